//! The data of a regression, sorted by abscissa, with centred ordinates.

use std::ops::Range;

use super::{Degree, Kernel, Sums};
use crate::linear::correlation::weighted_mean;
use crate::parallel;
use crate::sort::order;

/// Points sorted by abscissa, then ordinate, then weight. So nothing depends on their order in the record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sorted {
    pub x: Vec<f64>,
    /// The ordinates minus their mean: so their sums lose no digits to a large offset.
    pub y: Vec<f64>,
    /// Positive weights. `None`: every weight is 1.
    w: Option<Vec<f64>>,
    pub mean: f64,
}

impl Sorted {
    /// Sorts finite points with weights that are not negative; those of weight zero are left out.
    pub fn new(x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Self {
        let order = match weights {
            None => order(&[x, y]),
            Some(w) => order(&[x, y, w]).into_iter().filter(|&i| w[i] > 0.0).collect(),
        };
        let gather = |values: &[f64]| parallel::numbers(order.len(), |i| values[order[i]]);
        Self::centred(gather(x), gather(y), weights.map(gather))
    }

    /// Sorted points; the ordinates' mean is subtracted.
    pub fn centred(x: Vec<f64>, mut y: Vec<f64>, w: Option<Vec<f64>>) -> Self {
        let mean = weighted_mean(&y, w.as_deref());
        y.iter_mut().for_each(|y| *y -= mean);
        Sorted { x, y, w, mean }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    pub fn is_weighted(&self) -> bool {
        self.w.is_some()
    }

    /// The weights, where there are any.
    pub fn weights(&self) -> Option<&[f64]> {
        self.w.as_deref()
    }

    /// The weight of point `i`.
    #[inline(always)]
    pub fn weight(&self, i: usize) -> f64 {
        self.w.as_ref().map_or(1.0, |w| w[i])
    }

    /// Calls `each` with abscissa, weight and weighted ordinate of the points `range`, in order.
    #[inline(always)]
    pub fn for_each(&self, range: Range<usize>, mut each: impl FnMut(f64, f64, f64)) {
        let points = self.x[range.clone()].iter().zip(&self.y[range.clone()]);
        match &self.w {
            None => points.for_each(|(&x, &y)| each(x, 1.0, y)),
            Some(w) => points.zip(&w[range]).for_each(|((&x, &y), &w)| each(x, w, w * y)),
        }
    }

    /// The points within `reach` of `q`, by the same comparison as in the sliding windows.
    pub fn within(&self, q: f64, reach: f64) -> Range<usize> {
        self.x.partition_point(|&x| q - x > reach)..self.x.partition_point(|&x| x - q <= reach)
    }

    /// The sums at `q` over all points in reach, one by one, leaving out the point `skip`.
    #[cold]
    #[inline(never)]
    pub fn direct_sums(&self, kernel: Kernel, degree: Degree, h: f64, q: f64, skip: Option<usize>) -> Sums {
        let range = self.within(q, kernel.reach() * h);
        let sums = self.sums_over(range.clone(), kernel, h, q, q, skip);
        if degree == Degree::Constant || !(sums.s[0] > 0.0) {
            return sums;
        }
        // A second pass about the points' own centre, so that the spread of a far and narrow group loses no digits.
        let anchor = (q + h * sums.s[1] / sums.s[0]).clamp(self.x[range.start], self.x[range.end - 1]);
        self.sums_over(range, kernel, h, q, anchor, skip)
    }

    /// The sums at `q` over the points `range`, in the coordinate about `anchor`.
    pub fn sums_over(
        &self,
        range: Range<usize>,
        kernel: Kernel,
        h: f64,
        q: f64,
        anchor: f64,
        skip: Option<usize>,
    ) -> Sums {
        let mut sums = Sums {
            at: (q - anchor) / h,
            ..Sums::NONE
        };
        for i in range.filter(|&i| Some(i) != skip) {
            let u = (self.x[i] - anchor) / h;
            let w = self.weight(i);
            let k = w * kernel.weight((q - self.x[i]) / h);
            sums.mass[0] += w;
            sums.mass[1] += w * u * u;
            sums.s[0] += k;
            sums.s[1] += k * u;
            sums.s[2] += k * u * u;
            sums.t[0] += k * self.y[i];
            sums.t[1] += k * u * self.y[i];
        }
        sums
    }

    /// The mean of the centred ordinates of the points nearest to `q` (all those at the same distance),
    /// leaving out the point `skip`. At least one other point must exist.
    pub fn nearest(&self, q: f64, skip: Option<usize>) -> f64 {
        let mut low = self.x.partition_point(|&x| x < q);
        let mut high = low;
        let (mut sum, mut total, mut distance) = (0.0, 0.0, f64::INFINITY);
        loop {
            let below = low.checked_sub(1).map_or(f64::INFINITY, |i| q - self.x[i]);
            let above = self.x.get(high).map_or(f64::INFINITY, |x| x - q);
            let nearest = below.min(above);
            if nearest > distance || nearest == f64::INFINITY {
                return if total > 0.0 { sum / total } else { 0.0 };
            }
            let i = if below < above {
                low -= 1;
                low
            } else {
                high += 1;
                high - 1
            };
            if Some(i) != skip {
                distance = nearest;
                sum += self.weight(i) * self.y[i];
                total += self.weight(i);
            }
        }
    }
}

/// Values in increasing order, and their indices.
#[derive(Debug, PartialEq)]
pub struct Increasing {
    pub order: Vec<usize>,
    pub values: Vec<f64>,
}

impl Increasing {
    /// The finite values of `all`.
    pub fn new(all: &[f64]) -> Increasing {
        let mut order = order(&[all]);
        order.retain(|&i| all[i].is_finite());
        Increasing {
            values: order.iter().map(|&i| all[i]).collect(),
            order,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorting_keeps_pairs_and_centres() {
        let s = Sorted::new(&[2.0, -1.0, 0.0, -3.5], &[1.0, 2.0, 3.0, 6.0], None);
        assert_eq!(s.x, [-3.5, -1.0, 0.0, 2.0]);
        assert_eq!(s.mean, 3.0);
        assert_eq!(s.y, [3.0, -1.0, 0.0, -2.0]);
    }

    #[test]
    fn finite_values_are_put_in_order_with_their_indices() {
        let at = [3.0, f64::NAN, -1.0, f64::INFINITY, 2.0];
        let Increasing { order, values } = Increasing::new(&at);
        assert_eq!((order, values), (vec![2, 4, 0], vec![-1.0, 2.0, 3.0]));
        assert!(Increasing::new(&[f64::NAN]).values.is_empty());
    }

    #[test]
    fn nearest_averages_ties_and_skips() {
        let s = Sorted::new(&[0.0, 1.0, 2.0, 2.0], &[0.0, 4.0, 6.0, 10.0], None); // mean 5
        assert_eq!(s.nearest(0.1, None), -5.0);
        assert_eq!(s.nearest(0.5, None), (-5.0 - 1.0) / 2.0);
        assert_eq!(s.nearest(5.0, None), (1.0 + 5.0) / 2.0);
        assert_eq!(s.nearest(2.0, Some(2)), 5.0);
        assert_eq!(s.nearest(0.0, Some(0)), -1.0);
    }
}
