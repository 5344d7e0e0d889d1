//! Rows that are far from the curve: found in every regression, and left out where that is asked for.
//!
//! A row is left out by a weight of zero. The fit is repeated until the outliers stay the same: this is the M-estimate with weight 1 below
//! the limit and 0 above.

use flexure::nonlinearity::NamedEstimator;
use flexure::outliers::far_along;

use super::{Diagnosis, Regression, RegressionData};

/// A row is an outlier from this many usual residuals on. Normal residuals have none in a million rows. Convention.
const OUTLIER: f64 = 8.0;
/// If a larger share of rows is far from the curve, this is the nature of the noise. Convention.
const MOST_OUTLIERS: f64 = 0.1;
/// The most fits. Two are enough if the first finds all outliers.
const ROUNDS: usize = 5;

/// The outliers among rows with these residuals: far from zero, compared with rows of nearly the same x or, for several columns, of nearly
/// the same estimate.
pub fn outliers(data: &RegressionData, rows: &[usize], fitted: &[f64], residuals: &[f64]) -> Vec<usize> {
    let places: Vec<f64> = match &data.x[..] {
        [x] => rows.iter().map(|&row| x[row]).collect(),
        _ => fitted.to_vec(),
    };
    let sizes: Vec<f64> = residuals.iter().map(|residual| residual.abs()).collect();
    let far = far_along(&places, &sizes, OUTLIER, f64::MIN_POSITIVE);
    let mut found: Vec<usize> = far.into_iter().map(|at| rows[at]).collect();
    found.sort_unstable();
    match found.len() as f64 > MOST_OUTLIERS * rows.len() as f64 {
        true => Vec::new(),
        false => found,
    }
}

/// The weights of all rows without the outliers, and the outliers.
pub fn without_outliers(estimator: &NamedEstimator, data: &RegressionData) -> flexure::Result<(Vec<f64>, Vec<usize>)> {
    let own: Vec<f64> = (0..data.y.len()).map(|row| data.weight(row)).collect();
    let (mut weights, mut found) = (own.clone(), Vec::new());
    for _ in 0..ROUNDS {
        let kept = RegressionData {
            weights: Some(&weights),
            ..data.clone()
        };
        let regression = Regression::new(estimator.clone(), &kept)?;
        let all = Diagnosis::new(&regression, data)?;
        if all.outliers == found {
            break;
        }
        found = all.outliers;
        weights.clone_from(&own);
        found.iter().for_each(|&row| weights[row] = 0.0);
    }
    Ok((weights, found))
}
