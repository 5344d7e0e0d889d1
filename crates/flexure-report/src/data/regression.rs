//! What the page of a regression shows.

use serde::Serialize;

use super::{Choice, Fact, Nonlinearity};

/// Everything on the page of a regression of y on one or several columns of x.
#[derive(Debug, Clone, Serialize)]
pub struct RegressionPage {
    /// The heading, for example "y against x".
    pub title: String,
    /// One sentence below it: what was estimated from what.
    pub subtitle: String,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// The estimate in one column of x, without abscissas where there are several.
    pub curve: Nonlinearity,
    /// The data of `curve`.
    pub points: Scatter,
    /// The estimate in two columns of x.
    pub surface: Option<Surface>,
    /// The estimate along one column of x while the others stay where they are.
    pub slices: Vec<Slice>,
    /// The residuals of the estimate.
    pub residuals: RegressionResiduals,
    /// What was chosen from data and why.
    pub choices: Vec<Choice>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}

/// Points, decimated by the page where they are many.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Scatter {
    /// Abscissas, in any order.
    pub x: Vec<f64>,
    /// Ordinates, as many.
    pub y: Vec<f64>,
}

impl Scatter {
    /// The points with these coordinates.
    pub fn new(x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Scatter {
            x: x.into(),
            y: y.into(),
        }
    }
}

/// The estimate over a rectangular grid.
#[derive(Debug, Clone, Serialize)]
pub struct Surface {
    /// The first column's name and unit.
    pub x_label: String,
    /// The second column's name and unit.
    pub y_label: String,
    /// The estimated quantity's name and unit.
    pub z_label: String,
    /// The grid along the first column, increasing.
    pub x: Vec<f64>,
    /// The grid along the second column, increasing.
    pub y: Vec<f64>,
    /// The estimate: `z[i * x.len() + j]` is that at `(x[j], y[i])`.
    pub z: Vec<f64>,
    /// Where there are data.
    pub points: Scatter,
}

/// The estimate along one column.
#[derive(Debug, Clone, Serialize)]
pub struct Slice {
    /// Where the other columns stay, for example "b = 0.3, c = 2".
    pub at: String,
    /// The estimate.
    pub curve: Nonlinearity,
}

/// The residuals, measured less estimated.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RegressionResiduals {
    /// What they are drawn over, for example "x (m)" or "estimate".
    pub x_label: String,
    /// The residuals' name and unit.
    pub y_label: String,
    /// The residuals over that.
    pub points: Scatter,
    /// Abscissas of the running mean and spread, increasing.
    pub running_x: Vec<f64>,
    /// The mean of the residuals near each of them.
    pub running_mean: Vec<f64>,
    /// Their standard deviation about it.
    pub running_spread: Vec<f64>,
}
