//! The recursive estimate over a record: at any point, with c from the data.

use std::cell::RefCell;

use super::super::line::{PartialEstimate, predict};
use super::levels::Levels;
use super::{RecursiveForm, RecursiveKernel};
use crate::error::{Error, Result};
use crate::nonlinearity::estimator::{Checked, check_queries};
use crate::nonlinearity::{Choice, Estimator, Kernel, Outside, Regression};
use crate::parallel;
use crate::selection::{Criterion, Grid, Search};
use crate::sort;

/// The name of the method in messages.
const WHAT: &str = "a recursive kernel regression";
/// The fewest points of positive weight from which c is chosen.
const FEWEST: usize = 3;
/// The most points that are predicted for a score of c. With more points, every second one, every third one, ... is predicted.
const SCORED: usize = 20_000;

/// The recursive kernel estimate over recorded points, taken in the order given.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `kernel` | the weight function | | Epanechnikov |
/// | `form` | the observations' weights | | by 1/h_i |
/// | `bandwidth` | c, the bandwidth of the first observation, in the unit of x | positive, finite | by leave-one-out |
/// | `exponent` | gamma, how fast the bandwidth shrinks: 1/3 for Lipschitz, 1/5 for smooth m | between 0 and 1 | 1/5 |
/// | `outside` | the estimate beyond the data and in empty windows | | NaN |
///
/// At every point the estimate equals that of [`RecursiveKernel`] over the stream, except for rounding. A point of weight w counts as w
/// points of the stream, one after the other. **Leave-one-out**: a point is predicted from all others, earlier and later ones. Their
/// bandwidths stay the same. If no other is in reach, its nearest neighbours predict it. With more than 20,000 points only every second,
/// third, ... in order of x is predicted, from all others.
///
/// [`Outside::Nan`]: NaN where no data are within reach; all other values stay the same. [`Outside::Nearest`] and
/// [`Outside::Linear`] are as for [`KernelEstimator`](crate::nonlinearity::KernelEstimator) in one variable; the slope at
/// an end is that of the line fitted there with the weights of the estimate.
///
/// ```
/// use flexure::nonlinearity::{Estimator, RecursiveRegression, Regression};
/// let x: Vec<f64> = (0..1000).map(|i| f64::from(i * 37 % 1000) / 1000.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| 2.0 * x).collect();
/// let fit = RecursiveRegression::default().fit(&[&x], &y, None)?;
/// assert!((fit.predict(&[&[0.5]])?[0] - 1.0).abs() < 0.01);
/// assert!(fit.search().is_some_and(|search| search.curve.len() > 10));
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecursiveRegression {
    /// The weight function.
    pub kernel: Kernel,
    /// How observations are weighed.
    pub form: RecursiveForm,
    /// c, in the unit of x.
    pub bandwidth: Choice<f64>,
    /// gamma.
    pub exponent: f64,
    /// The estimate beyond the data and in empty windows.
    pub outside: Outside,
}

impl Default for RecursiveRegression {
    fn default() -> Self {
        RecursiveRegression {
            kernel: Kernel::default(),
            form: RecursiveForm::default(),
            bandwidth: Choice::default(),
            exponent: 0.2,
            outside: Outside::default(),
        }
    }
}

/// A fitted recursive kernel regression.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveFit {
    method: RecursiveKernel,
    levels: Levels,
    search: Option<Search<f64>>,
    outside: Outside,
}

impl Estimator for RecursiveRegression {
    type Fit = RecursiveFit;

    /// # Errors
    /// Those of every [`Estimator`]; [`Error::Parameter`] for a bandwidth or an exponent out of range, and
    /// [`Error::Data`]: `TooShort` if c is chosen and fewer than 3 points have a positive weight.
    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<RecursiveFit> {
        let data = Checked::new(WHAT, 1, x, y, weights)?;
        let with = |bandwidth| RecursiveKernel {
            kernel: self.kernel,
            form: self.form,
            bandwidth,
            exponent: self.exponent,
        };
        let given = match self.bandwidth {
            Choice::Fixed(bandwidth) => bandwidth,
            Choice::FromData(_) => 1.0,
        };
        with(given).check()?;
        let levels = Levels::new(&data);
        let search = match self.bandwidth {
            Choice::Fixed(_) => None,
            Choice::FromData(criterion) => Some(search(&levels, &data, with, criterion)?),
        };
        Ok(RecursiveFit {
            method: with(search.as_ref().map_or(given, |s| s.parameter)),
            levels,
            search,
            outside: self.outside,
        })
    }
}

/// Searches for c. The typical bandwidths of the values tried are the candidates of a search for one bandwidth.
fn search(
    levels: &Levels,
    data: &Checked<'_>,
    with: impl Fn(f64) -> RecursiveKernel + Sync,
    criterion: Criterion,
) -> Result<Search<f64>> {
    let n = levels.all.len();
    if n < FEWEST {
        return Err(Error::too_short(WHAT, FEWEST, n));
    }
    let points = levels.own(data, n.div_ceil(SCORED));
    let typical = levels.typical(&with(1.0));
    let tried = RefCell::new(Vec::new());
    let found = Grid::new(&levels.all.x).search_by(|bandwidths| {
        let candidate = |h: &f64| levels.candidate(&with(h / typical), &points);
        let candidates = parallel::batch(bandwidths, candidate);
        let scores = candidates.iter().map(|c| c.score(criterion)).collect();
        tried.borrow_mut().extend(candidates);
        scores
    });
    let mut curve = tried.into_inner();
    sort::by_key(&mut curve, |c| c.parameter);
    Ok(Search {
        parameter: found.bandwidth / typical,
        criterion,
        curve,
        at_edge: found.at_edge,
    })
}

impl RecursiveFit {
    /// c, the bandwidth of the first observation, given or chosen, in the unit of x.
    pub fn bandwidth(&self) -> f64 {
        self.method.bandwidth
    }

    /// The root mean square of the observations' bandwidths, in the unit of x. One bandwidth of this size for all observations smooths as
    /// much.
    pub fn typical_bandwidth(&self) -> f64 {
        self.method.bandwidth * self.levels.typical(&self.method)
    }

    /// The estimate as a stream makes it.
    pub fn method(&self) -> RecursiveKernel {
        self.method
    }

    /// The scores of all values of c that were tried, if c was chosen from the data.
    pub fn search(&self) -> Option<&Search<f64>> {
        self.search.as_ref()
    }
}

impl PartialEstimate for RecursiveFit {
    fn abscissas(&self) -> &[f64] {
        &self.levels.all.x
    }

    fn known(&self, x: &[f64]) -> Vec<f64> {
        self.levels.estimates(&self.method, x)
    }

    fn slope(&self, q: f64) -> f64 {
        self.levels.slope(&self.method, q)
    }

    fn has_gap(&self, a: f64, b: f64) -> bool {
        self.levels.has_gap(&self.method, a, b)
    }
}

impl Regression for RecursiveFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        Ok(predict(self, check_queries(x, 1)?[0], self.outside))
    }
}

#[cfg(test)]
#[path = "regression_tests.rs"]
mod tests;
