//! Static (memoryless) nonlinearities: estimated from data, and as blocks of a model.

mod curve;

pub use curve::{Curve, Outside};
