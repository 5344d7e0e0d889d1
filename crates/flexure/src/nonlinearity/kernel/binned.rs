//! Leave-one-out scores from data in bins. Their cost does not depend on the number of points.
//!
//! In the kernel sums a bin is one point at the mean of its data, with their number as its weight. The error of the
//! sums is of second order in the width of the bins.
//!
//! The squared errors of a bin's data are taken about the tangent of the estimate at the bin, so that the second moments
//! of the bin suffice. This error is of second order as well.

use super::bin::{Bin, gather, squares_about};
use super::gaussian::{self, FEW_NEIGHBOURS, FEW_TERMS};
use super::{Degree, Kernel, Sorted, Sums, direct_without, for_each_sum};
use crate::parallel;

/// Points that are gathered at a time. No bin extends over two such groups, so the bins do not depend on the number of threads.
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
pub(crate) struct BinnedScales {
    levels: Vec<Bins>,
    /// The width of the narrowest bins.
    narrowest: f64,
    /// The least number of bins to a bandwidth.
    per_bandwidth: f64,
}

impl BinnedScales {
    /// Puts unweighted data into bins for bandwidths between `smallest` and `largest`. A bandwidth spans at least
    /// `per_bandwidth` bins, and at most twice as many.
    pub fn new(data: &Sorted, smallest: f64, largest: f64, per_bandwidth: f64) -> Self {
        // The inverse of the width must be finite.
        let narrowest = (smallest / per_bandwidth).max(f64::MIN_POSITIVE);
        let finest = Bins::gathered(data.len(), |i| Bin::of_point(data.x[i], data.y[i]), narrowest);
        let mut scales = BinnedScales {
            levels: vec![finest],
            narrowest,
            per_bandwidth,
        };
        for level in 1..=scales.level(largest) {
            let finer = &scales.levels[level - 1];
            if finer.data.len() < 2 {
                break;
            }
            let width = narrowest * 2f64.powi(level as i32);
            let coarser = Bins::gathered(finer.data.len(), |i| finer.bin(i), width);
            scales.levels.push(coarser);
        }
        scales
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
        let bins_for = |h: f64| &self.levels[self.level(h).min(self.levels.len() - 1)];
        parallel::batch(bandwidths, |&h| bins_for(h).score(kernel, degree, h))
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

    /// The score of one bandwidth.
    fn score(&self, kernel: Kernel, degree: Degree, h: f64) -> f64 {
        let data = &self.data;
        let mut fits = vec![
            Fit {
                value: 0.0,
                factor: 1.0
            };
            data.len()
        ];
        let visit = |b: usize, sums: Sums| {
            let Some(fit) = sums.fit(degree) else { return };
            let rest = 1.0 - fit.leverage;
            fits[b] = if data.weight(b) > 1.0 || rest > ALONE {
                Fit {
                    value: fit.value,
                    factor: 1.0 / rest,
                }
            } else {
                Fit {
                    value: direct_without(data, kernel, degree, h, b),
                    factor: 1.0,
                }
            };
        };
        match kernel {
            Kernel::Gaussian => gaussian::transform::<FEW_TERMS, FEW_NEIGHBOURS>(data, h, &data.x, visit),
            _ => for_each_sum(data, kernel, degree, h, &data.x, visit),
        }
        let total: f64 = (0..data.len()).map(|b| data.weight(b)).sum();
        (0..data.len()).map(|b| self.squares_in(b, h, &fits)).sum::<f64>() / total
    }

    /// The squared errors of the data of bin `b`: their distances from the tangent, times the factor. The slope of the
    /// tangent is that between the neighbouring bins within reach.
    fn squares_in(&self, b: usize, h: f64, fits: &[Fit]) -> f64 {
        let x = &self.data.x;
        let below = b - usize::from(b > 0 && x[b] - x[b - 1] <= h);
        let above = b + usize::from(b + 1 < x.len() && x[b + 1] - x[b] <= h);
        let run = x[above] - x[below];
        let slope = if run > 0.0 {
            (fits[above].value - fits[below].value) / run
        } else {
            0.0
        };
        fits[b].factor * fits[b].factor * squares_about(self.bin(b), fits[b].value, slope)
    }
}

/// The estimate at a bin.
#[derive(Clone, Copy)]
struct Fit {
    /// The estimate from all points.
    value: f64,
    /// The factor that turns a point's residual into its leave-one-out error.
    factor: f64,
}

#[cfg(test)]
#[path = "binned_tests.rs"]
mod tests;
