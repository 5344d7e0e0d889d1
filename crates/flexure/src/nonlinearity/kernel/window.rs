//! Sums over a sliding window by moments that are only ever added, never subtracted.
//!
//! For a polynomial kernel the sum over the window is a combination of the moments
//! sum w u^k and sum w y u^k, u = (x - c)/h. As the window slides it is cut at a split: the moments of
//! every run of points that ends at the split are at hand, and those of every run that starts there, so
//! that each window that holds the split is one of the former and one of the latter. When the window
//! leaves the split behind, a new one is made at its upper end, and the anchor c with it. Every point is so
//! added at most three times, and as nothing is subtracted no digit is lost to an offset, to clusters, to
//! ties or to heavy tails: |u| never exceeds 2.
//!
//! Runs are kept for one block of points on either side of the split, whatever the window's width; the
//! others are remembered by one sum a block.

use std::ops::Range;

/// Points in a block.
const BLOCK: usize = 64;

/// sum w u^k and sum w y u^k for k < N, in pairs.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub struct Moments<const N: usize>(pub [[f64; 2]; N]);

impl<const N: usize> Moments<N> {
    pub const ZERO: Self = Moments([[0.0; 2]; N]);

    /// Adds a point at u of weight `w` and of weighted ordinate `wy`.
    #[inline(always)]
    pub fn push(&mut self, u: f64, w: f64, wy: f64) {
        let mut power = [w, wy];
        for k in 0..N {
            self.0[k][0] += power[0];
            self.0[k][1] += power[1];
            power = [power[0] * u, power[1] * u];
        }
    }

    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        for k in 0..N {
            sum.0[k][0] += other.0[k][0];
            sum.0[k][1] += other.0[k][1];
        }
        sum
    }

    /// The moments of r u.
    #[inline(always)]
    pub fn scaled(mut self, r: f64) -> Self {
        let mut power = r;
        for k in 1..N {
            self.0[k] = self.0[k].map(|m| power * m);
            power *= r;
        }
        self
    }

    /// The moments of u + d, by Pascal's triangle.
    #[inline(always)]
    pub fn shifted(mut self, d: f64) -> Self {
        for i in 1..N {
            for k in (i..N).rev() {
                for side in 0..2 {
                    self.0[k][side] += d * self.0[k - 1][side];
                }
            }
        }
        self
    }
}

/// What a window slides over: a line of points, or of groups of points, in order.
pub trait Items<const N: usize> {
    /// How many there are.
    fn len(&self) -> usize;

    /// The abscissa to count from when `i` is the last item of a window.
    fn anchor(&self, i: usize) -> f64;

    /// Adds item `i` to `sum`.
    fn add(&self, i: usize, frame: Frame, sum: &mut Moments<N>);
}

/// The coordinate u = (x - anchor) per_h.
#[derive(Clone, Copy)]
pub struct Frame {
    pub anchor: f64,
    pub per_h: f64,
}

impl Frame {
    #[inline(always)]
    pub fn u(self, x: f64) -> f64 {
        (x - self.anchor) * self.per_h
    }
}

/// Moments over windows that move upward.
pub struct Slider<'a, I, const N: usize> {
    items: &'a I,
    frame: Frame,
    /// The split is just below this item.
    split: usize,
    /// Moments of the items from the end of block k below the split up to the split.
    /// Block 0 starts with the first item of the window for which the split was made.
    beyond: Vec<Moments<N>>,
    base: usize,
    /// Moments of the items i..split, for i in `low`.
    below: Vec<Moments<N>>,
    low: Range<usize>,
    /// Moments of the items split..i, for i in `high`.
    above: Vec<Moments<N>>,
    high: Range<usize>,
}

impl<'a, I: Items<N>, const N: usize> Slider<'a, I, N> {
    pub fn new(items: &'a I, h: f64) -> Self {
        Slider {
            items,
            frame: Frame {
                anchor: 0.0,
                per_h: 1.0 / h,
            },
            split: 0,
            beyond: Vec::new(),
            base: 0,
            below: Vec::with_capacity(BLOCK),
            low: 0..0,
            above: Vec::with_capacity(BLOCK + 1),
            high: 0..0,
        }
    }

    /// What there is to see from the window lo..hi, lo < hi, neither of which may be less than before.
    #[inline(always)]
    pub fn seek(&mut self, lo: usize, hi: usize) -> View<'_, N> {
        if lo >= self.split {
            self.make_split(lo, hi);
        }
        if lo >= self.low.end {
            self.fill_below(lo);
        }
        while hi >= self.high.end {
            self.fill_above();
        }
        View {
            frame: self.frame,
            below: &self.below,
            low: self.low.start,
            above: &self.above,
            high: self.high.start,
        }
    }

    #[inline(never)]
    fn make_split(&mut self, lo: usize, hi: usize) {
        (self.base, self.split) = (lo, hi);
        self.frame.anchor = self.items.anchor(hi - 1);
        self.beyond.clear();
        self.beyond.resize((hi - lo).div_ceil(BLOCK), Moments::ZERO);
        let mut sum = Moments::ZERO;
        for (k, beyond) in self.beyond.iter_mut().enumerate().rev() {
            *beyond = sum;
            let first = lo + k * BLOCK;
            if k > 0 {
                for i in (first..(first + BLOCK).min(hi)).rev() {
                    self.items.add(i, self.frame, &mut sum);
                }
            }
        }
        self.fill_below(lo);
        self.high = hi..hi + 1;
        self.above.clear();
        self.above.push(Moments::ZERO);
    }

    #[inline(never)]
    fn fill_below(&mut self, lo: usize) {
        let block = (lo - self.base) / BLOCK;
        let first = self.base + block * BLOCK;
        self.low = first..(first + BLOCK).min(self.split);
        let mut sum = self.beyond[block];
        self.below.resize(self.low.len(), sum);
        for (i, run) in self.low.clone().zip(&mut self.below).rev() {
            self.items.add(i, self.frame, &mut sum);
            *run = sum;
        }
    }

    #[inline(never)]
    fn fill_above(&mut self) {
        let first = self.high.end - 1;
        let end = (first + BLOCK).min(self.items.len());
        let mut sum = self.above[self.above.len() - 1];
        self.above.resize(end - first + 1, sum);
        self.above[0] = sum;
        for (i, run) in (first..end).zip(&mut self.above[1..]) {
            self.items.add(i, self.frame, &mut sum);
            *run = sum;
        }
        self.high = first..end + 1;
    }
}

/// Runs on both sides of a split.
pub struct View<'a, const N: usize> {
    pub frame: Frame,
    below: &'a [Moments<N>],
    low: usize,
    above: &'a [Moments<N>],
    high: usize,
}

impl<const N: usize> View<'_, N> {
    /// The moments over the items lo..hi; nothing where that is out of sight.
    #[inline(always)]
    pub fn window(&self, lo: usize, hi: usize) -> Option<Moments<N>> {
        Some(self.below.get(lo - self.low)?.plus(self.above.get(hi - self.high)?))
    }
}

/// The first index from `start` on at which `holds` is false; true values come first.
#[inline(always)]
pub fn first_beyond(x: &[f64], start: usize, holds: impl Fn(f64) -> bool) -> usize {
    let mut i = start;
    // Four at a time without a branch that could be mispredicted: mostly one step is enough.
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

/// Steps of four before the search for a far index begins.
const FOURS: usize = 4;

/// The same for an index that may be far: doubles its step, then bisects.
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
