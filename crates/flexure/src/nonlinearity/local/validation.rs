//! Whether local bandwidths, and how local: by cross-validation between two halves of the data.

use super::choice::Broken;
use super::windows::{Design, Windows};
use crate::nonlinearity::kernel::Sorted;

/// Half widths of the confidence intervals to try, in standard errors.
const THRESHOLDS: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];
/// A gain of so many standard errors is clear.
const CLEARLY: f64 = 2.0;
/// A gain below this share of the ordinates' sum of squares is rounding.
const ROUNDING: f64 = 1e-18;
/// From all points to half of them the best bandwidth grows by this factor.
const HALVED: f64 = 1.148_698_354_997_035; // 2^(1/5)

/// Local bandwidths that predict clearly better than one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Better {
    /// Half width of the confidence intervals, in standard errors.
    pub threshold: f64,
    /// The mean squared error with which either half of the data is predicted from the other.
    pub error: f64,
}

/// The threshold with the smallest error of prediction from either half (every other point in order of x) of the other;
/// nothing where the gain over one bandwidth for all is not more than twice its standard error.
pub fn threshold(data: &Sorted, design: &Design) -> Option<Better> {
    // For every threshold the sum of the gains and of their squares.
    let mut gains = [[0.0; 2]; THRESHOLDS.len()];
    let (mut errors, mut size) = (0.0, 0.0);
    for first in 0..2 {
        let (train, other) = (half(data, first), half(data, 1 - first));
        let test = design.grouped(&other);
        let windows = Windows::new(&train, design);
        let squares = |curve: &Broken| -> Vec<f64> {
            let residual = |i: usize| test.y[i] + other.mean - train.mean - curve.value(test.x[i]);
            (0..test.len()).map(|i| test.weight(i) * residual(i).powi(2)).collect()
        };
        let global = squares(&windows.uniform(&train, HALVED * design.global).curve);
        // With groups of points in place of points, what is among those of a group is in no difference, but in the error.
        let squared = |data: &Sorted| (0..data.len()).map(|i| data.weight(i) * data.y[i].powi(2)).sum::<f64>();
        let all = squared(&other);
        errors += global.iter().sum::<f64>() + (all - squared(&test)).max(0.0);
        size += all;
        for (gain, threshold) in gains.iter_mut().zip(THRESHOLDS) {
            let local = squares(&windows.adapted(&train, threshold).curve);
            for (g, l) in global.iter().zip(&local) {
                gain[0] += g - l;
                gain[1] += (g - l).powi(2);
            }
        }
    }
    let best = (0..THRESHOLDS.len()).max_by(|&i, &j| gains[i][0].total_cmp(&gains[j][0]))?;
    let [gain, squares] = gains[best];
    (gain > CLEARLY * squares.sqrt() && gain > ROUNDING * size).then(|| Better {
        threshold: THRESHOLDS[best],
        error: (errors - gain) / (0..data.len()).map(|i| data.weight(i)).sum::<f64>(),
    })
}

/// Every other point, from `first` on.
fn half(data: &Sorted, first: usize) -> Sorted {
    let of = |value: &dyn Fn(usize) -> f64| (first..data.len()).step_by(2).map(value).collect::<Vec<_>>();
    Sorted::weighted(&of(&|i| data.x[i]), &of(&|i| data.y[i]), &of(&|i| data.weight(i)))
}
