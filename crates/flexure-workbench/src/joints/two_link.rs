//! A two-link arm.

use anyhow::Result;
use flexure::identify::robot_joint::{AxisDrive, Estimated, Finding, NeededTorque, TwoLinkArm};
use flexure_report::data::JointPage;
use serde_json::{Value, json};

use super::arm_file::{self, Place, StartedArm};
use super::flexible::{Words, axis_json, curves, forms, write_axis};
use super::outcome::Outcome;
use super::row::Row;
use super::text::{Constant, Units, constants, with_error};
use super::{Curves, Joint, Log, Motion, Trial, page, simulation};
use crate::lines::Lines;

const OF_ARM: Words = Words {
    link: "M at q2 = 0",
    torque: "torques",
    no_motor_friction: "not identified for an arm: all friction counts as friction at the link",
};

/// An identified two-link arm with its log.
pub struct TwoLink {
    pub arm: TwoLinkArm,
    pub log: Log,
}

impl Joint for TwoLink {
    fn json(&self) -> Value {
        let arm = &self.arm;
        let [shoulder, elbow, coupling] = &arm.model;
        json!({
            "joint": "two_link_arm",
            "shoulder": arm.shoulder,
            "elbow": arm.elbow,
            "coupling": arm.coupling,
            "model": {
                "motor_inertia": arm.model_motors,
                "shoulder": shoulder,
                "elbow": elbow,
                "coupling": coupling,
            },
            "joints": arm.joints.iter().map(axis_json).collect::<Vec<_>>(),
        })
    }

    fn log(&self) -> &Log {
        &self.log
    }

    fn velocities(&self) -> Vec<&[f64]> {
        arm_file::own_velocities(&self.arm)
    }

    fn needed_torque(&self, log: &Log) -> flexure::Result<Vec<NeededTorque>> {
        log.needed(|i, motion| self.arm.joints[i].needed_torque(motion))
    }

    fn simulate(&self, log: &Log, velocities: &[&[f64]], _: Option<AxisDrive>) -> Result<Vec<Motion>> {
        let Ok(StartedArm { arm, initial }) = arm_file::two_link_arm(&self.arm, log, None, velocities) else {
            return Ok(Vec::new());
        };
        Ok(simulation::motions(arm, initial, log, velocities)?)
    }

    fn motions_json(&self, motions: &[Motion]) -> (&'static str, Value) {
        let of = |value: fn(&Motion) -> f64| motions.iter().map(value).collect::<Vec<_>>();
        let both = (!motions.is_empty()).then(|| {
            json!({
                "rms": of(|m| m.fit.rms),
                "fit_percent": of(|m| m.fit.percent),
                "velocity_fit_percent": of(|m| m.velocity_fit_percent),
            })
        });
        ("replay", json!(both))
    }

    fn summary(&self, trial: &Trial) -> Lines {
        let log = &self.log;
        let mut lines = Lines::new();
        let elbow = format!("elbow's inertia {} kg m^2", with_error(self.arm.elbow));
        Outcome::new(trial, self.arm.joints.iter().map(forms), self.findings()).write_headline(
            "Two-link arm",
            &elbow,
            &mut lines,
        );
        lines.item("log", format!("{} samples of {}", log.samples(), log.name));
        for Constant { name, formula, value } in constants(&self.arm) {
            lines.item(name, format!("{} kg m^2, {formula}", with_error(value)));
        }
        for (i, axis) in self.arm.joints.iter().enumerate() {
            lines.sentence(format!("Joint {}", i + 1));
            lines.deeper(|lines| write_axis(axis, &OF_ARM, trial.motions.get(i), lines));
        }
        trial.write_later(log, &Units::of(false), &mut lines);
        lines
    }

    fn page(&self, trial: &Trial) -> JointPage {
        page::two_link(&self.arm, &self.log, trial)
    }

    fn arm_file(&self, place: Place) -> Result<String> {
        arm_file::two_link(&self.arm, &self.log, place)
    }

    fn curves(&self) -> flexure::Result<Vec<Curves>> {
        self.arm.joints.iter().map(curves).collect()
    }

    fn inertias(&self) -> Vec<(&'static str, Estimated)> {
        let motors = (self.arm.joints.iter()).map(|axis| ("motor's inertia", axis.motor_inertia));
        let links = [
            ("shoulder's inertia", self.arm.shoulder),
            ("elbow's inertia", self.arm.elbow),
        ];
        links.into_iter().chain(motors).collect()
    }

    fn findings(&self) -> Vec<&Finding> {
        self.arm.joints.iter().flat_map(|axis| &axis.link.findings).collect()
    }

    fn row(&self, trial: &Trial) -> Row {
        let [shoulder, _] = &self.arm.joints;
        Row::of_flexible(
            shoulder,
            &Outcome::new(trial, [forms(shoulder)], &shoulder.link.findings),
        )
    }
}
