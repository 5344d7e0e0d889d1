//! `flexure excite`: a record that excites an arm as much as its limits allow, and what it can show.

mod chain;
mod rehearsal;
mod search;
mod signals;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{ArgGroup, ValueEnum};
use flexure::Record;
use flexure::manipulator::{Arm, JointKind, LinkDynamics, SimulationOptions};
use flexure::text::shown_path;
use flexure_io::arm::ArmFile;
use flexure_io::{check_computed, write_record};
use flexure_workbench::lines::Lines;
use serde_json::{Value, json};

use crate::arguments::{self, Usage};
use crate::files::prepare;
use crate::output::{print, print_result};
use crate::progress::spinning;
use crate::robot::{self, Robot};
use crate::simulate::{Source, arm_or_chain};
use rehearsal::Rehearsal;
use search::{Gains, Setup, Trial};

/// Write torques, or references for position servos, that excite an arm within its limits.
///
/// The signals are as large as the limits allow (--max-torque, --max-position, --max-velocity). To find this size, the
/// command simulates the arm. Every joint that is not locked gets a signal of its own. Then the command rehearses the
/// experiment: it simulates a record with noise, and `flexure joint` identifies the arm from this record. The printed
/// text says what such a record can tell and what it cannot.
///
/// A chain, from a URDF or a chain file, gets references for all its joints. Each joint moves about the middle of its
/// range. The torques that the references need are computed from the inertias of the chain.
#[derive(clap::Args)]
#[command(group(ArgGroup::new("source").required(true).args(["arm", "preset"])))]
#[command(after_help = "Examples:\n  \
    flexure excite --preset space-arm --max-torque 40,20 --max-velocity 2 -o excitation.csv\n  \
    flexure excite arm.toml --kind chirp --f-max 3 --max-torque 10 --max-position 1.5 -o chirp.csv\n  \
    flexure excite robot.urdf --max-torque 80 --max-velocity 1 --f-max 1 -o reference.csv\n  \
    flexure excite arm.toml --reference --f-max 1 --max-torque 40 --max-position 0.5 -o reference.csv\n\n\
    To simulate an arm under these torques, write into its arm file:\n  \
    [excitation]\n  \
    kind = \"record\"\n  \
    file = \"excitation.csv\"")]
pub struct Arguments {
    /// The arm file, or a chain of links: a URDF or a chain file.
    #[arg(value_name = "ARM.toml|ROBOT.urdf")]
    arm: Option<PathBuf>,
    /// A preset in place of a file. See flexure simulate --help for the names.
    #[arg(long, value_name = "NAME", value_parser = arm_or_chain)]
    preset: Option<String>,
    /// The kind of signal.
    #[arg(long, value_enum, default_value = "multisine")]
    kind: SignalKind,
    /// Write reference angles for position servos of the motors, instead of torques. For a chain, references are always
    /// written.
    #[arg(long)]
    reference: bool,
    /// No gravity acts on a URDF. Without this option, gravity is 9.81 m/s^2 along -z.
    #[arg(long, help_heading = "Experiment")]
    no_gravity: bool,
    /// The largest torque of the motors in N m (N for a prismatic joint): one number, or one for each joint.
    #[arg(long, value_name = "TAU[,TAU]", value_delimiter = ',', required = true, allow_hyphen_values = true, value_parser = arguments::physical)]
    max_torque: Vec<f64>,
    /// The largest distance of each joint from where it starts, in rad (m for a prismatic joint): one number, or one
    /// for each joint. By default, an arm has no such limit. The joints of a chain always stay within their ranges.
    #[arg(long, value_name = "Q[,Q]", value_delimiter = ',', allow_hyphen_values = true, value_parser = arguments::physical)]
    max_position: Vec<f64>,
    /// The largest velocity of each joint, in rad/s (m/s for a prismatic joint): one number, or one for each joint. It
    /// is the velocity of a link relative to the link before it. By default, there is no limit.
    #[arg(long, value_name = "V[,V]", value_delimiter = ',', allow_hyphen_values = true, value_parser = arguments::physical)]
    max_velocity: Vec<f64>,
    /// The duration of the signal in s.
    #[arg(long, value_name = "S", default_value = "60", allow_hyphen_values = true, value_parser = arguments::positive)]
    duration: f64,
    /// The sample time of the signal in s.
    #[arg(long, help_heading = "Experiment", value_name = "S", default_value = "0.001", allow_hyphen_values = true, value_parser = arguments::positive)]
    sample_time: f64,
    /// The lowest frequency of a multisine or chirp, in Hz.
    #[arg(long, value_name = "HZ", default_value = "0.05", allow_hyphen_values = true, value_parser = arguments::positive)]
    f_min: f64,
    /// The highest frequency of a multisine or chirp, in Hz.
    #[arg(long, value_name = "HZ", default_value = "3", allow_hyphen_values = true, value_parser = arguments::positive)]
    f_max: f64,
    /// The time for which a multilevel signal holds each level, in s.
    #[arg(long, value_name = "S", default_value = "0.5", allow_hyphen_values = true, value_parser = arguments::positive)]
    hold: f64,
    /// The number of levels of a multilevel signal.
    #[arg(long, value_name = "N", default_value = "7", value_parser = clap::value_parser!(u16).range(2..))]
    levels: u16,
    /// The seed of all random numbers: of the phases or levels of the signal, and of the noise in the rehearsal.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// The standard deviation of the encoder noise in the rehearsal, in rad.
    #[arg(long, value_name = "RAD", default_value = "1e-5", allow_hyphen_values = true, value_parser = arguments::positive)]
    encoder_noise: f64,
    /// The standard deviation of the torque noise in the rehearsal, as a share of --max-torque.
    #[arg(long, value_name = "SHARE", default_value = "0.01", allow_hyphen_values = true, value_parser = arguments::positive)]
    torque_noise: f64,
    /// Write the record to this file: .csv or .parquet. Torques have the columns t, tau1, tau2. References have the
    /// columns t, r1, r2. For a chain, the columns are t and r_JOINT for each joint.
    #[arg(short = 'o', long = "out", value_name = "RECORD")]
    out: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SignalKind {
    /// Harmonics of equal size, with phases for a low crest factor.
    Multisine,
    /// A sine of rising frequency.
    Chirp,
    /// Random levels. Each level is held for the time --hold. Not for a chain.
    Multilevel,
}

impl Arguments {
    /// The chain, where one is given.
    fn robot(&self) -> Result<Option<Robot>> {
        match (&self.arm, &self.preset) {
            (Some(path), _) if Robot::is_chain(path)? => Ok(Some(Robot::read(path, self.no_gravity)?)),
            (_, Some(name)) if robot::preset(name).is_some() => Ok(Some(Robot::read(name.as_ref(), self.no_gravity)?)),
            _ => Ok(None),
        }
    }
}

/// Absolute values of a joint: its limits, infinite where there is none, or the largest that it reaches.
#[derive(Debug, Clone, Copy, Default)]
struct Extremes {
    /// The torque, N m.
    torque: f64,
    /// The distance from the start, rad.
    position: f64,
    /// The velocity, rad/s.
    velocity: f64,
}

impl Extremes {
    /// The limits of both joints.
    fn limits(arguments: &Arguments) -> Result<[Extremes; 2], Usage> {
        let each = |name: &str, given: &[f64]| match *given {
            [] => Ok([f64::INFINITY; 2]),
            [same] => Ok([same; 2]),
            [first, second] => Ok([first, second]),
            _ => Err(Usage(format!(
                "--{name}: one number, or one for each of the two joints"
            ))),
        };
        let torque = each("max-torque", &arguments.max_torque)?;
        let position = each("max-position", &arguments.max_position)?;
        let velocity = each("max-velocity", &arguments.max_velocity)?;
        Ok([0, 1].map(|i| Extremes {
            torque: torque[i],
            position: position[i],
            velocity: velocity[i],
        }))
    }

    /// The largest share of a limit.
    fn share(&self, limits: &Extremes) -> f64 {
        let torque = self.torque / limits.torque;
        torque
            .max(self.position / limits.position)
            .max(self.velocity / limits.velocity)
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    prepare(&arguments.arm, [&arguments.out], [])?;
    if let Some(robot) = arguments.robot()? {
        return chain::run(arguments, &robot);
    }
    if arguments.no_gravity {
        return Err(Usage("--no-gravity is for URDF; no gravity acts on an arm file's arm".to_owned()).into());
    }
    let limits = Extremes::limits(arguments)?;
    let file = Source::new(&arguments.arm, &arguments.preset)?.arm()?;
    let arm = Arm::new(file.arm)?;
    if arm.model() == JointKind::Rigid {
        bail!(
            "the arm's joints are rigid; `flexure excite` rehearses the identification of flexible ones (model = \"nonlinear\" or \"linear\")"
        );
    }
    let free = file.arm.joints.map(|j| !j.locked);
    if free == [false; 2] {
        bail!("both joints of the arm are locked: there is nothing to excite; remove 'locked = true' from one");
    }
    let options = SimulationOptions {
        initial: file.initial,
        ..SimulationOptions::new(arguments.duration, arguments.sample_time)?
    };
    // Signals, motion and rehearsal.
    check_computed(options.sampling.rows(), 30)?;
    let setup = Setup {
        arm: &arm,
        options: &options,
        free,
        limits,
        gains: gains(&arm, &file, arguments),
    };
    let trial = spinning("simulating", || search::largest(&setup, arguments))?;
    let names = match arguments.reference {
        true => ["t", "r1", "r2"],
        false => ["t", "tau1", "tau2"],
    };
    let record = Record::new([
        (names[0], trial.motion.column("t")?.to_vec()),
        (names[1], trial.signals[0].clone()),
        (names[2], trial.signals[1].clone()),
    ])?;
    let rehearsal = spinning("rehearsing", || {
        rehearsal::rehearse(&trial.motion, free, limits, arguments)
    })?;
    write_record(&arguments.out, &record)?;
    if arguments.json {
        return print(&json_of(&trial, &setup, &rehearsal, arguments).to_string());
    }
    let mut lines = summary(&trial, &setup, arguments.reference);
    rehearsal.write(&mut lines);
    let wrote = format!(
        "wrote {} ({} samples of {})",
        shown_path(&arguments.out),
        record.len(),
        names.join(", ")
    );
    print_result(&lines, [wrote])
}

fn json_of(trial: &Trial, setup: &Setup, rehearsal: &Rehearsal, arguments: &Arguments) -> Value {
    let reached = |of: fn(&Extremes) -> f64| trial.reached.iter().map(of).collect::<Vec<_>>();
    let gains = setup.gains.map(|g| [g.kp, g.kd]);
    let crest = [0, 1].map(|i| signals::crest_factor(&trial.signals[i]));
    json!({
        "record": arguments.out.display().to_string(),
        "samples": trial.signals[0].len(),
        "sample_time": arguments.sample_time,
        "signal": if arguments.reference { "reference" } else { "torque" },
        "gains": arguments.reference.then_some(gains),
        "crest_factor": crest,
        "largest_torque": reached(|r| r.torque),
        "largest_position": reached(|r| r.position),
        "largest_velocity": reached(|r| r.velocity),
        "can": rehearsal.can,
        "cannot": rehearsal.cannot,
    })
}

/// What each joint reaches, one line each.
fn summary(trial: &Trial, setup: &Setup, reference: bool) -> Lines {
    let of = |value: f64, limit: f64, unit: &str| match limit.is_finite() {
        true => format!("{value:.3} of {limit} {unit}"),
        false => format!("{value:.3} {unit}"),
    };
    let mut lines = Lines::new();
    for i in (0..2).filter(|&i| setup.free[i]) {
        let (reached, limits) = (trial.reached[i], setup.limits[i]);
        lines.sentence(format!(
            "Joint {}: crest factor {:.2}; torque up to {}, link {} from its start, velocity {}",
            i + 1,
            signals::crest_factor(&trial.signals[i]),
            of(reached.torque, limits.torque, "N m"),
            of(reached.position, limits.position, "rad"),
            of(reached.velocity, limits.velocity, "rad/s")
        ));
        if reference {
            let Gains { kp, kd } = setup.gains[i];
            let servo = format!(
                "in a servo with torque = kp (reference - motor angle) - kd motor velocity, kp = {kp:.4} N m/rad, kd = {kd:.4} N m s/rad"
            );
            lines.deeper(|lines| lines.sentence(servo));
        }
    }
    lines
}

/// Gains of servos that follow the reference well and are far from instability by sampling.
fn gains(arm: &Arm, file: &ArmFile, arguments: &Arguments) -> [Gains; 2] {
    let mass = LinkDynamics::inertia(&arm.link_dynamics(), file.initial.q[1]);
    [0, 1].map(|i| {
        let motor = file.arm.joints[i].motor_inertia;
        let inertia = mass[i][i] + motor;
        let sampled = 0.15 * motor / (arguments.sample_time * inertia);
        let pace = (4.0 * std::f64::consts::PI * arguments.f_max).min(sampled);
        Gains {
            kp: inertia * pace * pace,
            kd: 2.0 * inertia * pace,
        }
    })
}
