//! The impulse response by correlation, and the linear part from it.

use std::ops::Range;

use super::{LARGEST_ORDER, Regression};
use crate::error::{DataError, Error, Result};
use crate::identify::outcome::{ChosenOrder, OrderScore, Psi};
use crate::linalg;
use crate::linear::TransferFunction;
use crate::linear::correlation::{cross_covariance, mean, variance};
use crate::linear::from_impulse_response::{from_impulse_response, hankel_singular_values};

/// The normal quantile of two-sided 99 % limits.
const LIMIT_QUANTILE: f64 = 2.575_829_303_548_901;
/// Multiple of the 99 % limit that chance exceeds rarely even among all lags.
const CLEAR: f64 = 1.7;
/// Below this squared correlation of X and m(X) the output is correlated with m(X) in place of X.
const WEAK_CORRELATION: f64 = 0.25;
/// Below this share of the output's variance that of m(X) is rounding.
const CONSTANT: f64 = 1e-20;
/// Most lags of a deconvolution, whose cost grows with their cube.
const MOST_DECONVOLVED: usize = 300;
/// Share of the variance that is added to the autocovariance before it is inverted: frequencies at which
/// the input has less power are not resolved.
const RIDGE: f64 = 1e-5;

/// The estimated impulse response, from lag 0.
pub(super) struct ImpulseEstimate {
    pub k: Vec<f64>,
    /// Within this of zero a coefficient is noise with 99 %.
    pub limit: f64,
    pub psi: Psi,
    /// The share of the output's variance that the response leaves; not known by plain correlation.
    pub unexplained: f64,
    /// The autocovariance of what drives the linear part, where that is not white.
    pub metric: Option<Vec<f64>>,
}

impl ImpulseEstimate {
    /// The lag of the largest coefficient.
    pub fn strongest(&self) -> usize {
        (0..self.k.len())
            .rev()
            .max_by(|&i, &j| self.k[i].abs().total_cmp(&self.k[j].abs()))
            .unwrap_or(0)
    }

    /// The first lag that is clear of noise.
    pub fn first(&self) -> usize {
        self.k
            .iter()
            .position(|k| k.abs() > CLEAR * self.limit)
            .unwrap_or_else(|| self.strongest())
    }

    /// A standard error of the static gain of a fit with this many parameters.
    pub fn gain_error(&self, parameters: usize) -> f64 {
        self.limit / LIMIT_QUANTILE * (parameters as f64).sqrt()
    }

    /// The lag by which the response has settled: past the last clear coefficient by half as much again.
    pub fn settling_lag(&self, delay: usize) -> usize {
        let last = self
            .k
            .iter()
            .rposition(|k| k.abs() > CLEAR * self.limit)
            .unwrap_or(delay)
            .max(delay);
        last + (last - delay) / 2
    }
}

/// cov(Y_{n+j}, psi(X_n)) over cov(m_n(X_n), psi(X_n)), j = 0, ..., `lags`: the impulse response, in the
/// scale in which its coefficient at the regression's lag is 1.
pub(super) fn correlate(u: &[f64], y: &[f64], regression: &Regression, lags: usize) -> ImpulseEstimate {
    let m = &regression.centred;
    let centre = mean(u);
    let joint = m.iter().zip(u).map(|(m, u)| m * (u - centre)).sum::<f64>() / u.len() as f64;
    let power = variance(m);
    let (psi, signal, scale) = if joint * joint < WEAK_CORRELATION * power * variance(u) {
        (Psi::Nonlinearity, m.as_slice(), power)
    } else {
        (Psi::Input, u, joint)
    };
    // A nonlinearity estimated as constant, but for rounding, leaves nothing to correlate with.
    let per_scale = if power > CONSTANT * variance(y) {
        1.0 / scale
    } else {
        0.0
    };
    ImpulseEstimate {
        k: cross_covariance(signal, y, lags)
            .iter()
            .map(|c| c * per_scale)
            .collect(),
        limit: LIMIT_QUANTILE * (variance(signal) * variance(y) / y.len() as f64).sqrt() * per_scale.abs(),
        psi,
        unexplained: f64::INFINITY,
        metric: None,
    }
}

/// The lags that a deconvolution solves for: from `delay` on if that is known, else those from 0 on or, where the
/// strongest dependence lies far, those around it.
pub(super) fn deconvolved_lags(
    delay: Option<usize>,
    strongest: usize,
    order: usize,
    samples: usize,
    last: usize,
) -> Range<usize> {
    // Ten samples for each unknown, but never fewer unknowns than the order needs.
    let count = (samples / 10).max(4 * order + 5).min(MOST_DECONVOLVED);
    let around = strongest.saturating_sub(count / 2);
    let first = delay.unwrap_or(around);
    first..(first + count).min(last) + 1
}

/// The impulse response from `m` = m_n(X_n) to y where X is not white: the solution of the Wiener-Hopf
/// equations sum_i k_i cov(m_{n+j-i}, m_n) = cov(y_{n+j}, m_n) for i and j in `lags`; zero at those before.
///
/// `None` if m is constant.
pub(super) fn deconvolve(y: &[f64], m: &[f64], lags: Range<usize>) -> Option<ImpulseEstimate> {
    let n = y.len();
    let mut r = cross_covariance(m, m, lags.len() - 1);
    let joint = cross_covariance(m, y, lags.end - 1).split_off(lags.start);
    r[0] *= 1.0 + RIDGE;
    let (solution, smallest_variance) = linalg::solve_toeplitz(&r, &joint)?;
    let explained: f64 = solution.iter().zip(&joint).map(|(k, c)| k * c).sum();
    let k = std::iter::repeat_n(0.0, lags.start).chain(solution).collect();
    let power = variance(y);
    let unexplained = (1.0 - explained / power).max(0.0);
    Some(ImpulseEstimate {
        limit: LIMIT_QUANTILE * (unexplained * power * smallest_variance / n as f64).sqrt(),
        k,
        psi: Psi::DeconvolvedNonlinearity,
        unexplained,
        metric: Some(r),
    })
}

/// y less what the response explains of it at all lags but `lag`: what a regression at that lag is left with.
pub(super) fn less_other_lags(y: &[f64], m: &[f64], k: &[f64], lag: usize) -> Vec<f64> {
    let first = k.iter().position(|&k| k != 0.0).unwrap_or(k.len());
    (0..y.len())
        .map(|n| {
            let past = k.iter().enumerate().skip(first).take((n + 1).saturating_sub(first));
            let others: f64 = past.filter(|(j, _)| *j != lag).map(|(j, k)| k * m[n - j]).sum();
            y[n] - others
        })
        .collect()
}

/// Order and transfer function (without the delay) for the impulse response from the delay to `memory`.
pub(super) fn linear_part(
    estimate: &ImpulseEstimate,
    delay: usize,
    memory: usize,
    given: Option<usize>,
    m: &[f64],
    y: &[f64],
) -> Result<(TransferFunction, ChosenOrder)> {
    let k = estimate.k.get(delay..=memory).unwrap_or_default();
    let factor = estimate
        .metric
        .as_ref()
        .and_then(|r| linalg::toeplitz_factor(r.get(..k.len())?));
    let largest = LARGEST_ORDER.min((k.len().saturating_sub(1)) / 2);
    let orders = match given {
        Some(l) => l..=l,
        None => 0..=largest,
    };
    let n = y.len() as f64;
    let centre = mean(y);
    let mut best: Option<(TransferFunction, OrderScore)> = None;
    let mut scores = Vec::new();
    for order in orders {
        let Some(model) = from_impulse_response(k, order, factor.as_deref()) else {
            continue;
        };
        let response = model.simulate(m);
        let silent = std::iter::repeat_n(0.0, delay);
        let squares: f64 = y
            .iter()
            .zip(silent.chain(response))
            .map(|(y, p)| (y - centre - p).powi(2))
            .sum();
        let bic = n * (squares / n).max(f64::MIN_POSITIVE).ln() + (2 * order + 1) as f64 * n.ln();
        let score = OrderScore { order, bic };
        scores.push(score);
        if bic.is_finite() && best.as_ref().is_none_or(|b| bic < b.1.bic) {
            best = Some((model, score));
        }
    }
    let Some((model, score)) = best else {
        return Err(Error::Data(DataError::ResponseTooShort {
            delay,
            lags: k.len(),
            need: 2 * given.unwrap_or(0) + 1,
        }));
    };
    let hankel_singular_values = hankel_singular_values(k, 20).unwrap_or_default();
    let order = ChosenOrder {
        order: score.order,
        hankel_singular_values,
        scores,
    };
    Ok((model, order))
}
