//! Decides whether local bandwidths are used, and with which threshold, by cross-validation between two halves of the data.

use super::choice::Broken;
use super::windows::{Design, Windows};
use crate::nonlinearity::kernel::Sorted;
use crate::sort;

/// Half widths of the confidence intervals to try, in standard errors.
const THRESHOLDS: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];
/// A gain of this many standard errors is clear. For smooth m the gain is negative: of 540 records, one reached this limit.
const CLEARLY: f64 = 1.0;
/// Near a jump a few errors are so large that no gain is clear. Then errors are cut off at this many standard deviations, and a gain of
/// this many standard errors is clear.
const CLEARLY_ELSEWHERE: f64 = 3.0;
const CUT: f64 = 4.0;
/// The median of the square of a standard normal variable.
const MEDIAN_SQUARE: f64 = 0.454_936_423_119_572_7;
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
    /// The same error with one bandwidth for all points.
    pub error_of_one: f64,
}

/// The threshold with the smallest prediction error between the two halves (every other point in order of x). `None` if the gain over one
/// bandwidth for all is not clear. A clear gain is more than its standard error, or three times that if large errors are cut off.
pub fn threshold(data: &Sorted, design: &Design) -> Option<Better> {
    let mut gains = [Gain::default(); THRESHOLDS.len()];
    let (mut errors, mut size) = (0.0, 0.0);
    // The fourth powers of very large or very small ordinates leave the range of floating-point numbers.
    let unit = data.y.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
    let unit = if unit.is_normal() { unit } else { 1.0 };
    for first in 0..2 {
        let (train, other) = (half(data, first), half(data, 1 - first));
        let test = design.grouped(&other);
        let windows = Windows::new(&train, design);
        let squares = |curve: &Broken| -> Vec<f64> {
            let residual = |i: usize| test.y[i] + other.mean - train.mean - curve.value(test.x[i]);
            (0..test.len())
                .map(|i| test.weight(i) * (residual(i) / unit).powi(2))
                .collect()
        };
        let global = squares(&windows.uniform(&train, HALVED * design.global).curve);
        // If groups stand for points, the scatter within a group is in no difference of two predictions, but it is in the error.
        let squared = |data: &Sorted| {
            (0..data.len())
                .map(|i| data.weight(i) * (data.y[i] / unit).powi(2))
                .sum::<f64>()
        };
        let all = squared(&other);
        errors += global.iter().sum::<f64>() + (all - squared(&test)).max(0.0);
        size += all;
        for (gain, threshold) in gains.iter_mut().zip(THRESHOLDS) {
            let local = squares(&windows.adapted(&train, threshold).curve);
            gain.add(&global, &local);
        }
    }
    let best = (0..THRESHOLDS.len()).max_by(|&i, &j| gains[i].sum.total_cmp(&gains[j].sum))?;
    let gain = gains[best].sum;
    let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
    (gains[best].is_clear() && gain > ROUNDING * size).then(|| Better {
        threshold: THRESHOLDS[best],
        error: (errors - gain) / total * unit * unit,
        error_of_one: errors / total * unit * unit,
    })
}

/// How much better local bandwidths predict than one.
#[derive(Clone, Copy, Default)]
struct Gain {
    /// The sum of the differences of the squared errors, and the sum of the squares of these differences.
    sum: f64,
    squares: f64,
    /// The same with errors cut off.
    cut_sum: f64,
    cut_squares: f64,
}

impl Gain {
    /// The weighted squared errors of one bandwidth and of local ones.
    fn add(&mut self, global: &[f64], local: &[f64]) {
        if local.is_empty() {
            return;
        }
        let most = CUT * CUT * sort::median(local.to_vec()) / MEDIAN_SQUARE;
        for (&g, &l) in global.iter().zip(local) {
            let (gain, cut) = (g - l, g.min(most) - l.min(most));
            self.sum += gain;
            self.squares += gain * gain;
            self.cut_sum += cut;
            self.cut_squares += cut * cut;
        }
    }

    fn is_clear(&self) -> bool {
        self.sum > CLEARLY * self.squares.sqrt()
            || self.sum > 0.0 && self.cut_sum > CLEARLY_ELSEWHERE * self.cut_squares.sqrt()
    }
}

/// Every other point, from `first` on.
fn half(data: &Sorted, first: usize) -> Sorted {
    let of = |value: &dyn Fn(usize) -> f64| (first..data.len()).step_by(2).map(value).collect::<Vec<_>>();
    Sorted::new(&of(&|i| data.x[i]), &of(&|i| data.y[i]), Some(&of(&|i| data.weight(i))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nonlinearity::Kernel;

    /// The choice is the same in every unit of y, and the errors scale with the square of the unit.
    #[test]
    fn the_choice_does_not_depend_on_the_unit() {
        let n = 2000;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i * 37 % n)).collect();
        let noise = |i: usize| (i * i % 101) as f64 / 101.0 - 0.5;
        let y: Vec<f64> = (0..x.len()).map(|i| f64::from(x[i] > 700.0) + noise(i)).collect();
        let better = |unit: f64| {
            let y: Vec<f64> = y.iter().map(|y| unit * y).collect();
            let data = Sorted::new(&x, &y, None);
            threshold(&data, &Design::new(&data, Kernel::default(), 50.0)).unwrap()
        };
        let one = better(1.0);
        assert!(one.error < one.error_of_one);
        for unit in [1e-150, 1e-80, 1e80, 1e150] {
            let scaled = better(unit);
            assert_eq!(scaled.threshold, one.threshold, "{unit}");
            for (scaled, one) in [(scaled.error, one.error), (scaled.error_of_one, one.error_of_one)] {
                assert!(
                    (scaled / unit / unit / one - 1.0).abs() < 1e-9,
                    "{unit}: {scaled} {one}"
                );
            }
        }
    }
}
