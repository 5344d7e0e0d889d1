use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::validation::FitMeasures;

fn uniform(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

/// A known system.
struct Known {
    f: fn(f64) -> f64,
    b: &'static [f64],
    a: &'static [f64],
    g: fn(f64) -> f64,
}

impl Known {
    fn run(&self, u: &[f64]) -> Vec<f64> {
        let linear = TransferFunction::new(self.b.to_vec(), self.a.to_vec()).unwrap();
        let v: Vec<f64> = u.iter().map(|u| (self.f)(*u)).collect();
        linear.simulate_from_mean(&v).into_iter().map(self.g).collect()
    }

    /// With white noise of this share of the output's standard deviation.
    fn record(&self, n: usize, seed: u64, noise: f64) -> Record {
        let u = uniform(n, seed);
        let mut y = self.run(&u);
        let spread = noise * variance(&y).sqrt();
        let mut rng = Pcg64::seed_from_u64(seed + 1000);
        for y in &mut y {
            let e: f64 = StandardNormal.sample(&mut rng);
            *y += spread * e;
        }
        Record::new([("u", u), ("y", y)]).unwrap()
    }

    /// The fit of a model to the noiseless output under another input.
    fn fit(&self, model: &Block) -> f64 {
        let u = uniform(4000, 77);
        FitMeasures::new(&self.run(&u)[200..], &model.simulate(&u)[200..])
            .unwrap()
            .fit_percent
    }
}

fn dead_zone(u: f64) -> f64 {
    (u - 0.5).max(0.0) + (u + 0.4).min(0.0)
}

fn saturation(x: f64) -> f64 {
    x.clamp(-0.7, 0.9)
}

const DEAD_ZONE_AND_SATURATION: Known = Known {
    f: dead_zone,
    b: &[0.0, 0.3, 0.1],
    a: &[1.0, -1.1, 0.5],
    g: saturation,
};

#[test]
fn a_dead_zone_before_and_a_saturation_behind_come_back() {
    let known = DEAD_ZONE_AND_SATURATION;
    let result = HammersteinWiener::default()
        .identify(&known.record(12_000, 1, 0.01), "u", "y")
        .unwrap();
    let fit = known.fit(&result.model);
    println!("{fit} {:?}", result.tried.last());
    assert!(fit >= 99.0, "{fit}");
    assert_eq!((result.order, result.delay), (2, 1), "{:?}", result.linear);
    for (got, want) in result.linear.a().iter().zip(known.a) {
        assert!((got - want).abs() < 0.02, "{:?}", result.linear);
    }
    assert!((result.linear.static_gain() - 1.0).abs() < 1e-9);
}
