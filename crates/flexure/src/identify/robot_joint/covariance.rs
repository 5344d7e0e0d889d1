//! Standard errors that hold for any spectrum of the noise.
//!
//! If the weights are right, the covariance is the inverse C of the normal matrix. Otherwise it is $C M C$, where M is the
//! covariance of the moments (the products of columns and residuals). M is estimated twice: from the residuals' spectrum (White
//! 1980, in frequency) and from the scatter of the moments over time ([`over_time`]). The largest of the three variances is used.

use super::bursts::over_time;
use super::equations::{Equations, Lines, Solution};
use super::limits::{FEWEST_SMOOTHED, LEAST_REMAINDER, LEAST_WHITE, SMOOTHED_SHARE, WHITE_ROUNDS, WHITE_SETTLED};
use super::normal::Covariance;
use crate::linalg::{Complex, Matrix, product};
use crate::parallel;

/// The errors of a solution for any spectrum of the noise.
pub(super) struct Robust {
    pub covariance: Covariance,
    /// The mean decrease of the weighted sum of squares by the unknowns due to chance: their number, if the weights are right.
    pub taken: f64,
}

impl Equations<'_> {
    /// The mean square of the noise in each line of each block, from the residuals divided by one minus the line's leverage
    /// (MacKinnon & White 1985, HC2).
    ///
    /// Fine curves follow the few lines of low frequencies, which have the largest weights. Without the division, these would seem free of
    /// noise.
    pub fn powers(&self, solution: &Solution) -> Vec<Vec<f64>> {
        let n = self.columns.len();
        let c = &solution.covariance;
        let blocks = self.noise.iter().zip(&solution.residuals).enumerate();
        blocks
            .map(|(block, (noise, residuals))| {
                let own: Vec<(usize, &[Complex<f64>])> = (0..n)
                    .filter_map(|i| Some((i, self.columns[i][block].as_deref()?)))
                    .collect();
                parallel::map(noise.len(), |k| {
                    let mut taken = 0.0;
                    for &(i, a) in &own {
                        let (re, im) = own.iter().fold((0.0, 0.0), |(re, im), &(j, b)| {
                            (re + c.at(i, j) * b[k].re, im + c.at(i, j) * b[k].im)
                        });
                        taken += a[k].re * re + a[k].im * im;
                    }
                    // For the line's two real equations, each with half the noise.
                    residuals[k].norm_sqr() / (1.0 - taken / noise[k]).max(LEAST_REMAINDER)
                })
            })
            .collect()
    }

    /// The covariance of the moments for errors of these mean squares of each line.
    pub fn moment_covariance(&self, powers: &[Vec<f64>]) -> Matrix {
        let blocks = self.noise.iter().zip(powers);
        let weights: Vec<Vec<f64>> = blocks
            .map(|(s, power)| {
                let power = smoothed(power);
                s.iter().zip(&power).map(|(s, p)| 2.0 * p / (s * s)).collect()
            })
            .collect();
        self.products(&weights)
    }

    /// The errors of a solution for any spectrum of the noise.
    pub fn robust(&self, solution: &Solution) -> Robust {
        let c = &solution.covariance.0;
        let by_frequency = product(c, &self.moment_covariance(&self.powers(solution)));
        let by_time = product(c, &over_time(self, &solution.residuals));
        let [robust, scatter] = [&by_frequency, &by_time].map(|moments| product(moments, c));
        let grow: Vec<f64> = (0..c.nrows())
            .map(|i| {
                let largest = c[(i, i)].max(scatter[(i, i)]);
                (largest / robust[(i, i)].max(f64::MIN_POSITIVE)).sqrt().max(1.0)
            })
            .collect();
        let mut covariance = robust.map_with_location(|i, j, v| v * grow[i] * grow[j]);
        for given in &self.given {
            let column: Vec<Option<&Lines>> = given.iter().map(Option::as_ref).collect();
            let moved = product(c, &Matrix::from_vec(c.nrows(), 1, self.moments_with(&column)));
            covariance += product(&moved, &moved.transpose());
        }
        Robust {
            covariance: Covariance(covariance),
            taken: by_time.trace().max(by_frequency.trace()),
        }
    }
}

/// The running mean over a fiftieth of the lines.
fn smoothed(powers: &[f64]) -> Vec<f64> {
    let n = powers.len();
    let half = (n / SMOOTHED_SHARE).max(FEWEST_SMOOTHED).min(n / 2);
    let mut sums = vec![0.0];
    for p in powers {
        sums.push(sums[sums.len() - 1] + p);
    }
    (0..n)
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(n));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// The spectrum of an equation's noise, from its residuals: the sum of a white part and a known part.
///
/// The white part follows by Whittle's likelihood.
pub(super) fn fitted_noise(residuals: &[Complex<f64>], known: &[f64]) -> Vec<f64> {
    let power: Vec<f64> = residuals.iter().map(|r| r.norm_sqr()).collect();
    fitted_to_power(&power, known)
}

/// [`fitted_noise`] from the mean squares of the lines.
pub(super) fn fitted_to_power(power: &[f64], known: &[f64]) -> Vec<f64> {
    let n = power.len() as f64;
    let mean = power.iter().sum::<f64>() / n;
    let floor = LEAST_WHITE * mean + f64::MIN_POSITIVE;
    let mut white = mean.max(floor);
    for _ in 0..WHITE_ROUNDS {
        let (mut above, mut below) = (0.0, 0.0);
        for (p, k) in power.iter().zip(known) {
            let s = white + k;
            above += p / (s * s);
            below += 1.0 / s;
        }
        let next = (white * (above / below).sqrt()).max(floor);
        let settled = (next - white).abs() < WHITE_SETTLED * white;
        white = next;
        if settled {
            break;
        }
    }
    known.iter().map(|k| white + k).collect()
}
