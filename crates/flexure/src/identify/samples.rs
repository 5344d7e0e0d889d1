//! The checked samples of one record, and the common steps before and after every fit by simulation error.

use super::block::Prepared;
use super::checks::{both_vary, fresh_part, warn_if_useless, warn_of_levels};
use super::outcome::Verdict;
use super::warning::Warning;
use crate::error::{DataError, Error, Result};
use crate::record::Record;
use crate::validation::Estimated;

/// Inputs and output, the last part of them kept for the verdict.
pub(super) struct Samples<'a> {
    pub u: Vec<&'a [f64]>,
    pub y: &'a [f64],
    /// Samples before this are fitted.
    pub fitted: usize,
}

impl<'a> Samples<'a> {
    /// Checks the columns; `what` names the fit in the error about fewer fitted samples than `need`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort`, `Unit`, [`Error::Parameter`] for a share outside 0.05 to 0.9.
    pub fn new(
        record: &'a Record,
        inputs: &[&str],
        output: &str,
        fresh_share: f64,
        what: &'static str,
        need: usize,
    ) -> Result<Samples<'a>> {
        let fitted = fresh_part(fresh_share, record.len())?;
        let u: Vec<&[f64]> = inputs.iter().map(|i| record.finite(i)).collect::<Result<_>>()?;
        let y = record.finite(output)?;
        if fitted < need {
            return Err(Error::too_short(what, need, fitted));
        }
        let mut named: Vec<(&str, &[f64])> = inputs.iter().copied().zip(u.iter().copied()).collect();
        named.push((output, y));
        both_vary(&named, fitted)?;
        Ok(Samples { u, y, fitted })
    }

    /// The first input.
    pub fn input(&self) -> &'a [f64] {
        self.u.first().copied().unwrap_or_default()
    }

    /// The fitted part.
    pub fn prepared(&self) -> Prepared {
        let u: Vec<&[f64]> = self.u.iter().map(|u| &u[..self.fitted]).collect();
        Prepared::new(&u, &self.y[..self.fitted])
    }

    /// The verdicts on a free run over all samples, for a model whose number of parameters may be known: one verdict for each input and for
    /// each pair of inputs ([`Verdict::of_inputs`]).
    pub fn verdicts(&self, predicted: &[f64], parameters: Option<usize>) -> Result<Vec<Verdict>> {
        let fitted = self.fitted;
        let estimated = parameters.map(|parameters| Estimated {
            parameters,
            samples: fitted,
        });
        let fresh: Vec<&[f64]> = self.u.iter().map(|u| &u[fitted..]).collect();
        Verdict::of_inputs(&fresh, &self.y[fitted..], &predicted[fitted..], estimated)
    }

    /// The warnings about the samples and these verdicts.
    pub fn warnings(&self, verdicts: &[Verdict]) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let fitted = self.u.iter().map(|u| &u[..self.fitted]);
        fitted.for_each(|u| warn_of_levels(u, &mut warnings));
        verdicts.iter().take(1).for_each(|v| warn_if_useless(v, &mut warnings));
        warnings
    }
}

/// Refuses an input that is given twice.
pub(super) fn refuse_repeated(inputs: &[&str]) -> Result<()> {
    let twice = inputs.iter().enumerate().find(|(i, name)| inputs[..*i].contains(name));
    twice.map_or(Ok(()), |(_, name)| {
        Err(Error::Data(DataError::DuplicateColumn {
            name: (*name).to_owned(),
        }))
    })
}
