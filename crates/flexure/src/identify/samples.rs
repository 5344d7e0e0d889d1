//! The checked samples of one record, and the common steps before and after every fit by simulation error.

use super::block::Prepared;
use super::checks::{both_vary, fresh_part, warn_if_useless, warn_of_levels};
use super::outcome::Verdict;
use super::request::Request;
use super::warning::Warning;
use crate::error::{DataError, Error, Result};
use crate::validation::Estimated;

/// Inputs and output, the last part of them kept for the verdict.
pub(super) struct Samples<'a> {
    pub u: Vec<&'a [f64]>,
    pub y: &'a [f64],
    /// Samples before this are fitted.
    pub fitted: usize,
    /// Where the record has outputs, if some are missing.
    pub present: Option<Vec<bool>>,
}

impl<'a> Samples<'a> {
    /// Checks the columns; `what` names the fit in the error about fewer fitted samples than `need`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort`, `Unit`, [`Error::Parameter`] for a share outside 0.05 to 0.9.
    pub fn new(request: &'a Request<'_>, what: &'static str, need: usize) -> Result<Samples<'a>> {
        let (record, inputs, output) = (request.record()?, request.inputs, request.output);
        let fitted = fresh_part(request.options.fresh_share, record.len())?;
        let u: Vec<&[f64]> = inputs.iter().map(|i| record.finite(i)).collect::<Result<_>>()?;
        let y = request.outputs()?;
        if fitted < need {
            return Err(Error::too_short(what, need, fitted));
        }
        let mut named: Vec<(&str, &[f64])> = inputs.iter().copied().zip(u.iter().copied()).collect();
        named.push((output, y));
        let samples = Samples {
            present: request.present()?,
            u,
            y,
            fitted,
        };
        if samples.fresh(y).is_empty() {
            return Err(Error::too_short("the fresh part (besides missing samples)", 1, 0));
        }
        both_vary(&named, fitted)?;
        Ok(samples)
    }

    /// The fresh part of a signal, without the samples whose output is missing.
    pub fn fresh(&self, signal: &[f64]) -> Vec<f64> {
        let fresh = &signal[self.fitted..];
        match &self.present {
            None => fresh.to_vec(),
            Some(present) => {
                let both = fresh.iter().zip(&present[self.fitted..]);
                both.filter(|(_, present)| **present).map(|(v, _)| *v).collect()
            }
        }
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
        let fresh: Vec<Vec<f64>> = self.u.iter().map(|u| self.fresh(u)).collect();
        let fresh: Vec<&[f64]> = fresh.iter().map(Vec::as_slice).collect();
        Verdict::of_inputs(&fresh, &self.fresh(self.y), &self.fresh(predicted), estimated)
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
