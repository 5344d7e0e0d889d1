//! Joints from their logs.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::Result;
use flexure::Record;
use flexure::identify::robot_joint::{AxisDrive, Extra, JointLoad};
use flexure_io::RecordFile;
use flexure_io::arm::{ArmFile, Excitation};
use flexure_workbench::joints::{
    Axes as IdentifiedAxes, AxisLoad, AxisLog, IdentifiedAxis, Joint as Identified, LaterLog, Log, NamedAxis, Place,
    Settings, Trial, identify,
};
use pyo3::prelude::*;

use crate::arrays::Column;
use crate::chain::Chain;
use crate::errors::{DataError, ParameterError, of_any, of_library};
use crate::names::argument;
use crate::run::interruptible;

/// What stands for a file's name in messages and on pages.
const LOG: &str = "the log";
const OTHER_LOG: &str = "the other log";
const CHAIN: &str = "the chain";

/// The factors that bring a log to the link's side of the gear.
#[derive(Clone, Copy)]
struct Scale {
    /// Torque at the link for each unit of the logged torque.
    torque: f64,
    /// The link's angle for each unit of the motor's.
    motor: f64,
}

/// A log of these columns, one or two of each kind; without a link, of a rigid axis at its motor.
fn log(
    name: &str,
    torque: &[Column],
    link: &[Column],
    motor: &[Column],
    velocity: Option<&Column>,
    sample_time: f64,
    scale: Scale,
) -> Log {
    let (link, motor, by) = match link {
        [] => (motor, link, scale.motor),
        _ => (link, motor, 1.0),
    };
    let scaled = |column: &Column, by: f64| column.samples().iter().map(|v| v * by).collect();
    let axes = torque.iter().zip(link).enumerate().map(|(i, (torque, link))| AxisLog {
        torque: scaled(torque, scale.torque),
        position: scaled(link, by),
        motor: motor.get(i).map(|motor| scaled(motor, scale.motor)),
        velocity: velocity.map(|velocity| scaled(velocity, by)),
        load: None,
    });
    Log {
        name: name.to_owned(),
        sample_time,
        axes: axes.collect(),
        columns: BTreeMap::new(),
    }
}

/// A position controller with a velocity loop inside, in which a log was made.
struct PositionLoop {
    reference: Vec<f64>,
    kp: f64,
    kv: f64,
}

/// An identified joint or arm with its log.
struct Session {
    found: Box<dyn Identified>,
    position_loop: Option<PositionLoop>,
    scale: Scale,
}

impl Session {
    /// The controller in whose loop the log was made, where it follows this reference.
    fn drive<'a>(&self, reference: &'a [f64]) -> Option<AxisDrive<'a>> {
        let &PositionLoop { kp, kv, .. } = self.position_loop.as_ref()?;
        Some(AxisDrive::Loop {
            reference,
            kp,
            kv,
            torque_constant: self.scale.torque,
        })
    }

    /// What the joint does when simulated, and on another log.
    fn trial(&self, later: Option<LaterLog>) -> Result<Trial> {
        let own = self.position_loop.as_ref();
        let position_loop = own.and_then(|own| self.drive(&own.reference));
        self.found.try_out(position_loop, later)
    }
}

/// An identified joint or arm with its log.
#[pyclass(frozen, module = "flexure._core")]
pub struct Joint(Arc<Session>);

impl Joint {
    /// What `work` makes of what the joint does when simulated.
    fn tried<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&dyn Identified, &Trial) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let session = Arc::clone(&self.0);
        let made = interruptible(py, move |_| work(&*session.found, &session.trial(None)?))?;
        made.map_err(|error| of_any(&error))
    }
}

#[pymethods]
impl Joint {
    /// The object that `flexure joint --json` prints, as text, without simulated motions and files.
    fn json(&self) -> String {
        self.0.found.json().to_string()
    }

    /// The text that `flexure joint` prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        self.tried(py, |found, trial| Ok(found.summary(trial).to_string()))
    }

    /// The simulated motions, as `flexure joint --json` prints them, as text.
    fn motions(&self, py: Python<'_>) -> PyResult<String> {
        self.tried(py, |found, trial| Ok(found.motions_json(&trial.motions).1.to_string()))
    }

    /// The page that `flexure joint --report` writes.
    fn page(&self, py: Python<'_>) -> PyResult<String> {
        self.tried(py, |found, trial| found.html(trial, None, None))
    }

    /// What the joint does on another log, as `flexure joint --validate` prints it with `--json`, as text; `reference` is what the controller
    /// followed there.
    #[pyo3(signature = (torque, link, motor, velocity, sample_time, reference=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords on the other side")]
    fn validate(
        &self,
        py: Python<'_>,
        torque: Vec<Column>,
        link: Vec<Column>,
        motor: Vec<Column>,
        velocity: Option<Column>,
        sample_time: f64,
        reference: Option<Column>,
    ) -> PyResult<String> {
        let session = Arc::clone(&self.0);
        let own = session.found.log();
        let own_motors = own.axes.iter().filter(|axis| axis.motor.is_some()).count();
        let [links, motors] = match link.len() {
            0 => [motor.len(), 0],
            links => [links, motor.len()],
        };
        if [torque.len(), links, motors] != [own.axes.len(), own.axes.len(), own_motors] {
            return Err(ParameterError::new_err(
                "the other log needs the columns of the one that was fitted: torque and position, torque and motor, or torque, motor and link",
            ));
        }
        let made = interruptible(py, move |_| {
            let log = log(
                OTHER_LOG,
                &torque,
                &link,
                &motor,
                velocity.as_ref(),
                sample_time,
                session.scale,
            );
            let file = RecordFile::in_memory(Record::new::<String>([])?, OTHER_LOG);
            let reference = reference.as_ref();
            let position_loop = reference.and_then(|reference| session.drive(reference.samples()));
            let later = LaterLog {
                log,
                file: &file,
                position_loop,
            };
            let tried = session.trial(Some(later))?;
            Ok(tried.later.map_or_else(String::new, |later| later.json().to_string()))
        })?;
        made.map_err(|error: anyhow::Error| of_any(&error))
    }

    /// The text of the arm file that `flexure joint --arm` writes, not driven by any record; `joint`, 0 or 1, is the place of a single
    /// joint in the arm; `template` is the text of an arm file with the links' geometry.
    #[pyo3(signature = (joint=0, template=None))]
    fn arm_file(&self, joint: usize, template: Option<&str>) -> PyResult<String> {
        let template = template.map(|text| ArmFile::from_toml_str(text, "the template"));
        let template = template.transpose().map_err(|error| of_any(&error.into()))?;
        let place = Place {
            joint: joint.min(1),
            template: template.map(|file| file.arm),
            excitation: Excitation::default(),
        };
        self.0.found.arm_file(place).map_err(|error| of_any(&error))
    }
}

/// Identifies a joint or an arm from the columns of its log, one or two of each kind. Without `motor` it is a rigid axis, without
/// `link` one at its motor. The position loop is a reference, kp and kv.
#[pyfunction]
#[pyo3(signature = (torque, link, motor, velocity, sample_time, *, motor_inertia=None, gravity=false, spring=false, prismatic=false, level=0.95, torque_constant=1.0, gear_ratio=1.0, position_loop=None))]
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
    torque_constant: f64,
    gear_ratio: f64,
    position_loop: Option<(Column, f64, f64)>,
) -> PyResult<Joint> {
    let known = matches!(
        (torque.len(), link.len(), motor.len()),
        (1, 1, 0 | 1) | (1, 0, 1) | (2, 2, 2)
    );
    if !known {
        return Err(ParameterError::new_err(
            "a two-link arm needs two columns each of motors, links and torques, a joint one",
        ));
    }
    if !(gear_ratio > 0.0 && gear_ratio.is_finite()) {
        return Err(ParameterError::new_err(format!(
            "gear_ratio is {gear_ratio}, but must be positive and finite"
        )));
    }
    let joint = interruptible(py, move |_| {
        let scale = Scale {
            torque: torque_constant * gear_ratio,
            motor: 1.0 / gear_ratio,
        };
        let log = log(LOG, &torque, &link, &motor, velocity.as_ref(), sample_time, scale);
        let settings = Settings {
            motor_inertia,
            ..settings(gravity, spring, prismatic, level)
        };
        let file = RecordFile::in_memory(Record::new::<String>([])?, LOG);
        let found = identify(log, &settings, &file, argument)?;
        let position_loop = position_loop.map(|(reference, kp, kv)| PositionLoop {
            reference: reference.samples().to_vec(),
            kp,
            kv,
        });
        Ok(Session {
            found,
            position_loop,
            scale,
        })
    })?;
    joint
        .map(|session| Joint(Arc::new(session)))
        .map_err(|error: anyhow::Error| of_any(&error))
}

fn settings(gravity: bool, spring: bool, prismatic: bool, level: f64) -> Settings {
    let mut extras = Vec::new();
    extras.extend(gravity.then_some(Extra::Gravity));
    extras.extend(spring.then_some(Extra::Spring));
    Settings {
        extras,
        prismatic,
        motor_inertia: None,
        level,
    }
}

/// Several axes of a log, each identified alone.
#[pyclass(frozen, module = "flexure._core")]
pub struct Axes(Arc<IdentifiedAxes>);

#[pymethods]
impl Axes {
    /// The object that `flexure joint --axis ... --json` prints, as text, without files.
    fn json(&self) -> String {
        self.0.json().to_string()
    }

    /// The text that `flexure joint --axis ...` prints.
    fn summary(&self) -> String {
        self.0.summary().to_string()
    }

    /// The page that `flexure joint --axis ... --report` writes.
    fn page(&self, py: Python<'_>) -> PyResult<String> {
        let axes = Arc::clone(&self.0);
        let made = interruptible(py, move |_| axes.html(None, None))?;
        made.map_err(|error| of_any(&error))
    }
}

/// The columns of one axis: torque, position, motor and velocity; or why it has none.
type AxisColumns = Result<(Vec<f64>, Vec<f64>, Option<Vec<f64>>, Option<Vec<f64>>), String>;

/// Identifies several axes from their names, the settings, and the columns or the reason why an axis has none: each alone, or as joints of a
/// chain, which comes with the positions of all its joints and the numbers of those that the axes are.
#[pyfunction]
#[pyo3(signature = (axes, sample_time, *, gravity=false, spring=false, prismatic=false, level=0.95, chain=None))]
#[expect(
    clippy::type_complexity,
    clippy::too_many_arguments,
    reason = "one tuple an axis, and keywords"
)]
pub fn identify_axes(
    py: Python<'_>,
    axes: Vec<(
        String,
        Option<String>,
        Option<String>,
        Option<(Column, Column, Option<Column>, Option<Column>)>,
    )>,
    sample_time: f64,
    gravity: bool,
    spring: bool,
    prismatic: bool,
    level: f64,
    chain: Option<(PyRef<'_, Chain>, Vec<Column>, Vec<usize>)>,
) -> PyResult<Axes> {
    let samples = |column: &Column| column.samples().to_vec();
    let of_chain = chain.map(|(chain, positions, joints)| (chain.links().clone(), positions, joints));
    let loads = of_chain.as_ref().map(|(chain, positions, joints)| {
        let positions: Vec<&[f64]> = positions.iter().map(Column::samples).collect();
        let loads = JointLoad::of_chain(chain, &positions, sample_time).map_err(|error| of_library(&error))?;
        let load = |&joint: &usize| AxisLoad {
            load: loads[joint].clone(),
            chain: CHAIN.to_owned(),
            joint: chain.joints()[joint].clone(),
        };
        PyResult::Ok(joints.iter().map(load).collect::<Vec<_>>())
    });
    let loads = loads.transpose()?;
    let slides = |axis: usize| match &of_chain {
        Some((chain, _, joints)) => chain.prismatic().nth(joints[axis]) == Some(true),
        None => prismatic,
    };
    let names: Vec<NamedAxis> = (axes.iter().enumerate())
        .map(|(i, (name, ..))| NamedAxis {
            name: name.clone(),
            prismatic: slides(i),
        })
        .collect();
    let logs: Vec<(Option<String>, AxisColumns)> = axes
        .iter()
        .map(|(_, remark, error, columns)| {
            let columns = columns.as_ref().map(|(torque, position, motor, velocity)| {
                let [motor, velocity] = [motor, velocity].map(|column| column.as_ref().map(samples));
                (samples(torque), samples(position), motor, velocity)
            });
            (remark.clone(), columns.ok_or_else(|| error.clone().unwrap_or_default()))
        })
        .collect();
    let found = interruptible(py, move |_| {
        let file = RecordFile::in_memory(Record::new::<String>([])?, LOG);
        IdentifiedAxes::new(LOG, names, |i, axis| {
            let settings = settings(gravity, spring, axis.prismatic, level);
            let (remark, columns) = &logs[i];
            let (torque, position, motor, velocity) = columns.clone().map_err(anyhow::Error::msg)?;
            let log = Log {
                name: LOG.to_owned(),
                sample_time,
                axes: vec![AxisLog {
                    torque,
                    position,
                    motor,
                    velocity,
                    load: loads.as_ref().map(|loads| loads[i].clone()),
                }],
                columns: BTreeMap::new(),
            };
            let joint = identify(log, &settings, &file, argument)?;
            let trial = joint.try_out(None, None)?;
            Ok(IdentifiedAxis {
                joint,
                trial,
                remark: remark.clone(),
            })
        })
    })?;
    found
        .map(|axes| Axes(Arc::new(axes)))
        .map_err(|error| DataError::new_err(format!("{error:#}")))
}
