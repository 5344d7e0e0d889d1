//! From the sums to the estimate: the bandwidth by cross-validation over the folds, the estimate at the bins' means, and a band
//! from the scatter of the folds' own estimates.

use super::{FOLDS, Folds, StreamedRegression};
use crate::distributions::student_quantile;
use crate::error::{DataError, Error, Result};
use crate::interrupt;
use crate::nonlinearity::estimator::{Regression, check_queries};
use crate::nonlinearity::kernel::bin::{Bin, squares_about};
use crate::nonlinearity::kernel::{Degree, Kernel, KernelFit, KernelRegression, Sorted, for_each_sum};
use crate::parallel;
use crate::selection::{BandwidthSearch, Grid};

/// The least number of bins in a bandwidth that is chosen. The estimate at their means is then off by less than a thousandth of the
/// smoothing bias. The Gaussian's bandwidth is not its reach.
const BINS: f64 = 30.0;
const BINS_GAUSSIAN: f64 = 12.0;
/// The least number of folds with data for a standard error.
const FEWEST_FOLDS: usize = 3;

/// A kernel regression from sums over a record.
#[derive(Debug, Clone)]
pub struct StreamedFit {
    fit: KernelFit,
    /// The same fit from each fold alone. Folds without data are left out.
    folds: Vec<KernelFit>,
    search: Option<BandwidthSearch>,
    bin_width: f64,
    count: u64,
    /// The ordinates' variance.
    variance: f64,
}

/// A band around an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamedBand {
    /// The lower edge; NaN where it is not known.
    pub lower: Vec<f64>,
    /// The upper edge.
    pub upper: Vec<f64>,
    /// The estimate minus its estimated smoothing bias. It is the middle of the band.
    pub centre: Vec<f64>,
    /// The centre's standard error.
    pub standard_error: Vec<f64>,
}

impl StreamedRegression {
    /// The regression with this bandwidth, in the unit of x; `None` chooses it by cross-validation over the folds.
    ///
    /// # Errors
    /// [`Error::Data`]: `TooShort` with fewer than 3 rows, or with rows of a single fold where the bandwidth is to be chosen;
    /// `TooFewDistinct` where x lies in fewer than 3 bins; [`Error::Parameter`] for a bandwidth that is not positive and finite;
    /// [`Error::Stopped`].
    pub fn fit(&self, kernel: Kernel, degree: Degree, bandwidth: Option<f64>) -> Result<StreamedFit> {
        let bins: Vec<&Folds> = self.in_order().into_iter().map(|(_, folds)| folds).collect();
        if self.count < 3 {
            return Err(Error::too_short("a kernel regression", 3, self.count as usize));
        }
        if bins.len() < 3 {
            return Err(Error::Data(DataError::TooFewDistinct {
                what: "a kernel regression",
                columns: 1,
                need: 3,
                got: bins.len(),
            }));
        }
        let used = (0..FOLDS).filter(|&fold| bins.iter().any(|folds| folds[fold].count > 0.0));
        let parts: Vec<usize> = used.collect();
        let whole = sorted(bins.iter().map(|folds| without(folds, None)));
        let search = match bandwidth {
            Some(_) => None,
            None => Some(self.search(kernel, degree, &bins, &parts)?),
        };
        let bandwidth = bandwidth.or(search.as_ref().map(|s| s.bandwidth)).unwrap_or(f64::NAN);
        let fitted = |data| {
            Ok(KernelRegression { kernel, bandwidth }
                .fit_sorted(data)?
                .with_degree(degree))
        };
        let of_part = |&part: &usize| fitted(sorted(bins.iter().map(|folds| folds[part])));
        Ok(StreamedFit {
            fit: fitted(whole)?,
            folds: parts.iter().map(of_part).collect::<Result<_>>()?,
            search,
            bin_width: self.bin_width(),
            count: self.count,
            variance: {
                let all = bins
                    .iter()
                    .map(|folds| without(folds, None))
                    .fold(Bin::EMPTY, Bin::plus);
                all.yy / all.count
            },
        })
    }

    /// The bandwidth with the smallest mean squared error, when every fold is predicted from all the others.
    fn search(&self, kernel: Kernel, degree: Degree, bins: &[&Folds], parts: &[usize]) -> Result<BandwidthSearch> {
        if parts.len() < 2 {
            let need = usize::try_from(self.block).unwrap_or(usize::MAX).saturating_add(1);
            let what = "cross-validation by blocks of rows (make the blocks shorter, or give a bandwidth)";
            return Err(Error::too_short(what, need, self.count as usize));
        }
        let centres: Vec<f64> = bins.iter().map(|folds| without(folds, None).x).collect();
        let mut grid = Grid::new(&centres);
        let per_bandwidth = if kernel == Kernel::Gaussian {
            BINS_GAUSSIAN
        } else {
            BINS
        };
        grid.smallest = grid.smallest.max(per_bandwidth * self.bin_width());
        grid.largest = grid.largest.max(2.0 * grid.smallest);
        let others = parallel::batch(parts, |part| {
            sorted(bins.iter().map(|folds| without(folds, Some(*part))))
        });
        let score = |h: f64| {
            let left_out = parts.iter().zip(&others);
            let of_part = |(&part, others): (&usize, &Sorted)| squares(bins, part, others, kernel, degree, h);
            left_out.map(of_part).sum::<f64>() / self.count as f64
        };
        let search = grid.search(score);
        interrupt::check()?;
        Ok(search)
    }
}

/// The points of all folds of a bin, except for `left_out`.
fn without(folds: &Folds, left_out: Option<usize>) -> Bin {
    let others = folds
        .iter()
        .enumerate()
        .filter(|(fold, bin)| Some(*fold) != left_out && bin.count > 0.0);
    others.fold(Bin::EMPTY, |sum, (_, bin)| sum.plus(*bin))
}

/// The bins as weighted points, in order and without the empty ones.
fn sorted(bins: impl Iterator<Item = Bin>) -> Sorted {
    let bins: Vec<Bin> = bins.filter(|bin| bin.count > 0.0).collect();
    let column = |of: fn(&Bin) -> f64| -> Vec<f64> { bins.iter().map(of).collect() };
    Sorted::centred(column(|b| b.x), column(|b| b.y), Some(column(|b| b.count)))
}

/// The squared distances of a fold's data from the estimate from the `others`. Within a bin the estimate is a line through its value at the
/// bin, with the slope between the neighbouring bins.
fn squares(bins: &[&Folds], part: usize, others: &Sorted, kernel: Kernel, degree: Degree, h: f64) -> f64 {
    let of_part: Vec<Bin> = bins
        .iter()
        .map(|folds| folds[part])
        .filter(|bin| bin.count > 0.0)
        .collect();
    let x: Vec<f64> = of_part.iter().map(|bin| bin.x).collect();
    let mut values: Vec<Option<f64>> = vec![None; x.len()];
    for_each_sum(others, kernel, degree, h, &x, |j, sums| {
        values[j] = sums.fit(degree).map(|fit| fit.value)
    });
    let value = |j: usize| others.mean + values[j].unwrap_or_else(|| others.nearest(x[j], None));
    let values: Vec<f64> = (0..x.len()).map(value).collect();
    let slope = |j: usize| {
        let (below, above) = (j.saturating_sub(1), (j + 1).min(x.len() - 1));
        let run = x[above] - x[below];
        if run > 0.0 && run <= 2.0 * h {
            (values[above] - values[below]) / run
        } else {
            0.0
        }
    };
    (0..x.len())
        .map(|j| squares_about(of_part[j], values[j], slope(j)))
        .sum()
}

impl StreamedFit {
    /// The bandwidth, in the unit of x.
    pub fn bandwidth(&self) -> f64 {
        self.fit.method().bandwidth
    }

    /// The bandwidths that were tried, where it was chosen.
    pub fn search(&self) -> Option<&BandwidthSearch> {
        self.search.as_ref()
    }

    /// The number of rows.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The mean squared error with which the rows of every fold are predicted from the others, if the bandwidth was chosen by it.
    pub fn prediction_error(&self) -> Option<f64> {
        let scores = self.search.as_ref()?.curve.iter().map(|score| score.error);
        scores.filter(|error| error.is_finite()).reduce(f64::min)
    }

    /// 1 - E/V, where E is [`prediction_error`](Self::prediction_error) and V the ordinates' variance.
    pub fn r_squared(&self) -> Option<f64> {
        Some(1.0 - self.prediction_error()? / self.variance)
    }

    /// The width of the bins, in the unit of x. The estimate does not show details narrower than a few bins.
    pub fn bin_width(&self) -> f64 {
        self.bin_width
    }

    /// The smallest and the largest mean of a bin.
    pub fn range(&self) -> (f64, f64) {
        let x = &self.fit.data().x;
        (x[0], x[x.len() - 1])
    }

    /// A pointwise band at the points `at`, in any order. At each point it holds the regression with probability `level`.
    ///
    /// Its centre is $2 m_h - m_{\sqrt{2} h}$, whose bias is of higher order (Schucany and Sommers 1977: the local line's bias is
    /// proportional to h^2). Its standard error is that of the mean over the folds, from their scatter; NaN where fewer than three
    /// folds have data in reach.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a level that is not between 0 and 1.
    pub fn band(&self, at: &[f64], level: f64) -> Result<StreamedBand> {
        if !(level > 0.0 && level < 1.0) {
            return Err(Error::parameter("the level", level, "between 0 and 1"));
        }
        let centre = unbiased(&self.fit, at)?;
        let of_folds = parallel::map(self.folds.len(), |fold| unbiased(&self.folds[fold], at));
        let of_folds: Vec<Vec<f64>> = of_folds.into_iter().collect::<Result<_>>()?;
        let quantile = |folds: usize| student_quantile(0.5 + 0.5 * level, (folds - 1) as f64);
        let (mut standard_error, mut half_width) = (Vec::with_capacity(at.len()), Vec::with_capacity(at.len()));
        for i in 0..at.len() {
            let values: Vec<f64> = of_folds
                .iter()
                .map(|of_fold| of_fold[i])
                .filter(|v| v.is_finite())
                .collect();
            let (error, half) = match values.len() {
                0..FEWEST_FOLDS => (f64::NAN, f64::NAN),
                folds => {
                    let error = error_of_mean(&values);
                    (error, quantile(folds) * error)
                }
            };
            standard_error.push(error);
            half_width.push(half);
        }
        let edge = |sign: f64| {
            centre
                .iter()
                .zip(&half_width)
                .map(|(c, half)| c + sign * half)
                .collect()
        };
        Ok(StreamedBand {
            lower: edge(-1.0),
            upper: edge(1.0),
            standard_error,
            centre,
        })
    }
}

/// The estimate minus its smoothing bias. The bias grows with the square of the bandwidth.
fn unbiased(fit: &KernelFit, at: &[f64]) -> Result<Vec<f64>> {
    let KernelRegression { kernel, bandwidth } = fit.method();
    let bandwidth = std::f64::consts::SQRT_2 * bandwidth;
    let wider = KernelRegression { kernel, bandwidth }
        .fit_sorted(fit.data().clone())?
        .with_degree(fit.degree());
    Ok(fit
        .predict(at)
        .iter()
        .zip(wider.predict(at))
        .map(|(m, wider)| 2.0 * m - wider)
        .collect())
}

/// The standard error of the mean of some values.
fn error_of_mean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt()
}

impl Regression for StreamedFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        Ok(self.fit.predict(check_queries(x, 1)?[0]))
    }
}
