//! From a record to a model, with a verdict.
//!
//! [`PlainHammerstein`] is the paper's algorithm as it stands; [`RefinedHammerstein`] starts from it and comes near the
//! accuracy of an estimator that knows the linear part.
//!
//! [`HammersteinWiener`] has a nonlinearity at either end, [`MultipleInputs`] a Hammerstein branch for every input; [`Narx`] and
//! [`Volterra`] are references without blocks.

mod branches;
mod calibration;
mod checks;
mod dependence;
pub mod hammerstein;
mod hammerstein_wiener;
mod impulse;
pub mod joint;
mod multiple_inputs;
mod outcome;
mod reference;
mod refined;
mod sandwich;

pub use branches::TriedBranches;
pub use calibration::Calibration;
pub use hammerstein::{PlainHammerstein, RegressionLag};
pub use hammerstein_wiener::{HammersteinWiener, HammersteinWienerIdentification};
pub use multiple_inputs::{InputBranch, MultipleInputs, MultipleInputsIdentification, MultipleInputsModel};
pub use outcome::{ChosenOrder, Identification, OrderScore, Psi, Verdict, Warning};
pub use reference::{
    DecayPrior, Narx, NarxIdentification, NarxModel, NarxTerm, TriedNarx, Volterra, VolterraIdentification,
    VolterraModel,
};
pub use refined::{
    Breakpoint, BreakpointKind, CoefficientErrors, Form, FormFit, FormParameter, MemoryRemoved, RefinedHammerstein,
    RefinedIdentification,
};
pub use sandwich::{ApproximationScore, Intersample, SandwichIdentification, Stage, TriedStructure, WienerHammerstein};
