//! A parameter of any estimator by cross-validation over blocks of time.

use super::Search;
use super::h_block::gap_from_data;
use super::search::FLAT;
use crate::error::{Error, ParameterError, Result, Stopped};
use crate::interrupt;
use crate::nonlinearity::{
    Choice, Estimator, HaarRegression, KernelRegression, NearestNeighbours, Points, PolynomialRegression,
    RecursiveRegression, Regression, SeriesRegression, SplineRegression,
};
use crate::parallel;

/// An estimator with one parameter that data can choose.
pub trait Tunable: Estimator + Clone + Sync {
    /// The type of the parameter that is chosen.
    type Parameter: Copy + std::fmt::Debug + Send + Sync;

    /// The estimator with its parameter fixed.
    #[must_use]
    fn with(&self, parameter: Self::Parameter) -> Self;

    /// The values that the estimator itself would try on these data, in order. There are at most 64, the first ones, as each needs a refit.
    /// If the estimator makes no choice of its own, there is one value.
    ///
    /// # Errors
    /// Those of [`Estimator::fit`].
    fn candidates(&self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Vec<Self::Parameter>>;
}

/// The estimators that search on their own: the field that is chosen, and its type.
macro_rules! tunable {
    ($($estimator:ident . $field:ident: $parameter:ty),+ $(,)?) => {$(
        impl Tunable for $estimator {
            type Parameter = $parameter;

            fn with(&self, parameter: $parameter) -> Self {
                $estimator { $field: Choice::Fixed(parameter), ..*self }
            }

            fn candidates(&self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Vec<$parameter>> {
                let searching = $estimator { $field: Choice::default(), ..*self };
                let fit = searching.fit(x, y, weights)?;
                Ok(fit.search().map_or_else(Vec::new, Search::for_refits))
            }
        }
    )+};
}

tunable!(
    NearestNeighbours.neighbours: usize,
    SeriesRegression.terms: usize,
    HaarRegression.levels: usize,
    PolynomialRegression.degree: usize,
    SplineRegression.penalty: f64,
    RecursiveRegression.bandwidth: f64,
);

/// The parameter is the bandwidth. The candidates are the given one, and this one halved and doubled up to three times.
impl Tunable for KernelRegression {
    type Parameter = f64;

    fn with(&self, bandwidth: f64) -> Self {
        KernelRegression { bandwidth, ..*self }
    }

    fn candidates(&self, _: &[&[f64]], _: &[f64], _: Option<&[f64]>) -> Result<Vec<f64>> {
        Ok((-6..=6).map(|k| self.bandwidth * (0.5 * f64::from(k)).exp2()).collect())
    }
}

/// Cross-validation over contiguous blocks of time. A refit predicts every block from the samples that are more than `gap` samples away
/// from it (Burman, Chow and Nolan 1994; Racine 2000).
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `folds` | the number of blocks | 2 to the number of samples | 10 |
/// | `gap` | samples left out on either side of a block | small enough that every refit keeps samples | 0; [`BlockFolds::for_data`] |
///
/// ```
/// use flexure::nonlinearity::{Basis, SeriesRegression};
/// use flexure::selection::BlockFolds;
/// let x: Vec<f64> = (0..400).map(|i| ((i * 37) % 400) as f64 / 200.0 - 1.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x * x * x - x).collect();
/// let method = SeriesRegression { basis: Basis::Legendre, ..Default::default() };
/// let search = BlockFolds::default().search(&method, &[&x], &y, None)?;
/// assert!(search.parameter >= 4); // a cubic has four terms
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockFolds {
    /// The number of blocks.
    pub folds: usize,
    /// Samples left out on either side of a block.
    pub gap: usize,
}

impl Default for BlockFolds {
    fn default() -> Self {
        BlockFolds { folds: 10, gap: 0 }
    }
}

/// A candidate and its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldScore<P> {
    /// The parameter's value.
    pub parameter: P,
    /// The weighted mean squared error of the predictions, in the squared unit of y; infinite if a refit had too few data for this value.
    pub error: f64,
    /// The standard error of `error`, from its scatter over the blocks.
    pub standard_error: f64,
}

/// The whole search over blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldSearch<P> {
    /// The value with the smallest score. If scores are equal, it is the first.
    pub parameter: P,
    /// All candidates in the given order.
    pub curve: Vec<FoldScore<P>>,
    /// Whether the best is the first or the last candidate, so that the minimum may lie beyond.
    pub at_edge: bool,
    /// The blocks.
    pub folds: BlockFolds,
}

impl BlockFolds {
    /// Ten blocks (with fewer samples, one block for each) and a gap from `x` and `y`, in the order of time. The gap is one less than the
    /// first lag at which the autocorrelation of the ordinates about an oversmoothed estimate is within its 95 % limits. It is at most a
    /// tenth of the samples and at most 200.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`, `NonFinite`, `TooShort` with fewer than 3 samples.
    pub fn for_data(x: &[f64], y: &[f64]) -> Result<Self> {
        crate::nonlinearity::kernel::check_points(x, y, 3)?;
        Ok(BlockFolds {
            folds: BlockFolds::default().folds.min(x.len()),
            gap: gap_from_data(x, y),
        })
    }

    /// Searches among the values that the estimator itself would try.
    ///
    /// # Errors
    /// Those of [`choose`](Self::choose).
    pub fn search<E: Tunable>(
        &self,
        estimator: &E,
        x: &[&[f64]],
        y: &[f64],
        weights: Option<&[f64]>,
    ) -> Result<FoldSearch<E::Parameter>> {
        let candidates = estimator.candidates(x, y, weights)?;
        self.choose(&candidates, |p| estimator.with(p), x, y, weights)
    }

    /// Searches among `candidates`; `estimator` makes the estimator for each. The samples are in the order of time.
    ///
    /// If the refit predicts nothing for a sample, the mean of the refit's samples predicts it. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the number of blocks, for a gap that leaves no samples for a refit, and without candidates; the errors of
    /// [`Estimator::fit`]. One of them is an exception: a candidate for which some refit has too few data ([`Error::Parameter`]:
    /// `BeyondData`) gets an infinite score, as long as another candidate is left.
    pub fn choose<P: Copy + Send + Sync, E: Estimator>(
        &self,
        candidates: &[P],
        estimator: impl Fn(P) -> E + Sync,
        x: &[&[f64]],
        y: &[f64],
        weights: Option<&[f64]>,
    ) -> Result<FoldSearch<P>> {
        let blocks = self.blocks(x, y, weights)?;
        let jobs: Vec<(usize, usize)> = (0..candidates.len())
            .flat_map(|c| (0..blocks.len()).map(move |b| (c, b)))
            .collect();
        let interrupt = interrupt::current();
        let errors = parallel::batch(&jobs, |&(c, b)| match interrupt.is_requested() {
            true => Err(Error::Stopped(Stopped::Interrupted)),
            false => blocks[b].error(estimator(candidates[c])),
        });
        let total: f64 = blocks.iter().map(|b| b.weight).sum();
        let mut curve = Vec::with_capacity(candidates.len());
        let mut refused = None;
        for (parameter, errors) in candidates.iter().zip(errors.chunks(blocks.len())) {
            let mut score = FoldScore {
                parameter: *parameter,
                error: f64::INFINITY,
                standard_error: f64::INFINITY,
            };
            match errors.iter().cloned().collect::<Result<Vec<f64>>>() {
                Ok(sums) => score = score.of_blocks(&sums, &blocks, total),
                Err(error @ Error::Parameter(ParameterError::BeyondData { .. })) => refused = Some(error),
                Err(error) => return Err(error),
            }
            curve.push(score);
        }
        let best = (0..curve.len())
            .min_by(|&i, &j| curve[i].error.total_cmp(&curve[j].error))
            .filter(|&i| curve[i].error < f64::INFINITY);
        let Some(best) = best else {
            return Err(refused.unwrap_or(Error::parameter("the number of candidates", 0.0, "at least one")));
        };
        let last = curve.len() - 1;
        let steeper = |i: usize| curve[i].error - curve[best].error > FLAT * curve[i].error;
        Ok(FoldSearch {
            parameter: curve[best].parameter,
            at_edge: last > 0 && (best == 0 && steeper(1) || best == last && steeper(last - 1)),
            curve,
            folds: *self,
        })
    }

    fn blocks(&self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Vec<Block>> {
        let n = y.len();
        if !(2..=n.max(2)).contains(&self.folds) {
            return Err(Error::parameter(
                "the number of folds",
                self.folds as f64,
                "at least 2 and at most the number of samples",
            ));
        }
        // This also checks the samples that are only predicted, so that the error names a bad sample by its place in the record.
        Points::new("block cross-validation", x.len().max(1), x, y, weights)?;
        (0..self.folds)
            .map(|k| {
                let (start, end) = (k * n / self.folds, (k + 1) * n / self.folds);
                let before = start.saturating_sub(self.gap);
                let after = end.saturating_add(self.gap).min(n);
                let inside = |v: &[f64]| v[start..end].to_vec();
                let outside = |v: &[f64]| [&v[..before], &v[after..]].concat();
                let block = Block {
                    x: x.iter().map(|c| inside(c)).collect(),
                    y: inside(y),
                    w: weights.map_or_else(|| vec![1.0; end - start], inside),
                    train_x: x.iter().map(|c| outside(c)).collect(),
                    train_y: outside(y),
                    train_w: weights.map_or_else(|| vec![1.0; before + n - after], outside),
                    weight: 0.0,
                };
                if !block.train_w.iter().any(|w| *w > 0.0) {
                    return Err(Error::parameter(
                        "the gap",
                        self.gap as f64,
                        "small enough to leave samples of positive weight outside every block",
                    ));
                }
                let weight = block.w.iter().sum();
                Ok(Block { weight, ..block })
            })
            .collect()
    }
}

/// One block and the samples that predict it.
struct Block {
    x: Vec<Vec<f64>>,
    y: Vec<f64>,
    w: Vec<f64>,
    train_x: Vec<Vec<f64>>,
    train_y: Vec<f64>,
    train_w: Vec<f64>,
    weight: f64,
}

impl Block {
    /// The weighted sum of the squared errors of prediction.
    fn error(&self, estimator: impl Estimator) -> Result<f64> {
        let fit = estimator.fit(&slices(&self.train_x), &self.train_y, Some(&self.train_w))?;
        let predicted = fit.predict(&slices(&self.x))?;
        let total: f64 = self.train_w.iter().sum();
        let mean = self.train_y.iter().zip(&self.train_w).map(|(y, w)| w * y).sum::<f64>() / total;
        let errors = predicted.iter().zip(&self.y).zip(&self.w).map(|((m, y), w)| {
            let m = if m.is_finite() { *m } else { mean };
            w * (y - m).powi(2)
        });
        Ok(errors.sum())
    }
}

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

impl<P> FoldScore<P> {
    /// The mean squared error and its standard error, from the sums over the blocks.
    fn of_blocks(self, sums: &[f64], blocks: &[Block], total: f64) -> Self {
        let mean = sums.iter().sum::<f64>() / total;
        let folds = blocks.len() as f64;
        let scatter: f64 = sums
            .iter()
            .zip(blocks)
            .map(|(s, b)| (s - mean * b.weight).powi(2))
            .sum();
        FoldScore {
            error: mean,
            standard_error: (scatter * folds / (folds - 1.0)).sqrt() / total,
            ..self
        }
    }
}

#[cfg(test)]
#[path = "folds_tests.rs"]
mod tests;
