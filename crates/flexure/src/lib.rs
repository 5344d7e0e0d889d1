//! Flexure simulates flexible-joint space manipulators and identifies, from input-output
//! records, the nonlinear blocks inside them.
//!
//! # Map
//!
//! | module | what |
//! |---|---|
//! | [`record`] | named, sampled signals |
//! | [`model`] | static nonlinearities and linear systems in series and in parallel |
//! | [`linear`] | transfer functions |
//! | [`signal`] | excitation signals |
//! | [`simulation`] | the integrator, zero-order hold, batches |
//! | [`manipulator`] | the two-link arm: rigid, and with linear or nonlinear flexible joints |
//! | [`error`] | everything that can go wrong, with the facts in the fields |

pub mod error;
pub mod linear;
pub mod manipulator;
pub mod model;
pub mod nonlinearity;
pub mod record;
pub mod signal;
pub mod simulation;

pub(crate) mod linalg;

pub use error::{Error, Result};
pub use model::Block;
pub use record::Record;
