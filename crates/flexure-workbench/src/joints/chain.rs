//! The joints of a chain of links: what gravity and the other joints add to the torque of each.

use flexure::identify::robot_joint::ChainFit;
use flexure::text::{percent, readable};
use flexure_report::data::Fact;
use serde_json::{Value, json};

use super::log::{AxisLoad, AxisLog};
use super::text::{Units, inertia_json, inertia_text, typeset};
use crate::text::{joint_name, number};

/// How a chain fits the log of one of its joints.
pub struct OfChain<'a> {
    of: &'a AxisLoad,
    fit: ChainFit,
    /// The load's root mean square as a share of that of the torque.
    share: f64,
    flexible: bool,
}

impl<'a> OfChain<'a> {
    /// Of an axis with this log; `None` if it is alone.
    pub fn new(log: &'a AxisLog, fit: Option<ChainFit>) -> Option<Self> {
        let (of, fit) = log.load.as_ref().zip(fit)?;
        let squares = |x: &[f64]| x.iter().map(|value| value * value).sum::<f64>();
        Some(OfChain {
            share: (squares(&of.load.torque) / squares(&log.torque)).sqrt(),
            flexible: log.motor.is_some(),
            of,
            fit,
        })
    }

    /// The chain's name.
    pub fn name(&self) -> &str {
        &self.of.chain
    }

    /// As text: the load, and whose inertia was found.
    pub fn text(&self, units: &Units) -> String {
        let links = format!("{} {}", number(self.fit.links), units.inertia());
        let inertia = match self.flexible {
            true => format!("the inertia of its links is {links} on average"),
            false => format!(
                "the inertia of its links is {links} on average, that of its drive {}",
                inertia_text(self.fit.beside_links, units)
            ),
        };
        format!(
            "{} of {}: gravity and the other joints make up {} of the recorded {} (root mean square); {inertia}",
            joint_name(&format!("'{}'", readable(&self.of.joint))),
            self.of.chain,
            percent(self.share),
            units.effort
        )
    }

    /// As facts of a page.
    pub fn facts(&self, units: &Units) -> Vec<Fact> {
        let links = typeset(&format!("{} {}", number(self.fit.links), units.inertia()));
        let joint = joint_name(&format!("'{}'", self.of.joint));
        let of = format!("of {joint} of {}", self.of.chain);
        let inertia = match self.flexible {
            true => Fact::new("Inertia of the links", links, format!("on average, {of}")),
            false => {
                let drive = typeset(&inertia_text(self.fit.beside_links, units));
                Fact::new(
                    "Inertia of the drive",
                    drive,
                    format!("beside {links} of the links, on average"),
                )
            }
        };
        let share = format!("of the recorded {}, root mean square, {of}", units.effort);
        let load = Fact::new("Gravity and the other joints", percent(self.share), share);
        vec![inertia, load]
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let drive = (!self.flexible).then(|| inertia_json(self.fit.beside_links));
        json!({
            "name": self.of.chain,
            "joint": self.of.joint,
            "load_share": self.share,
            "load_factor": self.fit.factor,
            "links_inertia": self.fit.links,
            "drive_inertia": drive,
        })
    }
}
