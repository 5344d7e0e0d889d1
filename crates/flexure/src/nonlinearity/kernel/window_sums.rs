//! Sums over a window that slides over sorted points.
//!
//! ```text
//!       lower run        whole groups        upper run
//!  --[----------------|-----|-----|-----|----------------)--
//!   start          low_end          high_start          end
//! ```
//!
//! A window is the sum of two running sums. The first runs from `low_end` down to `start`. The second begins with the sum
//! of the whole groups and runs from `high_start` up to `end`. The windows of a batch of neighbouring points share their
//! runs, and the next batch gets its own. So the groups are added up only once a batch, by a [`SlidingSum`].

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x2, f64x4};

use super::moments::{Coefficients, Frame, GROUP, Groups, Moments, SlidingSum};
use super::{Sorted, Sums};

/// Most points of a batch.
pub const BATCH: usize = 128;
/// Within a batch the starts of the windows move by less than this, and so do their ends.
const MOST_MOVE: u32 = 160;
/// Capacity of a run: MOST_MOVE points and what it takes to begin and to end with a group. A power of two.
const CAPACITY: usize = 256;

/// Moments w u^k and w y u^k of as many points of the lower run (the first two numbers) and of the upper run.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Pair<const N: usize>([[f64; 4]; N]);

/// The running sums of both runs. They may be used again for other windows.
pub struct RunningSums<const N: usize> {
    /// Entry k: the last k points of the lower run, and the groups with the first k points of the upper run.
    pairs: Box<[Pair<N>; CAPACITY]>,
    /// Coordinates of the points that are added to one and the other.
    u: Box<[[f64; 2]; CAPACITY]>,
}

impl<const N: usize> Default for RunningSums<N> {
    fn default() -> Self {
        RunningSums {
            pairs: Box::new([Pair([[0.0; 4]; N]); CAPACITY]),
            u: Box::new([[0.0; 2]; CAPACITY]),
        }
    }
}

/// Neighbouring points of evaluation whose windows share their runs.
pub struct Batch<'a, F, const N: usize> {
    frame: Frame,
    coefficients: F,
    at: &'a [f64],
    /// The first point of each window, and the one after its last.
    starts: &'a [u32],
    ends: &'a [u32],
    /// Where the lower run ends and where the upper one begins.
    low_end: usize,
    high_start: usize,
    sums: &'a RunningSums<N>,
}

impl<F, const N: usize> Batch<'_, F, N> {
    pub fn len(&self) -> usize {
        self.at.len()
    }

    /// The moments over a window.
    #[inline(always)]
    fn window(&self, start: u32, end: u32) -> Moments<N> {
        // The remainders let the compiler know that the indices are in range.
        let (low, high) = (self.low_end - start as usize, end as usize - self.high_start);
        let pairs = &self.sums.pairs;
        let (Pair(below), Pair(above)) = (&pairs[low % CAPACITY], &pairs[high % CAPACITY]);
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

    /// sum w K and sum w K y for the local constants at all points.
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
pub struct WindowSums<'a, const N: usize> {
    data: &'a Sorted,
    groups: SlidingSum<'a, N>,
    frame: Frame,
    /// The last window.
    start: usize,
    end: usize,
    /// The points of the lower run and of the upper one.
    low: Range<usize>,
    high: Range<usize>,
    sums: &'a mut RunningSums<N>,
}

impl<'a, const N: usize> WindowSums<'a, N> {
    pub fn new(data: &'a Sorted, groups: &'a Groups<N>, h: f64, sums: &'a mut RunningSums<N>) -> Self {
        WindowSums {
            data,
            frame: Frame {
                anchor: 0.0,
                per_h: 1.0 / h,
            },
            groups: SlidingSum::new(groups, h),
            start: 0,
            end: 0,
            low: 0..0,
            high: 0..0,
            sums,
        }
    }

    /// Visits the sums at those of the points `at[range]` that have any data in their window. The window begins after the
    /// last x for which `below(x, q)` is true and ends with the last for which `within(x, q)` is. The points must not be
    /// less than those of any call before.
    #[inline(always)]
    pub fn visit<const M: usize>(
        &mut self,
        at: &[f64],
        range: Range<usize>,
        below: impl Fn(f64, f64) -> bool,
        within: impl Fn(f64, f64) -> bool,
        coefficients: impl Coefficients<M>,
        mut visit: impl FnMut(usize, Sums),
    ) {
        let x = &self.data.x[..];
        let (mut starts, mut ends) = ([0; BATCH], [0; BATCH]);
        let Range { start: mut first, end } = range;
        while first < end {
            let mut count = 0;
            for &q in &at[first..end.min(first + BATCH)] {
                self.start = first_beyond(x, self.start, |x| below(x, q));
                self.end = first_beyond(x, self.end.max(self.start), |x| within(x, q));
                if self.start == self.end {
                    break;
                }
                (starts[count], ends[count]) = (self.start as u32, self.end as u32);
                count += 1;
            }
            let at = &at[first..first + count];
            self.batches(at, &starts[..count], &ends[..count], coefficients, |k, batch| {
                for i in 0..batch.len() {
                    visit(first + k + i, batch.sums(i));
                }
            });
            // If the first window is empty, the point has no data in reach.
            first += count.max(1);
        }
    }

    /// Visits the increasing points `at`, whose windows `starts` to `ends` are not empty: a batch at a time, with the index
    /// of its first point.
    #[inline(always)]
    pub fn batches<F: Coefficients<M>, const M: usize>(
        &mut self,
        at: &[f64],
        starts: &[u32],
        ends: &[u32],
        coefficients: F,
        mut visit: impl FnMut(usize, &Batch<'_, F, N>),
    ) {
        let mut first = 0;
        while first < at.len() {
            let (starts, ends) = (&starts[first..], &ends[first..]);
            let count = self.make_runs(starts, ends);
            let batch = Batch {
                frame: self.frame,
                coefficients,
                at: &at[first..first + count],
                starts: &starts[..count],
                ends: &ends[..count],
                low_end: self.low.end,
                high_start: self.high.start,
                sums: self.sums,
            };
            visit(first, &batch);
            first += count;
        }
    }

    /// Makes the runs for the first of these windows and for as many more as they serve. Returns the number of windows.
    #[inline(never)]
    fn make_runs(&mut self, starts: &[u32], ends: &[u32]) -> usize {
        let (start, end) = (starts[0], ends[0]);
        let mut count = starts.len().min(BATCH);
        if starts[count - 1] - start >= MOST_MOVE || ends[count - 1] - end >= MOST_MOVE {
            // Starts and ends increase.
            count = starts[..count].partition_point(|&other| other - start < MOST_MOVE);
            count = ends[..count].partition_point(|&other| other - end < MOST_MOVE);
        }
        let (start, end) = (start as usize, end as usize);
        let mut low_end = (starts[count - 1] as usize / GROUP + 1) * GROUP;
        let mut high_start = end / GROUP * GROUP;
        if low_end > high_start {
            // Narrow windows: all of them must hold the point where the runs meet.
            (low_end, high_start) = (end, end);
            count = starts[..count].partition_point(|&other| (other as usize) < end);
        }
        let mut between = Moments::ZERO;
        self.frame.anchor = self.data.x[end - 1];
        if low_end < high_start {
            between = self.groups.over(low_end / GROUP, high_start / GROUP);
            self.frame = self.groups.frame;
        }
        self.low = start..low_end;
        self.high = high_start..ends[count - 1] as usize;
        match self.data.weights() {
            None => dispatch!(Level::new(), simd => self.fill(simd, between, |_, y| (1.0, y))),
            Some(w) => dispatch!(Level::new(), simd => self.fill(simd, between, |i, y| (w[i], w[i] * y))),
        }
        count
    }

    /// Fills the running sums. That of the upper run begins with `between`; `weighted(i, y)` returns w and w y.
    ///
    /// Every sum must wait for the one before it. So both runs are summed at once, as far as both have points, and then the
    /// rest of the longer one.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, between: Moments<N>, weighted: impl Fn(usize, f64) -> (f64, f64)) {
        let both = self.low.len().min(self.high.len());
        let sums = between.0.map(|[w, wy]| f64x4::simd_from(simd, [0.0, 0.0, w, wy]));
        self.sums.pairs[0].0 = sums.map(Into::into);
        let sums = self.fill_both(simd, both, sums, &weighted);
        for (side, len) in [(0, self.low.len()), (2, self.high.len())] {
            let sum = sums.map(|sum| [sum[side], sum[side + 1]]);
            self.fill_one(simd, side, both..len, sum, &weighted);
        }
    }

    /// Fills the first `both` entries of both runs, from the sums before them. Returns the last sums.
    #[inline(always)]
    fn fill_both<S: Simd>(
        &mut self,
        simd: S,
        both: usize,
        mut sums: [f64x4<S>; N],
        weighted: &impl Fn(usize, f64) -> (f64, f64),
    ) -> [[f64; 4]; N] {
        let Sorted { x, y, .. } = self.data;
        let (frame, first, high_start) = (self.frame, self.low.end - both, self.high.start);
        let (lower_x, lower_y) = (&x[first..][..both], &y[first..][..both]);
        let (upper_x, upper_y) = (&x[high_start..][..both], &y[high_start..][..both]);
        let (pairs, u) = (&mut self.sums.pairs[1..][..both], &mut self.sums.u[..both]);
        for k in 0..both {
            u[k] = [frame.u(lower_x[both - 1 - k]), frame.u(upper_x[k])];
        }
        for k in 0..both {
            let l = both - 1 - k;
            let (w, wy) = weighted(first + l, lower_y[l]);
            let (v, vy) = weighted(high_start + k, upper_y[k]);
            let mut power = f64x4::simd_from(simd, [w, wy, v, vy]);
            let u = f64x4::simd_from(simd, [u[k][0], u[k][0], u[k][1], u[k][1]]);
            for m in 0..N {
                sums[m] += power;
                power *= u;
                pairs[k].0[m] = sums[m].into();
            }
        }
        sums.map(Into::into)
    }

    /// Fills the entries `range` of one run (the lower one for `side` 0, the upper one for 2) from the sum before them.
    #[inline(always)]
    fn fill_one<S: Simd>(
        &mut self,
        simd: S,
        side: usize,
        range: Range<usize>,
        sum: [[f64; 2]; N],
        weighted: &impl Fn(usize, f64) -> (f64, f64),
    ) {
        let Sorted { x, y, .. } = self.data;
        let mut sum = sum.map(|sum| f64x2::simd_from(simd, sum));
        let pairs = &mut self.sums.pairs[1..][range.clone()];
        for (k, Pair(pair)) in range.zip(pairs) {
            let i = if side == 0 {
                self.low.end - 1 - k
            } else {
                self.high.start + k
            };
            let (w, wy) = weighted(i, y[i]);
            let mut power = f64x2::simd_from(simd, [w, wy]);
            let u = f64x2::splat(simd, self.frame.u(x[i]));
            for m in 0..N {
                sum[m] += power;
                power *= u;
                sum[m].store_slice(&mut pair[m][side..side + 2]);
            }
        }
    }
}

/// Steps of four before the search for a far index begins.
const FOURS: usize = 4;

/// The first index from `start` on at which `holds` is false. All indices at which it is true come first.
#[inline(always)]
fn first_beyond(x: &[f64], start: usize, holds: impl Fn(f64) -> bool) -> usize {
    let mut i = start;
    // Mostly one step of four is enough. It has no branch that could be mispredicted.
    for _ in 0..FOURS {
        let Some(four) = x.get(i..i + 4) else { break };
        let count: usize = four.iter().map(|&v| usize::from(holds(v))).sum();
        i += count;
        if count < 4 {
            return i;
        }
    }
    far_beyond(x, i, holds)
}

/// The same for an index that may be far: the step is doubled, then the last interval bisected.
#[inline(never)]
fn far_beyond(x: &[f64], start: usize, holds: impl Fn(f64) -> bool) -> usize {
    let (mut known, mut step) = (start, 1);
    while x.get(known + step - 1).is_some_and(|&v| holds(v)) {
        known += step;
        step *= 2;
    }
    let end = (known + step).min(x.len());
    known + x[known..end].partition_point(|&v| holds(v))
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
        let data = Sorted::new(&x, &y, Some(&w));
        let groups = Groups::<5>::new(&data);
        let weighted = |i: usize, y: f64| (w[i], w[i] * y);
        for level in [Level::new(), Level::baseline()] {
            for (low, high) in [(10..75, 200..330), (10..140, 200..261), (7..8, 8..9), (0..50, 90..90)] {
                let mut runs = RunningSums::default();
                let mut windows = WindowSums::new(&data, &groups, 100.0, &mut runs);
                (windows.low, windows.high, windows.frame.anchor) = (low.clone(), high.clone(), 150.0);
                let mut between = Moments::ZERO;
                between.push(0.5, 2.0, 3.0);
                dispatch!(level, simd => windows.fill(simd, between, weighted));
                let frame = windows.frame;
                let check = |points: &mut dyn Iterator<Item = usize>, mut sum: Moments<5>, side: usize| {
                    for (k, i) in points.enumerate() {
                        let (w, wy) = weighted(i, data.y[i]);
                        sum.push(frame.u(x[i]), w, wy);
                        let run = runs.pairs[k + 1].0.map(|moment| [moment[side], moment[side + 1]]);
                        assert!(run == sum.0, "{level:?}, {low:?}, {high:?}: {i}");
                    }
                };
                check(&mut low.clone().rev(), Moments::ZERO, 0);
                check(&mut high.clone(), between, 2);
            }
        }
    }
}
