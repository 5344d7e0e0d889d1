//! From least squares to generalised least squares, if the error is coloured noise.
//!
//! Least squares minimises the simulation error. Under coloured noise this is consistent but not efficient: the estimation error is larger
//! than necessary, most of all if the input is weak. Least squares of the error after the autoregression that whitens it (Ljung 1999,
//! section 15.2; Aitken 1936) is efficient. Only for efficient estimates, each parameter costs one noise variance on fresh data
//! ([`Estimated`](crate::validation::Estimated)).
//!
//! A coloured error may also come from dynamics that the structure lacks. The whitened estimate then differs from the one that is best
//! for simulation. The test of Hausman (1978) decides: for a true model both estimates are consistent, and they differ by no more than
//! their covariances allow. If they differ by more, the least-squares estimate is kept.

use super::descent::{Minimum, Residuals, Whitened, descend};
use super::limits::{EFFICIENT, EFFICIENT_LEVEL};
use super::monitor::Monitor;
use crate::distributions::chi_squared_quantile;
use crate::linear::TransferFunction;
use crate::linear::autoregression::{SAMPLES_PER_COEFFICIENT, whitening};
use crate::linear::least_squares::{UnitDiagonal, normal_equations};
use crate::linear::levenberg_marquardt::Linearisation;
use crate::parallel;
use crate::vectors::add;

/// The parameters of generalised least squares, started from those of least squares, and their sum of squared simulation errors.
/// `None` if `at` is kept: its error is white, or the sum rises by more than a true model would explain.
pub(in crate::identify) fn efficient(
    problem: &impl Residuals,
    at: &[f64],
    monitor: &mut Monitor<'_>,
) -> Option<Minimum> {
    let from = problem.from();
    let squares = |e: &[f64]| e[from..].iter().map(|e| e * e).sum::<f64>();
    let before = problem.residuals(at)?;
    let filter = whitening_filter(problem, &before)?;
    if !monitor.keep_on() {
        return None;
    }
    let whitened = Whitened {
        problem,
        filter: &filter,
    };
    let limit = whitened.largest_rise(at)?;
    let parameters = descend(&whitened, at.to_vec(), EFFICIENT, monitor)?.parameters;
    let after = squares(&problem.residuals(&parameters)?);
    (after - squares(&before) <= limit).then_some(Minimum {
        parameters,
        squares: after,
    })
}

/// The autoregression that whitens the residuals of a problem; `None` if they are white.
pub(in crate::identify) fn whitening_filter(problem: &impl Residuals, residuals: &[f64]) -> Option<Vec<f64>> {
    let filter = whitening(&residuals[problem.from()..], SAMPLES_PER_COEFFICIENT);
    (filter.len() > 1).then_some(filter)
}

impl<P> Whitened<'_, P> {
    /// Columns with the colour of the error.
    pub fn coloured(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let colour = TransferFunction::monic(vec![1.0], self.filter[1..].to_vec());
        parallel::batch(columns, |column| colour.simulate(column))
    }
}

impl<P: Residuals> Whitened<'_, P> {
    /// For a true model: how much the sum of squared simulation errors may rise from least squares (which ended in `at`) to generalised
    /// least squares; `None` if a Gauss-Newton step already rises by more.
    ///
    /// The rise is d'Gd, with G = J'J and the estimates' difference d. Its covariance is that of least squares minus that of the efficient
    /// estimate, $\sigma^2 (G^{-1} M G^{-1} - W^{-1})$ with the normal matrices M of the columns coloured as the noise and W of the
    /// whitened ones. A weighted sum of squares is nearly a chi-squared variable with other degrees of freedom times a factor
    /// (Satterthwaite 1946).
    fn largest_rise(&self, at: &[f64]) -> Option<f64> {
        let plain = self.problem.linearise(at);
        let white = self.whitened(&plain);
        let Linearisation { residuals, jacobian } = plain;
        let (from, n) = (self.from(), jacobian.len());
        let plain = normal_equations(&residuals, &jacobian, from);
        let white = normal_equations(&white.residuals, &white.jacobian, from);
        let coloured = normal_equations(&residuals, &self.coloured(&jacobian), from);
        let degrees = (residuals.len() - from).checked_sub(n).filter(|degrees| *degrees > 0)?;
        let variance = white.cost / degrees as f64;
        let [by_plain, by_white] = [&plain, &white].map(|equations| UnitDiagonal::new(equations).inverse());
        let (by_plain, by_white) = (by_plain?, by_white?);
        // G times the covariance of d, in units of the noise's variance.
        let (worse, better) = (
            matrix_product(&by_plain, &coloured.normal, n),
            matrix_product(&by_white, &plain.normal, n),
        );
        let excess: Vec<f64> = worse.iter().zip(&better).map(|(w, b)| w - b).collect();
        let mean = (0..n).map(|i| excess[i * n + i]).sum::<f64>();
        let power: f64 = (0..n * n).map(|k| excess[k] * excess[k % n * n + k / n]).sum();
        if !(mean > 0.0 && power > 0.0 && mean.is_finite() && power.is_finite()) {
            return None;
        }
        let limit = variance * power / mean * chi_squared_quantile(1.0 - EFFICIENT_LEVEL, mean * mean / power);
        let step = matrix_product(&by_white, &white.descent, n);
        let rise: f64 = matrix_product(&plain.normal, &step, n)
            .iter()
            .zip(&step)
            .map(|(g, d)| g * d)
            .sum();
        (rise <= limit).then_some(limit)
    }
}

/// A matrix of `n` columns times one of `n` rows, or times a vector.
pub(in crate::identify) fn matrix_product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let columns = b.len() / n.max(1);
    let mut product = vec![0.0; a.len() / n.max(1) * columns];
    for (row, a) in product.chunks_exact_mut(columns.max(1)).zip(a.chunks_exact(n.max(1))) {
        for (a, b) in a.iter().zip(b.chunks_exact(columns.max(1))) {
            add(row, *a, b);
        }
    }
    product
}

#[cfg(test)]
#[path = "efficient_tests.rs"]
mod tests;
