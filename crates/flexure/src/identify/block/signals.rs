//! The signals that a system is fitted to.

use super::criterion;
use super::rational::convolved;

/// Inputs and output at zero mean and unit variance, the first samples of which only let the initial state decay.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Signals {
    pub u: Vec<Vec<f64>>,
    pub y: Vec<f64>,
    /// Samples from here on count.
    pub from: usize,
    /// This many of them carry as much information as one whose error is independent of the others'.
    pub dependence: f64,
    /// The polynomial in the delay that errors pass before they count: 1, or the one that whitens them.
    pub filter: Vec<f64>,
}

impl Signals {
    /// All errors count as they are, and as independent of one another.
    pub fn new(u: Vec<Vec<f64>>, y: Vec<f64>, from: usize) -> Signals {
        Signals {
            u,
            y,
            from,
            dependence: 1.0,
            filter: vec![1.0],
        }
    }

    /// [`new`](Self::new) for one input.
    pub fn of_input(u: Vec<f64>, y: Vec<f64>, from: usize) -> Signals {
        Signals::new(vec![u], y, from)
    }

    /// The first input.
    pub fn input(&self) -> &[f64] {
        self.u.first().map_or(&[], Vec::as_slice)
    }

    /// The same samples; errors count as `filter` leaves them, and as independent of one another.
    pub fn through(&self, filter: Vec<f64>) -> Signals {
        Signals {
            from: self.from.max(filter.len() - 1),
            filter,
            dependence: 1.0,
            ..self.clone()
        }
    }

    /// The number of samples that count.
    pub fn counted(&self) -> usize {
        self.y.len() - self.from
    }

    /// The first samples, `counted` of which count, or all.
    pub fn head(&self, counted: usize) -> Signals {
        let n = self.y.len().min(self.from.saturating_add(counted));
        Signals {
            u: self.u.iter().map(|u| u[..n].to_vec()).collect(),
            y: self.y[..n].to_vec(),
            filter: self.filter.clone(),
            ..*self
        }
    }

    /// The sum of squared errors of an output.
    pub fn squares(&self, output: &[f64]) -> f64 {
        let errors = output.iter().zip(&self.y).map(|(p, y)| p - y);
        if self.filter.len() == 1 {
            return errors.skip(self.from).map(|e| e * e).sum();
        }
        let errors: Vec<f64> = errors.collect();
        convolved(&self.filter, &errors)[self.from..]
            .iter()
            .map(|e| e * e)
            .sum()
    }

    /// Schwarz's criterion of a sum of squares; it counts as many independent errors as the samples are worth.
    pub fn bic(&self, squares: f64, parameters: usize) -> f64 {
        criterion::schwarz(squares, parameters, self.counted(), self.dependence)
    }

    /// Takes [`dependence`](Self::dependence) from the autocorrelation of the errors of an output.
    pub fn set_dependence(&mut self, output: &[f64]) {
        self.dependence = criterion::dependence(output, &self.y, self.from);
    }
}

/// A signal `lag` samples later, times `sign`; zero before its start.
pub(in crate::identify) fn delayed(of: &[f64], lag: usize, sign: f64) -> Vec<f64> {
    let rest = of.len() - lag.min(of.len());
    let zeros = std::iter::repeat_n(0.0, of.len() - rest);
    zeros.chain(of[..rest].iter().map(|v| sign * v)).collect()
}

/// Adds a signal to a sum.
pub(super) fn add(sum: &mut [f64], more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
}
