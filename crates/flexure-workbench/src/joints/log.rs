//! The log of a joint or an arm, seen from the link's side of the gear.

use std::collections::BTreeMap;

use flexure::Error;
use flexure::error::DataError;

/// The log of the axes that move.
pub struct Log {
    /// What it is called in text and on pages: a file's name without its folder.
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
}

impl Log {
    /// The number of samples.
    pub fn samples(&self) -> usize {
        self.axes.first().map_or(0, |axis| axis.position.len())
    }

    /// The error with the file's name of a column in place of the library's.
    pub(super) fn renamed(&self, error: Error) -> Error {
        let name = |column: String| self.columns.get(&column).cloned().unwrap_or(column);
        match error {
            Error::Data(DataError::Constant { column, value }) => Error::constant(name(column), value),
            Error::Data(DataError::Unit { column, largest }) => Error::Data(DataError::Unit {
                column: name(column),
                largest,
            }),
            Error::Data(DataError::WrappedAngle { column, sample, jump }) => Error::Data(DataError::WrappedAngle {
                column: name(column),
                sample,
                jump,
            }),
            other => other,
        }
    }
}
