//! Whether neighbouring rows depend on each other beyond what is estimated.
//!
//! Two signs are looked for. The residuals of neighbouring rows may be correlated. Or the fit follows the noise, so that the residuals show
//! nothing; then choosing the bandwidth without neighbours in time gives a much wider window.

use flexure::nonlinearity::{Degree, EstimatorName, NamedEstimator};
use flexure::quantiles::NORMAL_99;
use flexure::selection::{BandwidthRule, BlockFolds, choose_bandwidth};

use super::RegressionData;

/// Fewer rows do not show a dependence.
const FEWEST_ROWS: usize = 50;
/// More rows than this are not needed for it.
const MOST_ROWS: usize = 4000;
/// A correlation of x with time above this is a trend.
const TREND: f64 = 0.9;
/// A smaller correlation does no harm, even if it is significant.
const HARMFUL: f64 = 0.1;
/// A bandwidth by blocks this many times that by leave-one-out shows that the latter follows the noise.
const WIDER: f64 = 1.5;
/// If x follows time, rows near in time are near in x, and leaving them out widens the window even if the noise is independent. Then a
/// window of at most this many rows to either side shows that the fit follows the noise.
const FEW_ROWS: f64 = 5.0;
/// Rows this far apart show whether the noise depends on itself: their second differences are then [`ROUGHER`] times larger than those of
/// neighbours. Independent noise makes both equal; an autoregression of 0.5 makes the far ones 1.5 times larger.
const FAR_APART: usize = 5;
/// See [`FAR_APART`].
const ROUGHER: f64 = 1.3;

/// Whether rows depend on their neighbours; `residuals` are those of `rows`.
pub fn depend(
    estimator: &NamedEstimator,
    data: &RegressionData,
    rows: &[usize],
    residuals: &[f64],
) -> flexure::Result<bool> {
    Ok(correlated(residuals) || follows_noise(estimator, data, rows)?)
}

/// Whether the residuals of neighbouring rows are correlated, with a correlation that is significant and not small.
fn correlated(residuals: &[f64]) -> bool {
    let residuals: Vec<f64> = residuals.iter().copied().filter(|r| r.is_finite()).collect();
    let n = residuals.len();
    if n < FEWEST_ROWS {
        return false;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let squares: f64 = residuals.iter().map(|r| (r - mean).powi(2)).sum();
    let products: f64 = residuals.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    let r = products / squares;
    r > HARMFUL && r * (n as f64).sqrt() > NORMAL_99
}

/// Whether leave-one-out follows noise that depends on itself in time.
fn follows_noise(estimator: &NamedEstimator, data: &RegressionData, rows: &[usize]) -> flexure::Result<bool> {
    let ([_], true) = (data.x.as_slice(), rows.len() >= FEWEST_ROWS) else {
        return Ok(false);
    };
    // Enough rows from the middle: the cost of the comparison grows faster than the number of rows.
    let first = rows.len().saturating_sub(MOST_ROWS) / 2;
    let rows = &rows[first..rows.len().min(first + MOST_ROWS)];
    let x = &data.x_at(rows)[0];
    let y: Vec<f64> = rows.iter().map(|&i| data.y[i]).collect();
    let time: Vec<f64> = (0..rows.len()).map(|t| t as f64).collect();
    if BlockFolds::for_data(x, &y)?.gap == 0 {
        return Ok(false);
    }
    let degree = match estimator.name {
        EstimatorName::Kernel => Degree::Constant,
        _ => Degree::Linear,
    };
    let bandwidth = |rule| choose_bandwidth(rule, estimator.kernel, degree, x, &y, None).map(|c| c.bandwidth());
    let leave_one_out = bandwidth(BandwidthRule::LeaveOneOut)?;
    if correlation(x, &time).abs() > TREND {
        let extent = x.iter().fold(0.0, |most: f64, v| most.max((v - x[0]).abs()));
        // A jump also needs a narrow window, but its differences show no dependence.
        return Ok(leave_one_out <= FEW_ROWS * extent / rows.len() as f64 && rougher_far_apart(&y));
    }
    Ok(bandwidth(BandwidthRule::HBlock { gap: None })? > WIDER * leave_one_out)
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

/// Whether values some rows apart differ more than neighbours do, beyond a trend: as they do if the noise depends on itself. The medians of
/// second differences are compared, since a few jumps do not change them.
fn rougher_far_apart(y: &[f64]) -> bool {
    let median = |lag: usize| {
        let differences = y.windows(2 * lag + 1).map(|w| (w[0] - 2.0 * w[lag] + w[2 * lag]).abs());
        let mut sizes: Vec<f64> = differences.collect();
        let middle = sizes.len() / 2;
        *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    y.len() > 2 * FAR_APART && median(FAR_APART) > ROUGHER * median(1)
}
