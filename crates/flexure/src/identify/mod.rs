//! From a record to a model, with a verdict.

mod calibration;
mod checks;
mod dependence;
pub mod hammerstein;
mod outcome;

pub use calibration::Calibration;
pub use hammerstein::{PlainHammerstein, RegressionLag};
pub use outcome::{ChosenOrder, Identification, OrderScore, Psi, Verdict, Warning};
