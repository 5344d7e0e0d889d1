//! Does the past of one signal say something about another? A linear regression for signals of any colour.

use crate::linear::autoregression::whitening;
use crate::linear::correlation::{about_mean, mean};
use crate::linear::least_squares::{NormalEquations, UnitDiagonal};
use crate::vectors::dot;

/// Samples for each coefficient of the autoregression. There are fewer than for a fit's errors, as the fresh part is short; the tests in
/// `residuals_tests.rs` measure the levels with it.
const SAMPLES_PER_COEFFICIENT: usize = 20;

/// The signal to be explained, whitened by an autoregression.
///
/// The regressors pass the same filter, which changes neither a linear relation nor its lags (generalised least squares).
pub(super) struct Regression<'a> {
    original: &'a [f64],
    autoregression: Vec<f64>,
    whitened: Vec<f64>,
}

/// The part of a signal that a regression explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Explained {
    /// The explained share of the whitened signal's sum of squares about its mean, below 1.
    pub share: f64,
    /// The explained share of the signal itself: the same slopes, applied to the regressors before the filter, have this share of the
    /// signal's squares about its mean. It equals `share` if the signal is white.
    pub part: f64,
    /// The degrees of freedom of the rest.
    pub rest: f64,
}

impl<'a> Regression<'a> {
    pub fn new(v: &'a [f64]) -> Regression<'a> {
        let autoregression = whitening(v, SAMPLES_PER_COEFFICIENT);
        Regression {
            original: v,
            whitened: filtered(v, &autoregression),
            autoregression,
        }
    }

    pub fn samples(&self) -> usize {
        self.whitened.len()
    }

    /// The signal before the filter.
    pub fn original(&self) -> &[f64] {
        self.original
    }

    /// The whitened signal.
    pub fn whitened(&self) -> &[f64] {
        &self.whitened
    }

    /// The order of the autoregression.
    pub fn order(&self) -> usize {
        self.autoregression.len() - 1
    }

    /// The filter is undone for `whitened`, which belongs to the last samples. Returns its share in the signal's sum of squares about the
    /// mean at these samples.
    pub fn share_of_original(&self, whitened: &[f64]) -> f64 {
        let mut part: Vec<f64> = Vec::with_capacity(whitened.len());
        for v in whitened {
            let past = part.iter().rev().zip(&self.autoregression[1..]);
            part.push(v - past.map(|(p, a)| a * p).sum::<f64>());
        }
        let all = squares_about_mean(&self.original[self.original.len() - whitened.len()..]);
        if all > 0.0 {
            squares_about_mean(&part) / all
        } else {
            0.0
        }
    }

    /// The covariance of the whitened signal with `signal` through the same filter, times the number of samples.
    pub fn covariance(&self, signal: &[f64]) -> f64 {
        let signal = about_mean(&filtered(signal, &self.autoregression));
        dot(&about_mean(&self.whitened), &signal)
    }

    /// The part that a regression on lags 0 to `lags` of `w` and a constant explains.
    ///
    /// There must be more than two samples for each lag.
    pub fn explained_by_past(&self, signal: &[f64], lags: usize) -> Explained {
        let w = filtered(signal, &self.autoregression);
        let v = &self.whitened[lags..];
        let n = v.len();
        let size = lags + 1;
        let rest = n.saturating_sub(size + 1).max(1) as f64;
        let nothing = Explained {
            share: 0.0,
            part: 0.0,
            rest,
        };
        let centre = mean(v);
        // The level is subtracted first: otherwise products of the means would cost most digits.
        let w = about_mean(&w);
        let lagged = |lag: usize| &w[lags - lag..w.len() - lag];
        let means: Vec<f64> = (0..size).map(|lag| mean(lagged(lag))).collect();
        let gram = gram(&w, lags);
        let covariance = |k: usize| gram[k] - n as f64 * means[k / size] * means[k % size];
        let with_v = |lag: usize| lagged(lag).iter().zip(v).map(|(w, v)| w * (v - centre)).sum();
        let equations = NormalEquations {
            cost: squares_about_mean(v),
            descent: (0..size).map(with_v).collect(),
            normal: (0..size * size).map(covariance).collect(),
        };
        let varies = |i: usize| equations.normal[i * size + i] > 0.0 && equations.normal[i * size + i].is_finite();
        if !(equations.cost > 0.0 && (0..size).all(varies)) {
            return nothing;
        }
        match UnitDiagonal::new(&equations).ridged_solution(&equations.descent) {
            None => nothing,
            Some(slopes) => Explained {
                share: (dot(&slopes, &equations.descent) / equations.cost).clamp(0.0, 1.0 - f64::EPSILON),
                part: self.part(signal, &slopes),
                rest,
            },
        }
    }

    /// The share of the signal's squares about its mean that lags 0, 1, ... of `w` with these slopes explain.
    fn part(&self, w: &[f64], slopes: &[f64]) -> f64 {
        let lags = slopes.len() - 1;
        let level = mean(w);
        let products = |end: usize| {
            slopes
                .iter()
                .enumerate()
                .map(move |(lag, b)| b * (w[end - lag] - level))
        };
        let fitted: Vec<f64> = (lags..w.len()).map(|end| products(end).sum()).collect();
        let all = squares_about_mean(&self.original[lags..]);
        if all > 0.0 {
            squares_about_mean(&fitted) / all
        } else {
            0.0
        }
    }
}

fn squares_about_mean(v: &[f64]) -> f64 {
    let centre = mean(v);
    v.iter().map(|v| (v - centre).powi(2)).sum()
}

/// $\sum_i r_i v_{n-i}$, where the signal is constant before its start.
fn filtered(v: &[f64], r: &[f64]) -> Vec<f64> {
    let first = v.first().copied().unwrap_or(0.0);
    let past = |n: usize, i: usize| if n >= i { v[n - i] } else { first };
    (0..v.len())
        .map(|n| r.iter().enumerate().map(|(i, r)| r * past(n, i)).sum())
        .collect()
}

/// The products of lags 0 to `lags` of `w`, summed over the samples that have all lags; row-major.
///
/// One lag more on both sides drops one product and adds one, so only the first row is summed.
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
    use crate::linalg;

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn the_share_is_that_of_least_squares() {
        let (v, w) = (noise(90, 1), noise(90, 2));
        let v: Vec<f64> = (0..90).map(|n| 3.0 + v[n] + 0.5 * w[n.max(2) - 2]).collect();
        let white = Regression {
            original: &v,
            autoregression: vec![1.0],
            whitened: v.clone(),
        };
        let lags = 4;
        let Explained { share, part, rest } =
            white.explained_by_past(&w.iter().map(|w| w + 7.0).collect::<Vec<_>>(), lags);
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
        assert!((part - share).abs() < 1e-10, "{part} {share}");
    }

    #[test]
    fn constants_and_signals_that_repeat_explain_without_failing() {
        let signal = noise(100, 3);
        let v = Regression::new(&signal);
        assert_eq!(v.explained_by_past(&[2.0; 100], 5).share, 0.0);
        let alternating: Vec<f64> = (0..100).map(|i| f64::from(i % 2)).collect();
        let share = v.explained_by_past(&alternating, 5).share;
        assert!((0.0..0.2).contains(&share), "{share}");
        assert_eq!(
            Regression::new(&[1.0; 100]).explained_by_past(&alternating, 5).share,
            0.0
        );
    }

    #[test]
    fn the_part_is_that_of_the_signal_before_the_filter() {
        // A slow signal and white noise that is hardly a tenth of it; a filter that takes the slow one away.
        let n = 40_000;
        let mut slow = 0.0;
        let w: Vec<f64> = noise(n, 5)
            .iter()
            .map(|e| {
                slow = 0.99 * slow + 0.1 * e;
                slow
            })
            .collect();
        let e = noise(n, 6);
        let v: Vec<f64> = (0..n).map(|i| w[i] + 0.1 * e[i]).collect();
        let regression = Regression {
            original: &v,
            autoregression: vec![1.0, -0.99],
            whitened: filtered(&v, &[1.0, -0.99]),
        };
        let Explained { share, part, .. } = regression.explained_by_past(&w, 3);
        let truth = squares_about_mean(&w) / squares_about_mean(&v);
        // The slopes' standard error is about 1 %, and the part grows with their square.
        assert!((part - truth).abs() < 0.05 && truth > 0.9, "{part} {truth}");
        assert!(share < 0.8, "{share}");
    }
}
