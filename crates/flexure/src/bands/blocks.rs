//! The block length of the moving block bootstrap, from the data.
//!
//! Politis & White (2004), as corrected by Patton, Politis & White (2009):
//! $$ \ell = \left( \frac{2 \hat G^2}{\hat D} \right)^{1/3} n^{1/3} , \quad
//!    \hat G = \sum_{|k| \le M} \lambda(k/M)\, |k|\, \hat R_k , \quad
//!    \hat D = \tfrac43 \Bigl( \sum_{|k| \le M} \lambda(k/M)\, \hat R_k \Bigr)^2 , $$
//! with the flat-top window lambda, 1 up to 1/2 and falling linearly to 0 at 1, over twice as many lags as are
//! correlated.

use crate::linear::correlation::cross_covariance;

/// Correlations count if they are this many standard errors, sqrt(log10 n / n) each, from zero.
const SIGNIFICANT: f64 = 2.0;

/// The block length that is best for the variance of the mean of `values`, in their order in time.
///
/// Between 1, for values that are not correlated, and a third of their number.
pub fn automatic_block_length(values: &[f64]) -> usize {
    let n = values.len();
    if n < 4 {
        return 1;
    }
    let log = (n as f64).log10();
    // Lags are counted as correlated up to the first of `quiet` in a row that are not.
    let quiet = (log.sqrt().ceil() as usize).max(5);
    let most = ((n as f64).sqrt().ceil() as usize + quiet).min(n - 1);
    let covariance = cross_covariance(values, values, most);
    if !(covariance[0] > 0.0) {
        return 1;
    }
    let limit = SIGNIFICANT * (log / n as f64).sqrt() * covariance[0];
    let correlated = |k: usize| covariance.get(k).is_some_and(|c| c.abs() >= limit);
    let last = (0..=most)
        .find(|&m| (1..=quiet).all(|k| !correlated(m + k)))
        .unwrap_or(most);
    let window = (2 * last).clamp(1, most);
    let (mut g, mut spectrum) = (0.0, covariance[0]);
    for k in 1..=window {
        let taper = (2.0 * (1.0 - k as f64 / window as f64)).min(1.0);
        g += 2.0 * taper * k as f64 * covariance[k];
        spectrum += 2.0 * taper * covariance[k];
    }
    let d = 4.0 / 3.0 * spectrum * spectrum;
    let length = (2.0 * g * g / d * n as f64).cbrt();
    if length.is_finite() {
        (length.round() as usize).clamp(1, n / 3)
    } else {
        1
    }
}
