//! Impulse responses of the linear block from conditional moments of the input, without linear correlation.
//!
//! For a Gaussian input with covariance R, $x_n = (u_n, \dots, u_{n-m})$ and $w_n = h^T x_n$, all information of the output about $x_n$ is
//! about $w_n$; with a weight $T(y)$,
//! $$ E\, T(Y_n)\,(x_n x_n^T - R) = c\, R h\, h^T R, \qquad E(x_n \mid Y_n) = g(Y_n)\, R h. $$
//! Both matrices have rank one, and h is their dominant eigenvector relative to R. The first gives Li's (1992) principal Hessian
//! directions, which also work for even nonlinearities. The second is Greblicki's (1992) inverse regression at all lags at once, or sliced
//! inverse regression (Li 1991), which is robust against heavy tails. For inputs that are not Gaussian, the starts are not exact.

use super::super::limits::{ROWS_TOGETHER, SLICES, WHITENING_RIDGE};
use crate::linalg;
use crate::linear::correlation::{cross_covariance, mean};
use crate::sort;
use crate::vectors::dot;

/// Estimates of the impulse response at lags 0 to `lags - 1`, one for every kind of moment, of unit length.
pub(super) fn directions(u: &[f64], y: &[f64], lags: usize) -> Vec<Vec<f64>> {
    let mut covariance = cross_covariance(u, u, lags - 1);
    let level = mean(&y[lags - 1..]);
    let centred: Vec<f64> = y.iter().map(|y| y - level).collect();
    let squared: Vec<f64> = centred.iter().map(|y| y * y).collect();
    let matrices = [
        second_moment(u, &centred, &covariance),
        second_moment(u, &squared, &covariance),
        inverse_regression(u, y, lags),
    ];
    covariance[0] *= 1.0 + WHITENING_RIDGE;
    let mut dominant = |m: Vec<f64>| linalg::dominant_relative_to_toeplitz(&m, &covariance);
    matrices.into_iter().filter_map(&mut dominant).collect()
}

/// $\mathrm{mean}\,(T_n - \bar T)(x_n x_n^T - R)$, row-major.
fn second_moment(u: &[f64], weights: &[f64], covariance: &[f64]) -> Vec<f64> {
    let lags = covariance.len();
    let level = mean(&weights[lags - 1..]);
    let mut sum = vec![0.0; lags * lags];
    let times: Vec<usize> = (lags - 1..u.len()).collect();
    // Lag by lag over a block of times: contiguous products.
    for block in times.chunks(ROWS_TOGETHER) {
        let (first, last) = (block[0], block[block.len() - 1] + 1);
        for i in 0..lags {
            let weighted: Vec<f64> = (first..last).map(|t| (weights[t] - level) * u[t - i]).collect();
            for j in 0..=i {
                sum[i * lags + j] += dot(&weighted, &u[first - j..last - j]);
            }
        }
    }
    symmetric(&sum, lags, 1.0 / times.len() as f64)
}

/// The covariance of the slices' means of $x_n$, row-major.
fn inverse_regression(u: &[f64], y: &[f64], lags: usize) -> Vec<f64> {
    let mut times: Vec<usize> = (lags - 1..u.len()).collect();
    sort::by_key(&mut times, |t| y[*t]);
    let total = times.len() as f64;
    let mut sum = vec![0.0; lags * lags];
    for slice in times.chunks(times.len().div_ceil(SLICES)) {
        let size = slice.len() as f64;
        let centre: Vec<f64> = (0..lags)
            .map(|i| slice.iter().map(|t| u[t - i]).sum::<f64>() / size)
            .collect();
        for i in 0..lags {
            for j in 0..=i {
                sum[i * lags + j] += size * centre[i] * centre[j];
            }
        }
    }
    symmetric(&sum, lags, 1.0 / total)
}

/// The full matrix from its lower triangle, scaled.
fn symmetric(lower: &[f64], n: usize, scale: f64) -> Vec<f64> {
    (0..n * n)
        .map(|k| (k / n, k % n))
        .map(|(i, j)| scale * lower[i.max(j) * n + i.min(j)])
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Coloured Gaussian input through an impulse response and a nonlinearity.
    fn record(f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>, [f64; 5]) {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        let mut last = 0.0;
        let u: Vec<f64> = (0..6000)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                last = 0.6 * last + 0.8 * e;
                last
            })
            .collect();
        let h = [0.2, 0.7, -0.5, 0.3, 0.1];
        let w = |t: usize| (0..5).filter(|i| *i <= t).map(|i| h[i] * u[t - i]).sum();
        let y = (0..u.len()).map(|t| f(w(t))).collect();
        (u, y, h)
    }

    /// The cosine of the angle between two vectors.
    fn alignment(a: &[f64], b: &[f64]) -> f64 {
        dot(a, b).abs() / (dot(a, a) * dot(b, b)).sqrt()
    }

    #[test]
    fn even_nonlinearities_are_seen_by_second_moments_and_odd_ones_by_the_inverse_regression() {
        let (u, y, h) = record(|w| w * w);
        let all = directions(&u, &y, 8);
        assert_eq!(all.len(), 3);
        let truth: Vec<f64> = h.iter().copied().chain([0.0; 3]).collect();
        assert!(alignment(&all[0], &truth) > 0.99, "{:?}", all[0]);
        assert!(alignment(&all[1], &truth) > 0.97, "{:?}", all[1]);
        assert!(alignment(&all[2], &truth) < 0.9, "{:?}", all[2]);
        let (u, y, _) = record(|w| w.clamp(-0.3, 0.4));
        let all = directions(&u, &y, 8);
        assert!(alignment(&all[2], &truth) > 0.99, "{:?}", all[2]);
    }

    #[test]
    fn second_moments_are_the_sums_that_define_them() {
        let (u, y, _) = record(|w| w.abs());
        let (u, y) = (&u[..200], &y[..200]);
        let r = cross_covariance(u, u, 3);
        let got = second_moment(u, y, &r);
        let level = mean(&y[3..]);
        for i in 0..4 {
            for j in 0..4 {
                let want: f64 = (3..200)
                    .map(|t| (y[t] - level) * (u[t - i] * u[t - j] - r[i.abs_diff(j)]))
                    .sum::<f64>()
                    / 197.0;
                assert!((got[4 * i + j] - want).abs() < 1e-12, "{i} {j}");
            }
        }
    }
}
