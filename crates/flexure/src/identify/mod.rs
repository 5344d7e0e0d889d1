//! From a record to a model, with a verdict.

mod calibration;
mod checks;
mod dependence;
pub mod hammerstein;
mod impulse;
mod outcome;
pub mod refined;

pub use calibration::Calibration;
pub use hammerstein::{PlainHammerstein, RegressionLag};
pub use refined::RefinedHammerstein;
pub use outcome::{ChosenOrder, Identification, OrderScore, Psi, Verdict, Warning};
