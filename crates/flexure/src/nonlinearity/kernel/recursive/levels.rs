//! The observations of a record in levels. The observations of one level have one bandwidth and make an ordinary kernel sum.

use super::super::sorted::Increasing;
use super::super::sums::ONE_ABSCISSA;
use super::super::{Degree, Sorted, for_each_sum};
use super::RecursiveKernel;
use crate::nonlinearity::estimator::Checked;
use crate::parallel;
use crate::selection::ScoredParameter;
use crate::sort::order;

/// A point is left out by subtraction. If the other points contribute less than this share of the sums, rounding spoils the
/// difference, and they are summed again.
const FEW: f64 = 1e-3;
/// The observations of one bandwidth.
#[derive(Debug, Clone, PartialEq)]
struct Level {
    /// How often the stream had doubled when these observations came.
    doublings: u32,
    data: Sorted,
}

/// All observations, by levels and together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Levels {
    levels: Vec<Level>,
    /// All of them. Sums over the levels take the ordinates relative to the mean of all.
    pub all: Sorted,
}

/// Sums over all levels at one point: of w h^-r K, and of w h^-r K (y - mean y).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pair {
    s: f64,
    t: f64,
}

impl Pair {
    /// The estimate minus the mean of all ordinates; NaN without data in reach.
    fn value(self) -> f64 {
        if self.s > 0.0 { self.t / self.s } else { f64::NAN }
    }
}

/// A point that is to be predicted from the others. Parts of its weight may belong to different levels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Own {
    x: f64,
    /// The ordinate as given.
    y: f64,
    weight: f64,
    parts: Vec<LevelWeight>,
}

/// The part of a weight that belongs to one level.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LevelWeight {
    /// The level's place in the list.
    level: usize,
    weight: f64,
}

/// The weight of an observation at one number of doublings of the stream.
#[derive(Debug, Clone, Copy, PartialEq)]
struct DoublingWeight {
    doublings: u32,
    weight: f64,
}

/// The observations of a level, and how they are smoothed.
struct Smoothed<'a> {
    data: &'a Sorted,
    bandwidth: f64,
    /// h^-r
    factor: f64,
}

impl Levels {
    /// Splits the observations, in the order given. An observation of weight w counts as w observations, also in the doublings of the
    /// stream. If the stream doubles within it, its weight belongs to several levels.
    pub fn new(data: &Checked<'_>) -> Levels {
        let (x, y) = (data.x[0], data.y);
        let mut columns: Vec<(u32, [Vec<f64>; 3])> = Vec::new();
        let mut before = 0.0;
        for i in 0..y.len() {
            for DoublingWeight { doublings, weight } in shares(before, data.weight(i)) {
                if columns.last().is_none_or(|(last, _)| *last != doublings) {
                    columns.push((doublings, Default::default()));
                }
                if let Some((_, [xs, ys, ws])) = columns.last_mut() {
                    xs.push(x[i]);
                    ys.push(y[i]);
                    ws.push(weight);
                }
            }
            before += data.weight(i);
        }
        let level = |(doublings, [x, y, w]): &(u32, [Vec<f64>; 3])| Level {
            doublings: *doublings,
            data: Sorted::new(x, y, data.w.map(|_| w.as_slice())),
        };
        Levels {
            levels: parallel::batch(&columns, level),
            all: Sorted::new(x, y, data.w),
        }
    }

    /// The root mean square of h_i / c over the observations. The bias is proportional to it.
    pub fn typical(&self, method: &RecursiveKernel) -> f64 {
        let weight = |data: &Sorted| -> f64 { (0..data.len()).map(|i| data.weight(i)).sum() };
        let squares = self.levels.iter().map(|level| {
            let shrunk = method.shrunk(level.doublings);
            weight(&level.data) * shrunk * shrunk
        });
        (squares.sum::<f64>() / weight(&self.all)).sqrt()
    }

    fn each<'a>(&'a self, method: &'a RecursiveKernel) -> impl Iterator<Item = Smoothed<'a>> {
        self.levels.iter().map(|level| {
            let shrunk = method.shrunk(level.doublings);
            Smoothed {
                data: &level.data,
                bandwidth: method.bandwidth * shrunk,
                factor: method.factor(shrunk),
            }
        })
    }

    /// The sums at the increasing points `at`.
    fn sums(&self, method: &RecursiveKernel, at: &[f64]) -> Vec<Pair> {
        let levels: Vec<_> = self.each(method).collect();
        let of_level = |level: &Smoothed<'_>| {
            let Smoothed {
                data,
                bandwidth,
                factor,
            } = *level;
            let mut pairs = vec![Pair::default(); at.len()];
            let lift = data.mean - self.all.mean;
            for_each_sum(data, method.kernel, Degree::Constant, bandwidth, at, |j, sums| {
                pairs[j] = Pair {
                    s: factor * sums.s[0],
                    t: factor * (sums.t[0] + lift * sums.s[0]),
                };
            });
            pairs
        };
        // The order of the additions does not depend on the number of threads.
        let all: Vec<Vec<Pair>> = parallel::batch(&levels, of_level);
        let mut total = vec![Pair::default(); at.len()];
        for pairs in all {
            for (sum, pair) in total.iter_mut().zip(pairs) {
                sum.s += pair.s;
                sum.t += pair.t;
            }
        }
        total
    }

    /// The estimates at points in any order. NaN where no data are in reach, and for points that are not finite.
    pub fn estimates(&self, method: &RecursiveKernel, at: &[f64]) -> Vec<f64> {
        let Increasing { order, values } = Increasing::new(at);
        let mut estimates = vec![f64::NAN; at.len()];
        for (i, pair) in order.into_iter().zip(self.sums(method, &values)) {
            estimates[i] = self.all.mean + pair.value();
        }
        estimates
    }

    /// Every `stride`-th point in order of x.
    pub fn own(&self, data: &Checked<'_>, stride: usize) -> Vec<Own> {
        let mut before = 0.0;
        let mut starts = Vec::with_capacity(data.y.len());
        for i in 0..data.y.len() {
            starts.push(before);
            before += data.weight(i);
        }
        let (x, y) = (data.x[0], data.y);
        let order = order(&[x, y]).into_iter().filter(|&i| data.weight(i) > 0.0);
        let kept = order.skip(stride / 2).step_by(stride);
        let part = |share: DoublingWeight| LevelWeight {
            level: self.levels.partition_point(|level| level.doublings < share.doublings),
            weight: share.weight,
        };
        kept.map(|i| Own {
            x: x[i],
            y: y[i],
            weight: data.weight(i),
            parts: shares(starts[i], data.weight(i)).map(part).collect(),
        })
        .collect()
    }

    /// The scores of c over these points, in order of x. Each point is predicted from all others, and their bandwidths stay the same. If no
    /// other is in reach, its nearest neighbours predict it.
    pub fn candidate(&self, method: &RecursiveKernel, points: &[Own]) -> ScoredParameter<f64> {
        let at: Vec<f64> = points.iter().map(|p| p.x).collect();
        let factors: Vec<f64> = self.each(method).map(|level| level.factor).collect();
        let (mut trace, mut left_out, mut squares, mut total) = (0.0, 0.0, 0.0, 0.0);
        for (point, sum) in points.iter().zip(self.sums(method, &at)) {
            // K(0) = 1.
            let own: f64 = point.parts.iter().map(|part| part.weight * factors[part.level]).sum();
            let y = point.y - self.all.mean;
            let (mut rest, mut value) = (sum.s - own, f64::NAN);
            if rest > FEW * sum.s {
                value = (sum.t - own * y) / rest;
            } else {
                let others = self.others(method, point);
                rest = others.s;
                value = if rest > 0.0 { others.value() } else { value };
            }
            if !(rest > 0.0) {
                value = self.all.nearest(point.x, self.place(&self.all, point, point.weight));
            }
            trace += own / sum.s;
            left_out += point.weight * (y - value).powi(2);
            squares += point.weight * (y - sum.value()).powi(2);
            total += point.weight;
        }
        ScoredParameter::new(method.bandwidth, trace, left_out, squares, total, points.len())
    }

    /// The sums at a point over all others, one by one.
    fn others(&self, method: &RecursiveKernel, point: &Own) -> Pair {
        let mut pair = Pair::default();
        for (k, level) in self.each(method).enumerate() {
            let Smoothed {
                data,
                bandwidth,
                factor,
            } = level;
            let part = point.parts.iter().find(|part| part.level == k);
            let skip = part.and_then(|part| self.place(data, point, part.weight));
            let sums = data.direct_sums(method.kernel, Degree::Constant, bandwidth, point.x, skip);
            pair.s += factor * sums.s[0];
            pair.t += factor * (sums.t[0] + (data.mean - self.all.mean) * sums.s[0]);
        }
        pair
    }

    /// The index of this point, with this weight, among sorted points; or of an equal point.
    fn place(&self, data: &Sorted, point: &Own, weight: f64) -> Option<usize> {
        let first = data.x.partition_point(|&x| x < point.x);
        let same = data.x[first..].iter().take_while(|&&x| x == point.x).count();
        let y = point.y - data.mean;
        (first..first + same).find(|&i| data.y[i] == y && data.weight(i) == weight)
    }

    /// The slope at `q` of the line fitted with the weights of the estimate there; zero where it is not determined.
    pub fn slope(&self, method: &RecursiveKernel, q: f64) -> f64 {
        // Two passes, in units of c. The second is about the centre.
        let unit = method.bandwidth;
        let sums = |centre: f64| {
            let mut s = [0.0; 5];
            for Smoothed {
                data,
                bandwidth: h,
                factor,
            } in self.each(method)
            {
                let lift = data.mean - self.all.mean;
                data.for_each(data.within(q, method.kernel.reach() * h), |x, w, wy| {
                    let k = factor * method.kernel.weight((q - x) / h);
                    let (u, y) = ((x - q) / unit - centre, wy + w * lift);
                    let terms = [k * w, k * w * u, k * w * u * u, k * y, k * u * y];
                    s.iter_mut().zip(terms).for_each(|(s, term)| *s += term);
                });
            }
            s
        };
        let first = sums(0.0);
        let [s0, s1, s2, t0, t1] = sums(first[1] / first[0]);
        let spread = s2 - s1 * (s1 / s0);
        if spread > ONE_ABSCISSA * ONE_ABSCISSA * s0 {
            (t1 - t0 * (s1 / s0)) / spread / unit
        } else {
            0.0
        }
    }

    /// Whether there is a place without data in reach between the neighbouring abscissas `a` and `b`.
    pub fn has_gap(&self, method: &RecursiveKernel, a: f64, b: f64) -> bool {
        let (mut reached_from_below, mut reached_from_above) = (f64::NEG_INFINITY, f64::INFINITY);
        for Smoothed { data, bandwidth, .. } in self.each(method) {
            let reach = method.kernel.reach() * bandwidth;
            let after = data.x.partition_point(|&x| x <= a);
            if let Some(&x) = after.checked_sub(1).and_then(|i| data.x.get(i)) {
                reached_from_below = reached_from_below.max(x + reach);
            }
            if let Some(&x) = data.x.get(after) {
                reached_from_above = reached_from_above.min(x - reach);
            }
        }
        reached_from_below <= reached_from_above && a < b
    }
}

/// Splits an observation of weight `w`, after others of total weight `before`, by the doublings of the stream: the numbers of doublings and
/// the weights there. The stream has doubled k times from the 2^k-th observation on.
fn shares(before: f64, w: f64) -> impl Iterator<Item = DoublingWeight> {
    let (mut at, mut rest) = (before, w);
    std::iter::from_fn(move || {
        if !(rest > 0.0) {
            return None;
        }
        let doublings = exponent(at + 1.0);
        let until_next = f64::from(doublings + 1).exp2() - 1.0 - at;
        // The difference is lost in rounding if the observation is negligible in comparison with the weights before it.
        let share = if until_next > 0.0 && until_next < rest {
            until_next
        } else {
            rest
        };
        (at, rest) = (at + share, rest - share);
        Some(DoublingWeight {
            doublings,
            weight: share,
        })
    })
}

/// The integer part of the base-2 logarithm of a number of at least 1, exactly.
fn exponent(v: f64) -> u32 {
    ((v.to_bits() >> 52) as u32 & 0x7ff).saturating_sub(1023)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_is_split_where_the_stream_doubles() {
        let pair = |share: DoublingWeight| (share.doublings, share.weight);
        let of = |before, w| shares(before, w).map(pair).collect::<Vec<_>>();
        assert_eq!(of(0.0, 1.0), [(0, 1.0)]);
        assert_eq!(of(1.0, 1.0), [(1, 1.0)]);
        assert_eq!(of(2.0, 2.0), [(1, 1.0), (2, 1.0)]);
        assert_eq!(of(0.5, 3.0), [(0, 0.5), (1, 2.0), (2, 0.5)]);
        assert_eq!(of(6.0, 0.0), []);
        for count in [1_u64, 7, 8, 1023, 1024, (1 << 50) - 1, 1 << 50] {
            assert_eq!(exponent(count as f64), count.ilog2());
        }
        for (before, w) in [(0.0, 1e300), (1e300, 1.0), (f64::INFINITY, 2.0), (1e308, 1e308)] {
            let total: f64 = shares(before, w).map(|share| share.weight).sum();
            assert!((total / w - 1.0).abs() < 1e-12, "{before} {w} {total}");
        }
    }
}
