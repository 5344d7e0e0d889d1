//! A rigid axis.

use anyhow::{Result, bail};
use flexure::identify::robot_joint::{
    AxisDrive, Estimated, Finding, Fitted, NeededTorque, Parameter, Polished, RigidAxis,
};
use flexure_report::data::JointPage;
use serde_json::{Value, json};

use super::arm_file::{self, Place};
use super::chain::OfChain;
use super::curves::{curve_json, curve_record, range_text};
use super::outcome::Outcome;
use super::row::Row;
use super::simulation::Fit;
use super::text::{
    Units, estimate, fitted_json, inertia_json, inertia_text, nearness, with_error, write_findings, write_form,
    write_others,
};
use super::{Curves, Joint, Log, Motion, Trial, page};
use crate::lines::{Lines, unbroken};
use crate::text::number;

/// An identified rigid axis with its log.
pub struct Rigid {
    pub axis: RigidAxis,
    pub prismatic: bool,
    pub log: Log,
}

impl Rigid {
    /// The axis; `prismatic` says whether it moves along a line.
    pub fn new(axis: RigidAxis, prismatic: bool, log: Log) -> Self {
        Rigid { axis, prismatic, log }
    }

    fn units(&self) -> Units {
        Units::of(self.prismatic)
    }

    /// The form with which the axis is simulated: the polished one, if held-back halves of the log confirm it.
    fn simulated(&self) -> &Fitted {
        let polished = self.axis.polished.as_ref().filter(|polished| polished.is_used);
        polished.map_or(self.axis.friction.best(), |polished| &polished.form)
    }

    /// The simulated motion of a log that starts with this velocity.
    fn motion(&self, log: &Log, velocity: f64, drive: AxisDrive, name: &'static str) -> Motion {
        let measured = &log.axes[0].position;
        // As in the fit of the polished form.
        let best = self.axis.friction.best();
        let velocity = self.axis.starting_velocity(best, drive, measured, velocity);
        let position = self.axis.replay(self.simulated(), drive, [measured[0], velocity]);
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
        let object = json!({
            "joint": "rigid",
            "inertia": inertia_json(axis.inertia),
            "inertia_unit": units.inertia(),
            "friction": curve_json(&axis.friction.band),
            "extras": axis.extras,
            "forms": axis.friction.forms.iter().map(|f| fitted_json(f, &units)).collect::<Vec<_>>(),
            "best_form": axis.friction.best().form,
            "polished": axis.polished.as_ref().map(|polished| polished_json(polished, &units)),
            "cut_off": axis.cut_off,
            "highest_frequency": axis.highest,
            "encoder_skew": axis.stiff.map(|stiff| stiff.clock_offset),
            "compliance": axis.stiff.map(|stiff| stiff.compliance),
            "findings": axis.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        self.with_chain(object)
    }

    fn log(&self) -> &Log {
        &self.log
    }

    fn velocities(&self) -> Vec<&[f64]> {
        vec![&self.axis.friction.x]
    }

    fn needed_torque(&self, log: &Log) -> flexure::Result<Vec<NeededTorque>> {
        log.needed(|_, motion| self.axis.needed_torque(motion))
    }

    fn simulate(&self, log: &Log, velocities: &[&[f64]], position_loop: Option<AxisDrive>) -> Result<Vec<Motion>> {
        let torque = log.axes[0].free_torque();
        let torque = AxisDrive::Torque(&torque);
        let motion = |drive, name| self.motion(log, velocities[0][0], drive, name);
        let mut motions = vec![motion(torque, "under the recorded torque")];
        motions.extend(position_loop.map(|drive| motion(drive, "in the position loop")));
        Ok(motions)
    }

    fn motions_json(&self, motions: &[Motion]) -> (&'static str, Value) {
        let each = motions
            .iter()
            .map(|m| json!({ "drive": m.drive, "rms": m.fit.rms, "fit_percent": m.fit.percent }));
        ("replays", each.collect())
    }

    fn summary(&self, trial: &Trial) -> Lines {
        let (axis, log, units) = (&self.axis, &self.log, self.units());
        let best = axis.friction.best();
        let inertia = inertia_text(axis.inertia, &units);
        let mut lines = Lines::new();
        Outcome::new(trial, [vec![best]], &axis.findings).write_headline(
            "Rigid axis",
            &format!("{} {inertia}", units.moved()),
            &mut lines,
        );
        lines.item("log", format!("{} samples of {}", log.samples(), log.name));
        lines.item(units.moved(), format!("{inertia}, with a free friction curve"));
        if let Some(chain) = self.of_chain() {
            lines.item("chain", chain.text(&units));
        }
        let velocity = format!("{}/s", units.position);
        lines.item("friction", range_text(&axis.friction.band, &velocity));
        for extra in &axis.extras {
            let value = with_error(estimate(extra));
            lines.item(&extra.symbol, format!("{value} {}", units.of_curve(extra.unit, true)));
        }
        for motion in &trial.motions {
            let near = nearness(motion.fit, units.position);
            lines.item("simulated motion", format!("{}: {near}", motion.drive));
        }
        write_form(best, &units, &mut lines);
        if let Some(polished) = &axis.polished {
            lines.item("polished", polished_text(polished, &units));
        }
        let by_bic = axis.friction.by_bic();
        write_others(
            "Other forms of the friction",
            by_bic.get(1..).unwrap_or_default(),
            &units,
            &mut lines,
        );
        write_findings(&axis.findings, &mut lines);
        trial.write_later(log, &units, &mut lines);
        lines
    }

    fn page(&self, trial: &Trial) -> JointPage {
        page::rigid(&self.axis, &self.units(), &self.log, trial)
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

    fn findings(&self) -> Vec<&Finding> {
        self.axis.findings.iter().collect()
    }

    fn of_chain(&self) -> Option<OfChain<'_>> {
        OfChain::new(&self.log.axes[0], self.axis.chain)
    }

    fn row(&self, trial: &Trial) -> Row {
        Row::of_rigid(
            &self.axis,
            &Outcome::new(trial, [vec![self.axis.friction.best()]], &self.axis.findings),
        )
    }
}

/// The form polished by its free run as JSON.
fn polished_json(polished: &Polished, units: &Units) -> Value {
    let [before, after] = polished.error;
    let [held_back, polished_held_back] = polished.held_back;
    json!({
        "form": fitted_json(&polished.form, units),
        "rms": after,
        "rms_before": before,
        "held_back_rms": polished_held_back,
        "held_back_rms_before": held_back,
        "is_used": polished.is_used,
        "differs": polished.differs,
    })
}

/// The effect of polishing by the free run, as text.
fn polished_text(polished: &Polished, units: &Units) -> String {
    let [before, after] = polished.error.map(number);
    let [held_back, polished_held_back] = polished.held_back.map(number);
    let unit = units.position;
    let lowered =
        format!("fitting the simulated motion lowered its error from {before} to {after} {unit} on the data fitted");
    if !polished.is_used {
        let but = match polished.held_back {
            [before, after] if after > before => "raised",
            _ => "hardly changed",
        };
        return format!(
            "{lowered}, but {but} it on data held back, from {held_back} to {polished_held_back} {unit}. The values so fitted are not used"
        );
    }
    let form = &polished.form;
    let inertia = ("M", form.inertia.value, units.inertia().to_owned());
    let of_curve = |p: &Parameter| units.of_curve(p.unit, false);
    let refined = form
        .parameters
        .iter()
        .map(|p| (p.symbol.as_str(), p.value, of_curve(p)));
    let each = std::iter::once(inertia).chain(refined);
    let each = each.map(|(symbol, value, unit)| unbroken(&format!("{symbol} = {} {unit}", number(value))));
    let differs = match &polished.differs[..] {
        [] => "All agree with the values above within the errors given there".to_owned(),
        [one] => format!("{one} differs from the value above by more than the error given there"),
        differs => format!(
            "{} differ from the values above by more than the errors given there",
            differs.join(", ")
        ),
    };
    format!(
        "{lowered}, and from {held_back} to {polished_held_back} {unit} on data held back. The values so fitted are {}, without standard \
         errors. {differs}. Use them only to simulate the motion. Compare the values above with those of other logs",
        each.collect::<Vec<_>>().join(", "),
    )
}
