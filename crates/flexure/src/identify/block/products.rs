//! Inner products of long columns, in chunks that threads share without changing the sums.

use crate::linear::levenberg_marquardt::NormalEquations;
use crate::parallel;

/// Samples a thread takes at a time; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;
/// Samples of all columns that are multiplied at a time, small enough for the cache.
const BLOCK: usize = 256;

/// J'r over the samples from `from` on.
pub(super) fn inner_products(jacobian: &[Vec<f64>], residuals: &[f64], from: usize) -> Vec<f64> {
    let dot = |c: &Vec<f64>| c[from..].iter().zip(&residuals[from..]).map(|(c, r)| c * r).sum();
    parallel::batch(jacobian, dot)
}

/// J'J, -J'r and r'r over the samples from `from` on.
pub(in crate::identify) fn normal_equations(residuals: &[f64], jacobian: &[Vec<f64>], from: usize) -> NormalEquations {
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
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
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

/// The lower triangle of the columns' inner products over a range of samples, two by two columns at a time.
fn products(columns: &[&[f64]], range: std::ops::Range<usize>) -> Vec<f64> {
    let size = columns.len();
    let mut sum = vec![0.0; size * size];
    for start in range.clone().step_by(BLOCK) {
        let block = start..range.end.min(start + BLOCK);
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
