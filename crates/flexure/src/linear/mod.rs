//! Linear, time-invariant, discrete-time systems.

mod transfer_function;

pub use transfer_function::TransferFunction;
