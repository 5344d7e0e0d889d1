//! The samples of one record, checked, and what is made of them before and after every fit by simulation error.

use super::checks::{must_vary, warn_of_levels};
use super::outcome::{Verdict, Warning};
use super::sandwich::{Monitor, Prepared};
use crate::error::{Error, Result};
use crate::model::Block;
use crate::record::Record;
use crate::validation::Estimated;

/// The fewest samples that are worth a fit.
const FEWEST: usize = 200;

/// Input and output, the last part of them kept for the verdict.
pub(super) struct Samples<'a> {
    pub u: &'a [f64],
    pub y: &'a [f64],
    /// Samples before this are fitted.
    pub fitted: usize,
}

impl<'a> Samples<'a> {
    /// Checks the columns; `what` names the fit in the error about too few samples.
    ///
    /// # Errors
    /// [`Error::MissingColumn`], [`Error::NonFinite`], [`Error::Constant`], [`Error::ConstantPart`], [`Error::TooShort`] (fewer
    /// than 200 samples for the fit), [`Error::Unit`], [`Error::InvalidParameter`] for a share outside 0.05 to 0.9.
    pub fn new(
        record: &'a Record,
        input: &str,
        output: &str,
        fresh_share: f64,
        what: &'static str,
    ) -> Result<Samples<'a>> {
        if !(0.05..=0.9).contains(&fresh_share) {
            return Err(Error::InvalidParameter {
                name: "the fresh share".to_owned(),
                value: fresh_share,
                requirement: "between 0.05 and 0.9",
            });
        }
        let (u, y) = (record.finite(input)?, record.finite(output)?);
        let fitted = u.len() - (fresh_share * u.len() as f64).round() as usize;
        if fitted < FEWEST {
            return Err(Error::TooShort {
                what,
                need: FEWEST,
                got: fitted,
            });
        }
        for (column, samples) in [(input, u), (output, y)] {
            must_vary(column, samples, 0..fitted, "used for the fit")?;
            must_vary(column, samples, fitted..samples.len(), "kept for the verdict")?;
        }
        Ok(Samples { u, y, fitted })
    }

    /// The fitted part with its linear approximations.
    pub fn prepared(&self, monitor: &mut Monitor<'_>) -> Prepared {
        Prepared::new(&self.u[..self.fitted], &self.y[..self.fitted], monitor)
    }

    /// The fitted part, the input delayed by so many samples, without linear approximations.
    pub fn prepared_with_delay(&self, delay: usize) -> Prepared {
        Prepared::with_delay(&self.u[..self.fitted], &self.y[..self.fitted], delay)
    }

    /// The free run over all samples of a model of so many parameters, the verdict on the fresh ones, and what the user should
    /// know.
    pub fn judged(&self, model: &Block, parameters: usize) -> Result<(Vec<f64>, Verdict, Vec<Warning>)> {
        let mut warnings = Vec::new();
        warn_of_levels(&self.u[..self.fitted], &mut warnings);
        let predicted = model.simulate(self.u);
        let fresh = self.fitted..;
        let estimated = Estimated {
            parameters,
            samples: self.fitted,
        };
        let (u, y) = (&self.u[fresh.clone()], &self.y[fresh.clone()]);
        let verdict = Verdict::of_estimate(u, y, &predicted[fresh], estimated)?;
        if verdict.measures.fit_percent <= 0.0 {
            warnings.push(Warning::Useless {
                fit_percent: verdict.measures.fit_percent,
            });
        }
        Ok((predicted, verdict, warnings))
    }
}
