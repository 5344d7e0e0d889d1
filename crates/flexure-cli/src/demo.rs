//! `flexure demo`: simulate the space arm, identify its elbow, show it.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure_io::arm::{ArmFile, preset_text};
use flexure_io::{check_writable, read_record, write_model, write_record};
use flexure_workbench::demo::{self, PRESET, Steps, VIEW_FILES, View};
use serde_json::{Map, json};

use crate::files::{write_text, wrote};
use crate::identify::hammerstein;
use crate::output::{command_line, print, print_result};
use crate::simulate::simulate;

/// Simulate the space arm, identify its elbow joint, and show it on one page.
///
/// The shoulder is locked and a white torque, held for 20 s a sample, drives the elbow; the friction in the joint then shows as
/// the dead zone of a Hammerstein model from torque to link velocity. DIR gets arm.toml, record.csv, model.json and report.html.
///
/// With --joint-views, the three ways of seeing the joint as a block-oriented system instead, a record and a page each: the static
/// regression of joint torque on deflection; commanded deflection to link velocity, exactly a Hammerstein system with the
/// stiffness as its nonlinearity; slow torque to velocity, where friction makes it an approximation.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  flexure demo --out flexure-demo\n  flexure demo --joint-views --out joint-views")]
pub struct Arguments {
    /// The folder for the results.
    #[arg(long, value_name = "DIR", default_value = "flexure-demo")]
    out: PathBuf,
    /// Show the joint's stiffness and friction in the three block-oriented views.
    #[arg(long)]
    joint_views: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    if out.exists() && !out.is_dir() {
        bail!("{}: is a file; --out takes a folder", out.display());
    }
    std::fs::create_dir_all(out).with_context(|| format!("{}: the folder cannot be made", out.display()))?;
    if arguments.joint_views {
        return show_views(out, arguments.json);
    }
    let paths = writable(out, ["arm.toml", "record.csv", "model.json", "report.html"])?;
    write_text(&paths[0], preset_text(PRESET)?)?;
    let arm = demo::arm()?;
    write_record(&paths[1], &simulated(&arm)?)?;

    // From here on, what `flexure identify` does with anybody's record.
    let file = read_record(&paths[1])?;
    let identified = hammerstein(&file, "tau2", "dq2", arm.run.sample_time)?;
    let command = command_line(["demo".into(), "--out".into(), out.into()]);
    let decoration = demo::decoration(&arm, &file.record, &identified, command)?;
    let html = identified.html(&file, decoration)?;
    write_model(&paths[2], &identified.model())?;
    write_text(&paths[3], &html)?;
    if arguments.json {
        let mut object = identified.json();
        object["files"] = paths.iter().map(|p| p.display().to_string()).collect();
        return print(&object.to_string());
    }
    let open = format!("open {} in a browser", paths[3].display());
    print_result(&identified.summary(), wrote(&paths).chain([open]))
}

/// Simulates, identifies and writes the three views of the joint.
fn show_views(out: &Path, json: bool) -> Result<()> {
    let command = command_line(["demo".into(), "--joint-views".into(), "--out".into(), out.into()]);
    let steps = Steps {
        simulate: simulated,
        identify: hammerstein,
    };
    let mut files = Vec::new();
    for name in VIEW_FILES {
        files.push(writable(out, ["csv", "html"].map(|kind| format!("{name}.{kind}")))?);
    }
    let views = demo::views(&steps, &command)?;
    let mut lines = Vec::new();
    for (view, [record, page]) in views.iter().zip(&files) {
        write_record(record, &view.record)?;
        write_text(page, &view.html)?;
        lines.extend(view.lines.iter().cloned());
        lines.extend(wrote([record, page]).map(|line| format!("  {line}")));
    }
    if json {
        let object: Map<_, _> = views
            .into_iter()
            .map(|View { name, json, .. }| (name.to_owned(), json))
            .collect();
        return print(&json!(object).to_string());
    }
    print(&lines.join("\n"))
}

/// The files of these names in a folder, if they can be written.
fn writable<const N: usize>(folder: &Path, names: [impl AsRef<Path>; N]) -> Result<[PathBuf; N]> {
    let paths = names.map(|name| folder.join(name));
    paths.iter().try_for_each(check_writable)?;
    Ok(paths)
}

fn simulated(arm: &ArmFile) -> Result<Record> {
    Ok(simulate(arm, Path::new(""))?)
}
