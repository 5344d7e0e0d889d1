//! The linear part as a filter over several experiments.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::linear::TransferFunction;

/// B(z)/A(z) after a delay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct LinearPart {
    pub transfer: TransferFunction,
    pub delay: usize,
}

impl LinearPart {
    /// From the coefficients of B and those of A from the first on: b_0, b_1, ... and a_1, a_2, ...
    pub fn new(b: &[f64], a: &[f64], delay: usize) -> LinearPart {
        LinearPart {
            transfer: TransferFunction::monic(b.to_vec(), a.to_vec()),
            delay,
        }
    }

    /// A filter without poles.
    pub fn moving_average(r: &[f64]) -> LinearPart {
        LinearPart::new(r, &[], 0)
    }

    pub fn b(&self) -> &[f64] {
        self.transfer.b()
    }

    /// a_1, a_2, ...
    pub fn a(&self) -> &[f64] {
        &self.transfer.a()[1..]
    }

    /// This filter, followed by a moving average.
    pub fn then(&self, r: &[f64]) -> LinearPart {
        LinearPart::new(&polynomial_product(self.b(), r), self.a(), self.delay)
    }

    /// The response to x within each experiment, from rest.
    pub fn filter(&self, experiments: &[Range<usize>], x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for part in experiments.iter().filter(|p| p.len() > self.delay) {
            let response = self.transfer.simulate(&x[part.start..part.end - self.delay]);
            y[part.start + self.delay..part.end].copy_from_slice(&response);
        }
        y
    }

    /// The adjoint of [`filter`](Self::filter): the same in reversed time.
    pub fn filter_back(&self, experiments: &[Range<usize>], x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let reversed: Vec<f64> = x.iter().rev().copied().collect();
        let experiments: Vec<Range<usize>> = experiments.iter().map(|p| n - p.end..n - p.start).collect();
        let mut y = self.filter(&experiments, &reversed);
        y.reverse();
        y
    }
}

/// The product of two polynomials.
pub(super) fn polynomial_product(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::dot;

    fn wave(n: usize, rate: f64) -> Vec<f64> {
        (0..n).map(|i| ((i * i) as f64 * rate).sin()).collect()
    }

    #[test]
    fn the_backward_filter_is_the_adjoint() {
        let (x, y) = (wave(300, 0.013), wave(300, 0.029));
        let experiments = [0..120, 120..121, 121..300];
        let g = LinearPart::new(&[0.5, -0.3, 0.2], &[-1.1, 0.4], 2);
        let forward = dot(&g.filter(&experiments, &x), &y);
        let backward = dot(&x, &g.filter_back(&experiments, &y));
        assert!(
            (forward - backward).abs() < 1e-10 * forward.abs().max(1.0),
            "{forward} {backward}"
        );
    }
}
