//! A joint as the page that shows it.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, Finding, Fitted, FlexibleAxis, RigidAxis, TwoLinkArm};
use flexure_report::data::{
    Axis, Comparison, Fact, JointCurve, JointPage, Nonlinearity, ParameterTable, Prediction, Scatter,
};

use super::simulation::Fit;
use super::text::{Constant, Outcome, Units, constants, lack_text, parameter_value, titled, with_error};
use super::{Log, Motion};
use crate::plots::{banded, median};
use crate::text::{capitalised, number};

/// A stiffness whose band is wider than this share of its median is not shown.
const WIDEST_BAND: f64 = 0.03;
/// Deflections below this share of the largest one are next to zero.
const NEXT: f64 = 0.2;

/// The page of a rigid axis.
pub fn rigid(axis: &RigidAxis, units: &Units, log: &Log, motions: &[Motion]) -> JointPage {
    let best = axis.friction.best();
    let labels = [
        format!("velocity ({}/s)", units.position),
        format!("torque ({})", units.torque),
    ];
    let distance = format!("{:.1} %", 100.0 * best.lack_of_fit.distance);
    let from = format!("root mean square distance of {} from the free curve", best.form.title());
    JointPage {
        title: "A rigid axis".to_owned(),
        subtitle: subtitle("", log),
        verdict: Some(Outcome::new(motions, [best]).verdict()),
        facts: vec![
            inertia("Inertia", axis.inertia, units.inertia()),
            Fact::new("Best form", distance, from),
            samples(log),
        ],
        warnings: warnings(&axis.findings).collect(),
        curves: vec![JointCurve::new(
            "Friction",
            "The torque that inertia and position-dependent terms leave, over the velocity, with the free curve and its \
             band; dashed the form with the smallest BIC.",
            curve(&axis.friction.band, [&labels[0], &labels[1]], |v| best.torque(v), best),
            Scatter::new(&axis.friction.x[..], &axis.friction.partial[..]),
        )],
        tables: axis.friction.forms.iter().map(|f| table(f, units)).collect(),
        motions: comparisons(log, 0, &axis.reconstructed, motions, units, ""),
        command: None,
        python: None,
    }
}

/// The page of a flexible joint.
pub fn flexible(axis: &FlexibleAxis, log: &Log, motions: &[Motion]) -> JointPage {
    let units = Units::of(false);
    JointPage {
        title: "A flexible joint".to_owned(),
        subtitle: subtitle("", log),
        verdict: Some(Outcome::new(motions, [&axis.model.friction]).verdict()),
        facts: vec![
            inertia("Motor inertia", axis.motor_inertia, "kg m^2"),
            inertia("Link inertia", axis.link.inertia, "kg m^2"),
            clock_offset(axis),
            samples(log),
        ],
        warnings: warnings(&axis.link.findings).collect(),
        curves: joint_curves(axis, "").into(),
        tables: forms(axis).map(|f| table(f, &units)).collect(),
        motions: comparisons(log, 0, &axis.link.reconstructed, motions, &units, ""),
        command: None,
        python: None,
    }
}

/// The page of a two-link arm.
pub fn two_link(arm: &TwoLinkArm, log: &Log, motions: &[Motion]) -> JointPage {
    let units = Units::of(false);
    let mut page = JointPage {
        title: "A two-link arm".to_owned(),
        subtitle: subtitle(" of both joints", log),
        verdict: Some(Outcome::new(motions, arm.joints.iter().map(|axis| &axis.model.friction)).verdict()),
        facts: constants(arm).into_iter().map(constant).collect(),
        ..JointPage::default()
    };
    for (i, axis) in arm.joints.iter().enumerate() {
        let name = format!("joint {}", i + 1);
        let motor = format!("Motor inertia, {name}");
        page.facts.push(inertia(&motor, axis.motor_inertia, "kg m^2"));
        page.warnings
            .extend(warnings(&axis.link.findings).map(|f| format!("{name}: {f}")));
        page.curves.extend(joint_curves(axis, &format!(", {name}")));
        page.tables.extend(forms(axis).enumerate().map(|(k, f)| {
            let table = table(f, &units);
            let all = if k < 2 { ", all equations together" } else { "" };
            ParameterTable {
                heading: format!("{} of {name}{all}", table.heading),
                ..table
            }
        }));
        let own = motions.get(i..=i).unwrap_or_default();
        let of = format!(" of {name}");
        page.motions
            .extend(comparisons(log, i, &axis.link.reconstructed, own, &units, &of));
    }
    page
}

/// The forms of a joint: those of the model, then each by itself.
fn forms(axis: &FlexibleAxis) -> impl Iterator<Item = &Fitted> {
    let model = [&axis.model.stiffness, &axis.model.friction].into_iter();
    model.chain(&axis.stiffness.forms).chain(&axis.link.friction.forms)
}

fn constant(constant: Constant) -> Fact {
    let fact = inertia(&capitalised(constant.name), constant.value, "kg m^2");
    Fact {
        note: format!("{}; {}", constant.formula, fact.note),
        ..fact
    }
}

fn clock_offset(axis: &FlexibleAxis) -> Fact {
    let note = match axis
        .link
        .findings
        .iter()
        .any(|f| matches!(f, Finding::EncoderClocks { .. }))
    {
        true => "by which the link's samples are late; corrected".to_owned(),
        false => format!(
            "not distinguished from zero (standard error {:.3} ms)",
            1e3 * axis.clock_offset.standard_error
        ),
    };
    Fact::new("Encoder skew", format!("{:.3} ms", 1e3 * axis.clock_offset.value), note)
}

/// The curves of a flexible joint; `of` is added to their headings.
fn joint_curves(axis: &FlexibleAxis, of: &str) -> [JointCurve; 3] {
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    let (deflection, torque) = ("deflection (rad)", "torque (N m)");
    let secant = |d: f64| if d == 0.0 { f64::NAN } else { stiffness.torque(d) / d };
    let secant = curve(&axis.secant, [deflection, "stiffness (N m/rad)"], secant, stiffness);
    [
        JointCurve::new(
            format!("Stiffness{of}"),
            "The stiffness k(d) = κ(d)/d with its band, where that is narrow enough to tell it: a dip at zero is a soft wind-up. Next \
             to zero no torque tells it.",
            without_wide_band(secant),
            Scatter::default(),
        ),
        JointCurve::new(
            format!("Elastic torque{of}"),
            "The torque that the motor's inertia leaves, over the deflection, with the free curve.",
            curve(
                &axis.stiffness.band,
                [deflection, torque],
                |d| stiffness.torque(d),
                stiffness,
            ),
            Scatter::new(&axis.stiffness.x[..], &axis.stiffness.partial[..]),
        ),
        JointCurve::new(
            format!("Friction{of}"),
            "The elastic torque that the link's inertia leaves, over the link's velocity, with the free curve and its \
             band.",
            curve(
                &axis.link.friction.band,
                ["velocity (rad/s)", torque],
                |v| friction.torque(v),
                friction,
            ),
            Scatter::new(&axis.link.friction.x[..], &axis.link.friction.partial[..]),
        ),
    ]
}

fn subtitle(of: &str, log: &Log) -> String {
    format!(
        "Friction, stiffness and inertia{of} from {} samples of {}.",
        log.samples(),
        log.name
    )
}

fn inertia(name: &str, value: Estimated, unit: &str) -> Fact {
    let note = match value.standard_error {
        0.0 => "as given".to_owned(),
        error if error.is_finite() => format!("standard error {}", number(error)),
        _ => "no standard error: see the notes".to_owned(),
    };
    Fact::new(name, typeset(&format!("{} {unit}", number(value.value))), note)
}

/// Text of the terminal with the signs of a page.
fn typeset(text: &str) -> String {
    text.replace("^2", "²").replace("^3", "³")
}

/// What is to be known before trusting a result; that a torque is held from sample to sample is how it should be.
fn warnings(findings: &[Finding]) -> impl Iterator<Item = String> {
    let worth = |f: &&Finding| !matches!(f, Finding::TorqueDelay { held: true, .. });
    findings.iter().filter(worth).map(ToString::to_string)
}

fn samples(log: &Log) -> Fact {
    let apart = format!("{} s apart", number(log.sample_time));
    Fact::new("Samples", log.samples().to_string(), apart)
}

fn curve(band: &Band, labels: [&str; 2], form: impl Fn(f64) -> f64, fitted: &Fitted) -> Nonlinearity {
    Nonlinearity {
        truth: band.x[0].iter().map(|&x| form(x)).collect(),
        truth_label: fitted.form.title().to_owned(),
        ..banded(band, labels, format!("{} % pointwise", 100.0 * band.level))
    }
}

/// Without the points at which the band of a stiffness is too wide.
fn without_wide_band(mut curve: Nonlinearity) -> Nonlinearity {
    let widest = WIDEST_BAND * median(curve.y.iter().map(|y| y.abs()));
    let wide: Vec<bool> = (0..curve.x.len())
        .map(|i| !(curve.upper[i] - curve.lower[i] < widest))
        .collect();
    // Next to zero nothing in between is known either.
    let farthest = curve.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let near = wide.iter().zip(&curve.x);
    let near = near.filter(|(wide, x)| **wide && x.abs() < NEXT * farthest);
    let reach = near.fold(-1.0_f64, |m, (_, x)| m.max(x.abs()));
    for (i, wide) in wide.into_iter().enumerate() {
        if wide || curve.x[i].abs() <= reach {
            (curve.y[i], curve.lower[i], curve.upper[i]) = (f64::NAN, f64::NAN, f64::NAN);
        }
    }
    curve
}

fn table(form: &Fitted, units: &Units) -> ParameterTable {
    let mut rows: Vec<[String; 2]> = Vec::new();
    if form.inertia.value.is_finite() {
        let value = with_error(form.inertia);
        rows.push(["inertia".to_owned(), typeset(&format!("{value} {}", units.inertia()))]);
    }
    for parameter in &form.parameters {
        let unit = units.of_curve(parameter.unit, form.form.is_stiffness());
        let value = parameter_value(parameter, &unit);
        rows.push([parameter.symbol.clone(), typeset(&value)]);
    }
    ParameterTable {
        heading: titled(form),
        rows,
        note: lack_text(form),
    }
}

/// The torque of axis `i` and its simulated motions beside the measured ones; `of` is what the headings call the axis.
fn comparisons(
    log: &Log,
    i: usize,
    reconstructed: &[f64],
    motions: &[Motion],
    units: &Units,
    of: &str,
) -> Vec<Comparison> {
    let torque = comparison(
        log,
        format!("Torque{of}: measured against reconstructed from the motion"),
        format!("torque ({})", units.torque),
        &log.axes[i].torque,
        reconstructed,
    );
    let (quantity, plural) = match of {
        "" => ("position", ""),
        _ => ("angle", "s"),
    };
    let motions = motions.iter().map(|motion| {
        comparison(
            log,
            format!("Motion{of}: measured against simulated {}{plural}", motion.drive),
            format!("{quantity} ({})", units.position),
            &log.axes[i].position,
            &motion.position,
        )
    });
    [torque].into_iter().chain(motions).collect()
}

fn comparison(log: &Log, heading: String, y_label: String, measured: &[f64], predicted: &[f64]) -> Comparison {
    let n = measured.len().min(predicted.len());
    let fit = Fit::new(measured, predicted);
    Comparison {
        heading,
        prediction: Prediction {
            y_label,
            time: Axis::of_samples(Some(log.sample_time), 0),
            measured: measured[..n].to_vec(),
            predicted: predicted[..n].to_vec(),
            fit_percent: fit.percent,
            rms: fit.rms,
        },
    }
}
