//! Linear least squares over long columns: inner products in fixed chunks, so that the sums do not depend on the threads, and normal
//! equations scaled to a unit diagonal.

use crate::linalg;
use crate::parallel;
use crate::vectors::{add, dot};

/// Samples that a thread takes at a time. It is fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;
/// Samples of all columns that are multiplied at a time, few enough for the processor's cache.
const CACHE_BLOCK: usize = 256;
/// Added to a unit diagonal if columns are nearly dependent: from the first (some hundred times rounding) to the largest, each 100 times
/// the one before.
const FIRST_RIDGE: f64 = 1e-13;
const LARGEST_RIDGE: f64 = 1e-3;
/// How many ridges are tried for an inverse. Convention.
const INVERSE_RIDGES: usize = 4;

/// A sum of squares linearised about a point: all that a step needs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NormalEquations {
    /// The sum of squares r'r.
    pub cost: f64,
    /// -J'r
    pub descent: Vec<f64>,
    /// J'J, row-major, both triangles.
    pub normal: Vec<f64>,
}

impl NormalEquations {
    /// Of no samples yet.
    pub fn zero(parameters: usize) -> NormalEquations {
        NormalEquations {
            cost: 0.0,
            descent: vec![0.0; parameters],
            normal: vec![0.0; parameters * parameters],
        }
    }

    /// Adds those of other samples at the same point.
    pub fn add(&mut self, other: &NormalEquations) {
        self.cost += other.cost;
        add(&mut self.descent, 1.0, &other.descent);
        add(&mut self.normal, 1.0, &other.normal);
    }

    /// The equations of the other parameters while this one is fixed.
    pub fn without(&self, fixed: usize) -> NormalEquations {
        let n = self.descent.len();
        let kept = || (0..n).filter(|&i| i != fixed);
        NormalEquations {
            cost: self.cost,
            descent: kept().map(|i| self.descent[i]).collect(),
            normal: kept()
                .flat_map(|i| kept().map(move |j| self.normal[i * n + j]))
                .collect(),
        }
    }
}

/// J'r over the samples from `from` on.
pub(crate) fn inner_products(jacobian: &[Vec<f64>], residuals: &[f64], from: usize) -> Vec<f64> {
    parallel::batch(jacobian, |c| dot(&c[from..], &residuals[from..]))
}

/// J'J, -J'r and r'r over the samples from `from` on.
pub(crate) fn normal_equations(residuals: &[f64], jacobian: &[Vec<f64>], from: usize) -> NormalEquations {
    let n = jacobian.len();
    let all: Vec<&[f64]> = jacobian
        .iter()
        .map(|c| &c[from..])
        .chain([&residuals[from..]])
        .collect();
    let samples = residuals.len() - from;
    let partial: Vec<Vec<f64>> = parallel::map(samples.div_ceil(CHUNK), |k| {
        products(&all, k * CHUNK..samples.min((k + 1) * CHUNK))
    });
    let size = n + 1;
    let mut sum = vec![0.0; size * size];
    for part in &partial {
        add(&mut sum, 1.0, part);
    }
    let mut normal = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..n {
            normal[i * n + j] = sum[i.max(j) * size + i.min(j)];
        }
    }
    NormalEquations {
        cost: sum[n * size + n],
        descent: (0..n).map(|j| -sum[n * size + j]).collect(),
        normal,
    }
}

/// Coefficients of columns and the remaining sum of squares.
pub(crate) struct LeastSquares {
    pub coefficients: Vec<f64>,
    pub squares: f64,
}

/// The least squares of `y` over the columns from sample `from` on, slightly damped if the columns are nearly dependent.
pub(crate) fn least_squares(y: &[f64], columns: &[Vec<f64>], from: usize) -> Option<LeastSquares> {
    let equations = regression(y, columns, from);
    let coefficients = UnitDiagonal::new(&equations).ridged_solution(&equations.descent)?;
    Some(LeastSquares {
        squares: equations.cost - dot(&coefficients, &equations.descent),
        coefficients,
    })
}

/// The normal equations of `y` over the columns from sample `from` on, about the origin of the coefficients.
pub(crate) fn regression(y: &[f64], columns: &[Vec<f64>], from: usize) -> NormalEquations {
    let minus: Vec<f64> = y.iter().map(|y| -y).collect();
    normal_equations(&minus, columns, from)
}

fn ridges() -> impl Iterator<Item = f64> {
    std::iter::successors(Some(FIRST_RIDGE), |ridge| Some(100.0 * ridge))
}

/// A normal matrix, scaled to a unit diagonal for a stable factorisation.
pub(crate) struct UnitDiagonal {
    matrix: Vec<f64>,
    pub scale: Vec<f64>,
}

impl UnitDiagonal {
    pub fn new(equations: &NormalEquations) -> UnitDiagonal {
        let n = equations.descent.len();
        let diagonal = (0..n).map(|i| equations.normal[i * n + i].sqrt());
        let scale: Vec<f64> = diagonal.map(|d| if d > 0.0 { d } else { 1.0 }).collect();
        let scaled = |k: usize| equations.normal[k] / (scale[k / n] * scale[k % n]);
        UnitDiagonal {
            matrix: (0..n * n).map(scaled).collect(),
            scale,
        }
    }

    /// The matrix with a changed diagonal.
    fn with_diagonal(&self, change: impl Fn(f64) -> f64) -> Vec<f64> {
        let n = self.scale.len();
        let mut matrix = self.matrix.clone();
        (0..n).for_each(|i| matrix[i * n + i] = change(matrix[i * n + i]));
        matrix
    }

    /// The solution for a right-hand side, in its own scale, with a changed diagonal.
    pub fn solve(&self, rhs: &[f64], change: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
        let scaled: Vec<f64> = rhs.iter().zip(&self.scale).map(|(r, s)| r / s).collect();
        let x = linalg::solve_positive_definite(&self.with_diagonal(change), &scaled)?;
        Some(x.iter().zip(&self.scale).map(|(x, s)| x / s).collect())
    }

    /// The solution with the smallest of the ridges with which there is one.
    pub fn ridged_solution(&self, rhs: &[f64]) -> Option<Vec<f64>> {
        let mut ridges = ridges().take_while(|ridge| *ridge < LARGEST_RIDGE);
        ridges.find_map(|ridge| self.solve(rhs, |d| d + ridge))
    }

    /// The inverse of the scaled matrix with a larger diagonal, row-major.
    pub fn scaled_inverse(&self, ridge: f64) -> Option<Vec<f64>> {
        linalg::inverse_positive_definite(&self.with_diagonal(|d| d + ridge), self.scale.len())
    }

    /// The inverse in its own scale, row-major; a nearly singular matrix first gets a slightly larger diagonal. `None` if a column is zero.
    pub fn inverse(&self) -> Option<Vec<f64>> {
        let n = self.scale.len();
        if !(0..n).all(|i| self.matrix[i * n + i] > 0.0) {
            return None;
        }
        let inverse = ridges()
            .take(INVERSE_RIDGES)
            .find_map(|ridge| self.scaled_inverse(ridge))?;
        let unscaled = |k: usize| inverse[k] / (self.scale[k / n] * self.scale[k % n]);
        Some((0..n * n).map(unscaled).collect())
    }
}

/// The lower triangle of the columns' inner products over a range of samples, two by two columns at a time.
fn products(columns: &[&[f64]], range: std::ops::Range<usize>) -> Vec<f64> {
    let size = columns.len();
    let mut sum = vec![0.0; size * size];
    for start in range.clone().step_by(CACHE_BLOCK) {
        let block = start..range.end.min(start + CACHE_BLOCK);
        let of = |i: usize| &columns[i.min(size - 1)][block.clone()];
        for i in (0..size).step_by(2) {
            let (a, b) = (of(i), of(i + 1));
            for j in (0..=i).step_by(2) {
                let four = dot4(a, b, of(j), of(j + 1));
                sum[i * size + j] += four[0];
                if j + 1 < size {
                    sum[i * size + j + 1] += four[1];
                }
                if i + 1 < size {
                    sum[(i + 1) * size + j] += four[2];
                    sum[(i + 1) * size + j + 1] += four[3];
                }
            }
        }
    }
    sum
}

/// a.c, a.d, b.c, b.d
fn dot4(a: &[f64], b: &[f64], c: &[f64], d: &[f64]) -> [f64; 4] {
    const LANES: usize = 2;
    let mut lanes = [[0.0; LANES]; 4];
    let whole = a.len() / LANES * LANES;
    for t in (0..whole).step_by(LANES) {
        for l in 0..LANES {
            let (p, q, r, s) = (a[t + l], b[t + l], c[t + l], d[t + l]);
            lanes[0][l] += p * r;
            lanes[1][l] += p * s;
            lanes[2][l] += q * r;
            lanes[3][l] += q * s;
        }
    }
    for t in whole..a.len() {
        lanes[0][0] += a[t] * c[t];
        lanes[1][0] += a[t] * d[t];
        lanes[2][0] += b[t] * c[t];
        lanes[3][0] += b[t] * d[t];
    }
    lanes.map(|l| l.iter().sum())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn products_are_the_sums() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        for (n, columns, from) in [(10_000, 5, 3), (4096 + 257, 4, 0), (7, 1, 2), (5, 0, 1)] {
            let mut column = || -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
            let jacobian: Vec<Vec<f64>> = (0..columns).map(|_| column()).collect();
            let residuals = column();
            let sum = |a: &[f64], b: &[f64]| (from..n).map(|t| a[t] * b[t]).sum::<f64>();
            let got = normal_equations(&residuals, &jacobian, from);
            let simple = inner_products(&jacobian, &residuals, from);
            assert!((got.cost - sum(&residuals, &residuals)).abs() < 1e-10);
            for i in 0..columns {
                let want = sum(&jacobian[i], &residuals);
                assert!((got.descent[i] + want).abs() < 1e-10 && (simple[i] - want).abs() < 1e-10);
                for j in 0..columns {
                    assert!((got.normal[i * columns + j] - sum(&jacobian[i], &jacobian[j])).abs() < 1e-10);
                }
            }
        }
    }
}
