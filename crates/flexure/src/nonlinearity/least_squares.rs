//! Least squares on the first K functions of a sequence, for all K at once.
//!
//! The functions are orthonormalised on the data, by the Cholesky factor of their Gram matrix, twice
//! (Yamamoto, Nakatsukasa, Yanagisawa, Fukaya 2015, "CholeskyQR2"): the second pass removes what the
//! rounding of the first leaves. Orthonormalisation keeps the order, so that the fit, its leverages and
//! with them the exact leave-one-out residuals of every K come from one pass over the points:
//! O(n K^2) time, O(K^2) memory.

use rayon::prelude::*;

use super::estimator::Points;
use super::functions::Functions;
use crate::selection::{Candidate, UNDETERMINED};

/// A function counts as a combination of those before it when no more than this share of its square is left.
const DEPENDENT: f64 = 1e-12;

/// Points of one parallel piece: fixed, so that the sums do not depend on the number of threads.
const PIECE: usize = 4096;

/// The fits with 1, 2, ..., `terms()` functions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nested {
    functions: Functions,
    first: Lower,
    second: Lower,
    /// Both by columns.
    columns: (Vec<f64>, Vec<f64>),
    /// The coefficients of the orthonormalised functions.
    coefficients: Vec<f64>,
    offset: f64,
}

impl Nested {
    /// Fits up to `most` functions to the first column; `offset` is taken off the ordinates, so the functions
    /// must contain the constant where it is not zero. Stops before the first function that the data do not
    /// tell from the ones before it.
    pub fn fit(functions: Functions, most: usize, points: &Points, offset: f64) -> Nested {
        let gram = sum_over(points, most * (most + 1) / 2, |i, total| {
            let mut v = vec![0.0; most];
            functions.values(points.x[0][i], &mut v);
            add_products(&v, points.w[i], total);
        });
        let (first, terms) = Lower::cholesky(gram, most);
        let first_columns = first.columns(terms);
        let again = sum_over(points, terms * (terms + 1) / 2, |i, total| {
            let mut v = vec![0.0; terms];
            functions.values(points.x[0][i], &mut v);
            solve(&first_columns, &mut v);
            add_products(&v, points.w[i], total);
        });
        let (second, terms) = Lower::cholesky(again, terms);
        let mut nested = Nested {
            functions,
            columns: (first.columns(terms), second.columns(terms)),
            first,
            second,
            coefficients: vec![0.0; terms],
            offset,
        };
        nested.coefficients = sum_over(points, terms, |i, total| {
            let mut v = vec![0.0; terms];
            nested.orthonormal(points.x[0][i], &mut v);
            for (t, v) in total.iter_mut().zip(&v) {
                *t += points.w[i] * v * (points.y[i] - offset);
            }
        });
        nested
    }

    /// The number of functions that the data determine.
    pub fn terms(&self) -> usize {
        self.coefficients.len()
    }

    pub fn into_functions(self) -> Functions {
        self.functions
    }

    fn orthonormal(&self, x: f64, out: &mut [f64]) {
        self.functions.values(x, out);
        solve(&self.columns.0, out);
        solve(&self.columns.1, out);
    }

    /// The coefficients of the first `terms` functions themselves.
    pub fn coefficients(&self, terms: usize) -> Vec<f64> {
        let mut c = self.coefficients[..terms].to_vec();
        self.second.solve_transposed(&mut c);
        self.first.solve_transposed(&mut c);
        c
    }

    /// Both scores for 1, 2, ... terms.
    pub fn scores(&self, points: &Points) -> Vec<Candidate<usize>> {
        let terms = self.terms();
        let sums = sum_over(points, 2 * terms, |i, total| {
            let mut q = vec![0.0; terms];
            self.orthonormal(points.x[0][i], &mut q);
            let w = points.w[i];
            let (mut residual, mut rest) = (points.y[i] - self.offset, 1.0);
            for (k, (q, c)) in q.iter().zip(&self.coefficients).enumerate() {
                residual -= q * c;
                rest -= w * q * q;
                total[k] += w * residual * residual;
                total[terms + k] += if rest > UNDETERMINED {
                    w * (residual / rest).powi(2)
                } else {
                    f64::INFINITY
                };
            }
        });
        let weight = points.total_weight();
        (0..terms)
            .map(|k| {
                let (residual, left_out) = (sums[k], sums[terms + k]);
                Candidate::new(k + 1, (k + 1) as f64, left_out, residual, weight, points.len())
            })
            .collect()
    }
}

/// The sums of `add` over all points.
fn sum_over(points: &Points, size: usize, add: impl Fn(usize, &mut [f64]) + Sync) -> Vec<f64> {
    let n = points.len();
    let pieces: Vec<Vec<f64>> = (0..n.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| {
            let mut total = vec![0.0; size];
            for i in piece * PIECE..n.min((piece + 1) * PIECE) {
                add(i, &mut total);
            }
            total
        })
        .collect();
    let mut total = vec![0.0; size];
    for piece in pieces {
        for (t, p) in total.iter_mut().zip(piece) {
            *t += p;
        }
    }
    total
}

/// Adds w v v' to a packed lower triangle.
fn add_products(v: &[f64], w: f64, packed: &mut [f64]) {
    let mut row = 0;
    for k in 0..v.len() {
        let scaled = w * v[k];
        for (t, vj) in packed[row..=row + k].iter_mut().zip(v) {
            *t += scaled * vj;
        }
        row += k + 1;
    }
}

/// A lower triangular matrix, its rows one after the other.
#[derive(Debug, Clone, PartialEq)]
struct Lower(Vec<f64>);

impl Lower {
    fn row(&self, k: usize) -> &[f64] {
        let start = k * (k + 1) / 2;
        &self.0[start..=start + k]
    }

    /// The Cholesky factor of the leading part of `gram` (`n` rows) that is safely positive definite, and
    /// that part's size.
    fn cholesky(gram: Vec<f64>, n: usize) -> (Lower, usize) {
        let mut lower = Lower(gram);
        for k in 0..n {
            let start = k * (k + 1) / 2;
            let (done, current) = lower.0.split_at_mut(start);
            let diagonal = current[k];
            let mut left = diagonal;
            for j in 0..k {
                let row = &done[j * (j + 1) / 2..][..=j];
                let dot: f64 = row[..j].iter().zip(&*current).map(|(a, b)| a * b).sum();
                current[j] = (current[j] - dot) / row[j];
                left -= current[j] * current[j];
            }
            if !(left > DEPENDENT * diagonal) {
                lower.0.truncate(start);
                return (lower, k);
            }
            current[k] = left.sqrt();
        }
        (lower, n)
    }

    /// The same matrix, its columns one after the other, for [`solve`].
    fn columns(&self, n: usize) -> Vec<f64> {
        (0..n).flat_map(|k| (k..n).map(move |i| self.row(i)[k])).collect()
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

/// `v` becomes the solution of L q = v, with the columns of L: every step works on all the rest at once.
fn solve(columns: &[f64], v: &mut [f64]) {
    let mut rest = columns;
    for k in 0..v.len() {
        let (column, after) = rest.split_at(v.len() - k);
        v[k] /= column[0];
        let top = v[k];
        for (v, a) in v[k + 1..].iter_mut().zip(&column[1..]) {
            *v -= a * top;
        }
        rest = after;
    }
}
