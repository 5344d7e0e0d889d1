//! Normal equations, scaled so that their diagonal is one, and their covariance.

use super::limits::RIDGE;
use crate::linalg::{Cholesky, Matrix};

/// The square roots of the diagonal entries of a matrix, 1 where there is none.
pub(super) fn scales(matrix: &Matrix) -> Vec<f64> {
    let roots = matrix.diagonal().map(f64::sqrt);
    let usable = |s: &f64| if *s > 0.0 && s.is_finite() { *s } else { 1.0 };
    roots.iter().map(usable).collect()
}

/// A matrix with its rows and columns divided by these scales.
pub(super) fn scaled(matrix: &Matrix, scale: &[f64]) -> Matrix {
    let n = scale.len();
    Matrix::from_fn(n, n, |i, j| matrix[(i, j)] / (scale[i] * scale[j]))
}

/// A matrix with this added to its diagonal.
pub(super) fn ridged(mut matrix: Matrix) -> Matrix {
    (0..matrix.nrows()).for_each(|i| matrix[(i, i)] += RIDGE);
    matrix
}

/// Normal equations whose matrix is scaled to a diagonal of ones plus [`RIDGE`].
pub(super) struct Normal {
    factors: Cholesky,
    scale: Vec<f64>,
}

impl Normal {
    /// The equations of columns with these inner products; `None` if they are not independent in double precision.
    pub fn new(products: &Matrix) -> Option<Self> {
        let scale = scales(products);
        let factors = ridged(scaled(products, &scale)).cholesky()?;
        Some(Normal { factors, scale })
    }

    /// The factors of the columns for each column of moments; `None` if they are not finite.
    pub fn solve(&self, moments: &Matrix) -> Option<Matrix> {
        let mut x = moments.clone();
        self.unscale(&mut x);
        self.factors.solve_mut(&mut x);
        self.unscale(&mut x);
        x.iter().all(|v| v.is_finite()).then_some(x)
    }

    fn unscale(&self, rows: &mut Matrix) {
        for (mut row, scale) in rows.row_iter_mut().zip(&self.scale) {
            row /= *scale;
        }
    }

    /// The covariance of the unknowns: the inverse of the normal matrix.
    pub fn covariance(&self) -> Option<Covariance> {
        let inverse = scaled(&self.factors.inverse().transpose(), &self.scale);
        inverse.iter().all(|v| v.is_finite()).then_some(Covariance(inverse))
    }
}

/// The covariance matrix of unknowns.
#[derive(Debug, Clone)]
pub(super) struct Covariance(pub Matrix);

/// An unknown in a sum, with its factor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub unknown: usize,
    pub factor: f64,
}

impl Covariance {
    /// The covariance of two unknowns.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.0[(i, j)]
    }

    /// The standard error of an unknown.
    pub fn error(&self, i: usize) -> f64 {
        self.at(i, i).max(0.0).sqrt()
    }

    /// The standard error of a sum of unknowns.
    pub fn error_of_sum(&self, parts: &[Part]) -> f64 {
        let pairs = parts.iter().flat_map(|a| parts.iter().map(move |b| (a, b)));
        let variance: f64 = pairs
            .map(|(a, b)| a.factor * b.factor * self.at(a.unknown, b.unknown))
            .sum();
        variance.max(0.0).sqrt()
    }
}
