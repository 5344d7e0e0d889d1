//! Does the past of one signal say something about another? A linear regression, whatever the colour of both.

use crate::linalg;
use crate::linear::autoregression::whitening;
use crate::linear::correlation::mean;

/// Samples for each coefficient of the autoregression. They are fewer than for a fit's errors, as the fresh part is short; the tests in
/// `residuals_tests.rs` measure the levels with it.
const SAMPLES_PER_COEFFICIENT: usize = 20;
/// Added to a unit diagonal where the regressors nearly determine one another. Rounding, and more where that is not enough.
const RIDGES: [f64; 4] = [0.0, 1e-12, 1e-9, 1e-6];

/// A signal that is to be explained, whitened by an autoregression.
///
/// The regressors pass the same filter, which changes neither a linear relation nor its lags (generalised least squares).
pub(super) struct Regression {
    autoregression: Vec<f64>,
    whitened: Vec<f64>,
}

/// What a regression explains of a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Explained {
    /// The share of the squares about the mean, below 1.
    pub share: f64,
    /// The degrees of freedom that are left.
    pub rest: f64,
}

impl Regression {
    pub fn new(v: &[f64]) -> Regression {
        let autoregression = whitening(v, SAMPLES_PER_COEFFICIENT);
        Regression {
            whitened: filtered(v, &autoregression),
            autoregression,
        }
    }

    pub fn samples(&self) -> usize {
        self.whitened.len()
    }

    /// What a regression on lags 0 to `lags` of `w` and a constant explains.
    ///
    /// There are more than two samples a lag.
    pub fn explained_by_past(&self, w: &[f64], lags: usize) -> Explained {
        let w = filtered(w, &self.autoregression);
        let v = &self.whitened[lags..];
        let n = v.len();
        let size = lags + 1;
        let rest = n.saturating_sub(size + 1).max(1) as f64;
        let explained = |share| Explained { share, rest };
        let centre = mean(v);
        let squares: f64 = v.iter().map(|v| (v - centre).powi(2)).sum();
        // The level first, lest the means' products cancel most digits.
        let level = mean(&w);
        let w: Vec<f64> = w.iter().map(|w| w - level).collect();
        let lagged = |lag: usize| &w[lags - lag..w.len() - lag];
        let means: Vec<f64> = (0..size).map(|lag| mean(lagged(lag))).collect();
        let gram = gram(&w, lags);
        let covariance = |i: usize, j: usize| gram[i * size + j] - n as f64 * means[i] * means[j];
        let scale: Vec<f64> = (0..size).map(|i| covariance(i, i).max(0.0).sqrt()).collect();
        if !(squares > 0.0 && scale.iter().all(|s| *s > 0.0 && s.is_finite())) {
            return explained(0.0);
        }
        let with_v: Vec<f64> = (0..size)
            .map(|lag| {
                let products = lagged(lag).iter().zip(v).map(|(w, v)| w * (v - centre));
                products.sum::<f64>() / scale[lag]
            })
            .collect();
        for ridge in RIDGES {
            let entry = |k: usize| {
                let (i, j) = (k / size, k % size);
                covariance(i, j) / (scale[i] * scale[j]) + if i == j { ridge } else { 0.0 }
            };
            let matrix: Vec<f64> = (0..size * size).map(entry).collect();
            if let Some(slopes) = linalg::solve_positive_definite(&matrix, &with_v) {
                let share = slopes.iter().zip(&with_v).map(|(a, b)| a * b).sum::<f64>() / squares;
                return explained(share.clamp(0.0, 1.0 - f64::EPSILON));
            }
        }
        explained(0.0)
    }
}

/// $\sum_i r_i v_{n-i}$, the signal constant before it starts.
fn filtered(v: &[f64], r: &[f64]) -> Vec<f64> {
    let first = v.first().copied().unwrap_or(0.0);
    let past = |n: usize, i: usize| if n >= i { v[n - i] } else { first };
    (0..v.len())
        .map(|n| r.iter().enumerate().map(|(i, r)| r * past(n, i)).sum())
        .collect()
}

/// The products of lags 0 to `lags` of `w`, summed over the samples that have all lags; row-major.
///
/// One sample later is one product less and one more, so that only the first row is summed.
fn gram(w: &[f64], lags: usize) -> Vec<f64> {
    let (n, size) = (w.len(), lags + 1);
    let mut gram = vec![0.0; size * size];
    for j in 0..size {
        gram[j] = w[lags..].iter().zip(&w[lags - j..]).map(|(a, b)| a * b).sum();
    }
    for i in 1..size {
        gram[i * size] = gram[i];
        for j in 1..size {
            let before = gram[(i - 1) * size + j - 1];
            gram[i * size + j] = before + w[lags - i] * w[lags - j] - w[n - i] * w[n - j];
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn the_share_is_that_of_least_squares() {
        let (v, w) = (noise(90, 1), noise(90, 2));
        let v: Vec<f64> = (0..90).map(|n| 3.0 + v[n] + 0.5 * w[n.max(2) - 2]).collect();
        let white = Regression {
            autoregression: vec![1.0],
            whitened: v.clone(),
        };
        let lags = 4;
        let Explained { share, rest } = white.explained_by_past(&w.iter().map(|w| w + 7.0).collect::<Vec<_>>(), lags);
        assert_eq!(rest, 86.0 - 6.0);
        let rows: Vec<f64> = (lags..90)
            .flat_map(|n| (0..=lags).map(|k| w[n - k]).chain([1.0]).collect::<Vec<_>>())
            .collect();
        let slopes = linalg::least_squares(&rows, lags + 2, &v[lags..]).unwrap();
        let centre = mean(&v[lags..]);
        let left: f64 = (rows.chunks_exact(lags + 2).zip(&v[lags..]))
            .map(|(row, v)| (v - row.iter().zip(&slopes).map(|(a, b)| a * b).sum::<f64>()).powi(2))
            .sum();
        let all: f64 = v[lags..].iter().map(|v| (v - centre).powi(2)).sum();
        assert!(
            (share - (1.0 - left / all)).abs() < 1e-10,
            "{share} {}",
            1.0 - left / all
        );
        assert!(share > 0.1);
    }

    #[test]
    fn constants_and_signals_that_repeat_explain_without_failing() {
        let v = Regression::new(&noise(100, 3));
        assert_eq!(v.explained_by_past(&[2.0; 100], 5).share, 0.0);
        let alternating: Vec<f64> = (0..100).map(|i| f64::from(i % 2)).collect();
        let share = v.explained_by_past(&alternating, 5).share;
        assert!((0.0..0.2).contains(&share), "{share}");
        assert_eq!(
            Regression::new(&[1.0; 100]).explained_by_past(&alternating, 5).share,
            0.0
        );
    }
}
