//! The recursive kernel estimate as a regression over recorded points, in the order in which they came.

use super::super::estimator::{Points, Regression, check_queries};
use super::super::{Curve, Kernel, Outside, RecursiveForm, RecursiveKernel};
use super::{NamedEstimator, Rule};
use crate::error::Result;
use crate::nonlinearity::kernel::Degree;
use crate::selection::choose_bandwidth;

/// The exponent of the bandwidths c (i + 1)^-gamma: that of the best rate for a smooth m.
const EXPONENT: f64 = 0.2;
/// Evenly spaced points at which the estimate is kept.
const POINTS: usize = 1001;

/// The estimate over the data's range, kept at evenly spaced points and straight between them.
#[derive(Debug)]
pub struct RecursiveFit(Curve);

impl RecursiveFit {
    /// One pass over the points in the order given, with the first bandwidth `bandwidth`.
    pub fn new(kernel: Kernel, bandwidth: f64, x: &[f64], y: &[f64], outside: Outside) -> Result<Self> {
        // Checked as for every other estimator; their order is that of the caller, though.
        let points = Points::new("a recursive kernel regression", 1, &[x], y, None)?;
        let (low, high) = points.range(0);
        let last = POINTS - 1;
        let mut at: Vec<f64> = (0..=last)
            .map(|i| low + (high - low) * (i as f64 / last as f64))
            .collect();
        at[last] = high;
        at.dedup();
        let method = RecursiveKernel {
            kernel,
            form: RecursiveForm::default(),
            bandwidth,
            exponent: EXPONENT,
        };
        let mut sums = method.start(&at)?;
        for (&x, &y) in x.iter().zip(y) {
            sums.push(x, y)?;
        }
        let known = at.into_iter().zip(sums.finish()).filter(|(_, m)| m.is_finite());
        let (at, estimates) = known.unzip();
        Ok(RecursiveFit(Curve::new(at, estimates, outside)?))
    }

    /// The first bandwidth c at which the mean square of all the bandwidths c (i + 1)^-gamma, which the bias is
    /// proportional to, is the square of that which `rule` finds for the estimate that is not recursive.
    pub fn bandwidth(rule: Rule, method: &NamedEstimator, x: &[f64], y: &[f64]) -> Result<f64> {
        let rule = rule.for_bandwidth();
        let choice = choose_bandwidth(rule, method.kernel, Degree::Constant, x, y, None)?;
        let squares: f64 = (1..=x.len()).map(|i| (i as f64).powf(-2.0 * EXPONENT)).sum();
        Ok(choice.bandwidth() / (squares / x.len() as f64).sqrt())
    }
}

impl Regression for RecursiveFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        Ok(check_queries(x, 1)?[0].iter().map(|&x| self.0.value(x)).collect())
    }
}
