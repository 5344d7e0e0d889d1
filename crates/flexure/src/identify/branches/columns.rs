//! The columns of a record, checked and scaled, and branches back in the record's units.

use super::super::samples::Samples;
use super::super::sandwich::{Scale, Shape, conventional_gain, even, mapped, tabulated as table};
use super::system::{Branch, Signals};
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::nonlinearity::Curve;
use crate::record::Record;

/// At most so many samples, the last ones, are fitted; more would only cost memory.
const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
const FIRST_LEFT_OUT: usize = 500;

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
    /// [`Error::MissingColumn`], [`Error::NonFinite`], [`Error::Constant`], [`Error::ConstantPart`], [`Error::TooShort`],
    /// [`Error::Unit`], [`Error::InvalidParameter`] for a share outside 0.05 to 0.9.
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
        let from = (part.len() / 10).min(FIRST_LEFT_OUT);
        Signals::new(u, self.output.standardised(&self.y[part]), from)
    }
}

/// A branch's linear part in the conventional scale, and what it was divided by.
pub(in crate::identify) fn normalised(branch: &Branch) -> Result<(TransferFunction, f64)> {
    let (gain, _) = conventional_gain(&branch.linear, branch.delay)?;
    let mut linear = branch.linear.clone();
    linear.b.iter_mut().for_each(|b| *b /= gain);
    Ok((linear.transfer_function(branch.delay)?, gain))
}

/// A nonlinearity as a table, straight on beyond its ends, with its breakpoints and its kinks' places, both increasing.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Tabulated {
    pub curve: Curve,
    pub breakpoints: Vec<f64>,
    pub kinks: Vec<f64>,
}

/// A nonlinearity as a table; both functions are applied to the shape's own coordinates.
pub(in crate::identify) fn tabulated(
    shape: &Shape,
    abscissa: impl Fn(f64) -> f64,
    ordinate: impl Fn(f64) -> f64,
) -> Result<Tabulated> {
    let breakpoints: &[f64] = shape.breakpoints();
    let (low, high) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let kinks: Vec<f64> = shape.kinks.iter().map(|k| k.at).collect();
    let all = even(low, high).chain(breakpoints.iter().chain(&kinks).copied());
    let curve = table(all, &abscissa, |x| ordinate(shape.value(x)))?;
    Ok(Tabulated {
        curve,
        breakpoints: mapped(breakpoints, &abscissa),
        kinks: mapped(&kinks, abscissa),
    })
}
