//! A model on a record: the first step of `predict`, `validate` and `report`.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use flexure::error::DataError;
use flexure_io::{ModelFile, RecordFile, TimeColumn, read_model};
use flexure_workbench::systems::Start;

use crate::arguments;
use crate::columns::Connected;
use crate::files::prepare;
use crate::source::{Source, Switches};

/// The model, the record, and which columns of it are the model's.
#[derive(clap::Args)]
pub struct ModelOnRecord {
    /// The model, from `flexure identify -o`.
    model: PathBuf,
    /// The record.
    pub record: PathBuf,
    /// The column of the input, if its name differs from the name in the model. A,B for a model with several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column of the measured output, if its name differs from the name in the model.
    #[arg(long, value_name = "COLUMN")]
    pub output: Option<String>,
    /// The state of the model at the start of the record. By default, it is estimated from the first outputs. If there
    /// are too few outputs for this, it is the steady state for the first input.
    #[arg(long, value_name = "INITIAL_STATE", value_parser = arguments::named::<Start>())]
    pub initial_state: Option<Start>,
    #[command(flatten)]
    source: Source,
}

/// Extends the error about a missing sample: for one of the output it names the option that skips such samples, if there `is_option`; otherwise the
/// one that interpolates them.
pub fn with_missing(error: anyhow::Error, output: &str, is_option: bool) -> anyhow::Error {
    let missing = |cause: &flexure::Error| match cause {
        flexure::Error::Data(DataError::NonFinite { column, value, .. }) => value.is_nan().then(|| column == output),
        _ => None,
    };
    match error.downcast_ref() {
        Some(flexure_io::Error::Data { cause, .. }) => match missing(cause) {
            Some(true) if is_option => {
                anyhow!("{error}, or say --missing: samples without an output then do not count")
            }
            Some(_) => anyhow!("{error}, or say --fill N: gaps of at most N samples are then interpolated"),
            None => error,
        },
        _ => error,
    }
}

/// The error about an input of a model that a record lacks, where the record can be read without the model's options.
pub fn lacking(own: &Source, record: &Path, model: &ModelFile, inputs: Option<&str>) -> Option<anyhow::Error> {
    let file = own.reading.read(record).ok()?;
    let connected = Connected::of_model(&file, model, inputs, None).ok()?;
    let missing = connected.inputs().iter().find_map(|name| file.column(name).err());
    missing.map(Into::into)
}

/// A model, and the record that it is applied to.
pub struct Applied {
    /// The model.
    pub model: ModelFile,
    /// The record.
    pub file: RecordFile,
    /// The columns that enter the model, and its output.
    pub connected: Connected,
    /// The column of the record's instants.
    pub time: Option<TimeColumn>,
    /// How the record was read and prepared, as it is typed for another command.
    pub reading: Vec<String>,
}

impl ModelOnRecord {
    /// Reads both. `tables` and `others` are the files that the command will write; `switches` are options of the command, if it has them;
    /// they become true if they were set for the model's record.
    ///
    /// # Errors
    /// For files that cannot be read or written, columns that the record lacks, and another sample time than the model's.
    pub fn open<'a>(
        &'a self,
        tables: impl IntoIterator<Item = &'a PathBuf>,
        others: impl IntoIterator<Item = &'a PathBuf>,
        mut switches: Option<&mut Switches>,
    ) -> Result<Applied> {
        if let Some(input) = &self.input {
            arguments::distinct_inputs(&[input], self.output.as_deref())?;
        }
        prepare([&self.model, &self.record], tables, others)?;
        let model = read_model(&self.model)?;
        let source = self.source.as_of_model(&model, switches.as_deref_mut(), &self.record)?;
        source.check()?;
        let read = source.reading.read(&self.record);
        let file = read.map_err(|error| {
            let inputs = self.input.as_deref();
            lacking(&self.source, &self.record, &model, inputs).unwrap_or(error)
        })?;
        let connected = Connected::of_model(&file, &model, self.input.as_deref(), self.output.as_deref())?;
        let reading = source.typed_for(&file, &connected.all(), &model);
        let file = source.prepared(file, &connected.all(), &[&connected.output], Some(&model))?;
        if let Some(switches) = switches {
            switches.missing |= source.prepares();
        }
        let time = source
            .reading
            .same_sample_time(&file, model.sample_time, &connected.all())?;
        Ok(Applied {
            model,
            file,
            connected,
            time,
            reading,
        })
    }
}
