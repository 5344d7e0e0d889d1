use super::*;
use crate::control::controllers::{Feedforward, Gains};
use crate::control::{Differences, Figures, JointMoves, LoopOptions, Run, Trajectory, run_loop};
use crate::manipulator::{Arm, JointKind, space_arm};

fn arm() -> Arm {
    Arm::new(space_arm(JointKind::Nonlinear)).unwrap()
}

fn noise() -> NoiseModel {
    NoiseModel {
        encoder: 1e-4,
        torque: 0.2,
        drift: 0.0,
        start: [1e-3, 1e-2],
    }
}

/// A run of ten seconds whose controller is given what an estimator makes of noisy encoders.
fn run(seed: u64, estimator: &mut dyn crate::control::Estimator) -> (Run, Figures) {
    let moves = JointMoves::new(&[[0.0, 0.5], [1.0, 1.5], [0.2, 1.0]], 4.0, 0.5).unwrap();
    let options = LoopOptions {
        encoder_noise: 1e-4,
        torque_noise: 0.2,
        initial_spread: [1e-3, 1e-2],
        seed,
        ..LoopOptions::new(10.0, 0.01).unwrap()
    };
    let gains = Gains::new([400.0; 2], [30.0; 2]).unwrap();
    let run = run_loop(&arm(), &mut Feedforward::new(arm(), gains), estimator, &moves, &options).unwrap();
    let figures = Figures::new(&run, &arm().parameters().links, moves.end());
    (run, figures)
}

#[test]
fn the_filters_errors_are_as_large_as_they_say() {
    for mut filter in [
        KalmanFilter::extended(arm(), noise()).unwrap().judged(),
        KalmanFilter::unscented(arm(), noise()).unwrap().judged(),
    ] {
        let mut kept = Vec::new();
        for seed in 1..=20 {
            run(seed, &mut filter);
            kept.extend_from_slice(filter.kept());
        }
        let consistency = Consistency::new(&kept);
        eprintln!("{consistency:?}");
        // 20 runs of some ten independent stretches: 0.95 with a standard error of about 0.015.
        assert!(
            consistency.nees.within > 0.92 && consistency.nis.within > 0.94,
            "{consistency:?}"
        );
        assert!((consistency.nis.mean - 2.0).abs() < 0.1, "{consistency:?}");
    }
}

#[test]
fn the_links_velocities_are_a_third_as_wrong_as_by_differences_or_better() {
    let (_, filtered) = run(3, &mut KalmanFilter::extended(arm(), noise()).unwrap());
    let best = (0..8)
        .map(|k| {
            run(3, &mut Differences::new(0.5 * 2.0_f64.powi(k), true).unwrap())
                .1
                .velocity_error_rms
        })
        .fold(f64::INFINITY, f64::min);
    eprintln!("{} {best}", filtered.velocity_error_rms);
    assert!(
        filtered.velocity_error_rms < best / 3.0,
        "{} {best}",
        filtered.velocity_error_rms
    );
}

/// The filter believes in a fifth of the torques' noise.
#[test]
fn fuzzy_rules_find_the_noise_that_a_filter_was_not_told() {
    let wrong = NoiseModel {
        torque: 0.04,
        ..noise()
    };
    let share = |filter: KalmanFilter| {
        let mut filter = filter.judged();
        run(5, &mut filter);
        (Consistency::new(filter.kept()).nis.mean, filter.factor())
    };
    let (plain, _) = share(KalmanFilter::extended(arm(), wrong).unwrap());
    let (adapted, factor) = share(KalmanFilter::extended(arm(), wrong).unwrap().adaptive());
    eprintln!("{plain} {adapted} {factor}");
    assert!((adapted - 2.0).abs() < 0.5 * (plain - 2.0).abs(), "{plain} {adapted}");
    // The true value is 25; the window's mean is noisy.
    assert!((5.0..125.0).contains(&factor), "{factor}");
}
