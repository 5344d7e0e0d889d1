//! The fast Gauss transform in comparison with direct sums, for data that extend over very many bandwidths.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::nonlinearity::{Degree, Kernel, KernelRegression};

/// sum_i Y_i exp(-((q - X_i)/h)^2 / 2) / sum_i exp(...).
fn directly(x: &[f64], y: &[f64], h: f64, q: f64) -> f64 {
    let weight = |x: f64| (-0.5 * ((q - x) / h).powi(2)).exp();
    let mass: f64 = x.iter().map(|&x| weight(x)).sum();
    x.iter().zip(y).map(|(&x, y)| weight(x) * y).sum::<f64>() / mass
}

fn assert_direct(x: &[f64], h: f64, at: &[f64]) {
    let y: Vec<f64> = x.iter().map(|x| 2.0 + (3.0 * x).sin()).collect();
    let method = KernelRegression {
        kernel: Kernel::Gaussian,
        bandwidth: h,
    };
    let all = method.fit(x, &y).unwrap().with_degree(Degree::Constant).predict(at);
    for (&q, &value) in at.iter().zip(&all) {
        let want = directly(x, &y, h, q);
        assert!(
            (value - want).abs() <= 1e-11 * want.abs(),
            "h {h}, at {q}: {value} {want}"
        );
    }
}

#[test]
fn outliers_and_far_clusters_cost_no_accuracy() {
    let mut rng = Pcg64::seed_from_u64(4);
    let mut near = |count: usize, middle: f64, half: f64| -> Vec<f64> {
        (0..count)
            .map(|_| middle + half * rng.random_range(-1.0..1.0))
            .collect()
    };
    let mut x = near(2000, 0.0, 1.0);
    let at = near(300, 0.0, 1.0);
    x.extend([-1e6, 1e6]);
    for h in [0.3, 0.01] {
        assert_direct(&x, h, &at);
    }
    let mut x = near(1500, 0.0, 0.5);
    x.extend(near(1500, 1e6, 0.5));
    let at = [near(200, 0.0, 0.5), near(200, 1e6, 0.5)].concat();
    for h in [0.2, 0.02] {
        assert_direct(&x, h, &at);
    }
}
