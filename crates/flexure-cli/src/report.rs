//! `flexure report`: the page of a model on a record.

use std::path::PathBuf;

use anyhow::Result;
use flexure_io::read_model;
use flexure_workbench::systems::{Decoration, Identified, Outside, Start, SystemColumns, columns};
use flexure_workbench::text::capitalised;
use serde_json::json;

use crate::arguments;
use crate::columns::Connected;
use crate::files::{prepare, write_text, wrote};
use crate::output::{print, this_command};
use crate::progress::spinning;
use crate::reading::Reading;

/// Write the page that shows a model, judged on a record.
///
/// On the record that the model was identified from, this is the page of `flexure identify --report`, without what only the
/// identification knows: bands and what was tried. On any other record the model is judged on all samples behind its settling time.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure report model.json fresh.csv -o page.html")]
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
    /// Leave the first N samples out of the verdict.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    /// The state in which the record begins: estimate if fewer samples are skipped than the model takes to settle, and the
    /// record has enough, else steady.
    #[arg(long, value_name = "INITIAL_STATE", value_parser = arguments::named::<Start>())]
    initial_state: Option<Start>,
    /// Write the page here.
    #[arg(short = 'o', long = "out", value_name = "PAGE.html")]
    out: PathBuf,
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
    prepare([&arguments.model, &arguments.record], [], [&arguments.out])?;
    let model = read_model(&arguments.model)?;
    let file = arguments.reading.read(&arguments.record)?;
    let connected = Connected::of_model(&file, &model, arguments.input.as_deref(), arguments.output.as_deref())?;
    let inputs = connected.inputs();
    arguments
        .reading
        .same_sample_time(&file, model.sample_time, &connected.all())?;
    let system = SystemColumns {
        inputs: &inputs,
        output: &connected.output,
    };
    let identified = spinning("simulating", || {
        Identified::again(&model, &file, system, arguments.skip, arguments.initial_state)
    })?;
    let outside = Outside::new(&model.block, &columns(&file, &inputs)?);
    let decoration = Decoration {
        command: Some(this_command()),
        remark: outside.remark().map(|remark| format!("{}.", capitalised(&remark))),
        ..Decoration::default()
    };
    write_text(&arguments.out, &identified.html(&file, decoration)?)?;
    let verdict = &identified.result.verdict;
    if arguments.json {
        let object = json!({
            "fit_percent": verdict.measures.fit_percent,
            "rms": verdict.measures.rms,
            "samples": verdict.measures.samples,
            "holds": verdict.holds(),
            "verdict": verdict.text(),
            "out": arguments.out.display().to_string(),
        });
        return print(&object.to_string());
    }
    let mut lines = vec![verdict.text()];
    lines.extend(outside.warning());
    lines.extend(wrote([&arguments.out]));
    print(&lines.join("\n"))
}
