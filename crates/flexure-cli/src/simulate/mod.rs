//! `flexure simulate`: an arm file, a robot's description, or a preset, to a record.

mod base;
mod chain;
mod machine;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::ArgGroup;
use flexure::Record;
use flexure::manipulator::chain::ChainPreset;
use flexure::text::shown_path;
use flexure_io::arm::{ArmError, ArmFile, Paths, preset_text, read_arm_record, run_watched};
use flexure_io::{ReadOptions, read_text, write_record};
use serde_json::json;

use chain::ChainArguments;

use crate::arguments::Usage;
use crate::files::{keep_apart, name_json, prepare, write_text, wrote};
use crate::output::print;
use crate::progress::Progress;

/// Simulate a two-link arm from an arm file, or a chain of any number of joints from a URDF or a chain file.
///
/// The record has one row for each sample instant. The torque in a row is held until the next row. The units are s, N
/// m, rad and rad/s (N, m and m/s for a prismatic joint).
///
/// The record of an arm has the columns t, tau1, tau2, q1, q2, qm1, qm2, dq1, dq2, dqm1 and dqm2. For a rigid arm, it
/// has no columns qm and dqm.
///
/// The record of a chain has the columns t, tau_JOINT for every driven joint, and q_JOINT and dq_JOINT for every joint.
/// A flexible joint also has qm_JOINT and dqm_JOINT. A base that floats or is moved has base_x to base_wz. Beams of
/// finite elements or modes have the columns e1_LINK and so on (their coordinates), de1_LINK and so on (the rates of
/// these coordinates), and tip_LINK (the deflection of the tip in m).
#[derive(clap::Args)]
#[command(group(ArgGroup::new("source").required(true).args(["arm", "preset"])))]
#[command(after_help = "Examples:\n  flexure simulate --preset space-arm -o record.csv\n  \
                        flexure simulate --preset space-arm --write-arm arm.toml\n  flexure simulate arm.toml -o record.parquet\n  \
                        flexure simulate robot.urdf --duration 10 --sample-time 0.01 --start elbow=0.5 -o record.csv")]
pub struct Arguments {
    /// The arm file, the chain file, or the URDF.
    #[arg(value_name = "ARM.toml|ROBOT.urdf")]
    arm: Option<PathBuf>,
    /// A preset in place of a file. Presets of an arm: space-arm (under white torques), motor-log (a log for `flexure
    /// joint`), elbow-test, short-stiff, frictionless. Presets of a chain: free-space-arm, space-manipulator,
    /// six-joint-arm, seven-joint-arm.
    #[arg(long, value_name = "NAME", value_parser = arm_or_chain)]
    preset: Option<String>,
    /// Write the record to this file: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "RECORD")]
    out: Option<PathBuf>,
    /// Write the arm file, with its comments, to this file. You can then edit it.
    #[arg(long, value_name = "ARM.toml")]
    write_arm: Option<PathBuf>,
    /// Write a page that shows the chain in motion to this file. Only for chains.
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    /// Let the arm file name a record in any folder. Without this option, the record must be in the folder of the arm
    /// file, or below it. Use this option only for an arm file that you trust.
    #[arg(long)]
    allow_paths: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    chain: ChainArguments,
}

/// The name of a preset of an arm or a chain.
pub fn arm_or_chain(name: &str) -> Result<String, String> {
    match ChainPreset::ALL.iter().any(|preset| preset.name() == name) {
        true => Ok(name.to_owned()),
        false => known_preset(name).map_err(|error| {
            let chains: Vec<&str> = ChainPreset::ALL.iter().map(|preset| preset.name()).collect();
            format!("{error}; of chains: {}", chains.join(", "))
        }),
    }
}

/// The name of an arm's preset.
pub fn known_preset(name: &str) -> Result<String, String> {
    preset_text(name)
        .map(|_| name.to_owned())
        .map_err(|error| error.to_string())
}

impl Arguments {
    fn paths(&self) -> Paths {
        match self.allow_paths {
            true => Paths::All,
            false => Paths::Below,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.out.is_none() && arguments.write_arm.is_none() {
        let stem = arguments.arm.as_deref().and_then(Path::file_stem);
        let stem = stem.map_or_else(|| "record".into(), |s| s.to_string_lossy());
        let message = format!("say where the record is to be written: -o {stem}.csv, or -o {stem}.parquet");
        return Err(Usage(message).into());
    }
    prepare(&arguments.arm, &arguments.out, &arguments.write_arm)?;
    if let Some(preset) = chain::preset(arguments) {
        return chain::run(arguments, &chain::of_preset(preset, arguments)?);
    }
    let source = Source::new(&arguments.arm, &arguments.preset)?;
    if let Some(chain) = chain::of_file(arguments, &source)? {
        return chain::run(arguments, &chain);
    }
    if let Some(option) = arguments.chain.given() {
        return Err(Usage(format!(
            "{option} is for chains. An arm has its duration and sample time in the table [run] of its file: write that of a preset with --write-arm \
             ARM.toml, and change it there"
        )).into());
    }
    if arguments.report.is_some() {
        let message =
            "--report draws chains; for an arm, flexure identify --arm ARM.toml shows the motion of its record";
        return Err(Usage(message.to_owned()).into());
    }
    let file = source.arm()?;
    let folder = arguments.arm.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let record = file.excitation.file.as_ref().map(|name| folder.join(name));
    keep_apart(&record, arguments.out.iter().chain(&arguments.write_arm))?;
    let mut samples = None;
    if let Some(path) = &arguments.out {
        let record =
            simulate(&file, folder, arguments.paths()).map_err(|error| error.located(&source.text, &source.name))?;
        write_record(path, &record)?;
        samples = Some((record.len(), record.names().to_vec()));
    }
    // An arm that cannot be simulated must not overwrite another file.
    if let Some(path) = &arguments.write_arm {
        write_text(path, &source.text)?;
    }
    if arguments.json {
        let object = json!({
            "samples": samples.as_ref().map(|s| s.0),
            "columns": samples.as_ref().map(|s| &s.1),
            "sample_time": file.run.sample_time,
            "record": name_json(&arguments.out),
            "arm": name_json(&arguments.write_arm),
        });
        return print(&object.to_string());
    }
    let mut lines: Vec<String> = wrote(&arguments.write_arm).collect();
    if let (Some(path), Some((rows, names))) = (&arguments.out, samples) {
        lines.push(format!(
            "wrote {} ({rows} samples of {})",
            shown_path(path),
            names.join(", ")
        ));
    }
    print(&lines.join("\n"))
}

/// The text of an arm file, and its name in messages.
pub struct Source {
    pub text: String,
    pub name: String,
}

impl Source {
    /// The source from the file, or from the preset.
    pub fn new(path: &Option<PathBuf>, preset: &Option<String>) -> Result<Self> {
        let preset = preset.as_deref().unwrap_or_default();
        Ok(match path {
            Some(path) => Source {
                text: read_text(path)?,
                name: shown_path(path),
            },
            None => Source {
                text: preset_text(preset)?.to_owned(),
                name: format!("preset {preset}"),
            },
        })
    }

    /// The arm.
    pub fn arm(&self) -> Result<ArmFile> {
        Ok(ArmFile::from_toml_str(&self.text, &self.name)?)
    }
}

/// Reads an arm file.
pub fn read_arm(path: &Path) -> Result<ArmFile> {
    Source::new(&Some(path.to_owned()), &None)?.arm()
}

/// Simulates under a progress bar; a record that the excitation names is looked for in the arm file's folder.
pub fn simulate(file: &ArmFile, folder: &Path, paths: Paths) -> Result<Record, ArmError> {
    let progress = Progress::new("simulating", file.run.duration);
    let load = |name: &str| read_arm_record(folder, name, paths, &ReadOptions::default());
    run_watched(file, load, &mut |t| {
        progress.at(t);
        ControlFlow::Continue(())
    })
}
