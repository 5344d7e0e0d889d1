//! A flexible joint.

use anyhow::Result;
use flexure::identify::robot_joint::{AxisDrive, Estimated, Fitted, FlexibleAxis};
use flexure_report::data::JointPage;
use serde_json::{Value, json};

use super::arm_file::{self, Place, StartedArm};
use super::text::{
    Units, findings, fitted_json, fitted_lines, lack_text, nearness, parameter_lines, range_line, titled, with_error,
};
use super::{Curves, Joint, Log, Motion, curve_json, curve_record, page, simulation};
use crate::text::number;

/// An identified flexible joint with its log.
pub struct Flexible {
    pub axis: FlexibleAxis,
    pub log: Log,
}

impl Joint for Flexible {
    fn json(&self) -> Value {
        let mut object = axis_json(&self.axis);
        object["joint"] = json!("flexible");
        object
    }

    fn simulate(&self, _: Option<AxisDrive>) -> Result<Vec<Motion>> {
        let StartedArm { arm, initial } = arm_file::alone(&self.axis, &self.log);
        Ok(simulation::motions(arm, initial, &self.log, &[&self.axis])?)
    }

    fn motions_json(&self, motions: &[Motion]) -> (&'static str, Value) {
        let motion = motions.first().map(|m| {
            json!({
                "rms": m.fit.rms,
                "fit_percent": m.fit.percent,
                "velocity_fit_percent": m.velocity_fit_percent,
            })
        });
        ("replay", json!(motion))
    }

    fn summary(&self, motions: &[Motion]) -> Vec<String> {
        let log = &self.log;
        let mut lines = vec![format!("Flexible joint from {} samples of {}", log.samples(), log.name)];
        lines.extend(axis_lines(&self.axis, "link inertia"));
        lines.extend(motions.iter().map(|m| motion_line(m, "torque")));
        lines.extend(findings(&self.axis.link.findings));
        lines
    }

    fn page(&self, motions: &[Motion]) -> JointPage {
        page::flexible(&self.axis, &self.log, motions)
    }

    fn arm_file(&self, place: Place) -> Result<String> {
        arm_file::flexible(&self.axis, &self.log, place)
    }

    fn curves(&self) -> flexure::Result<Vec<Curves>> {
        Ok(vec![curves(&self.axis)?])
    }

    fn inertias(&self) -> Vec<(&'static str, Estimated)> {
        vec![
            ("motor's inertia", self.axis.motor_inertia),
            ("link's inertia", self.axis.link.inertia),
        ]
    }
}

/// The results of a joint as JSON.
pub fn axis_json(axis: &FlexibleAxis) -> Value {
    let units = Units::of(false);
    let list = |forms: &[Fitted]| -> Vec<Value> { forms.iter().map(|f| fitted_json(f, &units)).collect() };
    json!({
        "motor_inertia": axis.motor_inertia,
        "link_inertia": axis.link.inertia,
        "stiffness": curve_json(&axis.stiffness.band),
        "secant_stiffness": curve_json(&axis.secant),
        "friction": curve_json(&axis.link.friction.band),
        "stiffness_forms": list(&axis.stiffness.forms),
        "best_stiffness_form": axis.stiffness.best().form,
        "friction_forms": list(&axis.link.friction.forms),
        "best_friction_form": axis.link.friction.best().form,
        "model": {
            "stiffness": fitted_json(&axis.model.stiffness, &units),
            "friction": fitted_json(&axis.model.friction, &units),
        },
        "encoder_skew": axis.clock_offset,
        "cut_off": axis.link.cut_off,
        "highest_frequency": axis.link.highest,
        "findings": axis.link.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// The curves of a joint as the columns of files.
pub fn curves(axis: &FlexibleAxis) -> flexure::Result<Curves> {
    let mut stiffness = curve_record(&axis.stiffness.band, ["deflection", "torque"])?;
    let band = &axis.secant;
    stiffness.push("stiffness", band.estimate.clone())?;
    stiffness.push("stiffness_lower", band.lower.clone())?;
    stiffness.push("stiffness_upper", band.upper.clone())?;
    Ok(Curves {
        friction: curve_record(&axis.link.friction.band, ["velocity", "torque"])?,
        stiffness: Some(stiffness),
    })
}

/// How near a simulated motion is to the measured one; `torque` is what the recorded drive is called.
pub fn motion_line(motion: &Motion, torque: &str) -> String {
    format!(
        "  simulated under the recorded {torque}: link angle {}; link velocity fit {:.2} %",
        nearness(motion.fit, "rad"),
        motion.velocity_fit_percent
    )
}

/// The results of a joint, a line each; `link` names its link's inertia.
pub fn axis_lines(axis: &FlexibleAxis, link: &str) -> Vec<String> {
    let units = Units::of(false);
    let inertia = |name: &str, e: Estimated| match e.standard_error != 0.0 {
        true => format!("  {name:<14} {} kg m^2", with_error(e)),
        false => format!("  {name:<14} {} kg m^2  (as given)", number(e.value)),
    };
    let mut lines = vec![
        inertia("motor inertia", axis.motor_inertia),
        inertia(link, axis.link.inertia),
        range_line("stiffness", &axis.stiffness.band, "rad"),
        range_line("friction", &axis.link.friction.band, "rad/s"),
    ];
    for form in [&axis.model.stiffness, &axis.model.friction] {
        lines.push(format!("  {}", titled(form)));
        lines.extend(parameter_lines(form, &units));
    }
    lines.push(format!("    together {}", lack_text(&axis.model.friction)));
    for (what, curve) in [("stiffness", &axis.stiffness), ("friction", &axis.link.friction)] {
        lines.push(format!("  Forms of the {what}, each by itself"));
        for (i, form) in curve.forms.iter().enumerate() {
            let form = fitted_lines(form, &units, i == curve.best);
            lines.extend(form.into_iter().map(|line| format!("  {line}")));
        }
    }
    lines
}
