//! A joint's log in memory: what `flexure joint --json` says of it.

use anyhow::Result;
use flexure::Record;
use flexure::identify::joint::{FlexibleJoint, JointFound, RigidAxis, RigidJoint, TwoLinkLog};
use flexure_io::RecordFile;
use serde_json::{Value, json};

use super::data::possible;
use super::words::Units;
use super::{flexible, rigid, two_link};

/// What stands for a file's name in messages.
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

impl JointLog<'_> {
    /// Identifies the joint, and says what was found as the object that `flexure joint --json` prints, without simulated
    /// motions and files.
    ///
    /// # Errors
    /// Those of the library, and for inertias that are clearly negative.
    pub fn identify(&self) -> Result<Value> {
        let file = RecordFile::in_memory(Record::new::<String>([])?, LOG);
        match self {
            JointLog::Rigid(joint, prismatic) => axis(&file, &joint.identify()?, *prismatic),
            JointLog::Flexible(joint) => match joint.identify()? {
                JointFound::Rigid(found) => axis(&file, &found, false),
                JointFound::Flexible(found) => {
                    let link = ("link's inertia", &found.link_inertia);
                    possible(&file, [("motor's inertia", &found.motor_inertia), link])?;
                    let mut object = flexible::axis_json(&found);
                    object["joint"] = json!("flexible");
                    Ok(object)
                }
            },
            JointLog::TwoLinks(log) => {
                let arm = log.identify()?;
                possible(
                    &file,
                    [("shoulder's inertia", &arm.shoulder), ("elbow's inertia", &arm.elbow)],
                )?;
                for axis in &arm.joints {
                    possible(&file, [("motor's inertia", &axis.motor_inertia)])?;
                }
                Ok(two_link::arm_json(&arm))
            }
        }
    }
}

fn axis(file: &RecordFile, axis: &RigidAxis, prismatic: bool) -> Result<Value> {
    possible(file, [("inertia", &axis.inertia)])?;
    Ok(rigid::axis_json(axis, &Units::of(prismatic)))
}
