//! Resamples, and the corrected estimates from them.

use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::bootstrap::{Refit, Scheme};
use crate::error::{Error, Result, Stopped};
use crate::parallel;

/// If the residuals keep less than this share of the noise, they show nothing about it.
const NOTHING_LEFT: f64 = 1e-6;
/// Resamples between two reports of progress.
const CHUNK: usize = 32;

/// The data's columns, where to predict, and how.
pub(super) struct Sample<'a> {
    pub refit: &'a Refit<'a>,
    pub x: &'a [&'a [f64]],
    pub at: &'a [&'a [f64]],
    pub correct_bias: bool,
}

/// A corrected estimate.
pub(super) struct Values {
    /// At the data.
    pub fitted: Vec<f64>,
    /// At the band's points.
    pub at: Vec<f64>,
}

impl Sample<'_> {
    /// The corrected estimate from the ordinates `y`.
    pub fn corrected(&self, y: &[f64], weights: Option<&[f64]>) -> Result<Values> {
        let once = (self.refit)(self.x, y, weights)?;
        let known = |fitted: Vec<f64>| -> Vec<f64> {
            // At a lone point there is no estimate, and only its ordinate is known.
            fitted
                .iter()
                .zip(y)
                .map(|(m, y)| if m.is_finite() { *m } else { *y })
                .collect()
        };
        let fitted = known(once.predict(self.x)?);
        let at = once.predict(self.at)?;
        if !self.correct_bias {
            return Ok(Values { fitted, at });
        }
        let twice = (self.refit)(self.x, &fitted, weights)?;
        let minus = |once: &[f64], twice: Vec<f64>| once.iter().zip(twice).map(|(a, b)| 2.0 * a - b).collect();
        Ok(Values {
            at: minus(&at, twice.predict(self.at)?),
            fitted: known(minus(&fitted, twice.predict(self.x)?)),
        })
    }
}

/// The data from which resamples are drawn.
pub(super) struct Resampler<'a> {
    pub fitted: &'a [f64],
    pub residuals: &'a [f64],
    pub y: &'a [f64],
    pub weights: Option<&'a [f64]>,
    pub scheme: Scheme,
    /// Points in a block, if blocks are resampled.
    pub block: Option<usize>,
}

impl Resampler<'_> {
    /// The corrected estimate from one resample, at the band's points.
    pub fn resample(&self, sample: &Sample<'_>, seed: u64) -> Result<Vec<f64>> {
        let values = match self.scheme {
            Scheme::Wild => {
                let signs = random_signs(self.y.len(), seed);
                let errors = self.residuals.iter().zip(signs).map(|(e, sign)| e * sign);
                sample.corrected(&self.plus(errors), self.weights)?
            }
            Scheme::Pairs | Scheme::MovingBlock { .. } => {
                let counts = self.counts(self.block.unwrap_or(1), seed);
                sample.corrected(self.y, Some(&counts))?
            }
        };
        Ok(values.at)
    }

    /// The fit of noise of random sign and equal size: half the difference of two fits with opposite noise, so that only noise is left.
    pub fn probe(&self, sample: &Sample<'_>, seed: u64) -> Result<Probe> {
        let size = self.mean_square(self.residuals.iter().copied()).sqrt();
        let signs = random_signs(self.y.len(), seed);
        let fit = |up: f64| sample.corrected(&self.plus(signs.iter().map(|sign| up * size * sign)), self.weights);
        let (above, below) = (fit(1.0)?, fit(-1.0)?);
        let half = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a - b) / size).collect() };
        let fitted = half(&above.fitted, &below.fitted);
        Ok(Probe {
            left: self.mean_square(signs.iter().zip(fitted).map(|(sign, m)| sign - m)),
            at: half(&above.at, &below.at),
        })
    }

    /// The fitted values with these errors.
    fn plus(&self, errors: impl Iterator<Item = f64>) -> Vec<f64> {
        self.fitted.iter().zip(errors).map(|(m, e)| m + e).collect()
    }

    /// How often each point is in the blocks that make up a sample, times its weight.
    fn counts(&self, length: usize, seed: u64) -> Vec<f64> {
        let n = self.y.len();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut counts = vec![0.0; n];
        let mut left = n;
        while left > 0 {
            let start = rng.random_range(0..=n - length);
            let count = length.min(left);
            counts[start..start + count].iter_mut().for_each(|c| *c += 1.0);
            left -= count;
        }
        if let Some(weights) = self.weights {
            counts.iter_mut().zip(weights).for_each(|(c, w)| *c *= w);
        }
        counts
    }

    /// The weighted mean of squares.
    fn mean_square(&self, values: impl Iterator<Item = f64>) -> f64 {
        let weight = |i: usize| self.weights.map_or(1.0, |w| w[i]);
        let (sum, total) = values
            .enumerate()
            .fold((0.0, 0.0), |(s, t), (i, v)| (s + weight(i) * v * v, t + weight(i)));
        sum / total
    }
}

/// The fit of noise of unit size.
pub(super) struct Probe {
    /// The mean square of the residuals.
    left: f64,
    /// The fit at the band's points.
    at: Vec<f64>,
}

/// The results of the probes.
pub(super) struct Known {
    /// The factor by which the noise is greater than the residuals.
    pub widening: f64,
    /// Degrees of freedom of the standard error at each of the band's points.
    pub freedom: Vec<f64>,
}

impl Known {
    /// `most` limits the degrees of freedom.
    pub fn new(probes: &[Probe], most: f64) -> Self {
        let mean = |of: &dyn Fn(&Probe) -> f64| probes.iter().map(of).sum::<f64>() / probes.len() as f64;
        let points = probes.first().map_or(0, |probe| probe.at.len());
        let left = mean(&|probe| probe.left);
        Known {
            // A fit that follows every point says nothing about the noise.
            widening: if left > NOTHING_LEFT {
                left.sqrt().recip()
            } else {
                f64::NAN
            },
            freedom: (0..points)
                .map(|j| mean(&|probe| probe.at[j].powi(2)).recip().clamp(1.0, most.max(1.0)))
                .collect(),
        }
    }
}

/// 1 and -1 at random.
fn random_signs(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect()
}

/// Work in rounds of many threads, with a report after each.
pub(super) struct Rounds<'a> {
    pub done: usize,
    pub total: usize,
    pub progress: &'a mut dyn FnMut(usize, usize) -> ControlFlow<()>,
}

impl Rounds<'_> {
    /// The results of `count` pieces of work, each as much as that many resamples.
    pub fn run<T: Send>(
        &mut self,
        count: usize,
        resamples: usize,
        work: impl Fn(usize) -> Result<T> + Sync,
    ) -> Result<Vec<T>> {
        let mut results = Vec::with_capacity(count);
        while results.len() < count {
            let part = results.len()..count.min(results.len() + CHUNK);
            for result in parallel::map(part.len(), |k| work(part.start + k)) {
                results.push(result?);
            }
            self.done += part.len() * resamples;
            if (self.progress)(self.done, self.total).is_break() && self.done < self.total {
                return Err(Error::Stopped(Stopped::Sampling {
                    done: self.done,
                    total: self.total,
                }));
            }
        }
        Ok(results)
    }
}
