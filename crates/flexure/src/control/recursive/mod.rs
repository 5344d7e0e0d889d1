//! Models that learn from one sample after the other, in constant time and memory.
//!
//! | item | what | source |
//! |---|---|---|
//! | [`LeastSquares`] | recursive least squares in square-root form, with forgetting or a drift of the parameters (Kalman) | Bierman 1977; Ljung & Soderstrom 1983 |
//! | [`RecursiveArx`] | a linear system | |
//! | [`RecursiveHammerstein`] | a static nonlinearity, then a linear system: overparametrised, then split | Bai 1998 |
//! | [`RecursiveFriction`] | inertia, Coulomb and viscous friction of a joint | |
//! | [`Cusum`] | a change of a mean, with the delay and the false-alarm rate from theory | Page 1954; Siegmund 1985 |
//!
//! All have `push`, `to_bytes` and `from_bytes`. In a closed loop the input is correlated with past noise: an ARX model whose noise is white
//! at its output equation is still estimated without bias (Ljung 1999, System Identification, section 13.4), as its regressors hold only
//! the past; an output-error model is not. Either the loop's delay is at least one sample, or the model has no direct term.

mod arx;
mod checkpoint;
mod detection;
mod friction;
mod least_squares;
#[cfg(test)]
mod tests;

pub use arx::{HammersteinEstimate, RecursiveArx, RecursiveHammerstein};
pub use detection::Cusum;
pub use friction::RecursiveFriction;
pub use least_squares::{LeastSquares, Memory};
