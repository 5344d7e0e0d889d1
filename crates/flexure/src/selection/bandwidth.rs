//! The bandwidth by leave-one-out cross-validation:
//! h minimises $\frac1n \sum_i (Y_i - m_{n,-i}(X_i))^2$, where m_{n,-i} is the estimate without point i.
//!
//! The search begins with a logarithmic grid, as the score may have several minima. Smaller steps around the best and the lowest point of a
//! parabola follow. Every bandwidth costs O(n) after one sort. With many points the search is made on data in bins, and exact scores around
//! the best then check it.

use super::grid::{BandwidthScores, Grid, lowest, scored};
use crate::error::{Error, Result};
use crate::nonlinearity::kernel::{BinnedScales, Degree, Kernel, Sorted, check_points, check_weights, leave_one_out};

/// Bandwidths of the logarithmic grid for binned scores, which cost little.
const BINNED_GRID: usize = 50;
/// From this number of points on, data are put in bins by default. The second limit is for the Gaussian, whose exact sums cost more.
const BINNED_FROM: usize = 200_000;
const BINNED_FROM_GAUSSIAN: usize = 20_000;
/// The least number of bins in a bandwidth. The Gaussian's bandwidth is not its reach.
const BINS: f64 = 30.0;
const BINS_GAUSSIAN: f64 = 12.0;
/// If binned scores have a relative difference of more than this from the exact ones, the search is made exactly.
const MOST_ERROR: f64 = 1e-3;

/// A candidate and its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The bandwidth, in the unit of x.
    pub bandwidth: f64,
    /// The mean squared leave-one-out error, in the squared unit of y.
    pub error: f64,
}

/// How the scores of a search are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scoring {
    /// Exactly below 200,000 points (Gaussian: 20,000) and with weights, otherwise as [`Binned`](Self::Binned).
    #[default]
    Automatic,
    /// Exactly, for any number of points.
    Exact,
    /// On data in bins of at most 1/30 of the bandwidth (Gaussian: 1/12); then exactly at the best bandwidth and its neighbours, and the
    /// best of these is chosen. If a binned score is off by more than 0.1 %, or if there are weights, the search is made exactly.
    Binned,
}

/// How the data were put in bins, and the loss of accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct Binning {
    /// The width of the narrowest bins, in the unit of x.
    pub narrowest: f64,
    /// The exact scores at the chosen bandwidth and around it, in order of bandwidth.
    pub exact: Vec<Score>,
    /// The largest relative difference between these and the binned scores.
    pub error: f64,
}

/// The whole search. Its result is part of every identification that used it.
#[derive(Debug, Clone, PartialEq)]
pub struct BandwidthSearch {
    /// The bandwidth with the smallest score.
    pub bandwidth: f64,
    /// All candidates in order of bandwidth.
    pub curve: Vec<Score>,
    /// Whether the best candidate is the smallest or the largest one tried, so that the minimum may
    /// lie beyond.
    pub at_edge: bool,
    /// Present if the scores of `curve` come from data in bins.
    pub binning: Option<Binning>,
}

impl BandwidthSearch {
    /// Searches for `kernel` over the points `(x[i], y[i])`.
    ///
    /// The result does not depend on the number of threads nor on the order of the points.
    ///
    /// # Errors
    /// [`crate::Error::Data`]: `TooShort` with fewer than 3 points, `LengthMismatch`, `NonFinite`.
    pub fn leave_one_out(kernel: Kernel, x: &[f64], y: &[f64]) -> Result<Self> {
        Self::search(kernel, Degree::Constant, x, y, None)
    }

    /// Searches for `kernel` and the local polynomial of this degree over the points `(x[i], y[i])`, weighted
    /// as by [`KernelRegression::fit_weighted`](crate::nonlinearity::KernelRegression::fit_weighted): the
    /// score is then sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i.
    ///
    /// # Errors
    /// Those of [`leave_one_out`](Self::leave_one_out), [`crate::Error::Parameter`] for a negative
    /// weight, and [`crate::Error::Data`]: `TooShort` with fewer than 3 points of positive weight.
    pub fn search(kernel: Kernel, degree: Degree, x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<Self> {
        let method = LeaveOneOut {
            kernel,
            degree,
            scoring: Scoring::Automatic,
        };
        method.search(x, y, weights)
    }

    /// [`search`](Self::search) over data that are sorted already.
    pub(crate) fn with_degree(kernel: Kernel, degree: Degree, data: &Sorted) -> Self {
        let method = LeaveOneOut {
            kernel,
            degree,
            scoring: Scoring::Automatic,
        };
        method.search_sorted(data)
    }
}

/// Cross-validation of the bandwidth.
///
/// | parameter | purpose | default |
/// |---|---|---|
/// | `kernel` | the weight function | Epanechnikov |
/// | `degree` | of the local polynomial | constant |
/// | `scoring` | exactly or on data in bins | exactly up to 200,000 points |
///
/// ```
/// use flexure::selection::{LeaveOneOut, Scoring};
/// let x: Vec<f64> = (0..500).map(|i| f64::from(i * 37 % 500) / 100.0).collect();
/// let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| x.sin() + 0.1 * (i as f64).cos()).collect();
/// let method = LeaveOneOut { scoring: Scoring::Exact, ..LeaveOneOut::default() };
/// let found = method.search(&x, &y, None)?;
/// let scores = method.exact_scores(&x, &y, None, &[0.5 * found.bandwidth, found.bandwidth])?;
/// assert!(scores[1].error < scores[0].error);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeaveOneOut {
    /// The weight function.
    pub kernel: Kernel,
    /// The degree of the local polynomial.
    pub degree: Degree,
    /// How the scores are summed.
    pub scoring: Scoring,
}

impl LeaveOneOut {
    /// Searches for the bandwidth over the points `(x[i], y[i])`, which may have weights.
    ///
    /// The result does not depend on the number of threads nor on the order of the points.
    ///
    /// # Errors
    /// Those of [`BandwidthSearch::search`].
    pub fn search(&self, x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<BandwidthSearch> {
        Ok(self.search_sorted(&sort(x, y, weights)?))
    }

    /// The exact scores of given bandwidths, in their order.
    ///
    /// # Errors
    /// Those of [`BandwidthSearch::search`], and [`crate::Error::Parameter`] for a bandwidth that is not
    /// positive and finite.
    pub fn exact_scores(
        &self,
        x: &[f64],
        y: &[f64],
        weights: Option<&[f64]>,
        bandwidths: &[f64],
    ) -> Result<Vec<Score>> {
        check_bandwidths(bandwidths)?;
        Ok(scored(bandwidths, self.exact(&sort(x, y, weights)?, bandwidths)))
    }

    /// The least number of bins in a bandwidth.
    fn bins(&self) -> f64 {
        if self.kernel == Kernel::Gaussian {
            BINS_GAUSSIAN
        } else {
            BINS
        }
    }

    fn exact(&self, data: &Sorted, bandwidths: &[f64]) -> Vec<f64> {
        leave_one_out(data, self.kernel, self.degree, bandwidths)
    }

    fn search_sorted(&self, data: &Sorted) -> BandwidthSearch {
        let gaussian = self.kernel == Kernel::Gaussian;
        let many = if gaussian { BINNED_FROM_GAUSSIAN } else { BINNED_FROM };
        let bins = match self.scoring {
            Scoring::Automatic => data.len() >= many,
            Scoring::Exact => false,
            Scoring::Binned => true,
        };
        let binned = (bins && !data.is_weighted())
            .then(|| self.binned_search(data, self.bins()))
            .filter(|search| search.binning.as_ref().is_some_and(|b| b.error <= MOST_ERROR));
        binned.unwrap_or_else(|| Grid::new(&data.x).search_by(|bandwidths| self.exact(data, bandwidths)))
    }

    /// The search on data in bins, and the exact scores around its result.
    fn binned_search(&self, data: &Sorted, bins: f64) -> BandwidthSearch {
        let grid = Grid::new(&data.x);
        let scales = BinnedScales::new(data, grid.smallest, grid.largest, bins);
        let binned = |bandwidths: &[f64]| scales.scores(self.kernel, self.degree, bandwidths);
        let BandwidthScores { scores: curve, at_edge } = grid.curve(BINNED_GRID, binned);
        let best = lowest(&curve);
        let (mut first, mut end) = (best.saturating_sub(1), curve.len().min(best + 2));
        let exact_at = |range: std::ops::Range<usize>| {
            let bandwidths: Vec<f64> = curve[range].iter().map(|c| c.bandwidth).collect();
            scored(&bandwidths, self.exact(data, &bandwidths))
        };
        let mut exact = exact_at(first..end);
        // Goes on as long as the exact scores fall.
        loop {
            let best = lowest(&exact);
            if best == 0 && first > 0 {
                first -= 1;
                exact.splice(0..0, exact_at(first..first + 1));
            } else if best + 1 == exact.len() && end < curve.len() {
                end += 1;
                exact.extend(exact_at(end - 1..end));
            } else {
                break;
            }
        }
        // Scores that cannot be compared fail the test of accuracy.
        let error = |(binned, exact): (&Score, &Score)| {
            let error = (binned.error / exact.error - 1.0).abs();
            if error.is_nan() { f64::INFINITY } else { error }
        };
        let errors = curve[first..end].iter().zip(&exact).map(error);
        BandwidthSearch {
            bandwidth: exact[lowest(&exact)].bandwidth,
            at_edge,
            binning: Some(Binning {
                narrowest: scales.narrowest(),
                error: errors.fold(0.0, f64::max),
                exact,
            }),
            curve,
        }
    }
}

fn check_bandwidths(bandwidths: &[f64]) -> Result<()> {
    let bad = bandwidths.iter().find(|h| !(**h > 0.0 && h.is_finite()));
    bad.map_or(Ok(()), |bandwidth| {
        Err(Error::parameter("the bandwidth", *bandwidth, "positive and finite"))
    })
}

/// The points in order, checked.
fn sort(x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<Sorted> {
    check_points(x, y, 3)?;
    if let Some(weights) = weights {
        check_weights(weights, x.len(), 3)?;
    }
    Ok(Sorted::new(x, y, weights))
}

#[cfg(test)]
#[path = "bandwidth_tests.rs"]
mod tests;
