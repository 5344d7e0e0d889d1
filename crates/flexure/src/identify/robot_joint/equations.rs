//! Weighted least squares over complex equations with real unknowns.
//!
//! Each equation of motion is a block of complex equations, one a frequency (a "line"):
//!
//! $$ \sum_j a_{bj}(\omega)\, x_j = r_b(\omega) + e_b(\omega), \qquad \mathrm{E}\,|e_b(\omega)|^2 = s_b(\omega). $$
//!
//! The solution minimises the sum of $2 |e_b|^2 / s_b$, as the real and the imaginary part each have half of the noise. Where
//! columns are noisy themselves, the mean of what their noise adds to the normal equations is taken off first.

use super::column_noise::{Excess, Noisy};
use super::covariance::Covariance;
use crate::interrupt;
use crate::linalg::{self, Complex};
use crate::parallel;

/// Added to the diagonal of the scaled normal equations: directions that the data do not determine stay finite.
pub(super) const RIDGE: f64 = 1e-10;

/// The lines of one signal.
pub(super) type Lines = Vec<Complex<f64>>;

/// A column with an unknown factor: its lines in each block of equations, or none.
pub(super) type Column = Vec<Option<Lines>>;

/// Stacked blocks of complex equations `sum_j columns[j] x_j = right`.
pub(super) struct Equations<'a> {
    pub columns: Vec<Column>,
    /// The right-hand side of each block.
    pub right: Vec<Lines>,
    /// The mean square of the noise in each line of each block.
    pub noise: Vec<&'a [f64]>,
    /// The noise that columns share with themselves and with each other.
    pub noisy: Vec<Noisy<'a>>,
}

/// The weighted inner products of columns without the part that the columns' noise adds.
pub(super) struct Gram {
    /// Row-major.
    pub products: Vec<f64>,
    /// The part that was taken off.
    pub excess: Excess,
}

/// A least-squares solution.
#[derive(Clone)]
pub(super) struct Solution {
    /// The unknowns.
    pub x: Vec<f64>,
    /// Their covariance if the noise is as it was given.
    pub covariance: Covariance,
    /// Right-hand side less columns times unknowns, block by block.
    pub residuals: Vec<Lines>,
    /// The weighted sum of squares of the residuals.
    pub squares: f64,
    /// That sum less the noise of the columns in it: what the solution minimises.
    pub objective: f64,
}

impl Solution {
    /// The number of lines of all blocks.
    pub fn lines(&self) -> usize {
        self.residuals.iter().map(Vec::len).sum()
    }
}

impl Equations<'_> {
    /// The same with a further column, which comes last.
    pub fn with_column(mut self, column: Column) -> Self {
        self.columns.push(column);
        self
    }

    /// The weights of each line of each block.
    pub fn weights(&self) -> Vec<Vec<f64>> {
        self.noise.iter().map(|s| s.iter().map(|s| 2.0 / s).collect()).collect()
    }

    /// The inner products of all columns with these weights, row-major.
    pub fn products(&self, weights: &[Vec<f64>]) -> Vec<f64> {
        let n = self.columns.len();
        let scaled: Vec<Vec<Option<Vec<f64>>>> = parallel::batch(&self.columns, |c| weighted(weights, c));
        let rows: Vec<Vec<f64>> = parallel::map(n, |i| {
            let row = &scaled[i];
            let with = |column: &Vec<Option<Vec<f64>>>| -> f64 {
                let blocks = row.iter().zip(column);
                blocks.filter_map(|(a, b)| Some(dot(a.as_ref()?, b.as_ref()?))).sum()
            };
            scaled[..=i].iter().map(with).collect()
        });
        let mut products = vec![0.0; n * n];
        for (i, row) in rows.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                products[i * n + j] = *v;
                products[j * n + i] = *v;
            }
        }
        products
    }

    /// The inner products without the columns' noise. No sum of the first `unknown` columns loses more than half of its square.
    ///
    /// All long work on equations of motion passes here: `None` if it was asked to stop.
    pub fn gram(&self, unknown: usize) -> Option<Gram> {
        if interrupt::requested() {
            return None;
        }
        let weights = self.weights();
        let products = self.products(&weights);
        let mut excess = Excess::new(&self.noisy, &weights);
        Some(Gram {
            products: excess.off(&products, self.columns.len(), unknown),
            excess,
        })
    }

    /// The weighted inner products of the columns with the right-hand side.
    pub fn moments(&self) -> Vec<f64> {
        let weights = self.weights();
        let product = |column: &Column| -> f64 {
            let blocks = weights.iter().zip(column.iter().zip(&self.right));
            blocks
                .map(|(w, (column, right))| {
                    let Some(column) = column else { return 0.0 };
                    let lines = w.iter().zip(column.iter().zip(right));
                    lines.map(|(w, (a, b))| w * (a.re * b.re + a.im * b.im)).sum()
                })
                .sum()
        };
        parallel::batch(&self.columns, product)
    }

    /// The weighted least-squares solution; `None` if the equations do not determine it in double precision, or if the work was
    /// asked to stop.
    pub fn solve(&self) -> Option<Solution> {
        let n = self.columns.len();
        let gram = self.gram(n)?;
        let moment = self.moments();
        let scaled = Scaled::new(&gram.products, n, n);
        let x = scaled.solve(&moment)?;
        let covariance = scaled.inverse()?;
        let residuals = self.residuals(&x);
        let weights = self.weights();
        let squares: f64 = weights
            .iter()
            .zip(&residuals)
            .map(|(w, r)| w.iter().zip(r).map(|(w, r)| w * r.norm_sqr()).sum::<f64>())
            .sum();
        Some(Solution {
            objective: squares - gram.excess.square(&x),
            covariance: Covariance::new(covariance, n),
            x,
            residuals,
            squares,
        })
    }

    /// The right-hand sides less the columns times these unknowns.
    pub fn residuals(&self, x: &[f64]) -> Vec<Lines> {
        let mut residuals = self.right.clone();
        for (column, x) in self.columns.iter().zip(x) {
            for (block, residual) in column.iter().zip(&mut residuals) {
                if let Some(lines) = block {
                    residual.iter_mut().zip(lines).for_each(|(r, v)| *r -= v * *x);
                }
            }
        }
        residuals
    }
}

/// The normal matrix of the first columns, scaled to a diagonal of ones plus [`RIDGE`].
pub(super) struct Scaled {
    entries: Vec<f64>,
    scale: Vec<f64>,
}

impl Scaled {
    /// Of the first `count` of n columns with these inner products.
    pub fn new(products: &[f64], n: usize, count: usize) -> Self {
        let scale = scales(products, n, count);
        let mut entries = vec![0.0; count * count];
        for i in 0..count {
            for j in 0..count {
                entries[i * count + j] = products[i * n + j] / (scale[i] * scale[j]);
            }
            entries[i * count + i] += RIDGE;
        }
        Scaled { entries, scale }
    }

    /// The factors of the columns for these moments; `None` if they are not determined in double precision.
    pub fn solve(&self, moments: &[f64]) -> Option<Vec<f64>> {
        if moments.is_empty() {
            return Some(Vec::new());
        }
        let moments: Vec<f64> = moments.iter().zip(&self.scale).map(|(m, s)| m / s).collect();
        let x = linalg::solve_positive_definite(&self.entries, &moments)?;
        Some(x.iter().zip(&self.scale).map(|(x, s)| x / s).collect())
    }

    /// The inverse of the normal matrix.
    fn inverse(&self) -> Option<Vec<f64>> {
        let n = self.scale.len();
        let mut inverse = linalg::inverse_positive_definite(&self.entries, n)?;
        for i in 0..n {
            for j in 0..n {
                inverse[i * n + j] /= self.scale[i] * self.scale[j];
            }
        }
        Some(inverse)
    }
}

/// The square roots of the first `count` diagonal entries of a matrix of size n, 1 where there is none.
pub(super) fn scales(matrix: &[f64], n: usize, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| matrix[i * n + i].sqrt())
        .map(|s| if s > 0.0 && s.is_finite() { s } else { 1.0 })
        .collect()
}

/// The real and imaginary parts of a column's lines, each times the square root of its weight.
fn weighted(weights: &[Vec<f64>], column: &Column) -> Vec<Option<Vec<f64>>> {
    let blocks = weights.iter().zip(column);
    blocks
        .map(|(w, lines)| {
            let lines = w.iter().zip(lines.as_ref()?);
            Some(lines.flat_map(|(w, v)| [w.sqrt() * v.re, w.sqrt() * v.im]).collect())
        })
        .collect()
}

/// The sum of products, in eight sums at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const SUMS: usize = 8;
    let (a, b) = (a.chunks_exact(SUMS), b.chunks_exact(SUMS));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; SUMS];
    for (a, b) in a.zip(b) {
        for k in 0..SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    rest + sums.iter().sum::<f64>()
}
