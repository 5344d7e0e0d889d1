//! Static (memoryless) nonlinearities: estimated from data, and as blocks of a model.
//!
//! # Estimators of m(x) = E(Y | X = x)
//!
//! Every estimator is a struct of its parameters that implements [`Estimator`]; its fit implements
//! [`Regression`]. A parameter of type [`Choice`] is given, or chosen from the data by exact leave-one-out or
//! generalised cross-validation; the whole score curve is then part of the fit.
//!
//! | estimator | columns | parameter | valid range | default | reference |
//! |---|---|---|---|---|---|
//! | [`KernelRegression`] | 1 | bandwidth | positive | see [`crate::selection`] | Nadaraya (1964), Watson (1964) |
//! | [`KernelEstimator`] | 1 to 6 | bandwidths | positive | leave-one-out | Fan (1993), Ruppert and Wand (1994) |
//! | [`LocalKernel`] | 1 | bandwidth (and side), at every x | | Lepski's rule, or plug-in | Goldenshluger and Nemirovski (1997); Fan and Gijbels (1996) |
//! | [`RecursiveRegression`] | 1 | first bandwidth c | positive | leave-one-out | Wolverton and Wagner (1969) |
//! | [`NearestNeighbours`] | 1 to 6 | neighbours k | 1 to the total weight | leave-one-out | Stone (1977) |
//! | [`SeriesRegression`], [`Basis::Fourier`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (2008) |
//! | [`SeriesRegression`], [`Basis::Cosine`] | 1 | terms | 1 to 256 | leave-one-out | Eubank (1999) |
//! | [`SeriesRegression`], [`Basis::Legendre`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (1985) |
//! | [`SeriesRegression`], [`Basis::Hermite`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (1985) |
//! | [`HaarRegression`] | 1 | levels | 0 to 20 | leave-one-out | Greblicki and Pawlak (2008) |
//! | [`PolynomialRegression`] | 1 | degree | 0 to 64 | leave-one-out | Forsythe (1957) |
//! | [`SplineRegression`] | 1 | penalty | zero or positive | leave-one-out | O'Sullivan (1986) |
//! | [`NetworkRegression`] | 1 to 6 | units | 1 to 64 | leave-one-out, linearised | MacKay (1992) |
//!
//! [`NamedEstimator`] fits any of them by its [`EstimatorName`].

mod blocks;
mod by_name;
mod curve;
mod estimator;
mod functions;
mod haar;
pub(crate) mod kernel;
mod least_squares;
mod local;
mod neighbours;
mod network;
mod polynomial;
#[cfg(test)]
#[path = "estimator_tests/regressogram.rs"]
mod regressogram;
mod series;
pub(crate) mod spline;
mod surface;
mod tabulate;

pub use by_name::{EstimatorName, LocalBandwidths, NamedEstimator, NamedFit, Rule, Scores, Tuning};
pub use curve::{Curve, Outside};
pub(crate) use estimator::Points;
pub use estimator::{Choice, Estimator, Regression};
pub use haar::{HaarFit, HaarRegression};
pub use kernel::{
    Bandwidth, Degree, Kernel, KernelEstimate, KernelEstimator, KernelFit, KernelRegression, KernelScore, KernelSearch,
    RecursiveFit, RecursiveForm, RecursiveKernel, RecursiveRegression, RecursiveSums, StreamedBand, StreamedFit,
    StreamedRegression,
};
pub use local::{LocalKernel, LocalKernelFit, LocalRule, LocalWindow, Side};
pub use neighbours::{NearestNeighbours, NeighboursFit};
pub use network::{Decay, NetworkFit, NetworkRegression};
pub use polynomial::PolynomialRegression;
pub use series::{Basis, SeriesFit, SeriesRegression};
pub use spline::{SplineFit, SplineRegression};
pub(crate) use surface::products;
pub use surface::{Surface, SurfaceAxis};
pub(crate) use tabulate::{Tabulated, tabulate};
