//! Schwarz's criterion for simulation errors, which need not be independent of one another.

use crate::linear::correlation::{cross_covariance, variance};

/// Lags of the errors' autocorrelation.
const LAGS: usize = 100;
/// At least this many independent errors are assumed.
const FEWEST_ERRORS: f64 = 20.0;

/// Schwarz's criterion of the sum of squares of `errors` errors; `dependence` of them carry as much information as one independent error.
pub(super) fn schwarz(squares: f64, parameters: usize, errors: usize, dependence: f64) -> f64 {
    let samples = errors as f64;
    let n = samples / dependence;
    n * (squares.max(f64::MIN_POSITIVE) / samples).ln() + parameters as f64 * n.ln()
}

/// $1 + 2 \sum_j \rho_j^2$ of the output's errors from sample `from` on: a comparison of two models with errors of this
/// autocorrelation varies as much as one with that many times fewer independent errors (Bartlett 1946).
pub(super) fn dependence(output: &[f64], y: &[f64], from: usize) -> f64 {
    let errors: Vec<f64> = output.iter().zip(y).skip(from).map(|(p, y)| p - y).collect();
    if !(variance(&errors) > 0.0) {
        return 1.0;
    }
    let covariance = cross_covariance(&errors, &errors, LAGS.min(errors.len() / 4));
    let noise = 1.0 / errors.len() as f64;
    let power = |r: &f64| ((r / covariance[0]).powi(2) - noise).max(0.0);
    let sum: f64 = covariance[1..].iter().map(power).sum();
    let most = (errors.len() as f64 / FEWEST_ERRORS).max(1.0);
    if sum.is_finite() {
        (1.0 + 2.0 * sum).min(most)
    } else {
        1.0
    }
}
