//! Joints from their logs.

use std::sync::Arc;

use flexure::identify::robot_joint::{Extra, FlexibleJoint, RigidJoint, TwoLinkLog};
use flexure_cli::session::{JointLog, LoggedJoint};
use pyo3::prelude::*;

use crate::arrays::Column;
use crate::errors::{ParameterError, of_any};
use crate::run::interruptible;

/// An identified joint or arm with its log.
#[pyclass(frozen, module = "flexure._core")]
pub struct Joint(Arc<LoggedJoint>);

#[pymethods]
impl Joint {
    /// The object that `flexure joint --json` prints, as text, without simulated motions and files.
    fn json(&self) -> String {
        self.0.json().to_string()
    }

    /// The page that `flexure joint --report` writes.
    fn page(&self, py: Python<'_>) -> PyResult<String> {
        let joint = Arc::clone(&self.0);
        interruptible(py, move |_| joint.page())?.map_err(|error| of_any(&error))
    }

    /// The text of the arm file that `flexure joint --arm` writes, not driven by any record; `joint`, 0 or 1, is the place of a
    /// single joint in the arm, `template` the text of an arm file whose links' geometry it has.
    #[pyo3(signature = (joint=0, template=None))]
    fn arm_file(&self, joint: usize, template: Option<&str>) -> PyResult<String> {
        self.0.arm_file(joint, template).map_err(|error| of_any(&error))
    }
}

/// Identifies a joint or an arm from the columns of its log, one or two of each kind. Without `motor` it is a rigid axis.
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
) -> PyResult<Joint> {
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
        Some(found) => Ok(Joint(Arc::new(found))),
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
