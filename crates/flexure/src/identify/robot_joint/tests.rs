//! Known joints: what is identified is the truth, and what cannot be is said.

use rand::{RngExt as _, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::Error;
use crate::manipulator::{Arm, Drive, JointKind, SimulationOptions, simulate, space_arm};

mod bad_logs;
mod chains;
mod prediction;
mod presliding;
mod reversals;
mod stiff;
mod stretches;

const STEP: f64 = 1e-3;

/// Sums of sines of the torque at incommensurable frequencies up to 4 Hz.
fn torque(samples: usize, amplitude: f64) -> Vec<f64> {
    let lines = [
        (0.11, 0.0),
        (0.29, 1.0),
        (0.53, 2.1),
        (0.97, 0.4),
        (1.61, 5.1),
        (2.43, 3.3),
        (3.89, 4.2),
    ];
    let at = |t: f64| -> f64 {
        lines
            .iter()
            .map(|(f, p)| (std::f64::consts::TAU * f * t + p).sin())
            .sum()
    };
    (0..samples).map(|i| amplitude * at(i as f64 * STEP)).collect()
}

fn noisy(x: &[f64], sd: f64, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    x.iter()
        .map(|v| {
            let e: f64 = StandardNormal.sample(&mut rng);
            v + sd * e
        })
        .collect()
}

/// Motor angle, link angle and torque of the space arm's elbow with its shoulder locked, with noise; the link's inertia.
fn elbow(seconds: f64) -> ([Vec<f64>; 3], f64) {
    elbow_of(seconds, space_arm(JointKind::Nonlinear).joints[1].linear, 1e-5, 0)
}

/// The same with this linear stiffness and this noise of the encoders, another one in each `run`.
fn elbow_of(seconds: f64, linear: f64, encoder: f64, run: u64) -> ([Vec<f64>; 3], f64) {
    let mut parameters = space_arm(JointKind::Nonlinear);
    parameters.joints[0].locked = true;
    parameters.joints[1].linear = linear;
    let arm = Arm::new(parameters).unwrap();
    let options = SimulationOptions::new(seconds, STEP).unwrap();
    let rows = options.sampling.rows();
    let tau = torque(rows, 2.5);
    let record = simulate(&arm, &Drive::Held([&vec![0.0; rows], &tau]), &options).unwrap();
    let column = |name: &str, seed| noisy(record.column(name).unwrap(), encoder, seed + 10 * run);
    let log = [column("qm2", 1), column("q2", 2), noisy(&tau, 0.05, 3 + 10 * run)];
    (log, arm.link_dynamics().inertia(0.0)[1][1])
}

fn flexible<'a>([motor, link, torque]: &'a [Vec<f64>; 3]) -> FlexibleJoint<'a> {
    FlexibleJoint {
        motor,
        link,
        torque,
        load: None,
        sample_time: STEP,
        motor_inertia: None,
        level: 0.95,
    }
}

fn found(joint: FlexibleJoint) -> FlexibleAxis {
    match joint.identify().unwrap() {
        IdentifiedJoint::Flexible(axis) => *axis,
        IdentifiedJoint::Rigid(axis) => panic!("{:?}", axis.findings),
    }
}

/// The rigid axis of a position and a torque.
fn rigid_axis([position, torque]: &[Vec<f64>; 2], sample_time: f64) -> RigidAxis {
    let joint = RigidJoint {
        position,
        torque,
        velocity: None,
        load: None,
        sample_time,
        extras: &[],
        level: 0.95,
    };
    joint.identify().unwrap()
}

/// Relative L2 distance of a band's estimate from a function, and the share of its points that the band covers.
pub(super) fn distance(band: &crate::bands::Band, truth: impl Fn(f64) -> f64) -> (f64, f64) {
    let (mut off, mut size, mut covered) = (0.0, 0.0, 0);
    for (i, &x) in band.x[0].iter().enumerate() {
        let y = truth(x);
        off += (band.estimate[i] - y).powi(2);
        size += y * y;
        covered += usize::from((band.lower[i]..=band.upper[i]).contains(&y));
    }
    ((off / size).sqrt(), covered as f64 / band.x[0].len() as f64)
}

#[test]
fn the_space_arms_elbow_is_found_with_its_wind_up() {
    let (log, inertia) = elbow(40.0);
    let axis = found(flexible(&log));
    let near = |name: &str, value: f64, truth: f64, share: f64| {
        assert!(
            (value - truth).abs() < share * truth,
            "{name} = {value}, but it is {truth}"
        );
    };
    near("Jm", axis.motor_inertia.value, 1.0, 0.002);
    near("M", axis.link.inertia.value, inertia, 0.002);
    let arm = space_arm(JointKind::Nonlinear).joints[1];
    let kappa = arm.nonlinear_stiffness();
    let friction = arm.friction.unwrap();
    for (name, (off, covered)) in [
        ("kappa", distance(&axis.stiffness.band, |d| kappa.torque(d))),
        ("friction", distance(&axis.link.friction.band, |v| friction.torque(v))),
    ] {
        assert!(off < 0.01, "{name} is {off} from the truth");
        assert!(covered > 0.8, "the band of {name} covers {covered}");
    }
    let model = &axis.model;
    assert_eq!(model.stiffness.form, FormName::Windup);
    near("ksw", model.stiffness.parameter("ksw").unwrap().value, 10.0, 0.1);
    near("asw", model.stiffness.parameter("asw").unwrap().value, 3000.0, 0.15);
    // The forms without wind-up are refuted.
    let cubic = axis
        .stiffness
        .forms
        .iter()
        .find(|f| f.form == FormName::CubicStiffness)
        .unwrap();
    assert!(cubic.lack_of_fit.p_value < REFUTED, "{:?}", cubic.lack_of_fit);
    // The torque is held: half a sample late, which is said.
    assert!(
        matches!(axis.link.findings[..], [Finding::TorqueDelay { held: true, .. }]),
        "{:?}",
        axis.link.findings
    );
}

#[test]
fn a_skew_between_the_encoders_is_found_and_taken_back() {
    let (log, _) = elbow(30.0);
    let axis = found(flexible(&skewed(&log, 4)));
    // The link's equation has no torque and so no noise of it: it determines far more than the motor's, whose 0.1 ms would bend the friction.
    assert!(
        (axis.clock_offset.value - 0.004).abs() < 2e-5,
        "{:?}",
        axis.clock_offset
    );
    assert!(axis.clock_offset.standard_error < 2e-5, "{:?}", axis.clock_offset);
    let lack = axis.model.friction.lack_of_fit;
    assert!(lack.distance < 0.03 && lack.p_value > REFUTED, "{lack:?}");
    let a2 = axis.model.stiffness.parameter("a2").unwrap().value;
    assert!((a2 - 500.0).abs() < 2.0, "{a2}");
    let said = axis.link.findings.iter().map(ToString::to_string).collect::<String>();
    assert!(
        said.contains("the link's samples are") && said.contains("later than the motor's"),
        "{said}"
    );
}

/// A rigid axis of inertia 20 with friction, by Euler's method with short steps; position and torque with noise.
fn axis(samples: usize, bias: f64) -> (Vec<f64>, Vec<f64>) {
    let tau: Vec<f64> = torque(samples, 3.0).iter().map(|t| t + bias).collect();
    driven(&tau)
}

/// The same axis under this torque, which acts as it is.
fn driven(tau: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (0.0, 0.0);
    let mut position = Vec::new();
    for t in tau {
        position.push(q);
        for _ in 0..10 {
            v += (t - 2.0 * (200.0_f64 * v).tanh() - 4.0 * v) / 20.0 * STEP / 10.0;
            q += v * STEP / 10.0;
        }
    }
    (noisy(&position, 1e-5, 5), noisy(tau, 0.05, 6))
}

fn rigid<'a>(position: &'a [f64], torque: &'a [f64]) -> RigidJoint<'a> {
    RigidJoint {
        position,
        torque,
        velocity: None,
        load: None,
        sample_time: STEP,
        extras: &[],
        level: 0.95,
    }
}

#[test]
fn a_rigid_axis_has_its_inertia_and_friction() {
    let (position, torque) = axis(40_000, 0.0);
    let found = rigid(&position, &torque).identify().unwrap();
    assert!((found.inertia.value - 20.0).abs() < 0.05, "{:?}", found.inertia);
    let (off, covered) = distance(&found.friction.band, |v| 2.0 * (200.0 * v).tanh() + 4.0 * v);
    assert!(off < 0.02 && covered > 0.8, "{off} {covered}");
    let form = found
        .friction
        .forms
        .iter()
        .find(|f| f.form == FormName::SmoothCoulomb)
        .unwrap();
    for (symbol, truth, tolerance) in [
        ("g4", 2.0, 0.02),
        ("g6", 4.0, 0.1),
        ("g5", 200.0, 10.0),
        ("F0", 0.0, 0.02),
    ] {
        let p = form.parameter(symbol).unwrap();
        assert!((p.value - truth).abs() < tolerance, "{p:?}");
    }
    // The simulation holds the torque.
    assert!(
        matches!(found.findings[..], [Finding::TorqueDelay { held: true, .. }]),
        "{:?}",
        found.findings
    );
    // Twice the torque is twice all of it.
    let double: Vec<f64> = torque.iter().map(|t| 2.0 * t).collect();
    let twice = rigid(&position, &double).identify().unwrap();
    assert!((twice.inertia.value - 2.0 * found.inertia.value).abs() < 1e-3 * found.inertia.value);
    // The same motion comes back.
    let start = [position[0], found.friction.x[0]];
    let smooth = found
        .friction
        .forms
        .iter()
        .find(|f| f.form == FormName::SmoothCoulomb)
        .unwrap();
    let replayed = found.replay(smooth, AxisDrive::Torque(&torque), start);
    let error: f64 = replayed.iter().zip(&position).map(|(a, b)| (a - b).powi(2)).sum();
    assert!((error / position.len() as f64).sqrt() < 0.05, "{error}");
}

#[test]
fn a_rigid_joint_is_no_flexible_one_even_with_skewed_encoders() {
    let (position, torque) = axis(30_000, 0.0);
    let n = position.len();
    let clean = noisy(&position, 1e-5, 9);
    for late in [0, 4] {
        let log = [
            position[late..].to_vec(),
            clean[..n - late].to_vec(),
            torque[late..].to_vec(),
        ];
        let IdentifiedJoint::Rigid(axis) = flexible(&log).identify().unwrap() else {
            panic!("a flexible joint was seen");
        };
        assert!((axis.inertia.value - 20.0).abs() < 0.1, "{:?}", axis.inertia);
        let said: Vec<String> = axis.findings.iter().map(ToString::to_string).collect();
        assert!(said[0].starts_with("no flexibility is seen"), "{said:?}");
        assert_eq!(said.iter().any(|s| s.contains("4.0")), late > 0, "{said:?}");
    }
}

/// The link's angle `late` samples late.
fn skewed([motor, link, torque]: &[Vec<f64>; 3], late: usize) -> [Vec<f64>; 3] {
    let n = link.len();
    [
        motor[late..].to_vec(),
        link[..n - late].to_vec(),
        torque[late..].to_vec(),
    ]
}

#[test]
fn a_joint_as_stiff_as_its_encoders_are_coarse_is_no_flexible_one() {
    for (linear, encoder, run, late) in [
        (1e6, 1e-5, 0, 4),
        (1e6, 1e-5, 1, 0),
        (1e6, 1e-5, 2, 4),
        (500.0, 0.02, 3, 0),
    ] {
        let (log, _) = elbow_of(30.0, linear, encoder, run);
        let IdentifiedJoint::Rigid(axis) = flexible(&skewed(&log, late)).identify().unwrap() else {
            panic!("a flexible joint was seen at {linear} N m/rad");
        };
        let Finding::NoFlexibility { stiffness, .. } = axis.findings[0] else {
            panic!("{:?}", axis.findings);
        };
        assert!(
            stiffness.is_nan() || (0.5..2.0).contains(&(stiffness / linear)),
            "{stiffness}, but it is {linear}"
        );
        let skew = axis.findings.iter().find_map(|f| match f {
            Finding::EncoderClocks { offset, .. } => Some(*offset),
            _ => None,
        });
        assert_eq!(skew.is_some(), late > 0, "{:?}", axis.findings);
        assert!(skew.is_none_or(|s| (s - late as f64 * STEP).abs() < 1e-4), "{skew:?}");
    }
}

#[test]
fn a_stiff_joint_is_found_near_the_encoders_noise_and_with_their_skew() {
    let (log, inertia) = elbow_of(30.0, 2e4, 1e-5, 0);
    for late in [0, 4] {
        let axis = found(flexible(&skewed(&log, late)));
        let stiffness = &axis.model.stiffness;
        let a2 = stiffness.parameter("a2").unwrap();
        assert!((a2.value - 2e4).abs() < 0.02 * 2e4, "{a2:?}");
        let motor = axis.motor_inertia;
        let off = (motor.value - 1.0).abs();
        // The same noise is in the deflection and in the motor's acceleration: a bias, which its error allows for.
        assert!(off < 0.06 && off < 3.0 * motor.standard_error, "{motor:?}");
        assert!(
            (axis.link.inertia.value - inertia).abs() < 0.02 * inertia,
            "{:?}",
            axis.link.inertia
        );
        let skew = axis.clock_offset.value;
        assert!((skew - late as f64 * STEP).abs() < 2e-4, "{skew}");
    }
}

/// If g1, g2, g3 and g5 compensate each other, no wrong value may have a small error. True forms agree.
#[test]
fn what_is_said_of_the_forms_is_true() {
    let joint = space_arm(JointKind::Nonlinear).joints[1];
    let [g1, g2, g3, g4, g5, g6] = joint.friction.unwrap().0;
    let truths = [
        ("g1", g1),
        ("g2", g2),
        ("g3", g3),
        ("g4", g4),
        ("g5", g5),
        ("g6", g6),
        ("a2", 500.0),
        ("ksw", 10.0),
    ];
    for run in 0..4 {
        let (log, _) = elbow_of(30.0, joint.linear, 1e-5, run);
        let axis = found(flexible(&log));
        for form in [&axis.model.stiffness, &axis.model.friction] {
            println!("run {run}: {:?} {:?}", form.form, form.lack_of_fit);
            assert!(form.lack_of_fit.p_value > REFUTED, "run {run}: {:?}", form.lack_of_fit);
            for (symbol, truth) in truths {
                let found = form.parameter(symbol).filter(|p| p.identifiable);
                println!("  {symbol} {found:?}");
                assert!(
                    found.is_none_or(|p| (p.value - truth).abs() < 4.0 * p.standard_error),
                    "run {run}: {found:?}, but it is {truth}"
                );
            }
        }
        let true_forms = |forms: &[Fitted], form| forms.iter().find(|f| f.form == form).unwrap().lack_of_fit;
        for lack in [
            true_forms(&axis.stiffness.forms, FormName::Windup),
            true_forms(&axis.link.friction.forms, FormName::SmoothStribeck),
        ] {
            assert!(lack.p_value > REFUTED, "run {run}: {lack:?}");
        }
    }
}
