//! What a simulated record shows when it is identified.

use anyhow::Result;
use flexure::Record;
use flexure::bands::Band;
use flexure::identify::robot_joint::{
    Estimated, Finding, FlexibleAxis, FlexibleJoint, IdentifiedJoint, JointLoad, RigidAxis, RigidJoint, TwoLinkLog,
};
use flexure::manipulator::add_noise;
use flexure::manipulator::chain::JointPath;

use super::chain::ChainTrial;
use super::{Arguments, Extremes};
use flexure::text::percent;
use flexure_workbench::joints::{Units, parameter_text};
use flexure_workbench::lines::Lines;
use flexure_workbench::text::{joint_name, number};

/// A standard error, or half a band's width, above this share is a poor estimate.
const POOR: f64 = 0.1;
/// An error of the torque of a chain's joint above this share of its limit is one too.
const FINE: f64 = 0.01;

/// Identifies every joint of a chain from its motion with noise.
pub fn rehearse_chain(trial: &ChainTrial, arguments: &Arguments) -> Result<Rehearsal> {
    let chain = trial.robot.chain.chain();
    let mut log = Record::new::<String>([])?;
    let mut noise: Vec<(String, f64)> = Vec::new();
    for (i, ((path, drive), limits)) in trial.paths.iter().zip(&trial.drives).zip(&trial.limits).enumerate() {
        log.push(format!("q{i}"), path.position.clone())?;
        log.push(format!("tau{i}"), drive.torque.clone())?;
        noise.push((format!("q{i}"), arguments.encoder_noise));
        noise.push((format!("tau{i}"), arguments.torque_noise * limits.torque));
        if let Some(motor) = &drive.motor {
            log.push(format!("qm{i}"), motor.clone())?;
            noise.push((format!("qm{i}"), arguments.encoder_noise));
        }
    }
    let noise: Vec<(&str, f64)> = noise.iter().map(|(name, sd)| (name.as_str(), *sd)).collect();
    let log = add_noise(&log, arguments.seed, &noise)?;
    let positions: Vec<&[f64]> = (0..trial.paths.len())
        .map(|i| log.column(&format!("q{i}")))
        .collect::<flexure::Result<_>>()?;
    let loads = JointLoad::of_chain(chain, &positions, arguments.sample_time)?;
    let mut rehearsal = Rehearsal::default();
    for (i, (joint, prismatic)) in chain.joints().iter().zip(chain.prismatic()).enumerate() {
        let of = format!("{}: ", joint_name(joint));
        let torque = log.column(&format!("tau{i}"))?;
        let found = match trial.drives[i].motor.is_some() {
            true => FlexibleJoint {
                motor: log.column(&format!("qm{i}"))?,
                link: positions[i],
                torque,
                load: Some(&loads[i]),
                sample_time: arguments.sample_time,
                motor_inertia: None,
                level: 0.95,
            }
            .identify(),
            false => RigidJoint {
                position: positions[i],
                torque,
                velocity: None,
                load: Some(&loads[i]),
                sample_time: arguments.sample_time,
                extras: &[],
                level: 0.95,
            }
            .identify()
            .map(|axis| IdentifiedJoint::Rigid(Box::new(axis))),
        };
        match found {
            Err(error) => rehearsal.cannot.push(format!("{of}anything: {error}")),
            Ok(IdentifiedJoint::Rigid(axis)) => rehearsal.rigid(
                &axis,
                &of,
                &Units::of(prismatic),
                &trial.paths[i],
                trial.limits[i].torque,
            ),
            Ok(IdentifiedJoint::Flexible(axis)) => rehearsal.joint(&axis, &of),
        }
    }
    Ok(rehearsal)
}

/// What a record can and cannot show, one line each.
#[derive(Default)]
pub struct Rehearsal {
    pub can: Vec<String>,
    pub cannot: Vec<String>,
}

/// Identifies the motion with noise.
pub fn rehearse(motion: &Record, free: [bool; 2], limits: [Extremes; 2], arguments: &Arguments) -> Result<Rehearsal> {
    let mut noise: Vec<(String, f64)> = Vec::new();
    for i in (0..2).filter(|&i| free[i]) {
        noise.push((format!("q{}", i + 1), arguments.encoder_noise));
        noise.push((format!("qm{}", i + 1), arguments.encoder_noise));
        noise.push((format!("tau{}", i + 1), arguments.torque_noise * limits[i].torque));
    }
    let noise: Vec<(&str, f64)> = noise.iter().map(|(name, sd)| (name.as_str(), *sd)).collect();
    let log = add_noise(motion, arguments.seed, &noise)?;
    let columns = |name: &str| -> Result<[&[f64]; 2]> {
        Ok([log.column(&format!("{name}1"))?, log.column(&format!("{name}2"))?])
    };
    let (motor, link, torque) = (columns("qm")?, columns("q")?, columns("tau")?);
    let mut rehearsal = Rehearsal::default();
    if free == [true; 2] {
        let log = TwoLinkLog {
            motor,
            link,
            torque,
            sample_time: arguments.sample_time,
            level: 0.95,
        };
        match log.identify() {
            Err(error) => rehearsal
                .cannot
                .push(format!("anything of the arm as a whole: {error}")),
            Ok(arm) => {
                rehearsal.number("the shoulder's inertia", arm.shoulder);
                rehearsal.number("the elbow's inertia", arm.elbow);
                rehearsal.number("the inertial coupling m2 l1 lc2", arm.coupling);
                rehearsal.cannot.push(
                    "masses, lengths and centres of mass of the links one by one: the motion depends on three constants of them"
                        .to_owned(),
                );
                for (i, axis) in arm.joints.iter().enumerate() {
                    rehearsal.joint(axis, &format!("joint {}: ", i + 1));
                }
            }
        }
        return Ok(rehearsal);
    }
    let joint = usize::from(!free[0]);
    let log = FlexibleJoint {
        motor: motor[joint],
        link: link[joint],
        torque: torque[joint],
        load: None,
        sample_time: arguments.sample_time,
        motor_inertia: None,
        level: 0.95,
    };
    match log.identify() {
        Err(error) => rehearsal.cannot.push(format!("anything of the joint: {error}")),
        Ok(IdentifiedJoint::Rigid(axis)) => rehearsal.cannot.extend(axis.findings.iter().map(ToString::to_string)),
        Ok(IdentifiedJoint::Flexible(axis)) => {
            rehearsal.number("the link's inertia", axis.link.inertia);
            rehearsal.joint(&axis, "");
        }
    }
    Ok(rehearsal)
}

impl Rehearsal {
    /// As text.
    pub fn write(&self, lines: &mut Lines) {
        for (title, items) in [("It can tell", &self.can), ("It cannot tell", &self.cannot)] {
            if !items.is_empty() {
                lines.sentence(format!("{title}:"));
                lines.deeper(|lines| items.iter().for_each(|item| lines.sentence(&**item)));
            }
        }
    }

    /// A rigid joint of a chain: how well its drive's inertia and its friction would be known, whatever they are. An error counts by the torque
    /// that it is, against the limit.
    fn rigid(&mut self, axis: &RigidAxis, of: &str, units: &Units, path: &JointPath, limit: f64) {
        if let Some(chain) = axis.chain {
            let error = chain.beside_links.standard_error;
            let text = format!(
                "{of}the drive's inertia to within {} {} (one standard error), beside {} of the links",
                number(error),
                units.inertia(),
                number(chain.links)
            );
            self.sort(error * rms(path.acceleration.iter().copied()) < FINE * limit, text);
        }
        let (x, half) = (&axis.friction.band.x[0], half_width(&axis.friction.band));
        let text = format!(
            "{of}the friction from {} to {} {}/s to within {} {} (half the band)",
            number(x[0]),
            number(x[x.len() - 1]),
            units.position,
            number(half),
            units.torque
        );
        self.sort(half < FINE * limit, text);
        self.findings(&axis.findings, of);
    }

    /// What would be remarked on.
    fn findings(&mut self, findings: &[Finding], of: &str) {
        // A held torque is expected to be late by half a sample.
        let worth = |f: &&Finding| !matches!(f, Finding::TorqueDelay { held: true, .. });
        self.cannot
            .extend(findings.iter().filter(worth).map(|f| format!("{of}{f}")));
    }

    fn number(&mut self, what: &str, e: Estimated) {
        let share = e.standard_error / e.value.abs();
        let error = match share.is_finite() {
            true => format!("with a standard error of {}", percent(share)),
            false => "without a standard error".to_owned(),
        };
        self.sort(share < POOR, format!("{what}: {} kg m^2 {error}", number(e.value)));
    }

    fn sort(&mut self, can: bool, text: String) {
        match can {
            true => self.can.push(text),
            false => self.cannot.push(text),
        }
    }

    fn joint(&mut self, axis: &FlexibleAxis, of: &str) {
        self.number(&format!("{of}the motor's inertia"), axis.motor_inertia);
        for (name, band, unit) in [
            ("stiffness", &axis.stiffness.band, "rad"),
            ("friction", &axis.link.friction.band, "rad/s"),
        ] {
            let x = &band.x[0];
            let (low, high, width) = (number(x[0]), number(x[x.len() - 1]), width(band));
            let text = format!(
                "{of}the {name} curve from {low} to {high} {unit}, the band's half width {} of it; beyond, nothing",
                percent(width)
            );
            self.sort(width < POOR, text);
        }
        let units = Units::of(false);
        for form in [&axis.model.stiffness, &axis.model.friction] {
            for p in &form.parameters {
                let unit = units.of_curve(p.unit, form.form.is_stiffness());
                self.sort(p.identifiable, format!("{of}{}", parameter_text(p, &unit)));
            }
        }
        let forms = [&axis.model.stiffness, &axis.model.friction];
        let has = |symbol: &str| forms.iter().any(|f| f.parameter(symbol).is_some());
        for (symbol, what) in [
            (
                "ksw",
                "a soft wind-up: none is seen beside the noise within these deflections; load the joint more, and slowly through zero",
            ),
            (
                "a1",
                "a cubic stiffness: the deflections are too small for it; load the joint more",
            ),
            (
                "g1",
                "the Stribeck part g1, g2, g3 of friction; move more often through velocities near zero",
            ),
            ("g6", "viscous friction g6; move faster"),
        ] {
            if !has(symbol) {
                self.cannot.push(format!("{of}{what}"));
            }
        }
        self.findings(&axis.link.findings, of);
    }
}

/// Half the band's width over the curve, both as root mean squares.
fn width(band: &Band) -> f64 {
    half_width(band) / rms(band.estimate.iter().copied())
}

/// Half the band's width, root mean square.
fn half_width(band: &Band) -> f64 {
    rms(band.upper.iter().zip(&band.lower).map(|(u, l)| 0.5 * (u - l)))
}

fn rms(x: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = x.len() as f64;
    (x.map(|v| v * v).sum::<f64>() / n).sqrt()
}
