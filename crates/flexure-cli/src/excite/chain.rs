//! References for the joints of a chain: as large as the limits allow, from rest to rest.

use anyhow::{Result, anyhow, bail};
use flexure::Record;
use flexure::manipulator::chain::{JointPath, NeededDrive};
use flexure::text::{counted, shown_path};
use flexure_io::{check_computed, write_record};
use flexure_workbench::lines::Lines;
use flexure_workbench::text::{joint_name, number};
use serde_json::json;

use super::rehearsal::{Rehearsal, rehearse_chain};
use super::{Arguments, Extremes, SignalKind, signals};
use crate::arguments::Usage;
use crate::output::{print, print_result};
use crate::progress::spinning;
use crate::robot::Robot;

/// The share of a reference in which it starts, and in which it stops.
const FADE: f64 = 0.05;
/// The amplitude of a joint without a limit of its position, rad or m.
const UNLIMITED: f64 = 1.0;
/// References use this share of the range of positions.
const INSIDE: f64 = 0.95;
/// Shares of the integrated signal that are tried.
const BLENDS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Rounds of making the references smaller.
const ROUNDS: usize = 60;
/// A reference that needs too much becomes smaller by at least this factor, and aims at this share of its limit.
const SMALLER: f64 = 0.97;
const AIM: f64 = 0.98;

/// A chain's experiment.
pub struct ChainTrial<'a> {
    pub robot: &'a Robot,
    pub paths: Vec<JointPath>,
    pub drives: Vec<NeededDrive>,
    pub limits: Vec<Extremes>,
    reached: Vec<Extremes>,
}

/// Runs the command for a chain.
pub fn run(arguments: &Arguments, robot: &Robot) -> Result<()> {
    if arguments.kind == SignalKind::Multilevel {
        let message = "--kind multilevel jumps, which no joint of a chain can follow; take multisine or chirp";
        return Err(Usage(message.to_owned()).into());
    }
    let joints = robot.chain.chain().joints();
    let rows = (arguments.duration / arguments.sample_time).round() as usize + 1;
    check_computed(rows, 12 * joints.len())?;
    let trial = spinning("searching", || largest(arguments, robot, rows))?;
    let rehearsal = spinning("rehearsing", || rehearse_chain(&trial, arguments))?;
    let instants = (0..rows).map(|k| k as f64 * arguments.sample_time).collect();
    let references = joints
        .iter()
        .zip(&trial.paths)
        .map(|(joint, path)| (format!("r_{joint}"), path.position.clone()));
    let record = Record::new(std::iter::once(("t".to_owned(), instants)).chain(references))?;
    write_record(&arguments.out, &record)?;
    if arguments.json {
        return print(&json_of(arguments, &trial, &rehearsal, rows).to_string());
    }
    let mut lines = trial.summary();
    rehearsal.write(&mut lines);
    if !trial.robot.chain.has_drives() {
        lines.note("the chain has no drives: the torques are those of its links alone; lower --max-torque by what the drives' inertia and friction need");
    }
    lines.note("what the arm may hit is not checked: run the reference slowly first");
    let wrote = format!(
        "wrote {} ({} of references of {})",
        shown_path(&arguments.out),
        counted(rows, "sample"),
        counted(joints.len(), "joint")
    );
    print_result(&lines, [wrote])
}

fn json_of(arguments: &Arguments, trial: &ChainTrial, rehearsal: &Rehearsal, rows: usize) -> serde_json::Value {
    let reached = |of: fn(&Extremes) -> f64| trial.reached.iter().map(of).collect::<Vec<_>>();
    json!({
        "record": arguments.out.display().to_string(),
        "samples": rows,
        "sample_time": arguments.sample_time,
        "signal": "reference",
        "joints": trial.robot.chain.chain().joints(),
        "crest_factor": trial.paths.iter().map(|path| signals::crest_factor(&path.position)).collect::<Vec<_>>(),
        "largest_torque": reached(|r| r.torque),
        "largest_position": reached(|r| r.position),
        "largest_velocity": reached(|r| r.velocity),
        "can": rehearsal.can,
        "cannot": rehearsal.cannot,
    })
}

/// The limits of every joint, and the position about which it moves: the middle of its range, or zero.
fn limits(arguments: &Arguments, robot: &Robot) -> Result<(Vec<Extremes>, Vec<f64>)> {
    let chain = robot.chain.chain();
    let n = chain.joints().len();
    let each = |name: &str, given: &[f64]| match *given {
        [] => Ok(vec![f64::INFINITY; n]),
        [same] => Ok(vec![same; n]),
        _ if given.len() == n => Ok(given.to_vec()),
        _ => Err(Usage(format!(
            "--{name}: one number, or one for each of the {n} joints of {}",
            robot.name
        ))),
    };
    let torque = each("max-torque", &arguments.max_torque)?;
    let position = each("max-position", &arguments.max_position)?;
    let velocity = each("max-velocity", &arguments.max_velocity)?;
    let centres: Vec<f64> = chain
        .limits()
        .iter()
        .map(|&[low, high]| {
            if (high - low).is_finite() {
                0.5 * (low + high)
            } else {
                0.0
            }
        })
        .collect();
    let limits = (0..n).map(|i| {
        let [low, high] = chain.limits()[i];
        let reach = INSIDE * (high - centres[i]).min(centres[i] - low);
        if !(reach > 0.0) {
            let name = &chain.joints()[i];
            bail!(
                "{}: joint '{name}' starts at 0, outside its limits {low} to {high}; give it both limits",
                robot.name
            );
        }
        Ok(Extremes {
            torque: torque[i],
            position: position[i].min(reach),
            velocity: velocity[i],
        })
    });
    Ok((limits.collect::<Result<_>>()?, centres))
}

/// The largest references that keep the limits.
fn largest<'a>(arguments: &Arguments, robot: &'a Robot, rows: usize) -> Result<ChainTrial<'a>> {
    let (limits, centres) = limits(arguments, robot)?;
    let units = (limits.iter().enumerate())
        .map(|(joint, limits)| unit(arguments, joint, rows, limits))
        .collect::<Result<Vec<JointPath>>>()?;
    let mut scales = vec![1.0; units.len()];
    for _ in 0..ROUNDS {
        let paths: Vec<JointPath> = units
            .iter()
            .zip(&scales)
            .zip(&centres)
            .map(|((unit, scale), centre)| scaled(unit, *scale, *centre))
            .collect();
        let drives = robot.chain.needed_drives(&paths, arguments.sample_time)?;
        let reached = |i: usize| Extremes {
            torque: largest_of(&drives[i].torque, 0.0),
            position: largest_of(&paths[i].position, centres[i]),
            velocity: largest_of(&paths[i].velocity, 0.0),
        };
        let reached: Vec<Extremes> = (0..paths.len()).map(reached).collect();
        let shares: Vec<f64> = reached
            .iter()
            .zip(&limits)
            .map(|(reached, limits)| reached.torque / limits.torque)
            .collect();
        if shares.iter().all(|share| *share <= 1.0) {
            return Ok(ChainTrial {
                robot,
                paths,
                drives,
                limits,
                reached,
            });
        }
        // A joint bears what all others do: all become smaller, and those above their limits more.
        for (scale, share) in scales.iter_mut().zip(&shares) {
            *scale *= SMALLER * (AIM / share).clamp(0.8, 1.0);
        }
    }
    Err(too_heavy(robot, &centres, &limits))
}

/// Why no reference keeps the limits of the torque.
fn too_heavy(robot: &Robot, centres: &[f64], limits: &[Extremes]) -> anyhow::Error {
    let rest = |centre: &f64| JointPath {
        position: vec![*centre],
        velocity: vec![0.0],
        acceleration: vec![0.0],
    };
    let holding = robot
        .chain
        .needed_drives(&centres.iter().map(rest).collect::<Vec<_>>(), 1.0)
        .unwrap_or_default();
    let each = robot.chain.chain().joints().iter().zip(holding.iter().zip(limits));
    let heavy = each.filter_map(|(joint, (drive, limits))| {
        let torque = drive.torque[0].abs();
        (torque > limits.torque).then(|| {
            format!(
                "joint '{joint}' needs {torque:.3} of {} to hold the arm at rest",
                limits.torque
            )
        })
    });
    let heavy: Vec<String> = heavy.collect();
    match heavy.is_empty() {
        true => {
            anyhow!("no amplitude was found that keeps the limits of the torque; raise --max-torque, or lower --f-max")
        }
        false => anyhow!("{}: {}; raise --max-torque", robot.name, heavy.join("; ")),
    }
}

/// A reference about zero that starts and stops at rest, as large as the limits of position and velocity allow.
///
/// A position with harmonics of equal size is fast, but does not go far. The integral of this signal is slow, and goes far. Of some blends of
/// both, the one is taken that comes nearest to both limits.
fn unit(arguments: &Arguments, joint: usize, rows: usize, limits: &Extremes) -> Result<JointPath> {
    let fast = signals::of_joint(rows, joint, arguments)?;
    let slow = integral(&fast);
    let reach = if limits.position.is_finite() {
        limits.position
    } else {
        UNLIMITED
    };
    let mut best: Option<(f64, JointPath)> = None;
    for blend in BLENDS {
        let both = fast.iter().zip(&slow);
        let path = from_rest_to_rest(
            both.map(|(fast, slow)| (1.0 - blend) * fast + blend * slow).collect(),
            arguments.sample_time,
        );
        let [position, velocity] = [&path.position, &path.velocity].map(|x| largest_of(x, 0.0));
        let scale = (reach / position).min(limits.velocity / velocity);
        let used = match limits.velocity.is_finite() {
            true => scale * position / reach * (scale * velocity / limits.velocity),
            false => scale * position / reach,
        };
        if best.as_ref().is_none_or(|(most, _)| used > *most) {
            best = Some((used, scaled(&path, scale, 0.0)));
        }
    }
    best.map(|(_, path)| path)
        .ok_or_else(|| anyhow!("no reference was found"))
}

/// The sums of a signal without its mean, of largest value one.
fn integral(x: &[f64]) -> Vec<f64> {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let about = mean(x);
    let sums: Vec<f64> = x
        .iter()
        .scan(0.0, |sum, value| {
            *sum += value - about;
            Some(*sum)
        })
        .collect();
    let centre = mean(&sums);
    let largest = largest_of(&sums, centre);
    sums.iter().map(|sum| (sum - centre) / largest).collect()
}

/// A path that fades in and out.
fn from_rest_to_rest(mut position: Vec<f64>, step: f64) -> JointPath {
    let rows = position.len();
    let fade = (FADE * rows as f64).max(1.0);
    for (k, value) in position.iter_mut().enumerate() {
        let near = k.min(rows - 1 - k) as f64 / fade;
        *value *= smooth(near.min(1.0));
    }
    let velocity = slopes(&position, step);
    JointPath {
        acceleration: slopes(&velocity, step),
        velocity,
        position,
    }
}

fn largest_of(x: &[f64], about: f64) -> f64 {
    x.iter().fold(0.0_f64, |m, v| m.max((v - about).abs()))
}

/// From 0 to 1 without a jump of velocity, acceleration and jerk.
fn smooth(x: f64) -> f64 {
    x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))
}

/// The derivative of a signal that is at rest at both ends, by central differences of order 4.
fn slopes(x: &[f64], step: f64) -> Vec<f64> {
    let at = |k: isize| x[k.clamp(0, x.len() as isize - 1) as usize];
    let slope = |k: isize| (8.0 * (at(k + 1) - at(k - 1)) - (at(k + 2) - at(k - 2))) / (12.0 * step);
    (0..x.len() as isize).map(slope).collect()
}

/// A path this many times as large, about a centre.
fn scaled(unit: &JointPath, scale: f64, centre: f64) -> JointPath {
    let times = |x: &[f64]| x.iter().map(|v| scale * v).collect();
    JointPath {
        position: unit.position.iter().map(|v| centre + scale * v).collect(),
        velocity: times(&unit.velocity),
        acceleration: times(&unit.acceleration),
    }
}

impl ChainTrial<'_> {
    /// What each joint reaches, one line each.
    fn summary(&self) -> Lines {
        let of = |value: f64, limit: f64, unit: &str| match limit.is_finite() {
            true => format!("{value:.3} of {} {unit}", number(limit)),
            false => format!("{value:.3} {unit}"),
        };
        let chain = self.robot.chain.chain();
        let mut lines = Lines::new();
        let both = self.reached.iter().zip(&self.limits).zip(&self.paths);
        for (((reached, limits), path), (joint, prismatic)) in both.zip(chain.joints().iter().zip(chain.prismatic())) {
            let [effort, place] = if prismatic { ["N", "m"] } else { ["N m", "rad"] };
            lines.sentence(format!(
                "{}: crest factor {:.2}; torque up to {}, position {} from {:.3} {place}, velocity {}",
                joint_name(joint),
                signals::crest_factor(&path.position),
                of(reached.torque, limits.torque, effort),
                of(reached.position, limits.position, place),
                path.position[0],
                of(reached.velocity, limits.velocity, &format!("{place}/s"))
            ));
        }
        lines
    }
}
