//! From a record to a model, with a verdict.
//!
//! [`PlainHammerstein`] is the paper's algorithm as it stands; [`RefinedHammerstein`] starts from it and comes near the
//! accuracy of an estimator that knows the linear part. [`Wiener`] and [`WienerHammerstein`] are the structures with linear
//! dynamics before the nonlinearity, [`Linear`] the reference that has none, and [`Auto`] finds out which of them the data support.
//! [`HammersteinWiener`] has a nonlinearity at either end, [`Parallel`] several branches for one input, [`MultipleInputs`] a
//! Hammerstein branch for every input, [`JointInputs`] one nonlinearity of all of them; [`Narx`] and [`Volterra`] are references without blocks.
//!
//! | structure | identification | even nonlinearity | coloured input | standard errors | missing outputs |
//! |---|---|---|---|---|---|
//! | linear | [`Linear`] | | yes | no | no |
//! | static, linear | [`PlainHammerstein`] | yes | deconvolved | band | no |
//! | static, linear | [`RefinedHammerstein`] | yes | yes | yes | yes |
//! | linear, static | [`Wiener`] | yes | yes | no | no |
//! | linear, static, linear | [`WienerHammerstein`] | no | yes | no | no |
//! | static, linear, static | [`HammersteinWiener`] | the first | yes | no | no |
//! | a sum of static, linear | [`Parallel`] | yes | yes | no | no |
//! | a sum of linear, static, linear | [`Parallel`] | beside others | yes | no | no |
//! | static, linear, of every input | [`MultipleInputs`] | yes | yes | no | no |
//! | static of all inputs, linear | [`JointInputs`] | yes | yes | no | no |
//! | any of the first five, or none | [`Auto`] | all but the last | yes | that of the chosen | no |

mod auto;
mod branches;
mod checks;
mod criterion;
#[cfg(test)]
mod derivative_tests;
pub mod hammerstein;
mod hammerstein_wiener;
mod joint_inputs;
mod multiple_inputs;
mod outcome;
mod output_error;
mod parallel;
mod reference;
pub mod robot_joint;
mod samples;
mod sandwich;
mod several;
mod wiener;

pub use auto::{Auto, AutoIdentification, Identified, Refutation, Structure, StructureCandidate};
pub use branches::TriedBranches;
pub use hammerstein::{
    Breakpoint, BreakpointKind, Calibration, CoefficientErrors, Form, FormFit, FormParameter, MemoryRemoved,
    PlainHammerstein, RefinedHammerstein, RefinedIdentification, RegressionLag,
};
pub use hammerstein_wiener::{HammersteinWiener, HammersteinWienerIdentification};
pub use joint_inputs::{JointInputs, JointInputsIdentification, TriedSurface};
pub use multiple_inputs::{InputBranch, MultipleInputs, MultipleInputsIdentification, MultipleInputsModel};
pub use outcome::{ChosenOrder, Identification, OrderScore, Psi, Verdict, Warning};
pub use output_error::{Linear, LinearIdentification};
pub use parallel::{Parallel, ParallelBranch, ParallelIdentification, TriedSum};
pub use reference::{
    DecayPrior, Narx, NarxIdentification, NarxModel, NarxTerm, TriedNarx, Volterra, VolterraIdentification,
    VolterraModel,
};
pub use sandwich::{ApproximationScore, Intersample, SandwichIdentification, Stage, TriedStructure, WienerHammerstein};
pub use wiener::{Wiener, WienerIdentification, WienerStart};
