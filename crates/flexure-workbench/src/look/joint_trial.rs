//! A joint tried on a part of its record.

use std::collections::BTreeMap;
use std::ops::Range;

use flexure::error::DataError;
use flexure::identify::robot_joint::{Estimated, Extra};
use flexure::text::{shown_path, with_error};
use flexure_io::RecordFile;

use super::joint_columns::Joint;
use crate::joints::{AxisLog, Log, Settings, identify, in_unit};

/// Standard errors by which an inertia differs from zero.
const CLEARLY: f64 = 3.0;

/// What is assumed of joints that are tried.
#[derive(Clone, Copy)]
pub(super) struct Assumed {
    /// The torque for each unit of the torque column.
    pub constant: f64,
    /// Of a gear between motor and link.
    pub gear_ratio: f64,
    pub extra: Option<Extra>,
    pub is_prismatic: bool,
}

impl Assumed {
    fn settings(&self) -> Settings {
        Settings {
            extras: self.extra.into_iter().collect(),
            prismatic: self.is_prismatic,
            level: 0.95,
            ..Settings::default()
        }
    }

    /// The log of joints in a part of a record.
    fn log(&self, file: &RecordFile, part: &Range<usize>, joints: &[Joint], sample_time: f64) -> anyhow::Result<Log> {
        let [angle, effort] = if self.is_prismatic { ["m", "N"] } else { ["rad", "Nm"] };
        let column = |name: &str, unit: &str, by: f64| -> anyhow::Result<Vec<f64>> {
            let (samples, _) = in_unit(file, name, unit)?;
            Ok(samples[part.clone()].iter().map(|v| v * by).collect())
        };
        let axis = |joint: &Joint| {
            let motor = joint.motor.map(|motor| column(motor, angle, 1.0 / self.gear_ratio));
            anyhow::Ok(AxisLog {
                torque: column(joint.torque, effort, self.constant * self.gear_ratio)?,
                position: column(joint.position, angle, 1.0)?,
                motor: motor.transpose()?,
                velocity: None,
                load: None,
            })
        };
        Ok(Log {
            name: file.name(),
            sample_time,
            axes: joints.iter().map(axis).collect::<anyhow::Result<_>>()?,
            columns: BTreeMap::new(),
        })
    }
}

/// Why the joints of a part of a record cannot be identified.
#[derive(Default)]
pub(super) struct Failure {
    pub text: String,
    /// Whether the torque changes too fast for the sample time. Then it does so in the whole record.
    pub is_too_fast: bool,
}

/// The fit of the simulated motion in percent, the worst of several, if the joints can be identified from a part of a record: their inertias
/// clearly differ from zero, and the simulated motion is closer to the measured one than standstill.
pub(super) fn trial(
    file: &RecordFile,
    part: &Range<usize>,
    joints: &[Joint],
    assumed: Assumed,
    sample_time: f64,
) -> Result<f64, Failure> {
    let settings = assumed.settings();
    let identified = || {
        let log = assumed.log(file, part, joints, sample_time)?;
        let joint = identify(log, &settings, file, |name, _| format!("--{name}"))?;
        let motions = joint.try_out(None, None)?.motions;
        anyhow::Ok((joint, motions))
    };
    let (joint, motions) = identified().map_err(|error| {
        let text = error.to_string();
        let path = format!("{}: ", shown_path(&file.path));
        Failure {
            text: text.strip_prefix(&path).unwrap_or(&text).to_owned(),
            is_too_fast: error.chain().any(is_too_fast),
        }
    })?;
    for (name, Estimated { value, standard_error }) in joint.inertias() {
        if !(value > 0.0) || standard_error.is_finite() && value < CLEARLY * standard_error {
            let value = with_error(value, standard_error);
            let text = format!("the {name}, {value}, does not clearly differ from zero");
            return Err(Failure {
                text,
                ..Failure::default()
            });
        }
    }
    let fits = || motions.iter().map(|motion| motion.fit.percent);
    match motions.is_empty() || fits().any(|fit| !(fit > 0.0)) {
        true => Err(Failure {
            text: "the simulated motion is nowhere near the measured one".to_owned(),
            ..Failure::default()
        }),
        false => Ok(fits().fold(f64::INFINITY, f64::min)),
    }
}

/// Whether an error is that of a torque which changes too fast for the sample time.
fn is_too_fast(error: &(dyn std::error::Error + 'static)) -> bool {
    let library = match error.downcast_ref() {
        Some(flexure_io::Error::Data { cause, .. }) => Some(&**cause),
        _ => error.downcast_ref(),
    };
    matches!(library, Some(flexure::Error::Data(DataError::SampledTooSlowly { .. })))
}
