//! Known systems and their records.

use flexure::linear::TransferFunction;
use flexure::record::Record;
use flexure::validation::FitMeasures;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Uniform on [-2, 2].
pub fn uniform(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

pub fn spread(v: &[f64]) -> f64 {
    let mean = v.iter().sum::<f64>() / v.len() as f64;
    (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / v.len() as f64).sqrt()
}

/// `y` with white noise of this share of its standard deviation.
pub fn noisy(mut y: Vec<f64>, share: f64, seed: u64) -> Vec<f64> {
    let size = share * spread(&y);
    let mut rng = Pcg64::seed_from_u64(seed + 1000);
    for y in &mut y {
        let e: f64 = StandardNormal.sample(&mut rng);
        *y += size * e;
    }
    y
}

/// The fit after a transient, percent.
pub fn fit(truth: &[f64], predicted: &[f64]) -> f64 {
    FitMeasures::new(&truth[300..], &predicted[300..]).unwrap().fit_percent
}

/// Static, linear, static.
#[derive(Clone)]
pub struct Known {
    pub f: fn(f64) -> f64,
    pub b: &'static [f64],
    pub a: &'static [f64],
    pub g: fn(f64) -> f64,
}

impl Known {
    pub fn run(&self, u: &[f64]) -> Vec<f64> {
        let linear = TransferFunction::new(self.b.to_vec(), self.a.to_vec()).unwrap();
        let v: Vec<f64> = u.iter().map(|u| (self.f)(*u)).collect();
        linear.simulate_from_mean(&v).into_iter().map(self.g).collect()
    }

    pub fn record(&self, n: usize, seed: u64, noise: f64) -> Record {
        let u = uniform(n, seed);
        let y = noisy(self.run(&u), noise, seed);
        Record::new([("u", u), ("y", y)]).unwrap()
    }
}

pub fn dead_zone(u: f64) -> f64 {
    (u - 0.5).max(0.0) + (u + 0.4).min(0.0)
}

pub fn saturation(x: f64) -> f64 {
    x.clamp(-0.7, 0.9)
}

pub fn identity(x: f64) -> f64 {
    x
}
