//! A rigid axis.

use anyhow::{Result, bail};
use flexure::identify::robot_joint::{AxisDrive, Estimated, Finding, RigidAxis};
use flexure_report::data::JointPage;
use serde_json::{Value, json};

use super::arm_file::{self, Place};
use super::simulation::Fit;
use super::text::{
    Outcome, Units, estimate, fitted_json, inertia_json, inertia_text, nearness, range_text, with_error,
    write_findings, write_form, write_others,
};
use super::{Curves, Joint, Log, Motion, curve_json, curve_record, page};
use crate::lines::Lines;

/// An identified rigid axis with its log.
pub struct Rigid {
    pub axis: RigidAxis,
    pub prismatic: bool,
    pub log: Log,
}

impl Rigid {
    /// The axis, which is prismatic or not.
    pub fn new(mut axis: RigidAxis, prismatic: bool, log: Log) -> Self {
        if prismatic {
            // There are no turns to be counted in metres.
            axis.findings.retain(|f| !matches!(f, Finding::ManyTurns { .. }));
        }
        Rigid { axis, prismatic, log }
    }

    fn units(&self) -> Units {
        Units::of(self.prismatic)
    }

    fn motion(&self, drive: AxisDrive, name: &'static str) -> Motion {
        let measured = &self.log.axes[0].position;
        let start = [measured[0], self.axis.friction.x[0]];
        let position = self.axis.replay(self.axis.friction.best(), drive, start);
        Motion {
            drive: name,
            fit: Fit::new(measured, &position),
            velocity_fit_percent: f64::NAN,
            position,
        }
    }
}

impl Joint for Rigid {
    fn json(&self) -> Value {
        let (axis, units) = (&self.axis, self.units());
        json!({
            "joint": "rigid",
            "inertia": inertia_json(axis.inertia),
            "inertia_unit": units.inertia(),
            "friction": curve_json(&axis.friction.band),
            "extras": axis.extras,
            "forms": axis.friction.forms.iter().map(|f| fitted_json(f, &units)).collect::<Vec<_>>(),
            "best_form": axis.friction.best().form,
            "cut_off": axis.cut_off,
            "highest_frequency": axis.highest,
            "encoder_skew": axis.stiff.map(|stiff| stiff.clock_offset),
            "compliance": axis.stiff.map(|stiff| stiff.compliance),
            "findings": axis.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        })
    }

    fn simulate(&self, position_loop: Option<AxisDrive>) -> Result<Vec<Motion>> {
        let torque = AxisDrive::Torque(&self.log.axes[0].torque);
        let mut motions = vec![self.motion(torque, "under the recorded torque")];
        motions.extend(position_loop.map(|drive| self.motion(drive, "in the position loop")));
        Ok(motions)
    }

    fn motions_json(&self, motions: &[Motion]) -> (&'static str, Value) {
        let each = motions
            .iter()
            .map(|m| json!({ "drive": m.drive, "rms": m.fit.rms, "fit_percent": m.fit.percent }));
        ("replays", each.collect())
    }

    fn summary(&self, motions: &[Motion]) -> Lines {
        let (axis, log, units) = (&self.axis, &self.log, self.units());
        let best = axis.friction.best();
        let inertia = inertia_text(axis.inertia, &units);
        let mut lines = Lines::new();
        Outcome::new(motions, [vec![best]]).write_headline("Rigid axis", &format!("inertia {inertia}"), &mut lines);
        lines.item("log", format!("{} samples of {}", log.samples(), log.name));
        lines.item("inertia", format!("{inertia}, beside the free friction curve"));
        let velocity = format!("{}/s", units.position);
        lines.item("friction", range_text(&axis.friction.band, &velocity));
        for extra in &axis.extras {
            let value = with_error(estimate(extra));
            lines.item(&extra.symbol, format!("{value} {}", units.of_curve(extra.unit, true)));
        }
        for motion in motions {
            let near = nearness(motion.fit, units.position);
            lines.item("simulated motion", format!("{}: {near}", motion.drive));
        }
        write_form(best, &units, &mut lines);
        lines.sentence("Other forms of the friction");
        let forms = axis.friction.forms.iter().enumerate();
        let others = forms.filter(|(i, _)| *i != axis.friction.best).map(|(_, form)| form);
        lines.deeper(|lines| write_others(others, &units, lines));
        write_findings(&axis.findings, &mut lines);
        lines
    }

    fn page(&self, motions: &[Motion]) -> JointPage {
        page::rigid(&self.axis, &self.units(), &self.log, motions)
    }

    fn arm_file(&self, place: Place) -> Result<String> {
        if !self.axis.extras.is_empty() {
            bail!("an arm file has no gravity or spring, and without them the arm would not move as the axis does");
        }
        arm_file::rigid(&self.axis, self.prismatic, &self.log, place)
    }

    fn curves(&self) -> flexure::Result<Vec<Curves>> {
        Ok(vec![Curves {
            friction: curve_record(&self.axis.friction.band, ["velocity", "torque"])?,
            motor_friction: None,
            stiffness: None,
        }])
    }

    fn inertias(&self) -> Vec<(&'static str, Estimated)> {
        vec![("inertia", self.axis.inertia)]
    }
}
