//! From a record to an identified system.

use std::ops::ControlFlow;

use anyhow::Result;
use flexure::Record;
use flexure::identify::{Identification, Options, Request, Structure, Warning, or_another};
use flexure::look::integrated_output;
use flexure_io::{RecordFile, RecordMark};

use super::columns::SystemColumns;
use super::periods::Periodic;
use super::streamed::Fitted;
use crate::labels::Labels;

/// What is to be identified, with the choices that were given.
#[derive(Clone)]
pub struct Task {
    /// The structure.
    pub structure: &'static Structure,
    /// The choices.
    pub options: Options,
    /// Whether another structure may take the place of a Hammerstein system that does not hold ([`or_another`]). Not for records in parts.
    pub or_another: bool,
}

/// An identified system.
pub struct Identified {
    /// The result.
    pub result: Identification,
    /// The sample time of its record in s, where it is known.
    pub sample_time: Option<f64>,
    /// Whether its record differs from the one that it was identified from: then no sample was fitted, and all except the first ones are
    /// judged.
    pub is_other_record: bool,
    /// Whether outputs could be missing in its record.
    pub missing: bool,
    /// Whether outliers of the output were left out.
    pub robust: bool,
    /// The units of its record's columns.
    pub labels: Labels,
    /// The records that it was identified from, one an experiment.
    pub records: Vec<RecordMark>,
    /// The best linear approximation of a periodic record, reported in addition to the model.
    pub periodic: Option<Periodic>,
    /// What was fitted of a record that was read in parts: the result's own record is its end.
    pub in_parts: Option<Fitted>,
}

impl Task {
    /// The input that the output integrates, if there is one.
    pub fn integrated<'a>(file: &RecordFile, SystemColumns { inputs, output }: SystemColumns<'a>) -> Option<&'a str> {
        integrated(&file.record, inputs, output)
    }

    /// Whether several experiments of one system can be identified together.
    pub fn takes_experiments(&self) -> bool {
        self.structure.is_refined(&self.options)
    }

    /// Identifies from columns of a record, and says in which file and line an error lies. `experiments` has the samples of each
    /// experiment, whose records follow each other in `file`. `stage` is called with the name of the present stage, and stops the work by
    /// returning [`ControlFlow::Break`].
    pub fn identify(
        &self,
        file: &RecordFile,
        SystemColumns { inputs, output }: SystemColumns,
        sample_time: Option<f64>,
        experiments: &[usize],
        stage: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Identified> {
        check(file, inputs, output, self.options.missing)?;
        let parts: Vec<Record>;
        let records: Vec<&Record> = match experiments.len() {
            0 | 1 => vec![&file.record],
            _ => {
                parts = experiment_records(&file.record, experiments);
                parts.iter().collect()
            }
        };
        let request = Request::new(&records, inputs, output, self.options.clone());
        let result = self.structure.identify_with(&request, &mut |name| stage(name));
        let result = result.and_then(|result| match self.or_another {
            true => or_another(result, &request, &mut |name| stage(name)),
            false => Ok(result),
        });
        let result = result.map_err(|error| file.locate(named(error, file)))?;
        self.identified(file, &request, sample_time, result)
    }

    /// The result with what belongs to its record; it may be from more than that.
    pub fn identified(
        &self,
        file: &RecordFile,
        request: &Request<'_>,
        sample_time: Option<f64>,
        mut result: Identification,
    ) -> Result<Identified> {
        let Request {
            records,
            inputs,
            output,
            ..
        } = *request;
        // A model with a pole at 1 has a place for it.
        if result.detail("integrators").is_none() {
            let integrated = integrated(records[0], inputs, output).map(|input| Warning::IntegratedOutput {
                input: input.to_owned(),
                output: output.to_owned(),
            });
            // It comes first, since it explains all others.
            result.warnings.splice(0..0, integrated);
        }
        let columns = [inputs, &[output]].concat();
        let marks = records
            .iter()
            .map(|record| RecordMark::new(&file.name(), record, &columns));
        Ok(Identified {
            result,
            sample_time,
            is_other_record: false,
            missing: self.options.missing,
            robust: self.options.robust,
            labels: Labels::new(file),
            records: marks.collect::<flexure::Result<_>>()?,
            periodic: None,
            in_parts: None,
        })
    }
}

/// The input that the output integrates, if there is one.
fn integrated<'a>(record: &Record, inputs: &[&'a str], output: &str) -> Option<&'a str> {
    let y = record.column(output).ok()?;
    let integrates = |input: &&str| record.column(input).is_ok_and(|u| integrated_output(u, y).is_some());
    inputs.iter().copied().find(integrates)
}

/// The records of experiments that follow each other.
fn experiment_records(record: &Record, experiments: &[usize]) -> Vec<Record> {
    let mut start = 0;
    let mut parts = Vec::with_capacity(experiments.len());
    for samples in experiments {
        parts.push(record.slice(start..start + samples));
        start += samples;
    }
    parts
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

/// The error, with a name for the signal that enters a nonlinearity if the file has no column of the library's name.
fn named(error: flexure::Error, file: &RecordFile) -> flexure::Error {
    error.with_columns(|column| {
        let inner = column == "x" && !file.has(column);
        inner.then(|| "(what enters the nonlinearity)".to_owned())
    })
}
