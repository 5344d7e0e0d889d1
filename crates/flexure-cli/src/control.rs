//! `flexure control`: controllers of the arm in one loop, compared.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::ArgGroup;
use flexure::text::shown_path;
use flexure_io::arm::{Scenario, scenario_preset_text};
use flexure_io::{read_text, write_record};
use flexure_workbench::control::{Outcome, compare};

use crate::arguments::{self, Usage};
use crate::files::{keep_apart, prepare, write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::Progress;

/// Compare controllers and state estimators in one control loop, for a two-link arm with flexible joints or for a
/// flexible link.
///
/// A scenario says what moves, what the controllers know about it, the motion, the loop (sample time, delay, encoder
/// counts, noise, limits) and the controllers. The result is a table with one row for each controller. The record of a
/// run can be used for identification like any other record.
#[derive(clap::Args)]
#[command(group(ArgGroup::new("source").required(true).args(["scenario", "preset"])))]
#[command(after_help = "Examples:\n  flexure control --preset square --report square.html\n  \
                        flexure control --preset square --write-scenario mine.toml --dry-run\n  \
                        flexure control mine.toml --seeds 100 --json")]
pub struct Arguments {
    /// The file with the scenario.
    #[arg(value_name = "SCENARIO.toml")]
    scenario: Option<PathBuf>,
    /// A scenario that comes with Flexure, in place of a file: square, rest-to-rest, unknown-stiffness, noisy-encoders
    /// or flexible-link.
    #[arg(long, value_name = "NAME", value_parser = known_preset)]
    preset: Option<String>,
    /// The number of runs of each controller. Each run has another seed, counted from the seed of the scenario. The
    /// table then shows medians and the worst run. By default, the scenario gives this number.
    #[arg(long, value_name = "N", value_parser = arguments::whole::<1, 100_000>)]
    seeds: Option<usize>,
    /// Write the record of one run to this file: .csv or .parquet. It is the first run of the controller with the
    /// smallest error.
    #[arg(short = 'o', long = "out", value_name = "RECORD")]
    out: Option<PathBuf>,
    /// For --out: write the record of the first run of this controller instead.
    #[arg(long, value_name = "CONTROLLER", requires = "out")]
    of: Option<String>,
    /// Write a page with paths, errors, torques and the moving arm to this file.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    /// Write the scenario, with its comments, to this file. You can then edit it.
    #[arg(long, value_name = "SCENARIO.toml")]
    write_scenario: Option<PathBuf>,
    /// Check the scenario, but run nothing.
    #[arg(long, conflicts_with_all = ["out", "report"])]
    dry_run: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn known_preset(name: &str) -> Result<String, String> {
    let text = scenario_preset_text(name).map_err(|error| error.to_string());
    text.map(|_| name.to_owned())
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let pages = arguments.report.iter().chain(&arguments.write_scenario);
    prepare(&arguments.scenario, &arguments.out, pages)?;
    let (text, name) = match (&arguments.scenario, &arguments.preset) {
        (Some(path), _) => (read_text(path)?, shown_path(path)),
        (None, preset) => {
            let preset = preset.as_deref().unwrap_or_default();
            (scenario_preset_text(preset)?.to_owned(), format!("preset {preset}"))
        }
    };
    let folder = arguments
        .scenario
        .as_deref()
        .and_then(Path::parent)
        .unwrap_or(Path::new(""));
    let scenario = Scenario::from_toml_str(&text, &name, folder)?;
    let outputs = arguments
        .out
        .iter()
        .chain(&arguments.report)
        .chain(&arguments.write_scenario);
    keep_apart(&scenario.files, outputs)?;
    if let Some(of) = &arguments.of
        && !scenario.controllers.iter().any(|c| c.name == *of)
    {
        let names: Vec<&str> = scenario.controllers.iter().map(|c| c.name.as_str()).collect();
        return Err(Usage(format!(
            "--of {of}: the scenario's controllers are: {}",
            names.join(", ")
        ))
        .into());
    }
    if let Some(path) = &arguments.write_scenario {
        write_text(path, &text)?;
    }
    if arguments.dry_run && arguments.json {
        let names: Vec<&str> = scenario.controllers.iter().map(|c| c.name.as_str()).collect();
        return print(&serde_json::json!({"controllers": names, "wrong": null}).to_string());
    }
    if arguments.dry_run {
        return print(
            &wrote(&arguments.write_scenario)
                .chain([format!("{name}: no errors found")])
                .collect::<Vec<_>>()
                .join("\n"),
        );
    }
    let progress = Progress::new("controlling", 1.0);
    let outcome = compare(&scenario, &[], arguments.seeds, &|share| {
        progress.at(share);
        ControlFlow::Continue(())
    })?;
    drop(progress);
    let record = write_run(arguments, &outcome)?;
    if let Some(path) = &arguments.report {
        write_text(
            path,
            &outcome.html(name.trim_start_matches("preset "), Some(this_command()))?,
        )?;
    }
    if arguments.json {
        return print(&outcome.json().to_string());
    }
    let written = wrote(arguments.report.iter().chain(&arguments.write_scenario));
    print_result(&outcome.lines(), record.into_iter().chain(written))
}

/// Writes the record that was asked for, and says so.
fn write_run(arguments: &Arguments, outcome: &Outcome) -> Result<Option<String>> {
    let Some(path) = &arguments.out else {
        return Ok(None);
    };
    let row = match &arguments.of {
        Some(name) => outcome.rows.iter().find(|row| row.controller == *name),
        None => outcome.best(),
    };
    let Some((row, run)) = row.and_then(|row| Some((row, row.run.as_ref()?))) else {
        anyhow::bail!("no run was carried through, so there is no record to write");
    };
    write_record(path, &run.record()?)?;
    Ok(Some(format!(
        "wrote {} ({} samples under {})",
        shown_path(path),
        run.t.len(),
        row.controller
    )))
}
