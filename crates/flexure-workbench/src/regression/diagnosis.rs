//! What the residuals of a regression show.

use flexure::nonlinearity::{EstimatorName, NamedEstimator, Outside, Tuning};

use super::outliers::outliers;
use super::{Regression, RegressionData, dependence, slices};

/// Estimate and ordinate that differ by no more than this share of the ordinates' size are the same.
const REPEATED: f64 = 1e-9;

/// The residuals, and what they show.
pub struct Diagnosis {
    /// The rows of positive weight.
    pub rows: Vec<usize>,
    /// The estimate at those rows.
    pub fitted: Vec<f64>,
    /// Measured less estimated there; NaN where there is no estimate.
    pub residuals: Vec<f64>,
    /// Whether neighbouring rows depend on each other beyond what is estimated.
    pub dependent: bool,
    /// The rows that are far from the curve.
    pub outliers: Vec<usize>,
    /// The number of rows that have no other row within reach of their windows.
    pub alone: usize,
}

impl Diagnosis {
    /// Looks at the residuals of the rows that were fitted.
    pub fn new(regression: &Regression, data: &RegressionData) -> flexure::Result<Self> {
        let rows = data.rows();
        let fitted = regression.fit.regression.predict(&slices(&data.x_at(&rows)))?;
        let residuals: Vec<f64> = rows.iter().zip(&fitted).map(|(&i, m)| data.y[i] - m).collect();
        Ok(Diagnosis {
            outliers: outliers(data, &rows, &fitted, &residuals),
            alone: alone(regression, data, &rows, &residuals)?,
            dependent: dependence::depend(&regression.estimator, data, &rows, &residuals)?,
            rows,
            fitted,
            residuals,
        })
    }
}

/// The number of rows that have no other row in their windows: there, a local constant repeats any given ordinate.
fn alone(regression: &Regression, data: &RegressionData, rows: &[usize], residuals: &[f64]) -> flexure::Result<usize> {
    let name = match regression.fit.name {
        EstimatorName::Kernel | EstimatorName::LocalLinear => EstimatorName::Kernel,
        EstimatorName::Recursive => EstimatorName::Recursive,
        _ => return Ok(0),
    };
    let largest = rows.iter().map(|&i| data.y[i].abs()).fold(0.0, f64::max);
    // A lone row has a residual of zero.
    if !residuals.iter().any(|r| r.abs() <= REPEATED * largest) {
        return Ok(0);
    }
    // Pseudo-random, so that none is the mean of its neighbours.
    let scattered = |i: usize| (43_758.545_3 * (12.989_8 * i as f64).sin()).fract();
    let ordinates: Vec<f64> = (0..data.y.len()).map(scattered).collect();
    let constant = NamedEstimator {
        name,
        tuning: Tuning::Fixed(regression.fit.parameter.clone()),
        outside: Outside::Nan,
        ..regression.estimator.clone()
    };
    let repeated = constant.fit(&data.x, &ordinates, data.weights)?.regression;
    let repeated = repeated.predict(&slices(&data.x_at(rows)))?;
    let same = rows
        .iter()
        .zip(repeated)
        .filter(|(i, m)| (ordinates[**i] - m).abs() <= REPEATED);
    Ok(same.count())
}
