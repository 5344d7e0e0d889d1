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
mod block;
mod checks;
#[cfg(test)]
mod derivative_tests;
pub mod hammerstein;
mod outcome;
mod reference;
pub mod registry;
pub mod result;
pub mod robot_joint;
mod samples;
mod structures;
mod surface;

pub use auto::{Auto, Refutation, StructureCandidate, StructureComparison};
pub use block::{ApproximationScore, Intersample, Stage, TriedBranches, TriedStructure, TriedSum};
pub use hammerstein::{
    Breakpoint, BreakpointKind, Calibration, CoefficientErrors, FormFit, FormParameter, MemoryRemoved, PhysicalForm,
    PlainHammerstein, RefinedHammerstein, RefinedIdentification, RegressionLag,
};
pub use outcome::{ChosenOrder, OrderScore, PlainIdentification, Psi, Verdict, Warning};
pub use reference::{DecayPrior, Narx, NarxModel, NarxTerm, Volterra, VolterraModel};
pub use registry::{HammersteinMethod, Options, Progress, Request, Structure, structures};
pub use result::{Identification, StructureName};
pub use structures::{HammersteinWiener, Linear, MultipleInputs, Parallel, Wiener, WienerHammerstein};
pub use surface::JointInputs;
