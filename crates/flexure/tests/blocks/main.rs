//! Hammerstein-Wiener systems, systems of several inputs, and the unstructured references, through the public API.

mod common;
mod hammerstein_wiener;
mod multiple_inputs;
mod parallel;
mod reference;
