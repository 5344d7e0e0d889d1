//! Corrections for an input that is not white; the paper and theorem 2 assume a white one.
//!
//! Both steps are corrected, a few times in turn:
//!
//! 1. correlation: the covariances satisfy the Wiener-Hopf equations
//!    $$ \sum_i k_i\, \mathrm{cov}(m_{n+j-i}, m_n) = \mathrm{cov}(Y_{n+j}, m_n), \quad m_n = m_n(X_n), $$
//!    whose solution is the impulse response;
//! 2. regression: the output, minus the part that k explains at all other lags, is regressed on the input again.
//!
//! No theorem of the paper covers this.

use std::ops::Range;

use super::Estimate;
use super::correlation::{ImpulseResponse, Psi};
use super::delay::Lags;
use super::limits::{COLOUR_PASSES, LARGEST_ORDER, MOST_DECONVOLVED, RIDGE, SAMPLES_PER_UNKNOWN};
use super::options::PlainHammerstein;
use super::regression::NonlinearityEstimate;
use crate::error::Result;
use crate::linalg::{self, WithInverse};
use crate::linear::correlation::{cross_covariance, variance};
use crate::parallel;
use crate::quantiles::NORMAL_99;
use crate::vectors::dot;

/// Both blocks without the input's colour, from those estimated as if it were white.
pub(super) fn corrected(
    method: &PlainHammerstein,
    x: &[f64],
    y: &[f64],
    lags: &Lags,
    mut estimate: Estimate,
) -> Result<Estimate> {
    let window = deconvolved_lags(method, lags, x.len());
    let Some(response) = deconvolve(y, &estimate.regression.centred, window.clone()) else {
        return Ok(estimate);
    };
    estimate.response = response;
    for _ in 0..COLOUR_PASSES {
        let response = &estimate.response;
        let delay = method.delay.unwrap_or_else(|| response.first_clear());
        let lag = method.regression_lag.resolve(response.strongest(), delay);
        let rest = less_other_lags(y, &estimate.regression.centred, &response.k, lag);
        let regression = NonlinearityEstimate::new(method, x, &rest, lag)?;
        match deconvolve(y, &regression.centred, window.clone()) {
            Some(better) if better.unexplained < response.unexplained => {
                (estimate.regression, estimate.response) = (regression, better);
                estimate.regression_lag = lag;
            }
            _ => break,
        }
    }
    estimate.delay = method.delay.unwrap_or_else(|| estimate.response.first_clear());
    Ok(estimate)
}

/// The lags that a deconvolution solves for: from the delay on if it is given; otherwise from 0 on, or around the strongest dependence if
/// that is far away.
fn deconvolved_lags(method: &PlainHammerstein, lags: &Lags, samples: usize) -> Range<usize> {
    // Never fewer unknowns than the order needs.
    let order = method.order.unwrap_or(LARGEST_ORDER);
    let count = (samples / SAMPLES_PER_UNKNOWN).max(4 * order + 5).min(MOST_DECONVOLVED);
    let first = method.delay.unwrap_or(lags.strongest.saturating_sub(count / 2));
    first..(first + count).min(lags.last) + 1
}

/// The impulse response from `m` = m_n(X_n) to y by the Wiener-Hopf equations at the lags `lags`; zero at earlier lags.
///
/// `None` if m is constant.
pub(super) fn deconvolve(y: &[f64], m: &[f64], lags: Range<usize>) -> Option<ImpulseResponse> {
    let n = y.len();
    let mut r = cross_covariance(m, m, lags.len() - 1);
    let joint = cross_covariance(m, y, lags.end - 1).split_off(lags.start);
    r[0] *= 1.0 + RIDGE;
    let WithInverse {
        solution,
        largest_diagonal,
    } = linalg::solve_toeplitz(&r, &joint)?;
    let explained = dot(&solution, &joint);
    let power = variance(y);
    let unexplained = (1.0 - explained / power).max(0.0);
    Some(ImpulseResponse {
        limit: NORMAL_99 * (unexplained * power * largest_diagonal / n as f64).sqrt(),
        k: std::iter::repeat_n(0.0, lags.start).chain(solution).collect(),
        psi: Psi::DeconvolvedNonlinearity,
        unexplained,
        autocovariance: Some(r),
    })
}

/// y minus the part that the response explains at all lags except `lag`.
fn less_other_lags(y: &[f64], m: &[f64], k: &[f64], lag: usize) -> Vec<f64> {
    let first = k.iter().position(|&k| k != 0.0).unwrap_or(k.len());
    parallel::numbers(y.len(), |n| {
        let past = k.iter().enumerate().skip(first).take((n + 1).saturating_sub(first));
        let others: f64 = past.filter(|(j, _)| *j != lag).map(|(j, k)| k * m[n - j]).sum();
        y[n] - others
    })
}
