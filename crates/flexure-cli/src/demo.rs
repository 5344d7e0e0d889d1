//! `flexure demo`: simulate the space arm, identify its joints, show them.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure::Record;
use flexure::text::shown_path;
use flexure_io::arm::{ArmFile, Paths, preset_text};
use flexure_io::{check_writable, make_folder, read_record, write_model, write_record};
use flexure_workbench::demo::{self, BothJoints, ELBOW_COLUMNS, FreshRun, LOG_PRESET, Steps, VIEW_FILES, View};
use serde_json::{Map, json};

use crate::files::{write_text, wrote};
use crate::identify;
use crate::output::{command_line, print, print_result};
use crate::progress::spinning;
use crate::simulate::simulate;

/// Simulate a two-link arm, identify both of its joints from one minute of its log, and show the results on a page.
///
/// The arm is a space arm with flexible joints. Both motors apply multisine torques. The log contains the torques of
/// the drives and the angles of the encoders, with noise. From this log, the command identifies the inertias, and the
/// friction and stiffness of each joint, with confidence bands. The page shows these curves and the curves of the
/// simulated arm. Then the identified arm and the simulated arm move under torques that were not used for the fit. The
/// page compares both motions. Last, the command identifies the elbow alone as a chain of blocks, from torque to
/// velocity. The residual tests refute this chain, because friction acts in a feedback loop.
///
/// The folder DIR then contains the files of both joints: arm.toml, log.csv, identified.toml and report.html. It also
/// contains the files of the elbow alone: elbow.csv, elbow.json and elbow.html.
///
/// With --joint-views, the command shows three block-oriented views of a joint instead. It writes a record and a page
/// for each view. The first view is the static regression of joint torque on deflection. The second view goes from
/// commanded deflection to link velocity. It is exactly a Hammerstein system, whose nonlinearity is the stiffness. The
/// third view goes from slow torque to velocity. It is only an approximation, because of the friction.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  flexure demo --out flexure-demo\n  flexure demo --joint-views --out joint-views")]
pub struct Arguments {
    /// The folder for the results. It is created if it does not exist.
    #[arg(long, value_name = "DIR", default_value = "flexure-demo")]
    out: PathBuf,
    /// Show the stiffness and the friction of a joint in three block-oriented views instead.
    #[arg(long)]
    joint_views: bool,
    /// Do not open the page in a browser. By default, it is opened if the output is a terminal.
    #[arg(long)]
    no_open: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// The files of the demo.
const FILES: [&str; 7] = [
    "arm.toml",
    "log.csv",
    "identified.toml",
    "report.html",
    "elbow.csv",
    "elbow.json",
    "elbow.html",
];

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    make_folder(out)?;
    if arguments.joint_views {
        return show_views(out, arguments.json);
    }
    let paths = writable(out, FILES)?;
    let [
        arm_path,
        log_path,
        identified_path,
        page_path,
        elbow_path,
        model_path,
        elbow_page_path,
    ] = &paths;
    let command = || command_line(["demo".into(), "--out".into(), out.into()]);

    let arm = demo::logged_arm()?;
    write_text(arm_path, preset_text(LOG_PRESET)?)?;
    write_record(log_path, &simulated(&arm)?)?;
    // The following is what `flexure joint` does with any log.
    let file = read_record(log_path)?;
    let both = spinning("identifying both joints", || BothJoints::identify(&file, &arm))?;
    write_text(identified_path, &both.arm_file()?)?;
    let fresh = demo::under_fresh_torques(&arm);
    let fresh = FreshRun::new(
        &simulated(&fresh)?,
        &simulated(&both.under(&fresh)?)?,
        arm.run.sample_time,
    )?;
    write_text(page_path, &both.html(&fresh, command())?)?;

    let alone = demo::elbow_alone(&arm);
    write_record(elbow_path, &simulated(&alone)?)?;
    let file = read_record(elbow_path)?;
    let elbow = identify::by_name("auto", &file, ELBOW_COLUMNS, alone.run.sample_time)?;
    write_model(model_path, &elbow.model())?;
    let decoration = demo::elbow_decoration(&alone, &file.record, &elbow, command());
    write_text(elbow_page_path, &elbow.html(&file, decoration)?)?;

    if arguments.json {
        let object = json!({
            "joints": both.json(&fresh),
            "elbow": elbow.json(),
            "files": paths.each_ref().map(|path| path.display().to_string()),
        });
        return print(&object.to_string());
    }
    print_result(&both.summary(&fresh), [String::new()])?;
    let opened = !arguments.no_open && std::io::stdout().is_terminal() && open::that_detached(page_path).is_ok();
    let page = shown_path(page_path);
    let look = match opened {
        true => format!("opened {page} in your browser"),
        false => format!("open {page} in a browser"),
    };
    let next = "now your file: flexure look FILE".to_owned();
    let further = [String::new()].into_iter().chain(wrote(&paths)).chain([look, next]);
    print_result(&demo::elbow_summary(&elbow), further)
}

/// Simulates, identifies and writes the three views of the joint.
fn show_views(out: &Path, json: bool) -> Result<()> {
    let command = command_line(["demo".into(), "--joint-views".into(), "--out".into(), out.into()]);
    let steps = Steps {
        simulate: simulated,
        identify: |file, input, output, sample_time| {
            identify::by_name("hammerstein", file, [input, output], sample_time)
        },
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
    Ok(simulate(arm, Path::new(""), Paths::Below)?)
}
