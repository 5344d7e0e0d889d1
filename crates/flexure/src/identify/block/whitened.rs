//! Residuals through a polynomial in the delay, such as the autoregression that whitens them.

use rayon::prelude::*;

use super::descent::{Residuals, descend};
use super::monitor::Monitor;
use super::rational::convolved;

/// Residuals through an autoregression, to be minimised as those without it.
pub(super) struct Whitened<'a, P> {
    pub problem: &'a P,
    /// Monic, in powers of the delay.
    pub filter: &'a [f64],
}

/// [`descend`] on the residuals through a monic polynomial, 1 for the residuals themselves.
pub(in crate::identify) fn descend_through(
    filter: &[f64],
    problem: &impl Residuals,
    start: Vec<f64>,
    iterations: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Option<(Vec<f64>, f64)> {
    if filter.len() == 1 {
        return descend(problem, start, iterations, tolerance, monitor);
    }
    descend(&Whitened { problem, filter }, start, iterations, tolerance, monitor)
}

impl<P: Residuals> Residuals for Whitened<'_, P> {
    fn from(&self) -> usize {
        self.problem.from().max(self.filter.len() - 1)
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        Some(convolved(self.filter, &self.problem.residuals(parameters)?))
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (residuals, jacobian) = self.problem.linearise(parameters);
        (convolved(self.filter, &residuals), self.through(&jacobian))
    }
}

impl<P> Whitened<'_, P> {
    /// The columns through the polynomial.
    pub fn through(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        columns.par_iter().map(|c| convolved(self.filter, c)).collect()
    }
}
