//! Linear, time-invariant, discrete-time systems.

pub(crate) mod autoregression;
mod best_linear;
pub(crate) mod correlation;
pub(crate) mod least_squares;
pub(crate) mod levenberg_marquardt;
mod transfer_function;

pub use crate::linalg::Complex;
pub use best_linear::{BestLinearApproximation, PeriodicSignals, period_of};
pub(crate) use transfer_function::Piece;
pub use transfer_function::TransferFunction;
