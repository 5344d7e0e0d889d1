//! How well a fit to the first part of a record predicts the rest in a free run.

use super::super::block::{Monitor, Signals};
use super::fit::Criterion;
use super::limits::{COMPARED_BLOCKS, HELD_BACK, NEGLIGIBLE_ERROR, PART, TOLERATED_RATIO, WORSE_T};
use super::system::{LinearSystem, Orders, head};
use crate::linear::correlation::{mean, variance};

/// The errors of free runs on samples that were not fitted.
#[derive(Debug, Clone)]
pub struct HeldBack {
    /// The mean logarithm of the mean squared error of every fit on all samples after its own.
    pub score: f64,
    /// The squared error of every sample after the first part, by the last fit that has not seen it.
    squares: Vec<f64>,
}

/// The number of samples in a fit to the first part.
pub fn fitted_samples(share: f64, samples: usize) -> usize {
    (share * samples as f64) as usize
}

impl HeldBack {
    /// The errors of systems with the orders of `whole`, which is fitted to all samples; `None` if a part does not determine one.
    pub fn new(
        orders: &Orders,
        criterion: Criterion,
        whole: &LinearSystem,
        data: &Signals,
        monitor: &mut Monitor<'_>,
    ) -> Option<HeldBack> {
        let mut score = 0.0;
        let mut squares = Vec::new();
        for (k, share) in HELD_BACK.into_iter().enumerate() {
            let fitted = fitted_samples(share, data.y.len());
            let system = criterion.fitted(orders, &head(data, fitted), Some(whole), PART, monitor)?;
            let output = system.run(&data.u);
            let errors: Vec<f64> = (output.iter().zip(&data.y).skip(fitted))
                .map(|(p, y)| (p - y).powi(2))
                .collect();
            score += (mean(&errors) + NEGLIGIBLE_ERROR).ln() / HELD_BACK.len() as f64;
            let next = HELD_BACK
                .get(k + 1)
                .map_or(data.y.len(), |next| fitted_samples(*next, data.y.len()));
            squares.extend(&errors[..next - fitted]);
        }
        score.is_finite().then_some(HeldBack { score, squares })
    }

    /// Whether these errors are as good as those of `best`, whose sum is smaller: the samples show no significant difference.
    pub fn as_good_as(&self, best: &HeldBack) -> bool {
        if !(self.score <= best.score + TOLERATED_RATIO.ln()) {
            return false;
        }
        let differences: Vec<f64> = self.squares.iter().zip(&best.squares).map(|(s, b)| s - b).collect();
        let size = differences.len().div_ceil(COMPARED_BLOCKS).max(1);
        let means: Vec<f64> = differences.chunks(size).map(mean).collect();
        let error = (variance(&means) / (means.len() as f64 - 1.0)).sqrt();
        // Without a finite error there is nothing to compare.
        !(mean(&means) > WORSE_T * error)
    }
}
