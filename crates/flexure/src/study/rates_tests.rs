//! The theorems' exponents, measured; and that a study would notice wrong ones.

use std::ops::ControlFlow;

use super::*;
use crate::error::{Error, Stopped};
use crate::study::{Bandwidth, Checkpoint, FINITE_SAMPLES, RateResult, RateTable};

fn study(settings: Vec<Setting>, lengths: &[usize], runs: usize) -> RateStudy {
    RateStudy {
        settings,
        lengths: lengths.to_vec(),
        runs,
        seed: 1,
    }
}

fn run(study: &RateStudy) -> RateTable {
    study.run(&mut |_, _| ControlFlow::Continue(())).unwrap()
}

/// The results' slopes, weighted by their precision, and the standard error.
fn pooled<'a>(results: impl Iterator<Item = &'a RateResult>) -> (f64, f64) {
    let (mut weight, mut sum) = (0.0, 0.0);
    for r in results {
        let error = (r.interval[1] - r.interval[0]) / (2.0 * 1.96);
        weight += 1.0 / (error * error);
        sum += r.slope / (error * error);
    }
    (sum / weight, 1.0 / f64::sqrt(weight))
}

#[test]
fn the_theorems_exponents_are_measured_for_every_class_data_and_input() {
    let table = run(&study(theorem_settings(), &[1000, 4000, 16_000], 200));
    assert_eq!(table.results.len(), 18);
    for r in &table.results {
        assert!(r.points.iter().all(|p| p.missing == 0));
        assert!(r.agrees, "{table}");
    }
    // Over the inputs the slope is so precise that it excludes the other classes' exponents.
    for target in [Target::Cusp, Target::Kink, Target::Cosine] {
        for is_static in [true, false] {
            let chosen: Vec<&RateResult> = table
                .results
                .iter()
                .filter(|r| {
                    r.setting.target == target && matches!(r.setting.data, DataSource::Static { .. }) == is_static
                })
                .collect();
            assert_eq!(chosen.len(), 3);
            let (slope, error) = pooled(chosen.iter().copied());
            let exponent = chosen[0].setting.exponent;
            assert!(
                (slope - exponent).abs() < 2.58 * error,
                "{target:?}: {slope} +- {error}"
            );
            for other in [-0.25, -1.0 / 3.0, -0.4] {
                assert!(
                    other == exponent || (slope - other).abs() > 1.96 * error,
                    "{target:?}: {slope} +- {error}"
                );
            }
        }
    }
}

#[test]
fn a_wrong_bandwidth_exponent_gives_another_slope() {
    let right = |noise| {
        Setting::at_worst_point(
            Target::Cosine,
            Input::Uniform { range: 2.0 },
            DataSource::Static { noise },
        )
    };
    // Too narrow: the error is the variance's, (n h)^(-1/2).
    let narrow = Setting {
        bandwidth: Bandwidth {
            constant: 20.0,
            exponent: -0.7,
        },
        ..right(0.5)
    };
    // Too wide: the error is the bias's, h^2; the noise is low, so that n = 1000 shows it.
    let wide = Setting {
        bandwidth: Bandwidth {
            constant: 0.8,
            exponent: -0.1,
        },
        ..right(0.02)
    };
    let table = run(&study(vec![narrow, wide], &[1000, 4000, 16_000], 300));
    for (result, exponent) in table.results.iter().zip([-0.15, -0.2]) {
        assert!(!result.agrees, "{table}");
        let [low, high] = result.joint_interval;
        let within = low - FINITE_SAMPLES..high + FINITE_SAMPLES;
        assert!(within.contains(&exponent), "{exponent}: {table}");
    }
    assert!(!table.agrees());
    assert!(table.to_string().contains("differs"));
}

#[test]
fn the_seven_nonlinearities_errors_fall_as_theory_says() {
    let table = run(&study(known_settings(), &[2000, 8000, 32_000], 30));
    for r in &table.results {
        assert!(r.points.windows(2).all(|w| w[1].rms < 0.75 * w[0].rms), "{table}");
        assert!(r.agrees, "{table}");
    }
}

fn small() -> RateStudy {
    let settings = [theorem_settings()[4].clone(), known_settings()[1].clone()];
    study(settings.to_vec(), &[100, 300], 20)
}

#[test]
fn the_table_depends_neither_on_threads_nor_on_interruptions() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let one = pool(1).install(|| run(&small()));
    assert_eq!(one, pool(2).install(|| run(&small())));

    let mut checkpoint = Checkpoint::new(small());
    let mut calls = Vec::new();
    let mut table = None;
    for _ in 0..10 {
        let mut left = 2;
        match checkpoint.run(&mut |done, total| {
            calls.push((done, total));
            left -= 1;
            if left == 0 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        }) {
            Ok(t) => {
                table = Some(t);
                break;
            }
            Err(e) => assert!(
                matches!(e, Error::Stopped(Stopped::Sampling { total: 16_000, .. })),
                "{e}"
            ),
        }
    }
    assert_eq!(table, Some(one));
    // Nothing is measured twice.
    assert!(calls.windows(2).all(|w| w[0].0 <= w[1].0));
    assert_eq!(calls.last(), Some(&(16_000, 16_000)));
}

#[test]
fn another_seed_gives_other_errors() {
    let other = RateStudy { seed: 2, ..small() };
    assert_ne!(run(&small()).results[0].points, run(&other).results[0].points);
}

#[test]
fn a_stop_at_once_says_so() {
    let error = small().run(&mut |_, _| ControlFlow::Break(())).unwrap_err();
    assert_eq!(error.to_string(), "stopped after 0 of 16000 samples, as asked");
}

#[test]
fn runs_without_data_in_reach_are_counted() {
    let mut setting = theorem_settings()[0].clone();
    setting.bandwidth = Bandwidth {
        constant: 1.0,
        exponent: -1.0,
    };
    let table = run(&study(vec![setting], &[100, 1000], 200));
    // X in the window: binomial with mean 2 h n f = 0.5, so that exp(-0.5) = 61 % of the runs have none.
    for p in &table.results[0].points {
        assert_eq!(p.runs + p.missing, 200);
        assert!((90..150).contains(&p.missing), "{}", p.missing);
    }
}

#[test]
fn nonsense_is_refused_by_name() {
    let message = |study: RateStudy| {
        study
            .run(&mut |_, _| ControlFlow::Continue(()))
            .unwrap_err()
            .to_string()
    };
    let with = |change: fn(&mut Setting)| {
        let mut study = small();
        change(&mut study.settings[0]);
        message(study)
    };
    for (got, expected) in [
        (
            message(study(vec![], &[10, 20], 20)),
            "the number of settings of a rate study is 0",
        ),
        (
            message(study(theorem_settings(), &[10], 20)),
            "the number of lengths of a rate study is 1",
        ),
        (
            message(RateStudy { runs: 5, ..small() }),
            "the number of runs of a rate study is 5, but must be at least 20",
        ),
        (message(study(theorem_settings(), &[100, 50], 20)), "lengths[1] is 50"),
        (
            with(|s| s.bandwidth.constant = f64::NAN),
            "the bandwidth's constant is NaN",
        ),
        (with(|s| s.bandwidth.exponent = 0.5), "the bandwidth's exponent is 0.5"),
        (
            with(|s| s.input = Input::Uniform { range: 0.0 }),
            "the input's range is 0",
        ),
        (
            with(|s| s.data = DataSource::Static { noise: -1.0 }),
            "a noise's standard deviation is -1",
        ),
        (
            with(|s| s.norm = crate::study::Norm::Over { low: 1.0, high: 0.0 }),
            "the interval's upper end is 0",
        ),
    ] {
        assert!(got.starts_with(expected), "{got}");
    }
}
