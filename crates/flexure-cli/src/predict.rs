//! `flexure predict`: the output of a model, in free run or some samples ahead.

use std::path::PathBuf;

use anyhow::Result;
use flexure::Record;
use flexure::validation::FitMeasures;
use flexure_io::{read_model, read_record, write_record};
use flexure_workbench::Named;
use flexure_workbench::systems::{Ahead, FreeRun, Outside, Start, columns};
use flexure_workbench::text::number;
use serde_json::json;

use crate::arguments::{self, TIME, Usage};
use crate::files::prepare;
use crate::output::print;
use crate::progress::spinning;

/// Simulate a model under a record's input, or predict its output from the past.
///
/// Writes the output as column 'y' (after the record's column of times 't', if it has one), one row a sample of the record. Without
/// --horizon that is the free run, which sees the input alone.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  flexure predict model.json fresh.csv --input u -o predicted.csv\n  flexure predict model.json fresh.csv --input u --output y --horizon 5 -o predicted.csv"
)]
pub struct Arguments {
    /// The model, from `flexure identify -o`.
    model: PathBuf,
    /// The record with the input.
    record: PathBuf,
    /// The input's column; A,B for a model of several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: String,
    /// The measured output's column: for --horizon, for the initial state, and for a fit.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// Predict so many samples ahead: every value uses the outputs measured up to K samples before it.
    #[arg(long, value_name = "K", requires = "output", allow_hyphen_values = true, value_parser = arguments::count_from_one)]
    horizon: Option<usize>,
    /// The state in which the record begins: estimate if --output is given and the record has enough samples, else steady.
    #[arg(long, value_name = "INITIAL_STATE", value_parser = arguments::named::<Start>())]
    initial_state: Option<Start>,
    /// Write the prediction here: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "OUT.csv")]
    out: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments::distinct_inputs(&[&arguments.input], arguments.output.as_deref())?;
    if arguments.output.is_none() && arguments.initial_state == Some(Start::Estimate) {
        let message =
            "--initial-state estimate needs the measured output; name its column by --output, or choose steady";
        return Err(Usage(message.to_owned()).into());
    }
    prepare([&arguments.model, &arguments.record], [&arguments.out], [])?;
    let model = read_model(&arguments.model)?;
    let inputs = arguments::model_inputs(&model, &arguments.input)?;
    arguments::distinct_inputs(&inputs, arguments.output.as_deref())?;
    let file = spinning("reading", || read_record(&arguments.record))?;
    let mut signals = [&inputs[..], &[&model.output]].concat();
    signals.extend(arguments.output.as_deref());
    arguments::same_sample_time(&file, model.sample_time, &signals)?;
    let entering = columns(&file, &inputs)?;
    let measured = (arguments.output.as_deref())
        .map(|output| file.finite(output))
        .transpose()?;
    let free = spinning("simulating", || {
        FreeRun::new(&model.block, &file, &inputs, measured, arguments.initial_state)
    })?;
    let ahead = match (arguments.horizon, measured) {
        (Some(horizon), Some(measured)) => Some(Ahead::new(&model, &free, measured, horizon)?),
        _ => None,
    };
    let y = ahead.as_ref().map_or(&free.output, |ahead| &ahead.output);
    // A constant output has no fit.
    let measures = measured.and_then(|measured| FitMeasures::new(measured, y).ok());
    let outside = Outside::new(&model.block, &entering);
    let mut columns = Vec::new();
    if arguments::has_time(&file, &signals) {
        columns.push((TIME, file.column(TIME)?.to_vec()));
    }
    columns.push(("y", y.clone()));
    write_record(&arguments.out, &Record::new(columns)?)?;
    if arguments.json {
        let object = json!({
            "samples": y.len(),
            "samples_outside_range": outside.samples,
            "initial_state": free.start().name(),
            "initial_state_samples": free.estimated_from,
            "horizon": arguments.horizon,
            "noise_model_used": ahead.as_ref().is_some_and(|ahead| ahead.noise),
            "fit_percent": measures.map(|m| m.fit_percent),
            "rms": measures.map(|m| m.rms),
            "out": arguments.out.display().to_string(),
        });
        return print(&object.to_string());
    }
    let mut lines = vec![format!("wrote {} ({} samples)", arguments.out.display(), y.len())];
    lines.extend(ahead.map(|ahead| ahead.description));
    lines.push(format!("free run {}", free.description()));
    lines.extend(measures.map(|m| format!("fit {:.2} %, RMS error {}", m.fit_percent, number(m.rms))));
    lines.extend(outside.warning());
    print(&lines.join("\n"))
}
