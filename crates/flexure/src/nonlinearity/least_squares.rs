//! Least squares on the first K functions of a sequence, for all K at once.
//!
//! The functions are orthonormalised on the data, by the Cholesky factor of their Gram matrix, twice
//! (Yamamoto, Nakatsukasa, Yanagisawa, Fukaya 2015, "CholeskyQR2"): the second pass removes what the
//! rounding of the first leaves. Orthonormalisation keeps the order. So one pass over the points gives, for every K, the fit, its leverages
//! and the exact leave-one-out residuals: O(n K^2) time, O(K^2) memory.

use super::blocks::{BLOCK, Row, add_products, dot, load, rows, sum_over};
use super::estimator::Points;
use super::functions::Functions;
use crate::selection::{ScoredParameter, UNDETERMINED};

/// A function counts as a combination of those before it if no more than this share of its square remains.
const DEPENDENT: f64 = 1e-12;

/// Right-hand sides that are solved for together, in registers.
const COLUMNS: usize = 8;

/// The fits with 1, 2, ..., `terms()` functions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nested {
    functions: Functions,
    first: Lower,
    second: Lower,
    /// The coefficients of the orthonormalised functions.
    coefficients: Vec<f64>,
    offset: f64,
}

/// The entries of a packed lower triangle of `n` rows.
fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

impl Nested {
    /// Fits up to `most` functions to the first column. `offset` is subtracted from the ordinates. If it is not zero, the functions must
    /// contain the constant. Stops before the first function that the data cannot distinguish from those before it.
    pub fn fit(functions: Functions, most: usize, points: &Points, offset: f64) -> Nested {
        let gram = products(points, packed(most), most, |x, _, v| functions.rows(x, v));
        let first = Lower::cholesky(gram, most);
        let terms = first.size;
        // The ordinates as one more row: its products are the coefficients.
        let mut again = products(points, packed(terms + 1), terms + 1, |x, y, v| {
            let (v, ordinates) = v.split_at_mut(terms);
            functions.rows(x, v);
            first.solve(v);
            ordinates[0] = y.map(|y| y - offset);
        });
        let mut coefficients = again.split_off(packed(terms));
        let second = Lower::cholesky(again, terms);
        coefficients.truncate(second.size);
        second.solve(coefficients.as_chunks_mut::<1>().0);
        Nested {
            functions,
            first,
            second,
            coefficients,
            offset,
        }
    }

    /// The number of functions that the data determine.
    pub fn terms(&self) -> usize {
        self.coefficients.len()
    }

    pub fn into_functions(self) -> Functions {
        self.functions
    }

    /// The coefficients of the first `terms` functions themselves.
    pub fn coefficients(&self, terms: usize) -> Vec<f64> {
        let mut c = self.coefficients[..terms].to_vec();
        self.second.solve_transposed(&mut c);
        self.first.solve_transposed(&mut c);
        c
    }

    /// Both scores for 1, 2, ... terms.
    pub fn scores(&self, points: &Points) -> Vec<ScoredParameter<usize>> {
        let terms = self.terms();
        let scratch = || rows(terms);
        let sums = sum_over(points.len(), 2 * terms, scratch, |q, range, total| {
            self.functions.rows(&load(&points.x[0], &range, None), q);
            self.first.solve(q);
            self.second.solve(q);
            let w = load(&points.w, &range, Some(0.0));
            let mut residual = load(&points.y, &range, None).map(|y| y - self.offset);
            let mut rest = [1.0; BLOCK];
            for (k, (q, c)) in q.iter().zip(&self.coefficients).enumerate() {
                let mut left_out = [0.0; BLOCK];
                for p in 0..BLOCK {
                    residual[p] -= q[p] * c;
                    rest[p] -= w[p] * q[p] * q[p];
                    left_out[p] = if rest[p] > UNDETERMINED {
                        residual[p] / rest[p]
                    } else {
                        f64::INFINITY
                    };
                }
                total[k] += weighted_square(&w, &residual);
                total[terms + k] += weighted_square(&w, &left_out);
            }
        });
        let weight = points.total_weight();
        (0..terms)
            .map(|k| {
                let (residual, left_out) = (sums[k], sums[terms + k]);
                ScoredParameter::new(k + 1, (k + 1) as f64, left_out, residual, weight, points.len())
            })
            .collect()
    }
}

fn weighted_square(w: &Row, v: &Row) -> f64 {
    dot(&std::array::from_fn(|p| w[p] * v[p]), v)
}

/// The weighted products of the `count` rows that `fill` computes from the abscissas and ordinates of each block.
fn products(points: &Points, size: usize, count: usize, fill: impl Fn(&Row, &Row, &mut [Row]) + Sync) -> Vec<f64> {
    let scratch = || (rows(count), Vec::new());
    sum_over(points.len(), size, scratch, |(v, weighted), range, total| {
        let (x, y) = (load(&points.x[0], &range, None), load(&points.y, &range, None));
        fill(&x, &y, v);
        add_products(v, &load(&points.w, &range, Some(0.0)), weighted, total);
    })
}

/// A lower triangular matrix, its rows one after the other.
#[derive(Debug, Clone, PartialEq)]
struct Lower {
    packed: Vec<f64>,
    size: usize,
}

impl Lower {
    fn row(&self, k: usize) -> &[f64] {
        let start = k * (k + 1) / 2;
        &self.packed[start..=start + k]
    }

    /// The Cholesky factor of the leading part of `gram` (`n` rows) that is safely positive definite.
    fn cholesky(gram: Vec<f64>, n: usize) -> Lower {
        let mut packed = gram;
        for k in 0..n {
            let start = k * (k + 1) / 2;
            let (done, current) = packed.split_at_mut(start);
            let diagonal = current[k];
            let mut left = diagonal;
            for j in 0..k {
                let row = &done[j * (j + 1) / 2..][..=j];
                let dot: f64 = row[..j].iter().zip(&*current).map(|(a, b)| a * b).sum();
                current[j] = (current[j] - dot) / row[j];
                left -= current[j] * current[j];
            }
            if !(left > DEPENDENT * diagonal) {
                packed.truncate(start);
                return Lower { packed, size: k };
            }
            current[k] = left.sqrt();
        }
        Lower { packed, size: n }
    }

    /// Each of N columns of `v` becomes the solution q of L q = v, for the leading part of L of the size of `v`.
    fn solve<const N: usize>(&self, v: &mut [[f64; N]]) {
        for k in 0..v.len() {
            let row = self.row(k);
            let (done, rest) = v.split_at_mut(k);
            let (wide, narrow) = rest[0].as_chunks_mut::<COLUMNS>();
            for (c, v) in wide.iter_mut().enumerate() {
                substitute(row, done.iter().map(|q| &q.as_chunks().0[c]), v);
            }
            let first = N - narrow.len();
            for (c, v) in narrow.as_chunks_mut::<1>().0.iter_mut().enumerate() {
                substitute(row, done.iter().map(|q| &q[first..].as_chunks().0[c]), v);
            }
        }
    }

    /// `v` becomes the solution of L' q = v, for the leading part of L of the size of `v`.
    fn solve_transposed(&self, v: &mut [f64]) {
        for k in (0..v.len()).rev() {
            let row = self.row(k);
            v[k] /= row[k];
            let top = v[k];
            for (v, a) in v[..k].iter_mut().zip(row) {
                *v -= a * top;
            }
        }
    }
}

/// One row of a forward substitution: v becomes (v - sum of `row` times `done`) divided by the row's last entry.
fn substitute<'a, const N: usize>(row: &[f64], done: impl Iterator<Item = &'a [f64; N]>, v: &mut [f64; N]) {
    let mut sums = [0.0; N];
    for (a, q) in row.iter().zip(done) {
        for (sum, q) in sums.iter_mut().zip(q) {
            *sum += a * q;
        }
    }
    let pivot = row[row.len() - 1];
    for (v, sum) in v.iter_mut().zip(sums) {
        *v = (*v - sum) / pivot;
    }
}
