//! Scenario files: an arm, what its controllers know, a motion, a loop, and controllers, in TOML.
//!
//! `crates/flexure-io/presets/control` has commented ones; [`scenario_preset_text`] gives their text.

use std::path::{Component, Path};

use flexure::control::{JointMoves, LoopOptions, TipPath, Trajectory, TurnCounted, square};
use flexure::error::ParameterError;
use flexure::manipulator::{Arm, ArmParameters, JointKind};
use flexure::{Error, Result as LibraryResult};
use serde::Deserialize;

use self::controller::complete;
use super::error::ArmError;
use super::file::{ArmFile, Source};
use super::presets::{PRESETS, preset};
use crate::text::read_text;

mod controller;

pub use controller::{ControllerKind, ControllerTable, EstimatorKind};

/// The names of the scenarios that come with Flexure, with their commented texts.
pub const SCENARIOS: [(&str, &str); 4] = [
    ("square", include_str!("../../presets/control/square.toml")),
    ("rest-to-rest", include_str!("../../presets/control/rest-to-rest.toml")),
    (
        "unknown-stiffness",
        include_str!("../../presets/control/unknown-stiffness.toml"),
    ),
    (
        "noisy-encoders",
        include_str!("../../presets/control/noisy-encoders.toml"),
    ),
];

/// The most seeds, controllers and points of a scenario: a run of a minute takes a tenth of a second.
const MOST_SEEDS: usize = 100_000;
const MOST_CONTROLLERS: usize = 100;

/// A checked scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// What moves.
    pub plant: ArmParameters,
    /// What the controllers know of it.
    pub model: ArmParameters,
    /// The motion.
    pub motion: Motion,
    /// The rest behind it, s.
    pub hold: f64,
    /// The loop, for the motion and the rest.
    pub options: LoopOptions,
    /// The runs of each controller, with seeds that follow that of the options.
    pub seeds: usize,
    /// The controllers, at least one.
    pub controllers: Vec<ControllerTable>,
}

/// A motion to follow.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Of the tip.
    Path(TipPath),
    /// Of the joints.
    Moves(JointMoves),
}

impl Motion {
    /// The motion as a trajectory.
    pub fn trajectory(&self) -> Box<dyn Trajectory> {
        match self {
            Motion::Path(path) => Box::new(TurnCounted::new(path.clone())),
            Motion::Moves(moves) => Box::new(moves.clone()),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    plant: ArmChoice,
    model: Option<ArmChoice>,
    trajectory: TrajectoryTable,
    #[serde(rename = "loop")]
    sampling: LoopTable,
    #[serde(default)]
    controller: Vec<ControllerTable>,
}

#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
struct ArmChoice {
    arm: String,
    stiffness: Option<f64>,
    friction: Option<bool>,
    cubic: Option<bool>,
    windup: Option<bool>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum TrajectoryKind {
    Square,
    Path,
    Moves,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Default)]
#[serde(rename_all = "kebab-case")]
enum Elbow {
    #[default]
    Right,
    Left,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TrajectoryTable {
    kind: TrajectoryKind,
    side: Option<f64>,
    points: Option<Vec<[f64; 2]>>,
    postures: Option<Vec<[f64; 2]>>,
    duration: f64,
    blend: Option<f64>,
    pause: Option<f64>,
    #[serde(default)]
    hold: f64,
    elbow: Option<Elbow>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopTable {
    sample_time: f64,
    #[serde(default)]
    delay: usize,
    torque_limit: Option<f64>,
    #[serde(default)]
    encoder_counts: f64,
    #[serde(default)]
    encoder_noise: f64,
    #[serde(default)]
    torque_noise: f64,
    #[serde(default)]
    initial_angle: f64,
    #[serde(default)]
    initial_velocity: f64,
    seed: Option<u64>,
    seeds: Option<usize>,
}

/// The text of a scenario that comes with Flexure.
///
/// # Errors
/// [`ArmError::UnknownPreset`], which lists the names.
pub fn scenario_preset_text(name: &str) -> Result<&'static str, ArmError> {
    let found = SCENARIOS.iter().find(|(n, _)| *n == name);
    found.map(|(_, text)| *text).ok_or_else(|| ArmError::UnknownPreset {
        name: name.to_owned(),
        available: SCENARIOS.iter().map(|(n, _)| *n).collect(),
    })
}

impl Scenario {
    /// Reads and checks the text of a scenario; `source_name` names it in errors, and arm files are looked for in `folder`.
    ///
    /// # Errors
    /// [`ArmError::Format`] and [`ArmError::Value`], with the file, the line and the key, also for arm files that it names.
    ///
    /// ```
    /// use flexure_io::arm::{Scenario, scenario_preset_text};
    /// let scenario = Scenario::from_toml_str(scenario_preset_text("square")?, "square", "".as_ref())?;
    /// assert_eq!(scenario.options.sampling.sample_time(), 0.01);
    /// # Ok::<(), flexure_io::arm::ArmError>(())
    /// ```
    pub fn from_toml_str(text: &str, source_name: &str, folder: &Path) -> Result<Self, ArmError> {
        let source = Source {
            text,
            name: source_name,
        };
        let file: File = source.parse()?;
        let plant = arm(&source, "plant", &file.plant, folder)?;
        let model = match &file.model {
            Some(model) => arm(&source, "model", model, folder)?,
            None => {
                let nominal = ArmChoice {
                    stiffness: None,
                    ..file.plant.clone()
                };
                arm(&source, "plant", &nominal, folder)?
            }
        };
        let motion = motion(&source, &plant, &file.trajectory)?;
        let hold = file.trajectory.hold;
        if !(0.0..=1e6).contains(&hold) {
            return Err(source.value("trajectory.hold", format!("{hold}, but must be from 0 to 1000000 s")));
        }
        let (options, seeds) = sampling(&source, &file.sampling, motion.trajectory().end() + hold)?;
        let mut controllers = file.controller;
        if controllers.is_empty() {
            return Err(source.value("controller", "missing; give at least one [[controller]] with its kind"));
        }
        if controllers.len() > MOST_CONTROLLERS {
            let reason = format!(
                "there are {}, but at most {MOST_CONTROLLERS} can be compared",
                controllers.len()
            );
            return Err(source.value("controller", reason));
        }
        for i in 0..controllers.len() {
            complete(&source, &mut controllers, i)?;
        }
        Ok(Scenario {
            plant,
            model,
            motion,
            hold,
            options,
            seeds,
            controllers,
        })
    }
}

/// The arm that a table names, with what it changes.
fn arm(source: &Source, table: &str, choice: &ArmChoice, folder: &Path) -> Result<ArmParameters, ArmError> {
    let key = |name: &str| format!("{table}.{name}");
    let known = PRESETS.iter().any(|(name, _)| *name == choice.arm);
    let mut arm = match known {
        true => preset(&choice.arm)?.arm,
        false => {
            let plain = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
            if !choice.arm.ends_with(".toml") || !Path::new(&choice.arm).components().all(plain) {
                let names: Vec<&str> = PRESETS.iter().map(|(name, _)| *name).collect();
                let reason = format!(
                    "'{}' is neither a preset ({}) nor an arm file (.toml) in the scenario's folder or below",
                    choice.arm,
                    names.join(", ")
                );
                return Err(source.value(key("arm"), reason));
            }
            let path = folder.join(&choice.arm);
            let text = read_text(&path).map_err(|error| source.value(key("arm"), error.to_string()))?;
            ArmFile::from_toml_str(&text, &choice.arm)?.arm
        }
    };
    if arm.model == JointKind::Rigid {
        return Err(source.value(key("arm"), "an arm with rigid joints, but control is of flexible ones"));
    }
    if let Some(joint) = arm.joints.iter().position(|joint| joint.locked) {
        let reason = format!("its joint {} is locked, but control moves both", joint + 1);
        return Err(source.value(key("arm"), reason));
    }
    if let Some(factor) = choice.stiffness {
        if !(1e-3..=1e3).contains(&factor) {
            return Err(source.value(
                key("stiffness"),
                format!("{factor}, but must be a factor from 0.001 to 1000"),
            ));
        }
        for joint in &mut arm.joints {
            for value in [
                &mut joint.stiffness,
                &mut joint.cubic,
                &mut joint.linear,
                &mut joint.windup,
            ] {
                *value *= factor;
            }
        }
    }
    for (part, value) in [
        (&mut arm.parts.friction, choice.friction),
        (&mut arm.parts.cubic, choice.cubic),
        (&mut arm.parts.windup, choice.windup),
    ] {
        *part = value.unwrap_or(*part);
    }
    Arm::new(arm).map_err(|error| source.value(table, error.to_string()))?;
    Ok(arm)
}

/// Puts the key of a table to an error of the library.
fn at<T>(source: &Source, table: &str, result: LibraryResult<T>) -> Result<T, ArmError> {
    result.map_err(|error| match &error {
        Error::Parameter(ParameterError::OutOfRange { name, .. }) if !name.contains(' ') => {
            source.value(format!("{table}.{name}"), error.to_string())
        }
        _ => source.value(table, error.to_string()),
    })
}

fn motion(source: &Source, arm: &ArmParameters, table: &TrajectoryTable) -> Result<Motion, ArmError> {
    let missing = |name: &str, what: &str| source.value(format!("trajectory.{name}"), format!("missing; {what}"));
    let surplus = |names: &[(&str, bool)], kind: &str| match names.iter().find(|(_, given)| *given) {
        Some((name, _)) => {
            let reason = format!("the kind \"{kind}\" has no such key; leave it out");
            Err(source.value(format!("trajectory.{name}"), reason))
        }
        None => Ok(()),
    };
    let (points, postures, side) = (table.points.is_some(), table.postures.is_some(), table.side.is_some());
    if table.kind == TrajectoryKind::Moves {
        let of_path = [
            ("points", points),
            ("side", side),
            ("blend", table.blend.is_some()),
            ("elbow", table.elbow.is_some()),
        ];
        surplus(&of_path, "moves")?;
        let Some(postures) = &table.postures else {
            return Err(missing("postures", "two or more pairs of link angles, in rad"));
        };
        let pause = table.pause.unwrap_or(0.0);
        return at(source, "trajectory", JointMoves::new(postures, table.duration, pause)).map(Motion::Moves);
    }
    let of_moves = [("postures", postures), ("pause", table.pause.is_some())];
    let points = match table.kind {
        TrajectoryKind::Square => {
            surplus(&[("points", points)], "square")?;
            surplus(&of_moves, "square")?;
            let side = table.side.ok_or_else(|| missing("side", "the square's side, in m"))?;
            if !(side > 0.0 && side.is_finite()) {
                return Err(source.value(
                    "trajectory.side",
                    format!("{side}, but must be positive and finite (in m)"),
                ));
            }
            square(side)
        }
        _ => {
            surplus(&[("side", side)], "path")?;
            surplus(&of_moves, "path")?;
            table
                .points
                .clone()
                .ok_or_else(|| missing("points", "two or more places [x, y] of the tip, in m"))?
        }
    };
    let blend = table.blend.ok_or_else(|| {
        missing(
            "blend",
            "the time in s in which a corner's change of velocity is spread",
        )
    })?;
    let left = table.elbow == Some(Elbow::Left);
    at(
        source,
        "trajectory",
        TipPath::new(&arm.links, &points, table.duration, blend, left),
    )
    .map(Motion::Path)
}

fn sampling(source: &Source, table: &LoopTable, duration: f64) -> Result<(LoopOptions, usize), ArmError> {
    let options = at(source, "loop", LoopOptions::new(duration, table.sample_time))?;
    let options = LoopOptions {
        delay: table.delay,
        torque_limit: [table.torque_limit.unwrap_or(f64::INFINITY); 2],
        quantum: table.encoder_counts,
        encoder_noise: table.encoder_noise,
        torque_noise: table.torque_noise,
        initial_spread: [table.initial_angle, table.initial_velocity],
        seed: table.seed.unwrap_or(options.seed),
        ..options
    };
    at(source, "loop", options.check())?;
    let seeds = table.seeds.unwrap_or(1);
    if !(1..=MOST_SEEDS).contains(&seeds) {
        return Err(source.value("loop.seeds", format!("{seeds}, but must be from 1 to {MOST_SEEDS}")));
    }
    Ok((options, seeds))
}
