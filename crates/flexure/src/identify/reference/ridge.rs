//! Ridge regression for all penalties at once, from the spectrum of the columns' correlations.

use super::super::block::Scale;
use super::limits::{CONSTANT_COLUMN, PENALTIES, PENALTY_FACTOR, SMALLEST_PENALTY};
use crate::linalg::{self, Eigen};
use crate::linear::least_squares::regression;
use crate::vectors::{add, dot};

/// The least-squares problem of a constant and columns; the penalty acts on columns of zero mean and unit variance.
pub(super) struct Ridge {
    columns: Vec<Scale>,
    /// The output's mean.
    level: f64,
    samples: f64,
    output_squares: f64,
    /// Eigenvalues of the columns' correlation matrix, times the samples; the eigenvectors one after the other.
    values: Vec<f64>,
    vectors: Vec<f64>,
    /// The products of output and columns in the eigenvectors' coordinates.
    products: Vec<f64>,
}

impl Ridge {
    /// The problem for the samples `from..`; `None` if there are no columns or the decomposition fails.
    pub fn new(columns: &[Vec<f64>], y: &[f64], from: usize) -> Option<Ridge> {
        let n = columns.len();
        let samples = y.len().checked_sub(from).filter(|s| *s > 1)? as f64;
        let ones = vec![1.0; y.len()];
        let mut all = columns.to_vec();
        all.push(ones);
        let equations = regression(y, &all, from);
        let (size, normal) = (n + 1, &equations.normal);
        let mean = |i: usize| normal[i * size + n] / samples;
        let covariance = |i: usize, j: usize| normal[i * size + j] / samples - mean(i) * mean(j);
        // A column without variance gets no coefficient.
        let spread = |i: usize| {
            let floor = CONSTANT_COLUMN * normal[i * size + i] / samples;
            let variance = Some(covariance(i, i)).filter(|v| *v > floor);
            variance.map_or(f64::INFINITY, f64::sqrt)
        };
        let scales = (0..n).map(|i| Scale {
            mean: mean(i),
            spread: spread(i),
        });
        let scales: Vec<Scale> = scales.collect();
        let level = equations.descent[n] / samples;
        let mut correlations = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                correlations[i * n + j] = samples * covariance(i, j) / (scales[i].spread * scales[j].spread);
            }
        }
        let Eigen { values, vectors } = linalg::symmetric_eigen(&correlations, n)?;
        let with_output: Vec<f64> = (0..n)
            .map(|i| (equations.descent[i] - samples * mean(i) * level) / scales[i].spread)
            .collect();
        let products = (vectors.chunks_exact(n)).map(|v| dot(v, &with_output)).collect();
        Some(Ridge {
            output_squares: equations.cost - samples * level * level,
            columns: scales,
            level,
            samples,
            values: values.iter().map(|v| v.max(0.0)).collect(),
            vectors,
            products,
        })
    }

    /// The penalties to try.
    fn penalties(&self) -> impl Iterator<Item = f64> {
        let first = SMALLEST_PENALTY * self.samples;
        (0..PENALTIES).map(move |i| first * PENALTY_FACTOR.powi(i as i32))
    }

    /// The penalty with the least generalised cross-validation score (Golub, Heath & Wahba 1979), and the larger ones.
    pub fn chosen(&self) -> Vec<f64> {
        let all: Vec<f64> = self.penalties().collect();
        let scores: Vec<f64> = all.iter().map(|p| self.score(*p)).collect();
        let best = (0..all.len())
            .min_by(|i, j| scores[*i].total_cmp(&scores[*j]))
            .unwrap_or(0);
        all[best..].to_vec()
    }

    /// Generalised cross-validation.
    fn score(&self, penalty: f64) -> f64 {
        let (mut explained, mut degrees) = (0.0, 1.0);
        for (value, product) in self.values.iter().zip(&self.products) {
            explained += product * product * (value + 2.0 * penalty) / (value + penalty).powi(2);
            degrees += value / (value + penalty);
        }
        let free = self.samples - degrees;
        if free > 0.0 {
            self.samples * (self.output_squares - explained).max(0.0) / free.powi(2)
        } else {
            f64::INFINITY
        }
    }

    /// The solution under this penalty.
    pub fn solve(&self, penalty: f64) -> Affine {
        let n = self.columns.len();
        let mut c = vec![0.0; n];
        for (k, vector) in self.vectors.chunks_exact(n).enumerate() {
            let weight = self.products[k] / (self.values[k] + penalty);
            add(&mut c, weight, vector);
        }
        c.iter_mut().zip(&self.columns).for_each(|(c, s)| *c /= s.spread);
        let at_means = c.iter().zip(&self.columns).map(|(c, s)| c * s.mean).sum::<f64>();
        Affine {
            constant: self.level - at_means,
            coefficients: c,
        }
    }
}

/// A constant, and a coefficient for every column.
pub(super) struct Affine {
    pub constant: f64,
    pub coefficients: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tiny_penalty_gives_least_squares_and_a_huge_one_the_mean() {
        let x: Vec<f64> = (0..50).map(|i| (0.7 * f64::from(i)).sin() + 3.0).collect();
        let z: Vec<f64> = x.iter().map(|x| x * x).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.0 - x + 0.5 * x * x).collect();
        let columns = [x, vec![4.0; 50], z];
        let ridge = Ridge::new(&columns, &y, 10).unwrap();
        let Affine {
            constant,
            coefficients: c,
        } = ridge.solve(1e-9);
        assert!((constant - 2.0).abs() < 1e-5, "{constant} {c:?}");
        assert!(
            (c[0] + 1.0).abs() < 1e-5 && c[1] == 0.0 && (c[2] - 0.5).abs() < 1e-5,
            "{c:?}"
        );
        let constant = ridge.solve(1e12).constant;
        let mean = y[10..].iter().sum::<f64>() / 40.0;
        assert!((constant - mean).abs() < 1e-6, "{constant} {mean}");
        assert!(ridge.chosen()[0] < 1e-6);
    }
}
