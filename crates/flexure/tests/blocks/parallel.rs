//! Sums of branches with one input.

use std::ops::ControlFlow;

use flexure::Error;
use flexure::Result;
use flexure::error::ParameterError;
use flexure::identify::{Identification, Options, PARALLEL, Request};
use flexure::linear::TransferFunction;
use flexure::model::Block;
use flexure::record::Record;

use crate::common::{dead_zone, fit, noisy, uniform};

const SAMPLES: usize = 5000;
/// 40 dB.
const NOISE: f64 = 0.01;

/// A parabola through a slow pole, and a limiter through a resonance two samples later.
fn two_hammerstein_branches(u: &[f64]) -> Vec<f64> {
    let branch = |f: fn(f64) -> f64, b: &[f64], a: &[f64]| {
        let v: Vec<f64> = u.iter().map(|u| f(*u)).collect();
        TransferFunction::new(b.to_vec(), a.to_vec())
            .unwrap()
            .simulate_from_mean(&v)
    };
    let slow = branch(|u| u * u, &[0.2], &[1.0, -0.8]);
    let late = branch(|u| u.clamp(-0.8, 1.0), &[0.0, 0.0, 0.6, 0.3], &[1.0, -0.6, 0.5]);
    slow.iter().zip(&late).map(|(p, q)| 2.0 + p + q).collect()
}

/// of two Wiener-Hammerstein branches, with a dead zone and a saturation.
fn two_wiener_hammerstein_branches(u: &[f64]) -> Vec<f64> {
    let pole = |gain: f64, a: f64, v: &[f64]| {
        let system = TransferFunction::new(vec![gain], vec![1.0, -a]).unwrap();
        system.simulate_from_mean(v)
    };
    let branch = |front: f64, f: fn(f64) -> f64, back: f64| {
        let w = pole(1.0, front, u);
        let z: Vec<f64> = w.iter().map(|w| f(*w)).collect();
        pole(1.0, back, &z)
    };
    let (p, q) = (branch(0.6, dead_zone, 0.3), branch(-0.5, |w| (1.5 * w).tanh(), 0.8));
    p.iter().zip(&q).map(|(p, q)| p + q).collect()
}

fn record(system: fn(&[f64]) -> Vec<f64>, samples: usize, seed: u64) -> Record {
    let u = uniform(samples, seed);
    let y = noisy(system(&u), NOISE, seed);
    Record::new([("u", u), ("y", y)]).unwrap()
}

fn identify(record: &Record, branches: usize) -> Result<Identification> {
    let options = Options {
        branches: Some(branches),
        ..Options::default()
    };
    let records = [record];
    let request = Request::new(&records, &["u"], "y", options);
    PARALLEL.identify_with(&request, &mut |_| ControlFlow::Continue(()))
}

fn checked(result: &Identification, system: fn(&[f64]) -> Vec<f64>) {
    let fresh = uniform(3000, 77);
    let found = fit(&system(&fresh), &result.model.simulate(&fresh));
    assert!(found >= 99.0, "{found} {}", result.verdict.text());
    assert!(result.verdict.holds(), "{}", result.verdict.text());
    let stable = |g: &TransferFunction| g.poles().is_some_and(|p| p.iter().all(|p| p.norm() < 1.0));
    assert!(result.blocks().filter_map(|b| b.linear()).all(|g| stable(&g.system)));
}

#[test]
fn two_hammerstein_branches_come_back_as_two() {
    let result = identify(&record(two_hammerstein_branches, SAMPLES, 1), 2).unwrap();
    checked(&result, two_hammerstein_branches);
    assert_eq!(result.paths.len(), 2);
    let Block::Parallel(branches) = &result.model else {
        panic!("{:?}", result.model);
    };
    assert_eq!(branches.len(), 2);
    // Only the sum is determined: its steady state under a constant input.
    for level in [-1.5, -0.4, 0.3, 1.2] {
        let steady: f64 = (result.paths.iter())
            .map(|p| p.linear().next().unwrap().system.static_gain() * p.curves().next().unwrap().curve.value(level))
            .sum::<f64>()
            + result.output_offset;
        let want = 2.0 + level * level + level.clamp(-0.8, 1.0);
        assert!((steady - want).abs() < 0.05, "{level}: {steady} {want}");
    }
    // One branch, even with dynamics in front, does not do.
    let one = identify(&record(two_hammerstein_branches, 2000, 1), 1).unwrap();
    assert_eq!(one.paths.len(), 1);
    let found = one.verdict.measures.fit_percent;
    assert!(found < 97.0, "{found}");
}

#[test]
fn two_wiener_hammerstein_branches_add_up() {
    let result = identify(&record(two_wiener_hammerstein_branches, SAMPLES, 2), 2).unwrap();
    checked(&result, two_wiener_hammerstein_branches);
    assert!(result.block("front").is_some());
}

#[test]
fn units_and_offsets_change_nothing_but_units() {
    let plain = record(two_hammerstein_branches, 2000, 3);
    let (u, y) = (plain.column("u").unwrap(), plain.column("y").unwrap());
    let scaled = Record::new([
        ("u", u.iter().map(|u| 1e-6 * u + 3.0).collect()),
        ("y", y.iter().map(|y| 1e7 * y - 1e9).collect::<Vec<f64>>()),
    ])
    .unwrap();
    let [a, b] = [&plain, &scaled].map(|r| identify(r, 2).unwrap());
    let (a, b) = (a.verdict.measures.fit_percent, b.verdict.measures.fit_percent);
    assert!(a > 98.5 && (a - b).abs() < 0.2, "{a} {b}");
}

#[test]
fn what_cannot_be_fitted_is_refused_with_a_message() {
    let record = record(two_hammerstein_branches, 300, 4);
    for count in [0, 6] {
        let error = identify(&record, count).unwrap_err();
        assert!(matches!(error, Error::Parameter(ParameterError::OutOfRange { .. })));
        let message = error.to_string();
        assert!(
            message.contains("the number of branches") && message.contains("between 1 and 5"),
            "{message}"
        );
    }
    let short = Record::new([("u", uniform(150, 1)), ("y", uniform(150, 2))]).unwrap();
    let error = PARALLEL.identify(&short, &["u"], "y").unwrap_err();
    assert!(error.to_string().contains("branches in parallel"), "{error}");
}

#[test]
fn noise_alone_ends_in_a_model_that_explains_nothing() {
    let nothing = Record::new([("u", uniform(600, 8)), ("y", uniform(600, 9))]).unwrap();
    let result = PARALLEL.identify(&nothing, &["u"], "y").unwrap();
    assert!(result.verdict.measures.fit_percent < 15.0);
    assert!(result.predicted.iter().all(|y| y.is_finite()));
}
