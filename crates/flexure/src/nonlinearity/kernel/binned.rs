//! Leave-one-out scores from data that are brought together in bins: they cost the same however many points
//! there are.
//!
//! A bin is a point at its data's mean abscissa that weighs as many as they are, so that the kernel sums err in
//! the second order of the bin's width alone. The score of its data is that about the estimate's tangent: the
//! bin's second moments are all that is needed, and it errs in the second order as well.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};
use rayon::prelude::*;

use std::ops::{Div, Mul, Range, Sub};

use super::gaussian::{self, FEW_NEIGHBOURS, FEW_TERMS};
use super::piece::{Visit, at_own_points};
use super::sorted::mean;
use super::sums::DIRECT_BELOW;
use super::tangents::{LANES, Tangents};
use super::{Degree, Kernel, Sorted, Sums};
use crate::wide::extent;

/// Points that are put in bins at a time: bins end with them, whatever the number of threads.
const CHUNK: usize = 1 << 16;
/// Most parts in which points in no order are taken, each with bins of its own.
const PARTS: usize = 8;
/// A point whose share in its own estimate is larger than 1 less this is left out by direct summation.
const ALONE: f64 = 1e-3;

/// 2^52: what it is added to has no place left for a fraction, and its bits count up.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// The number of points, their means, and the sums of products of their deviations from these.
#[derive(Debug, Clone, Copy)]
struct Bin {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// Bins in order. Empty ones are left out.
#[derive(Debug)]
struct Bins {
    /// Their means, weighted by their counts.
    data: Sorted,
    /// xx, xy, yy of [`Bin`].
    products: [Vec<f64>; 3],
}

/// The same data in bins of several widths, each twice that before.
pub(crate) struct Pyramid {
    levels: Vec<Bins>,
    /// The widths, and the number of bins to a bandwidth.
    narrowest: f64,
    per_bandwidth: f64,
}

impl Pyramid {
    /// Puts unweighted data in bins for bandwidths between `smallest` and `largest`, `per_bandwidth` of them
    /// to a bandwidth at least and twice as many at most.
    pub fn new(data: &Sorted, smallest: f64, largest: f64, per_bandwidth: f64) -> Self {
        let point = |i: usize| Bin {
            count: 1.0,
            x: data.x[i],
            y: data.y[i],
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
        };
        let narrowest = smallest / per_bandwidth;
        Self::over(
            Bins::new(data.len(), point, narrowest),
            narrowest,
            largest,
            per_bandwidth,
        )
    }

    /// The same from points that are in no order: faster, unless they lie in few of very many bins.
    pub fn scattered(x: &[f64], y: &[f64], smallest: f64, largest: f64, per_bandwidth: f64) -> Self {
        let narrowest = smallest / per_bandwidth;
        match Bins::scattered(x, y, narrowest) {
            Some(bins) => Self::over(bins, narrowest, largest, per_bandwidth),
            None => Self::new(&Sorted::new(x, y), smallest, largest, per_bandwidth),
        }
    }

    fn over(finest: Bins, narrowest: f64, largest: f64, per_bandwidth: f64) -> Self {
        let mut pyramid = Pyramid {
            levels: vec![finest],
            narrowest,
            per_bandwidth,
        };
        for level in 1..=pyramid.level(largest) {
            let finer = &pyramid.levels[level - 1];
            let width = narrowest * 2f64.powi(level as i32);
            let coarser = Bins::new(finer.data.len(), |i| finer.bin(i), width);
            pyramid.levels.push(coarser);
        }
        pyramid
    }

    /// The width of the narrowest bins.
    pub fn narrowest(&self) -> f64 {
        self.narrowest
    }

    /// The widest bins that are narrow enough for a bandwidth.
    fn level(&self, bandwidth: f64) -> usize {
        (bandwidth / (self.per_bandwidth * self.narrowest)).log2().max(0.0) as usize
    }

    /// The scores, as of [`leave_one_out`](super::leave_one_out).
    pub fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        let level = |h: f64| self.level(h).min(self.levels.len() - 1);
        let by_level: Vec<(Vec<usize>, Vec<f64>)> = (self.levels.par_iter().enumerate())
            .map(|(k, bins)| {
                let own: Vec<usize> = (0..bandwidths.len()).filter(|&i| level(bandwidths[i]) == k).collect();
                let widths: Vec<f64> = own.iter().map(|&i| bandwidths[i]).collect();
                let scores = bins.scores(kernel, degree, &widths);
                (own, scores)
            })
            .collect();
        let mut scores = vec![f64::NAN; bandwidths.len()];
        for (own, values) in by_level {
            own.into_iter().zip(values).for_each(|(i, value)| scores[i] = value);
        }
        scores
    }
}

impl Bins {
    /// Brings `count` items in order together.
    fn new(count: usize, item: impl Fn(usize) -> Bin + Sync, width: f64) -> Self {
        let first = item(0).x;
        let bins: Vec<Vec<Bin>> = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|k| gather((k * CHUNK..count.min((k + 1) * CHUNK)).map(&item), first, width))
            .collect();
        Self::of(&bins.concat())
    }

    /// Brings points together that are in no order; nothing where there would be more bins than points.
    fn scattered(x: &[f64], y: &[f64], width: f64) -> Option<Self> {
        let (low, high) = (x.par_chunks(CHUNK)).map(extent).reduce(
            || (f64::INFINITY, f64::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
        let places = (high - low) / width;
        if !(places < x.len() as f64) {
            return None;
        }
        // Sums about the bins' middles and the mean, with the bins' width as the unit of x.
        let (count, mean, per_width) = (places as usize + 2, mean(y, None), 1.0 / width);
        let middle = |k: usize| low + k as f64 * width;
        let part = CHUNK.max(x.len().div_ceil(PARTS));
        let mut parts: Vec<Vec<Products>> = (x.par_chunks(part))
            .zip(y.par_chunks(part))
            .map(|(x, y)| {
                let mut bins = vec![Products::default(); count];
                for (x, y) in x.iter().zip(y) {
                    let (k, rest) = nearest_whole((x - low) * per_width);
                    // All are: rounding moves none by a whole bin.
                    if let Some(bin) = bins.get_mut(k) {
                        bin.add(rest, y - mean);
                    }
                }
                bins
            })
            .collect();
        let (sums, rest) = parts.split_first_mut()?;
        for part in rest {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum = sum.plus(*part));
        }
        let mut bins = Vec::with_capacity(count);
        for (k, sums) in sums.iter().enumerate().filter(|(_, sums)| sums.count > 0.0) {
            bins.push(sums.with_unit(width).about_mean([middle(k), mean]));
        }
        Some(Self::of(&bins))
    }

    fn of(bins: &[Bin]) -> Self {
        let column = |f: fn(&Bin) -> f64| -> Vec<f64> { bins.iter().map(f).collect() };
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

    fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        let data = &self.data;
        if bandwidths.is_empty() {
            return Vec::new();
        }
        let total: f64 = (0..data.len()).map(|b| data.weight(b)).sum();
        let tangents = Tangents::new(data, &self.products);
        let score = |room: &mut [Vec<f64>; 2], h: f64, visit: &mut dyn FnMut(&mut Fits<'_>)| {
            let [values, factors] = room;
            // Every bin is within its own reach and so is visited: nothing of another bandwidth stays.
            values.resize(data.len(), f64::NAN);
            factors.resize(data.len(), f64::NAN);
            visit(&mut Fits {
                data,
                kernel,
                degree,
                h,
                values,
                factors,
            });
            tangents.squares(values, factors, h) / total
        };
        let mut scores = Vec::new();
        if kernel == Kernel::Gaussian {
            let of = |room: &mut [Vec<f64>; 2], &h: &f64| {
                score(room, h, &mut |fits| {
                    let visit = |b: usize, sums: Sums| fits.visit(b, sums);
                    gaussian::transform::<FEW_TERMS, FEW_NEIGHBOURS>(data, h, &data.x, visit);
                })
            };
            scores = bandwidths.par_iter().map_init(Default::default, of).collect();
        } else {
            at_own_points(data, kernel, degree, &mut |pass| {
                let of = |room: &mut [Vec<f64>; 2], &h: &f64| score(room, h, &mut |fits| pass(h, 0..data.len(), fits));
                scores = bandwidths.par_iter().map_init(Default::default, of).collect();
            });
        }
        scores
    }
}

/// The whole number nearest to a place and what the place is more than it; no index of anything where the place is negative or not
/// finite. Without a conversion, which would take longer than the rest.
#[inline(always)]
pub(super) fn nearest_whole(place: f64) -> (usize, f64) {
    let rounded = place + WHOLE;
    // Below WHOLE the bits are less than its own, and so the difference is large.
    let k = rounded.to_bits().wrapping_sub(WHOLE.to_bits());
    (usize::try_from(k).unwrap_or(usize::MAX), place - (rounded - WHOLE))
}

/// The estimates at bins.
struct Fits<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    /// The estimates with all points, and the factors that take a point's own share out of its residual.
    values: &'a mut [f64],
    factors: &'a mut [f64],
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
            let others = data.direct_sums(kernel, degree, h, data.x[b], Some(b)).fit(degree);
            let value = others.map_or_else(|| data.nearest(data.x[b], Some(b)), |fit| fit.value);
            (value, 1.0)
        };
    }

    fn constants(&mut self, bins: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool {
        let fits = (&mut self.values[bins.clone()], &mut self.factors[bins]);
        let least = dispatch!(Level::new(), simd => constants(simd, sums, fits));
        least > ALONE && least > DIRECT_BELOW * most
    }
}

/// The local constants and their factors out of s and t, and the least of the others' sums of K.
#[inline(always)]
fn constants<S: Simd>(simd: S, sums: &[[f64; 2]], (values, factors): (&mut [f64], &mut [f64])) -> f64 {
    let (groups, rest) = sums.as_chunks::<LANES>();
    let (of_groups, of_rest) = values.as_chunks_mut::<LANES>();
    let (by_groups, by_rest) = factors.as_chunks_mut::<LANES>();
    let mut least = f64x8::splat(simd, f64::INFINITY);
    for ((sums, values), factors) in groups.iter().zip(of_groups).zip(by_groups) {
        let s = f64x8::from_fn(simd, |k| sums[k][0]);
        let t = f64x8::from_fn(simd, |k| sums[k][1]);
        let (value, factor, rest) = constant([s, t], f64x8::splat(simd, 1.0));
        // What is not a number changes nothing, on any processor.
        least = least.min_precise(rest);
        value.store_slice(values);
        factor.store_slice(factors);
    }
    let mut least = least.as_array().iter().copied().fold(f64::INFINITY, f64::min);
    for ((sums, to), by) in rest.iter().zip(of_rest).zip(by_rest) {
        let (value, factor, rest) = constant(*sums, 1.0);
        (*to, *by, least) = (value, factor, least.min(rest));
    }
    least
}

/// The local constant t/s, the factor, and the others' sum of K. A point's share in its estimate is 1/s.
#[inline(always)]
fn constant<T: Copy + Sub<Output = T> + Mul<Output = T> + Div<Output = T>>([s, t]: [T; 2], one: T) -> (T, T, T) {
    let rest = s - one;
    // t/s and s/rest by one division.
    let inverse = one / (s * rest);
    (t * rest * inverse, s * s * inverse, rest)
}

/// The bins of increasing items, [first + k width, first + (k + 1) width) for integers k.
fn gather(items: impl Iterator<Item = Bin>, first: f64, width: f64) -> Vec<Bin> {
    let (mut bins, per_width) = (Vec::with_capacity(items.size_hint().0 / 2 + 1), 1.0 / width);
    // The sums of a bin so far, about its first item.
    let mut origin = [0.0; 2];
    let mut sums = Products::default();
    let mut end = f64::NEG_INFINITY;
    for item in items {
        if item.x >= end {
            if sums.count > 0.0 {
                bins.push(sums.about_mean(origin));
            }
            let place = ((item.x - first) * per_width) as i64 as f64;
            // Rounding may have made the place one less, but those of one abscissa are in one bin.
            end = (first + (place + 1.0) * width).max(item.x.next_up());
            origin = [item.x, item.y];
            sums = Products::default();
        }
        let (dx, dy) = (item.x - origin[0], item.y - origin[1]);
        sums.count += item.count;
        sums.x += item.count * dx;
        sums.y += item.count * dy;
        sums.xx += item.xx + item.count * dx * dx;
        sums.xy += item.xy + item.count * dx * dy;
        sums.yy += item.yy + item.count * dy * dy;
    }
    if sums.count > 0.0 {
        bins.push(sums.about_mean(origin));
    }
    bins
}

/// Sums of deviations and of their products, in one line of the cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
struct Products {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Products {
    /// Adds a point by its deviations.
    #[inline(always)]
    fn add(&mut self, dx: f64, dy: f64) {
        self.count += 1.0;
        self.x += dx;
        self.y += dy;
        self.xx += dx * dx;
        self.xy += dx * dy;
        self.yy += dy * dy;
    }

    /// The sums over both, from one origin.
    fn plus(self, other: Self) -> Self {
        Products {
            count: self.count + other.count,
            x: self.x + other.x,
            y: self.y + other.y,
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// The sums with x in units of 1, where they were in units of `unit`.
    fn with_unit(self, unit: f64) -> Self {
        Products {
            x: self.x * unit,
            xx: self.xx * unit * unit,
            xy: self.xy * unit,
            ..self
        }
    }

    fn about_mean(&self, origin: [f64; 2]) -> Bin {
        let per_count = 1.0 / self.count;
        let (x, y) = (self.x * per_count, self.y * per_count);
        Bin {
            count: self.count,
            x: origin[0] + x,
            y: origin[1] + y,
            xx: (self.xx - x * self.x).max(0.0),
            xy: self.xy - x * self.y,
            yy: (self.yy - y * self.y).max(0.0),
        }
    }
}

#[cfg(test)]
#[path = "binned_tests.rs"]
mod tests;
