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
//! | [`study`] | convergence rates by Monte Carlo, beside the theorems' |
//! | [`error`] | everything that can go wrong, with the facts in the fields |

pub mod error;
pub mod identify;
pub mod linear;
pub mod model;
pub mod nonlinearity;
pub mod record;
pub mod selection;
pub mod study;
pub mod systems;
pub mod validation;

pub(crate) mod linalg;

pub use error::{Error, Result};
pub use model::Block;
pub use record::Record;
