//! The exact leave-one-out score of one bandwidth or more.

use std::ops::Range;

use super::{Degree, Kernel, Sorted, direct_without, for_each_sum};
use crate::{interrupt, parallel, sort};

/// Fewest points of a part. Parts do not depend on the number of threads, so that the scores do not either.
const PART: usize = 1 << 14;

/// The exact leave-one-out scores sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i of bandwidths.
///
/// A point without any other in reach is predicted by its nearest neighbours.
pub(crate) fn leave_one_out(data: &Sorted, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
    let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
    let n = data.len();
    let parts = |(k, &h): (usize, &f64)| {
        let size = if kernel == Kernel::Gaussian {
            n
        } else {
            part_size(&data.x, h)
        };
        (0..n).step_by(size).map(move |first| (k, first..n.min(first + size)))
    };
    let mut tasks: Vec<(usize, Range<usize>)> = bandwidths.iter().enumerate().flat_map(parts).collect();
    // The parts of a region for all bandwidths follow one another, while its points are in the cache.
    sort::by_key(&mut tasks, |(_, points)| points.start as f64);
    let interrupt = interrupt::current();
    let squares = parallel::batch(&tasks, |(k, points)| match interrupt.is_requested() {
        true => 0.0,
        false => squares(data, kernel, degree, bandwidths[*k], points.clone()),
    });
    let mut scores = vec![0.0; bandwidths.len()];
    for ((k, _), squares) in tasks.iter().zip(squares) {
        scores[*k] += squares / total;
    }
    scores
}

/// The size of a part: not much less than the points of a window, as every part begins with the sums over its first window.
fn part_size(x: &[f64], h: f64) -> usize {
    let parts = 0.25 * (x[x.len() - 1] - x[0]) / h;
    PART.max(x.len().div_ceil((parts as usize).max(1)))
}

/// The weighted sum of the squared leave-one-out errors at these points.
fn squares(data: &Sorted, kernel: Kernel, degree: Degree, h: f64, points: Range<usize>) -> f64 {
    let mut squares = 0.0;
    for_each_sum(data, kernel, degree, h, &data.x[points.clone()], |k, sums| {
        let i = points.start + k;
        let (y, w) = (data.y[i], data.weight(i));
        let residual = sums.residual_without(degree, y, w);
        let residual = residual.unwrap_or_else(|| y - direct_without(data, kernel, degree, h, i));
        squares += w * residual * residual;
    });
    squares
}
