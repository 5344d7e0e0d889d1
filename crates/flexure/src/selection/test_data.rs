//! Samples for the tests of bandwidths.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// `n` points with X uniform on [-2, 2] and Y = m(X) + N(0, 0.1^2).
pub fn noisy(seed: u64, n: usize, m: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
    let y = x.iter().map(|&x| m(x) + 0.1 * normal(&mut rng)).collect();
    (x, y)
}

/// `n` points with X rising evenly from -2 to 2 in time and errors e_t = r e_{t-1} + N(0, 0.1^2).
pub fn slow(seed: u64, n: usize, r: f64, m: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let x: Vec<f64> = (0..n).map(|i| -2.0 + 4.0 * i as f64 / (n - 1) as f64).collect();
    let mut error = 0.1 * normal(&mut rng) / (1.0 - r * r).sqrt();
    let y = x
        .iter()
        .map(|&x| {
            error = r * error + 0.1 * normal(&mut rng);
            m(x) + error
        })
        .collect();
    (x, y)
}

fn normal(rng: &mut rand_pcg::Pcg64) -> f64 {
    StandardNormal.sample(rng)
}
