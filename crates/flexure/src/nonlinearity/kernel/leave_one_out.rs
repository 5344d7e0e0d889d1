//! The exact leave-one-out score of one bandwidth or more.

use std::ops::Range;

use super::polynomials::{Visit, at_own_points};
use super::sums::{DIRECT_BELOW, LeftOut};
use super::{Degree, Kernel, Sorted, Sums, direct_without, for_each_sum};
use crate::parallel;
use crate::sort;
use crate::wide::widest;

/// Fewest points of a part. Parts do not depend on the number of threads, so that the scores do not either.
const PART: usize = 1 << 14;
/// Pairs of residuals that are taken at a time.
const LANES: usize = 4;

/// The exact leave-one-out scores sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i of bandwidths.
///
/// A point without any other in reach is predicted by its nearest neighbours.
pub(crate) fn leave_one_out(data: &Sorted, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
    let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
    let mut scores = Vec::new();
    if kernel == Kernel::Gaussian {
        let score = |&h: &f64| {
            let mut errors = Errors::new(data, kernel, degree, h);
            for_each_sum(data, kernel, degree, h, &data.x, |i, sums| errors.visit(i, sums));
            errors.sum
        };
        scores = parallel::batch(bandwidths, score);
    } else {
        at_own_points(data, kernel, degree, &mut |pass| {
            scores = sums_over_parts(data, bandwidths, |h, points| {
                let mut errors = Errors::new(data, kernel, degree, h);
                pass(h, points, &mut errors);
                errors.sum
            });
        });
    }
    scores.iter_mut().for_each(|score| *score /= total);
    scores
}

/// Sums `part(h, points)` over all parts, for each bandwidth.
fn sums_over_parts(data: &Sorted, bandwidths: &[f64], part: impl Fn(f64, Range<usize>) -> f64 + Sync) -> Vec<f64> {
    let n = data.len();
    let parts = |(k, &h): (usize, &f64)| {
        let size = part_size(&data.x, h);
        (0..n).step_by(size).map(move |first| (k, first..n.min(first + size)))
    };
    let mut tasks: Vec<(usize, Range<usize>)> = bandwidths.iter().enumerate().flat_map(parts).collect();
    // The parts of one region for all bandwidths follow one another, so that its points stay in the cache.
    sort::by_key(&mut tasks, |(_, points)| points.start as f64);
    let sums = parallel::batch(&tasks, |(k, points)| part(bandwidths[*k], points.clone()));
    let mut scores = vec![0.0; bandwidths.len()];
    for ((k, _), sum) in tasks.iter().zip(sums) {
        scores[*k] += sum;
    }
    scores
}

/// The size of a part. It is not much less than the points of a window, because every part begins with a search for its first window.
fn part_size(x: &[f64], h: f64) -> usize {
    let parts = 0.25 * (x[x.len() - 1] - x[0]) / h;
    PART.max(x.len().div_ceil((parts as usize).max(1)))
}

/// The sum of the squared leave-one-out errors.
struct Errors<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    /// The last abscissa at which the sums had to be made directly: many points may have one abscissa.
    last_x: f64,
    /// These sums.
    last: Sums,
    sum: f64,
}

impl<'a> Errors<'a> {
    fn new(data: &'a Sorted, kernel: Kernel, degree: Degree, h: f64) -> Self {
        Errors {
            data,
            kernel,
            degree,
            h,
            last_x: f64::NAN,
            last: Sums::NONE,
            sum: 0.0,
        }
    }

    /// The residual of a point where the fast `sums` are not reliable.
    #[cold]
    #[inline(never)]
    fn direct(&mut self, i: usize, mut sums: Sums) -> f64 {
        let Errors {
            data,
            kernel,
            degree,
            h,
            ..
        } = *self;
        let (x, y, w) = (data.x[i], data.y[i], data.weight(i));
        if !sums.reliable(degree) {
            if self.last_x != x {
                self.last_x = x;
                self.last = data.direct_sums(kernel, degree, h, x, None);
            }
            sums = self.last;
        }
        sums.residual_without(degree, y, w)
            .unwrap_or_else(|| y - direct_without(data, kernel, degree, h, i))
    }
}

impl Visit for Errors<'_> {
    fn visit(&mut self, i: usize, sums: Sums) {
        let (y, w) = (self.data.y[i], self.data.weight(i));
        let reliable = self.degree == Degree::Constant || sums.reliable(self.degree);
        let residual = reliable.then(|| sums.residual_without(self.degree, y, w)).flatten();
        let residual = residual.unwrap_or_else(|| self.direct(i, sums));
        self.sum += w * residual * residual;
    }

    fn constants(&mut self, points: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool {
        let y = &self.data.y[points.clone()];
        let Squares { sum, least } = widest(
            #[inline(always)]
            || match self.data.weights() {
                None => squares(y, sums, |_| 1.0),
                Some(w) => {
                    let w = &w[points];
                    squares(y, sums, |k| w[k])
                }
            },
        );
        let enough = least > DIRECT_BELOW * most && !sum.is_nan();
        if enough {
            self.sum += sum;
        }
        enough
    }
}

/// The squares of residuals from the local constants without each point.
struct Squares {
    /// The weighted sum.
    sum: f64,
    /// The smallest sum of K over the other points.
    least: f64,
}

#[inline(always)]
fn squares(y: &[f64], sums: &[[f64; 2]], weight: impl Fn(usize) -> f64) -> Squares {
    // LANES sums that need not wait for one another. A lane takes the residuals p/r and q/t of two points by one division:
    //   points   0 1 2 3 | 4 5 6 7
    //   lanes    0 1 2 3   0 1 2 3
    let (mut sum, mut least) = ([0.0; LANES], [f64::INFINITY; LANES]);
    let lower = |a: f64, b: f64| if a < b { a } else { b };
    let (groups, last) = y.as_chunks::<{ 2 * LANES }>();
    let (of_groups, of_last) = sums.as_chunks::<{ 2 * LANES }>();
    for (k, (y, sums)) in groups.iter().zip(of_groups).enumerate() {
        let mut terms = [[LeftOut::default(); LANES]; 2];
        for half in 0..2 {
            for lane in 0..LANES {
                let i = half * LANES + lane;
                terms[half][lane] = LeftOut::new(y[i], weight(k * 2 * LANES + i), sums[i]);
            }
        }
        let [a, b] = terms;
        for lane in 0..LANES {
            let LeftOut {
                weight: w,
                scaled: p,
                rest: r,
            } = a[lane];
            let LeftOut {
                weight: v,
                scaled: q,
                rest: t,
            } = b[lane];
            // No product has more than two factors: it could overflow.
            let inverse = 1.0 / (r * t);
            let (first, second) = (p * (t * inverse), q * (r * inverse));
            sum[lane] += w * first * first + v * second * second;
            least[lane] = lower(lower(r, t), least[lane]);
        }
    }
    let done = groups.len() * 2 * LANES;
    for (k, (y, sums)) in last.iter().zip(of_last).enumerate() {
        let LeftOut { weight, scaled, rest } = LeftOut::new(*y, weight(done + k), *sums);
        sum[0] += weight * (scaled / rest) * (scaled / rest);
        least[0] = lower(rest, least[0]);
    }
    Squares {
        sum: sum.iter().sum(),
        least: least.into_iter().fold(f64::INFINITY, f64::min),
    }
}
