//! The columns of a record, checked and scaled, and branches back in the record's units.

use super::super::checks::must_vary;
use super::super::sandwich::{Shape, conventional_gain};
use super::system::{Branch, Signals};
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::linear::correlation::{mean, variance};
use crate::nonlinearity::{Curve, Outside};
use crate::record::Record;

/// The fewest samples that are worth a fit.
const FEWEST: usize = 200;
/// At most so many samples, the last ones, are fitted; more would only cost memory.
const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
const FIRST_LEFT_OUT: usize = 500;
/// Evenly spaced points of a tabulated nonlinearity.
const POINTS: usize = 2001;

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Scale {
    pub mean: f64,
    pub spread: f64,
}

impl Scale {
    fn new(v: &[f64]) -> Scale {
        Scale {
            mean: mean(v),
            spread: variance(v).sqrt(),
        }
    }

    fn apply(&self, v: &[f64]) -> Vec<f64> {
        v.iter().map(|x| (x - self.mean) / self.spread).collect()
    }

    /// From scaled to the record's unit.
    pub fn back(&self, x: f64) -> f64 {
        self.mean + self.spread * x
    }
}

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
        if !(0.05..=0.9).contains(&fresh_share) {
            return Err(Error::InvalidParameter {
                name: "the fresh share".to_owned(),
                value: fresh_share,
                requirement: "between 0.05 and 0.9",
            });
        }
        let u: Vec<&[f64]> = inputs.iter().map(|i| record.finite(i)).collect::<Result<_>>()?;
        let y = record.finite(output)?;
        let fitted = y.len() - (fresh_share * y.len() as f64).round() as usize;
        let need = FEWEST * inputs.len().max(1);
        if fitted < need {
            return Err(Error::TooShort {
                what,
                need,
                got: fitted,
            });
        }
        let named = inputs.iter().copied().zip(u.iter().copied());
        for (column, samples) in named.chain([(output, y)]) {
            must_vary(column, samples, 0..fitted, "used for the fit")?;
            must_vary(column, samples, fitted..samples.len(), "kept for the verdict")?;
        }
        Ok(Columns {
            inputs: u.iter().map(|u| Scale::new(&u[..fitted])).collect(),
            output: Scale::new(&y[..fitted]),
            u,
            y,
            fitted,
        })
    }

    /// What is fitted, at zero mean and unit variance.
    pub fn signals(&self) -> Signals {
        let part = self.fitted.saturating_sub(MOST_SAMPLES)..self.fitted;
        let inputs = self.u.iter().zip(&self.inputs);
        Signals {
            u: inputs.map(|(u, scale)| scale.apply(&u[part.clone()])).collect(),
            y: self.output.apply(&self.y[part.clone()]),
            from: (part.len() / 10).min(FIRST_LEFT_OUT),
            dependence: 1.0,
        }
    }
}

/// A branch's linear part in the conventional scale, and what it was divided by.
pub(in crate::identify) fn normalised(branch: &Branch) -> Result<(TransferFunction, f64)> {
    let (gain, _) = conventional_gain(&branch.linear, branch.delay)?;
    let mut linear = branch.linear.clone();
    linear.b.iter_mut().for_each(|b| *b /= gain);
    Ok((linear.transfer_function(branch.delay)?, gain))
}

/// A nonlinearity as a table, straight on beyond its ends, and its breakpoints; both functions are applied to the shape's own
/// coordinates.
pub(in crate::identify) fn tabulated(
    shape: &Shape,
    abscissa: impl Fn(f64) -> f64,
    ordinate: impl Fn(f64) -> f64,
) -> Result<(Curve, Vec<f64>)> {
    let breakpoints = shape.breakpoints();
    let (low, high) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let even = (0..POINTS).map(|i| low + (high - low) * i as f64 / (POINTS - 1) as f64);
    let all = even.chain(breakpoints.iter().copied());
    let mut points: Vec<(f64, f64)> = all.map(|x| (abscissa(x), ordinate(shape.value(x)))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.dedup_by(|b, a| b.0 <= a.0);
    let (x, y) = points.into_iter().unzip();
    let mut breakpoints: Vec<f64> = breakpoints.iter().map(|x| abscissa(*x)).collect();
    breakpoints.sort_unstable_by(f64::total_cmp);
    Ok((Curve::new(x, y, Outside::Linear)?, breakpoints))
}
