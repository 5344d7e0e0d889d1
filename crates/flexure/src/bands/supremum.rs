//! The quantile of the largest absolute value of a studentised process on a grid, by Gaussian multipliers
//! (Chernozhukov, Chetverikov & Kato 2014).
//!
//! Given the data, $T_j = \sum_i l_{ji} r_i \xi_i / s_j$ with standard normal $\xi_i$ is a Gaussian process with the
//! covariance that the estimates' errors have. Neighbouring points have nearly the same weights, so their
//! multipliers are drawn together: the points are put into cells of a small share of a bandwidth.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::{seed_of, upper_quantile};
use crate::parallel;
use crate::vectors::dot;

/// The weights of one point of the grid: those of the sources from `first` on.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub first: usize,
    pub weights: Vec<f64>,
}

impl Row {
    /// Scales the row to unit variance; without a variance, an empty row, which never counts.
    pub fn standardised(mut self) -> Self {
        let norm = self.weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        if norm > 0.0 && norm.is_finite() {
            self.weights.iter_mut().for_each(|w| *w /= norm);
        } else {
            self.weights.clear();
        }
        self
    }
}

/// The quantile of max_j |sum_c row_jc xi_c| over `sources` independent standard normal xi, from `draws` draws.
pub(super) fn quantile(rows: &[Row], sources: usize, level: f64, draws: usize, seed: u64) -> f64 {
    let mut maxima = parallel::map(draws, |draw| {
        let mut rng = Pcg64::seed_from_u64(seed_of(seed, draw));
        let xi: Vec<f64> = (0..sources).map(|_| StandardNormal.sample(&mut rng)).collect();
        rows.iter()
            .map(|row| dot(&row.weights, &xi[row.first..]).abs())
            .fold(0.0, f64::max)
    });
    upper_quantile(&mut maxima, level)
}
