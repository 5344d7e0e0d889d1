//! Joints and arms from their logs: identified, simulated under their own torques, and as text, JSON, page, curves and arm file.
//!
//! A [`Log`] of one axis is that of a rigid axis, or of a flexible joint if it has a motor angle; two axes are a two-link arm.
//! [`identify`] returns what all of them have in common, a [`Joint`]. [`Axes`] are several joints of one log, each treated alone.

mod arm_file;
mod axes;
mod chain;
mod curves;
mod diagram;
mod flexible;
mod forms;
mod later;
mod log;
mod outcome;
mod page;
mod rigid;
mod row;
mod simulation;
mod text;
mod two_link;

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure::identify::robot_joint::{
    AxisDrive, Estimated, Extra, Finding, FlexibleJoint, IdentifiedJoint, JointLoad, NeededTorque, RigidJoint,
    TwoLinkArm, TwoLinkLog,
};
use flexure::text::shown_path;
use flexure_io::RecordFile;
use flexure_report::data::JointPage;
use serde_json::Value;

use crate::Spelling;
use crate::lines::Lines;
use chain::OfChain;
use flexible::Flexible;
use rigid::Rigid;
use row::Row;

pub use arm_file::{Place, recorded};
pub use axes::{Axes, Axis, IdentifiedAxis, MOST_AXES, NamedAxis};
pub use later::{Later, LaterLog, Trial};
pub use log::{AxisLoad, AxisLog, Log, in_unit, written_ratio};
pub use simulation::{Fit, Motion};
pub(crate) use text::{Constant, constants, estimate, with_error};
pub use text::{Units, parameter_text};
pub(crate) use two_link::TwoLink;

/// A negative inertia of more standard errors than this is no chance.
const CLEARLY: f64 = 3.0;

/// A column of counts has whole numbers in at least this share of its samples: others are interpolated. Convention.
const WHOLE: f64 = 0.98;

/// What is known about a joint in addition to its log.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Terms that act on a rigid axis.
    pub extras: Vec<Extra>,
    /// Whether a rigid axis moves along a line.
    pub prismatic: bool,
    /// The inertia of a flexible joint's motor on the link's side, kg m^2, where it is known.
    pub motor_inertia: Option<f64>,
    /// The level of the confidence bands, 0.5 to 0.999.
    pub level: f64,
}

/// The curves of one axis as the columns of files.
pub struct Curves {
    /// The friction torque over the velocity.
    pub friction: Record,
    /// The friction torque at the motor of a flexible joint over its velocity, where it is seen.
    pub motor_friction: Option<Record>,
    /// The torque and the stiffness of a flexible joint over its deflection.
    pub stiffness: Option<Record>,
}

/// An identified joint or arm with its log.
pub trait Joint: Send + Sync {
    /// The results, without simulated motions.
    fn json(&self) -> Value;

    /// Its log.
    fn log(&self) -> &Log;

    /// The velocity of every axis of its log.
    fn velocities(&self) -> Vec<&[f64]>;

    /// The torque that the motion of each axis of a log needs. The one of an arm's joints leaves out the coupling of its links.
    ///
    /// # Errors
    /// For motions that cannot be used.
    fn needed_torque(&self, log: &Log) -> flexure::Result<Vec<NeededTorque>>;

    /// The simulated motion of every axis under the torque of a log with these velocities; none if the simulation fails. A rigid axis is
    /// also simulated in a position loop, if one is given.
    ///
    /// # Errors
    /// For a sample time with which nothing can be simulated.
    fn simulate(&self, log: &Log, velocities: &[&[f64]], position_loop: Option<AxisDrive>) -> Result<Vec<Motion>>;

    /// Simulates the motions of its own log, and tries it on another one.
    ///
    /// # Errors
    /// As [`Joint::simulate`]; for another log that cannot be used.
    fn try_out(&self, position_loop: Option<AxisDrive>, later: Option<LaterLog>) -> Result<Trial> {
        let motions = self.simulate(self.log(), &self.velocities(), position_loop)?;
        let later = later.map(|later| Later::new(self, &motions, later)).transpose()?;
        Ok(Trial { motions, later })
    }

    /// The simulated motions, as a field with its name.
    fn motions_json(&self, motions: &[Motion]) -> (&'static str, Value);

    /// A short account, the result first.
    fn summary(&self, trial: &Trial) -> Lines;

    /// The page that shows everything, without the command that makes it again.
    fn page(&self, trial: &Trial) -> JointPage;

    /// The results, with the simulated motions and what it does on another log.
    fn tried_json(&self, trial: &Trial) -> Value {
        let mut object = self.json();
        let (name, motions) = self.motions_json(&trial.motions);
        object[name] = motions;
        if let Some(later) = &trial.later {
            object["later"] = later.json();
        }
        object
    }

    /// The page that shows everything; `command` makes it again, and `python` in Python.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    fn html(&self, trial: &Trial, command: Option<String>, python: Option<String>) -> Result<String> {
        html(JointPage {
            command,
            python,
            ..self.page(trial)
        })
    }

    /// The text of the file of the arm that the joint belongs to.
    ///
    /// # Errors
    /// If no arm file can be made of it, or the template contradicts the identified values.
    fn arm_file(&self, place: Place) -> Result<String>;

    /// The curves of every axis.
    fn curves(&self) -> flexure::Result<Vec<Curves>>;

    /// Its inertias by their names.
    fn inertias(&self) -> Vec<(&'static str, Estimated)>;

    /// What to know before trusting it, of every axis.
    fn findings(&self) -> Vec<&Finding>;

    /// How it fits the chain of which it is a joint; `None` for a joint alone.
    fn of_chain(&self) -> Option<OfChain<'_>> {
        None
    }

    /// Its results with what it has to do with its chain, if it is a joint of one.
    fn with_chain(&self, mut object: Value) -> Value {
        if let Some(chain) = self.of_chain() {
            object["chain"] = chain.json();
        }
        object
    }

    /// A single joint as a row of a table; for an arm, its shoulder.
    fn row(&self, trial: &Trial) -> Row;
}

/// A page as HTML.
fn html(page: JointPage) -> Result<String> {
    flexure_report::render_joint(&page).context("the report")
}

/// Identifies a joint or an arm from its log, which comes from `file`.
///
/// # Errors
/// Those of the library, with the file and its columns' names; for inertias that are clearly negative.
pub fn identify(log: Log, settings: &Settings, file: &RecordFile, spelling: Spelling) -> Result<Box<dyn Joint>> {
    log.check_deflections(spelling)?;
    let located = |log: &Log, error| file.locate(log.renamed(error));
    let joint: Box<dyn Joint> = match &log.axes[..] {
        [axis] => match axis.identify(log.sample_time, settings).map_err(|e| located(&log, e))? {
            IdentifiedJoint::Rigid(mut axis) => {
                // There are no turns to be counted in metres, nor in an angle whose unit the file has.
                let column = log.columns.get("position").or_else(|| log.columns.get("link"));
                if settings.prismatic || column.is_some_and(|column| file.unit(file.meant(column)).is_some()) {
                    axis.findings.retain(|f| !matches!(f, Finding::ManyTurns { .. }));
                }
                // The gear may have made fractions of them, and interpolation of a few.
                let logged = column.and_then(|column| file.record.column(file.meant(column)).ok());
                let are_whole = logged.is_some_and(|samples| {
                    let whole = samples.iter().filter(|q| q.fract() == 0.0).count();
                    whole as f64 > WHOLE * samples.len() as f64
                });
                for finding in &mut axis.findings {
                    if let Finding::ManyTurns { whole, .. } = finding {
                        *whole |= are_whole;
                    }
                }
                Box::new(Rigid::new(*axis, settings.prismatic, log))
            }
            IdentifiedJoint::Flexible(axis) => Box::new(Flexible { axis: *axis, log }),
        },
        [first, second] => {
            let arm = arm([first, second], log.sample_time, settings).map_err(|e| located(&log, e))?;
            Box::new(TwoLink { arm, log })
        }
        _ => bail!("a joint's log has one axis, an arm's two"),
    };
    for (name, inertia) in joint.inertias() {
        if inertia.value + CLEARLY * inertia.standard_error < 0.0 {
            bail!(
                "{}: the {name} comes out negative ({}), which cannot be: check the torque's sign ({} turns it), which columns are the \
                 motor's and which the link's, and the gear ratio",
                shown_path(&file.path),
                text::with_error(inertia),
                spelling("torque-constant", Some("-1"))
            );
        }
    }
    Ok(joint)
}

/// Identifies an arm from the log of its axes.
pub(crate) fn arm(axes: [&AxisLog; 2], sample_time: f64, settings: &Settings) -> flexure::Result<TwoLinkArm> {
    let joints = TwoLinkLog {
        motor: axes.map(|axis| axis.motor.as_deref().unwrap_or_default()),
        link: axes.map(|axis| &axis.position[..]),
        torque: axes.map(|axis| &axis.torque[..]),
        sample_time,
        level: settings.level,
    };
    joints.identify()
}

impl AxisLog {
    /// What the chain adds of which it is a joint.
    fn load(&self) -> Option<&JointLoad> {
        self.load.as_ref().map(|of| &of.load)
    }

    fn identify(&self, sample_time: f64, settings: &Settings) -> flexure::Result<IdentifiedJoint> {
        let Some(motor) = &self.motor else {
            let joint = RigidJoint {
                position: &self.position,
                torque: &self.torque,
                velocity: self.velocity.as_deref(),
                load: self.load(),
                sample_time,
                extras: &settings.extras,
                level: settings.level,
            };
            return Ok(IdentifiedJoint::Rigid(Box::new(joint.identify()?)));
        };
        let joint = FlexibleJoint {
            motor,
            link: &self.position,
            torque: &self.torque,
            load: self.load(),
            sample_time,
            motor_inertia: settings.motor_inertia,
            level: settings.level,
        };
        joint.identify()
    }
}
