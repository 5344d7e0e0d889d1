//! A joint as the page that shows it.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, Finding, Fitted, FlexibleAxis, RigidAxis, TwoLinkArm};
use flexure_report::data::{Axis, Comparison, Fact, JointCurve, JointPage, Nonlinearity, Prediction, Scatter};

use super::chain::OfChain;
use super::curves::{gaps_caption, with_gaps};
use super::diagram;
use super::flexible::forms;
use super::forms::{ALONE, alone, others, polished_table, table, tables};
use super::outcome::Outcome;
use super::simulation::Fit;
use super::text::{Constant, Units, constants, titled, typeset, with_error};
use super::{Log, Motion, Trial};
use crate::plots::{banded, median};
use crate::text::{capitalised, decimal, number};

/// A stiffness is not shown if its band is wider than this share of its median.
const WIDEST_BAND: f64 = 0.03;
/// Standard errors from which an offset of clocks differs from zero.
const DISTINGUISHED: f64 = 3.0;
/// Deflections below this share of the largest one are next to zero.
const NEXT: f64 = 0.2;

/// The page of a rigid axis.
pub fn rigid(axis: &RigidAxis, units: &Units, log: &Log, trial: &Trial) -> JointPage {
    let best = axis.friction.best();
    let labels = [
        format!("velocity ({}/s)", units.position),
        format!("{} ({})", units.effort, units.torque),
    ];
    let distance = format!("{:.1} %", 100.0 * best.lack_of_fit.distance);
    let from = format!("root mean square, from the free curve; the form: {}", best.form.title());
    JointPage {
        title: "A rigid axis".to_owned(),
        subtitle: subtitle("Friction and inertia", log),
        verdict: Some(Outcome::new(trial, [vec![best]], &axis.findings).verdict()),
        diagram: diagram::rigid(axis, units),
        facts: vec![
            inertia(
                &format!("{}, with the free friction curve", capitalised(units.moved())),
                axis.inertia,
                units.inertia(),
            ),
            Fact::new("Distance of the best form", distance, from),
            samples(log),
        ]
        .into_iter()
        .chain(of_chain(log, axis, units))
        .collect(),
        warnings: warnings(&axis.findings).chain(advice(trial)).collect(),
        curves: vec![JointCurve::new(
            "Friction",
            format!(
                "The {} minus the parts of the {} and of the position, against the velocity; the free curve with its band.{}",
                units.effort,
                units.moved(),
                gaps_caption(&axis.friction.band)
            ),
            curve(&axis.friction.band, [&labels[0], &labels[1]], |v| best.torque(v), best),
            Scatter::new(&axis.friction.x[..], &axis.friction.partial[..]),
        )],
        tables: (std::iter::once(table(best, units)))
            .chain(
                axis.polished
                    .as_ref()
                    .and_then(|polished| polished_table(polished, units)),
            )
            .collect(),
        others: others(
            "Other forms that were tried",
            axis.friction
                .by_bic()
                .into_iter()
                .skip(1)
                .map(|form| (titled(form), form)),
            units,
        ),
        motions: comparisons(log, 0, &axis.reconstructed, trial, units, ""),
        ..JointPage::default()
    }
}

/// The page of a flexible joint.
pub fn flexible(axis: &FlexibleAxis, log: &Log, trial: &Trial) -> JointPage {
    let units = Units::of(false);
    JointPage {
        title: "A flexible joint".to_owned(),
        subtitle: subtitle("Friction, stiffness and inertia", log),
        verdict: Some(Outcome::new(trial, [forms(axis)], &axis.link.findings).verdict()),
        diagram: diagram::flexible(axis, &units),
        facts: vec![
            inertia("Motor inertia", axis.motor_inertia, "kg m^2"),
            inertia("Link inertia", axis.link.inertia, "kg m^2"),
            clock_offset(axis),
        ]
        .into_iter()
        .chain(axis.damping.map(|c| inertia("Damping of the joint", c, "N m s/rad")))
        .chain(of_chain(log, &axis.link, &units))
        .chain([samples(log)])
        .collect(),
        warnings: warnings(&axis.link.findings).chain(advice(trial)).collect(),
        curves: joint_curves(axis, ""),
        tables: tables(axis, &units, "").collect(),
        others: others(ALONE, alone(axis, ""), &units),
        motions: comparisons(log, 0, &axis.link.reconstructed, trial, &units, ""),
        ..JointPage::default()
    }
}

/// The page of a two-link arm.
pub fn two_link(arm: &TwoLinkArm, log: &Log, trial: &Trial) -> JointPage {
    let units = Units::of(false);
    let findings = arm.joints.iter().flat_map(|axis| &axis.link.findings);
    let mut page = JointPage {
        title: "A two-link arm".to_owned(),
        subtitle: subtitle("Friction, stiffness and inertia of both joints", log),
        verdict: Some(Outcome::new(trial, arm.joints.iter().map(forms), findings).verdict()),
        facts: constants(arm).into_iter().map(constant).collect(),
        warnings: advice(trial).into_iter().collect(),
        ..JointPage::default()
    };
    for (i, axis) in arm.joints.iter().enumerate() {
        let name = format!("joint {}", i + 1);
        let motor = format!("Motor inertia, {name}");
        page.facts.push(inertia(&motor, axis.motor_inertia, "kg m^2"));
        page.warnings
            .extend(warnings(&axis.link.findings).map(|f| format!("{name}: {f}")));
        page.curves.extend(joint_curves(axis, &format!(", {name}")));
        page.tables
            .extend(tables(axis, &units, &format!("{}: ", capitalised(&name))));
        let of = format!(" of {name}");
        page.motions
            .extend(comparisons(log, i, &axis.link.reconstructed, trial, &units, &of));
    }
    let of_joint = |(i, axis)| alone(axis, &format!("joint {}: ", i + 1)).collect::<Vec<_>>();
    page.others = others(ALONE, arm.joints.iter().enumerate().flat_map(of_joint), &units);
    page
}

fn constant(constant: Constant) -> Fact {
    let fact = inertia(&capitalised(constant.name), constant.value, "kg m^2");
    Fact {
        note: format!("{}; {}", constant.formula, fact.note),
        ..fact
    }
}

fn clock_offset(axis: &FlexibleAxis) -> Fact {
    let Estimated { value, standard_error } = axis.clock_offset;
    let has = |finding: fn(&Finding) -> bool| axis.link.findings.iter().any(finding);
    let note = if has(|f| matches!(f, Finding::EncoderClocks { .. })) {
        "by which the link's samples are late; corrected".to_owned()
    } else if !(value.abs() > DISTINGUISHED * standard_error) {
        let error = 1e3 * standard_error;
        format!("not distinguished from zero (standard error {error:.3} ms)")
    } else if has(|f| matches!(f, Finding::FewReversals { .. } | Finding::NeverReverses { .. })) {
        "not corrected: the motion reverses too seldom to determine it".to_owned()
    } else {
        "a negligible part of a sample; not corrected".to_owned()
    };
    Fact::new("Encoder skew", format!("{:.3} ms", 1e3 * value), note)
}

/// The curves of a flexible joint; `of` is added to their headings. A stiffness that is not known anywhere is left out.
fn joint_curves(axis: &FlexibleAxis, of: &str) -> Vec<JointCurve> {
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    let (deflection, torque) = ("deflection (rad)", "torque (N m)");
    let secant = |d: f64| if d == 0.0 { f64::NAN } else { stiffness.torque(d) / d };
    let secant = curve(&axis.secant, [deflection, "stiffness (N m/rad)"], secant, stiffness);
    let secant = without_wide_band(secant);
    let known = secant.y.iter().any(|k| k.is_finite());
    let mut elastic =
        "The torque minus the part of the motor's inertia, against the deflection; the free curve.".to_owned();
    elastic.push_str(gaps_caption(&axis.stiffness.band));
    if !known {
        elastic.push_str(" The stiffness, torque over deflection, is not drawn: its band is wide everywhere.");
    }
    let windup = match stiffness.form.has_windup() {
        true => " The dip at zero is a soft wind-up.",
        false => "",
    };
    let stiffness_curve = known.then(|| {
        JointCurve::new(
            format!("Stiffness{of}"),
            format!(
                "The stiffness k(d) = κ(d)/d with its band.{windup} Where the torque is too small to tell, nothing is drawn."
            ),
            secant,
            Scatter::default(),
        )
    });
    let others = [
        JointCurve::new(
            format!("Elastic torque{of}"),
            elastic,
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
            format!(
                "Friction over velocity: the elastic torque minus the torque that accelerates the link.{}",
                gaps_caption(&axis.link.friction.band)
            ),
            curve(
                &axis.link.friction.band,
                ["velocity (rad/s)", torque],
                |v| friction.torque(v),
                friction,
            ),
            Scatter::new(&axis.link.friction.x[..], &axis.link.friction.partial[..]),
        ),
    ];
    let at_motor = axis.motor_friction.as_ref().zip(axis.model.motor_friction.as_ref());
    let at_motor = at_motor.map(|(found, form)| {
        JointCurve::new(
            format!("Friction at the motor{of}"),
            format!(
                "The motor's torque that its inertia and the spring leave, over the motor's velocity, with the free curve and its band.{}",
                gaps_caption(&found.band)
            ),
            curve(&found.band, ["velocity (rad/s)", torque], |v| form.torque(v), form),
            Scatter::new(&found.x[..], &found.partial[..]),
        )
    });
    stiffness_curve.into_iter().chain(others).chain(at_motor).collect()
}

fn subtitle(what: &str, log: &Log) -> String {
    format!("{what} from {} samples of {}.", log.samples(), log.name)
}

fn inertia(name: &str, value: Estimated, unit: &str) -> Fact {
    if !value.is_positive() {
        let note = match value.positive_range() {
            Some([_, high]) => typeset(&format!("these data support 0 to {} {unit}", number(high))),
            None => "the best fit is negative".to_owned(),
        };
        return Fact::new(name, "not identifiable".to_owned(), note);
    }
    let (number, note) = match value.standard_error {
        0.0 => (number(value.value), "as given"),
        error if error.is_finite() => (with_error(value), "± one standard error"),
        _ => (number(value.value), "no standard error: see the notes"),
    };
    // The words of a unit stay on one line.
    let unit = unit.replace(' ', "\u{a0}");
    Fact::new(name, typeset(&format!("{number} {unit}")), note.to_owned())
}

/// What the chain has to do with the axis, if it is a joint of one.
fn of_chain(log: &Log, axis: &RigidAxis, units: &Units) -> Vec<Fact> {
    OfChain::new(&log.axes[0], axis.chain).map_or_else(Vec::new, |chain| chain.facts(units))
}

/// The warnings about a result. A torque that is held from sample to sample is normal and needs none.
fn warnings(findings: &[Finding]) -> impl Iterator<Item = String> {
    let worth = |f: &&Finding| !matches!(f, Finding::TorqueDelay { held: true, .. });
    findings.iter().filter(worth).map(ToString::to_string)
}

/// What to do where the joint does not hold on another log.
fn advice(trial: &Trial) -> Option<String> {
    trial.later.as_ref()?.advice()
}

fn samples(log: &Log) -> Fact {
    let apart = format!("{} s apart", decimal(log.sample_time));
    Fact::new("Samples", log.samples().to_string(), apart)
}

fn curve(band: &Band, labels: [&str; 2], form: impl Fn(f64) -> f64, fitted: &Fitted) -> Nonlinearity {
    let drawn = banded(band, labels, format!("{} % pointwise", 100.0 * band.level));
    Nonlinearity {
        truth: band.x[0].iter().map(|&x| form(x)).collect(),
        truth_label: fitted.form.title().to_owned(),
        ..with_gaps(drawn, band)
    }
}

/// Without the points at which the band of a stiffness is too wide.
fn without_wide_band(mut curve: Nonlinearity) -> Nonlinearity {
    let widest = WIDEST_BAND * median(curve.y.iter().map(|y| y.abs()));
    let wide: Vec<bool> = (0..curve.x.len())
        .map(|i| !(curve.upper[i] - curve.lower[i] < widest))
        .collect();
    // Between deflections next to zero, nothing is known either.
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

/// The torque of axis `i`, and its simulated motions with the measured ones; then the same on another log. `of` is the axis's name in the
/// headings.
fn comparisons(log: &Log, i: usize, reconstructed: &[f64], trial: &Trial, units: &Units, of: &str) -> Vec<Comparison> {
    let later = trial.later.as_ref();
    let on_later = later.map(|later| {
        let torque = later.torque.as_ref();
        let torque = torque.map(|torque| (&torque.needed[..], torque.in_band(units)));
        let on = format!(", on {}", later.log.name);
        with_motions(&later.log, i, torque, &later.motions, units, [of, &on])
    });
    let in_band = later.and_then(|later| later.torque.as_ref());
    let in_band = in_band.map_or_else(String::new, |torque| torque.own_in_band(units));
    let torque = Some((reconstructed, in_band));
    let own = with_motions(log, i, torque, &trial.motions, units, [of, ""]);
    own.into_iter().chain(on_later.into_iter().flatten()).collect()
}

/// The torque of axis `i` of a log, with a remark, where it is known, and its simulated motions; `of` and `on` are the axis and the log in
/// the headings.
fn with_motions(
    log: &Log,
    i: usize,
    torque: Option<(&[f64], String)>,
    motions: &[Motion],
    units: &Units,
    [of, on]: [&str; 2],
) -> Vec<Comparison> {
    let torque = torque.map(|(torque, remark)| Comparison {
        remark,
        ..comparison(
            log,
            format!(
                "{}{of}: measured against reconstructed from the motion{on}",
                capitalised(units.effort)
            ),
            format!("{} ({})", units.effort, units.torque),
            &log.axes[i].torque,
            ("reconstructed", torque),
        )
    });
    let (quantity, plural) = match of {
        "" => ("position", ""),
        _ => ("angle", "s"),
    };
    // An arm has one motion an axis, an axis one a drive.
    let motions = match log.axes.len() {
        1 => motions,
        _ => motions.get(i..=i).unwrap_or_default(),
    };
    let motions = motions.iter().map(|motion| {
        comparison(
            log,
            format!("Motion{of}: measured against simulated {}{plural}{on}", motion.drive),
            format!("{quantity} ({})", units.position),
            &log.axes[i].position,
            ("simulated", &motion.position),
        )
    });
    torque.into_iter().chain(motions).collect()
}

fn comparison(
    log: &Log,
    heading: String,
    y_label: String,
    measured: &[f64],
    (name, predicted): (&'static str, &[f64]),
) -> Comparison {
    let n = measured.len().min(predicted.len());
    let fit = Fit::new(measured, predicted);
    Comparison {
        names: ["measured", name],
        heading,
        prediction: Prediction {
            y_label,
            time: Axis::of_samples(Some(log.sample_time), 0),
            measured: measured[..n].to_vec(),
            predicted: predicted[..n].to_vec(),
            fit_percent: fit.percent,
            rms: fit.rms,
        },
        remark: String::new(),
    }
}
