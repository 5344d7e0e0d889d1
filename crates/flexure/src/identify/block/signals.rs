//! The signals for the fit of a system, and Schwarz's criterion for its simulation errors, which need not be independent.

use super::limits::{ERROR_LAGS, FEWEST_ERRORS, LONGEST_START, SHORTEST_START};
use crate::linear::correlation::{cross_covariance, mean, variance};

/// A signal's mean and standard deviation.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Scale {
    pub mean: f64,
    pub spread: f64,
}

impl Scale {
    /// The scale of these samples.
    pub fn new(samples: &[f64]) -> Scale {
        Scale {
            mean: mean(samples),
            spread: variance(samples).sqrt(),
        }
    }

    /// A scaled value in the samples' own unit.
    pub fn back(&self, x: f64) -> f64 {
        self.mean + self.spread * x
    }

    /// The samples at zero mean and unit variance.
    pub fn standardised(&self, samples: &[f64]) -> Vec<f64> {
        samples.iter().map(|x| (x - self.mean) / self.spread).collect()
    }
}

/// Inputs and output at zero mean and unit variance. During the first samples, the initial state decays; they do not count.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Signals {
    pub u: Vec<Vec<f64>>,
    pub y: Vec<f64>,
    /// Samples from here on count.
    pub from: usize,
    /// This many samples carry as much information as one with an independent error.
    pub dependence: f64,
    /// The polynomial in the delay that errors pass before they count: 1, or the one that whitens them.
    pub filter: Vec<f64>,
}

impl Signals {
    /// All errors count unfiltered, and as independent of one another.
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

    /// The same samples; errors count after `filter`, and as independent of one another.
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

    /// The first samples, as many that `counted` of them count, or all.
    pub fn head(&self, counted: usize) -> Signals {
        let n = self.y.len().min(self.from.saturating_add(counted));
        Signals {
            u: self.u.iter().map(|u| u[..n].to_vec()).collect(),
            y: self.y[..n].to_vec(),
            filter: self.filter.clone(),
            ..*self
        }
    }

    /// Counts the samples from where responses have settled.
    pub fn count_after(&mut self, settling: usize) {
        let n = self.y.len();
        self.from = settling.clamp(n / SHORTEST_START, n / LONGEST_START);
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

    /// Schwarz's criterion of a sum of squares; the number of independent errors that the samples are worth replaces their number.
    pub fn bic(&self, squares: f64, parameters: usize) -> f64 {
        let samples = self.counted() as f64;
        let n = samples / self.dependence;
        n * (squares.max(f64::MIN_POSITIVE) / samples).ln() + parameters as f64 * n.ln()
    }

    /// Takes [`dependence`](Self::dependence) from the autocorrelation $\rho$ of the errors of an output: $1 + 2 \sum_j \rho_j^2$.
    ///
    /// A comparison of two models with errors of this autocorrelation varies as much as one with independent errors whose number is smaller
    /// by this factor (Bartlett 1946).
    pub fn set_dependence(&mut self, output: &[f64]) {
        let errors = output.iter().zip(&self.y).skip(self.from);
        let errors: Vec<f64> = errors.map(|(p, y)| p - y).collect();
        self.dependence = 1.0;
        if !(variance(&errors) > 0.0) {
            return;
        }
        let covariance = cross_covariance(&errors, &errors, ERROR_LAGS.min(errors.len() / 4));
        let noise = 1.0 / errors.len() as f64;
        let power = |r: &f64| ((r / covariance[0]).powi(2) - noise).max(0.0);
        let sum: f64 = covariance[1..].iter().map(power).sum();
        if sum.is_finite() {
            let most = (errors.len() as f64 / FEWEST_ERRORS).max(1.0);
            self.dependence = (1.0 + 2.0 * sum).min(most);
        }
    }
}

/// A signal at zero mean and unit variance; all zero if it does not vary.
pub(in crate::identify) fn standardised(v: &[f64]) -> Vec<f64> {
    let Scale { mean, spread } = Scale::new(v);
    let varies = spread > 0.0 && spread.is_finite();
    let scale = if varies { 1.0 / spread } else { 0.0 };
    v.iter().map(|x| scale * (x - mean)).collect()
}

/// A signal `lag` samples later, times `sign`; zero before its start.
pub(in crate::identify) fn delayed(of: &[f64], lag: usize, sign: f64) -> Vec<f64> {
    let rest = of.len() - lag.min(of.len());
    let zeros = std::iter::repeat_n(0.0, of.len() - rest);
    zeros.chain(of[..rest].iter().map(|v| sign * v)).collect()
}

/// $\sum_i b_i z^{-i}$ applied to a signal.
pub(in crate::identify) fn convolved(b: &[f64], signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    let mut output = vec![0.0; n];
    for (i, b) in b.iter().enumerate().take_while(|(i, _)| *i < n) {
        output[i..].iter_mut().zip(signal).for_each(|(y, v)| *y += b * v);
    }
    output
}

/// Adds a signal to a sum.
pub(super) fn add(sum: &mut [f64], more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
}
