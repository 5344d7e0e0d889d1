//! Controllers of the arm: measured values in, torque out.
//!
//! | controller | what it knows | source |
//! |---|---|---|
//! | [`Feedforward`] | a model for the torque of the reference; PD at the motors | De Luca 2000 |
//! | [`Linearising`] | a model; linear error dynamics of the links by feedback linearisation | Spong 1987 |
//! | [`Lqg`] | a model, linearised; the motors' encoders | Anderson & Moore 1990 |
//! | [`DirectAdaptive`] | the rigid part of a model | Ulrich, Sasiadek & Barkana 2012 |
//! | [`Composite`] | the same, to compare with | Slotine & Li 1989 |
//! | [`Fuzzy`] | scales of errors and torques | Mamdani; Takagi & Sugeno 1985 |
//! | [`LinearSystem`] | its matrices | |

mod adaptive;
mod composite;
mod feedforward;
mod fuzzy;
mod linear_system;
mod linearising;
mod lqg;
#[cfg(test)]
mod tests;

pub use adaptive::{AdaptiveGains, DirectAdaptive};
pub use composite::{Composite, CompositeGains};
pub use feedforward::{Feedforward, Gains};
pub use fuzzy::{Fuzzy, FuzzyScales, Inference, infer, memberships};
pub use linear_system::LinearSystem;
pub use linearising::Linearising;
pub use lqg::{Lqg, Weights};
