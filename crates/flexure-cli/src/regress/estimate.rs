//! The fit and what can be said of it.

use std::ops::ControlFlow;

use flexure::nonlinearity::{Degree, EstimatorName, NamedEstimator, NamedFit, Outside, Rule, Tuning};
use flexure::selection::{BandwidthRule, BlockFolds, choose_bandwidth};

use super::Method;
use super::band::{Banding, banding, kind_words};
use super::data::Data;

/// Folds of the cross-validation where the leave-one-out error is not known.
const FOLDS: usize = 10;
/// Fewer rows tell nothing of the residuals' dependence.
const FEWEST_FOR_DEPENDENCE: usize = 50;
/// More rows than this are not needed for it.
const MOST_FOR_DEPENDENCE: usize = 4000;
/// A correlation of x with time above this is a trend.
const TREND: f64 = 0.9;
/// The two-sided 99 % quantile of the normal distribution.
const SIGNIFICANT: f64 = 2.575_829_303_548_901;
/// A correlation below this does no harm however significant it is.
const HARMFUL: f64 = 0.1;
/// A bandwidth by blocks this many times that by leave-one-out tells that the latter follows the noise.
const WIDER: f64 = 1.5;
/// Where x goes with time, rows near in time are those near in x, and leaving them out widens the window even where the
/// noise is independent: there a window of no more rows than this to either side tells that it follows the noise.
const FEW_ROWS: f64 = 5.0;
/// So far apart rows tell whether the noise depends on itself, where their second differences are so many times larger
/// than those of neighbours; independent noise makes both alike, an autoregression of 0.5 the far ones 1.5 times larger.
const FAR_APART: usize = 5;
const ROUGHER: f64 = 1.3;
/// Estimate and ordinate that differ by no more than this share of the ordinates' size are the same.
const REPEATED: f64 = 1e-9;

/// A fitted regression with its residuals.
pub struct Estimate {
    /// The method, with the parameter as it was asked for.
    pub method: NamedEstimator,
    /// The fit.
    pub fit: NamedFit,
    /// How the band is made; `None` if there is none.
    pub banding: Option<Banding>,
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
    /// Whether neighbouring rows depend on each other beyond what is estimated.
    pub dependent: bool,
}

/// The error of predicting rows from the others.
pub struct Validation {
    /// 1 less the mean squared error over the variance of y.
    pub r_squared: f64,
    /// The root of that mean squared error.
    pub rms: f64,
    /// How, in words.
    pub by: &'static str,
    /// All rows.
    pub rows: usize,
    /// Rows that have no other row within reach of their windows: they are predicted by their nearest rows.
    pub alone: usize,
    /// Rows that could not be predicted, and do not count in the error.
    pub unpredicted: usize,
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
    /// What the band is; `None` if there is none.
    pub band: Option<BandWords>,
}

/// What a band is.
#[derive(Clone)]
pub struct BandWords {
    /// The nominal coverage.
    pub level: f64,
    /// "pointwise" or "simultaneous".
    pub kind: &'static str,
    /// Of what it is, where that is not the estimate itself; with its comma.
    pub of: &'static str,
    /// How it was made.
    pub method: String,
}

impl Estimate {
    /// Fits, and looks at what is left.
    pub fn new(method: &Method, data: &Data) -> flexure::Result<Self> {
        let fit = method.estimator.fit(&data.x, data.y, data.weights)?;
        let rows = data.rows();
        let fitted = fit.regression.predict(&slices(&gathered(data, &rows)))?;
        let residuals: Vec<f64> = rows.iter().zip(&fitted).map(|(&i, m)| data.y[i] - m).collect();
        let weights: Vec<f64> = rows.iter().map(|&i| data.weight(i)).collect();
        let mut validation = validation(&method.estimator, &fit, data, &rows)?;
        validation.alone = alone(&method.estimator, &fit, data, (&rows, &residuals))?;
        let dependent = correlated(&residuals) || follows_noise(&method.estimator, data, &rows)?;
        Ok(Estimate {
            method: method.estimator.clone(),
            banding: banding(method, &fit, data),
            residual_sd: mean_square(&residuals, &weights).sqrt(),
            fit,
            rows,
            fitted,
            residuals,
            validation,
            dependent,
        })
    }

    /// The estimate and its band at the points with these coordinates, column by column.
    pub fn evaluate(&self, data: &Data, x: Vec<Vec<f64>>) -> flexure::Result<Evaluated> {
        let y = self.fit.regression.predict(&slices(&x))?;
        let Some(banding) = self.banding else {
            let none = vec![f64::NAN; y.len()];
            return Ok(Evaluated {
                x,
                y,
                lower: none.clone(),
                upper: none,
                band: None,
            });
        };
        let band = banding.band(&self.method, &self.fit, data, &x, &mut |_, _| ControlFlow::Continue(()))?;
        let of = match (&self.fit.local, banding) {
            (Some(_), Banding::Robust(_)) => ", of the local line with one bandwidth",
            _ => "",
        };
        Ok(Evaluated {
            x,
            y,
            lower: band.lower,
            upper: band.upper,
            band: Some(BandWords {
                level: band.level,
                kind: kind_words(band.kind),
                of,
                method: format!("{}{of}", band.method),
            }),
        })
    }
}

/// Columns as slices.
pub fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

fn gathered(data: &Data, rows: &[usize]) -> Vec<Vec<f64>> {
    let of = |column: &&[f64]| rows.iter().map(|&i| column[i]).collect();
    data.x.iter().map(of).collect()
}

/// The weighted mean square of the values that are finite.
fn mean_square(values: &[f64], weights: &[f64]) -> f64 {
    let finite = || values.iter().zip(weights).filter(|(v, _)| v.is_finite());
    finite().map(|(v, w)| w * v * v).sum::<f64>() / finite().map(|(_, w)| w).sum::<f64>()
}

/// Whether the residuals of neighbouring rows are correlated, by a correlation that is significant and not small.
fn correlated(residuals: &[f64]) -> bool {
    let residuals: Vec<f64> = residuals.iter().copied().filter(|r| r.is_finite()).collect();
    let n = residuals.len();
    if n < FEWEST_FOR_DEPENDENCE {
        return false;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let squares: f64 = residuals.iter().map(|r| (r - mean).powi(2)).sum();
    let products: f64 = residuals.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    let r = products / squares;
    r > HARMFUL && r * (n as f64).sqrt() > SIGNIFICANT
}

/// The correlation of two columns; 0 where one is constant.
fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let products = |f: &dyn Fn(f64, f64) -> f64| x.iter().zip(y).map(|(x, y)| f(x - mx, y - my)).sum::<f64>();
    let scale = (products(&|x, _| x * x) * products(&|_, y| y * y)).sqrt();
    if scale > 0.0 {
        products(&|x, y| x * y) / scale
    } else {
        0.0
    }
}

/// Whether leave-one-out would follow noise that depends on itself in time: such a fit leaves residuals in which nothing
/// is to be seen, but leaving out neighbours in time asks for a much wider window.
fn follows_noise(method: &NamedEstimator, data: &Data, rows: &[usize]) -> flexure::Result<bool> {
    let ([_], true) = (data.x.as_slice(), rows.len() >= FEWEST_FOR_DEPENDENCE) else {
        return Ok(false);
    };
    // As many as tell it, from the middle: the comparison costs more than in proportion.
    let first = rows.len().saturating_sub(MOST_FOR_DEPENDENCE) / 2;
    let rows = &rows[first..rows.len().min(first + MOST_FOR_DEPENDENCE)];
    let x = gathered(data, rows);
    let y: Vec<f64> = rows.iter().map(|&i| data.y[i]).collect();
    let time: Vec<f64> = (0..rows.len()).map(|t| t as f64).collect();
    let trend = correlation(&x[0], &time).abs() > TREND;
    if BlockFolds::for_data(&x[0], &y)?.gap == 0 {
        return Ok(false);
    }
    let degree = match method.name {
        EstimatorName::Kernel => Degree::Constant,
        _ => Degree::Linear,
    };
    let bandwidth = |rule| choose_bandwidth(rule, method.kernel, degree, &x[0], &y, None).map(|c| c.bandwidth());
    let loo = bandwidth(BandwidthRule::LeaveOneOut)?;
    if trend {
        let extent = x[0].iter().fold(0.0, |most: f64, v| most.max((v - x[0][0]).abs()));
        // A jump asks for a narrow window too; but the differences tell no dependence.
        return Ok(loo <= FEW_ROWS * extent / rows.len() as f64 && rougher_far_apart(&y));
    }
    Ok(bandwidth(BandwidthRule::HBlock { gap: None })? > WIDER * loo)
}

/// Whether values some rows apart differ more than neighbours do, beyond a trend: as they do where the noise depends on
/// itself. Of second differences the medians are compared, which a few jumps do not move.
fn rougher_far_apart(y: &[f64]) -> bool {
    let median = |lag: usize| {
        let differences = y.windows(2 * lag + 1).map(|w| (w[0] - 2.0 * w[lag] + w[2 * lag]).abs());
        let mut sizes: Vec<f64> = differences.collect();
        let middle = sizes.len() / 2;
        *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    y.len() > 2 * FAR_APART && median(FAR_APART) > ROUGHER * median(1)
}

fn validation(method: &NamedEstimator, fit: &NamedFit, data: &Data, rows: &[usize]) -> flexure::Result<Validation> {
    let weights: Vec<f64> = rows.iter().map(|&i| data.weight(i)).collect();
    let y: Vec<f64> = rows.iter().map(|&i| data.y[i]).collect();
    let mean = y.iter().zip(&weights).map(|(y, w)| w * y).sum::<f64>() / weights.iter().sum::<f64>();
    let about: Vec<f64> = y.iter().map(|y| y - mean).collect();
    let variance = mean_square(&about, &weights);
    // Rows that depend on their neighbours are not predicted from those.
    let blocks = match (&method.tuning, &fit.scores) {
        (Tuning::FromData(Rule::Block), Some(scores)) => scores.score.iter().copied().reduce(f64::min),
        _ => None,
    };
    let halves = fit.local.as_ref().and_then(|local| local.prediction_error);
    let known = [
        (blocks, "cross-validation over blocks of rows"),
        (fit.left_out, "leave-one-out"),
        (halves, "either half of the rows from the other"),
    ];
    let known = known
        .into_iter()
        .find_map(|(error, by)| Some((error.filter(|e| e.is_finite())?, by)));
    let (error, by, unpredicted) = match known {
        Some((error, by)) => (error, by, 0),
        None => {
            let residuals = folded(&method.fixed(fit), data, rows)?;
            let unpredicted = residuals.iter().filter(|r| !r.is_finite()).count();
            (
                mean_square(&residuals, &weights),
                match rows.len() > FOLDS {
                    true => "10-fold cross-validation",
                    false => "leave-one-out",
                },
                unpredicted,
            )
        }
    };
    Ok(Validation {
        r_squared: 1.0 - error / variance,
        rms: error.sqrt(),
        by,
        rows: rows.len(),
        alone: 0,
        unpredicted,
    })
}

/// The number of rows that have no other row in their windows: those at which a local constant repeats whatever ordinates
/// it is given.
fn alone(
    method: &NamedEstimator,
    fit: &NamedFit,
    data: &Data,
    (rows, residuals): (&[usize], &[f64]),
) -> flexure::Result<usize> {
    let name = match fit.name {
        EstimatorName::Kernel | EstimatorName::LocalLinear => EstimatorName::Kernel,
        EstimatorName::Recursive => EstimatorName::Recursive,
        _ => return Ok(0),
    };
    let largest = rows.iter().map(|&i| data.y[i].abs()).fold(0.0, f64::max);
    // A row alone has no residual.
    if !residuals.iter().any(|r| r.abs() <= REPEATED * largest) {
        return Ok(0);
    }
    // As good as random, so that none is the mean of its neighbours.
    let scattered = |i: usize| (43_758.545_3 * (12.989_8 * i as f64).sin()).fract();
    let ordinates: Vec<f64> = (0..data.y.len()).map(scattered).collect();
    let constant = NamedEstimator {
        name,
        tuning: Tuning::Fixed(fit.parameter.clone()),
        outside: Outside::Nan,
        ..method.clone()
    };
    let repeated = constant.fit(&data.x, &ordinates, data.weights)?.regression;
    let repeated = repeated.predict(&slices(&gathered(data, rows)))?;
    let same = rows
        .iter()
        .zip(repeated)
        .filter(|(i, m)| (ordinates[**i] - m).abs() <= REPEATED);
    Ok(same.count())
}

/// The residuals of every tenth row from the others; NaN where these do not allow a fit.
fn folded(method: &NamedEstimator, data: &Data, rows: &[usize]) -> flexure::Result<Vec<f64>> {
    let method = NamedEstimator {
        outside: Outside::Nearest,
        ..method.clone()
    };
    let mut residuals = vec![f64::NAN; rows.len()];
    for fold in 0..FOLDS.min(rows.len()) {
        let (left, kept): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|k| k % FOLDS == fold);
        let kept: Vec<usize> = kept.into_iter().map(|k| rows[k]).collect();
        let of = |column: &[f64]| -> Vec<f64> { kept.iter().map(|&i| column[i]).collect() };
        let weights = data.weights.map(of);
        let Ok(fit) = method.fit(&slices(&gathered(data, &kept)), &of(data.y), weights.as_deref()) else {
            continue;
        };
        let asked: Vec<usize> = left.iter().map(|&k| rows[k]).collect();
        let predicted = fit.regression.predict(&slices(&gathered(data, &asked)))?;
        for (k, m) in left.into_iter().zip(predicted) {
            residuals[k] = data.y[rows[k]] - m;
        }
    }
    Ok(residuals)
}
