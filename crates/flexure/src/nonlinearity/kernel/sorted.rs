//! The data of a regression, sorted by abscissa, with centred ordinates.

use std::ops::Range;

use super::{Kernel, Sums};

/// Points sorted by abscissa, then ordinate, so that nothing depends on their order in the record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sorted {
    pub x: Vec<f64>,
    /// The ordinates less their mean: sums of them then lose no digits to a large offset.
    pub y: Vec<f64>,
    pub mean: f64,
}

impl Sorted {
    /// Sorts finite points.
    pub fn new(x: &[f64], y: &[f64]) -> Self {
        let mut points: Vec<(u64, f64)> = x.iter().zip(y).map(|(&x, &y)| (to_ordered(x), y)).collect();
        points.sort_unstable_by(|p, q| p.0.cmp(&q.0).then(p.1.total_cmp(&q.1)));
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
        Sorted {
            x: points.iter().map(|p| from_ordered(p.0)).collect(),
            y: points.iter().map(|p| p.1 - mean).collect(),
            mean,
        }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// The points within `reach` of `q`, by the same comparison as the sliding windows make.
    pub fn within(&self, q: f64, reach: f64) -> Range<usize> {
        self.x.partition_point(|&x| q - x > reach)..self.x.partition_point(|&x| x - q <= reach)
    }

    /// The sums at `q` over all points in reach, one by one, leaving out the point `skip`.
    pub fn direct_sums(&self, kernel: Kernel, h: f64, q: f64, skip: Option<usize>) -> Sums {
        let range = self.within(q, kernel.reach() * h);
        self.sums_over(range, kernel, h, q, skip)
    }

    /// The sums at `q` over the points `range`.
    pub fn sums_over(&self, range: Range<usize>, kernel: Kernel, h: f64, q: f64, skip: Option<usize>) -> Sums {
        let count = range.len();
        let (mut weight, mut moment) = (0.0, 0.0);
        for i in range {
            if Some(i) != skip {
                let k = kernel.weight((q - self.x[i]) / h);
                weight += k;
                moment += k * self.y[i];
            }
        }
        Sums { weight, moment, count }
    }

    /// The mean of the centred ordinates of the points nearest to `q` (all those at the same distance),
    /// leaving out the point `skip`. At least one other point must exist.
    pub fn nearest(&self, q: f64, skip: Option<usize>) -> f64 {
        let mut left = self.x.partition_point(|&x| x < q);
        let mut right = left;
        let (mut sum, mut count, mut distance) = (0.0, 0.0, f64::INFINITY);
        loop {
            let below = left.checked_sub(1).map_or(f64::INFINITY, |i| q - self.x[i]);
            let above = self.x.get(right).map_or(f64::INFINITY, |x| x - q);
            let i = if below < above { left.wrapping_sub(1) } else { right };
            let d = below.min(above);
            if d > distance || d == f64::INFINITY {
                return if count > 0.0 { sum / count } else { 0.0 };
            }
            if below < above {
                left -= 1;
            } else {
                right += 1;
            }
            if Some(i) != skip {
                distance = d;
                sum += self.y[i];
                count += 1.0;
            }
        }
    }
}

/// Maps finite floats to integers of the same order (and -0 to 0).
fn to_ordered(x: f64) -> u64 {
    let bits = (x + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn from_ordered(key: u64) -> f64 {
    f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorting_keeps_pairs_and_centres() {
        let s = Sorted::new(&[2.0, -1.0, 0.0, -3.5], &[1.0, 2.0, 3.0, 6.0]);
        assert_eq!(s.x, [-3.5, -1.0, 0.0, 2.0]);
        assert_eq!(s.mean, 3.0);
        assert_eq!(s.y, [3.0, -1.0, 0.0, -2.0]);
    }

    #[test]
    fn nearest_averages_ties_and_skips() {
        let s = Sorted::new(&[0.0, 1.0, 2.0, 2.0], &[0.0, 4.0, 6.0, 10.0]); // mean 5
        assert_eq!(s.nearest(0.1, None), -5.0);
        assert_eq!(s.nearest(0.5, None), (-5.0 - 1.0) / 2.0);
        assert_eq!(s.nearest(5.0, None), (1.0 + 5.0) / 2.0);
        assert_eq!(s.nearest(2.0, Some(2)), 5.0);
        assert_eq!(s.nearest(0.0, Some(0)), -1.0);
    }
}
