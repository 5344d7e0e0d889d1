//! What all estimators of m(x) = E(Y | X = x) have in common.
//!
//! An [`Estimator`] holds parameters, unchecked; [`Estimator::fit`] checks them together with the data and
//! returns a [`Regression`], which predicts. A new estimator is one file with a struct that implements the
//! first and a fit that implements the second; [`Points`] checks the data for it.

use std::fmt::Debug;

use super::{KernelFit, KernelRegression, Outside};
use crate::error::{Error, ParameterError, Result};
use crate::interrupt;
use crate::linear::correlation::weighted_mean;
use crate::record::check_values;
use crate::selection::Criterion;
use crate::sort::order;

/// The most columns of an estimator, or inputs of a surface, that takes several. Convention.
pub(crate) const MOST_COLUMNS: usize = 6;

/// A fitted regression: a function of `dimension()` variables.
pub trait Regression: Debug + Send + Sync {
    /// The number of columns of x.
    fn dimension(&self) -> usize;

    /// The estimates at the points whose coordinates are the columns `x`, all of one length.
    ///
    /// An estimate is NaN if a coordinate of its point is NaN, and where the estimator's policy says that nothing is known.
    ///
    /// # Errors
    /// [`Error::Parameter`]: `ColumnCount` for a number of columns other than `dimension()`, [`Error::Data`]: `LengthMismatch`.
    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>>;

    /// This fit as a kernel fit in one variable, if it is one. Its standard errors need that.
    fn kernel_fit(&self) -> Option<&KernelFit> {
        None
    }
}

/// A method of estimating a regression, with its parameters.
pub trait Estimator: Debug + Sized {
    /// What the method returns.
    type Fit: Regression + 'static;

    /// Estimates m from the points whose coordinates are the columns `x`, with the ordinates `y`.
    ///
    /// A point of weight w counts as w points. A point of weight zero does not count. Without weights every point counts once. Nothing
    /// depends on the order of the points.
    ///
    /// # Errors
    /// [`Error::Parameter`]: `ColumnCount`, [`Error::Data`]: `LengthMismatch`, `NonFinite`, `Unit` for a column whose largest
    /// value is below 1e-100 or above 1e100 in size, `TooShort` without any point of positive weight, [`Error::Parameter`] for a weight that is negative or not finite
    /// and for the estimator's own parameters, `BeyondData` where these ask for more than the data
    /// can tell.
    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Self::Fit>;

    /// [`Estimator::fit`] for code that chooses the estimator at run time.
    ///
    /// # Errors
    /// Those of [`Estimator::fit`].
    fn fit_boxed(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Box<dyn Regression>> {
        Ok(Box::new(self.fit(x, y, weights)?))
    }
}

/// A parameter that is given, or chosen from the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice<P> {
    /// This value.
    Fixed(P),
    /// The value with the smallest score.
    FromData(Criterion),
}

impl<P> Default for Choice<P> {
    /// From the data, by leave-one-out.
    fn default() -> Self {
        Choice::FromData(Criterion::default())
    }
}

impl Regression for KernelFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        Ok(KernelFit::predict(self, check_queries(x, 1)?[0]))
    }

    fn kernel_fit(&self) -> Option<&KernelFit> {
        Some(self)
    }
}

impl Estimator for KernelRegression {
    type Fit = KernelFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<KernelFit> {
        let points = Points::new("a kernel regression", 1, x, y, weights)?;
        self.fit_weighted(&points.x[0], &points.y, &points.w)
    }
}

/// Checks for `dimension` query columns of one length. Their values may be anything, even NaN.
pub(crate) fn check_queries<'a, 'b>(x: &'a [&'b [f64]], dimension: usize) -> Result<&'a [&'b [f64]]> {
    if x.len() != dimension {
        return Err(Error::Parameter(ParameterError::ColumnCount {
            what: "this regression",
            got: x.len(),
            expected: columns(dimension),
        }));
    }
    equal_lengths(x)?;
    Ok(x)
}

pub(super) fn columns(count: usize) -> String {
    crate::text::counted(count, "column")
}

fn equal_lengths(x: &[&[f64]]) -> Result<()> {
    match x.iter().position(|column| column.len() != x[0].len()) {
        None => Ok(()),
        Some(i) => Err(Error::length(name_of(i, x.len()), x[i].len(), x[0].len())),
    }
}

fn name_of(column: usize, dimension: usize) -> String {
    if dimension == 1 {
        "x".to_owned()
    } else {
        format!("x[{column}]")
    }
}

/// Checked columns as they were given.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Checked<'a> {
    /// The coordinates: `x[j][i]` is that of point i along dimension j.
    pub x: &'a [&'a [f64]],
    /// The ordinates.
    pub y: &'a [f64],
    /// The weights, zero or positive. `None`: every weight is 1.
    pub w: Option<&'a [f64]>,
}

impl<'a> Checked<'a> {
    /// Checks the data of an estimator called `what` that takes at most `most` columns. At least one point must have a positive weight.
    pub fn new(
        what: &'static str,
        most: usize,
        x: &'a [&'a [f64]],
        y: &'a [f64],
        weights: Option<&'a [f64]>,
    ) -> Result<Checked<'a>> {
        if x.is_empty() || x.len() > most {
            let expected = if most == 1 {
                columns(1)
            } else {
                format!("1 to {}", columns(most))
            };
            return Err(Error::Parameter(ParameterError::ColumnCount {
                what,
                got: x.len(),
                expected,
            }));
        }
        equal_lengths(x)?;
        let n = x[0].len();
        for (name, values) in [("y", Some(y)), ("weights", weights)] {
            if let Some(values) = values.filter(|v| v.len() != n) {
                return Err(Error::length(name, values.len(), n));
            }
        }
        let named = x.iter().enumerate().map(|(j, column)| (name_of(j, x.len()), *column));
        for (column, values) in named.chain([("y".to_owned(), y)]) {
            check_values(&column, values)?;
        }
        if let Some(weights) = weights
            && let Some(i) = weights.iter().position(|&w| !(w >= 0.0 && w.is_finite()))
        {
            return Err(Error::parameter(
                format!("weights[{i}]"),
                weights[i],
                "zero or positive, and finite",
            ));
        }
        if let Some(weights) = weights {
            check_values("weights", weights)?;
        }
        if weights.map_or(n == 0, |w| w.iter().all(|w| *w == 0.0)) {
            return Err(Error::too_short(what, 1, 0));
        }
        Ok(Checked { x, y, w: weights })
    }

    /// The weight of point `i`.
    pub fn weight(&self, i: usize) -> f64 {
        self.w.map_or(1.0, |w| w[i])
    }

    /// The points of positive weight, sorted.
    pub fn sorted(&self) -> Points {
        let Checked { x, y, w } = *self;
        let columns: Vec<&[f64]> = x.iter().copied().chain([y]).chain(w).collect();
        let mut order = order(&columns);
        interrupt::leave();
        order.retain(|&i| self.weight(i) > 0.0);
        let gather = |values: &[f64]| order.iter().map(|&i| values[i]).collect();
        Points {
            x: x.iter().map(|column| gather(column)).collect(),
            y: gather(y),
            w: order.iter().map(|&i| self.weight(i)).collect(),
        }
    }
}

/// Checked points of positive weight, sorted, so that nothing depends on their order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Points {
    /// The coordinates: `x[j][i]` is that of point i along dimension j.
    pub x: Vec<Vec<f64>>,
    /// The ordinates.
    pub y: Vec<f64>,
    /// The weights, all positive.
    pub w: Vec<f64>,
}

impl Points {
    /// Checks and sorts the data of an estimator called `what` that takes at most `most` columns. There must be at least one point.
    pub fn new(what: &'static str, most: usize, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<Points> {
        Ok(Checked::new(what, most, x, y, weights)?.sorted())
    }

    pub fn len(&self) -> usize {
        self.y.len()
    }

    pub fn total_weight(&self) -> f64 {
        self.w.iter().sum()
    }

    /// The weighted mean of the ordinates.
    pub fn mean(&self) -> f64 {
        weighted_mean(&self.y, Some(&self.w))
    }

    /// The root mean square of the ordinates. It serves to distinguish rounding from error.
    pub fn size(&self) -> f64 {
        (self.y.iter().map(|y| y * y).sum::<f64>() / self.len() as f64).sqrt()
    }

    /// The first and the last abscissa along dimension `j`.
    pub fn range(&self, j: usize) -> (f64, f64) {
        let fold = |f: fn(f64, f64) -> f64| self.x[j].iter().copied().fold(self.x[j][0], f);
        (fold(f64::min), fold(f64::max))
    }

    /// The distinct abscissas of one column, increasing.
    pub fn distinct(&self) -> Vec<f64> {
        let mut distinct = self.x[0].clone();
        distinct.dedup();
        distinct
    }
}

/// Evaluates an estimate in one variable. Within `range` the estimate applies, beyond it `outside`.
pub(crate) fn evaluate(
    x: &[f64],
    range: (f64, f64),
    outside: Outside,
    value: impl Fn(f64) -> f64,
    slope: impl Fn(f64) -> f64,
) -> Vec<f64> {
    x.iter()
        .map(|&x| {
            let end = x.clamp(range.0, range.1);
            match outside {
                _ if x.is_nan() => f64::NAN,
                _ if x == end => value(x),
                Outside::Nan => f64::NAN,
                Outside::Nearest => value(end),
                Outside::Linear => value(end) + slope(end) * (x - end),
            }
        })
        .collect()
}

#[cfg(test)]
#[path = "estimator_tests/mod.rs"]
mod tests;
