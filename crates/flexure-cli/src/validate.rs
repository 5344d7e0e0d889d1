//! `flexure validate`: does a model hold on a record?

use anyhow::{Result, bail};
use flexure_workbench::systems::{Judged, SystemColumns};

use crate::applied::{Applied, ModelOnRecord};
use crate::arguments;
use crate::output::{print, print_result};

/// Judge a model on a record that was not used for its fit.
///
/// Simulates the model under the record's input and compares with its output: fit in percent, RMS error, and tests
/// whether the error still depends on the input.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure validate model.json fresh.csv")]
pub struct Arguments {
    #[command(flatten)]
    applied: ModelOnRecord,
    /// Leave the first N samples out of the comparison; by default the model's settling time, at most a
    /// tenth of the record, as the state at the start is not known.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Applied {
        model, file, connected, ..
    } = arguments.applied.open([], [])?;
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
    let judged = Judged::new(&model, &file, columns, arguments.skip, arguments.applied.initial_state)?;
    match arguments.json {
        true => print(&judged.json().to_string()),
        false => print_result(&judged.summary(), []),
    }
}
