//! The test of whiteness.

use super::residuals::LEVEL;
use super::test::{Estimated, Observed, ResidualTest, TestKind};
use crate::linear::correlation::cross_covariance;

/// Monti's variant of the Ljung-Box test of `v` with `lags` lags.
pub(crate) fn whiteness(v: &[f64], lags: usize) -> ResidualTest {
    whiteness_of(v, lags, None, LEVEL)
}

/// [`whiteness`] of a signal after an estimated autoregression. The error of that estimate appears as autocorrelation.
pub(super) fn whiteness_of(v: &[f64], lags: usize, noise: Option<Estimated>, level: f64) -> ResidualTest {
    let n = v.len() as f64;
    let partial = partial_autocorrelations(&cross_covariance(v, v, lags));
    let terms = (partial.iter().enumerate()).map(|(k, p)| p * p / (n - (k + 1) as f64));
    let inflation = noise.map(|from| from.inflation(v.len(), lags)).unwrap_or_default();
    let observed = Observed {
        statistic: n * (n + 2.0) * terms.sum::<f64>(),
        terms: lags,
        // Each further lag leaves a factor of the variance.
        explained: 1.0 - partial.iter().map(|p| 1.0 - p * p).product::<f64>(),
    };
    ResidualTest::chi_squared(TestKind::Whiteness, observed, inflation, level)
}

/// The partial autocorrelations at lags 1, 2, ... from covariances at lags 0, 1, ... (Levinson 1947, Durbin 1960).
///
/// They end early if the past determines the signal.
pub(super) fn partial_autocorrelations(covariance: &[f64]) -> Vec<f64> {
    let (mut coefficients, mut partial): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut power = covariance[0];
    for k in 1..covariance.len() {
        if !(power > 0.0) {
            break;
        }
        let expected: f64 = coefficients
            .iter()
            .zip(covariance[..k].iter().rev())
            .map(|(a, c)| a * c)
            .sum();
        let next = ((covariance[k] - expected) / power).clamp(-1.0, 1.0);
        let mirrored: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(mirrored).for_each(|(a, m)| *a -= next * m);
        coefficients.push(next);
        partial.push(next);
        power *= 1.0 - next * next;
    }
    partial
}
