//! Kernel regression in one to six columns: one estimator for any number of columns.

use super::choice::{Bandwidth, KernelSearch};
use super::line::Line;
use super::product::Product;
use super::{Degree, Kernel, KernelFit};
use crate::error::{DataError, Error, ParameterError, Result};
use crate::nonlinearity::Outside;
use crate::nonlinearity::estimator::{Checked, Estimator, MOST_COLUMNS, Regression, check_queries};
use crate::selection::Criterion;

/// Kernel regression, local constant or local linear, in one to six variables.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `kernel` | the weight function | | Epanechnikov |
/// | `degree` | the polynomial that is fitted around every point | | linear |
/// | `bandwidth` | half widths of the window (Gaussian: standard deviations), in the columns' units | positive, finite | by leave-one-out |
/// | `outside` | the estimate beyond the data and in empty windows | | NaN |
///
/// In several variables the kernel is a product: a point X counts at x with the weight
/// $\prod_j K((x_j - X_j)/h_j)$. The local linear fit (Fan 1993; Ruppert and Wand 1994) is the default: the local constant one (Nadaraya
/// 1964, Watson 1964; paper, (13)) is biased at boundaries, and with several variables many points lie near a boundary.
///
/// **Where the points in reach determine no plane.** A column takes no part in the local fit if its values in reach have a standard
/// deviation, weighted by the kernel, below 1e-8 bandwidths. If another column is a linear function of the columns before it, up to a part
/// that small, the fit is the local constant one. In one variable the same holds with 1e-9.
///
/// **Outside the data.** [`Outside::Nan`]: NaN where no data are within reach; all other values stay the same. The other two choices apply
/// from the ends of the data on:
///
/// | where | [`Outside::Nearest`] | [`Outside::Linear`] |
/// |---|---|---|
/// | one variable, beyond the data's range | the estimate at the nearer end | the straight line from that end |
/// | one variable, between neighbouring abscissas with an empty window between | the estimate at the nearer one | the straight line between the two estimates |
/// | several variables, beyond some column's range | the estimate at the nearest point of the ranges | the plane from there |
/// | several variables, no data in reach there | the estimate at the nearest of the data (in bandwidths; the first one of several) | the plane from there |
///
/// The slopes of these lines and planes are those of the local linear fit, for both degrees. They are zero where it is not determined.
///
/// ```
/// use flexure::nonlinearity::{Estimator, KernelEstimator, Regression};
/// let grid: Vec<f64> = (0..20).map(|i| f64::from(i) / 10.0 - 0.95).collect();
/// let a: Vec<f64> = (0..400).map(|i| grid[i % 20]).collect();
/// let b: Vec<f64> = (0..400).map(|i| grid[i / 20]).collect();
/// let y: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * a - b).collect();
/// let fit = KernelEstimator::default().fit(&[&a, &b], &y, None)?;
/// assert!((fit.predict(&[&[0.5], &[0.25]])?[0] - 0.0).abs() < 0.02);
/// assert!(fit.bandwidths()[1] > fit.bandwidths()[0]); // linear in b
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct KernelEstimator {
    /// The weight function.
    pub kernel: Kernel,
    /// The degree of the polynomial that is fitted around every point.
    pub degree: Degree,
    /// The bandwidths, or how to choose them.
    pub bandwidth: Bandwidth,
    /// The estimate beyond the data and in empty windows.
    pub outside: Outside,
}

impl Default for KernelEstimator {
    /// The Epanechnikov kernel, local linear, bandwidths by leave-one-out, NaN outside.
    fn default() -> Self {
        KernelEstimator {
            kernel: Kernel::Epanechnikov,
            degree: Degree::Linear,
            bandwidth: Bandwidth::default(),
            outside: Outside::Nan,
        }
    }
}

impl Estimator for KernelEstimator {
    type Fit = KernelEstimate;

    /// # Errors
    /// Those of every [`Estimator`]; [`Error::Parameter`] for a bandwidth that is not positive and finite,
    /// [`Error::Parameter`]: `ColumnCount` if their number is neither one nor one for each column, and [`Error::Data`]: `TooFewDistinct` if
    /// the local linear fit in d columns is given points at no more than d places. If the bandwidth is chosen, this must hold also without
    /// any one point.
    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<KernelEstimate> {
        let data = Checked::new("a kernel regression", MOST_COLUMNS, x, y, weights)?;
        let d = x.len();
        let given = match &self.bandwidth {
            Bandwidth::Fixed(h) => Some(for_columns(h, d)?),
            Bandwidth::FromData(_) => None,
        };
        check_distinct(&data, self.degree, self.places(d, given.is_none()))?;
        let (bandwidths, search) = match (given, &self.bandwidth) {
            (Some(h), _) => (h, None),
            (None, Bandwidth::FromData(criterion)) => {
                let search = KernelSearch::over(&data, self.kernel, self.degree, *criterion)?;
                (search.bandwidths.clone(), Some(search))
            }
            (None, Bandwidth::Fixed(_)) => (Vec::new(), None),
        };
        let method = if d == 1 {
            Method::Line(Line::new(&data, self.kernel, self.degree, bandwidths[0])?)
        } else {
            Method::Product(Product::new(&data, self.kernel, &bandwidths))
        };
        Ok(KernelEstimate {
            kernel: self.kernel,
            degree: self.degree,
            outside: self.outside,
            bandwidths,
            search,
            method,
        })
    }
}

impl KernelEstimator {
    /// The exact score, by this criterion, of the given bandwidths.
    ///
    /// # Errors
    /// Those of [`Estimator::fit`] for bandwidths chosen from the data, and [`Error::Parameter`]: `ColumnCount` where none are
    /// given.
    pub fn score(&self, criterion: Criterion, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<f64> {
        let data = Checked::new("a kernel regression", MOST_COLUMNS, x, y, weights)?;
        let h = match &self.bandwidth {
            Bandwidth::Fixed(h) => for_columns(h, x.len())?,
            Bandwidth::FromData(_) => for_columns(&[], x.len())?,
        };
        check_distinct(&data, self.degree, self.places(x.len(), true))?;
        Ok(KernelSearch::score_of(&data, self.kernel, self.degree, criterion, &h))
    }

    /// The number of distinct places that the points need in `d` columns, whether or not one point is left out.
    fn places(&self, d: usize, leaving_out: bool) -> usize {
        let plane = if self.degree == Degree::Linear { d + 1 } else { 1 };
        if leaving_out { (plane + 1).max(3) } else { plane }
    }
}

/// One bandwidth for each column, from one for all or one for each.
fn for_columns(given: &[f64], d: usize) -> Result<Vec<f64>> {
    if given.len() != 1 && given.len() != d {
        return Err(Error::Parameter(ParameterError::ColumnCount {
            what: "the bandwidth",
            got: given.len(),
            expected: if d == 1 {
                "one value".to_owned()
            } else {
                format!("one value for all columns or {d} values, one a column")
            },
        }));
    }
    // The reciprocal has to be finite, too.
    if let Some(j) = given.iter().position(|h| !(*h >= f64::MIN_POSITIVE && h.is_finite())) {
        return Err(Error::parameter(
            if given.len() == 1 {
                "the bandwidth".to_owned()
            } else {
                format!("the bandwidth of x[{j}]")
            },
            given[j],
            "positive and finite",
        ));
    }
    Ok(if given.len() == d {
        given.to_vec()
    } else {
        vec![given[0]; d]
    })
}

/// Checks that points of positive weight lie at `need` distinct places or more.
fn check_distinct(data: &Checked<'_>, degree: Degree, need: usize) -> Result<()> {
    let mut found: Vec<usize> = Vec::new();
    let same = |i: usize, k: usize| data.x.iter().all(|column| column[i] == column[k]);
    for i in (0..data.y.len()).filter(|&i| data.weight(i) > 0.0) {
        if found.len() >= need {
            return Ok(());
        }
        if !found.iter().any(|&k| same(i, k)) {
            found.push(i);
        }
    }
    if found.len() >= need {
        return Ok(());
    }
    let d = data.x.len();
    Err(Error::Data(DataError::TooFewDistinct {
        what: match degree {
            Degree::Constant => "a local constant regression",
            Degree::Linear => "a local linear regression",
        },
        columns: d,
        need,
        got: found.len(),
    }))
}

#[derive(Debug, Clone, PartialEq)]
enum Method {
    Line(Line),
    Product(Product),
}

/// A fitted kernel regression in one to six variables.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelEstimate {
    kernel: Kernel,
    degree: Degree,
    outside: Outside,
    bandwidths: Vec<f64>,
    search: Option<KernelSearch>,
    method: Method,
}

impl KernelEstimate {
    /// The weight function.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The degree of the polynomial that is fitted around every point.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The estimate beyond the data and in empty windows.
    pub fn outside(&self) -> Outside {
        self.outside
    }

    /// The bandwidths, one per column, given or chosen.
    pub fn bandwidths(&self) -> &[f64] {
        &self.bandwidths
    }

    /// The scores of all bandwidths that were tried, where these were chosen from the data.
    pub fn search(&self) -> Option<&KernelSearch> {
        self.search.as_ref()
    }

    /// In one variable, the fit without the rule for outside the data. It serves for standard errors.
    pub fn line(&self) -> Option<&KernelFit> {
        match &self.method {
            Method::Line(line) => Some(line.fit()),
            Method::Product(_) => None,
        }
    }
}

impl Regression for KernelEstimate {
    fn kernel_fit(&self) -> Option<&KernelFit> {
        self.line()
    }

    fn dimension(&self) -> usize {
        self.bandwidths.len()
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, self.dimension())?;
        Ok(match &self.method {
            Method::Line(line) => line.predict(x[0], self.outside),
            Method::Product(product) => product.predict(self.degree, x, self.outside),
        })
    }
}
