//! A joint whose encoders' clocks make nearly all of the difference between motor and link.

use super::*;

const SAMPLE: f64 = 0.004;
const LATE: f64 = 2.9e-3;
const COMPLIANCE: f64 = 2e-5;

/// An industrial robot's axis: one slow motion, encoders that are fine, a gear with errors of a hundredth of a degree. Motor, link and torque.
fn industrial(seed: u64) -> [Vec<f64>; 3] {
    let lines = [
        (0.35, 0.11, 0.3),
        (0.06, 0.37, 1.1),
        (0.012, 0.83, 2.0),
        (0.003, 1.9, 0.4),
    ];
    let angle = |t: f64, derivative: usize| -> f64 {
        let term = |(amplitude, frequency, phase): (f64, f64, f64)| {
            let w = std::f64::consts::TAU * frequency;
            let quarter = derivative as f64 * std::f64::consts::FRAC_PI_2;
            amplitude * w.powi(derivative as i32) * (w * t + phase + quarter).sin()
        };
        lines.into_iter().map(term).sum()
    };
    let torque = |t: f64| 8.0 * angle(t, 2) + 1.6 * (200.0 * angle(t, 1)).tanh() + 7.0 * angle(t, 1) + 0.2;
    // A full turn of the motor is a hundredth of the link's, and its error comes back with it.
    let link = |t: f64| {
        angle(t, 0) - COMPLIANCE * torque(t) + 3e-5 * (3.0 * angle(t, 0)).sin() + 4e-6 * (100.0 * angle(t, 0)).sin()
    };
    let sampled = |f: &dyn Fn(f64) -> f64| (0..2500).map(|i| f(f64::from(i) * SAMPLE)).collect::<Vec<_>>();
    [
        noisy(&sampled(&|t| angle(t, 0)), 1.5e-6, seed),
        noisy(&sampled(&|t| link(t - LATE)), 4e-6, seed + 100),
        noisy(&sampled(&torque), 0.2, seed + 200),
    ]
}

#[test]
fn an_offset_of_the_clocks_and_a_small_compliance_are_both_reported() {
    let runs = 8;
    let mut squares = [0.0; 2];
    for seed in 0..runs {
        let log = industrial(seed);
        let joint = FlexibleJoint {
            sample_time: SAMPLE,
            ..flexible(&log)
        };
        let IdentifiedJoint::Rigid(axis) = joint.identify().unwrap() else {
            panic!("a flexible joint was seen");
        };
        let stiff = axis.stiff.unwrap();
        for (square, (estimated, truth)) in squares
            .iter_mut()
            .zip([(stiff.clock_offset, LATE), (stiff.compliance, COMPLIANCE)])
        {
            *square += ((estimated.value - truth) / estimated.standard_error).powi(2);
        }
        assert!((stiff.clock_offset.value - LATE).abs() < 2e-4, "{stiff:?}");
        assert!(
            (axis.inertia.value - 8.0).abs() < 3.0 * axis.inertia.standard_error,
            "{:?}",
            axis.inertia
        );
        let said = axis.findings[0].to_string();
        assert!(
            said.starts_with("motor and link move almost as one") && said.contains("the joint deflects by"),
            "{said}"
        );
    }
    let of_errors = squares.map(|square| (square / runs as f64).sqrt());
    println!("deviations in standard errors, root mean square: {of_errors:?}");
    assert!(of_errors.iter().all(|rms| *rms < 1.6), "{of_errors:?}");
}
