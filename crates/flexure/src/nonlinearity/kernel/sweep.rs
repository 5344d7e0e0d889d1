//! Sums over a window that slides over sorted points.
//!
//! Whole grains of [`GRAIN`] points in the window are summed as such, by their moments, with a [`Slider`]; a
//! grain's moments count from its own middle and serve every bandwidth. What is left, at the window's ends, is
//! kept ready as running sums over the points of a short run: those that end where the grains begin, and
//! those that start where the grains end, which hold the grains as well. Every window is so the sum of one of
//! either kind. The windows of a stretch of points share their runs; the next stretch gets its own.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x2, f64x4};
use rayon::prelude::*;

use super::piece::Coefficients;
use super::window::{Frame, Items, Moments, Slider, first_beyond};
use super::{Sorted, Sums};

/// Points of a grain.
const GRAIN: usize = 32;
/// Most points of a stretch.
pub const STRETCH: usize = 128;
/// The starts of a stretch's windows, and their ends, move by less.
const RUN: u32 = 160;
/// Room for a run of RUN points and what it takes to begin and to end with a grain; a power of two.
const ROOM: usize = 256;

/// The moments of GRAIN neighbouring points about their middle, in half widths.
struct Grain<const N: usize> {
    middle: f64,
    half_width: f64,
    moments: Moments<N>,
}

/// All points in grains.
pub struct Grains<const N: usize>(Vec<Grain<N>>);

impl<const N: usize> Grains<N> {
    pub fn new(data: &Sorted) -> Self {
        let grain = |k: usize| {
            let range = k * GRAIN..data.len().min((k + 1) * GRAIN);
            let (first, last) = (data.x[range.start], data.x[range.end - 1]);
            let half_width = 0.5 * (last - first);
            let frame = Frame {
                anchor: first + half_width,
                // All at one abscissa: their offsets are zero whatever the unit.
                per_h: if half_width > 0.0 { 1.0 / half_width } else { 1.0 },
            };
            let mut moments = Moments::ZERO;
            data.for_each(range, |x, w, wy| moments.push(frame.u(x), w, wy));
            Grain {
                middle: frame.anchor,
                half_width,
                moments,
            }
        };
        let count = data.len().div_ceil(GRAIN);
        Grains((0..count).into_par_iter().with_min_len(1024).map(grain).collect())
    }
}

impl<const N: usize> Items<N> for Grains<N> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn anchor(&self, i: usize) -> f64 {
        self.0[i].middle
    }

    #[inline(always)]
    fn add(&self, i: usize, frame: Frame, sum: &mut Moments<N>) {
        let grain = &self.0[i];
        let moments = grain.moments.scaled(grain.half_width * frame.per_h);
        *sum = sum.plus(&moments.shifted(frame.u(grain.middle)));
    }
}

/// Moments of the points of a lower run and of an upper one, as many of either: w, w y of the lower, then of the upper.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Pair<const N: usize>([[f64; 4]; N]);

/// Neighbouring points whose windows all begin and end on the same two runs.
pub struct Stretch<'a, F, const N: usize> {
    frame: Frame,
    coefficients: F,
    at: &'a [f64],
    /// The windows, and where the lower run ends and the upper begins.
    starts: &'a [u32],
    ends: &'a [u32],
    low: usize,
    high: usize,
    runs: &'a Runs<N>,
}

impl<F, const N: usize> Stretch<'_, F, N> {
    pub fn len(&self) -> usize {
        self.at.len()
    }

    /// The moments over a window.
    #[inline(always)]
    fn window(&self, start: u32, end: u32) -> Moments<N> {
        // The remainders tell the compiler that the places are in the runs.
        let (low, high) = (self.low - start as usize, end as usize - self.high);
        let pairs = &self.runs.pairs;
        let (Pair(below), Pair(above)) = (&pairs[low % ROOM], &pairs[high % ROOM]);
        Moments(std::array::from_fn(|k| {
            [below[k][0] + above[k][2], below[k][1] + above[k][3]]
        }))
    }

    /// The sums at the k-th of the points.
    #[inline(always)]
    pub fn sums<const M: usize>(&self, k: usize) -> Sums
    where
        F: Coefficients<M>,
    {
        let moments = self.window(self.starts[k], self.ends[k]);
        Sums::combined(&moments, self.frame.u(self.at[k]), self.coefficients)
    }

    /// s and t of the local constants' sums at all the points.
    #[inline(never)]
    pub fn constants<const M: usize>(&self, sums: &mut [[f64; 2]])
    where
        F: Coefficients<M>,
    {
        let points = self.starts.iter().zip(self.ends).zip(self.at);
        for (((&start, &end), &q), sum) in points.zip(sums) {
            let Moments(moments) = self.window(start, end);
            *sum = self.coefficients.combined(self.frame.u(q), &moments);
        }
    }

    /// A mass that none of the windows exceeds.
    pub fn most(&self) -> f64 {
        let (first, last) = (self.starts[0], self.ends[self.ends.len() - 1]);
        self.window(first, last).0[0][0]
    }
}

/// A window that moves upward over sorted points.
pub struct Sweep<'a, const N: usize> {
    data: &'a Sorted,
    grains: Slider<'a, Grains<N>, N>,
    frame: Frame,
    /// The window.
    lo: usize,
    hi: usize,
    low: Range<usize>,
    high: Range<usize>,
    runs: &'a mut Runs<N>,
}

/// Room for the runs of a sweep, which may be used again.
pub struct Runs<const N: usize> {
    /// The k-th: moments of the last k points below the end of the lower run, and of the grains between the runs and
    /// the first k points of the upper run.
    pairs: Box<[Pair<N>; ROOM]>,
    /// Coordinates of the points that are added to one and the other.
    u: Box<[[f64; 2]; ROOM]>,
}

impl<const N: usize> Default for Runs<N> {
    fn default() -> Self {
        Runs {
            pairs: Box::new([Pair([[0.0; 4]; N]); ROOM]),
            u: Box::new([[0.0; 2]; ROOM]),
        }
    }
}

impl<'a, const N: usize> Sweep<'a, N> {
    pub fn new(data: &'a Sorted, grains: &'a Grains<N>, h: f64, runs: &'a mut Runs<N>) -> Self {
        Sweep {
            data,
            frame: Frame {
                anchor: 0.0,
                per_h: 1.0 / h,
            },
            grains: Slider::new(grains, h),
            lo: 0,
            hi: 0,
            low: 0..0,
            high: 0..0,
            runs,
        }
    }

    /// Visits the sums at those of the points `at[range]` that have any data in their window: that without the
    /// lowest x of which `below(x, q)` is true, up to the last of which `within(x, q)` is. The points must not
    /// be less than those of any call before.
    #[inline(always)]
    pub fn visit<const M: usize>(
        &mut self,
        at: &[f64],
        range: Range<usize>,
        (below, within): (impl Fn(f64, f64) -> bool, impl Fn(f64, f64) -> bool),
        coefficients: impl Coefficients<M>,
        mut visit: impl FnMut(usize, Sums),
    ) {
        let x = &self.data.x[..];
        let (mut starts, mut ends) = ([0; STRETCH], [0; STRETCH]);
        let Range { start: mut first, end } = range;
        while first < end {
            let mut count = 0;
            for &q in &at[first..end.min(first + STRETCH)] {
                self.lo = first_beyond(x, self.lo, |x| below(x, q));
                self.hi = first_beyond(x, self.hi.max(self.lo), |x| within(x, q));
                if self.lo == self.hi {
                    break;
                }
                (starts[count], ends[count]) = (self.lo as u32, self.hi as u32);
                count += 1;
            }
            let windows = (&starts[..count], &ends[..count]);
            self.stretches(&at[first..first + count], windows, coefficients, |k, stretch| {
                for i in 0..stretch.len() {
                    visit(first + k + i, stretch.sums(i));
                }
            });
            // Where there are none, the point has no data in its window.
            first += count.max(1);
        }
    }

    /// Visits the increasing points `at`, which have the windows `starts` to `ends`, none of them empty: a stretch at
    /// a time, with the index of its first point.
    #[inline(always)]
    pub fn stretches<F: Coefficients<M>, const M: usize>(
        &mut self,
        at: &[f64],
        (starts, ends): (&[u32], &[u32]),
        coefficients: F,
        mut visit: impl FnMut(usize, &Stretch<'_, F, N>),
    ) {
        let mut first = 0;
        while first < at.len() {
            let (starts, ends) = (&starts[first..], &ends[first..]);
            let count = self.make_runs(starts, ends);
            let stretch = Stretch {
                frame: self.frame,
                coefficients,
                at: &at[first..first + count],
                starts: &starts[..count],
                ends: &ends[..count],
                low: self.low.end,
                high: self.high.start,
                runs: self.runs,
            };
            visit(first, &stretch);
            first += count;
        }
    }

    /// Makes the runs for the first of these windows and as many more as they serve, and tells how many.
    #[inline(never)]
    fn make_runs(&mut self, starts: &[u32], ends: &[u32]) -> usize {
        let (lo, hi) = (starts[0], ends[0]);
        let mut count = starts.len().min(STRETCH);
        if starts[count - 1] - lo >= RUN || ends[count - 1] - hi >= RUN {
            // The windows move upward.
            count = starts[..count].partition_point(|&start| start - lo < RUN);
            count = ends[..count].partition_point(|&end| end - hi < RUN);
        }
        let (lo, hi) = (lo as usize, hi as usize);
        let mut end = (starts[count - 1] as usize / GRAIN + 1) * GRAIN;
        let mut start = hi / GRAIN * GRAIN;
        if end > start {
            // Narrow windows: all must hold the point where the runs meet.
            (end, start) = (hi, hi);
            count = starts[..count].partition_point(|&start| (start as usize) < hi);
        }
        let mut core = Moments::ZERO;
        self.frame.anchor = self.data.x[hi - 1];
        if end < start {
            let (first, last) = (end / GRAIN, start / GRAIN);
            let view = self.grains.seek(first, last);
            if let Some(moments) = view.window(first, last) {
                (core, self.frame) = (moments, view.frame);
            }
        }
        self.low = lo..end;
        self.high = start..ends[count - 1] as usize;
        match self.data.weights() {
            None => dispatch!(Level::new(), simd => self.fill(simd, core, |_, y| (1.0, y))),
            Some(w) => dispatch!(Level::new(), simd => self.fill(simd, core, |i, y| (w[i], w[i] * y))),
        }
        count
    }

    /// Fills the runs, of which the upper one begins with `core`; `weighted(i, y)` are w and w y.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, core: Moments<N>, weighted: impl Fn(usize, f64) -> (f64, f64)) {
        let Sorted { x, y, .. } = self.data;
        let (frame, low, high) = (self.frame, self.low.clone(), self.high.clone());
        let Runs { pairs, u } = &mut *self.runs;
        // Both runs at once, as every sum must wait for the one before; then what one has more than the other.
        let both = low.len().min(high.len());
        let mut sums = core.0.map(|[w, wy]| f64x4::simd_from(simd, [0.0, 0.0, w, wy]));
        pairs[0].0 = sums.map(Into::into);
        let pairs = &mut pairs[1..];
        {
            let first = low.end - both;
            let (lower_x, lower_y) = (&x[first..low.end], &y[first..low.end]);
            let (upper_x, upper_y) = (&x[high.start..][..both], &y[high.start..][..both]);
            let (pairs, u) = (&mut pairs[..both], &mut u[..both]);
            for k in 0..both {
                u[k] = [frame.u(lower_x[both - 1 - k]), frame.u(upper_x[k])];
            }
            for k in 0..both {
                let l = both - 1 - k;
                let (w, wy) = weighted(first + l, lower_y[l]);
                let (v, vy) = weighted(high.start + k, upper_y[k]);
                let mut power = f64x4::simd_from(simd, [w, wy, v, vy]);
                let u = f64x4::simd_from(simd, [u[k][0], u[k][0], u[k][1], u[k][1]]);
                for m in 0..N {
                    sums[m] += power;
                    power *= u;
                    pairs[k].0[m] = sums[m].into();
                }
            }
        }
        let sums: [[f64; 4]; N] = sums.map(Into::into);
        for (side, len) in [(0, low.len()), (2, high.len())] {
            let mut sum = sums.map(|sum| f64x2::from_slice(simd, &sum[side..side + 2]));
            for (k, Pair(pair)) in (both..).zip(&mut pairs[both..len]) {
                let i = if side == 0 { low.end - 1 - k } else { high.start + k };
                let (w, wy) = weighted(i, y[i]);
                let mut power = f64x2::simd_from(simd, [w, wy]);
                let u = f64x2::splat(simd, frame.u(x[i]));
                for m in 0..N {
                    sum[m] += power;
                    power *= u;
                    sum[m].store_slice(&mut pair[m][side..side + 2]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside sums point by point, to the last bit, whatever registers there are.
    #[test]
    fn runs_are_the_sums_of_their_points_on_every_processor() {
        let n = 600;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i) + 0.3 * f64::from(i).sin()).collect();
        let y: Vec<f64> = x.iter().map(|x| (0.1 * x).cos()).collect();
        let w: Vec<f64> = x.iter().map(|x| 1.5 + x.sin()).collect();
        let data = Sorted::weighted(&x, &y, &w);
        let grains = Grains::<5>::new(&data);
        let weighted = |i: usize, y: f64| (w[i], w[i] * y);
        for level in [Level::new(), Level::baseline()] {
            for (low, high) in [(10..75, 200..330), (10..140, 200..261), (7..8, 8..9), (0..50, 90..90)] {
                let mut runs = Runs::default();
                let mut sweep = Sweep::new(&data, &grains, 100.0, &mut runs);
                (sweep.low, sweep.high, sweep.frame.anchor) = (low.clone(), high.clone(), 150.0);
                let mut core = Moments::ZERO;
                core.push(0.5, 2.0, 3.0);
                dispatch!(level, simd => sweep.fill(simd, core, weighted));
                let frame = sweep.frame;
                let check = |points: &mut dyn Iterator<Item = usize>, mut sum: Moments<5>, side: usize| {
                    for (k, i) in points.enumerate() {
                        let (w, wy) = weighted(i, data.y[i]);
                        sum.push(frame.u(x[i]), w, wy);
                        let run = runs.pairs[k + 1].0.map(|moment| [moment[side], moment[side + 1]]);
                        assert!(run == sum.0, "{level:?}, {low:?}, {high:?}: {i}");
                    }
                };
                check(&mut low.clone().rev(), Moments::ZERO, 0);
                check(&mut high.clone(), core, 2);
            }
        }
    }
}
