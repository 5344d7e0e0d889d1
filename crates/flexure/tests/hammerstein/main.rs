//! The plain Hammerstein identification through the public interface, on systems whose truth is known.

mod calibration;
mod cascades;
mod colour;
mod controlled;
mod errors;
mod forms;
mod invariance;
mod kinks;
mod oracle;
mod ordinary_inputs;
mod recovery;
mod refined;
mod robustness;
mod starts;
mod verdict;

use std::ops::ControlFlow;

use flexure::Record;
use flexure::identify::result::{CoefficientErrors, ImpulseEstimate, StaticBlock, Value};
use flexure::identify::{Identification, Options, PlainHammerstein, Request, Structure};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::Curve;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// `n` values, uniform on [-range, range].
fn uniform(seed: u64, n: usize, range: f64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-range..range)).collect()
}

/// `n` values, normal with standard deviation `sd`.
fn normal(seed: u64, n: usize, sd: f64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let e: f64 = StandardNormal.sample(&mut rng);
            sd * e
        })
        .collect()
}

fn filter(b: &[f64], a: &[f64]) -> TransferFunction {
    TransferFunction::new(b.to_vec(), a.to_vec()).unwrap()
}

fn record(u: Vec<f64>, y: Vec<f64>) -> Record {
    Record::new([("u", u), ("y", y)]).unwrap()
}

/// `phi`, then `linear`, then normal noise of standard deviation `noise`; uniform input on [-2, 2].
fn hammerstein(phi: impl Fn(f64) -> f64, linear: &TransferFunction, n: usize, noise: f64, seed: u64) -> Record {
    let u = uniform(seed, n, 2.0);
    let w: Vec<f64> = u.iter().map(|&u| phi(u)).collect();
    let e = normal(seed ^ 0xabcd, n, noise);
    let y = linear.simulate(&w).iter().zip(e).map(|(y, e)| y + e).collect();
    record(u, y)
}

fn identify(record: &Record) -> Identification {
    PlainHammerstein::default().identify(record, "u", "y").unwrap()
}

/// The identification from a record whose output misses samples.
fn identify_present(structure: &Structure, record: &Record) -> Identification {
    let options = Options {
        missing: true,
        ..Options::default()
    };
    let records = [record];
    let request = Request::new(&records, &["u"], "y", options);
    structure
        .identify_with(&request, &mut |_| ControlFlow::Continue(()))
        .unwrap()
}

fn curve(result: &Identification) -> &Curve {
    &static_block(result).curve
}

fn static_block(result: &Identification) -> &StaticBlock {
    result.block("nonlinearity").unwrap().curve().unwrap()
}

fn linear_part(result: &Identification) -> &TransferFunction {
    result.linear("linear").unwrap()
}

fn impulse(result: &Identification) -> &ImpulseEstimate {
    let linear = result.block("linear").unwrap().linear().unwrap();
    linear.impulse.as_ref().unwrap()
}

fn errors(result: &Identification) -> Option<&CoefficientErrors> {
    result.block("linear").unwrap().linear().unwrap().errors.as_ref()
}

fn number(result: &Identification, detail: &str) -> f64 {
    result.detail(detail).and_then(Value::number).unwrap()
}

fn numbers(result: &Identification, detail: &str) -> Vec<f64> {
    let values = result.detail(detail).unwrap().list().iter();
    values.map(|v| v.number().unwrap()).collect()
}

fn lag_of_regression(result: &Identification) -> usize {
    number(result, "regression_lag") as usize
}

fn is_correlated_with(result: &Identification, signal: &str) -> bool {
    result.detail("correlated_with") == Some(&Value::from(signal))
}

/// Asserts |a - b| <= tolerance, elementwise.
fn assert_close(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= tolerance, "{what}[{i}]: {a} {b}");
    }
}
