//! A joint as the page that shows it.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, Finding, Fitted, FlexibleAxis, RigidAxis, TwoLinkArm};
use flexure_report::data::{
    Axis, Comparison, Fact, JointCurve, JointPage, Nonlinearity, ParameterTable, Prediction, Scatter,
};

use super::arm::Simulated;
use super::data::{ArmLog, Log};
use super::rigid::{Replay, fit};
use super::two_link::{Replay as ArmReplay, constants};
use super::words::{Units, lack_words, parameter_words, with_error};
use flexure_workbench::text::number;

/// A stiffness whose band is wider than this share of its median is not shown.
const UNTOLD: f64 = 0.03;
/// Deflections below this share of the largest one are next to zero.
const NEXT: f64 = 0.2;

/// The page of a rigid axis.
pub fn rigid(axis: &RigidAxis, log: &Log, replays: &[Replay], units: &Units, command: Option<String>) -> JointPage {
    let best = &axis.forms[axis.best];
    let velocity = format!("velocity ({}/s)", units.position);
    let mut motions = vec![torque(log, &axis.reconstructed, units)];
    motions.extend(replays.iter().map(|r| motion(log, &r.position, r.drive, units)));
    JointPage {
        title: "A rigid axis".to_owned(),
        subtitle: subtitle(log),
        facts: vec![
            inertia("Inertia", axis.inertia, units.inertia()),
            lack(best),
            samples(log),
        ],
        warnings: warnings(&axis.findings).collect(),
        curves: vec![JointCurve {
            heading: "Friction".to_owned(),
            caption: "The torque that inertia and position-dependent terms leave, over the velocity, with the free curve and its \
                      band; dashed the form with the smallest BIC."
                .to_owned(),
            curve: curve(&axis.friction, [&velocity, &format!("torque ({})", units.torque)], |v| best.torque(v), best),
            points: Scatter {
                x: axis.velocity.clone(),
                y: axis.partial.clone(),
            },
        }],
        tables: axis.forms.iter().map(|f| table(f, units)).collect(),
        motions,
        command,
    }
}

/// The page of a flexible joint.
pub fn flexible(axis: &FlexibleAxis, log: &Log, replay: Option<&Simulated>, command: Option<String>) -> JointPage {
    let units = Units::of(false);
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    let mut motions = vec![torque(log, &axis.reconstructed, &units)];
    motions.extend(replay.map(|r| motion(log, &r.link, "under the recorded torque", &units)));
    JointPage {
        title: "A flexible joint".to_owned(),
        subtitle: subtitle(log),
        facts: vec![
            inertia("Motor inertia", axis.motor_inertia, "kg m^2"),
            inertia("Link inertia", axis.link_inertia, "kg m^2"),
            Fact {
                name: "Encoder skew".to_owned(),
                value: format!("{:.3} ms", 1e3 * axis.skew.value),
                note: match axis.findings.iter().any(|f| matches!(f, Finding::EncoderSkew { .. })) {
                    true => "by which the link's samples are late; corrected".to_owned(),
                    false => format!(
                        "not told from none (standard error {:.3} ms)",
                        1e3 * axis.skew.standard_error
                    ),
                },
            },
            samples(log),
        ],
        warnings: warnings(&axis.findings).collect(),
        curves: joint_curves(axis, ""),
        tables: [stiffness, friction]
            .into_iter()
            .chain(&axis.stiffness_forms)
            .chain(&axis.friction_forms)
            .map(|f| table(f, &units))
            .collect(),
        motions,
        command,
    }
}

/// The page of a two-link arm.
pub fn two_link(arm: &TwoLinkArm, log: &ArmLog, replay: Option<&ArmReplay>, command: Option<String>) -> JointPage {
    let units = Units::of(false);
    let mut facts: Vec<Fact> = constants(arm)
        .into_iter()
        .map(|(name, formula, value)| {
            let fact = inertia(&(name[..1].to_uppercase() + &name[1..]), value, "kg m^2");
            Fact {
                note: format!("{formula}; {}", fact.note),
                ..fact
            }
        })
        .collect();
    let (mut warnings, mut curves, mut tables, mut motions) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, (axis, name)) in arm.joints.iter().zip(["joint 1", "joint 2"]).enumerate() {
        facts.push(inertia(&format!("Motor inertia, {name}"), axis.motor_inertia, "kg m^2"));
        warnings.extend(self::warnings(&axis.findings).map(|f| format!("{name}: {f}")));
        curves.extend(joint_curves(axis, &format!(", {name}")));
        let forms = [&axis.model.stiffness, &axis.model.friction].into_iter();
        let forms = forms.chain(&axis.stiffness_forms).chain(&axis.friction_forms);
        tables.extend(forms.enumerate().map(|(k, f)| {
            let table = table(f, &units);
            let all = if k < 2 { ", all equations together" } else { "" };
            ParameterTable {
                heading: format!("{} of {name}{all}", table.heading),
                ..table
            }
        }));
        let step = log.sample_time;
        motions.push(comparison(
            time(step),
            format!("Torque of {name}: measured against reconstructed from the motion"),
            "torque (N m)".to_owned(),
            &log.torque[i],
            &axis.reconstructed,
        ));
        motions.extend(replay.map(|r| {
            comparison(
                time(step),
                format!("Motion of {name}: measured against simulated under the recorded torques"),
                "angle (rad)".to_owned(),
                &log.link[i],
                &r.link[i],
            )
        }));
    }
    JointPage {
        title: "A two-link arm".to_owned(),
        subtitle: format!(
            "Friction, stiffness and inertia of both joints from {} samples of {}.",
            log.link[0].len(),
            log.file
        ),
        facts,
        warnings,
        curves,
        tables,
        motions,
        command,
    }
}

/// The curves of a flexible joint; `of` is added to their headings.
fn joint_curves(axis: &FlexibleAxis, of: &str) -> Vec<JointCurve> {
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    let cloud = |x: &[f64], y: &[f64]| Scatter {
        x: x.to_vec(),
        y: y.to_vec(),
    };
    let deflection = "deflection (rad)";
    let curves = vec![
            JointCurve {
                heading: "Stiffness".to_owned(),
                caption: "The stiffness k(d) = κ(d)/d with its band, where that is narrow enough to tell it: a dip at zero is a soft wind-up. Next \
                          to zero no torque tells it."
                    .to_owned(),
                curve: told(curve(
                    &axis.secant,
                    [deflection, "stiffness (N m/rad)"],
                    |d| if d == 0.0 { f64::NAN } else { stiffness.torque(d) / d },
                    stiffness,
                )),
                points: Scatter::default(),
            },
            JointCurve {
                heading: "Elastic torque".to_owned(),
                caption: "The torque that the motor's inertia leaves, over the deflection, with the free curve.".to_owned(),
                curve: curve(&axis.stiffness, [deflection, "torque (N m)"], |d| stiffness.torque(d), stiffness),
                points: cloud(&axis.deflection, &axis.partial_stiffness),
            },
            JointCurve {
                heading: "Friction".to_owned(),
                caption: "The elastic torque that the link's inertia leaves, over the link's velocity, with the free curve and its \
                          band."
                    .to_owned(),
                curve: curve(&axis.friction, ["velocity (rad/s)", "torque (N m)"], |v| friction.torque(v), friction),
                points: cloud(&axis.velocity, &axis.partial_friction),
            },
        ];
    curves
        .into_iter()
        .map(|c| JointCurve {
            heading: c.heading.clone() + of,
            ..c
        })
        .collect()
}

fn subtitle(log: &Log) -> String {
    format!(
        "Friction, stiffness and inertia from {} samples of {}.",
        log.position.len(),
        log.file
    )
}

fn inertia(name: &str, value: Estimated, unit: &str) -> Fact {
    Fact {
        name: name.to_owned(),
        value: typeset(&format!("{} {unit}", number(value.value))),
        note: match value.standard_error {
            0.0 => "as given".to_owned(),
            error if error.is_finite() => format!("standard error {}", number(error)),
            _ => "no standard error: see the notes".to_owned(),
        },
    }
}

/// Words of the terminal with the signs of a page.
fn typeset(words: &str) -> String {
    words.replace("+-", "±").replace("^2", "²").replace("^3", "³")
}

/// What is to be known before trusting a result; that a torque is held from sample to sample is how it should be.
fn warnings(findings: &[Finding]) -> impl Iterator<Item = String> {
    let worth = |f: &&Finding| !matches!(f, Finding::TorqueDelay { held: true, .. });
    findings.iter().filter(worth).map(ToString::to_string)
}

fn samples(log: &Log) -> Fact {
    Fact {
        name: "Samples".to_owned(),
        value: log.position.len().to_string(),
        note: format!("{} s apart", number(log.sample_time)),
    }
}

fn lack(best: &Fitted) -> Fact {
    Fact {
        name: "Best form".to_owned(),
        value: format!("{:.1} %", 100.0 * best.lack_of_fit.distance),
        note: format!("root mean square distance of {} from the free curve", best.form.title()),
    }
}

fn curve(band: &Band, [x, y]: [&str; 2], form: impl Fn(f64) -> f64, fitted: &Fitted) -> Nonlinearity {
    Nonlinearity {
        x_label: x.to_owned(),
        y_label: y.to_owned(),
        x: band.x[0].clone(),
        y: band.estimate.clone(),
        lower: band.lower.clone(),
        upper: band.upper.clone(),
        band_label: format!("{} % pointwise", 100.0 * band.level),
        density: Vec::new(),
        truth: band.x[0].iter().map(|&x| form(x)).collect(),
        truth_label: fitted.form.title().to_owned(),
    }
}

/// Without the points at which a stiffness is not told.
fn told(mut curve: Nonlinearity) -> Nonlinearity {
    let mut size: Vec<f64> = curve.y.iter().map(|y| y.abs()).collect();
    size.sort_unstable_by(f64::total_cmp);
    let widest = UNTOLD * size[size.len() / 2];
    let wide: Vec<bool> = (0..curve.x.len())
        .map(|i| !(curve.upper[i] - curve.lower[i] < widest))
        .collect();
    // Next to zero nothing in between is told either.
    let farthest = curve.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let near = wide
        .iter()
        .zip(&curve.x)
        .filter(|(wide, x)| **wide && x.abs() < NEXT * farthest);
    let reach = near.fold(-1.0_f64, |m, (_, x)| m.max(x.abs()));
    for (i, wide) in wide.into_iter().enumerate() {
        if wide || curve.x[i].abs() <= reach {
            (curve.y[i], curve.lower[i], curve.upper[i]) = (f64::NAN, f64::NAN, f64::NAN);
        }
    }
    curve
}

fn table(form: &Fitted, units: &Units) -> ParameterTable {
    let title = form.form.title();
    let mut rows: Vec<[String; 2]> = Vec::new();
    if form.inertia.value.is_finite() {
        let value = with_error(form.inertia.value, form.inertia.standard_error);
        rows.push(["inertia".to_owned(), typeset(&format!("{value} {}", units.inertia()))]);
    }
    for parameter in &form.parameters {
        let unit = units.of_curve(parameter.unit, form.form.is_stiffness());
        let words = parameter_words(parameter, &unit);
        let words = words.strip_prefix(&parameter.symbol).unwrap_or(&words).trim();
        rows.push([parameter.symbol.clone(), typeset(words)]);
    }
    ParameterTable {
        heading: title[..1].to_uppercase() + &title[1..],
        rows,
        note: lack_words(form),
    }
}

fn time(step: f64) -> Axis {
    Axis {
        name: "time".to_owned(),
        unit: "s".to_owned(),
        start: 0.0,
        step,
    }
}

fn comparison(time: Axis, heading: String, y_label: String, measured: &[f64], predicted: &[f64]) -> Comparison {
    let n = measured.len().min(predicted.len());
    let (rms, fit_percent) = fit(measured, predicted);
    Comparison {
        heading,
        prediction: Prediction {
            y_label,
            time,
            measured: measured[..n].to_vec(),
            predicted: predicted[..n].to_vec(),
            fit_percent,
            rms,
        },
    }
}

fn torque(log: &Log, reconstructed: &[f64], units: &Units) -> Comparison {
    let heading = "Torque: measured against reconstructed from the motion".to_owned();
    comparison(
        time(log.sample_time),
        heading,
        format!("torque ({})", units.torque),
        &log.torque,
        reconstructed,
    )
}

fn motion(log: &Log, simulated: &[f64], drive: &str, units: &Units) -> Comparison {
    let heading = format!("Motion: measured against simulated {drive}");
    comparison(
        time(log.sample_time),
        heading,
        format!("position ({})", units.position),
        &log.position,
        simulated,
    )
}
