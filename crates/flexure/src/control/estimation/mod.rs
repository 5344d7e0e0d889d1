//! The state of the arm from the motors' encoders alone: Kalman filters and their consistency.
//!
//! | item | what | source |
//! |---|---|---|
//! | [`KalmanFilter::extended`] | linearised at every step | Bar-Shalom, Li & Kirubarajan 2001, section 10.3 |
//! | [`KalmanFilter::unscented`] | through sigma points | Wan & van der Merwe 2000; Arasaratnam & Haykin 2009 |
//! | [`Adaptation`] | the process noise by fuzzy rules on the innovations | Sasiadek & Wang 1999; Green & Sasiadek |
//! | [`Consistency`] | whether errors and innovations are as large as the filter says | Bar-Shalom, Li & Kirubarajan, section 5.4 |

mod consistency;
mod fuzzy;
mod kalman;
mod matrix;
mod prediction;
#[cfg(test)]
mod tests;

pub use consistency::{Consistency, Share};
pub use fuzzy::Adaptation;
pub use kalman::{KalmanFilter, NoiseModel};
