//! What `flexure identify`, `predict` and `validate` do between reading and writing, with a record in memory: for packages
//! of other languages, whose models and pages are then the command's.

mod cascade;
mod comparison;
mod estimate;
mod form;
mod joint_inputs;
mod nonlinear_ends;
mod outcome;
mod page;
mod parallel;
mod periods;
mod prediction;
mod references;
mod several_inputs;
mod structure;
mod task;
mod validation;

use std::ops::ControlFlow;

use anyhow::{Context as _, Result};
use flexure::identify::{PhysicalForm, RefinedHammerstein};
use flexure_io::{ModelFile, RecordFile};
use serde_json::Value;

pub use cascade::CascadeMethod;
pub use estimate::{Estimate, Method};
pub use form::form;
pub use outcome::{Context, Signals};
pub use page::{Decoration, Truth, arm_motion, labelled};
pub use periods::{Periodic, period};
pub use prediction::{Ahead, FreeRun, Outside, Start, columns};
pub use references::ReferenceMethod;
pub use structure::{Found, Structure, Task};
pub use task::check;
pub use validation::Judged;

/// An identified model with the record that it came from.
pub struct Identified<'a> {
    file: &'a RecordFile,
    found: Found<'a>,
}

impl<'a> Identified<'a> {
    /// Does the task; `inputs` are the inputs' columns one by one, those of the signals joined by commas. `stage` is told
    /// what is being done, and stops the work by returning [`ControlFlow::Break`]. The Hammerstein methods and the references have no
    /// stages; a [`flexure::Interrupt`] stops them.
    ///
    /// # Errors
    /// Those of the method.
    pub fn new(
        task: Task,
        file: &'a RecordFile,
        inputs: &[&str],
        signals: Signals<'a>,
        stage: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Self> {
        let found = task.identify(file, inputs, signals, stage)?;
        Ok(Identified { file, found })
    }

    /// A Hammerstein model of several experiments, whose records follow each other in `file`, so many `samples` each.
    ///
    /// # Errors
    /// Those of [`RefinedHammerstein::identify_experiments`].
    pub fn of_experiments(
        method: RefinedHammerstein,
        form: Option<PhysicalForm>,
        file: &'a RecordFile,
        samples: &[usize],
        signals: Signals<'a>,
    ) -> Result<Self> {
        let found = Found::of_experiments(method, form, file, samples, signals)?;
        Ok(Identified { file, found })
    }

    /// The object that `flexure identify --json` prints.
    pub fn json(&self) -> Value {
        self.found.json()
    }

    /// The text that `flexure identify` prints.
    pub fn summary(&self) -> String {
        self.found.summary()
    }

    /// The model file that `flexure identify -o` writes.
    ///
    /// # Errors
    /// Those of the blocks of the model.
    pub fn model(&self) -> Result<ModelFile> {
        Ok(self.found.model_file()?)
    }

    /// The free-run output over the record.
    pub fn predicted(&self) -> &[f64] {
        self.found.predicted()
    }

    /// The page that `flexure identify --report` writes. `command` is shown as what makes it again.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn page(&self, command: Option<String>) -> Result<String> {
        let decoration = Decoration {
            command,
            ..Decoration::default()
        };
        let page = self.found.page(self.file, decoration)?;
        flexure_report::render(&page).context("the report")
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
