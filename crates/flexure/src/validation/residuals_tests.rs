//! The tests' levels, measured, and their power.

use super::*;
use crate::linear::TransferFunction;
use crate::signal::gaussian;
use crate::validation::test::Inflation;

fn coloured(seed: u64, n: usize, pole: f64) -> Vec<f64> {
    let filter = TransferFunction::new(vec![1.0], vec![1.0, -pole]).unwrap();
    filter.simulate(&gaussian(n + 200, seed)).split_off(200)
}

/// How often `kind` rejects over many independent pairs (e, u).
fn rejections(kind: TestKind, runs: u64, pair: impl Fn(u64) -> (Vec<f64>, Vec<f64>)) -> f64 {
    let rejected = (0..runs).filter(|&seed| {
        let (e, u) = pair(seed);
        let tests = ResidualTests::new(&e, &u).unwrap();
        tests.tests.iter().any(|t| t.kind == kind && t.p_value < LEVEL)
    });
    rejected.count() as f64 / runs as f64
}

/// Three standard deviations of a share of 1 % over `runs`.
fn tolerance(runs: u64) -> f64 {
    3.0 * (LEVEL * (1.0 - LEVEL) / runs as f64).sqrt()
}

/// Five standard deviations of a share of 1 % over `runs`. None of 30 such comparisons exceeds them by chance.
fn far(runs: u64) -> f64 {
    5.0 / 3.0 * tolerance(runs)
}

#[test]
fn a_true_model_is_rejected_at_the_stated_level_whatever_the_colours() {
    for (n, runs) in [(60, 3000), (500, 2000), (1000, 1000)] {
        for (input, error) in [(0.0, 0.0), (0.8, 0.0), (0.0, 0.7), (0.8, 0.7)] {
            let mut rejected = [0_u64; 6];
            for seed in 0..runs {
                let (e, u) = (coloured(2 * seed, n, error), coloured(2 * seed + 1, n, input));
                let p = TransferFunction::monic(vec![1.0, 0.5], vec![-0.6]).simulate(&u);
                let all = ResidualTests::with_prediction(&e, &u, &p).unwrap();
                let each = rejected.iter_mut().zip(&all.tests);
                each.for_each(|(count, test)| *count += u64::from(test.p_value < LEVEL));
            }
            for (i, &count) in rejected.iter().enumerate() {
                let share = count as f64 / runs as f64;
                // A coloured error is not white; on 60 samples its colour is not known well enough for the other tests.
                let exempt = error != 0.0 && (i == 0 || n < 100);
                let off = (share - LEVEL).abs() >= far(runs);
                assert!(exempt || !off, "n = {n}, poles {input} {error}, test {i}: {share}");
            }
        }
    }
}

#[test]
fn a_true_model_is_rejected_at_the_joint_level() {
    // The tests are not independent, so that the joint level may be below 1 %, but not above.
    for (n, runs) in [(500, 4000), (1000, 2000)] {
        for with_prediction in [false, true] {
            let rejected = (0..runs).filter(|&seed| {
                let (e, u) = (coloured(2 * seed, n, 0.7), coloured(2 * seed + 1, n, 0.8));
                let p = TransferFunction::monic(vec![1.0, 0.5], vec![-0.6]).simulate(&u);
                let all = match with_prediction {
                    true => ResidualTests::with_prediction(&e, &u, &p).unwrap(),
                    false => ResidualTests::new(&e, &u).unwrap(),
                };
                let levels = all.tests.iter().filter(|t| t.kind.refutes()).map(|t| t.level);
                assert!((levels.sum::<f64>() - LEVEL).abs() < 1e-15);
                let holm = all.tests.iter().any(|t| t.kind.refutes() && t.p_value < t.level);
                assert_eq!(all.refutation().is_some(), holm, "limit and p-value agree");
                holm
            });
            let share = rejected.count() as f64 / runs as f64;
            let spread = tolerance(runs);
            assert!(
                (LEVEL / 2.0 - spread..LEVEL + spread).contains(&share),
                "n = {n}: {share}"
            );
        }
    }
}

#[test]
fn the_effect_is_the_dependent_share_whatever_the_length_and_the_colours() {
    // e = noise + c u_{n-3} with a share of 5 % of the variance, under a slow input or slow noise.
    for (n, poles) in [(2000, [0.0, 0.0]), (20_000, [0.9, 0.0]), (20_000, [0.0, 0.9])] {
        let runs = 30;
        let mean_effect: f64 = (0..runs)
            .map(|seed| {
                let (v, u) = (coloured(2 * seed, n, poles[1]), coloured(2 * seed + 1, n, poles[0]));
                let gain = (0.05 / 0.95 * variance(&v) / variance(&u)).sqrt();
                let e: Vec<f64> = (0..n).map(|i| v[i] + gain * u[i.max(3) - 3]).collect();
                let tests = ResidualTests::new(&e, &u).unwrap();
                let test = tests.tests[1];
                assert!(!test.passed() && test.kind == TestKind::InputIndependence);
                test.effect / f64::from(runs as u32)
            })
            .sum();
        assert!(
            (mean_effect - 0.05).abs() < 0.006,
            "n = {n}, poles {poles:?}: {mean_effect}"
        );
    }
    // Nothing there: nothing on average either, where R^2 itself is 26/500.
    let silent = (0..200).map(|seed| {
        let tests = ResidualTests::new(&gaussian(500, 2 * seed), &gaussian(500, 2 * seed + 1)).unwrap();
        tests.tests[1].effect / 200.0
    });
    assert!(silent.sum::<f64>() < 0.01);
}

#[test]
fn of_several_tests_the_one_with_the_largest_part_refutes() {
    // The input explains 1 % of the error, its square 20 %.
    let (u, noise) = (gaussian(5000, 1), gaussian(5000, 2));
    let e: Vec<f64> = u.iter().zip(&noise).map(|(u, v)| v + 0.12 * u + 0.4 * u * u).collect();
    let tests = ResidualTests::new(&e, &u).unwrap();
    assert!(!tests.tests[1].passed() && !tests.tests[2].passed());
    assert_eq!(tests.refutation().unwrap().kind, TestKind::SquaredInputIndependence);
}

#[test]
fn the_limits_allow_for_the_error_of_estimated_parameters() {
    // The residual of a moving average of 20 lags, estimated from as many samples as it is tested on.
    let (n, lags, runs) = (600, 20, 1500);
    let [mut allowed, mut plain] = [0_u64; 2];
    for seed in 0..runs {
        let (e, u) = (gaussian(2 * n, 2 * seed), gaussian(2 * n, 2 * seed + 1));
        let row = |t: usize| (0..=lags).map(|k| u[t - k]).collect::<Vec<_>>();
        let rows: Vec<f64> = (lags..n).flat_map(row).collect();
        let slopes = crate::linalg::least_squares(&rows, lags + 1, &e[lags..n]).unwrap();
        let own = |t: usize| row(t).iter().zip(&slopes).map(|(u, b)| u * b).sum::<f64>();
        let left: Vec<f64> = (n..2 * n).map(|t| e[t] - own(t)).collect();
        let estimated = Estimated {
            parameters: lags + 1,
            samples: n - lags,
        };
        let input = |all: ResidualTests| u64::from(all.tests[1].p_value < LEVEL);
        allowed += input(ResidualTests::of_estimate(&left, &u[n..], &u[n..], estimated).unwrap());
        plain += input(ResidualTests::with_prediction(&left, &u[n..], &u[n..]).unwrap());
    }
    let [allowed, plain] = [allowed, plain].map(|count| count as f64 / runs as f64);
    assert!((allowed - LEVEL).abs() < tolerance(runs), "{allowed}");
    assert!(plain > 0.2, "{plain}");
}

#[test]
fn equal_values_share_their_ranks() {
    assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0, 3.0]), [3.0, 0.0, 3.0, 1.0, 3.0]);
    assert_eq!(ranks(&[4.0; 3]), [1.0; 3]);
}

#[test]
fn dependence_is_found() {
    let linear = |seed| {
        let u = gaussian(1000, 2 * seed);
        let e = gaussian(1000, 2 * seed + 1)
            .iter()
            .enumerate()
            .map(|(i, e)| e + 0.25 * u[i.max(3) - 3])
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::InputIndependence, 50, linear) > 0.95);
    let even = |seed| {
        let u = gaussian(1000, 2 * seed);
        let e = gaussian(1000, 2 * seed + 1)
            .iter()
            .zip(&u)
            .map(|(e, u)| e + 0.2 * u * u)
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::SquaredInputIndependence, 50, even) > 0.95);
    // A saturation before a slow pole. A linear model covers its linear part; no other test sees the rest.
    let odd = |seed| {
        let u = gaussian(400, 2 * seed);
        let slope = u.iter().map(|u| u * u.clamp(-0.7, 0.7)).sum::<f64>() / u.iter().map(|u| u * u).sum::<f64>();
        let missed: Vec<f64> = u.iter().map(|u| u.clamp(-0.7, 0.7) - slope * u).collect();
        let slow = TransferFunction::new(vec![0.3], vec![1.0, -0.7]).unwrap();
        let e = slow
            .simulate(&missed)
            .iter()
            .zip(gaussian(400, 2 * seed + 1))
            .map(|(e, noise)| e + 0.01 * noise)
            .collect();
        (e, u)
    };
    assert!(rejections(TestKind::CubedInputIndependence, 50, odd) > 0.95);
    assert!(rejections(TestKind::SquaredInputIndependence, 50, odd) < 0.2);
    let spread = |seed| {
        let u = gaussian(1000, 2 * seed);
        let e = gaussian(1000, 2 * seed + 1)
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
            gaussian(1000, seed)
        )) > 0.95
    );
}

#[test]
fn a_nonlinearity_after_the_dynamics_is_found_where_the_input_alone_does_not_show_it() {
    // The prediction is linear with a memory of 50 samples; the output is its saturation.
    let slow = TransferFunction::new(vec![0.2], vec![1.0, -0.98]).unwrap();
    let tests = |seed: u64, share: f64| {
        let u = gaussian(3000, 2 * seed);
        let p = slow.simulate(&u);
        let e: Vec<f64> = gaussian(3000, 2 * seed + 1)
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
        TestKind::CubedInputIndependence,
        TestKind::SquaredPredictionIndependence,
        TestKind::CubedPredictionIndependence,
    ] {
        let rejected = (0..1000).filter(|&s| {
            let u = coloured(2 * s, 1000, 0.8);
            let e = coloured(2 * s + 1, 1000, 0.5);
            let all = ResidualTests::with_prediction(&e, &u, &u).unwrap();
            all.tests.iter().any(|t| t.kind == kind && t.p_value < LEVEL)
        });
        let share = rejected.count() as f64 / 1000.0;
        assert!((share - LEVEL).abs() < 2.0 * tolerance(1000), "{kind:?}: {share}");
    }
}

#[test]
fn nothing_left_is_nothing_against_the_model() {
    let tests = ResidualTests::new(&[0.0; 100], &gaussian(100, 1)).unwrap();
    assert!(tests.refutation().is_none() && tests.tests.iter().all(ResidualTest::passed));
}

#[test]
fn chi_squared_limits_are_those_of_tables() {
    // R: qchisq(0.99, 25) = 44.3141, pchisq(30, 25, lower = FALSE) = 0.2243
    let observed = Observed {
        statistic: 30.0,
        terms: 25,
        explained: 0.6,
    };
    let test = ResidualTest::chi_squared(TestKind::Whiteness, observed, Inflation::default(), LEVEL);
    // Five sixths of such a statistic come about by chance.
    assert!((test.effect - 0.1).abs() < 1e-12, "{}", test.effect);
    assert!(
        (test.limit - 44.3141).abs() < 1e-3 && (test.p_value - 0.2243).abs() < 1e-4,
        "{test:?}"
    );
}

#[test]
fn an_estimated_noise_model_raises_the_limit_of_whiteness_alone() {
    let (e, u, p) = (gaussian(600, 1), gaussian(600, 2), gaussian(600, 3));
    let noise = Estimated {
        parameters: 9,
        samples: 1800,
    };
    let plain = ResidualTests::of_estimate(&e, &u, &p, noise).unwrap();
    let allowed = ResidualTests::of_whitened(&e, &u, &p, noise, noise).unwrap();
    for (a, b) in plain.tests.iter().zip(&allowed.tests) {
        assert_eq!(a.statistic, b.statistic);
        assert_eq!(a.limit < b.limit, a.kind == TestKind::Whiteness, "{:?}", a.kind);
    }
    // A third of a noise deviation more for each of nine of 25 squares: (25 + 3)/25 in the mean.
    let ratio = allowed.tests[0].limit / plain.tests[0].limit;
    assert!((1.11..1.14).contains(&ratio), "{ratio}");
}

#[test]
fn tests_that_share_a_level_reject_later() {
    let (e, u, p) = (gaussian(400, 4), gaussian(400, 5), gaussian(400, 6));
    let alone = ResidualTests::with_prediction(&e, &u, &p).unwrap();
    let shared = ResidualTests::among(&e, &u, &p, None, 3).unwrap();
    for (a, b) in alone.tests.iter().zip(&shared.tests) {
        assert!(a.limit < b.limit && a.p_value == b.p_value && (3.0 * b.level - a.level).abs() < 1e-15);
    }
}

/// One in a hundred correlations with the input lies outside its limit, also where both signals are correlated in time.
#[test]
fn the_limit_of_a_correlation_with_the_input_allows_for_memory() {
    let (runs, lags) = (400, 2 * LAGS + 1);
    for (input, error) in [(0.0, 0.0), (0.95, 0.9)] {
        let (mut outside, mut outside_of_white) = (0, 0);
        for seed in 0..runs {
            let (e, u) = (coloured(2 * seed, 2000, error), coloured(2 * seed + 1, 2000, input));
            let found = ResidualTests::new(&e, &u).unwrap().correlations;
            let beyond = |limit: f64| found.with_input.iter().filter(|r| r.abs() > limit).count();
            outside += beyond(found.input_limit);
            outside_of_white += beyond(found.limit);
        }
        let share = |count: usize| count as f64 / (runs as usize * lags) as f64;
        assert!(
            (0.005..0.02).contains(&share(outside)),
            "{input} {error}: {}",
            share(outside)
        );
        assert!(
            input == 0.0 || share(outside_of_white) > 0.2,
            "{}",
            share(outside_of_white)
        );
    }
}
