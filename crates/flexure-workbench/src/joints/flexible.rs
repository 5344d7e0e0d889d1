//! A flexible joint.

use anyhow::{Result, bail};
use flexure::identify::robot_joint::{AxisDrive, Effect, Estimated, Finding, Fitted, FlexibleAxis, NeededTorque};
use flexure_report::data::JointPage;
use serde_json::{Value, json};

use super::arm_file::{self, Place, StartedArm};
use super::chain::OfChain;
use super::curves::{curve_json, curve_record, range_text};
use super::outcome::Outcome;
use super::row::Row;
use super::simulation::Fit;
use super::text::{
    Units, estimate, fitted_json, formula, inertia_json, inertia_text, lack_text, nearness, titled, with_error,
    write_findings, write_others, write_parameters,
};
use super::{Curves, Joint, Log, Motion, Trial, page, simulation};
use crate::lines::Lines;
use crate::text::number;

/// An identified flexible joint with its log.
pub struct Flexible {
    pub axis: FlexibleAxis,
    pub log: Log,
}

impl Flexible {
    /// The simulated motion of a log with these velocities of the link, where gravity or a chain acts.
    fn motion(&self, log: &Log, velocity: &[f64]) -> Motion {
        let axis = &log.axes[0];
        let motor = axis.motor.as_ref().unwrap_or(&axis.position)[0];
        let [of_motor, of_link] = self.starting_velocities(log, velocity[0]);
        let start = [motor, axis.position[0], of_motor, of_link];
        let position: Vec<f64> = self
            .axis
            .replay(&axis.torque, axis.load(), start)
            .iter()
            .map(|[_, link]| *link)
            .collect();
        let slopes =
            |x: &[f64]| -> Vec<f64> { x.windows(2).map(|pair| (pair[1] - pair[0]) / log.sample_time).collect() };
        Motion {
            drive: "under the recorded torque",
            fit: Fit::new(&axis.position, &position),
            velocity_fit_percent: Fit::new(&velocity[..velocity.len() - 1], &slopes(&position)).percent,
            position,
        }
    }
}

impl Flexible {
    /// The velocities of motor and link with which a log begins, from a smoothed one of the link.
    fn starting_velocities(&self, log: &Log, smoothed: f64) -> [f64; 2] {
        let axis = &log.axes[0];
        let motor = axis.motor.as_ref().unwrap_or(&axis.position);
        let angles = [&motor[..], &axis.position[..]];
        self.axis
            .starting_velocities(&axis.torque, axis.load(), angles, smoothed)
    }
}

impl Joint for Flexible {
    fn json(&self) -> Value {
        let mut object = axis_json(&self.axis);
        object["joint"] = json!("flexible");
        self.with_chain(object)
    }

    fn log(&self) -> &Log {
        &self.log
    }

    fn velocities(&self) -> Vec<&[f64]> {
        vec![&self.axis.link.friction.x]
    }

    fn needed_torque(&self, log: &Log) -> flexure::Result<Vec<NeededTorque>> {
        log.needed(|_, motion| self.axis.needed_torque(motion))
    }

    fn simulate(&self, log: &Log, velocities: &[&[f64]], _: Option<AxisDrive>) -> Result<Vec<Motion>> {
        // The simulated arm has no gravity and no chain.
        if !self.axis.link.extras.is_empty() || log.axes[0].load.is_some() {
            return Ok(vec![self.motion(log, velocities[0])]);
        }
        let StartedArm { arm, mut initial } = arm_file::alone(&self.axis, log, velocities);
        [initial.dqm[0], initial.dq[0]] = self.starting_velocities(log, velocities[0][0]);
        Ok(simulation::motions(arm, initial, log, velocities)?)
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

    fn summary(&self, trial: &Trial) -> Lines {
        let (axis, log) = (&self.axis, &self.log);
        let mut lines = Lines::new();
        let inertia = format!("link inertia {}", inertia_text(axis.link.inertia, &Units::of(false)));
        Outcome::new(trial, [forms(axis)], &axis.link.findings).write_headline("Flexible joint", &inertia, &mut lines);
        lines.item("log", format!("{} samples of {}", log.samples(), log.name));
        if let Some(chain) = self.of_chain() {
            lines.item("chain", chain.text(&Units::of(false)));
        }
        write_axis(axis, &ALONE, trial.motions.first(), &mut lines);
        trial.write_later(log, &Units::of(false), &mut lines);
        lines
    }

    fn page(&self, trial: &Trial) -> JointPage {
        page::flexible(&self.axis, &self.log, trial)
    }

    fn arm_file(&self, place: Place) -> Result<String> {
        if !self.axis.link.extras.is_empty() {
            bail!(
                "an arm file has no gravity, which acts on this joint, and without it the arm would not move as the joint does"
            );
        }
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

    fn findings(&self) -> Vec<&Finding> {
        self.axis.link.findings.iter().collect()
    }

    fn of_chain(&self) -> Option<OfChain<'_>> {
        OfChain::new(&self.log.axes[0], self.axis.link.chain)
    }

    fn row(&self, trial: &Trial) -> Row {
        Row::of_flexible(
            &self.axis,
            &Outcome::new(trial, [forms(&self.axis)], &self.axis.link.findings),
        )
    }
}

/// The results of a joint as JSON.
pub fn axis_json(axis: &FlexibleAxis) -> Value {
    let units = Units::of(false);
    let list = |forms: &[Fitted]| -> Vec<Value> { forms.iter().map(|f| fitted_json(f, &units)).collect() };
    json!({
        "motor_inertia": inertia_json(axis.motor_inertia),
        "motor_inertia_by_equations": axis.by_equations.map(inertia_json),
        "link_inertia": inertia_json(axis.link.inertia),
        "stiffness": curve_json(&axis.stiffness.band),
        "secant_stiffness": curve_json(&axis.secant),
        "friction": curve_json(&axis.link.friction.band),
        "motor_friction": axis.motor_friction.as_ref().map(|curve| curve_json(&curve.band)),
        "damping": axis.damping,
        "extras": axis.link.extras,
        "effects": axis.effects,
        "competing": axis.competing,
        "stiffness_forms": list(&axis.stiffness.forms),
        "best_stiffness_form": axis.stiffness.best().form,
        "friction_forms": list(&axis.link.friction.forms),
        "best_friction_form": axis.link.friction.best().form,
        "motor_friction_forms": axis.motor_friction.as_ref().map(|curve| list(&curve.forms)),
        "best_motor_friction_form": axis.motor_friction.as_ref().map(|curve| curve.best().form),
        "model": {
            "stiffness": fitted_json(&axis.model.stiffness, &units),
            "friction": fitted_json(&axis.model.friction, &units),
            "motor_friction": axis.model.motor_friction.as_ref().map(|form| fitted_json(form, &units)),
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
        motor_friction: (axis.motor_friction.as_ref())
            .map(|curve| curve_record(&curve.band, ["velocity", "torque"]))
            .transpose()?,
        stiffness: Some(stiffness),
    })
}

/// The forms of a joint's model, the friction at the link last.
pub fn forms(axis: &FlexibleAxis) -> Vec<&Fitted> {
    let model = &axis.model;
    let others = std::iter::once(&model.stiffness).chain(&model.motor_friction);
    others.chain([&model.friction]).collect()
}

/// The form of the friction at the motor, with its place.
pub fn at_motor(axis: &FlexibleAxis) -> Option<(&Fitted, &'static str)> {
    axis.model.motor_friction.as_ref().map(|form| (form, ", at the motor"))
}

/// The words in which the text on a joint alone differs from that on a joint of an arm.
pub struct Words {
    /// Its link's inertia.
    pub link: &'static str,
    /// The recorded drive of its simulated motion.
    pub torque: &'static str,
    /// Why there is no friction at the motor.
    pub no_motor_friction: &'static str,
}

const ALONE: Words = Words {
    link: "link inertia",
    torque: "torque",
    no_motor_friction: "none found: all friction that the log shows acts at the link",
};

/// The results of a joint.
pub fn write_axis(axis: &FlexibleAxis, words: &Words, motion: Option<&Motion>, lines: &mut Lines) {
    let units = Units::of(false);
    let inertia = |e: Estimated| match e.standard_error != 0.0 {
        true => inertia_text(e, &units),
        false => format!("{} kg m^2, as given", number(e.value)),
    };
    let equations = axis.by_equations.map_or_else(String::new, |by_equations| {
        let alone = inertia_text(by_equations, &units);
        format!(", by the simulated motion of short stretches; the equations of motion alone say {alone}")
    });
    lines.item("motor inertia", inertia(axis.motor_inertia) + &equations);
    lines.item(words.link, inertia(axis.link.inertia));
    lines.item("stiffness", range_text(&axis.stiffness.band, "rad"));
    lines.item("friction", range_text(&axis.link.friction.band, "rad/s"));
    match (&axis.motor_friction, axis.competing.contains(&Effect::MotorFriction)) {
        (Some(curve), false) => lines.item("motor friction", range_text(&curve.band, "rad/s")),
        (Some(_), true) => lines.item("motor friction", "not told from what the note names"),
        (None, _) => lines.item("motor friction", words.no_motor_friction),
    }
    if let Some(damping) = axis.damping {
        let value = match damping.is_positive() {
            true => format!("{} N m s/rad, beside the spring", with_error(damping)),
            false => "not identifiable: the best fit is not clearly positive".to_owned(),
        };
        lines.item("damping", value);
    }
    for extra in &axis.link.extras {
        lines.item(
            &extra.symbol,
            format!("{} {}", with_error(estimate(extra)), units.of_curve(extra.unit, true)),
        );
    }
    if let Some(motion) = motion {
        lines.item(
            "simulated motion",
            format!(
                "under the recorded {}: link angle {}; link velocity fit {:.2} %",
                words.torque,
                nearness(motion.fit, "rad"),
                motion.velocity_fit_percent
            ),
        );
    }
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    lines.sentence(format!("All forms together: {}", lack_text(friction)));
    for (form, place) in [(stiffness, ""), (friction, "")].into_iter().chain(at_motor(axis)) {
        lines.sentence(format!("{}{place}", titled(form)));
        lines.deeper(|lines| {
            lines.item("formula", formula(form));
            write_parameters(form, &units, lines);
        });
    }
    let of_motor = axis.motor_friction.iter().map(|curve| ("friction at the motor", curve));
    let curves = [("stiffness", &axis.stiffness), ("friction", &axis.link.friction)];
    for (what, curve) in curves.into_iter().chain(of_motor) {
        let heading = format!("Forms of the {what}, each in turn");
        write_others(&heading, &curve.by_bic(), &units, lines);
    }
    write_findings(&axis.link.findings, lines);
}
