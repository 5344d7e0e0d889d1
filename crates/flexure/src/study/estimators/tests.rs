//! That the estimators converge as theory says, and that the study would notice if one did not.

use std::ops::ControlFlow;

use super::*;
use crate::nonlinearity::Basis;
use crate::study::{Experiment, Input, RateTable};

fn run(settings: Vec<EstimatorSetting>, lengths: &[usize], runs: usize) -> RateTable<EstimatorSetting> {
    let study = EstimatorStudy {
        settings,
        lengths: lengths.to_vec(),
        runs,
        seed: 1,
    };
    study.run(&mut |_, _| ControlFlow::Continue(())).unwrap()
}

#[test]
fn every_estimator_converges_at_its_rate() {
    // With 60 runs a pointwise slope is known to 0.7 / sqrt(60) / 2.9 = 0.03, an L2 one to 0.005 or so; the verdict takes
    // all intervals jointly.
    let table = run(estimator_settings(), &[256, 2048, 16_384], 60);
    for r in &table.results {
        assert!(r.points.iter().all(|p| p.missing == 0), "{table}");
        // If an estimate has run wild, eight times as many points do not help, and the fit's weights do not show it.
        assert!(r.points.windows(2).all(|w| w[1].rms < 0.9 * w[0].rms), "{table}");
        assert!(r.agrees, "{table}");
        // Wide intervals agree with anything.
        assert!(r.interval[1] - r.interval[0] < 0.15, "{table}");
    }
}

#[test]
fn a_wrong_schedule_gives_another_slope() {
    let find = |method, regressand| {
        let settings = estimator_settings().into_iter();
        let mut matching = settings.filter(|s| s.method == method && s.regressand == regressand && s.columns == 1);
        matching.next().unwrap()
    };
    let with = |method, regressand, constant, exponent, noise| EstimatorSetting {
        schedule: Schedule { constant, exponent },
        noise,
        ..find(method, regressand)
    };
    // Too few neighbours: the variance's 1/k. Too few terms or cells: the bias's N^-2, N^-1.
    let wrong = vec![
        with(Method::Neighbours, Regressand::Cosine, 3.0, 0.5, 0.5),
        with(Method::Series(Basis::Fourier), Regressand::ThreeHalves, 6.0, 0.1, 0.01),
        with(Method::Haar, Regressand::Sine, 1.0, 1.0 / 6.0, 0.01),
    ];
    let table = run(wrong, &[256, 2048, 16_384], 60);
    for (r, exponent) in table.results.iter().zip([-0.25, -0.2, -1.0 / 6.0]) {
        assert!(!r.agrees, "{table}");
        assert!((r.slope - exponent).abs() < 0.05, "{exponent}: {table}");
    }
    assert!(!table.agrees());
}

#[test]
fn networks_keep_their_bounds() {
    let settings = network_settings().into_iter().filter(|s| s.columns == 1).collect();
    let table = run(settings, &[100, 800], 20);
    assert!(table.agrees(), "{table}");
}

#[test]
fn regressands_are_what_their_names_say() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}");
    close(Regressand::Cone.value(&[3.0, -4.0]), 5.0);
    close(Regressand::Cosine.value(&[0.3, 0.4]), 0.3_f64.cos() * 0.4_f64.cos());
    close(Regressand::ThreeHalves.value(&[-1.0]), 1.0);
    close(Regressand::ThreeHalves.value(&[1.0 / 3.0]), 0.5_f64.powf(1.5));
    close(Regressand::Sine.value(&[0.4]), 0.8_f64.sin());
    close(Regressand::KinkedBump.value(&[-1.0]), (-0.5_f64).exp());
    close(Regressand::Bump.value(&[2.0]), (-1.0_f64).exp());
}

#[test]
fn threads_do_not_matter_and_a_stop_says_so() {
    let study = EstimatorStudy {
        settings: estimator_settings()[..4].to_vec(),
        lengths: vec![50, 100],
        runs: 20,
        seed: 3,
    };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let go = || study.run(&mut |_, _| ControlFlow::Continue(())).unwrap();
    assert_eq!(pool(1).install(go), pool(2).install(go));
    let error = study.run(&mut |_, _| ControlFlow::Break(())).unwrap_err();
    assert_eq!(error.to_string(), "stopped after 0 of 12000 samples, as asked");
}

#[test]
fn nonsense_is_refused_by_name() {
    let with = |change: fn(&mut EstimatorSetting)| {
        let mut settings = estimator_settings()[..1].to_vec();
        change(&mut settings[0]);
        let study = EstimatorStudy {
            settings,
            lengths: vec![20, 40],
            runs: 20,
            seed: 1,
        };
        let error = study.run(&mut |_, _| ControlFlow::Continue(())).unwrap_err();
        error.to_string()
    };
    for (got, expected) in [
        (
            with(|s| s.schedule.constant = f64::NAN),
            "the schedule's constant is NaN",
        ),
        (with(|s| s.schedule.exponent = 2.0), "the schedule's exponent is 2"),
        (with(|s| s.noise = -1.0), "the noise's standard deviation is -1"),
        (
            with(|s| s.input = Input::Uniform { range: 0.0 }),
            "the input's range is 0",
        ),
        (with(|s| s.norm = ErrorNorm::At(f64::INFINITY)), "the point is inf"),
        (with(|s| s.columns = 3), "the number of columns is 3"),
    ] {
        assert!(got.starts_with(expected), "{got}");
    }
    assert!(
        estimator_settings()[0]
            .name()
            .contains("local constant, d = 1, |x| at 0")
    );
}
