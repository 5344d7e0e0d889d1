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
//! | [`NearestNeighbours`] | 1 to 6 | neighbours k | 1 to the total weight | leave-one-out | Stone (1977) |
//! | [`SeriesRegression`], [`Basis::Fourier`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (2008) |
//! | [`SeriesRegression`], [`Basis::Cosine`] | 1 | terms | 1 to 256 | leave-one-out | Eubank (1999) |
//! | [`SeriesRegression`], [`Basis::Legendre`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (1985) |
//! | [`SeriesRegression`], [`Basis::Hermite`] | 1 | terms | 1 to 256 | leave-one-out | Greblicki and Pawlak (1985) |
//! | [`HaarRegression`] | 1 | levels | 0 to 20 | leave-one-out | Greblicki and Pawlak (2008) |
//! | [`PolynomialRegression`] | 1 | degree | 0 to 64 | leave-one-out | Forsythe (1957) |
//! | [`SplineRegression`] | 1 | penalty | zero or positive | leave-one-out | O'Sullivan (1986) |

mod curve;
mod estimator;
mod functions;
mod haar;
pub(crate) mod kernel;
mod least_squares;
mod neighbours;
mod polynomial;
mod series;
pub(crate) mod spline;
mod tabulate;

pub use curve::{Curve, Outside};
pub use estimator::{Choice, Estimator, Regression};
pub use haar::{HaarFit, HaarRegression};
pub use kernel::{Degree, Kernel, KernelFit, KernelRegression, RecursiveForm, RecursiveKernel, RecursiveSums};
pub use neighbours::{NearestNeighbours, NeighboursFit};
pub use polynomial::PolynomialRegression;
pub use series::{Basis, SeriesFit, SeriesRegression};
pub use spline::{SplineFit, SplineRegression};
pub(crate) use tabulate::tabulate;
