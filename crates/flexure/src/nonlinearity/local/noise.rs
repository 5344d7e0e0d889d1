//! The noise's variance as a function of x, without an estimate of m.

use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, for_each_sum};

/// The variance is averaged over this share of the data's extent on either side.
const WINDOW: f64 = 0.15;

/// The standard deviation of an observation of weight one at each of the increasing points `at`: the local mean square of the differences
/// between every ordinate and the straight line through its neighbours. A smooth m hardly affects these differences (Gasser, Sroka and
/// Jennen-Steinmetz 1986).
pub fn deviation(data: &Sorted, extent: f64, at: &[f64]) -> Vec<f64> {
    let last = data.len() - 1;
    let squares: Vec<f64> = (1..last).map(|i| square(data, i)).collect();
    let differences = Sorted::new(&data.x[1..last], &squares, None);
    // Where no difference is in reach, the overall mean is used.
    let mut variance = vec![differences.mean; at.len()];
    for_each_sum(
        &differences,
        Kernel::Uniform,
        Degree::Constant,
        WINDOW * extent,
        at,
        |j, sums| {
            if let Some(fit) = sums.fit(Degree::Constant) {
                variance[j] = differences.mean + fit.value;
            }
        },
    );
    // Ordinates on a line have no noise except for their rounding.
    let floor = f64::EPSILON * data.y.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    variance.into_iter().map(|v| v.max(0.0).sqrt().max(floor)).collect()
}

/// The squared difference at an inner point, scaled to the variance of an observation of weight one.
fn square(data: &Sorted, i: usize) -> f64 {
    let gap = data.x[i + 1] - data.x[i - 1];
    let right = if gap > 0.0 {
        (data.x[i] - data.x[i - 1]) / gap
    } else {
        0.5
    };
    let left = 1.0 - right;
    let difference = data.y[i] - left * data.y[i - 1] - right * data.y[i + 1];
    let share = |j: usize, c: f64| c * c / data.weight(j);
    difference * difference / (share(i, 1.0) + share(i - 1, left) + share(i + 1, right))
}
