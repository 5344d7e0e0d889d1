//! The regressogram (Tukey 1961): the mean of the ordinates in each cell of a grid.

use super::Regression;
use super::estimator::{Estimator, Points, check_queries};
use crate::error::{Error, Result};

/// The mean of y in cells of equal width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regressogram {
    /// The cells' width, in the unit of x; positive and finite.
    pub width: f64,
}

/// A fitted regressogram.
#[derive(Debug, Clone, PartialEq)]
pub struct RegressogramFit {
    width: f64,
    cells: std::collections::BTreeMap<i64, (f64, f64)>, // sum of w y, sum of w
}

impl Estimator for Regressogram {
    type Fit = RegressogramFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<RegressogramFit> {
        if !(self.width > 0.0 && self.width.is_finite()) {
            return Err(Error::parameter("the cells' width", self.width, "positive and finite"));
        }
        let points = Points::new("a regressogram", 1, x, y, weights)?; // checked, of positive weight, sorted
        let mut cells = std::collections::BTreeMap::new();
        for ((x, y), w) in points.x[0].iter().zip(&points.y).zip(&points.w) {
            let sums: &mut (f64, f64) = cells.entry((x / self.width).floor() as i64).or_default();
            *sums = (sums.0 + w * y, sums.1 + w);
        }
        Ok(RegressogramFit {
            width: self.width,
            cells,
        })
    }
}

impl Regression for RegressogramFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let cell = |x: f64| {
            self.cells
                .get(&((x / self.width).floor() as i64))
                .filter(|_| x.is_finite())
        };
        Ok(check_queries(x, 1)?[0]
            .iter()
            .map(|&x| cell(x).map_or(f64::NAN, |(wy, w)| wy / w))
            .collect())
    }
}
