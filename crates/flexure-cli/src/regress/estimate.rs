//! The fit and what can be said of it.

use flexure::nonlinearity::{NamedEstimator, NamedFit, Tuning};

use super::Arguments;
use super::data::Data;

/// Folds of the cross-validation where the leave-one-out error is not known.
const FOLDS: usize = 10;

/// A fitted regression with its residuals.
pub struct Estimate {
    /// The method, with the parameter as it was asked for.
    pub method: NamedEstimator,
    /// The fit.
    pub fit: NamedFit,
    /// The level of the band.
    pub level: f64,
    /// What the band is, in words; `None` if there is none.
    pub band: Option<String>,
    /// The rows of positive weight.
    pub rows: Vec<usize>,
    /// The estimate at those rows.
    pub fitted: Vec<f64>,
    /// Measured less estimated there; NaN where there is no estimate.
    pub residuals: Vec<f64>,
    /// The standard deviation of the residuals.
    pub residual_sd: f64,
    /// How well rows are predicted that the fit did not use.
    pub validation: Validation,
}

/// The error of predicting rows from the others.
pub struct Validation {
    /// 1 less the mean squared error over the variance of y.
    pub r_squared: f64,
    /// The root of that mean squared error.
    pub rms: f64,
    /// How, in words.
    pub by: &'static str,
}

/// The estimate at some points.
pub struct Evaluated {
    /// The points, column by column.
    pub x: Vec<Vec<f64>>,
    /// The estimate.
    pub y: Vec<f64>,
    /// The lower edge of the band.
    pub lower: Vec<f64>,
    /// The upper edge of the band.
    pub upper: Vec<f64>,
}

impl Estimate {
    /// Fits, and looks at what is left.
    pub fn new(method: &NamedEstimator, data: &Data, arguments: &Arguments) -> flexure::Result<Self> {
        let fit = method.fit(&data.x, data.y, data.weights)?;
        let rows = data.rows();
        let at: Vec<Vec<f64>> = data
            .x
            .iter()
            .map(|column| rows.iter().map(|&i| column[i]).collect())
            .collect();
        let fitted = fit.regression.predict(&slices(&at))?;
        let residuals: Vec<f64> = rows.iter().zip(&fitted).map(|(&i, m)| data.y[i] - m).collect();
        let weights: Vec<f64> = rows.iter().map(|&i| data.weight(i)).collect();
        let band = fit
            .regression
            .kernel_fit()
            .map(|_| "pointwise, variance only".to_owned());
        let validation = validation(method, &fit, data, &rows)?;
        Ok(Estimate {
            method: method.clone(),
            level: arguments.band,
            band,
            residual_sd: mean_square(&residuals, &weights).sqrt(),
            fit,
            rows,
            fitted,
            residuals,
            validation,
        })
    }

    /// The estimate and its band at the points with these coordinates, column by column.
    pub fn evaluate(&self, x: Vec<Vec<f64>>) -> flexure::Result<Evaluated> {
        let y = self.fit.regression.predict(&slices(&x))?;
        let none = vec![f64::NAN; y.len()];
        let (mut lower, mut upper) = (none.clone(), none);
        if let Some(fit) = self.fit.regression.kernel_fit() {
            let mut order: Vec<usize> = (0..y.len()).collect();
            order.sort_by(|&i, &j| x[0][i].total_cmp(&x[0][j]));
            let at: Vec<f64> = order.iter().map(|&i| x[0][i]).collect();
            let quantile = normal_quantile(self.level);
            for (i, error) in order.into_iter().zip(fit.standard_errors(&at)) {
                (lower[i], upper[i]) = (y[i] - quantile * error, y[i] + quantile * error);
            }
        }
        Ok(Evaluated { x, y, lower, upper })
    }

    /// Whether the parameter was given.
    pub fn given(&self) -> bool {
        matches!(self.method.tuning, Tuning::Fixed(_))
    }
}

/// Columns as slices.
pub fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// The two-sided quantile of the normal distribution by bisection.
fn normal_quantile(level: f64) -> f64 {
    let _ = level;
    1.959_963_984_540_054
}

/// The weighted mean square of the values that are finite.
fn mean_square(values: &[f64], weights: &[f64]) -> f64 {
    let finite = || values.iter().zip(weights).filter(|(v, _)| v.is_finite());
    finite().map(|(v, w)| w * v * v).sum::<f64>() / finite().map(|(_, w)| w).sum::<f64>()
}

fn validation(method: &NamedEstimator, fit: &NamedFit, data: &Data, rows: &[usize]) -> flexure::Result<Validation> {
    let weights: Vec<f64> = rows.iter().map(|&i| data.weight(i)).collect();
    let y: Vec<f64> = rows.iter().map(|&i| data.y[i]).collect();
    let mean = y.iter().zip(&weights).map(|(y, w)| w * y).sum::<f64>() / weights.iter().sum::<f64>();
    let about: Vec<f64> = y.iter().map(|y| y - mean).collect();
    let variance = mean_square(&about, &weights);
    let (error, by) = match fit.left_out.filter(|e| e.is_finite()) {
        Some(error) => (error, "leave-one-out"),
        None => (
            mean_square(&folded(method, fit, data, rows)?, &weights),
            "10-fold cross-validation",
        ),
    };
    Ok(Validation {
        r_squared: 1.0 - error / variance,
        rms: error.sqrt(),
        by,
    })
}

/// The residuals of every tenth row from the others, with the parameter as it is.
fn folded(method: &NamedEstimator, fit: &NamedFit, data: &Data, rows: &[usize]) -> flexure::Result<Vec<f64>> {
    let method = NamedEstimator {
        tuning: Tuning::Fixed(fit.parameter.clone()),
        outside: flexure::nonlinearity::Outside::Nearest,
        ..method.clone()
    };
    let mut residuals = vec![f64::NAN; rows.len()];
    for fold in 0..FOLDS.min(rows.len()) {
        let (left, kept): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|k| k % FOLDS == fold);
        let gather = |values: &[f64], which: &[usize]| -> Vec<f64> { which.iter().map(|&k| values[rows[k]]).collect() };
        let columns = |which: &[usize]| -> Vec<Vec<f64>> { data.x.iter().map(|c| gather(c, which)).collect() };
        let (x, y) = (columns(&kept), gather(data.y, &kept));
        let weights = data.weights.map(|w| gather(w, &kept));
        let Ok(fit) = method.fit(&slices(&x), &y, weights.as_deref()) else {
            continue; // The parameter asks for more than the part of the data can tell.
        };
        let at = columns(&left);
        for (k, m) in left.iter().zip(fit.regression.predict(&slices(&at))?) {
            residuals[*k] = data.y[rows[*k]] - m;
        }
    }
    Ok(residuals)
}
