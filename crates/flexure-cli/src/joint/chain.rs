//! The axes of a chain: the positions of all its joints, and the load of each.

use std::path::PathBuf;

use anyhow::{Result, bail};
use flexure::identify::robot_joint::JointLoad;
use flexure::text::shown_path;
use flexure_io::RecordFile;
use flexure_workbench::joints::{AxisLoad, in_unit};
use flexure_workbench::text::number;

use super::Arguments;
use super::axes::AxisNames;
use super::log::{Names, Quantity};
use crate::arguments::Usage;
use crate::output::print_note;
use crate::robot::Robot;

/// Positions outside a joint's limits by this share of their range are hardly in its unit.
const FAR: f64 = 0.1;

/// The chain whose joints are identified.
#[derive(clap::Args)]
pub struct ChainOptions {
    /// Identify the joints of this chain of links: a URDF, a chain file, or the name of a preset. The torques from
    /// gravity and from the other joints are computed from the inertias of the chain and from the positions of all its
    /// joints. The log must contain these positions. In the names of columns, {} stands for the joint: its number from
    /// 1, or its name.
    #[arg(
        long,
        value_name = "ROBOT.urdf",
        help_heading = "Joint",
        conflicts_with_all = ["joint", "arm", "gravity", "prismatic", "reference", "motor_inertia"]
    )]
    chain: Option<PathBuf>,
    /// No gravity acts on the URDF of --chain. Without this option, gravity is 9.81 m/s^2 along -z.
    #[arg(long, help_heading = "Joint", requires = "chain")]
    no_gravity: bool,
}

impl ChainOptions {
    /// The chain, if one is given.
    pub fn robot(&self) -> Result<Option<Robot>> {
        let read = |path: &PathBuf| Robot::read(path, self.no_gravity);
        self.chain.as_ref().map(read).transpose()
    }

    /// Its file, or its name.
    pub fn given(&self) -> Option<&PathBuf> {
        self.chain.as_ref()
    }
}

/// The joints of a chain as the axes of a log.
pub struct AxesOfChain {
    robot: Robot,
    /// How columns name the joints, in the order of the chain.
    names: Vec<String>,
}

impl AxesOfChain {
    /// For these axes of a log, or all joints: by their numbers, or by their names as the axes or the columns of the file have them.
    pub fn new(robot: Robot, axes: Option<&AxisNames>, given: &Names, file: &RecordFile) -> Self {
        let joints = robot.chain.chain().joints();
        let numbers: Vec<String> = (1..=joints.len()).map(|i| i.to_string()).collect();
        let by_name = match axes {
            Some(AxisNames(axes)) => axes.iter().any(|axis| joints.contains(axis)),
            None => given
                .position_of(&numbers[0], file)
                .is_none_or(|column| !file.has(&column)),
        };
        let names = if by_name { joints.to_vec() } else { numbers };
        AxesOfChain { robot, names }
    }

    /// All joints as axes.
    pub fn all(&self) -> Vec<String> {
        self.names.clone()
    }

    /// The joint that an axis is.
    pub fn joint(&self, axis: &str) -> Result<usize, Usage> {
        self.robot.joint(axis)
    }

    /// Whether the joint that an axis is slides.
    pub fn prismatic(&self, axis: &str) -> bool {
        let joint = self.joint(axis).ok();
        joint.is_some_and(|i| self.robot.chain.chain().prismatic().nth(i) == Some(true))
    }

    /// What the chain adds to the torque of each joint in a log.
    ///
    /// # Errors
    /// For a joint without a column of its position, and positions that cannot be used.
    pub fn loads(&self, arguments: &Arguments, given: &Names, file: &RecordFile) -> Result<Vec<AxisLoad>> {
        let chain = self.robot.chain.chain();
        let mut columns = Vec::new();
        let mut positions = Vec::new();
        for ((joint, name), prismatic) in chain.joints().iter().zip(&self.names).zip(chain.prismatic()) {
            let own = given.of_axis(name, file);
            let before_gear = if own.at_motor { 1.0 / arguments.gear_ratio } else { 1.0 };
            let column = own.position.or(own.link).unwrap_or_default();
            if !file.has(&column) {
                bail!(
                    "{}: there is no column '{column}' of the joint '{joint}': the load of a joint depends on the positions of all joints of {}",
                    shown_path(&file.path),
                    self.robot.name
                );
            }
            let unit = Quantity::Angle.unit(prismatic);
            let (samples, _) = in_unit(file, &column, unit)?;
            let samples: Vec<f64> = samples.iter().map(|q| q * before_gear).collect();
            note_of_limits(file, &column, &samples, joint, chain.limits()[positions.len()], unit);
            positions.push(samples);
            columns.push(column);
        }
        let used: Vec<&str> = columns.iter().map(String::as_str).collect();
        let sample_time = arguments.sample_time_of(file, &used)?;
        let slices: Vec<&[f64]> = positions.iter().map(Vec::as_slice).collect();
        let named = |name: &str| {
            let joint = chain.joints().iter().position(|joint| joint == name)?;
            Some(columns[joint].clone())
        };
        let loads = JointLoad::of_chain(chain, &slices, sample_time);
        let loads = loads.map_err(|error| file.locate(error.with_columns(named)))?;
        let each = loads.into_iter().zip(chain.joints());
        Ok(each
            .map(|(load, joint)| AxisLoad {
                load,
                chain: self.robot.name.clone(),
                joint: joint.clone(),
            })
            .collect())
    }
}

/// Says of positions that are far outside the limits of their joint that they may be in another unit.
fn note_of_limits(file: &RecordFile, column: &str, q: &[f64], joint: &str, [low, high]: [f64; 2], unit: &str) {
    let outside = |q: &&f64| **q < low - FAR * (high - low) || **q > high + FAR * (high - low);
    if let Some(position) = q.iter().find(outside) {
        print_note(&format!(
            "note: {}: '{column}' has {}, far beyond the limits {} to {} {unit} of the joint '{joint}': is it in another unit, such as degrees?",
            file.name(),
            number(*position),
            number(low),
            number(high)
        ));
    }
}
