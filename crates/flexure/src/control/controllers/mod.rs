//! Controllers of the arm: measured values in, torque out.
//!
//! | controller | what it knows | source |
//! |---|---|---|
//! | [`Feedforward`] | a model for the torque of the reference; PD at the motors | De Luca 2000 |
//! | [`Linearising`] | a model; linear error dynamics of the links by feedback linearisation | Spong 1987 |

mod feedforward;
mod linearising;

pub use feedforward::{Feedforward, Gains};
pub use linearising::Linearising;
