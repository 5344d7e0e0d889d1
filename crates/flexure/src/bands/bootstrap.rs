//! Bands for any estimator by the bootstrap.
//!
//! The centre is the estimate corrected for its bias by the bootstrap (Haerdle & Bowman 1988; Hall & Horowitz 2013), which
//! for an estimator that is linear in the ordinates needs no resampling: with the fit S,
//! $$ \hat m_{bc} = 2 \hat m - S[\hat m(X)] = \hat m + S[Y - \hat m(X)] . $$
//! (Tukey's twicing.) For a kernel estimate this doubles the kernel's order; for a projection (a polynomial, a series,
//! a spline without penalty) it changes nothing, and such an estimate is to be given more terms than are best for its
//! error (undersmoothed). Every resample goes through the same correction, so that its variance counts, as in
//! robust bias correction. The residuals have lost what the fit took of the noise; how much is found by fitting known noise,
//! and the standard errors are widened by it.

use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::{Band, BandKind, automatic_block_length, check_level, seed_of, upper_quantile};
use crate::error::{Error, Result};
use crate::nonlinearity::{Estimator, Regression};

/// How an estimator is fitted to columns, ordinates and weights.
pub type Refit<'a> = dyn Fn(&[&[f64]], &[f64], Option<&[f64]>) -> Result<Box<dyn Regression>> + Sync + 'a;

/// Fits of known noise, which tell how much of the noise a fit takes.
const PROBES: usize = 16;
/// Resamples between two reports of progress.
const CHUNK: usize = 32;
/// The fewest points.
const FEWEST: usize = 5;

/// How the data are resampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Residuals keep their place and get random signs (Liu 1988; Davidson & Flachaire 2008): independent errors, whose
    /// variance may be any function of x.
    #[default]
    Wild,
    /// Blocks of successive points (Kuensch 1989): the points must be in the order of time, and stationary. The
    /// errors may depend on each other and on past x.
    MovingBlock {
        /// Points in a block, from 1 to half of all; from the residuals' autocorrelation
        /// ([`automatic_block_length`]) where none is given.
        length: Option<usize>,
    },
}

/// A band for any estimator by the bootstrap.
///
/// The parameter of the estimator must be fixed, for instance to the value that was chosen from the data: otherwise
/// it would be chosen anew for each resample.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `level` | nominal coverage | above 0, below 1 | 0.95 |
/// | `kind` | pointwise or simultaneous | | pointwise |
/// | `scheme` | what is resampled | | wild |
/// | `resamples` | their number | at least 2 / (1 - level) | 999 |
/// | `correct_bias` | whether the centre is corrected; without it the estimate must be undersmoothed | | true |
/// | `seed` | of the resamples | | 1 |
///
/// ```
/// use std::ops::ControlFlow;
/// use flexure::bands::BootstrapBand;
/// use flexure::nonlinearity::{Choice, NearestNeighbours};
/// let x: Vec<f64> = (0..200).map(|i| (i as f64 * 0.618) % 1.0).collect();
/// let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| x * x + 0.1 * (i as f64 * 1.7).sin()).collect();
/// let estimator = NearestNeighbours { neighbours: Choice::Fixed(30), ..NearestNeighbours::default() };
/// let method = BootstrapBand { resamples: 199, ..BootstrapBand::default() };
/// let band = method.for_estimator(&estimator, &[&x], &y, None, &[&[0.5]], &mut |_, _| ControlFlow::Continue(()))?;
/// assert!(band.lower[0] < 0.25 && 0.25 < band.upper[0]);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BootstrapBand {
    /// The nominal coverage.
    pub level: f64,
    /// Pointwise or simultaneous.
    pub kind: BandKind,
    /// How the data are resampled.
    pub scheme: Scheme,
    /// The number of resamples.
    pub resamples: usize,
    /// Whether the centre is corrected for bias.
    pub correct_bias: bool,
    /// The seed of the resamples.
    pub seed: u64,
}

impl Default for BootstrapBand {
    fn default() -> Self {
        BootstrapBand {
            level: 0.95,
            kind: BandKind::default(),
            scheme: Scheme::default(),
            resamples: 999,
            correct_bias: true,
            seed: 1,
        }
    }
}

impl BootstrapBand {
    /// [`run`](Self::run) for an estimator whose parameter is fixed.
    ///
    /// # Errors
    /// Those of `run`.
    pub fn for_estimator<E: Estimator + Clone + Sync>(
        &self,
        estimator: &E,
        x: &[&[f64]],
        y: &[f64],
        weights: Option<&[f64]>,
        at: &[&[f64]],
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Band> {
        let refit = |x: &[&[f64]], y: &[f64], w: Option<&[f64]>| estimator.clone().fit_boxed(x, y, w);
        self.run(&refit, x, y, weights, at, progress)
    }

    /// The band at the points whose coordinates are the columns `at`, for the fit that `refit` makes of columns,
    /// ordinates and weights.
    ///
    /// `progress` is called now and then with the resamples done and in all, and stops the computation by
    /// returning [`ControlFlow::Break`]. The result depends neither on it nor on the number of threads.
    ///
    /// NaN where the estimate is, and where it is so for more than half of the resamples.
    ///
    /// # Errors
    /// [`Error::InvalidParameter`] for a parameter outside its range, [`Error::TooShort`] with fewer than 5 points,
    /// [`Error::Stopped`] if `progress` stopped it, and all that `refit` and its predictions return.
    pub fn run(
        &self,
        refit: &Refit<'_>,
        x: &[&[f64]],
        y: &[f64],
        weights: Option<&[f64]>,
        at: &[&[f64]],
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Band> {
        check_level(self.level, self.resamples, "resamples")?;
        if y.len() < FEWEST {
            return Err(Error::TooShort {
                what: "a confidence band",
                need: FEWEST,
                got: y.len(),
            });
        }
        let sample = Sample {
            refit,
            x,
            at,
            correct_bias: self.correct_bias,
        };
        let estimate = refit(x, y, weights)?.predict(at)?;
        let original = sample.corrected(y, weights)?;
        let residuals: Vec<f64> = y.iter().zip(&original.fitted).map(|(y, m)| y - m).collect();
        let block = self.block_length(&residuals)?;
        let world = World {
            fitted: &original.fitted,
            residuals: &residuals,
            y,
            weights,
            block,
        };
        let total = PROBES + self.resamples;
        let mut rounds = Rounds {
            done: 0,
            total,
            progress,
        };

        let shares = rounds.run(PROBES, |k| {
            let (fitted, noisy) = (&world, world.wild(seed_of(!self.seed, k)));
            let again = sample.corrected(&noisy, weights)?;
            Ok(fitted.mean_square(noisy.iter().zip(&again.fitted).map(|(y, m)| y - m)))
        })?;
        let left = shares.iter().sum::<f64>() / PROBES as f64;
        let before = world.mean_square(residuals.iter().copied());
        // Fits that follow every point leave no residuals at all: nothing to widen.
        let widening = if left > 0.0 { (before / left).sqrt() } else { f64::NAN };

        let resamples = rounds.run(self.resamples, |k| world.resample(&sample, seed_of(self.seed, k)))?;
        let deviations: Vec<Vec<f64>> = resamples
            .into_iter()
            .map(|values| {
                values
                    .iter()
                    .zip(&original.at)
                    .map(|(v, m)| widening * (v - m))
                    .collect()
            })
            .collect();
        let errors: Vec<f64> = (0..original.at.len()).map(|j| spread(&deviations, j)).collect();
        let factor = self.factors(&deviations, &errors);
        let points = at.iter().map(|column| column.to_vec()).collect();
        Ok(Band::around(
            points,
            [estimate, original.at, errors],
            &factor,
            (self.level, self.kind),
            self.words(block),
        ))
    }

    fn block_length(&self, residuals: &[f64]) -> Result<Option<usize>> {
        match self.scheme {
            Scheme::Wild => Ok(None),
            Scheme::MovingBlock { length: None } => Ok(Some(automatic_block_length(residuals))),
            Scheme::MovingBlock { length: Some(length) } if length == 0 || length > residuals.len() / 2 => {
                Err(Error::InvalidParameter {
                    name: "the block length of the bootstrap".to_owned(),
                    value: length as f64,
                    requirement: "at least 1 and at most half the number of points",
                })
            }
            Scheme::MovingBlock { length } => Ok(length),
        }
    }

    /// By how many standard errors the deviations at each point, or the largest at once, are exceeded.
    fn factors(&self, deviations: &[Vec<f64>], errors: &[f64]) -> Vec<f64> {
        let studentised = |row: &[f64], j: usize| (row[j] / errors[j]).abs();
        match self.kind {
            BandKind::Pointwise => (0..errors.len())
                .map(|j| {
                    let at_j = deviations.iter().map(|row| studentised(row, j));
                    upper_quantile(&mut at_j.filter(|t| t.is_finite()).collect::<Vec<_>>(), self.level)
                })
                .collect(),
            BandKind::Simultaneous => {
                let largest = |row: &Vec<f64>| {
                    let at_all = (0..errors.len()).map(|j| studentised(row, j));
                    at_all.filter(|t| t.is_finite()).fold(0.0, f64::max)
                };
                let factor = upper_quantile(&mut deviations.iter().map(largest).collect::<Vec<_>>(), self.level);
                vec![factor; errors.len()]
            }
        }
    }

    fn words(&self, block: Option<usize>) -> String {
        let centre = if self.correct_bias {
            "bias corrected by the bootstrap"
        } else {
            "no bias correction"
        };
        match block {
            None => format!(
                "wild bootstrap, {} resamples, {centre}; errors independent",
                self.resamples
            ),
            Some(length) => format!(
                "moving block bootstrap, blocks of {length}, {} resamples, {centre}; errors may be dependent",
                self.resamples
            ),
        }
    }
}

/// The data's columns, where to predict, and how.
struct Sample<'a> {
    refit: &'a Refit<'a>,
    x: &'a [&'a [f64]],
    at: &'a [&'a [f64]],
    correct_bias: bool,
}

/// A corrected estimate.
struct Values {
    /// At the data.
    fitted: Vec<f64>,
    /// At the band's points.
    at: Vec<f64>,
}

impl Sample<'_> {
    /// The corrected estimate from the ordinates `y`.
    fn corrected(&self, y: &[f64], weights: Option<&[f64]>) -> Result<Values> {
        let once = (self.refit)(self.x, y, weights)?;
        let known = |fitted: Vec<f64>| -> Vec<f64> {
            // No estimate at a point of its own: its ordinate is all there is to say.
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

/// The world that the resamples are drawn from.
struct World<'a> {
    fitted: &'a [f64],
    residuals: &'a [f64],
    y: &'a [f64],
    weights: Option<&'a [f64]>,
    /// Points in a block, where blocks are resampled.
    block: Option<usize>,
}

impl World<'_> {
    /// The corrected estimate from one resample, at the band's points.
    fn resample(&self, sample: &Sample<'_>, seed: u64) -> Result<Vec<f64>> {
        let values = match self.block {
            None => sample.corrected(&self.wild(seed), self.weights)?,
            Some(length) => sample.corrected(self.y, Some(&self.blocks(length, seed)))?,
        };
        Ok(values.at)
    }

    /// The fitted values with the residuals under random signs.
    fn wild(&self, seed: u64) -> Vec<f64> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let sign = |e: f64, up: bool| if up { e } else { -e };
        let points = self.fitted.iter().zip(self.residuals);
        points.map(|(m, e)| m + sign(*e, rng.random())).collect()
    }

    /// How often each point is in as many blocks as make up a sample, times its weight.
    fn blocks(&self, length: usize, seed: u64) -> Vec<f64> {
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

/// The standard deviation of the deviations at point `j` from zero; NaN where more than half are missing.
fn spread(deviations: &[Vec<f64>], j: usize) -> f64 {
    let known = || deviations.iter().map(|row| row[j]).filter(|d| d.is_finite());
    let count = known().count();
    if 2 * count < deviations.len() {
        return f64::NAN;
    }
    (known().map(|d| d * d).sum::<f64>() / count as f64).sqrt()
}

/// Work in rounds of many threads, with a report after each.
struct Rounds<'a> {
    done: usize,
    total: usize,
    progress: &'a mut dyn FnMut(usize, usize) -> ControlFlow<()>,
}

impl Rounds<'_> {
    fn run<T: Send>(&mut self, count: usize, work: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
        let mut results = Vec::with_capacity(count);
        while results.len() < count {
            let part = results.len()..count.min(results.len() + CHUNK);
            let round: Result<Vec<T>> = part.clone().into_par_iter().map(&work).collect();
            results.extend(round?);
            self.done += part.len();
            if (self.progress)(self.done, self.total).is_break() && self.done < self.total {
                return Err(Error::Stopped {
                    done: self.done,
                    total: self.total,
                });
            }
        }
        Ok(results)
    }
}
