//! `flexure validate`: does a model hold on a record?

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use flexure::identify::Verdict;
use flexure::text::shown_path;
use flexure_workbench::systems::{Judged, Judging, SystemColumns};

use crate::applied::{Applied, ModelOnRecord, with_missing};
use crate::arguments;
use crate::files::{write_text, wrote};
use crate::output::{command_line, print, print_result, this_command};
use crate::report::Page;
use crate::source::Switches;

/// Judge a model on a record that was not used for its fit.
///
/// The command simulates the model under the input of the record, and compares the result with the output of the
/// record. It reports the fit in percent and the RMS error. It tests whether the error still depends on the input.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure validate model.json fresh.csv --report page.html")]
pub struct Arguments {
    #[command(flatten)]
    applied: ModelOnRecord,
    /// Leave the first N samples out of the comparison, because the state at the start is not known. By default, N is
    /// the settling time of the model, but at most one tenth of the record.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    #[command(flatten)]
    switches: Switches,
    /// Write the page of the model on this record to this file. It is the page that flexure report writes.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut switches = arguments.switches;
    let Applied {
        model,
        file,
        connected,
        reading,
        ..
    } = arguments.applied.open([], &arguments.report, Some(&mut switches))?;
    if let Some(skip) = arguments.skip.filter(|skip| *skip >= file.record.len()) {
        bail!(
            "{}: --skip {skip} leaves nothing of {} samples to compare",
            shown_path(&file.path),
            file.record.len()
        );
    }
    let columns = SystemColumns {
        inputs: &connected.inputs(),
        output: &connected.output,
    };
    let judging = Judging {
        skip: arguments.skip,
        initial_state: arguments.applied.initial_state,
        missing: switches.missing,
        robust: switches.robust,
    };
    let judged = Judged::new(&model, &file, columns, judging)
        .map_err(|error| with_missing(error, &connected.output, !switches.missing))?;
    if let Some(path) = &arguments.report {
        write_text(path, &Page::new(&model, &file, columns, judging)?.html)?;
    }
    match arguments.json {
        true => print(&judged.json().to_string()),
        false => {
            let next = next(&judged.verdict, switches, columns, &arguments.applied.record, &reading);
            let next = next.map(|command| [String::new(), format!("next: {command}")]);
            print_result(
                &judged.summary(),
                wrote(&arguments.report).chain(next.into_iter().flatten()),
            )
        }
    }
}

/// What to type where the model does not hold: without the outliers that hide the answer, otherwise whether another structure holds on this
/// record.
fn next(
    verdict: &Verdict,
    switches: Switches,
    columns: SystemColumns,
    record: &Path,
    reading: &[String],
) -> Option<String> {
    if verdict.hidden_by.is_some() {
        return (!switches.robust).then(|| format!("{} --robust", this_command()));
    }
    if verdict.holds() || (verdict.residuals.is_none() && verdict.runs_away.is_none()) {
        return None;
    }
    let record = record.display().to_string();
    let inputs = columns.inputs.join(",");
    let named = ["identify", &record, "--input", &inputs, "--output", columns.output].map(str::to_owned);
    let flags = [(switches.missing, "--missing"), (switches.robust, "--robust")];
    let flags = flags
        .into_iter()
        .filter(|(given, _)| *given)
        .map(|(_, flag)| flag.to_owned());
    let structure = ["--structure", "auto"].map(str::to_owned);
    let words = named
        .into_iter()
        .chain(reading.iter().cloned())
        .chain(flags)
        .chain(structure);
    Some(command_line(words.map(OsString::from)))
}
