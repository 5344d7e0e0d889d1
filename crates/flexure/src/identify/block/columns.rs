//! The columns of a record, checked and scaled.

use super::super::samples::Samples;
use super::limits::{MOST_SAMPLES, SETTLING_UNKNOWN};
use super::signals::Signals;
use super::units::Scale;
use crate::error::Result;
use crate::record::Record;

/// Inputs and output of a record, the last part of them kept for the verdict.
pub(in crate::identify) struct Columns<'a> {
    pub u: Vec<&'a [f64]>,
    pub y: &'a [f64],
    /// Samples before this are fitted.
    pub fitted: usize,
    pub inputs: Vec<Scale>,
    pub output: Scale,
}

impl<'a> Columns<'a> {
    /// Checks the columns; `what` names the fit in the error about too few samples.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort`,
    /// `Unit`, [`Error::Parameter`] for a share outside 0.05 to 0.9.
    pub fn new(
        record: &'a Record,
        inputs: &[&str],
        output: &str,
        fresh_share: f64,
        what: &'static str,
    ) -> Result<Columns<'a>> {
        let Samples { u, y, fitted } = Samples::of_inputs(record, inputs, output, fresh_share, what)?;
        Ok(Columns {
            inputs: u.iter().map(|u| Scale::new(&u[..fitted])).collect(),
            output: Scale::new(&y[..fitted]),
            u,
            y,
            fitted,
        })
    }

    /// The same columns without their scales.
    pub fn samples(&self) -> Samples<'a> {
        Samples {
            u: self.u.clone(),
            y: self.y,
            fitted: self.fitted,
        }
    }

    /// What is fitted, at zero mean and unit variance.
    pub fn signals(&self) -> Signals {
        let part = self.fitted.saturating_sub(MOST_SAMPLES)..self.fitted;
        let inputs = self.u.iter().zip(&self.inputs);
        let u = inputs.map(|(u, scale)| scale.standardised(&u[part.clone()])).collect();
        let from = (part.len() / 10).min(SETTLING_UNKNOWN);
        Signals::new(u, self.output.standardised(&self.y[part]), from)
    }
}
