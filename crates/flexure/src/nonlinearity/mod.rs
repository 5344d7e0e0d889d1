//! Static (memoryless) nonlinearities: estimated from data, and as blocks of a model.

mod curve;
pub(crate) mod kernel;

pub use curve::{Curve, Outside};
pub use kernel::{Kernel, KernelFit, KernelRegression};
