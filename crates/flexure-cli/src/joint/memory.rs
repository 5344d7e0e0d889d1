//! A joint's log in memory: what `flexure joint` says, shows and writes of it.

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure::identify::robot_joint::{
    FlexibleAxis, FlexibleJoint, JointFound, RigidAxis, RigidJoint, TwoLinkArm, TwoLinkLog,
};
use flexure_io::RecordFile;
use flexure_io::arm::{ArmFile, Excitation};
use serde_json::{Value, json};

use super::arm::{Place, arm_file, rigid_arm_file, simulated};
use super::data::{ArmLog, Log};
use super::words::Units;
use super::{flexible, page, rigid, two_link};

/// What stands for a file's name in messages and on pages.
const LOG: &str = "the log";

/// A joint's log, as the library takes it.
pub enum JointLog<'a> {
    /// Of a rigid axis, which is prismatic or not.
    Rigid(RigidJoint<'a>, bool),
    /// Of a flexible joint.
    Flexible(FlexibleJoint<'a>),
    /// Of a two-link arm.
    TwoLinks(TwoLinkLog<'a>),
}

/// An identified joint or arm with its log.
pub enum LoggedJoint {
    /// A rigid axis, which is prismatic or not.
    Rigid(Log, Box<RigidAxis>, bool),
    /// A flexible joint.
    Flexible(Log, Box<FlexibleAxis>),
    /// A two-link arm.
    TwoLinks(ArmLog, Box<TwoLinkArm>),
}

impl JointLog<'_> {
    /// Identifies the joint.
    ///
    /// # Errors
    /// Those of the library, and for inertias that are clearly negative.
    pub fn identify(&self) -> Result<LoggedJoint> {
        let file = RecordFile::in_memory(Record::new::<String>([])?, LOG);
        let rigid = |log: Log, axis: RigidAxis, prismatic: bool| -> Result<LoggedJoint> {
            let axis = rigid::checked(&file, axis, prismatic)?;
            Ok(LoggedJoint::Rigid(log, Box::new(axis), prismatic))
        };
        match self {
            JointLog::Rigid(joint, prismatic) => {
                let log = log(joint.position, joint.torque, &[], joint.sample_time);
                rigid(log, joint.identify()?, *prismatic)
            }
            JointLog::Flexible(joint) => {
                let log = log(joint.link, joint.torque, joint.motor, joint.sample_time);
                match joint.identify()? {
                    JointFound::Rigid(axis) => rigid(log, *axis, false),
                    JointFound::Flexible(axis) => {
                        flexible::checked(&file, &axis)?;
                        Ok(LoggedJoint::Flexible(log, axis))
                    }
                }
            }
            JointLog::TwoLinks(joints) => {
                let arm = joints.identify()?;
                two_link::checked(&file, &arm)?;
                let log = ArmLog {
                    file: LOG.to_owned(),
                    torque: joints.torque.map(<[f64]>::to_vec),
                    link: joints.link.map(<[f64]>::to_vec),
                    motor: joints.motor.map(<[f64]>::to_vec),
                    sample_time: joints.sample_time,
                    torque_constant: 1.0,
                };
                Ok(LoggedJoint::TwoLinks(log, Box::new(arm)))
            }
        }
    }
}

fn log(position: &[f64], torque: &[f64], motor: &[f64], sample_time: f64) -> Log {
    Log {
        file: LOG.to_owned(),
        torque: torque.to_vec(),
        position: position.to_vec(),
        motor: motor.to_vec(),
        velocity: None,
        sample_time,
        torque_constant: 1.0,
        has_both_torques: false,
    }
}

impl LoggedJoint {
    /// The object that `flexure joint --json` prints, without simulated motions and files.
    pub fn json(&self) -> Value {
        match self {
            LoggedJoint::Rigid(_, axis, prismatic) => rigid::axis_json(axis, &Units::of(*prismatic)),
            LoggedJoint::Flexible(_, axis) => {
                let mut object = flexible::axis_json(axis);
                object["joint"] = json!("flexible");
                object
            }
            LoggedJoint::TwoLinks(_, arm) => two_link::arm_json(arm),
        }
    }

    /// The page that `flexure joint --report` writes.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn page(&self) -> Result<String> {
        let page = match self {
            LoggedJoint::Rigid(log, axis, prismatic) => {
                page::rigid(axis, log, &[rigid::replay(log, axis)], &Units::of(*prismatic), None)
            }
            LoggedJoint::Flexible(log, axis) => page::flexible(axis, log, simulated(axis, log)?.as_ref(), None),
            LoggedJoint::TwoLinks(log, arm) => page::two_link(arm, log, two_link::replay(arm, log)?.as_ref(), None),
        };
        flexure_report::render_joint(&page).context("the report")
    }

    /// The text of the arm file that `flexure joint --arm` writes, not driven by any record. `joint`, 0 or 1, is the place of a
    /// single joint in the arm; `template` is the text of the arm file whose links' geometry it has.
    ///
    /// # Errors
    /// For a rigid axis with gravity or a spring, which no arm file has; for a template that is wrong, or contradicts what was identified.
    pub fn arm_file(&self, joint: usize, template: Option<&str>) -> Result<String> {
        let template = template.map(|text| ArmFile::from_toml_str(text, "the template"));
        let template = template.transpose()?.map(|file| file.arm);
        let place = Place {
            joint: joint.min(1),
            template,
            excitation: Excitation::zero(),
        };
        match self {
            LoggedJoint::Rigid(_, axis, _) if !axis.extras.is_empty() => {
                bail!("an arm file has no gravity or spring, and without them the arm would not move as the axis does")
            }
            LoggedJoint::Rigid(log, axis, prismatic) => rigid_arm_file(axis, log, place, *prismatic),
            LoggedJoint::Flexible(log, axis) => arm_file(axis, log, place),
            LoggedJoint::TwoLinks(log, arm) => {
                let Place {
                    template, excitation, ..
                } = place;
                two_link::arm_file(arm, log, template.map(|arm| arm.links).as_ref(), excitation)
            }
        }
    }
}
