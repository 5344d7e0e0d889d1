//! Leave-one-out scores from data that are brought together in bins: they cost the same however many points
//! there are.
//!
//! Bins that lie side by side are done in sections ([`section`](super::section)), which is faster and more accurate,
//! for local constants with a kernel of one polynomial. Here is what serves all kernels, and bins with gaps between them:
//!
//! A bin is a point at its data's mean abscissa that weighs as many as they are, so that the kernel sums err in
//! the second order of the bin's width alone. The score of its data is that about the estimate's tangent: the
//! bin's second moments are all that is needed, and it errs in the second order as well.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};
use rayon::prelude::*;

use std::ops::{Div, Mul, Range, Sub};
use std::sync::OnceLock;

use super::bin::{Bin, gather};
use super::gaussian::{self, FEW_NEIGHBOURS, FEW_TERMS};
use super::lattice::Lattice;
use super::piece::{Visit, at_own_points};
use super::sums::DIRECT_BELOW;
use super::tangents::{LANES, Tangents};
use super::{Degree, Kernel, Sorted, Sums};

/// Points that are put in bins at a time: bins end with them, whatever the number of threads.
pub(super) const CHUNK: usize = 1 << 16;
/// Most parts in which points in no order are taken, each with bins of its own.
pub(super) const PARTS: usize = 8;
/// A point whose share in its own estimate is larger than 1 less this is left out by direct summation.
pub(super) const ALONE: f64 = 1e-3;

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
    levels: Vec<OneWidth>,
    /// The widths, and the number of bins to a bandwidth.
    narrowest: f64,
    per_bandwidth: f64,
}

/// The data in bins of one width: side by side where these are not too many, and without the empty ones where that is
/// asked for.
struct OneWidth {
    lattice: Option<Lattice>,
    bins: OnceLock<Bins>,
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
        let narrowest = narrowest(smallest, per_bandwidth);
        let finest = OneWidth::new(data.len(), point, narrowest);
        Self::over(finest, narrowest, largest, per_bandwidth)
    }

    /// The same from points that are in no order: faster, unless they lie in few of very many bins.
    pub fn scattered(x: &[f64], y: &[f64], smallest: f64, largest: f64, per_bandwidth: f64) -> Self {
        let narrowest = narrowest(smallest, per_bandwidth);
        match Lattice::new(x, y, narrowest) {
            Some(lattice) => Self::over(OneWidth::side_by_side(lattice), narrowest, largest, per_bandwidth),
            None => Self::new(&Sorted::new(x, y), smallest, largest, per_bandwidth),
        }
    }

    fn over(finest: OneWidth, narrowest: f64, largest: f64, per_bandwidth: f64) -> Self {
        let mut pyramid = Pyramid {
            levels: vec![finest],
            narrowest,
            per_bandwidth,
        };
        for level in 1..=pyramid.level(largest) {
            let finer = &pyramid.levels[level - 1];
            if finer.len() < 2 {
                break;
            }
            let coarser = match &finer.lattice {
                Some(lattice) => OneWidth::side_by_side(lattice.coarser()),
                None => {
                    let (finer, width) = (finer.bins(), narrowest * 2f64.powi(level as i32));
                    OneWidth::new(finer.data.len(), |i| finer.bin(i), width)
                }
            };
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
        // The ratio itself need not be finite.
        (bandwidth.log2() - self.per_bandwidth.log2() - self.narrowest.log2()).max(0.0) as usize
    }

    /// The scores, as of [`leave_one_out`](super::leave_one_out).
    pub fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        let level = |h: f64| self.level(h).min(self.levels.len() - 1);
        let by_level: Vec<(Vec<usize>, Vec<f64>)> = (self.levels.par_iter().enumerate())
            .map(|(k, width)| {
                let own: Vec<usize> = (0..bandwidths.len()).filter(|&i| level(bandwidths[i]) == k).collect();
                let widths: Vec<f64> = own.iter().map(|&i| bandwidths[i]).collect();
                let scores = width.scores(kernel, degree, &widths);
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

/// The width of the narrowest bins, of which the inverse is finite.
fn narrowest(smallest: f64, per_bandwidth: f64) -> f64 {
    (smallest / per_bandwidth).max(f64::MIN_POSITIVE)
}

impl OneWidth {
    fn side_by_side(lattice: Lattice) -> Self {
        OneWidth {
            lattice: Some(lattice),
            bins: OnceLock::new(),
        }
    }

    /// Brings `count` items in order together.
    fn new(count: usize, item: impl Fn(usize) -> Bin + Sync, width: f64) -> Self {
        let first = item(0).x;
        let bins: Vec<Vec<Bin>> = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|k| gather((k * CHUNK..count.min((k + 1) * CHUNK)).map(&item), first, width))
            .collect();
        let bins = bins.concat();
        match Lattice::of_bins(&bins, first, width) {
            Some(lattice) => Self::side_by_side(lattice),
            None => OneWidth {
                lattice: None,
                bins: Bins::of(&bins).into(),
            },
        }
    }

    fn len(&self) -> usize {
        self.lattice
            .as_ref()
            .map_or_else(|| self.bins().data.len(), |lattice| lattice.len)
    }

    /// Those that are not empty; only a lattice's are not at hand.
    fn bins(&self) -> &Bins {
        (self.bins).get_or_init(|| Bins::of(&self.lattice.iter().flat_map(Lattice::bins).collect::<Vec<_>>()))
    }

    fn scores(&self, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
        if bandwidths.is_empty() {
            return Vec::new();
        }
        let lattice = self.lattice.as_ref().filter(|_| degree == Degree::Constant);
        lattice
            .and_then(|lattice| lattice.scores(kernel, bandwidths))
            .unwrap_or_else(|| self.bins().scores(kernel, degree, bandwidths))
    }
}

impl Bins {
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
        (self.values[b], self.factors[b]) = left_out(data, kernel, degree, h, b, sums);
    }

    fn constants(&mut self, bins: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool {
        let fits = (&mut self.values[bins.clone()], &mut self.factors[bins]);
        let least = dispatch!(Level::new(), simd => constants(simd, sums, fits));
        least > ALONE && least > DIRECT_BELOW * most
    }
}

/// The estimate at a bin, of which these are the sums, and the factor that takes a point's own share out of its residual.
fn left_out(data: &Sorted, kernel: Kernel, degree: Degree, h: f64, b: usize, sums: Sums) -> (f64, f64) {
    let Some(fit) = sums.fit(degree) else {
        return (0.0, 1.0);
    };
    let rest = 1.0 - fit.leverage;
    if data.weight(b) > 1.0 || rest > ALONE {
        return (fit.value, 1.0 / rest);
    }
    let others = data.direct_sums(kernel, degree, h, data.x[b], Some(b)).fit(degree);
    let value = others.map_or_else(|| data.nearest(data.x[b], Some(b)), |fit| fit.value);
    (value, 1.0)
}

/// The local constants and their factors out of s and t, and the least of the others' sums of K.
#[inline(always)]
fn constants<S: Simd>(simd: S, sums: &[[f64; 2]], (values, factors): (&mut [f64], &mut [f64])) -> f64 {
    let (groups, rest) = sums.as_chunks::<LANES>();
    let (of_groups, of_rest) = values.as_chunks_mut::<LANES>();
    let (by_groups, by_rest) = factors.as_chunks_mut::<LANES>();
    let one = f64x8::splat(simd, 1.0);
    let mut least = f64x8::splat(simd, f64::INFINITY);
    for ((sums, values), factors) in groups.iter().zip(of_groups).zip(by_groups) {
        let s = f64x8::from_fn(simd, |k| sums[k][0]);
        let t = f64x8::from_fn(simd, |k| sums[k][1]);
        let (value, factor, rest) = constant([s, t], one, one);
        // What is not a number changes nothing, on any processor.
        least = least.min_precise(rest);
        value.store_slice(values);
        factor.store_slice(factors);
    }
    let mut least = least.as_array().iter().copied().fold(f64::INFINITY, f64::min);
    for ((sums, to), by) in rest.iter().zip(of_rest).zip(by_rest) {
        let (value, factor, rest) = constant(*sums, 1.0, 1.0);
        (*to, *by, least) = (value, factor, least.min(rest));
    }
    least
}

/// The local constant t/s, the factor, and the others' sum of K, which is s less a point's `own` share.
#[inline(always)]
pub(super) fn constant<T: Copy + Sub<Output = T> + Mul<Output = T> + Div<Output = T>>(
    [s, t]: [T; 2],
    own: T,
    one: T,
) -> (T, T, T) {
    let rest = s - own;
    // t/s and s/rest by one division.
    let inverse = one / (s * rest);
    (t * rest * inverse, s * s * inverse, rest)
}

#[cfg(test)]
#[path = "binned_tests.rs"]
mod tests;
