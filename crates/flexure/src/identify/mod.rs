//! From a record to a model, with a verdict.

mod calibration;
mod checks;
mod dependence;
pub mod hammerstein;
mod impulse;
mod outcome;
mod sandwich;

pub use calibration::Calibration;
pub use hammerstein::{PlainHammerstein, RegressionLag};
pub use outcome::{ChosenOrder, Identification, OrderScore, Psi, Verdict, Warning};
pub use sandwich::{ApproximationScore, SandwichIdentification, Stage, TriedStructure, WienerHammerstein};
