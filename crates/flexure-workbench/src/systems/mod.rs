//! The work of `flexure identify`, `predict` and `validate` between reading and writing, with a record in memory.

mod again;
mod columns;
mod compare;
mod comparison;
mod file;
mod form;
mod json;
mod page;
mod periods;
mod poles;
mod prediction;
mod streamed;
mod summary;
mod task;
mod validation;

pub use columns::SystemColumns;
pub use compare::{Compared, ComparedModel};
pub use form::form;
pub use page::{Decoration, Truth, arm_motion, score_curve};
pub use periods::{Periodic, period};
pub use prediction::{Ahead, FreeRun, Outside, Start, columns, predict, simulate};
pub use streamed::{Fitted, Streamed};
pub use summary::tone;
pub use task::{Identified, Task, check};
pub use validation::{Judged, Judging};

/// Share of the impulse response that remains when a system counts as settled.
const SETTLED: f64 = 0.01;
