//! How far the data in bins are from the tangents of an estimate at the bins.

use std::ops::{Add, Mul, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};

use super::Sorted;

/// Bins that are done at a time.
pub const LANES: usize = 8;

/// Bins, and what of their tangents is the same for all estimates.
pub struct Tangents<'a> {
    /// The bins' means, weighted by their counts.
    data: &'a Sorted,
    /// Sums of products of the deviations from these, xx, xy, yy.
    products: &'a [Vec<f64>; 3],
    /// The largest distance between neighbours.
    widest: f64,
    /// For each bin but the first and the last 1 over the distance between its neighbours; zero where these are at one
    /// place.
    per_run: Vec<f64>,
}

impl<'a> Tangents<'a> {
    pub fn new(data: &'a Sorted, products: &'a [Vec<f64>; 3]) -> Self {
        let per_run = |(below, above): (&f64, &f64)| if above > below { 1.0 / (above - below) } else { 0.0 };
        Tangents {
            data,
            products,
            widest: data.x.windows(2).fold(0.0, |widest: f64, x| widest.max(x[1] - x[0])),
            per_run: data.x.iter().zip(data.x.iter().skip(2)).map(per_run).collect(),
        }
    }

    /// The sum of the data's squared distances from an estimate's tangents at their bins, times the square of a factor
    /// on the distances for each bin. A slope is that between the neighbours within `reach`.
    pub fn squares(&self, values: &[f64], factors: &[f64], reach: f64) -> f64 {
        let last = values.len() - 1;
        let counts = match self.data.weights() {
            Some(counts) if last > 1 && self.widest <= reach => counts,
            _ => return (0..=last).map(|b| self.square(values, factors, b, reach)).sum(),
        };
        // Most often all are within reach: several at a time, without a division, nor a look for each whether it is.
        dispatch!(Level::new(), simd => self.squares_of_many(simd, counts, (values, factors), reach))
    }

    /// The same where all neighbours are within reach.
    #[inline(always)]
    fn squares_of_many<S: Simd>(
        &self,
        simd: S,
        counts: &[f64],
        (values, factors): (&[f64], &[f64]),
        reach: f64,
    ) -> f64 {
        let last = values.len() - 1;
        let (y, [xx, xy, yy]) = (&self.data.y, self.products);
        let mut sums = f64x8::splat(simd, 0.0);
        let groups = (last - 1) / LANES;
        for group in 0..groups {
            let first = 1 + group * LANES;
            let of = |column: &[f64], first: usize| f64x8::from_slice(simd, &column[first..first + LANES]);
            let slope = (of(values, first + 1) - of(values, first - 1)) * of(&self.per_run, first - 1);
            let data = (of(y, first), of(counts, first));
            let products = [of(xx, first), of(xy, first), of(yy, first)];
            sums += square(data, products, (of(values, first), of(factors, first)), slope);
        }
        let rest = (1 + groups * LANES..=last)
            .chain([0])
            .map(|b| self.square(values, factors, b, reach));
        rest.chain(<[f64; LANES]>::from(sums)).sum()
    }

    /// The squared distance of one bin's data.
    fn square(&self, values: &[f64], factors: &[f64], b: usize, reach: f64) -> f64 {
        let (x, count) = (&self.data.x, values.len());
        let below = b - usize::from(b > 0 && x[b] - x[b - 1] <= reach);
        let above = b + usize::from(b + 1 < count && x[b + 1] - x[b] <= reach);
        let run = x[above] - x[below];
        let slope = if run > 0.0 {
            (values[above] - values[below]) / run
        } else {
            0.0
        };
        let products = self.products.each_ref().map(|column| column[b]);
        square(
            (self.data.y[b], self.data.weight(b)),
            products,
            (values[b], factors[b]),
            slope,
        )
    }
}

/// The squared distance of a bin's data, of the mean y, from the line of this slope through the estimate; or of those
/// of several bins.
#[inline(always)]
pub fn square<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>>(
    (y, count): (T, T),
    [xx, xy, yy]: [T; 3],
    (value, factor): (T, T),
    slope: T,
) -> T {
    let residual = y - value;
    factor * factor * (yy + count * residual * residual + slope * (slope * xx - (xy + xy)))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn many_bins_at_a_time_are_the_same_as_one_after_the_other() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        for bins in [1, 2, 3, 4, 9, 10, 11, 17, 18, 19, 250] {
            let mut column = || -> Vec<f64> { (0..bins).map(|_| rng.random_range(0.1..1.0)).collect() };
            let mut x = column();
            x.sort_by(f64::total_cmp);
            let data = Sorted::centred(x, column(), Some(column()));
            let products = std::array::from_fn(|_| column());
            let (values, factors) = (column(), column());
            let tangents = Tangents::new(&data, &products);
            // All neighbours are within reach, and not all are.
            for reach in [1.0, 0.5 * tangents.widest] {
                let one_by_one: f64 = (0..bins).map(|b| tangents.square(&values, &factors, b, reach)).sum();
                let squares = tangents.squares(&values, &factors, reach);
                assert!(
                    (squares - one_by_one).abs() <= 1e-13 * one_by_one,
                    "{bins} bins, reach {reach}: {squares}, {one_by_one}"
                );
            }
        }
    }
}
