//! `flexure validate`: does a model hold on a record?

use std::path::PathBuf;

use anyhow::{Result, bail};
use flexure_io::read_model;
use flexure_workbench::systems::{Judged, Start, SystemColumns};

use crate::arguments;
use crate::columns::Connected;
use crate::output::{print, print_result};
use crate::reading::Reading;

/// Judge a model on a record that was not used for its fit.
///
/// Simulates the model under the record's input and compares with its output: fit in percent, RMS error, and tests
/// whether the error still depends on the input.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure validate model.json fresh.csv")]
pub struct Arguments {
    /// The model, from `flexure identify -o`.
    model: PathBuf,
    /// The record.
    record: PathBuf,
    /// The input's column, where it is not called as the model's; A,B for a model of several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The measured output's column, where it is not called as the model's.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// Leave the first N samples out of the comparison; by default the model's settling time, at most a
    /// tenth of the record, as the state at the start is not known.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    /// The state in which the record begins: estimate if fewer samples are skipped than the model takes to settle, and the
    /// record has enough, else steady.
    #[arg(long, value_name = "INITIAL_STATE", value_parser = arguments::named::<Start>())]
    initial_state: Option<Start>,
    #[command(flatten)]
    reading: Reading,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(input) = &arguments.input {
        arguments::distinct_inputs(&[input], arguments.output.as_deref())?;
    }
    let model = read_model(&arguments.model)?;
    let file = arguments.reading.read(&arguments.record)?;
    let connected = Connected::of_model(&file, &model, arguments.input.as_deref(), arguments.output.as_deref())?;
    arguments
        .reading
        .same_sample_time(&file, model.sample_time, &connected.all())?;
    if let Some(skip) = arguments.skip.filter(|skip| *skip >= file.record.len()) {
        bail!(
            "{}: --skip {skip} leaves nothing of {} samples to compare",
            file.path.display(),
            file.record.len()
        );
    }
    let columns = SystemColumns {
        inputs: &connected.inputs(),
        output: &connected.output,
    };
    let judged = Judged::new(&model, &file, columns, arguments.skip, arguments.initial_state)?;
    match arguments.json {
        true => print(&judged.json().to_string()),
        false => print_result(&judged.summary(), []),
    }
}
