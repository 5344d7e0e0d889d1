//! How well a fit to the first part of a record predicts the rest in a free run.

use super::super::block::{Monitor, Signals, convolved};
use super::fit::{Criterion, Start};
use super::limits::{COMPARED_BLOCKS, HELD_BACK, NEGLIGIBLE_ERROR, PART, WORSE_T};
use super::system::{LinearSystem, Orders, head};
use crate::linear::correlation::{mean, variance};

/// The errors of free runs on samples that were not fitted.
#[derive(Debug, Clone)]
pub struct HeldBack {
    pub plain: Errors,
    /// Those through the polynomial that whitens the noise, if it is coloured.
    pub filtered: Option<Errors>,
}

/// Errors on samples that were not fitted.
#[derive(Debug, Clone, Default)]
pub struct Errors {
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
    /// The errors of systems with the orders of `whole`, which is fitted to all samples from `start`. So is the colour of the noise.
    /// `None` if a part does not determine one.
    pub fn new(
        orders: &Orders,
        criterion: Criterion,
        whole: &LinearSystem,
        start: Start<'_>,
        data: &Signals,
        monitor: &mut Monitor<'_>,
    ) -> Option<HeldBack> {
        let mut plain = Errors::default();
        let mut filtered = start.high_order.map(|_| Errors::default());
        for (k, share) in HELD_BACK.into_iter().enumerate() {
            let fitted = fitted_samples(share, data.y.len());
            let near = start.near(whole);
            let system = criterion.fitted(orders, &head(data, fitted), near, PART, monitor)?;
            let output = system.run(&data.u);
            let errors: Vec<f64> = output.iter().zip(&data.y).map(|(p, y)| p - y).collect();
            let next = HELD_BACK
                .get(k + 1)
                .map_or(data.y.len(), |next| fitted_samples(*next, data.y.len()));
            plain.add(&errors[fitted..], next - fitted);
            if let (Some(filtered), Some(high_order)) = (&mut filtered, start.high_order) {
                filtered.add(&convolved(&high_order.whitener, &errors)[fitted..], next - fitted);
            }
        }
        let is_finite = plain.score.is_finite() && filtered.as_ref().is_none_or(|f| f.score.is_finite());
        is_finite.then_some(HeldBack { plain, filtered })
    }

    /// The errors that decide between systems whose free runs are about equally good.
    pub fn deciding(&self) -> &Errors {
        self.filtered.as_ref().unwrap_or(&self.plain)
    }
}

impl Errors {
    /// Adds the errors of a fit on all samples after its own. The `first` of them are not samples of later fits.
    fn add(&mut self, errors: &[f64], first: usize) {
        let squares: Vec<f64> = errors.iter().map(|e| e.powi(2)).collect();
        self.score += (mean(&squares) + NEGLIGIBLE_ERROR).ln() / HELD_BACK.len() as f64;
        self.squares.extend(&squares[..first]);
    }

    /// Whether these errors are as good as those of `best`, whose sum is smaller: the samples show no significant difference.
    pub fn as_good_as(&self, best: &Errors, tolerated: f64) -> bool {
        if !(self.score <= best.score + tolerated.ln()) {
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
