//! `flexure report`: the page of a model on a record.

use std::path::PathBuf;

use anyhow::Result;
use flexure::identify::Verdict;
use flexure::text::fit;
use flexure_io::{ModelFile, RecordFile};
use flexure_workbench::lines::Lines;
use flexure_workbench::systems::{Decoration, Identified, Judging, Outside, SystemColumns, columns, tone};
use flexure_workbench::text::capitalised;
use serde_json::json;

use crate::applied::{Applied, ModelOnRecord, with_missing};
use crate::arguments;
use crate::files::{write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::spinning;
use crate::source::Switches;

/// Write a page that shows a model and judges it on a record.
///
/// If the model was identified from this record, the page is that of `flexure identify --report`. It lacks only what
/// the model file does not contain: the bands of the curves, and what was tried. On any other record, the model is
/// judged on all samples after its settling time.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure report model.json fresh.csv -o page.html")]
pub struct Arguments {
    #[command(flatten)]
    applied: ModelOnRecord,
    /// Leave the first N samples out of the verdict. By default, the samples that were used for the fit are left out.
    /// On any other record, the default is the settling time of the model, but at most one tenth of the record.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    #[command(flatten)]
    switches: Switches,
    /// Write the page to this file.
    #[arg(short = 'o', long = "out", value_name = "PAGE.html")]
    out: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// The page of a model on a record, with its main results.
pub struct Page {
    /// The page.
    pub html: String,
    verdict: Verdict,
    outside: Outside,
}

impl Page {
    /// Judges the model as `judging` says.
    ///
    /// # Errors
    /// As [`Identified::again`].
    pub fn new(model: &ModelFile, file: &RecordFile, system: SystemColumns, judging: Judging) -> Result<Page> {
        let identified = spinning("simulating", || Identified::again(model, file, system, judging))?;
        let outside = Outside::new(&model.block, &columns(file, system.inputs)?);
        let decoration = Decoration {
            command: Some(this_command()),
            remark: outside.remark().map(|remark| format!("{}.", capitalised(&remark))),
            ..Decoration::default()
        };
        Ok(Page {
            html: identified.html(file, decoration)?,
            verdict: identified.result.verdict,
            outside,
        })
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut switches = arguments.switches;
    let Applied {
        model, file, connected, ..
    } = arguments.applied.open([], [&arguments.out], Some(&mut switches))?;
    let inputs = connected.inputs();
    let system = SystemColumns {
        inputs: &inputs,
        output: &connected.output,
    };
    let judging = Judging {
        skip: arguments.skip,
        initial_state: arguments.applied.initial_state,
        missing: switches.missing,
        robust: switches.robust,
    };
    let page = Page::new(&model, &file, system, judging)
        .map_err(|error| with_missing(error, &connected.output, !switches.missing))?;
    write_text(&arguments.out, &page.html)?;
    let Page { verdict, outside, .. } = page;
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
    let mut lines = Lines::new();
    let fit = fit(verdict.measures.fit_percent, 2);
    lines.headline(
        tone(&verdict),
        format!("Fit {fit} on this record, {}", verdict.in_short()),
    );
    lines.sentence(verdict.text());
    outside.remark().into_iter().for_each(|remark| lines.warning(remark));
    print_result(&lines, wrote([&arguments.out]))
}
