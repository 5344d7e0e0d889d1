//! The levels in comparison with their truth.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::super::TransferFunction;
use super::*;

const PERIOD: usize = 256;
const LINES: usize = 100;

fn system() -> TransferFunction {
    TransferFunction::new(vec![1.0, 0.4], vec![1.0, -0.6]).unwrap()
}

/// Random phases on the first lines, unit variance.
fn multisine(rng: &mut Pcg64, periods: usize) -> Vec<f64> {
    let phases: Vec<f64> = (0..LINES).map(|_| rng.random_range(0.0..TAU)).collect();
    let size = (2.0 / LINES as f64).sqrt();
    let at = |n: usize| {
        let wave = |(k, phase): (usize, &f64)| (TAU * (k + 1) as f64 * n as f64 / PERIOD as f64 + phase).cos();
        size * phases.iter().enumerate().map(wave).sum::<f64>()
    };
    let period: Vec<f64> = (0..PERIOD).map(at).collect();
    period.iter().cycle().take(periods * PERIOD).copied().collect()
}

/// Input and output in the steady state of a nonlinearity, the system, and noise of this size.
fn measured(seed: u64, periods: usize, f: fn(f64) -> f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let u = multisine(&mut rng, periods + 1);
    let v: Vec<f64> = u.iter().map(|u| f(*u)).collect();
    let mut y = system().simulate(&v).split_off(PERIOD);
    for y in &mut y {
        let e: f64 = StandardNormal.sample(&mut rng);
        *y += noise * e;
    }
    (u[PERIOD..].to_vec(), y)
}

fn approximated(realisations: u64, periods: usize, f: fn(f64) -> f64, noise: f64) -> BestLinearApproximation {
    let all: Vec<_> = (0..realisations).map(|m| measured(m + 1, periods, f, noise)).collect();
    let slices: Vec<PeriodicSignals> = all.iter().map(|(u, y)| PeriodicSignals { u, y }).collect();
    BestLinearApproximation::new(&slices, PERIOD).unwrap()
}

fn mean_square(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64
}

#[test]
fn a_linear_system_has_its_response_and_the_noise_its_level() {
    let (realisations, periods, noise) = (6, 4, 0.1);
    let best = approximated(realisations, periods, |u| u, noise);
    assert_eq!(best.frequency.len(), LINES);
    // A line of the input has the power N^2 / (2 L), one of white noise N s^2.
    let line = PERIOD as f64 / (2.0 * LINES as f64);
    let variance = noise * noise / line / (realisations as f64 * periods as f64);
    // 100 lines of 18 (or 5) complex differences each: 3 % (or 5 %) of the variance.
    assert!(
        (mean_square(&best.noise) / variance - 1.0).abs() < 0.12,
        "{}",
        mean_square(&best.noise) / variance
    );
    assert!(
        (mean_square(&best.total) / variance - 1.0).abs() < 0.2,
        "{}",
        mean_square(&best.total) / variance
    );
    let truth = |f: f64| system().frequency_response(TAU * f);
    let errors = best
        .frequency
        .iter()
        .zip(&best.response)
        .map(|(f, g)| (g - truth(*f)).norm());
    let errors: Vec<f64> = errors.collect();
    assert!(
        (mean_square(&errors) / variance - 1.0).abs() < 0.4,
        "{}",
        mean_square(&errors) / variance
    );
    // What is called distortion is what the estimates' scatter leaves of nothing.
    assert!(mean_square(&best.distortion) < 2.0 * variance * realisations as f64);
}

#[test]
fn a_cubic_has_three_times_the_input_power_as_gain_and_its_distortion_is_distinguished_from_noise() {
    let cubic: fn(f64) -> f64 = |u| u * u * u;
    let (realisations, periods) = (24, 2);
    let best = approximated(realisations, periods, cubic, 0.3);
    // Bussgang: E(u^3 u) / E(u^2) = 3 E(u^2), minus three halves of a line's share of it.
    let gain = 3.0 - 1.5 / LINES as f64;
    let truth = |f: f64| gain * system().frequency_response(TAU * f);
    let far = (best.frequency.iter().zip(&best.response).zip(&best.total))
        .filter(|((f, g), s)| (*g - truth(**f)).norm() > 3.0 * **s)
        .count();
    assert!(
        far <= 3,
        "{far} of {LINES} lines are off by more than three standard deviations"
    );
    let quiet = approximated(realisations, periods, cubic, 0.0);
    assert!(quiet.noise.iter().all(|s| *s < 1e-9));
    let (got, want) = (mean_square(&best.distortion), mean_square(&quiet.distortion));
    assert!((got / want - 1.0).abs() < 0.1, "{got} {want}");
    // Without noise, all differences are distortion.
    let alone = realisations as f64 * mean_square(&quiet.total);
    assert!((alone / want - 1.0).abs() < 1e-9, "{alone} {want}");
}

#[test]
fn what_was_not_measured_is_not_given() {
    let (u, y) = measured(3, 2, |u| u, 0.1);
    let single = BestLinearApproximation::new(&[PeriodicSignals { u: &u, y: &y }], PERIOD).unwrap();
    assert!(single.total.is_empty() && single.distortion.is_empty() && single.noise.len() == LINES);
    let (u, y) = (&u[..PERIOD], &y[..PERIOD]);
    let once = BestLinearApproximation::new(&[PeriodicSignals { u, y }; 2], PERIOD).unwrap();
    assert!(once.noise.is_empty() && once.distortion.is_empty() && once.total.len() == LINES);
}

#[test]
fn what_cannot_be_approximated_is_refused_with_a_message() {
    let message = |u: &[f64], y: &[f64], period| {
        let refused = BestLinearApproximation::new(&[PeriodicSignals { u, y }], period);
        refused.unwrap_err().to_string()
    };
    assert!(message(&[1.0; 8], &[1.0; 8], 1).contains("the period"));
    assert!(message(&[1.0; 8], &[1.0; 7], 4).contains("the output of realisation 0"));
    assert!(message(&[1.0; 8], &[1.0; 8], 9).contains("whole periods"));
    assert!(message(&[1.0; 8], &[1.0; 8], 4).contains("the input"));
    assert!(message(&[1.0, f64::NAN], &[1.0; 2], 2).contains("the input of realisation 0"));
    assert!(BestLinearApproximation::new(&[], 4).is_err());
}

#[test]
fn periods_are_found_up_to_noise_and_nowhere_else() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(8);
    let mut noise = |n: usize| -> Vec<f64> { (0..n).map(|_| random.random_range(-1.0..1.0)).collect() };
    let period = noise(128);
    let errors = noise(1000);
    let repeated = |size: f64| -> Vec<f64> {
        let signal = period.iter().cycle().zip(&errors);
        signal.map(|(u, e)| u + size * e).collect()
    };
    assert_eq!(period_of(&repeated(0.0)), Some(128));
    assert_eq!(period_of(&repeated(0.02)), Some(128));
    assert_eq!(period_of(&repeated(0.5)), None);
    assert_eq!(period_of(&noise(1000)), None);
    assert_eq!(period_of(&[1.0; 100]), None);
    assert_eq!(period_of(&[]), None);
    let slow = |length: f64| -> Vec<f64> {
        (0..1000)
            .map(|k| (std::f64::consts::TAU * f64::from(k) / length).sin())
            .collect()
    };
    assert_eq!(period_of(&slow(250.0)), Some(250));
    assert_eq!(period_of(&slow(2000.0)), None);
}
