//! Joints from their logs.

use std::collections::BTreeMap;
use std::sync::Arc;

use flexure::Record;
use flexure::identify::robot_joint::Extra;
use flexure_io::RecordFile;
use flexure_io::arm::{ArmFile, Excitation};
use flexure_workbench::joints::{AxisLog, Joint as Identified, Log, Place, Settings, identify};
use pyo3::prelude::*;

use crate::arrays::Column;
use crate::errors::{ParameterError, of_any};
use crate::names::argument;
use crate::run::interruptible;

/// What stands for a file's name in messages and on pages.
const LOG: &str = "the log";

/// An identified joint or arm with its log.
#[pyclass(frozen, module = "flexure._core")]
pub struct Joint(Arc<dyn Identified>);

#[pymethods]
impl Joint {
    /// The object that `flexure joint --json` prints, as text, without simulated motions and files.
    fn json(&self) -> String {
        self.0.json().to_string()
    }

    /// The page that `flexure joint --report` writes.
    fn page(&self, py: Python<'_>) -> PyResult<String> {
        let joint = Arc::clone(&self.0);
        let page = interruptible(py, move |_| joint.html(&joint.simulate(None)?, None))?;
        page.map_err(|error| of_any(&error))
    }

    /// The text of the arm file that `flexure joint --arm` writes, not driven by any record; `joint`, 0 or 1, is the place of a
    /// single joint in the arm, `template` the text of an arm file whose links' geometry it has.
    #[pyo3(signature = (joint=0, template=None))]
    fn arm_file(&self, joint: usize, template: Option<&str>) -> PyResult<String> {
        let template = template.map(|text| ArmFile::from_toml_str(text, "the template"));
        let template = template.transpose().map_err(|error| of_any(&error.into()))?;
        let place = Place {
            joint: joint.min(1),
            template: template.map(|file| file.arm),
            excitation: Excitation::default(),
        };
        self.0.arm_file(place).map_err(|error| of_any(&error))
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
    let known = matches!((torque.len(), link.len(), motor.len()), (1, 1, 0 | 1) | (2, 2, 2));
    if !known {
        return Err(ParameterError::new_err(
            "a two-link arm needs two columns each of motors, links and torques, a joint one",
        ));
    }
    let joint = interruptible(py, move |_| {
        let samples = |column: &Column| column.samples().to_vec();
        let axes = (0..torque.len()).map(|i| AxisLog {
            torque: samples(&torque[i]),
            position: samples(&link[i]),
            motor: motor.get(i).map(samples),
            velocity: velocity.as_ref().map(samples),
        });
        let log = Log {
            name: LOG.to_owned(),
            sample_time,
            axes: axes.collect(),
            columns: BTreeMap::new(),
        };
        let mut extras = Vec::new();
        extras.extend(gravity.then_some(Extra::Gravity));
        extras.extend(spring.then_some(Extra::Spring));
        let settings = Settings {
            extras,
            prismatic,
            motor_inertia,
            level,
        };
        let file = RecordFile::in_memory(Record::new::<String>([])?, LOG);
        identify(log, &settings, &file, argument)
    })?;
    joint
        .map(|joint| Joint(Arc::from(joint)))
        .map_err(|error| of_any(&error))
}
