//! `flexure predict`: the free-run output of a model.

use std::path::PathBuf;

use anyhow::Result;
use flexure::Record;
use flexure_io::{check_record_writable, read_model, read_record, write_record};
use serde_json::json;

use crate::arguments::{self, TIME};
use crate::output::print;
use crate::prediction::{self, Outside};
use crate::progress::spinning;

/// Simulate a model under a record's input.
///
/// Writes the free-run output as column 'y' (after the record's column of times 't', if it has one), one row a sample of
/// the record. The model starts in the steady state that belongs to the mean input.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure predict model.json fresh.csv --input u -o predicted.csv")]
pub struct Arguments {
    /// The model, from `flexure identify -o`.
    model: PathBuf,
    /// The record with the input.
    record: PathBuf,
    /// The input's column.
    #[arg(long, value_name = "COLUMN")]
    input: String,
    /// Write the prediction here: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "OUT.csv")]
    out: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    check_record_writable(&arguments.out)?;
    let model = read_model(&arguments.model)?;
    let file = spinning("reading", || read_record(&arguments.record))?;
    let signals = [arguments.input.as_str(), &model.output];
    arguments::same_sample_time(&file, model.sample_time, &signals)?;
    let input = file.finite(&arguments.input)?;
    let y = prediction::predict(&model.block, &file, &arguments.input)?;
    let outside = Outside::new(&model.block, input);
    let mut columns = Vec::new();
    if arguments::has_time(&file, &signals) {
        columns.push((TIME, file.column(TIME)?.to_vec()));
    }
    columns.push(("y", y));
    write_record(&arguments.out, &Record::new(columns)?)?;
    if arguments.json {
        let object = json!({
            "samples": input.len(),
            "samples_outside_range": outside.samples,
            "out": arguments.out.display().to_string(),
        });
        return print(&object.to_string());
    }
    let mut lines = vec![format!("wrote {} ({} samples)", arguments.out.display(), input.len())];
    lines.extend(outside.warning());
    print(&lines.join("\n"))
}
