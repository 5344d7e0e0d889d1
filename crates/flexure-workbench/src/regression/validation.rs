//! How well a fit predicts rows that it did not use.

use flexure::nonlinearity::{NamedEstimator, Outside, Rule, Tuning};

use super::{Diagnosis, Regression, RegressionData, slices};

/// Folds of the cross-validation where the leave-one-out error is not known.
const FOLDS: usize = 10;

/// The error of predicting rows from the others.
pub struct Validation {
    /// 1 - (mean squared error)/(variance of y).
    pub r_squared: f64,
    /// The root of that mean squared error.
    pub rms: f64,
    /// How the rows were predicted, for reading.
    pub by: &'static str,
    /// Rows that could not be predicted, and do not count in the error.
    pub unpredicted: usize,
    /// The standard deviation of the residuals of the fit.
    pub residual_sd: f64,
}

impl Validation {
    /// From the error that is known from the choice of the parameter, otherwise by cross-validation.
    pub fn new(regression: &Regression, data: &RegressionData, diagnosis: &Diagnosis) -> flexure::Result<Self> {
        let rows = &diagnosis.rows;
        let weights: Vec<f64> = rows.iter().map(|&i| data.weight(i)).collect();
        let y: Vec<f64> = rows.iter().map(|&i| data.y[i]).collect();
        let mean = y.iter().zip(&weights).map(|(y, w)| w * y).sum::<f64>() / weights.iter().sum::<f64>();
        let about: Vec<f64> = y.iter().map(|y| y - mean).collect();
        let variance = mean_square(&about, &weights);
        let (Predicted { error, by }, unpredicted) = match known_error(regression) {
            Some(known) => (known, 0),
            None => {
                let residuals = residuals_of_folds(regression, data, rows)?;
                let unpredicted = residuals.iter().filter(|r| !r.is_finite()).count();
                let by = match rows.len() > FOLDS {
                    true => "10-fold cross-validation",
                    false => "leave-one-out",
                };
                let error = mean_square(&residuals, &weights);
                (Predicted { error, by }, unpredicted)
            }
        };
        Ok(Validation {
            r_squared: 1.0 - error / variance,
            rms: error.sqrt(),
            by,
            unpredicted,
            residual_sd: mean_square(&diagnosis.residuals, &weights).sqrt(),
        })
    }
}

/// A mean squared error of prediction.
struct Predicted {
    error: f64,
    /// How rows were predicted for it.
    by: &'static str,
}

/// The error that is known from the choice of the parameter.
fn known_error(regression: &Regression) -> Option<Predicted> {
    let (fit, estimator) = (&regression.fit, &regression.estimator);
    // Rows that depend on their neighbours must not be predicted from them.
    let blocks = match (&estimator.tuning, &fit.scores) {
        (Tuning::FromData(Rule::Block), Some(scores)) => scores.score.iter().copied().reduce(f64::min),
        _ => None,
    };
    let halves = fit.local.as_ref().and_then(|local| local.prediction_error);
    [
        (blocks, "cross-validation over blocks of rows"),
        (fit.left_out, "leave-one-out"),
        (halves, "either half of the rows from the other"),
    ]
    .into_iter()
    .find_map(|(error, by)| {
        let error = error.filter(|e| e.is_finite())?;
        Some(Predicted { error, by })
    })
}

/// The residuals of every tenth row from the others; NaN where these do not allow a fit.
fn residuals_of_folds(regression: &Regression, data: &RegressionData, rows: &[usize]) -> flexure::Result<Vec<f64>> {
    let estimator = NamedEstimator {
        outside: Outside::Nearest,
        ..regression.estimator.fixed(&regression.fit)
    };
    let mut residuals = vec![f64::NAN; rows.len()];
    for fold in 0..FOLDS.min(rows.len()) {
        let (out, kept): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|k| k % FOLDS == fold);
        let kept: Vec<usize> = kept.into_iter().map(|k| rows[k]).collect();
        let of = |column: &[f64]| -> Vec<f64> { kept.iter().map(|&i| column[i]).collect() };
        let weights = data.weights.map(of);
        let Ok(fit) = estimator.fit(&slices(&data.x_at(&kept)), &of(data.y), weights.as_deref()) else {
            continue;
        };
        let asked: Vec<usize> = out.iter().map(|&k| rows[k]).collect();
        let predicted = fit.regression.predict(&slices(&data.x_at(&asked)))?;
        for (k, m) in out.into_iter().zip(predicted) {
            residuals[k] = data.y[rows[k]] - m;
        }
    }
    Ok(residuals)
}

/// The weighted mean square of the values that are finite.
fn mean_square(values: &[f64], weights: &[f64]) -> f64 {
    let finite = || values.iter().zip(weights).filter(|(v, _)| v.is_finite());
    finite().map(|(v, w)| w * v * v).sum::<f64>() / finite().map(|(_, w)| w).sum::<f64>()
}
