//! The estimators that have a name: their names, parameters and fits.

use std::fmt;

use super::shared::{Observations, Shown, count, number, tuned};
use super::{NamedEstimator, NamedFit, Rule, kernels, recursive};
use crate::error::Result;
use crate::nonlinearity::estimator::{Choice, MOST_COLUMNS};
use crate::nonlinearity::kernel::Degree;
use crate::nonlinearity::{
    Basis, Decay, HaarFit, HaarRegression, NearestNeighbours, NeighboursFit, NetworkFit, NetworkRegression,
    PolynomialRegression, SeriesFit, SeriesRegression, SplineFit, SplineRegression,
};

/// An estimator of m(x) = E(Y | X = x), by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum EstimatorName {
    /// The kernel estimate, a constant fitted around every point (Nadaraya 1964, Watson 1964).
    Kernel,
    /// The kernel estimate, a line fitted around every point (Fan 1993).
    #[default]
    LocalLinear,
    /// The local line with a separate bandwidth, and a side, at every point (Lepski 1990).
    LocalBandwidth,
    /// The mean over the nearest neighbours (Stone 1977).
    Neighbours,
    /// A series of these functions, by least squares.
    Series(Basis),
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
        EstimatorName::Series(Basis::Fourier),
        EstimatorName::Series(Basis::Cosine),
        EstimatorName::Series(Basis::Legendre),
        EstimatorName::Series(Basis::Hermite),
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
            EstimatorName::Series(basis) => basis.name(),
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

    /// Its description within a sentence.
    pub fn title(self) -> &'static str {
        match self {
            EstimatorName::Kernel => "kernel regression",
            EstimatorName::LocalLinear => "local linear regression",
            EstimatorName::LocalBandwidth => "local linear regression with local bandwidths",
            EstimatorName::Neighbours => "nearest-neighbour regression",
            EstimatorName::Series(basis) => basis.title(),
            EstimatorName::Haar => "Haar series",
            EstimatorName::Polynomial => "polynomial",
            EstimatorName::Spline => "penalised cubic spline",
            EstimatorName::Network => "neural network",
            EstimatorName::Recursive => "recursive kernel regression",
        }
    }

    /// The name of its tuning parameter.
    pub fn parameter(self) -> &'static str {
        match self {
            EstimatorName::Kernel | EstimatorName::LocalLinear => "bandwidth",
            EstimatorName::LocalBandwidth => "global bandwidth",
            EstimatorName::Recursive => "first bandwidth",
            EstimatorName::Neighbours => "neighbours",
            EstimatorName::Series(_) => "terms",
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

impl Rule {
    /// Whether it can choose the parameter of this estimator with this number of columns.
    ///
    /// The plug-in rule is made for the local line: the bias of a local constant has another formula, with the slopes of m and of the
    /// density, and another order at the ends of the data.
    pub fn suits(self, estimator: EstimatorName, columns: usize) -> bool {
        use EstimatorName::{LocalBandwidth, LocalLinear};
        match (self, estimator) {
            (Rule::LeaveOneOut, _) => true,
            (Rule::PlugIn, _) => matches!(estimator, LocalLinear | LocalBandwidth) && columns == 1,
            (_, LocalBandwidth) => false,
            (Rule::Generalized | Rule::Block, _) => true,
            (Rule::Bootstrap | Rule::BlockBootstrap { .. }, _) => estimator.has_bandwidth() && columns == 1,
        }
    }
}

impl fmt::Display for EstimatorName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Fits the estimator that `method` names.
pub(super) fn fit(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    match method.name {
        EstimatorName::Kernel => kernels::fit(method, Degree::Constant, data),
        EstimatorName::LocalLinear => kernels::fit(method, Degree::Linear, data),
        EstimatorName::LocalBandwidth => kernels::local_bandwidth(method, data),
        EstimatorName::Recursive => recursive::fit(method, data),
        EstimatorName::Neighbours => neighbours(method, data),
        EstimatorName::Series(basis) => series(method, basis, data),
        EstimatorName::Haar => haar(method, data),
        EstimatorName::Polynomial => polynomial(method, data),
        EstimatorName::Spline => spline(method, data),
        EstimatorName::Network => network(method, data),
    }
}

fn neighbours(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    let make = |neighbours| NearestNeighbours {
        neighbours,
        outside: method.outside,
    };
    let shown = Shown {
        value: |fit: &NeighboursFit| fit.neighbours() as f64,
        search: NeighboursFit::search,
        candidate: |k| k as f64,
    };
    tuned(method, data, count(method)?, make, &shown)
}

fn series(method: &NamedEstimator, basis: Basis, data: Observations) -> Result<NamedFit> {
    let make = |terms| SeriesRegression {
        basis,
        terms,
        outside: method.outside,
    };
    let shown = Shown {
        value: |fit: &SeriesFit| fit.terms() as f64,
        search: SeriesFit::search,
        candidate: |k| k as f64,
    };
    tuned(method, data, count(method)?, make, &shown)
}

fn polynomial(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    // Searches count terms; there is one more than the degree.
    let terms = match count(method)? {
        Choice::Fixed(degree) => Choice::Fixed(degree + 1),
        Choice::FromData(criterion) => Choice::FromData(criterion),
    };
    let make = |terms| PolynomialRegression {
        degree: match terms {
            Choice::Fixed(terms) => Choice::Fixed(usize::saturating_sub(terms, 1)),
            Choice::FromData(criterion) => Choice::FromData(criterion),
        },
        outside: method.outside,
    };
    let shown = Shown {
        value: |fit: &SeriesFit| fit.terms() as f64 - 1.0,
        search: SeriesFit::search,
        candidate: |terms| terms as f64 - 1.0,
    };
    tuned(method, data, terms, make, &shown)
}

fn haar(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    let make = |levels| HaarRegression {
        levels,
        outside: method.outside,
    };
    let shown = Shown {
        value: |fit: &HaarFit| fit.levels() as f64,
        search: HaarFit::search,
        candidate: |k| k as f64,
    };
    tuned(method, data, count(method)?, make, &shown)
}

fn spline(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    let make = |penalty| SplineRegression {
        penalty,
        outside: method.outside,
        ..SplineRegression::default()
    };
    let shown = Shown {
        value: SplineFit::penalty,
        search: SplineFit::search,
        candidate: |p| p,
    };
    tuned(method, data, number(method)?, make, &shown)
}

fn network(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    let make = |units| NetworkRegression {
        units,
        decay: Decay::default(),
        seed: method.seed,
        outside: method.outside,
        ..NetworkRegression::default()
    };
    let shown = Shown {
        value: |fit: &NetworkFit| fit.units() as f64,
        search: NetworkFit::search,
        candidate: |k| k as f64,
    };
    tuned(method, data, count(method)?, make, &shown)
}
