//! The tests' levels, measured, and their power.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::linear::TransferFunction;

fn white(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}

fn coloured(seed: u64, n: usize, pole: f64) -> Vec<f64> {
    let filter = TransferFunction::new(vec![1.0], vec![1.0, -pole]).unwrap();
    filter.simulate(&white(seed, n + 200)).split_off(200)
}

/// How often `kind` rejects over many independent pairs (e, u).
fn rejections(kind: TestKind, runs: u64, pair: impl Fn(u64) -> (Vec<f64>, Vec<f64>)) -> f64 {
    let rejected = (0..runs).filter(|&seed| {
        let (e, u) = pair(seed);
        let tests = ResidualTests::new(&e, &u).unwrap();
        tests.tests.iter().any(|t| t.kind == kind && !t.passed())
    });
    rejected.count() as f64 / runs as f64
}

/// Three standard deviations of a share of 1 % over `runs`.
fn tolerance(runs: u64) -> f64 {
    3.0 * (LEVEL * (1.0 - LEVEL) / runs as f64).sqrt()
}

#[test]
fn a_true_model_is_rejected_at_the_stated_level() {
    let runs = 2000;
    let pair = |n| move |seed| (white(2 * seed, n), white(2 * seed + 1, n));
    for kind in [TestKind::InputIndependence, TestKind::SquaredInputIndependence] {
        let share = rejections(kind, runs, pair(1000));
        assert!((share - LEVEL).abs() < tolerance(runs), "{kind:?}: {share}");
    }
    // The tail of Ljung and Box's statistic approaches its limit slowly: 1.7 % at n = 1000.
    let share = rejections(TestKind::Whiteness, runs, pair(8000));
    assert!((share - LEVEL).abs() < tolerance(runs), "whiteness: {share}");
}

#[test]
fn colour_of_both_signals_does_not_change_the_level_of_the_independence_test() {
    let runs = 2000;
    let share = rejections(TestKind::InputIndependence, runs, |seed| {
        (coloured(2 * seed, 2000, 0.8), coloured(2 * seed + 1, 2000, 0.7))
    });
    assert!((share - LEVEL).abs() < 2.0 * tolerance(runs), "{share}");
}

#[test]
fn dependence_is_found() {
    let linear = |seed| {
        let u = white(2 * seed, 1000);
        let e = white(2 * seed + 1, 1000)
            .iter()
            .enumerate()
            .map(|(i, e)| e + 0.25 * u[i.max(3) - 3])
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::InputIndependence, 50, linear) > 0.95);
    let even = |seed| {
        let u = white(2 * seed, 1000);
        let e = white(2 * seed + 1, 1000)
            .iter()
            .zip(&u)
            .map(|(e, u)| e + 0.2 * u * u)
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::SquaredInputIndependence, 50, even) > 0.95);
    let spread = |seed| {
        let u = white(2 * seed, 1000);
        let e = white(2 * seed + 1, 1000)
            .iter()
            .zip(&u)
            .map(|(e, u)| e * (1.0 + 0.5 * u * u))
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::SquaredIndependence, 50, spread) > 0.95);
    assert!(
        rejections(TestKind::Whiteness, 50, |seed| (
            coloured(seed, 1000, 0.3),
            white(seed, 1000)
        )) > 0.95
    );
}

#[test]
fn a_nonlinearity_after_the_dynamics_is_found_where_the_input_alone_does_not_show_it() {
    // The prediction is linear with a memory of 50 samples; the output is its saturation.
    let slow = TransferFunction::new(vec![0.2], vec![1.0, -0.98]).unwrap();
    let tests = |seed: u64, share: f64| {
        let u = white(2 * seed, 3000);
        let p = slow.simulate(&u);
        let e: Vec<f64> = white(2 * seed + 1, 3000)
            .iter()
            .zip(&p)
            .map(|(e, p)| e - share * p.powi(3))
            .collect();
        ResidualTests::with_prediction(&e, &u, &p).unwrap()
    };
    let found = (0..40).filter(|&s| {
        let t = tests(s, 0.15);
        t.tests
            .iter()
            .any(|t| t.kind == TestKind::CubedPredictionIndependence && !t.passed())
    });
    assert!(found.count() > 36);
    // And nothing is found where there is nothing, at the level of 1 % each.
    for kind in [
        TestKind::SquaredPredictionIndependence,
        TestKind::CubedPredictionIndependence,
    ] {
        let rejected = (0..1000).filter(|&s| {
            let u = coloured(2 * s, 1000, 0.8);
            let e = coloured(2 * s + 1, 1000, 0.5);
            let all = ResidualTests::with_prediction(&e, &u, &u).unwrap();
            all.tests.iter().any(|t| t.kind == kind && !t.passed())
        });
        let share = rejected.count() as f64 / 1000.0;
        assert!((share - LEVEL).abs() < 2.0 * tolerance(1000), "{kind:?}: {share}");
    }
}

#[test]
fn nothing_left_is_nothing_against_the_model() {
    let tests = ResidualTests::new(&[0.0; 100], &white(1, 100)).unwrap();
    assert!(tests.refutation().is_none() && tests.tests.iter().all(ResidualTest::passed));
}

#[test]
fn chi_squared_limits_are_those_of_tables() {
    // R: qchisq(0.99, 25) = 44.3141, pchisq(30, 25, lower = FALSE) = 0.2243
    let test = ResidualTest::chi_squared(TestKind::Whiteness, 30.0, 25);
    assert!(
        (test.limit - 44.3141).abs() < 1e-3 && (test.p_value - 0.2243).abs() < 1e-4,
        "{test:?}"
    );
}
