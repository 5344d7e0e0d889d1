//! Static (memoryless) nonlinearities: estimated from data, and as blocks of a model.

mod curve;
pub(crate) mod kernel;
mod tabulate;

pub use curve::{Curve, Outside};
pub use kernel::{Degree, Kernel, KernelFit, KernelRegression, RecursiveForm, RecursiveKernel, RecursiveSums};
pub(crate) use tabulate::tabulate;
