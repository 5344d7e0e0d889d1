//! One Monte Carlo run: a record, the estimate (13) from it, and the estimate's error.

use rand::{RngExt, SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::setting::{DEGREES, DataSource, Input, Norm, OfTarget, Setting};
use crate::error::Result;
use crate::nonlinearity::{Kernel, KernelRegression};

/// Points at which the error over an interval is averaged.
const GRID: usize = 4000;

/// A setting with everything that does not change from run to run.
pub(super) struct Sampler<'a> {
    setting: &'a Setting,
    /// Gain and offset of phi in m, (16).
    truth: OfTarget,
    /// Samples before the record starts, so that the linear part reaches its stationary regime.
    before: usize,
    grid: Vec<f64>,
}

impl<'a> Sampler<'a> {
    pub fn new(setting: &'a Setting) -> Self {
        let grid = match setting.norm {
            Norm::At(x) => vec![x],
            Norm::Over { low, high } => (0..GRID)
                .map(|i| low + (high - low) * (i as f64 + 0.5) / GRID as f64)
                .collect(),
        };
        Sampler {
            setting,
            truth: setting.truth(),
            before: match &setting.data {
                DataSource::Static { .. } => 0,
                DataSource::Hammerstein { linear, .. } => linear.settling(1e-9),
            },
            grid,
        }
    }

    /// The mean squared error over the norm's points; `None` if one has no data within reach.
    pub fn squared_error(&self, n: usize, seed: u64) -> Result<Option<f64>> {
        let (x, y) = self.points(n, seed);
        let kernel = Kernel::default();
        let bandwidth = self.setting.bandwidth.at(n);
        let estimates = match self.grid.as_slice() {
            [at] => vec![estimate_at(kernel, bandwidth, *at, &x, &y)],
            grid => KernelRegression { kernel, bandwidth }.fit(&x, &y)?.predict(grid),
        };
        let OfTarget { gain, offset } = self.truth;
        let sum: f64 = self
            .grid
            .iter()
            .zip(estimates)
            .map(|(&x, m)| (m - gain * self.setting.target.value(x) - offset).powi(2))
            .sum();
        let mean = sum / self.grid.len() as f64;
        Ok(mean.is_finite().then_some(mean))
    }

    /// n pairs (X, Y) for the regression.
    fn points(&self, n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let phi = self.setting.target;
        let normal = |rng: &mut Pcg64| -> f64 { StandardNormal.sample(rng) };
        match &self.setting.data {
            DataSource::Static { noise } => {
                let x = draw(self.setting.input, n, &mut rng);
                let y = x.iter().map(|&x| phi.value(x) + noise * normal(&mut rng)).collect();
                (x, y)
            }
            DataSource::Hammerstein {
                linear,
                lag,
                process_noise,
                noise,
            } => {
                let mut x = draw(self.setting.input, self.before + n + lag, &mut rng);
                let w: Vec<f64> = x
                    .iter()
                    .map(|&x| phi.value(x) + process_noise * normal(&mut rng))
                    .collect();
                let mut y = linear.simulate(&w).split_off(self.before + lag);
                y.iter_mut().for_each(|y| *y += noise * normal(&mut rng));
                x.truncate(self.before + n);
                (x.split_off(self.before), y)
            }
        }
    }
}

pub(super) fn draw(input: Input, n: usize, rng: &mut Pcg64) -> Vec<f64> {
    match input {
        Input::Uniform { range } => (0..n).map(|_| rng.random_range(-range..range)).collect(),
        Input::Gaussian => (0..n).map(|_| StandardNormal.sample(rng)).collect(),
        Input::StudentT => {
            // A normal over the root of a mean square of DEGREES others.
            let Ok(squares) = ChiSquared::new(DEGREES) else {
                return Vec::new();
            };
            (0..n)
                .map(|_| {
                    let normal: f64 = StandardNormal.sample(rng);
                    normal / (squares.sample(rng) / DEGREES).sqrt()
                })
                .collect()
        }
    }
}

/// (13) at one point, without a sort; NaN without data in reach.
fn estimate_at(kernel: Kernel, h: f64, at: f64, x: &[f64], y: &[f64]) -> f64 {
    let (mut weight, mut moment) = (0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        let k = kernel.weight((at - x) / h);
        weight += k;
        moment += k * y;
    }
    moment / weight
}

#[cfg(test)]
mod tests {
    use super::super::setting::Target;
    use super::*;
    use crate::linear::correlation::{mean, variance};
    use crate::systems::known_linear_parts;

    #[test]
    fn the_estimate_at_a_point_is_the_library_s() {
        let mut rng = Pcg64::seed_from_u64(1);
        let x = draw(Input::StudentT, 3000, &mut rng);
        let y: Vec<f64> = x.iter().map(|x| 3.0 + x.abs()).collect();
        let (kernel, bandwidth) = (Kernel::default(), 0.17);
        let fit = KernelRegression { kernel, bandwidth }.fit(&x, &y).unwrap();
        for at in [0.0, -0.4, 1.3, 40.0] {
            let (one, other) = (estimate_at(kernel, bandwidth, at, &x, &y), fit.value(at));
            assert!(
                (one - other).abs() < 1e-12 || (one.is_nan() && other.is_nan()),
                "{at}: {one} {other}"
            );
        }
    }

    #[test]
    fn inputs_have_the_density_they_claim() {
        for (input, spread) in [
            (Input::Uniform { range: 2.0 }, 4.0 / 3.0),
            (Input::Gaussian, 1.0),
            (Input::StudentT, 5.0 / 3.0),
        ] {
            assert!((input.expectation(|_| 1.0) - 1.0).abs() < 1e-9, "{input:?}");
            assert!((input.expectation(|x| x * x) - spread).abs() < 1e-6, "{input:?}");
            let x = draw(input, 200_000, &mut Pcg64::seed_from_u64(5));
            let share = x.iter().filter(|x| x.abs() < 0.7).count() as f64 / x.len() as f64;
            let expected = input.expectation(|x| f64::from(x.abs() < 0.7));
            assert!((share - expected).abs() < 4e-3, "{input:?}: {share} {expected}");
        }
    }

    #[test]
    fn hammerstein_pairs_obey_the_regression_equation() {
        // E(Y) = gain E phi + offset, and the covariance with phi(X) is the gain times its variance.
        let setting = Setting::at_worst_point(
            Target::Kink,
            Input::Uniform { range: 2.0 },
            DataSource::Hammerstein {
                linear: known_linear_parts()[0].clone(),
                lag: 2,
                process_noise: 0.1,
                noise: 0.1,
            },
        );
        let sampler = Sampler::new(&setting);
        let (x, y) = sampler.points(200_000, 3);
        assert_eq!((x.len(), y.len()), (200_000, 200_000));
        let w: Vec<f64> = x.iter().map(|x| x.abs()).collect();
        let OfTarget { gain, offset } = sampler.truth;
        assert!((mean(&y) - gain * mean(&w) - offset).abs() < 0.05);
        let (my, mw) = (mean(&y), mean(&w));
        let slope = y.iter().zip(&w).map(|(y, w)| (y - my) * (w - mw)).sum::<f64>() / (2e5 * variance(&w));
        assert!((slope - gain).abs() < 0.05, "{slope} {gain}");
    }
}
