//! Sums over a window that slides over sorted points.
//!
//! Whole grains of [`GRAIN`] points in the window are summed as such, by their moments, with a [`Slider`]; a
//! grain's moments count from its own middle and serve every bandwidth. What is left, at the window's ends, is
//! kept ready as running sums over the points of a short run: those that end where the grains begin, and
//! those that start where the grains end, which hold the grains as well. Every window is so the sum of one of
//! either kind, until one of its ends leaves its run.

use std::ops::Range;

use rayon::prelude::*;

use super::window::{Frame, Items, Moments, Slider, both_beyond, first_beyond};
use super::{Sorted, Sums};

/// Points of a grain.
const GRAIN: usize = 32;
/// Points whose running sums are kept at either end of the window, about.
const RUN: usize = 128;

/// Points whose windows are found at a time.
pub const TILE: usize = 64;

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

/// A window that moves upward over sorted points.
pub struct Sweep<'a, const N: usize> {
    data: &'a Sorted,
    grains: Slider<'a, Grains<N>, N>,
    frame: Frame,
    /// The window.
    lo: usize,
    hi: usize,
    /// Moments of the points i..end of the lower run for each i of it.
    below: Vec<Moments<N>>,
    low: usize,
    /// Moments of the grains between the runs and of the points up to i of the upper run, for each i.
    above: Vec<Moments<N>>,
    high: usize,
}

impl<'a, const N: usize> Sweep<'a, N> {
    pub fn new(data: &'a Sorted, grains: &'a Grains<N>, h: f64) -> Self {
        Sweep {
            data,
            frame: Frame {
                anchor: 0.0,
                per_h: 1.0 / h,
            },
            grains: Slider::new(grains, h),
            lo: 0,
            hi: 0,
            below: Vec::with_capacity(RUN + 1),
            low: 0,
            above: Vec::with_capacity(RUN + GRAIN + 1),
            high: 0,
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
        coefficients: impl Fn(f64) -> [f64; M],
        mut visit: impl FnMut(usize, Sums),
    ) {
        let x = &self.data.x[..];
        let (mut lo, mut hi) = (self.lo, self.hi);
        let Range { start: mut j, end } = range;
        // The windows first, then their sums: both loops are short, and wait for nothing.
        let mut windows = [[0; 2]; TILE];
        while j < end {
            lo = first_beyond(x, lo, |x| below(x, at[j]));
            hi = first_beyond(x, hi.max(lo), |x| within(x, at[j]));
            if lo == hi {
                j += 1;
                continue;
            }
            if lo < self.low || lo >= self.low + self.below.len() || hi >= self.high + self.above.len() {
                self.reposition(lo, hi);
            }
            // As long as the window's ends stay on their runs.
            let (low, high) = (self.low, self.high);
            let (lows, highs) = (&self.below[..], &self.above[..]);
            let (low_end, high_end) = (low + lows.len(), high + highs.len());
            let at = &at[j..end.min(j + TILE)];
            let mut count = 0;
            while count < at.len() {
                let q = at[count];
                if let Some(&next) = at.get(count + 1)
                    && let Some([lo0, lo1]) = both_beyond(x, lo, |x| below(x, q), |x| below(x, next))
                    && let Some([hi0, hi1]) = both_beyond(x, hi, |x| within(x, q), |x| within(x, next))
                    && lo1 < low_end
                    && hi1 < high_end
                {
                    windows[count] = [lo0 - low, hi0 - high];
                    windows[count + 1] = [lo1 - low, hi1 - high];
                    (lo, hi) = (lo1, hi1);
                    count += 2;
                    continue;
                }
                lo = first_beyond(x, lo, |x| below(x, q));
                hi = first_beyond(x, hi, |x| within(x, q));
                if lo >= low_end || hi >= high_end {
                    break;
                }
                windows[count] = [lo - low, hi - high];
                count += 1;
            }
            for (k, ([lo, hi], q)) in windows.iter().zip(at).enumerate().take(count) {
                let moments = lows[*lo].plus(&highs[*hi]);
                visit(j + k, Sums::combined(&moments, self.frame.u(*q), &coefficients));
            }
            j += count;
        }
        (self.lo, self.hi) = (lo, hi);
    }

    /// Makes the runs anew for the window lo..hi, which has a point.
    #[inline(never)]
    fn reposition(&mut self, lo: usize, hi: usize) {
        let (mut end, mut start) = (hi, hi);
        if hi - lo > RUN {
            end = (lo + RUN) / GRAIN * GRAIN;
            start = hi / GRAIN * GRAIN;
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
        let frame = self.frame;
        self.low = lo;
        // Not the empty run: the window would have left the anchor behind.
        self.below.resize(end - lo, Moments::ZERO);
        let mut sum = Moments::ZERO;
        let mut run = self.below.iter_mut().rev();
        self.data.for_each_reversed(lo..end, |x, w, wy| {
            sum.push(frame.u(x), w, wy);
            if let Some(run) = run.next() {
                *run = sum;
            }
        });
        let last = self.data.len().min(start + RUN + GRAIN);
        self.high = start;
        self.above.resize(last - start + 1, Moments::ZERO);
        self.above[0] = core;
        let mut run = self.above[1..].iter_mut();
        self.data.for_each(start..last, |x, w, wy| {
            core.push(frame.u(x), w, wy);
            if let Some(run) = run.next() {
                *run = core;
            }
        });
    }
}
