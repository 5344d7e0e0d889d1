//! Joints from their logs.

use flexure::identify::joint::{Extra, FlexibleJoint, RigidJoint, TwoLinkLog};
use flexure_cli::session::JointLog;
use pyo3::prelude::*;

use crate::arrays::Column;
use crate::errors::{ParameterError, of_any};
use crate::run::interruptible;

/// Identifies a joint or an arm from the columns of its log, one or two of each kind, and returns the object that
/// `flexure joint --json` prints, as text. Without `motor` it is a rigid axis.
#[pyfunction]
#[pyo3(signature = (torque, link, motor, velocity, sample_time, *, motor_inertia=None, gravity=false, spring=false, prismatic=false, level=0.95))]
#[expect(clippy::too_many_arguments, reason = "keywords on the other side")]
pub fn identify_joint(
    py: Python<'_>,
    torque: Vec<Column>,
    link: Vec<Column>,
    motor: Vec<Column>,
    velocity: Option<Column>,
    sample_time: f64,
    motor_inertia: Option<f64>,
    gravity: bool,
    spring: bool,
    prismatic: bool,
    level: f64,
) -> PyResult<String> {
    let found = interruptible(py, move |_| {
        let mut extras = Vec::new();
        extras.extend(gravity.then_some(Extra::Gravity));
        extras.extend(spring.then_some(Extra::Spring));
        let log = match (&torque[..], &link[..], &motor[..]) {
            ([torque], [position], []) => JointLog::Rigid(
                RigidJoint {
                    position: position.samples(),
                    torque: torque.samples(),
                    velocity: velocity.as_ref().map(Column::samples),
                    sample_time,
                    extras: &extras,
                    level,
                },
                prismatic,
            ),
            ([torque], [link], [motor]) => JointLog::Flexible(FlexibleJoint {
                motor: motor.samples(),
                link: link.samples(),
                torque: torque.samples(),
                sample_time,
                motor_inertia,
                level,
            }),
            _ => match (pair(&torque), pair(&link), pair(&motor)) {
                (Some(torque), Some(link), Some(motor)) => JointLog::TwoLinks(TwoLinkLog {
                    motor,
                    link,
                    torque,
                    sample_time,
                    level,
                }),
                _ => return Ok(None),
            },
        };
        log.identify().map(Some)
    })?;
    match found.map_err(|error| of_any(&error))? {
        Some(object) => Ok(object.to_string()),
        None => Err(ParameterError::new_err(
            "a two-link arm needs two columns each of motors, links and torques, a joint one",
        )),
    }
}

/// Two columns as slices.
fn pair(columns: &[Column]) -> Option<[&[f64]; 2]> {
    match columns {
        [first, second] => Some([first.samples(), second.samples()]),
        _ => None,
    }
}
