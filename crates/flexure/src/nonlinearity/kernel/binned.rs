//! Leave-one-out scores from data in bins. Their cost does not depend on the number of points.
//!
//! In the kernel sums a bin is one point at the mean of its data, with their number as its weight. The error of the
//! sums is of second order in the width of the bins.
//!
//! The squared errors of a bin's data are taken about the tangent of the estimate at the bin, so that the second moments
//! of the bin suffice. This error is of second order as well.

use std::ops::Range;

use super::bin::{Bin, gather};
use super::gaussian::{self, FEW_NEIGHBOURS, FEW_TERMS};
use super::polynomials::{Visit, at_own_points};
use super::sums::DIRECT_BELOW;
use super::{Degree, Kernel, Sorted, Sums, direct_without};
use crate::parallel;

/// Points that are gathered at a time. Bins end with them, whatever the number of threads.
const CHUNK: usize = 1 << 16;
/// If the others' share in the estimate at a point is smaller than this, the estimate without the point is summed
/// directly.
const ALONE: f64 = 1e-3;

/// Bins in order, without the empty ones.
#[derive(Debug)]
struct Bins {
    /// The bins' means, weighted by their counts.
    data: Sorted,
    /// The columns xx, xy, yy of [`Bin`].
    products: [Vec<f64>; 3],
}

/// The same data in bins of several widths. Each width is twice the one before.
pub(crate) struct Pyramid {
    levels: Vec<Bins>,
    /// The width of the narrowest bins.
    narrowest: f64,
    /// The least number of bins to a bandwidth.
    per_bandwidth: f64,
}

impl Pyramid {
    /// Puts unweighted data into bins for bandwidths between `smallest` and `largest`. A bandwidth spans at least
    /// `per_bandwidth` bins, and at most twice as many.
    pub fn new(data: &Sorted, smallest: f64, largest: f64, per_bandwidth: f64) -> Self {
        // The inverse of the width must be finite.
        let narrowest = (smallest / per_bandwidth).max(f64::MIN_POSITIVE);
        let finest = Bins::gathered(data.len(), |i| Bin::of_point(data.x[i], data.y[i]), narrowest);
        let mut pyramid = Pyramid {
            levels: vec![finest],
            narrowest,
            per_bandwidth,
        };
        for level in 1..=pyramid.level(largest) {
            let finer = &pyramid.levels[level - 1];
            if finer.data.len() < 2 {
                break;
            }
            let width = narrowest * 2f64.powi(level as i32);
            let coarser = Bins::gathered(finer.data.len(), |i| finer.bin(i), width);
            pyramid.levels.push(coarser);
        }
        pyramid
    }

    /// The width of the narrowest bins.
    pub fn narrowest(&self) -> f64 {
        self.narrowest
    }

    /// The level of the widest bins that are narrow enough for a bandwidth.
    fn level(&self, bandwidth: f64) -> usize {
        // The ratio itself may overflow.
        (bandwidth.log2() - self.per_bandwidth.log2() - self.narrowest.log2()).max(0.0) as usize
    }

    /// The scores of the bandwidths, as [`leave_one_out`](super::leave_one_out) defines them.
    pub fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        let level_of = |h: f64| self.level(h).min(self.levels.len() - 1);
        let of_level = |level: usize| {
            let own: Vec<usize> = (0..bandwidths.len())
                .filter(|&i| level_of(bandwidths[i]) == level)
                .collect();
            let widths: Vec<f64> = own.iter().map(|&i| bandwidths[i]).collect();
            let scores = self.levels[level].scores(kernel, degree, &widths);
            (own, scores)
        };
        let by_level: Vec<(Vec<usize>, Vec<f64>)> = parallel::map(self.levels.len(), of_level);
        let mut scores = vec![f64::NAN; bandwidths.len()];
        for (own, values) in by_level {
            own.into_iter().zip(values).for_each(|(i, value)| scores[i] = value);
        }
        scores
    }
}

impl Bins {
    /// Gathers `count` increasing items into bins of this width.
    fn gathered(count: usize, item: impl Fn(usize) -> Bin + Sync, width: f64) -> Self {
        let first = item(0).x;
        let of_chunk = |k: usize| {
            let items = (k * CHUNK..count.min((k + 1) * CHUNK)).map(&item);
            gather(items, first, width)
        };
        let bins: Vec<Vec<Bin>> = parallel::map(count.div_ceil(CHUNK), of_chunk);
        let bins = bins.concat();
        let column = |of: fn(&Bin) -> f64| -> Vec<f64> { bins.iter().map(of).collect() };
        Bins {
            data: Sorted::centred(column(|b| b.x), column(|b| b.y), Some(column(|b| b.count))),
            products: [column(|b| b.xx), column(|b| b.xy), column(|b| b.yy)],
        }
    }

    fn bin(&self, i: usize) -> Bin {
        let [xx, xy, yy] = self.products.each_ref().map(|column| column[i]);
        Bin {
            count: self.data.weight(i),
            x: self.data.x[i],
            y: self.data.y[i],
            xx,
            xy,
            yy,
        }
    }

    /// The scores of the bandwidths, in parallel.
    fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        if bandwidths.is_empty() {
            return Vec::new();
        }
        let data = &self.data;
        let count = data.len();
        let total: f64 = (0..count).map(|b| data.weight(b)).sum();
        let score = |&h: &f64, visit: &dyn Fn(&mut Fits<'_>)| {
            // Every bin is in its own window, and is therefore visited.
            let mut fits = Fits {
                data,
                kernel,
                degree,
                h,
                values: vec![f64::NAN; count],
                factors: vec![f64::NAN; count],
            };
            visit(&mut fits);
            self.squares(&fits) / total
        };
        let mut scores = Vec::new();
        if kernel == Kernel::Gaussian {
            let gaussian = |h: &f64| {
                score(h, &|fits| {
                    let visit = |b: usize, sums: Sums| fits.visit(b, sums);
                    gaussian::transform::<FEW_TERMS, FEW_NEIGHBOURS>(data, *h, &data.x, visit);
                })
            };
            scores = parallel::batch(bandwidths, gaussian);
        } else {
            at_own_points(data, kernel, degree, &mut |pass| {
                let bounded = |h: &f64| score(h, &|fits| pass(*h, 0..count, fits));
                scores = parallel::batch(bandwidths, bounded);
            });
        }
        scores
    }

    /// The sum of the squared leave-one-out errors of all data.
    fn squares(&self, fits: &Fits<'_>) -> f64 {
        (0..self.data.len()).map(|b| self.squares_in(b, fits)).sum()
    }

    /// The squared errors of the data of bin `b`: their distances from the tangent, times the factor. The slope of the
    /// tangent is that between the neighbouring bins within reach.
    fn squares_in(&self, b: usize, fits: &Fits<'_>) -> f64 {
        let (x, values) = (&self.data.x, &fits.values);
        let below = b - usize::from(b > 0 && x[b] - x[b - 1] <= fits.h);
        let above = b + usize::from(b + 1 < x.len() && x[b + 1] - x[b] <= fits.h);
        let run = x[above] - x[below];
        let slope = if run > 0.0 {
            (values[above] - values[below]) / run
        } else {
            0.0
        };
        let [xx, xy, yy] = self.products.each_ref().map(|column| column[b]);
        let residual = self.data.y[b] - values[b];
        let about_mean = yy + slope * (slope * xx - 2.0 * xy);
        fits.factors[b] * fits.factors[b] * (about_mean + self.data.weight(b) * residual * residual)
    }
}

/// The estimates at the bins.
struct Fits<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    /// The estimates from all points.
    values: Vec<f64>,
    /// The factors that turn a point's residual into its leave-one-out error.
    factors: Vec<f64>,
}

impl Visit for Fits<'_> {
    fn visit(&mut self, b: usize, mut sums: Sums) {
        let Fits {
            data,
            kernel,
            degree,
            h,
            ..
        } = *self;
        if kernel != Kernel::Gaussian && !sums.reliable(degree) {
            sums = data.direct_sums(kernel, degree, h, data.x[b], None);
        }
        let Some(fit) = sums.fit(degree) else {
            (self.values[b], self.factors[b]) = (0.0, 1.0);
            return;
        };
        let rest = 1.0 - fit.leverage;
        (self.values[b], self.factors[b]) = if data.weight(b) > 1.0 || rest > ALONE {
            (fit.value, 1.0 / rest)
        } else {
            (direct_without(data, kernel, degree, h, b), 1.0)
        };
    }

    fn constants(&mut self, bins: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool {
        let fits = self.values[bins.clone()].iter_mut().zip(&mut self.factors[bins]);
        let mut least = f64::INFINITY;
        for ((value, factor), [s, t]) in fits.zip(sums) {
            // A point of the bin has K(0) = 1.
            let rest = s - 1.0;
            (*value, *factor) = (t / s, s / rest);
            least = if rest < least { rest } else { least };
        }
        least > ALONE && least > DIRECT_BELOW * most
    }
}

#[cfg(test)]
#[path = "binned_tests.rs"]
mod tests;
