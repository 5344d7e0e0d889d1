//! The torque that a motion needs, by what was identified from another one.

use super::*;
use crate::linear::correlation::mean;

/// The root mean square of the difference, as a share of the torque's.
fn off(needed: &NeededTorque, torque: &[f64]) -> f64 {
    let (needed, torque) = (needed.in_band(&needed.torque), needed.in_band(torque));
    let both = needed.iter().zip(&torque);
    let squares: f64 = both.map(|(a, b)| (a - b).powi(2)).sum();
    (squares / torque.iter().map(|t| t * t).sum::<f64>()).sqrt()
}

/// The motion of sines with this amplitude, and the torque of a rigid axis that it needs.
fn rigid(amplitude: f64, inertia: f64, seed: u64) -> [Vec<f64>; 2] {
    let at = |i: usize, derivative: i32| -> f64 {
        let t = i as f64 * STEP;
        let line = |(f, phase): (f64, f64)| {
            let w = std::f64::consts::TAU * f;
            let turn = std::f64::consts::FRAC_PI_2 * f64::from(derivative);
            amplitude * w.powi(derivative) * (w * t + phase + turn).sin()
        };
        [(0.31, 0.2), (0.83, 1.9), (2.1, 4.0)].into_iter().map(line).sum()
    };
    let torque = |i: usize| {
        let v = at(i, 1);
        inertia * at(i, 2) + 0.8 * (40.0 * v).tanh() + 0.5 * v + 0.1
    };
    let samples = 20_000;
    let position: Vec<f64> = (0..samples).map(|i| at(i, 0)).collect();
    let torque: Vec<f64> = (0..samples).map(torque).collect();
    [noisy(&position, 1e-5, seed), noisy(&torque, 0.02, seed + 1)]
}

fn motion<'a>(position: &'a [f64], motor: Option<&'a [f64]>) -> JointMotion<'a> {
    JointMotion {
        position,
        motor,
        velocity: None,
        load: None,
        sample_time: STEP,
    }
}

#[test]
fn the_torque_of_a_rigid_axis_on_another_motion() {
    let log = rigid(0.2, 0.4, 1);
    let axis = rigid_axis(&log, STEP);
    let [position, torque] = log;
    let own = axis.needed_torque(&motion(&position, None)).unwrap();
    assert!(off(&own, &torque) < 0.005, "{}", off(&own, &torque));
    assert!(own.unseen < 1e-3);

    let [larger, its_torque] = rigid(0.3, 0.4, 3);
    let needed = axis.needed_torque(&motion(&larger, None)).unwrap();
    assert!(off(&needed, &its_torque) < 0.01, "{}", off(&needed, &its_torque));
    let fastest = axis.friction.x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let beyond: Vec<f64> = (needed.velocity.iter())
        .map(|v| f64::from(u8::from(v.abs() > fastest)))
        .collect();
    assert!(needed.unseen > 0.05 && (needed.unseen - mean(&beyond)).abs() < 0.02);

    // An axis that became heavier by a fifth is seen.
    let [position, torque] = rigid(0.2, 0.48, 5);
    let needed = axis.needed_torque(&motion(&position, None)).unwrap();
    assert!(off(&needed, &torque) > 0.05);
}

/// The friction of this joint changes so fast where the velocity changes sign that its smoothed velocity misses a few percent of the torque.
#[test]
fn the_torque_of_a_flexible_joint_on_another_motion() {
    let (log, _) = elbow(40.0);
    let axis = found(flexible(&log));
    let missed = |[motor, link, torque]: &[Vec<f64>; 3]| {
        let needed = axis.needed_torque(&motion(link, Some(motor))).unwrap();
        off(&needed, torque)
    };
    let own = missed(&log);
    assert!(own < 0.1, "{own}");
    let linear = space_arm(JointKind::Nonlinear).joints[1].linear;
    // The spring cancels: a stiffer one needs the same torque for its own motion.
    for (stiffness, run) in [(linear, 1), (2.0 * linear, 2)] {
        let again = missed(&elbow_of(20.0, stiffness, 1e-5, run).0);
        assert!(again < 1.2 * own, "{again}, but {own} on the own log");
    }
    let ([motor, link, mut torque], _) = elbow_of(20.0, linear, 1e-5, 3);
    torque.iter_mut().for_each(|t| *t *= 1.25);
    let other = missed(&[motor, link, torque]);
    assert!((other - 0.2).abs() < 0.05, "{other}");
}

#[test]
fn a_motion_that_cannot_be_used_is_refused() {
    let log = rigid(0.2, 0.4, 1);
    let axis = rigid_axis(&log, STEP);
    let [position, _] = log;
    let of = |position: &[f64]| axis.needed_torque(&motion(position, None)).unwrap_err().to_string();
    assert!(of(&position[..100]).contains("200"));
    assert!(of(&[1.0; 300]).contains("position"));
    let mut holed = position.clone();
    holed[7] = f64::NAN;
    assert!(of(&holed).contains("position"));
}
