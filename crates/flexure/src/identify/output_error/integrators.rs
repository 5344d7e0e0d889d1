//! Integrators: poles at 1, which are not estimated.
//!
//! $$ Y_n = \sum_i \frac{B_i(z)}{(1 - z^{-1})^d A(z)} z^{-s_i} U^{(i)}_n + \frac{C(z)}{A(z)} \delta_n + c_0 + \dots + c_d n^d + e_n $$
//! The polynomial of n is the state of the integrators at the start, and a constant that enters them: a bias of the input.
//!
//! Delayed copies of an integrated signal hardly differ. So a numerator is $\sum_{k<d} b_k (1 - z^{-1})^k + (1 - z^{-1})^d \sum_{k \ge d} b_k
//! z^{-(k - d)}$, whose first terms have the signal integrated d times, d - 1 times, ..., and the others the signal itself.

use super::super::block::{convolved, delayed};
use super::limits::TREND_SAMPLES;

/// The signal through $(1 - z^{-1})^d$.
pub fn differenced(signal: &[f64], d: usize) -> Vec<f64> {
    (0..d).fold(signal.to_vec(), |s, _| convolved(&[1.0, -1.0], &s))
}

/// The signal through $(1 - z^{-1})^{-d}$.
pub fn integrated(signal: &[f64], d: usize) -> Vec<f64> {
    let mut sum = signal.to_vec();
    for _ in 0..d {
        let mut all = 0.0;
        for s in &mut sum {
            all += *s;
            *s = all;
        }
    }
    sum
}

/// A signal through each of the first `count` terms of a numerator before d integrators.
pub fn terms(signal: &[f64], d: usize, count: usize) -> Vec<Vec<f64>> {
    (0..count)
        .map(|k| match k < d {
            true => integrated(signal, d - k),
            false => delayed(signal, k - d, 1.0),
        })
        .collect()
}

/// The powers 1 to d of time.
pub fn trend(n: usize, d: usize) -> Vec<Vec<f64>> {
    let power = |k: usize| (0..n).map(|t| (t as f64 / TREND_SAMPLES).powi(k as i32)).collect();
    (1..=d).map(power).collect()
}

/// The constant at the input that gives this coefficient of the last power of time, after d integrators with this gain.
pub fn bias(coefficient: f64, d: usize, gain: f64) -> f64 {
    let factorial: f64 = (1..=d).map(|k| k as f64).product();
    coefficient * factorial / TREND_SAMPLES.powi(d as i32) / gain
}

/// The polynomial in the delay times $(1 - z^{-1})^d$.
pub fn with_integrators(polynomial: &[f64], d: usize) -> Vec<f64> {
    (0..d).fold(polynomial.to_vec(), |before, _| {
        let shifted = std::iter::once(0.0).chain(before.iter().copied());
        let padded = before.iter().copied().chain([0.0]);
        padded.zip(shifted).map(|(now, last)| now - last).collect()
    })
}

/// The polynomial in the delay of one term of a numerator before d integrators.
pub fn term_polynomial(k: usize, d: usize) -> Vec<f64> {
    let mut lag = vec![0.0; k.saturating_sub(d)];
    lag.push(1.0);
    with_integrators(&lag, k.min(d))
}

/// The numerator as a polynomial in the delay.
pub fn numerator_polynomial(coefficients: &[f64], d: usize) -> Vec<f64> {
    let mut all = vec![0.0; coefficients.len()];
    for (k, c) in coefficients.iter().enumerate() {
        let each = all.iter_mut().zip(term_polynomial(k, d));
        each.for_each(|(sum, p)| *sum += c * p);
    }
    all
}
