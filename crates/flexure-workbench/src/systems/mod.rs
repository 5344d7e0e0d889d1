//! What `flexure identify`, `predict` and `validate` do between reading and writing, with a record in memory: for packages
//! of other languages, whose models and pages are then the command's.

mod comparison;
mod file;
mod form;
mod json;
mod page;
mod periods;
mod prediction;
mod summary;
mod task;
mod validation;

use anyhow::{Context as _, Result};
use flexure_io::{ModelFile, RecordFile};
use serde_json::Value;

pub use form::form;
pub use page::{Decoration, Truth, arm_motion, labelled, score_curve};
pub use periods::{Periodic, period};
pub use prediction::{Ahead, FreeRun, Outside, Start, columns};
pub use task::{Identified, Task, check};
pub use validation::Judged;

/// Share of the impulse response that is left when a system counts as settled.
const SETTLED: f64 = 0.01;

impl Identified {
    /// The object that `flexure identify --json` prints.
    pub fn json(&self) -> Value {
        json::json(self)
    }

    /// The text that `flexure identify` prints.
    pub fn summary(&self) -> String {
        summary::summary(&self.result)
    }

    /// The model file that `flexure identify -o` writes.
    pub fn model(&self) -> ModelFile {
        file::model_file(self)
    }

    /// The page that `flexure identify --report` writes, as values.
    ///
    /// # Errors
    /// For columns that the record lacks.
    pub fn page(&self, file: &RecordFile, decoration: Decoration) -> Result<flexure_report::data::Page> {
        page::page(file, self, decoration)
    }

    /// The page that `flexure identify --report` writes. `command` is shown as what makes it again.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, file: &RecordFile, command: Option<String>) -> Result<String> {
        let decoration = Decoration {
            command,
            ..Decoration::default()
        };
        flexure_report::render(&self.page(file, decoration)?).context("the report")
    }
}

/// The free run of a model under the columns `inputs`, as `flexure predict` makes it: from the steady state of the mean input.
///
/// # Errors
/// Names the first sample for which the model has no finite output.
pub fn simulate(model: &ModelFile, file: &RecordFile, inputs: &[&str]) -> Result<Vec<f64>> {
    prediction::predict(&model.block, file, inputs)
}

/// The prediction `horizon` samples ahead, as `flexure predict --horizon` makes it; without a horizon the free run. Both start
/// from the state that fits the column `output` best, where there are enough samples.
///
/// # Errors
/// Those of [`simulate`], and [`flexure::Error::Parameter`] for a horizon of 0.
pub fn predict(
    model: &ModelFile,
    file: &RecordFile,
    (inputs, output): (&[&str], &str),
    horizon: Option<usize>,
) -> Result<Vec<f64>> {
    let measured = file.finite(output)?;
    let known = Some(measured).filter(|y| Start::enough(&model.block, y.len()));
    let free = FreeRun::new(&model.block, file, inputs, known)?;
    match horizon {
        Some(horizon) => Ok(Ahead::new(model, &free, measured, horizon)?.output),
        None => Ok(free.output),
    }
}
