//! Step 3: the impulse response up to scale by correlation, equation (17) (section VII; Greblicki & Pawlak 2008).
//!
//! For a white input and any function psi,
//! $$ \mathrm{cov}(Y_{n+j}, \psi(X_n)) = k_{j-s}\, \mathrm{cov}(\varphi(X), \psi(X)), $$
//! so the cross-covariance is the impulse response up to a scale that does not depend on j. psi is the input itself, or the estimate m_n of
//! step 2 if phi(X) hardly correlates with X (an even phi, for example).

use super::limits::{CLEAR, CONSTANT, WEAK_CORRELATION};
use crate::linear::correlation::{cross_covariance, mean, variance};
use crate::quantiles::NORMAL_99;

/// The function of the input that the output was correlated with for the linear part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Psi {
    /// The input itself.
    Input,
    /// The estimated nonlinearity, if its correlation with the input (nearly) vanishes.
    Nonlinearity,
    /// The estimated nonlinearity, with its autocovariance deconvolved, if the input is not white.
    DeconvolvedNonlinearity,
}

/// The estimated impulse response, from lag 0.
pub(super) struct ImpulseResponse {
    pub k: Vec<f64>,
    /// A coefficient of pure noise lies within this distance of zero with a probability of 99 %.
    pub limit: f64,
    pub psi: Psi,
    /// The share of the output's variance that the response does not explain; unknown for plain correlation.
    pub unexplained: f64,
    /// The autocovariance of the linear part's input, if it is not white.
    pub autocovariance: Option<Vec<f64>>,
}

impl ImpulseResponse {
    /// The lag of the largest coefficient.
    pub fn strongest(&self) -> usize {
        (0..self.k.len())
            .rev()
            .max_by(|&i, &j| self.k[i].abs().total_cmp(&self.k[j].abs()))
            .unwrap_or(0)
    }

    /// The first lag that is clear of noise.
    pub fn first_clear(&self) -> usize {
        let first = self.k.iter().position(|k| k.abs() > CLEAR * self.limit);
        first.unwrap_or_else(|| self.strongest())
    }

    /// A standard error of the static gain of a fit with this many parameters.
    pub fn gain_error(&self, parameters: usize) -> f64 {
        self.limit / NORMAL_99 * (parameters as f64).sqrt()
    }

    /// The lag by which the response has settled: 1.5 times as far from the delay as the last clear coefficient.
    pub fn settling_lag(&self, delay: usize) -> usize {
        let last = self.k.iter().rposition(|k| k.abs() > CLEAR * self.limit);
        let last = last.unwrap_or(delay).max(delay);
        last + (last - delay) / 2
    }
}

/// cov(Y_{n+j}, psi(X_n)) over cov(m_n(X_n), psi(X_n)), j = 0, ..., `lags`: the impulse response in the scale in which its coefficient
/// at the lag of the regression is 1. `m` is m_n(X_n) minus its mean.
pub(super) fn correlate(x: &[f64], y: &[f64], m: &[f64], lags: usize) -> ImpulseResponse {
    let centre = mean(x);
    let joint = m.iter().zip(x).map(|(m, x)| m * (x - centre)).sum::<f64>() / x.len() as f64;
    let power = variance(m);
    let (psi, signal, scale) = if joint * joint < WEAK_CORRELATION * power * variance(x) {
        (Psi::Nonlinearity, m, power)
    } else {
        (Psi::Input, x, joint)
    };
    // If the estimated nonlinearity is constant except for rounding, there is nothing to correlate with.
    let per_scale = if power > CONSTANT * variance(y) {
        1.0 / scale
    } else {
        0.0
    };
    ImpulseResponse {
        k: cross_covariance(signal, y, lags)
            .iter()
            .map(|c| c * per_scale)
            .collect(),
        limit: NORMAL_99 * (variance(signal) * variance(y) / y.len() as f64).sqrt() * per_scale.abs(),
        psi,
        unexplained: f64::INFINITY,
        autocovariance: None,
    }
}
