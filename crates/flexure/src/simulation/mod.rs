//! A plant in time: the integrators, inputs held between samples, batches over all cores.
//!
//! | item | what |
//! |---|---|
//! | [`Dop853`] | an initial-value problem, integrated by the Dormand-Prince method of order 8 |
//! | [`Integration`], [`Integrator`] | the same by that method or, where the equations are stiff, by the implicit Radau IIA of order 13 |
//! | [`STAGES`], [`SOLUTION`] | the weights of that method, for an implementation in another language |
//! | [`Sampling`] | the uniform instants of a record |
//! | [`run_held`] | a plant whose input is held from each instant to the next (zero-order hold) |
//! | [`run_continuous`] | a plant whose input is a continuous function of time |
//! | [`batch`] | independent jobs over all cores, the results in order |

mod control;
mod dop853;
mod hold;
mod integration;
mod lanes;
mod radau;
mod radau_systems;
mod radau_tableau;
mod step;
mod tableau;
mod tolerances;

pub use crate::parallel::batch;
pub use dop853::{Dop853, StateVector, Statistics};
pub(crate) use hold::run_held_in_time;
pub use hold::{Sampling, run_continuous, run_held};
pub use integration::{Advance, Integration, Integrator};
pub(crate) use lanes::{HeldLane, run_held_lanes};
pub use tableau::{SOLUTION, STAGES};
pub use tolerances::Tolerances;
