//! The log of a joint or an arm, seen from the link's side of the gear.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use flexure::Error;
use flexure::identify::robot_joint::{JointLoad, gear_ratio};
use flexure::text::{exact, number};
use flexure_io::RecordFile;

use crate::Spelling;
use crate::preparation::conversion;

/// The samples of a column, which must be finite, in `unit`; and the unit of the file where they had to be converted from another one of the
/// same quantity.
///
/// # Errors
/// As [`RecordFile::finite`].
pub fn in_unit<'a>(file: &'a RecordFile, column: &str, unit: &str) -> flexure_io::Result<(Vec<f64>, Option<&'a str>)> {
    let samples = file.finite(column)?;
    let own = file.unit(file.meant(column));
    let convert = own.and_then(|own| Some((own, conversion(own, unit).ok()?)));
    Ok(match convert.filter(|(_, convert)| convert(1.0) != 1.0) {
        Some((own, convert)) => (samples.iter().map(|v| convert(*v)).collect(), Some(own)),
        None => (samples.to_vec(), None),
    })
}

/// A gear ratio to write, for one from a log: the nearest whole number, if it is near.
pub fn written_ratio(ratio: f64) -> String {
    const NEAR: f64 = 0.005;
    match (ratio / ratio.round() - 1.0).abs() < NEAR {
        true => exact(ratio.round()),
        false => number(ratio),
    }
}

/// The log of the axes that move.
pub struct Log {
    /// Its name in text and on pages: a file's name without its folder.
    pub name: String,
    /// s.
    pub sample_time: f64,
    /// One axis, or the shoulder and the elbow of an arm.
    pub axes: Vec<AxisLog>,
    /// The names of the columns in the file by the library's ("motor", or "motor 1" of an arm), where they differ.
    pub columns: BTreeMap<String, String>,
}

/// The log of one axis.
pub struct AxisLog {
    /// The torque on the link's side, N m (N for a prismatic axis).
    pub torque: Vec<f64>,
    /// The position of a rigid axis or the angle of a link, rad (m).
    pub position: Vec<f64>,
    /// The angle of a flexible joint's motor on the link's side, rad.
    pub motor: Option<Vec<f64>>,
    /// The velocity of a rigid axis, where it is logged.
    pub velocity: Option<Vec<f64>>,
    /// What the chain adds of which it is a joint.
    pub load: Option<AxisLoad>,
}

impl Log {
    /// The number of samples.
    pub fn samples(&self) -> usize {
        self.axes.first().map_or(0, |axis| axis.position.len())
    }

    /// The torques of both joints of an arm over `rows` samples; zero for a locked joint.
    pub(super) fn torques(&self, rows: usize, locked: [bool; 2]) -> [Vec<f64>; 2] {
        let mut axes = self.axes.iter();
        locked.map(|locked| {
            let axis = if locked { None } else { axes.next() };
            let mut torque = axis.map_or_else(Vec::new, |axis| axis.torque.clone());
            torque.resize(rows, 0.0);
            torque
        })
    }

    /// Refuses a joint whose motor and link are the same: there is nothing between them.
    pub(super) fn check_deflections(&self, spelling: Spelling) -> Result<()> {
        for (i, axis) in self.axes.iter().enumerate() {
            let Some(motor) = &axis.motor else { continue };
            let name = |kind: &'static str| {
                let of_arm = format!("{kind} {}", i + 1);
                let name = self.columns.get(kind).or_else(|| self.columns.get(&of_arm));
                name.map_or(kind, String::as_str)
            };
            let names = [name("motor"), name("link")];
            if *motor == axis.position {
                bail!(
                    "{}: columns '{}' and '{}' are equal: there is no deflection to see; use {} for a rigid axis",
                    self.name,
                    names[0],
                    names[1],
                    spelling("position", Some(names[1]))
                );
            }
            if let Some(ratio) = gear_ratio(motor, &axis.position, &axis.torque) {
                bail!(
                    "{}: '{}' goes {} times as far as '{}', as an angle before the gear does: {} divides it by the gear ratio and multiplies \
                     the torque by it; take the ratio of the gear's data sheet",
                    self.name,
                    names[0],
                    number(ratio),
                    names[1],
                    spelling("gear-ratio", Some(&written_ratio(ratio)))
                );
            }
        }
        Ok(())
    }

    /// The error with the file's name of a column in place of the library's.
    pub(super) fn renamed(&self, error: Error) -> Error {
        error.with_columns(|column| self.columns.get(column).cloned())
    }
}

/// What a chain adds to the torque of an axis.
#[derive(Debug, Clone)]
pub struct AxisLoad {
    /// The torque, and the inertia of the links.
    pub load: JointLoad,
    /// The name of the chain: a file's name without its folder, or a preset's.
    pub chain: String,
    /// The name of the joint in the chain.
    pub joint: String,
}

impl AxisLog {
    /// The torque without what the chain adds.
    pub(super) fn free_torque(&self) -> Vec<f64> {
        let load = self.load.as_ref().map_or(&[][..], |of| &of.load.torque);
        let load = load.iter().copied().chain(std::iter::repeat(0.0));
        self.torque
            .iter()
            .zip(load)
            .map(|(torque, load)| torque - load)
            .collect()
    }
}
