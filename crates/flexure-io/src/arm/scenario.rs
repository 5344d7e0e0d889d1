//! Scenario files: an arm, what its controllers know, a motion, a loop, and controllers, in TOML.
//!
//! `crates/flexure-io/presets/control` has commented ones; [`scenario_preset_text`] gives their text.

mod body;
mod controllers;

use std::path::{Path, PathBuf};

use flexure::control::flexible_link::ModelResponse;
use flexure::control::{JointMoves, LoopOptions, TipPath, Trajectory, TurnCounted, square};
use flexure::error::ParameterError;
use flexure::manipulator::Link;
use flexure::text::exact;
use flexure::{Error, Result as LibraryResult};
use serde::Deserialize;

use super::error::ArmError;
use super::file::Source;
use super::values::pairs;

pub use body::Body;
use body::BodyTable;
use controllers::complete;
pub use controllers::{ControllerKind, ControllerTable, EstimatorKind, unusable_name};

/// The names of the scenarios that come with Flexure, with their commented texts.
pub const SCENARIOS: [(&str, &str); 5] = [
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
    (
        "flexible-link",
        include_str!("../../presets/control/flexible-link.toml"),
    ),
];

/// The most seeds and controllers of a scenario. The first runs of all controllers are kept, so their samples are limited too: 2 GiB.
const MOST_SEEDS: usize = 100_000;
const MOST_CONTROLLERS: usize = 100;
const MOST_SAMPLES: usize = 10_000_000;

/// The most places or postures of a motion.
const MOST_PLACES: usize = 10_000;

/// A checked scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// What moves, and what the controllers know of it.
    pub body: Body,
    /// The motion.
    pub motion: Motion,
    /// The rest after the motion, s.
    pub hold: f64,
    /// The loop, for the motion and the rest.
    pub options: LoopOptions,
    /// The runs of each controller, with seeds that follow that of the options.
    pub seeds: usize,
    /// The controllers, at least one.
    pub controllers: Vec<ControllerTable>,
    /// The arm files that the scenario names.
    pub files: Vec<PathBuf>,
}

/// A motion to follow.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// A path of the tip.
    Path(TipPath),
    /// Moves of the joints.
    Moves(JointMoves),
    /// Commands of a flexible link.
    Commands(ModelResponse),
}

impl Motion {
    /// The motion as a trajectory.
    pub fn trajectory(&self) -> Box<dyn Trajectory> {
        match self {
            Motion::Path(path) => Box::new(TurnCounted::new(path.clone())),
            Motion::Moves(moves) => Box::new(moves.clone()),
            Motion::Commands(commands) => Box::new(commands.clone()),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    plant: BodyTable,
    model: Option<BodyTable>,
    trajectory: TrajectoryTable,
    #[serde(rename = "loop")]
    sampling: LoopTable,
    #[serde(default)]
    controller: Vec<ControllerTable>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum TrajectoryKind {
    Square,
    Path,
    Moves,
    Commands,
}

impl TrajectoryKind {
    /// Its name in files, and the keys that it has besides the duration.
    fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            TrajectoryKind::Square => ("square", &["side", "blend", "elbow"]),
            TrajectoryKind::Path => ("path", &["points", "blend", "elbow"]),
            TrajectoryKind::Moves => ("moves", &["postures", "pause"]),
            TrajectoryKind::Commands => ("commands", &["angles", "frequency"]),
        }
    }
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
    #[serde(default, deserialize_with = "pairs")]
    points: Option<Vec<[f64; 2]>>,
    #[serde(default, deserialize_with = "pairs")]
    postures: Option<Vec<[f64; 2]>>,
    angles: Option<Vec<f64>>,
    frequency: Option<f64>,
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
    /// The links from the base to the tip; a flexible link is the first, and the second has length zero.
    pub fn links(&self) -> [Link; 2] {
        self.body.links()
    }

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
        let body = Body::new(&source, &file.plant, file.model.as_ref(), folder)?;
        let motion = motion(&source, &body, &file.trajectory)?;
        let hold = file.trajectory.hold;
        if !(0.0..=1e6).contains(&hold) {
            let reason = format!("{}, but must be from 0 to 1000000 s", exact(hold));
            return Err(source.value("trajectory.hold", reason));
        }
        if file.trajectory.duration < file.sampling.sample_time {
            let reason = format!(
                "{}, but must be at least one sample time (in s)",
                exact(file.trajectory.duration)
            );
            return Err(source.value("trajectory.duration", reason));
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
        let samples = options.sampling.rows().saturating_mul(controllers.len());
        if samples > MOST_SAMPLES {
            let reason = format!(
                "{}, which makes {samples} samples of all controllers together, but they can be at most {MOST_SAMPLES}",
                exact(file.sampling.sample_time)
            );
            return Err(source.value("loop.sample_time", reason));
        }
        for i in 0..controllers.len() {
            complete(&source, &body, &mut controllers, i)?;
        }
        Ok(Scenario {
            body,
            motion,
            hold,
            options,
            seeds,
            controllers,
            files: [Some(&file.plant), file.model.as_ref()]
                .into_iter()
                .flatten()
                .filter_map(|table| table.arm.as_ref().filter(|name| name.ends_with(".toml")))
                .map(|name| folder.join(name))
                .collect(),
        })
    }
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

/// The error for a missing key of the trajectory.
fn missing(source: &Source, key: &str, what: &str) -> ArmError {
    source.value(format!("trajectory.{key}"), format!("missing; {what}"))
}

/// Refuses keys that the trajectory's kind does not have, and lists that are too short or too long.
fn check_trajectory(source: &Source, table: &TrajectoryTable) -> Result<(), ArmError> {
    let (kind, keys) = table.kind.keys();
    let given = [
        ("side", table.side.is_some()),
        ("points", table.points.is_some()),
        ("postures", table.postures.is_some()),
        ("angles", table.angles.is_some()),
        ("blend", table.blend.is_some()),
        ("pause", table.pause.is_some()),
        ("elbow", table.elbow.is_some()),
        ("frequency", table.frequency.is_some()),
    ];
    if let Some((name, _)) = given.iter().find(|(name, given)| *given && !keys.contains(name)) {
        let reason = format!("the kind \"{kind}\" has no such key; leave it out");
        return Err(source.value(format!("trajectory.{name}"), reason));
    }
    let lists = [
        ("points", 2, table.points.as_ref().map(Vec::len)),
        ("postures", 2, table.postures.as_ref().map(Vec::len)),
        ("angles", 1, table.angles.as_ref().map(Vec::len)),
    ];
    for (name, least, count) in lists {
        if let Some(count) = count.filter(|count| !(least..=MOST_PLACES).contains(count)) {
            let reason = format!("there are {count}, but must be from {least} to {MOST_PLACES}");
            return Err(source.value(format!("trajectory.{name}"), reason));
        }
    }
    Ok(())
}

fn motion(source: &Source, body: &Body, table: &TrajectoryTable) -> Result<Motion, ArmError> {
    check_trajectory(source, table)?;
    let links = match (body, table.kind) {
        (Body::Link { .. }, TrajectoryKind::Commands) => return commands(source, table),
        (Body::Link { .. }, _) => {
            let (kind, _) = table.kind.keys();
            let reason = format!("\"{kind}\" is for two-link arms; a flexible link has \"commands\"");
            return Err(source.value("trajectory.kind", reason));
        }
        (Body::Arm { .. }, TrajectoryKind::Commands) => {
            let reason = "\"commands\" is for a flexible link; an arm has \"square\", \"path\" or \"moves\"";
            return Err(source.value("trajectory.kind", reason));
        }
        (Body::Arm { plant, .. }, _) => &plant.links,
    };
    let points = match table.kind {
        TrajectoryKind::Square => square(side(source, table)?),
        TrajectoryKind::Path => {
            let points = table.points.clone();
            points.ok_or_else(|| missing(source, "points", "two or more places [x, y] of the tip, in m"))?
        }
        TrajectoryKind::Moves | TrajectoryKind::Commands => {
            let Some(postures) = &table.postures else {
                return Err(missing(source, "postures", "two or more pairs of link angles, in rad"));
            };
            let pause = table.pause.unwrap_or(0.0);
            return at(source, "trajectory", JointMoves::new(postures, table.duration, pause)).map(Motion::Moves);
        }
    };
    let blend = table.blend.ok_or_else(|| {
        let what = "the time in s in which a corner's change of velocity is spread";
        missing(source, "blend", what)
    })?;
    let left = table.elbow == Some(Elbow::Left);
    let path = TipPath::new(links, &points, table.duration, blend, left);
    at(source, "trajectory", path).map(Motion::Path)
}

/// The commands of a flexible link.
fn commands(source: &Source, table: &TrajectoryTable) -> Result<Motion, ArmError> {
    let angles = table.angles.as_ref().ok_or_else(|| {
        let what = "the hub's angles that are commanded one after the other, in rad";
        missing(source, "angles", what)
    })?;
    let frequency = table
        .frequency
        .ok_or_else(|| missing(source, "frequency", "that of the reference model, in rad/s"))?;
    let model = ModelResponse::new(angles, table.duration, frequency);
    at(source, "trajectory", model).map(Motion::Commands)
}

/// The side of a square, in m.
fn side(source: &Source, table: &TrajectoryTable) -> Result<f64, ArmError> {
    match table.side {
        None => Err(missing(source, "side", "the square's side, in m")),
        Some(side) if side > 0.0 && side.is_finite() => Ok(side),
        Some(side) => {
            let reason = format!("{}, but must be positive and finite (in m)", exact(side));
            Err(source.value("trajectory.side", reason))
        }
    }
}

fn sampling(source: &Source, table: &LoopTable, duration: f64) -> Result<(LoopOptions, usize), ArmError> {
    let options = LoopOptions::new(duration, table.sample_time).map_err(|error| match &error {
        // The duration in this error is that of the trajectory.
        Error::Parameter(ParameterError::OutOfRange {
            name,
            value,
            requirement,
        }) if name == "duration" => {
            let reason = format!(
                "the motion with its rest takes {} s, but it must take {requirement}",
                exact(*value)
            );
            source.value("loop.sample_time", reason)
        }
        _ => source.value("loop.sample_time", error.to_string()),
    })?;
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
