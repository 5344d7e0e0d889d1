//! The local line with its own bandwidth and side at every point.
//!
//! At every node of a table the line is fitted over windows of growing width: around the node, only to its left and only to its right. Each
//! of the three families grows as long as its confidence intervals have a point in common (Lepski 1990; Goldenshluger and Nemirovski 1997;
//! Lepski, Mammen and Spokoiny 1997). Of the three estimates, the one with the smallest standard error is taken. Near a kink or a jump it
//! is one-sided, and as wide as the data on that side allow (Qiu 2003; Gijbels, Lambert and Qiu 2007). One bandwidth for all points would
//! have to be narrow everywhere. If the left and the right estimates contradict each other, there is a jump. Its place is the split of the
//! points there that leaves the smallest residuals.
//!
//! Cross-validation between two halves of the data chooses how early the windows stop growing. It also decides whether local bandwidths are
//! used at all: if they are not clearly better, one bandwidth by leave-one-out serves.
//!
//! The other way to local bandwidths is the plug-in rule ([`plug_in`]): the bandwidth that minimises the asymptotic error at x.

mod choice;
mod noise;
mod plug_in;
mod validation;
mod windows;

pub use choice::{LocalWindow, Side};

use super::estimator::{Estimator, Regression, check_queries, evaluate};
use super::kernel::{Degree, Kernel, Sorted, check_points, check_weights};
use super::{Outside, estimator};
use crate::error::{Error, ParameterError, Result};
use crate::selection::BandwidthSearch;
use choice::{Broken, Chosen};
use plug_in::PlugInWindows;
use validation::Better;
use windows::{Design, Windows};

/// The fewest points for which local bandwidths are tried.
const FEWEST: usize = 50;

/// How the local bandwidths are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LocalRule {
    /// Windows to both sides and to one side grow as long as their estimates agree (Lepski 1990; Goldenshluger and Nemirovski 1997). The
    /// estimate follows jumps and kinks. Validation on the data decides whether the rule is used at all.
    #[default]
    Lepski,
    /// The minimum of the asymptotic error at x, which depends on the noise, the density and m'' around x (Fan and Gijbels 1996, section
    /// 4.3). It suits a smooth m whose curvature, or whose noise, differs from place to place.
    PlugIn,
}

/// The local line with local bandwidths, one column.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `kernel` | the weight function of the windows around a point; one-sided ones are uniform | | Epanechnikov |
/// | `rule` | how the bandwidths are chosen | | Lepski's |
/// | `outside` | the estimate beyond the data's range and in empty windows | | NaN |
///
/// The estimate is tabulated at up to 2000 quantiles of the data and at the jumps that were found. It is straight between them. Where no
/// window reaches, between data far apart, `outside` decides as it does beyond the data: NaN, the estimate at the nearer abscissa, or the
/// straight line between the two.
///
/// ```
/// use flexure::nonlinearity::{Estimator, LocalKernel, Regression};
/// let x: Vec<f64> = (0..20_000).map(|i| i as f64 / 10_000.0 - 1.0).collect();
/// let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| x.signum() + 0.1 * ((i * i % 7) as f64 - 2.0)).collect();
/// let fit = LocalKernel::default().fit(&[&x], &y, None)?;
/// assert!(fit.threshold().is_some() && fit.jumps().len() == 1);
/// assert!((fit.predict(&[&[0.01]])?[0] - fit.predict(&[&[-0.01]])?[0] - 2.0).abs() < 0.1);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LocalKernel {
    /// The weight function.
    pub kernel: Kernel,
    /// How the bandwidths are chosen.
    pub rule: LocalRule,
    /// The estimate beyond the data's range.
    pub outside: Outside,
}

/// A fitted local line with local bandwidths.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalKernelFit {
    table: Vec<LocalWindow>,
    curve: Broken,
    jumps: Vec<f64>,
    better: Option<Better>,
    global: BandwidthSearch,
    range: (f64, f64),
    gaps: Vec<Gap>,
    outside: Outside,
    mean: f64,
}

/// A stretch between neighbouring abscissas that no window reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gap {
    /// The abscissas.
    data: (f64, f64),
    /// The stretch between them.
    empty: (f64, f64),
}

impl Gap {
    /// All gaps, in order. The windows at two neighbouring abscissas are those of the nearest nodes.
    fn all(data: &Sorted, table: &[LocalWindow]) -> Vec<Gap> {
        let bandwidth = |x: f64| {
            let after = table.partition_point(|w| w.x < x);
            let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
            let near = near.filter_map(|j| table.get(j));
            let nearest = near.min_by(|a, b| (a.x - x).abs().total_cmp(&(b.x - x).abs()));
            nearest.map_or(0.0, |w| w.bandwidth)
        };
        let narrowest = table.iter().map(|w| w.bandwidth).fold(f64::INFINITY, f64::min);
        let wide = data.x.windows(2).filter(|pair| pair[1] - pair[0] > narrowest);
        wide.filter_map(|pair| {
            let empty = (pair[0] + bandwidth(pair[0]), pair[1] - bandwidth(pair[1]));
            (empty.1 > empty.0).then_some(Gap {
                data: (pair[0], pair[1]),
                empty,
            })
        })
        .collect()
    }
}

impl Estimator for LocalKernel {
    type Fit = LocalKernelFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<LocalKernelFit> {
        self.fit_sorted(&self.sorted(x, y, weights)?)
    }
}

impl LocalKernel {
    /// The points in order.
    pub(super) fn sorted(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Sorted> {
        let [x] = x else {
            return Err(Error::Parameter(ParameterError::ColumnCount {
                what: "a local kernel regression",
                got: x.len(),
                expected: estimator::columns(1),
            }));
        };
        check_points(x, y, 3)?;
        if let Some(weights) = weights {
            check_weights(weights, x.len(), 3)?;
        }
        Ok(Sorted::new(x, y, weights))
    }

    pub(super) fn fit_sorted(self, data: &Sorted) -> Result<LocalKernelFit> {
        if self.rule == LocalRule::PlugIn {
            let PlugInWindows { global, table } = PlugInWindows::new(data, self.kernel)?;
            let chosen = Chosen::smooth(table, data);
            return Ok(self.made(data, global, None, chosen));
        }
        let global = BandwidthSearch::with_degree(self.kernel, Degree::Linear, data);
        let design = Design::new(data, self.kernel, global.bandwidth);
        let better = if data.len() < FEWEST || design.nodes.len() < 3 {
            None
        } else {
            validation::threshold(data, &design)
        };
        let windows = Windows::new(data, &design);
        let chosen = match better {
            Some(better) => windows.adapted(data, better.threshold),
            None => windows.uniform(data, global.bandwidth),
        };
        Ok(self.made(data, global, better, chosen))
    }

    fn made(self, data: &Sorted, global: BandwidthSearch, better: Option<Better>, chosen: Chosen) -> LocalKernelFit {
        // The Gaussian kernel's windows end nowhere.
        let gaps = match self.kernel {
            Kernel::Gaussian => Vec::new(),
            _ => Gap::all(data, &chosen.table),
        };
        LocalKernelFit {
            gaps,
            table: chosen.table,
            curve: chosen.curve,
            jumps: chosen.jumps,
            better,
            global,
            range: (data.x[0], data.x[data.len() - 1]),
            outside: self.outside,
            mean: data.mean,
        }
    }
}

impl LocalKernelFit {
    /// The window that was chosen at every node, in order of x: bandwidth, side, estimate and its standard error.
    pub fn table(&self) -> Vec<LocalWindow> {
        let shifted = |w: &LocalWindow| LocalWindow {
            value: w.value + self.mean,
            ..*w
        };
        self.table.iter().map(shifted).collect()
    }

    /// The abscissas of the jumps that were found, increasing.
    pub fn jumps(&self) -> &[f64] {
        &self.jumps
    }

    /// For Lepski's rule: the half width of the confidence intervals that decide how far a window grows, in standard errors. `None` if one
    /// bandwidth serves for all points.
    pub fn threshold(&self) -> Option<f64> {
        self.better.map(|better| better.threshold)
    }

    /// For Lepski's rule: the mean squared error with which each half of the data (every other point in order of x) is predicted from the
    /// other, in the squared unit of y. `None` if one bandwidth serves for all points.
    pub fn prediction_error(&self) -> Option<f64> {
        self.better.map(|better| better.error)
    }

    /// For Lepski's rule: the error of prediction with one bandwidth for all points. [`prediction_error`](Self::prediction_error) is
    /// clearly less.
    pub fn prediction_error_of_one(&self) -> Option<f64> {
        self.better.map(|better| better.error_of_one)
    }

    /// The search for one bandwidth for all points. With the plug-in rule it has no scores.
    pub fn global(&self) -> &BandwidthSearch {
        &self.global
    }
}

impl Regression for LocalKernelFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, 1)?[0];
        let value = |x: f64| {
            let gap = self.gaps.get(self.gaps.partition_point(|gap| gap.empty.1 <= x));
            let place = match (gap.filter(|gap| x > gap.empty.0), self.outside) {
                (None, _) | (_, Outside::Linear) => x,
                (Some(_), Outside::Nan) => return f64::NAN,
                (Some(gap), Outside::Nearest) => match x - gap.data.0 <= gap.data.1 - x {
                    true => gap.data.0,
                    false => gap.data.1,
                },
            };
            self.mean + self.curve.value(place)
        };
        Ok(evaluate(x, self.range, self.outside, value, |x| self.curve.slope(x)))
    }
}

#[cfg(test)]
mod tests;
