//! A chain of links, from URDF, a chain file or a preset, to a record.

use std::iter;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use flexure::error::{IntegrationFailure, SimulationError};
use flexure::manipulator::chain::{Chain, ChainPreset, ChainSimulation};
use flexure::text::{counted, list, short, shown_path};
use flexure::{Error, Record};
use flexure_io::arm::{chain_file_of_toml, is_chain};
use flexure_io::urdf::parse_urdf;
use flexure_io::{RecordFile, check_computed, read_record, write_record};
use flexure_workbench::chains::motion_page;
use serde_json::json;

use super::base::base_motion;
use super::machine::Machine;
use super::{Arguments, Source};
use crate::arguments::{self, Usage};
use crate::files::{prepare, write_text, wrote};
use crate::output::{print, this_command};
use crate::progress::Progress;
use crate::robot;

/// How a chain is run.
#[derive(clap::Args, Default)]
#[command(next_help_heading = "Chains (URDF, chain files and their presets)")]
pub struct ChainArguments {
    /// The duration of the simulation in s. A chain needs this option.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = arguments::positive)]
    duration: Option<f64>,
    /// The time between two samples in s. A chain needs this option.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// The torques of the joints: a record with a column tau_JOINT for every driven joint, and one row for each sample
    /// of the run. Each torque is held until the next row. By default, all torques are zero.
    #[arg(long, value_name = "RECORD")]
    torques: Option<PathBuf>,
    /// The motion of the base: a record with one row for each sample of the run. The columns base_x, base_y, base_z are
    /// the position in m. The columns base_roll, base_pitch, base_yaw are turns about the x, y and z axes of the world,
    /// one after the other, in rad. A quaternion base_qx to base_qw may replace them. The base moves smoothly from row
    /// to row. Missing columns are zero.
    #[arg(long, value_name = "RECORD", conflicts_with = "free_base")]
    base_motion: Option<PathBuf>,
    /// The positions at which joints start, in rad or m: JOINT=VALUE,... All other joints start at zero.
    #[arg(
        long,
        value_name = "JOINT=VALUE,...",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    start: Vec<String>,
    /// The root link of a URDF floats freely. Without this option, it is fixed.
    #[arg(long)]
    free_base: bool,
    /// No gravity acts on a URDF. Without this option, gravity is 9.81 m/s^2 along -z.
    #[arg(long)]
    no_gravity: bool,
}

impl ChainArguments {
    /// A given option that applies to chains alone.
    pub fn given(&self) -> Option<&'static str> {
        [
            (self.duration.is_some(), "--duration"),
            (self.sample_time.is_some(), "--sample-time"),
            (self.torques.is_some(), "--torques"),
            (self.base_motion.is_some(), "--base-motion"),
            (!self.start.is_empty(), "--start"),
            (self.free_base, "--free-base"),
            (self.no_gravity, "--no-gravity"),
        ]
        .into_iter()
        .find_map(|(given, name)| given.then_some(name))
    }
}

/// The chain's preset that the arguments name.
pub fn preset(arguments: &Arguments) -> Option<ChainPreset> {
    arguments.preset.as_deref().and_then(robot::preset)
}

/// A preset's chain.
pub fn of_preset(preset: ChainPreset, arguments: &Arguments) -> Result<Machine> {
    not_urdf(arguments, "a preset")?;
    Ok(Machine(robot::rigid(Chain::new(&preset.parameters())?)?))
}

/// The chain, or flexible arm, of a file; `None` where that is a two-link arm's.
pub fn of_file(arguments: &Arguments, source: &Source) -> Result<Option<Machine>> {
    if arguments.arm.as_deref().is_some_and(robot::is_urdf) {
        let options = robot::urdf_options(arguments.chain.free_base, arguments.chain.no_gravity);
        let chain = parse_urdf(&source.text, source.name.as_ref(), &options)?;
        return Ok(Some(Machine(robot::rigid(chain)?)));
    }
    if !is_chain(&source.text) {
        return Ok(None);
    }
    not_urdf(arguments, "a chain file")?;
    Ok(Some(Machine(chain_file_of_toml(&source.text, &source.name)?)))
}

/// Refuses options of URDF.
fn not_urdf(arguments: &Arguments, source: &str) -> Result<(), Usage> {
    let given = [
        (arguments.chain.free_base, "--free-base"),
        (arguments.chain.no_gravity, "--no-gravity"),
    ];
    match given.into_iter().find(|(given, _)| *given) {
        Some((_, option)) => Err(Usage(format!(
            "{option} is for URDF; {source} says its base and its gravity itself"
        ))),
        None => Ok(()),
    }
}

/// Simulates the chain and writes its record.
pub fn run(arguments: &Arguments, chain: &Machine) -> Result<()> {
    let given = &arguments.chain;
    if arguments.write_arm.is_some() {
        return Err(Usage("--write-arm is for two-link arms; a chain's file is its own".to_owned()).into());
    }
    let (Some(out), Some(duration), Some(sample_time)) = (&arguments.out, given.duration, given.sample_time) else {
        let message = "a chain is simulated for --duration seconds in steps of --sample-time, and written to -o RECORD";
        return Err(Usage(message.to_owned()).into());
    };
    if arguments.report.is_some() {
        chain.drawn()?;
    }
    prepare(given.torques.iter().chain(&given.base_motion), [out], &arguments.report)?;
    let mut options = chain.at_rest(duration, sample_time)?;
    start(chain, &given.start, &mut options)?;
    if let Some(path) = &given.base_motion {
        chain.movable()?;
        options.base_motion = Some(base_motion(path, &options.sampling)?);
    }
    let rows = options.sampling.rows();
    // Memory limits the number of samples, and the limit of the steps follows from that number.
    let steps = options.tolerances.max_steps.max(STEPS_A_SAMPLE * rows as u64);
    options.tolerances.max_steps = steps;
    check_computed(rows, chain.columns().len())?;
    let torques = match &given.torques {
        Some(path) => torques(chain, path, rows)?,
        None => Vec::new(),
    };
    let slices: Vec<&[f64]> = torques.iter().map(Vec::as_slice).collect();
    let progress = Progress::new("simulating", duration);
    let record = chain.simulate(&slices, &options, &mut |t| {
        progress.at(t);
        ControlFlow::Continue(())
    });
    let record = record.map_err(|error| match error {
        Error::Simulation(SimulationError {
            time,
            reason: IntegrationFailure::TooManySteps { limit, .. },
        }) => anyhow!(
            "stopped at t = {} s: {limit} steps were not enough; the motion is very fast; shorten --duration, or change the chain",
            short(time)
        ),
        error => error.into(),
    })?;
    drop(progress);
    let page = match &arguments.report {
        Some(path) => Some((
            path,
            motion_page(
                chain.drawn()?,
                &record,
                sample_time,
                &name(arguments),
                Some(this_command()),
            )?,
        )),
        None => None,
    };
    write_record(out, &record)?;
    if let Some((path, page)) = page {
        write_text(path, &page)?;
    }
    said(arguments, chain, out, &record, sample_time)
}

/// What is simulated: a preset, or a file without its folder.
fn name(arguments: &Arguments) -> String {
    let file = arguments.arm.as_deref().and_then(Path::file_name);
    let preset = || arguments.preset.clone().unwrap_or_default();
    file.map_or_else(preset, |name| name.to_string_lossy().into_owned())
}

fn said(arguments: &Arguments, chain: &Machine, out: &Path, record: &Record, sample_time: f64) -> Result<()> {
    let joints = chain.joints();
    if arguments.json {
        let object = json!({
            "samples": record.len(),
            "columns": record.names(),
            "sample_time": sample_time,
            "record": out.display().to_string(),
            "report": arguments.report,
            "joints": joints,
        });
        return print(&object.to_string());
    }
    let base = match &arguments.chain.base_motion {
        Some(_) => "moving",
        None if chain.free_base() => "free",
        None => "fixed",
    };
    let text = format!(
        "wrote {} ({} samples of {} on a {base} base: {})",
        shown_path(out),
        record.len(),
        counted(joints.len(), "joint"),
        list(&joints)
    );
    let lines: Vec<String> = iter::once(text).chain(wrote(&arguments.report)).collect();
    print(&lines.join("\n"))
}

/// Steps of the integration for a sample, on average at most.
const STEPS_A_SAMPLE: u64 = 10;

/// The farthest that a joint starts, rad or m.
const FARTHEST: f64 = 1e6;

/// Puts joints, and their motors, where they start.
fn start(chain: &Machine, places: &[String], options: &mut ChainSimulation) -> Result<()> {
    let (joints, flexible) = (chain.joints(), chain.flexible());
    let (first, first_motor) = chain.places();
    let names: Vec<&str> = places
        .iter()
        .map(|place| place.split('=').next().unwrap_or_default().trim())
        .collect();
    arguments::named_once("start", &names)?;
    for place in places {
        let parsed = place.split_once('=').and_then(|(name, value)| {
            let value: f64 = value.trim().parse().ok()?;
            (value.abs() <= FARTHEST).then_some((name.trim(), value))
        });
        let Some((name, value)) = parsed else {
            return Err(Usage(format!(
                "--start has '{place}', but needs JOINT=VALUE with a value of at most {FARTHEST:e}, for example {}=0.5",
                joints.first().map_or("JOINT", String::as_str)
            ))
            .into());
        };
        let Some(joint) = joints.iter().position(|joint| joint == name) else {
            return Err(Usage(format!(
                "--start names the joint '{name}'; the joints are {}",
                list(&joints)
            ))
            .into());
        };
        options.initial[first + joint] = value;
        if flexible[joint] {
            let motor = flexible[..joint].iter().filter(|f| **f).count();
            options.initial[first_motor + motor] = value;
        }
    }
    Ok(())
}

/// The torques of all driven joints, zero where the record has no column.
fn torques(chain: &Machine, path: &Path, rows: usize) -> Result<Vec<Vec<f64>>> {
    let file = read_record(path)?;
    let names: Vec<String> = chain.driven().into_iter().map(|joint| format!("tau_{joint}")).collect();
    if !names.iter().any(|name| file.record.column(name).is_ok()) {
        bail!(
            "{}: no column is the torque of a joint; they are called {}",
            shown_path(path),
            list(&names)
        );
    }
    columns_or_zeros(&file, &names, rows)
}

/// These columns of a record with one row an instant of the run; those that are missing are zero.
pub fn columns_or_zeros(file: &RecordFile, names: &[impl AsRef<str>], rows: usize) -> Result<Vec<Vec<f64>>> {
    let samples = file.record.len();
    if samples != rows {
        bail!(
            "{}: there are {samples} rows, but the run has {rows} instants",
            shown_path(&file.path)
        );
    }
    let column = |name: &str| match file.record.column(name) {
        Ok(_) => Ok(file.finite(name)?.to_vec()),
        Err(_) => Ok(vec![0.0; rows]),
    };
    names.iter().map(|name| column(name.as_ref())).collect()
}
