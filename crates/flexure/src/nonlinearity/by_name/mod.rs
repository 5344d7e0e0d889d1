//! Every estimator by its name, for choices at run time by command lines, files and bindings.
//!
//! [`EstimatorName`] lists the estimators with the names of their tuning parameters. [`NamedEstimator`] fits any of them and reports, in
//! one form for all, what was chosen from the data and by which score.

mod estimators;
mod kernels;
mod recursive;
mod rule;
mod shared;

use super::estimator::Regression;
use super::{Kernel, KernelFit, LocalWindow, Outside};
use crate::error::Result;
use crate::text::number;

pub use estimators::EstimatorName;
pub use rule::Rule;

/// The tuning parameter: given, or chosen from the data.
#[derive(Debug, Clone, PartialEq)]
pub enum Tuning {
    /// This value; a bandwidth may be given for every column.
    Fixed(Vec<f64>),
    /// The value with the smallest score.
    FromData(Rule),
}

impl Default for Tuning {
    /// From the data, by leave-one-out.
    fn default() -> Self {
        Tuning::FromData(Rule::default())
    }
}

/// An estimator chosen by name, with the settings common to all.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `name` | the estimator | | local linear |
/// | `tuning` | its parameter, see [`EstimatorName::parameter`] | that of the estimator | by leave-one-out |
/// | `kernel` | the weight function, if it has one | | Epanechnikov |
/// | `outside` | the estimate beyond the data's range | | NaN |
/// | `seed` | of estimators and rules that draw random numbers | | 1 |
///
/// ```
/// use flexure::nonlinearity::{EstimatorName, NamedEstimator};
/// let x: Vec<f64> = (0..400).map(|i| i as f64 / 100.0 - 2.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x.tanh()).collect();
/// for name in EstimatorName::ALL {
///     let fit = NamedEstimator { name, ..Default::default() }.fit(&[&x], &y, None)?;
///     let error = fit.regression.predict(&[&[0.5]])?[0] - 0.5_f64.tanh();
///     assert!(error.abs() < 0.1, "{name} with {} = {:?}", name.parameter(), fit.parameter);
/// }
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct NamedEstimator {
    /// The estimator.
    pub name: EstimatorName,
    /// Its parameter.
    pub tuning: Tuning,
    /// The weight function of estimators that have one.
    pub kernel: Kernel,
    /// The estimate beyond the data's range.
    pub outside: Outside,
    /// The seed of estimators and rules that draw random numbers.
    pub seed: u64,
}

impl Default for NamedEstimator {
    fn default() -> Self {
        NamedEstimator {
            name: EstimatorName::default(),
            tuning: Tuning::default(),
            kernel: Kernel::default(),
            outside: Outside::default(),
            seed: 1,
        }
    }
}

/// What [`NamedEstimator::fit`] returns.
#[derive(Debug)]
pub struct NamedFit {
    /// The estimator: that of the method, or [`EstimatorName::LocalLinear`] if local bandwidths do not predict clearly better than one
    /// bandwidth.
    pub name: EstimatorName,
    /// The fitted regression.
    pub regression: Box<dyn Regression>,
    /// The parameter, given or chosen: one value, or one bandwidth a column.
    pub parameter: Vec<f64>,
    /// The scores of all tried values, if the parameter was chosen from the data.
    pub scores: Option<Scores>,
    /// The mean squared leave-one-out error at this parameter, in the squared unit of y, if known.
    pub left_out: Option<f64>,
    /// Local bandwidths, if they were used.
    pub local: Option<Box<LocalBandwidths>>,
}

impl NamedFit {
    /// The kernel estimate with one bandwidth, for robust bands: the regression itself or, with local bandwidths, the local line with the
    /// best single bandwidth.
    pub fn one_bandwidth(&self) -> Option<&KernelFit> {
        let beside = self.local.as_ref().map(|local| &local.line);
        beside.or_else(|| self.regression.kernel_fit())
    }
}

/// The results of local bandwidths.
#[derive(Debug)]
pub struct LocalBandwidths {
    /// The window at every node of the table, in order of x.
    pub windows: Vec<LocalWindow>,
    /// The abscissas of jumps, increasing.
    pub jumps: Vec<f64>,
    /// See [`LocalKernelFit::threshold`](super::LocalKernelFit::threshold).
    pub threshold: Option<f64>,
    /// See [`LocalKernelFit::prediction_error`](super::LocalKernelFit::prediction_error).
    pub prediction_error: Option<f64>,
    /// See [`LocalKernelFit::prediction_error_of_one`](super::LocalKernelFit::prediction_error_of_one).
    pub prediction_error_of_one: Option<f64>,
    /// The local line with one bandwidth for all points.
    pub line: KernelFit,
}

/// The scores of all values of a parameter that were tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// The name of the score, for example "leave-one-out error".
    pub criterion: &'static str,
    /// The values, increasing; for several bandwidths, their geometric mean.
    pub parameter: Vec<f64>,
    /// Their scores, in the squared unit of y; smaller is better, infinite where the fit is not determined.
    pub score: Vec<f64>,
    /// Whether the best is the first or the last tried one, although more could have been tried.
    pub at_edge: bool,
    /// If the scores come from binned data, as with very many points: the largest relative difference to the exact scores around the best.
    /// The best itself is then chosen by exact scores.
    pub binning_error: Option<f64>,
}

impl Scores {
    /// How the parameter with the smallest score was found, for reading.
    pub fn smallest(&self, criterion: &str) -> String {
        match self.binning_error {
            None => format!("smallest {criterion}"),
            Some(error) => format!(
                "smallest exact {criterion} among those around the best on data in bins, which is off by at most {} %",
                number(100.0 * error)
            ),
        }
    }
}

impl NamedEstimator {
    /// Fits the estimator to the points whose coordinates are the columns `x`, with the ordinates `y`.
    ///
    /// # Errors
    /// Those of the estimator's own [`Estimator::fit`](super::Estimator::fit),
    /// [`Error::Parameter`](crate::Error::Parameter) for a parameter that should be a whole number and
    /// is not, and [`Error::Parameter`](crate::Error::Parameter): `RuleUnsuited`.
    pub fn fit(&self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<NamedFit> {
        shared::check_rule(self, x.len())?;
        estimators::fit(self, shared::Observations { x, y, weights })
    }

    /// The estimator of a fit with its parameter, for refits to parts of the data; an estimator whose parameter cannot be given is
    /// unchanged.
    #[must_use]
    pub fn fixed(&self, fit: &NamedFit) -> NamedEstimator {
        let tuning = match fit.name.takes_parameter() {
            true => Tuning::Fixed(fit.parameter.clone()),
            false => self.tuning.clone(),
        };
        NamedEstimator {
            name: fit.name,
            tuning,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests;
