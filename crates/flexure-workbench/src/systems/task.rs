//! From a task and a record to what was identified.

use std::ops::ControlFlow;

use anyhow::Result;
use flexure::Record;
use flexure::identify::{self, PhysicalForm, RefinedHammerstein};
use flexure_io::RecordFile;

use crate::systems::estimate::Method;
use crate::systems::outcome::{Context, Signals};
use crate::systems::structure::{Found, Task};
use crate::systems::{parallel, several_inputs};

impl Task {
    /// Identifies from columns of a record, and says in which file and line an error lies; `inputs` are the inputs' columns
    /// one by one. `stage` is told what is being done, and stops the work by returning [`ControlFlow::Break`].
    pub fn identify<'a>(
        self,
        file: &'a RecordFile,
        inputs: &[&str],
        signals: Signals<'a>,
        stage: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Found<'a>> {
        let may_miss = matches!(&self, Task::Hammerstein(method) if method.skips_missing());
        check(file, inputs, signals.output, may_miss)?;
        self.found(&file.record, inputs, signals, stage)
            .map_err(|error| file.locate(error).into())
    }

    fn found<'a>(
        self,
        record: &Record,
        inputs: &[&str],
        signals: Signals<'a>,
        stage: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> flexure::Result<Found<'a>> {
        let Signals { input, output, .. } = signals;
        Ok(match self {
            Task::Hammerstein(method) => {
                let estimate = method.identify(record, input, output)?;
                Found::Hammerstein(Context { signals, method }, Box::new(estimate))
            }
            Task::Cascade(method) => Found::Cascade(signals, Box::new(method.identify(record, input, output, stage)?)),
            Task::HammersteinWiener(method) => {
                let result = method.identify_with(record, input, output, &mut |now| stage(now.name()))?;
                Found::HammersteinWiener(signals, Box::new(result))
            }
            Task::Parallel(method) => {
                let result = parallel::identify(&method, record, &signals, stage)?;
                Found::Parallel(signals, Box::new(result))
            }
            Task::MultipleInputs(method) => {
                let result = several_inputs::identify(&method, record, &signals, stage)?;
                Found::MultipleInputs(signals, Box::new(result))
            }
            Task::JointInputs(method) => {
                let result = method.identify_with(record, inputs, output, &mut |now| stage(now.name()))?;
                Found::JointInputs(signals, Box::new(result))
            }
            Task::Reference(method) => Found::Reference(signals, Box::new(method.identify(record, input, output)?)),
            Task::Compare(method) => {
                let progress = &mut |structure: identify::Structure, now: identify::Stage| {
                    stage(&format!("{structure}, {}", now.name()))
                };
                let result = method.identify_with(record, input, output, progress)?;
                Found::compared(result, signals, method)
            }
        })
    }
}

impl<'a> Found<'a> {
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
    ) -> flexure::Result<Self> {
        let mut start = 0;
        let mut parts = Vec::with_capacity(samples.len());
        for samples in samples {
            parts.push(file.record.slice(start..start + samples));
            start += samples;
        }
        let parts: Vec<_> = parts.iter().collect();
        let estimate = Method::of_experiments(&method, form, &parts, signals.input, signals.output)?;
        let method = Method::Refined { method, form };
        Ok(Found::Hammerstein(Context { signals, method }, Box::new(estimate)))
    }
}

/// The inputs must be finite, and the output too unless it may miss samples.
pub fn check(file: &RecordFile, inputs: &[&str], output: &str, may_miss: bool) -> Result<()> {
    for input in inputs {
        file.finite(input)?;
    }
    match may_miss {
        true => file.column(output)?,
        false => file.finite(output)?,
    };
    Ok(())
}
