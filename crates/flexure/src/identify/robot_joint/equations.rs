//! Weighted least squares over complex equations with real unknowns.
//!
//! Each equation of motion is a block of complex equations, one a frequency (a "line"):
//!
//! $$ \sum_j a_{bj}(\omega)\, x_j = r_b(\omega) + e_b(\omega), \qquad \mathrm{E}\,|e_b(\omega)|^2 = s_b(\omega). $$
//!
//! The solution minimises the sum of $2 |e_b|^2 / s_b$, since the real and the imaginary part each have half of the noise. If columns are
//! noisy themselves, the mean contribution of their noise to the normal equations is subtracted first.

use super::column_noise::{Excess, Noisy, excess, less, share_of, square};
use super::normal::{Covariance, Normal};
use crate::interrupt;
use crate::linalg::{Complex, Matrix};
use crate::parallel;

/// The lines of one signal.
pub(super) type Lines = Vec<Complex<f64>>;

/// A column with an unknown factor: its lines in each block of equations, or none.
pub(super) type Column = Vec<Option<Lines>>;

/// Stacked blocks of complex equations `sum_j columns[j] x_j = right`.
#[derive(Clone)]
pub(super) struct Equations<'a> {
    pub columns: Vec<Column>,
    /// The right-hand side of each block.
    pub right: Vec<Lines>,
    /// The mean square of the noise in each line of each block.
    pub noise: Vec<&'a [f64]>,
    /// The noise that columns share with themselves and with each other.
    pub noisy: Vec<Noisy<'a>>,
    /// What each known value adds to the right-hand side if it is off by its standard error.
    pub given: Vec<Column>,
}

/// The weighted inner products of columns without the part that the columns' noise adds.
pub(super) struct Gram {
    pub products: Matrix,
    /// The part that was subtracted.
    pub excess: Vec<Excess>,
}

/// A least-squares solution.
#[derive(Clone)]
pub(super) struct Solution {
    /// The unknowns.
    pub x: Vec<f64>,
    /// Their covariance if the noise is as given.
    pub covariance: Covariance,
    /// Right-hand side less columns times unknowns, block by block.
    pub residuals: Vec<Lines>,
    /// The weighted sum of squares of the residuals.
    pub squares: f64,
    /// That sum minus the noise of the columns in it. The solution minimises this.
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

    /// The inner products of all columns with these weights.
    pub fn products(&self, weights: &[Vec<f64>]) -> Matrix {
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
        Matrix::from_fn(n, n, |i, j| rows[i.max(j)][i.min(j)])
    }

    /// The inner products without the columns' noise. No sum of the first `unknown` columns loses more than half of its square.
    ///
    /// All long work on equations of motion calls this: `None` if it was asked to stop.
    pub fn gram(&self, unknown: usize) -> Option<Gram> {
        if interrupt::requested() {
            return None;
        }
        let weights = self.weights();
        let products = self.products(&weights);
        let mut excess = excess(&self.noisy, &weights);
        if !excess.is_empty() {
            let share = share_of(&products.view((0, 0), (unknown, unknown)).into_owned(), &excess);
            excess.iter_mut().for_each(|entry| entry.sum *= share);
        }
        Some(Gram {
            products: less(products, &excess),
            excess,
        })
    }

    /// The weighted inner products of the columns with the right-hand side.
    pub fn moments(&self) -> Vec<f64> {
        self.moments_with(&self.right.iter().map(Some).collect::<Vec<_>>())
    }

    /// The weighted inner products of the columns with this one.
    pub fn moments_with(&self, right: &[Option<&Lines>]) -> Vec<f64> {
        let weights = self.weights();
        let product = |column: &Column| -> f64 {
            let blocks = weights.iter().zip(column.iter().zip(right));
            blocks
                .map(|(w, (column, right))| {
                    let (Some(column), Some(right)) = (column, right) else {
                        return 0.0;
                    };
                    let lines = w.iter().zip(column.iter().zip(*right));
                    lines.map(|(w, (a, b))| w * (a.re * b.re + a.im * b.im)).sum()
                })
                .sum()
        };
        parallel::batch(&self.columns, product)
    }

    /// The weighted least-squares solution; `None` if the equations do not determine it in double precision, or if the work was
    /// asked to stop.
    pub fn solve(&self) -> Option<Solution> {
        let gram = self.gram(self.columns.len())?;
        let normal = Normal::new(&gram.products)?;
        let x = normal.solve(&Matrix::from_vec(self.columns.len(), 1, self.moments()))?;
        let covariance = normal.covariance()?;
        let residuals = self.residuals(x.as_slice());
        let weights = self.weights();
        let squares: f64 = weights
            .iter()
            .zip(&residuals)
            .map(|(w, r)| w.iter().zip(r).map(|(w, r)| w * r.norm_sqr()).sum::<f64>())
            .sum();
        Some(Solution {
            objective: squares - square(&gram.excess, x.as_slice()),
            covariance,
            x: x.as_slice().to_vec(),
            residuals,
            squares,
        })
    }

    /// The right-hand sides minus the columns times these unknowns.
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
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
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
