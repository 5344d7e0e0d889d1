//! The identification as a whole.

use crate::linear::TransferFunction;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::identify::WIENER;
use crate::identify::result::Value;
use crate::linear::correlation::{mean, variance};
use crate::model::Block;
use crate::record::Record;
use crate::signal::gaussian;
use crate::systems::relative_error_after_alignment;
use crate::validation::FitMeasures;

/// A known system: a linear block, and a function of its standardised output.
struct Known {
    linear: TransferFunction,
    f: fn(f64) -> f64,
}

impl Known {
    fn new(b: &[f64], a: &[f64], f: fn(f64) -> f64) -> Known {
        let linear = TransferFunction::new(b.to_vec(), a.to_vec()).unwrap();
        Known { linear, f }
    }

    /// Input, output, and output with white noise of this share of its standard deviation.
    fn record(&self, u: &[f64], noise: f64) -> (Vec<f64>, Record) {
        let w = self.linear.simulate(u);
        let (centre, spread) = (mean(&w), variance(&w).sqrt());
        let y0: Vec<f64> = w.iter().map(|w| (self.f)((w - centre) / spread)).collect();
        let size = noise * variance(&y0).sqrt();
        let noisy = y0.iter().zip(gaussian(u.len(), 99)).map(|(y, e)| y + size * e);
        let record = Record::new([("u", u.to_vec()), ("y", noisy.collect())]).unwrap();
        (y0, record)
    }
}

/// Impulse response's relative distance after the best scaling.
fn distance(a: &TransferFunction, b: &TransferFunction) -> f64 {
    let (k, h) = (a.impulse_response(200), b.impulse_response(200));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    (1.0 - dot(&k, &h).powi(2) / (dot(&k, &k) * dot(&h, &h)))
        .max(0.0)
        .sqrt()
}

/// Whether the search started from higher moments.
fn from_higher_moments(result: &Identification) -> bool {
    matches!(result.detail("start"), Some(Value::Text(text)) if text.contains("higher moments"))
}

fn identify(record: &Record) -> Identification {
    WIENER.identify(record, &["u"], "y").unwrap()
}

/// Orders 1 to 4; odd, invertible, even and one-sided; white and coloured, Gaussian and uniform; 40 dB.
#[test]
fn known_systems_come_back_with_both_blocks() {
    let mut rng = Pcg64::seed_from_u64(2);
    let uniform: Vec<f64> = (0..4000).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut last = 0.0;
    let coloured: Vec<f64> = gaussian(4000, 3)
        .iter()
        .map(|e| {
            last = 0.7 * last + e;
            last
        })
        .collect();
    let white = gaussian(4000, 4);
    type Case<'a> = (Known, &'a [f64], usize, bool);
    let cases: [Case<'_>; 6] = [
        (
            Known::new(&[1.0], &[1.0, -0.7], |x| x.clamp(-0.7, 1.0)),
            &white,
            1,
            false,
        ),
        (Known::new(&[1.0, 0.4], &[1.0, -1.2, 0.6], |x| x * x), &white, 2, true),
        (Known::new(&[1.0, 0.5], &[1.0, -1.5, 0.7], f64::abs), &coloured, 2, true),
        (
            Known::new(&[0.0, 1.0, 0.3], &[1.0, -0.9, 0.5, 0.2], |x| {
                (x - 0.5).max(0.0) + (x + 0.7).min(0.0)
            }),
            &coloured,
            3,
            false,
        ),
        (
            Known::new(&[1.0, 0.3, 0.1, 0.2], &[1.0, -1.6, 1.4, -0.8, 0.3], |x| {
                x + 0.4 * x * x * x
            }),
            &uniform,
            4,
            false,
        ),
        (
            Known::new(&[1.0, -0.8], &[1.0, -0.3, 0.06], |x| x.max(0.0)),
            &uniform,
            2,
            false,
        ),
    ];
    for (i, (known, u, order, even)) in cases.into_iter().enumerate() {
        let (y0, record) = known.record(u, 0.01);
        let result = identify(&record);
        let fit = FitMeasures::new(&y0[3000..], &result.predicted[3000..])
            .unwrap()
            .fit_percent;
        assert!(fit > 99.0, "{i}: {fit}");
        assert_eq!(result.order, order, "{i}");
        let apart = distance(&known.linear, result.linear("linear").unwrap());
        assert!(apart < 0.01, "{i}: {apart}");
        assert!(from_higher_moments(&result) || !even, "{i}");
        assert!(result.linear("linear").unwrap().is_stable(), "{i}");
        // The curve, over the middle of the intermediate signal's range.
        let w = Block::Linear(result.linear("linear").unwrap().clone()).simulate(u);
        let (centre, spread) = (mean(&w), variance(&w).sqrt());
        let sign = if same_sign(&known.linear, result.linear("linear").unwrap()) {
            1.0
        } else {
            -1.0
        };
        let grid: Vec<f64> = (-20..=20).map(|k| 0.1 * f64::from(k)).collect();
        let truth: Vec<f64> = grid.iter().map(|x| (known.f)(*x)).collect();
        let curve = |x: &f64| result.curve("nonlinearity").unwrap().value(centre + sign * spread * x);
        let error = relative_error_after_alignment(&truth, &grid.iter().map(curve).collect::<Vec<f64>>());
        assert!(error < 0.01, "{i}: {error}");
    }
}

/// Whether two impulse responses have the same sign.
fn same_sign(a: &TransferFunction, b: &TransferFunction) -> bool {
    let (k, h) = (a.impulse_response(200), b.impulse_response(200));
    k.iter().zip(&h).map(|(k, h)| k * h).sum::<f64>() > 0.0
}

#[test]
fn units_and_offsets_do_not_matter_and_neither_does_the_run() {
    let known = Known::new(&[0.4, 0.1], &[1.0, -1.1, 0.5], |x| x.abs() + 0.3 * x);
    let (_, record) = known.record(&gaussian(1200, 5), 0.01);
    let first = identify(&record);
    assert_eq!(first, identify(&record));
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let moved = |gain_in: f64, offset_in: f64, gain_out: f64, offset_out: f64| {
        let new = |v: &[f64], gain: f64, offset: f64| v.iter().map(|v| gain * v + offset).collect::<Vec<f64>>();
        let columns = [("u", new(u, gain_in, offset_in)), ("y", new(y, gain_out, offset_out))];
        identify(&Record::new(columns).unwrap())
    };
    // Powers of two: not a bit of the structure differs.
    let exact = moved(1024.0, 0.0, 1.0 / 4096.0, 0.0);
    assert_eq!(
        (exact.tried.len(), exact.linear("linear").unwrap().a()),
        (first.tried.len(), first.linear("linear").unwrap().a())
    );
    // In the other cases rounding may add or remove a piece, but it does not lead to another system.
    let noise = 0.01 * variance(y).sqrt();
    for (gain_in, offset_in, gain_out, offset_out) in [(1e9, 3e9, 1e-9, -2e-9), (1e-9, 0.0, -1e9, 5e9)] {
        let other = moved(gain_in, offset_in, gain_out, offset_out);
        assert_eq!(other.order, first.order);
        let apart = distance(other.linear("linear").unwrap(), first.linear("linear").unwrap());
        assert!(apart < 3e-3, "{apart}");
        let back = other.predicted.iter().map(|p| (p - offset_out) / gain_out);
        let squares: f64 = back.zip(&first.predicted).map(|(p, q)| (p - q).powi(2)).sum();
        let difference = (squares / y.len() as f64).sqrt();
        assert!(difference < 0.5 * noise, "{difference} {noise}");
    }
}

#[test]
fn a_long_delay_is_found_under_an_even_nonlinearity() {
    let b: Vec<f64> = [0.0; 40].into_iter().chain([1.0, 0.4]).collect();
    let known = Known::new(&b, &[1.0, -0.6], |x| x * x);
    let (y0, record) = known.record(&gaussian(4000, 6), 0.01);
    let result = identify(&record);
    let fit = FitMeasures::new(&y0[3000..], &result.predicted[3000..])
        .unwrap()
        .fit_percent;
    assert!(fit > 99.0, "{fit}");
    assert!(distance(&known.linear, result.linear("linear").unwrap()) < 0.01);
}
