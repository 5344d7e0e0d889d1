//! Bands for any estimator by the bootstrap.
//!
//! The centre is the estimate corrected for its bias by the bootstrap (Haerdle & Bowman 1988; Hall & Horowitz 2013), which
//! for an estimator that is linear in the ordinates needs no resampling: with the fit S,
//! $$ \hat m_{bc} = 2 \hat m - S[\hat m(X)] = \hat m + S[Y - \hat m(X)] . $$
//! (Tukey's twicing.) For a kernel estimate this doubles the kernel's order; for a projection (a polynomial, a series,
//! a spline without penalty) it changes nothing, so such an estimate needs more terms than those of smallest error (undersmoothing). Every
//! resample goes through the same correction, so that its variance counts, as in robust bias correction.
//!
//! The residuals lack the part of the noise that the fit follows. Fits of known noise show how large it is; the standard errors are widened
//! accordingly. They also show how many observations, N(x) = 1 / sum_i l_i(x)^2, the estimate at x is worth: quantiles are those of
//! Student's distribution with N degrees of freedom, at most the number of blocks.

use std::ops::ControlFlow;

use super::resample::{Known, Resampler, Rounds, Sample};
use super::{Band, BandKind, automatic_block_length, check_level, seed_of, student, upper_quantile};
use crate::error::{Error, Result};
use crate::nonlinearity::{Estimator, Regression};

/// How an estimator is fitted to columns, ordinates and weights.
pub type Refit<'a> = dyn Fn(&[&[f64]], &[f64], Option<&[f64]>) -> Result<Box<dyn Regression>> + Sync + 'a;

/// Fits of known noise.
const PROBES: usize = 16;
/// The fewest points.
const FEWEST: usize = 5;

/// How the data are resampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Points are drawn one by one (Efron 1979; Freedman 1981): independent points, whose errors' variance may be any
    /// function of x. The x are drawn too. So the band also holds for local means (kernel of degree 0, nearest neighbours) on a steep m,
    /// whose error comes from the uneven x as much as from the noise.
    #[default]
    Pairs,
    /// The x stay, and residuals keep their place and get random signs (Liu 1988; Davidson & Flachaire 2008): independent
    /// errors, whose variance may be any function of x; x may be anything, for instance a plan.
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
/// The parameter of the estimator must be fixed, for instance to the value that was chosen from the data: otherwise it would be chosen
/// again for each resample.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `level` | nominal coverage | above 0, below 1 | 0.95 |
/// | `kind` | pointwise or simultaneous | | pointwise |
/// | `scheme` | what is resampled | | pairs |
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
    /// `progress` is called now and then with the numbers of resamples, done and all, and stops the computation by returning
    /// [`ControlFlow::Break`]. The result depends neither on it nor on the number of threads.
    ///
    /// The band is NaN where the estimate is NaN, and where more than half of the resampled estimates are.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter outside its range, [`Error::Data`]: `TooShort` with fewer than 5 points,
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
            return Err(Error::too_short("a confidence band", FEWEST, y.len()));
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
        let resampler = Resampler {
            fitted: &original.fitted,
            residuals: &residuals,
            y,
            weights,
            scheme: self.scheme,
            block,
        };
        let mut rounds = Rounds {
            done: 0,
            total: 2 * PROBES + self.resamples,
            progress,
        };
        let probes = rounds.run(PROBES, 2, |k| resampler.probe(&sample, seed_of(!self.seed, k)))?;
        let blocks = block.map_or(f64::INFINITY, |length| y.len() as f64 / length as f64);
        let known = Known::new(&probes, blocks);
        let resamples = rounds.run(self.resamples, 1, |k| {
            resampler.resample(&sample, seed_of(self.seed, k))
        })?;
        let deviation = |(v, m): (&f64, &f64)| known.widening * (v - m);
        let of_resample = |values: &Vec<f64>| values.iter().zip(&original.at).map(deviation).collect();
        let deviations: Vec<Vec<f64>> = resamples.iter().map(of_resample).collect();
        let band = Band {
            x: at.iter().map(|column| column.to_vec()).collect(),
            estimate,
            standard_error: (0..original.at.len()).map(|j| spread(&deviations, j)).collect(),
            centre: original.at,
            lower: Vec::new(),
            upper: Vec::new(),
            level: self.level,
            kind: self.kind,
            method: self.description(block),
        };
        let factors = self.factors(&deviations, &band.standard_error);
        let factors = factors.iter().zip(&known.freedom).map(|(f, n)| student(*f, *n));
        let factors: Vec<f64> = factors.collect();
        Ok(band.with_limits(&factors))
    }

    fn block_length(&self, residuals: &[f64]) -> Result<Option<usize>> {
        match self.scheme {
            Scheme::Pairs | Scheme::Wild => Ok(None),
            Scheme::MovingBlock { length: None } => Ok(Some(automatic_block_length(residuals))),
            Scheme::MovingBlock { length: Some(length) } if length == 0 || length > residuals.len() / 2 => {
                Err(Error::parameter(
                    "the block length of the bootstrap",
                    length as f64,
                    "at least 1 and at most half the number of points",
                ))
            }
            Scheme::MovingBlock { length } => Ok(length),
        }
    }

    /// The quantiles of the deviations in standard errors: at each point, or of the largest over all points.
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

    fn description(&self, block: Option<usize>) -> String {
        let centre = if self.correct_bias {
            "bias corrected by the bootstrap"
        } else {
            "no bias correction"
        };
        let (name, errors) = match (self.scheme, block) {
            (Scheme::Pairs, _) => ("bootstrap of pairs".to_owned(), "errors independent"),
            (Scheme::Wild, _) => ("wild bootstrap".to_owned(), "errors independent"),
            (Scheme::MovingBlock { .. }, length) => (
                format!("moving block bootstrap, blocks of {}", length.unwrap_or(1)),
                "errors may be dependent",
            ),
        };
        format!("{name}, {} resamples, {centre}; {errors}", self.resamples)
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
