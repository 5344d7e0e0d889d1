//! Product kernels against direct summation and least squares by the singular value decomposition.

mod choosing;
mod oracle;
mod outside;
mod refusals;
mod values;

use rand::{RngExt, SeedableRng};
use rand_distr::{Cauchy, Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::linalg;
use crate::nonlinearity::{Bandwidth, Degree, Estimator, Kernel, KernelEstimate, KernelEstimator, Outside, Regression};
use crate::selection::Criterion;

const DEGREES: [Degree; 2] = [Degree::Constant, Degree::Linear];

fn slices(x: &[Vec<f64>]) -> Vec<&[f64]> {
    x.iter().map(Vec::as_slice).collect()
}

fn method(kernel: Kernel, degree: Degree, h: &[f64]) -> KernelEstimator {
    KernelEstimator {
        kernel,
        degree,
        bandwidth: Bandwidth::Fixed(h.to_vec()),
        outside: Outside::Nan,
    }
}

fn fit(method: &KernelEstimator, x: &[Vec<f64>], y: &[f64], w: Option<&[f64]>) -> KernelEstimate {
    method.clone().fit(&slices(x), y, w).unwrap()
}

/// Columns that break grids, prefix sums and normal equations.
fn hard_columns(seed: u64, n: usize, d: usize) -> Vec<(&'static str, Vec<Vec<f64>>)> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let cauchy = Cauchy::new(0.0, 1.0).unwrap();
    let mut draw = |f: &mut dyn FnMut(&mut Pcg64) -> f64| -> Vec<Vec<f64>> {
        (0..d).map(|_| (0..n).map(|_| f(&mut rng)).collect()).collect()
    };
    let uniform = draw(&mut |r| r.random_range(-1.0..1.0));
    let third: Vec<Vec<f64>> = uniform
        .iter()
        .map(|column| (0..n).map(|i| column[i % n.div_ceil(3)]).collect())
        .collect();
    vec![
        ("uniform", uniform),
        ("duplicates", third),
        ("offset", draw(&mut |r| 1e6 + r.random_range(-1.0..1.0))),
        ("cauchy", draw(&mut |r| cauchy.sample(r))),
        (
            "clusters",
            draw(&mut |r| {
                let z: f64 = StandardNormal.sample(r);
                0.4 * f64::from(r.random_range(0..4)) + 1e-5 * z
            }),
        ),
        ("ties", draw(&mut |r| 0.25 * f64::from(r.random_range(0..8)))),
    ]
}

fn response(x: &[Vec<f64>], offset: f64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(99);
    (0..x[0].len())
        .map(|i| {
            let e: f64 = StandardNormal.sample(&mut rng);
            let m: f64 = x.iter().enumerate().map(|(j, c)| ((j + 1) as f64 * c[i]).sin()).sum();
            offset + m + 0.3 * e
        })
        .collect()
}

/// Weights of very different size, a fifth of them zero.
fn weights(n: usize) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(55);
    (0..n)
        .map(|_| match rng.random_range(0..5) {
            0 => 0.0,
            k => 10f64.powi(k - 2) * rng.random_range(0.5..2.0),
        })
        .collect()
}

/// The twin: one estimate by direct summation over all points.
struct Direct<'a> {
    x: &'a [Vec<f64>],
    y: &'a [f64],
    w: &'a [f64],
    kernel: Kernel,
    h: &'a [f64],
}

impl Direct<'_> {
    fn weights(&self, q: &[f64], skip: Option<usize>) -> Vec<f64> {
        let factor = |i: usize, j: usize| {
            let delta = q[j] - self.x[j][i];
            if delta.abs() <= self.kernel.reach() * self.h[j] {
                self.kernel.weight(delta / self.h[j])
            } else {
                0.0
            }
        };
        (0..self.y.len())
            .map(|i| {
                let k: f64 = (0..q.len()).map(|j| factor(i, j)).product();
                if Some(i) == skip { 0.0 } else { self.w[i] * k }
            })
            .collect()
    }

    /// The estimate, and how well the points determine it, from 0 to 1.
    fn estimate(&self, degree: Degree, q: &[f64], skip: Option<usize>) -> Option<(f64, f64)> {
        let k = self.weights(q, skip);
        let used: Vec<usize> = (0..k.len()).filter(|&i| k[i] > 0.0).collect();
        let total: f64 = used.iter().map(|&i| k[i]).sum();
        if used.is_empty() {
            return None;
        }
        let mean_of = |f: &dyn Fn(usize) -> f64| used.iter().map(|&i| k[i] / total * f(i)).sum::<f64>();
        let first = self.y[used[0]];
        let mean = first + mean_of(&|i| self.y[i] - first);
        if degree == Degree::Constant {
            return Some((mean, 1.0));
        }
        // Standardised columns; those without extent are left out.
        let mut columns: Vec<(Vec<f64>, f64)> = Vec::new();
        // Near the extent below which a column is left out, what is left of it by the others may be below.
        let mut faint = false;
        for j in 0..q.len() {
            let anchor = self.x[j][used[0]];
            let centre = mean_of(&|i| self.x[j][i] - anchor);
            let size = mean_of(&|i| (self.x[j][i] - anchor - centre).powi(2)).sqrt();
            if size > 1e-8 * self.h[j] {
                faint |= size < 1e-5 * self.h[j];
                let column = used.iter().map(|&i| (self.x[j][i] - anchor - centre) / size);
                columns.push((column.collect(), (q[j] - anchor - centre) / size));
            }
        }
        if columns.is_empty() {
            return Some((mean, 1.0));
        }
        let root: Vec<f64> = used.iter().map(|&i| (k[i] / total).sqrt()).collect();
        let rows: Vec<f64> = (0..used.len())
            .flat_map(|r| columns.iter().map(move |c| (r, c)))
            .map(|(r, c)| root[r] * c.0[r])
            .collect();
        let rhs: Vec<f64> = (0..used.len()).map(|r| root[r] * (self.y[used[r]] - mean)).collect();
        let smallest = if used.len() > columns.len() && !faint {
            *linalg::singular_values(&rows, columns.len()).unwrap().last().unwrap()
        } else {
            0.0
        };
        let slopes = linalg::least_squares(&rows, columns.len(), &rhs).unwrap();
        let value = mean + slopes.iter().zip(&columns).map(|(b, c)| b * c.1).sum::<f64>();
        // Far from the points, the rounding of the ordinates grows with the distance in standard deviations.
        let far = columns.iter().map(|c| c.1.abs()).fold(0.0, f64::max);
        Some((value, smallest * (10.0 / far).min(1.0)))
    }
}
