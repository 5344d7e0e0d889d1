//! From a record to a model, with a verdict.
//!
//! [`PlainHammerstein`] is the paper's algorithm unchanged; [`RefinedHammerstein`] starts from it and nearly reaches the accuracy of an
//! estimator that knows the linear part. [`WIENER`] and [`WIENER_HAMMERSTEIN`] are the structures with linear dynamics before the
//! nonlinearity, [`LINEAR`] is the reference without a nonlinearity, and [`AUTO`] finds out which of them the data support.
//! [`HAMMERSTEIN_WIENER`] has a nonlinearity at either end, [`PARALLEL`] several branches for one input, [`MULTIPLE_INPUTS`] a Hammerstein
//! branch for every input, [`JOINT_INPUTS`] one nonlinearity of all of them; [`NARX`] and [`VOLTERRA`] are references without blocks.
//!
//! | structure | identification | even nonlinearity | coloured input | standard errors |
//! |---|---|---|---|---|
//! | linear, of every input | [`LINEAR`] | | yes | yes |
//! | static, linear | [`PlainHammerstein`] | yes | deconvolved | band |
//! | static, linear | [`RefinedHammerstein`] | yes | yes | yes |
//! | linear, static | [`WIENER`] | yes | yes | yes |
//! | linear, static, linear | [`WIENER_HAMMERSTEIN`] | no | yes | yes |
//! | static, linear, static | [`HAMMERSTEIN_WIENER`] | the first | yes | yes |
//! | a sum of static, linear | [`PARALLEL`] | yes | yes | of a single branch |
//! | a sum of linear, static, linear | [`PARALLEL`] | with others | yes | of a single branch |
//! | static, linear, of every input | [`MULTIPLE_INPUTS`] | yes | yes | yes |
//! | static of all inputs, linear | [`JOINT_INPUTS`] | yes | yes | no |
//! | static in a feedback loop | [`FEEDBACK`] | yes | yes | band |
//! | delay, static | [`Structure::by_name`]`("static")` | yes | yes | no |
//! | no blocks: past outputs and inputs | [`NARX`] | yes | yes | no |
//! | no blocks: past inputs | [`VOLTERRA`] | yes | yes | no |
//! | any of the first five, or none | [`AUTO`] | all but the last | yes | that of the chosen |
//!
//! All of them can leave out missing outputs ([`Options::missing`]).

mod auto;
mod block;
mod checks;
#[cfg(test)]
mod derivative_tests;
mod feedback;
pub mod hammerstein;
mod identifying;
mod limits;
mod missed_dynamics;
mod missing;
mod needless;
mod outcome;
mod output_error;
mod reaction;
mod reference;
mod registry;
mod request;
pub mod result;
pub mod robot_joint;
mod robust;
mod run;
mod samples;
mod structures;
mod surface;
mod warning;

pub(crate) use checks::few_levels;

pub use crate::model::{FeedbackModel, NarxModel, NarxTerm, VolterraModel};
pub use auto::{AUTO, Refutation, StructureCandidate, StructureComparison, Symptom, or_another};
pub use feedback::FEEDBACK;
pub use hammerstein::{
    Calibration, HAMMERSTEIN, HammersteinMethod, PhysicalForm, PlainHammerstein, RefinedHammerstein, RegressionLag,
    ShardPoint, ShardSums, ShardedHammerstein,
};
pub use outcome::{Hiding, RunsAway, Verdict};
pub use reference::{DecayPrior, NARX, VOLTERRA};
pub use registry::structures;
pub use request::{Options, Progress, Rank, Request, Structure};
pub use result::{Identification, StructureName};
pub use structures::{HAMMERSTEIN_WIENER, LINEAR, MULTIPLE_INPUTS, PARALLEL, WIENER, WIENER_HAMMERSTEIN};
pub use surface::JOINT_INPUTS;
pub use warning::Warning;
