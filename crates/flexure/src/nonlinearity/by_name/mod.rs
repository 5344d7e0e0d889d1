//! Every estimator by its name: what command lines, files and bindings choose at run time.
//!
//! [`EstimatorName`] says what there is and what each one's tuning parameter is called; [`NamedEstimator`] fits
//! any of them and tells, in one form for all, what was chosen from the data and by which score.

mod fit;
mod kernels;
mod recursive;
mod rule;

use std::fmt;

use super::estimator::Regression;
use super::{Kernel, KernelFit, LocalWindow, Outside};
use crate::error::Result;
use crate::text::number;

pub use rule::Rule;

/// The most columns of the estimators that take several.
const MOST_COLUMNS: usize = 6;

/// An estimator of m(x) = E(Y | X = x), by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum EstimatorName {
    /// The kernel estimate, a constant fitted around every point (Nadaraya 1964, Watson 1964).
    Kernel,
    /// The kernel estimate, a line fitted around every point (Fan 1993).
    #[default]
    LocalLinear,
    /// The local line with a bandwidth, and a side, of its own at every point (Lepski 1990).
    LocalBandwidth,
    /// The mean over the nearest neighbours (Stone 1977).
    Neighbours,
    /// The Fourier series, by least squares.
    Fourier,
    /// The cosine series, by least squares.
    Cosine,
    /// The Legendre series, by least squares.
    Legendre,
    /// The Hermite series, by least squares.
    Hermite,
    /// The Haar series: means over dyadic cells.
    Haar,
    /// A polynomial, by least squares.
    Polynomial,
    /// The penalised cubic spline.
    Spline,
    /// A neural network with one hidden layer.
    Network,
    /// The recursive kernel estimate (Wolverton and Wagner 1969): the order of the points counts.
    Recursive,
}

impl EstimatorName {
    /// All estimators.
    pub const ALL: [EstimatorName; 13] = [
        EstimatorName::Kernel,
        EstimatorName::LocalLinear,
        EstimatorName::LocalBandwidth,
        EstimatorName::Neighbours,
        EstimatorName::Fourier,
        EstimatorName::Cosine,
        EstimatorName::Legendre,
        EstimatorName::Hermite,
        EstimatorName::Haar,
        EstimatorName::Polynomial,
        EstimatorName::Spline,
        EstimatorName::Network,
        EstimatorName::Recursive,
    ];

    /// The name in lower case, as it is written in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            EstimatorName::Kernel => "kernel",
            EstimatorName::LocalLinear => "local-linear",
            EstimatorName::LocalBandwidth => "local-bandwidth",
            EstimatorName::Neighbours => "knn",
            EstimatorName::Fourier => "fourier",
            EstimatorName::Cosine => "cosine",
            EstimatorName::Legendre => "legendre",
            EstimatorName::Hermite => "hermite",
            EstimatorName::Haar => "haar",
            EstimatorName::Polynomial => "polynomial",
            EstimatorName::Spline => "spline",
            EstimatorName::Network => "network",
            EstimatorName::Recursive => "recursive",
        }
    }

    /// The estimator of this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// What it is, in words that fit into a sentence.
    pub fn title(self) -> &'static str {
        match self {
            EstimatorName::Kernel => "kernel regression",
            EstimatorName::LocalLinear => "local linear regression",
            EstimatorName::LocalBandwidth => "local linear regression with local bandwidths",
            EstimatorName::Neighbours => "nearest-neighbour regression",
            EstimatorName::Fourier => "Fourier series",
            EstimatorName::Cosine => "cosine series",
            EstimatorName::Legendre => "Legendre series",
            EstimatorName::Hermite => "Hermite series",
            EstimatorName::Haar => "Haar series",
            EstimatorName::Polynomial => "polynomial",
            EstimatorName::Spline => "penalised cubic spline",
            EstimatorName::Network => "neural network",
            EstimatorName::Recursive => "recursive kernel regression",
        }
    }

    /// What its tuning parameter is called.
    pub fn parameter(self) -> &'static str {
        match self {
            EstimatorName::Kernel | EstimatorName::LocalLinear => "bandwidth",
            EstimatorName::LocalBandwidth => "global bandwidth",
            EstimatorName::Recursive => "first bandwidth",
            EstimatorName::Neighbours => "neighbours",
            EstimatorName::Fourier | EstimatorName::Cosine | EstimatorName::Legendre | EstimatorName::Hermite => {
                "terms"
            }
            EstimatorName::Haar => "levels",
            EstimatorName::Polynomial => "degree",
            EstimatorName::Spline => "penalty",
            EstimatorName::Network => "units",
        }
    }

    /// Whether the parameter can be given; the local bandwidths are always chosen from the data.
    pub fn takes_parameter(self) -> bool {
        self != EstimatorName::LocalBandwidth
    }

    /// Whether the parameter is a whole number.
    pub fn counts(self) -> bool {
        !self.has_bandwidth() && self != EstimatorName::Spline
    }

    /// Whether it has a kernel, and its parameter is a bandwidth in the unit of x.
    pub fn has_bandwidth(self) -> bool {
        matches!(
            self,
            EstimatorName::Kernel
                | EstimatorName::LocalLinear
                | EstimatorName::LocalBandwidth
                | EstimatorName::Recursive
        )
    }

    /// The most columns of x that it takes.
    pub fn most_columns(self) -> usize {
        match self {
            EstimatorName::Kernel | EstimatorName::LocalLinear | EstimatorName::Neighbours | EstimatorName::Network => {
                MOST_COLUMNS
            }
            _ => 1,
        }
    }
}

impl fmt::Display for EstimatorName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

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

/// An estimator that was chosen by name, with everything that can be said of all of them.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `name` | the estimator | | local linear |
/// | `tuning` | its parameter, see [`EstimatorName::parameter`] | that of the estimator | by leave-one-out |
/// | `kernel` | the weight function, where it has one | | Epanechnikov |
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
    /// The weight function of those that have one.
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
    /// The estimator: that of the method, but for local bandwidths that do not predict clearly better than one, where
    /// it is [`EstimatorName::LocalLinear`].
    pub name: EstimatorName,
    /// The fitted regression.
    pub regression: Box<dyn Regression>,
    /// The parameter, given or chosen: one value, or one bandwidth a column.
    pub parameter: Vec<f64>,
    /// The scores of all values that were tried, where the parameter was chosen from the data.
    pub scores: Option<Scores>,
    /// The mean squared leave-one-out error at this parameter, in the squared unit of y, where it is known.
    pub left_out: Option<f64>,
    /// Local bandwidths, where they were used.
    pub local: Option<Box<LocalBandwidths>>,
}

impl NamedFit {
    /// The kernel estimate with one bandwidth for which robust bands are made: the regression itself, or, beside local
    /// bandwidths, the local line with the best single one.
    pub fn one_bandwidth(&self) -> Option<&KernelFit> {
        let beside = self.local.as_ref().map(|local| &local.line);
        beside.or_else(|| self.regression.kernel_fit())
    }
}

/// What is known of local bandwidths.
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
    /// The score in words, for example "leave-one-out error".
    pub criterion: &'static str,
    /// The values, increasing; of several bandwidths their geometric mean.
    pub parameter: Vec<f64>,
    /// Their scores, in the squared unit of y; smaller is better, infinite where the fit is not determined.
    pub score: Vec<f64>,
    /// Whether the best is the first or the last one tried where more could have been tried.
    pub at_edge: bool,
    /// Where the scores come from data in bins, as with very many points: the largest relative difference to the exact
    /// scores around the best. The best itself is then chosen among exact ones.
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
        fit::fit(self, x, y, weights)
    }

    /// The estimator of a fit with its parameter, for refits to parts of the data; one whose parameter cannot be given stays as
    /// it is.
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
