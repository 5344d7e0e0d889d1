//! Sums over a sliding window by moments that are only ever added, never subtracted.
//!
//! For a polynomial kernel the sum over the window is a combination of the moments
//! sum u^k and sum y u^k, u = (x - c)/h. As the window slides it is cut at a split: the moments of every
//! run of points that ends at the split are stored, and those of every run that starts there, so that
//! each window that holds the split is one of the former and one of the latter. When the window leaves
//! the split behind, a new one is made at its upper end, and the anchor c with it. Every point is so added
//! at most twice, and as nothing is subtracted no digit is lost to an offset, to clusters, to ties or to
//! heavy tails: |u| never exceeds 2.

use std::ops::Range;

use super::{Sorted, Sums};

/// sum u^k and sum y u^k for k < M.
#[derive(Clone, Copy)]
struct Moments<const M: usize> {
    weight: [f64; M],
    moment: [f64; M],
}

impl<const M: usize> Moments<M> {
    const ZERO: Self = Moments {
        weight: [0.0; M],
        moment: [0.0; M],
    };

    #[inline(always)]
    fn add(&mut self, u: f64, y: f64) {
        let mut power = 1.0;
        for k in 0..M {
            self.weight[k] += power;
            self.moment[k] += y * power;
            power *= u;
        }
    }
}

/// The moments on both sides of a split.
struct Split<const M: usize> {
    per_h: f64,
    anchor: f64,
    /// The split is just above this point; `below` starts at point `base`.
    at: usize,
    base: usize,
    /// Moments of the points i..at, for each i from `base`.
    below: Vec<Moments<M>>,
    /// Moments of the points at..i, for each i from `at`.
    above: Vec<Moments<M>>,
}

impl<const M: usize> Split<M> {
    fn new(h: f64) -> Self {
        Split {
            per_h: 1.0 / h,
            anchor: 0.0,
            at: 0,
            base: 0,
            below: Vec::new(),
            above: Vec::new(),
        }
    }

    /// A new split at the end of the points `window`, for windows that end at `end` or before.
    fn make(&mut self, data: &Sorted, window: Range<usize>, end: usize) {
        (self.base, self.at) = (window.start, window.end);
        self.anchor = data.x[self.at - 1];
        let mut sum = Moments::ZERO;
        self.below.clear();
        self.below.resize(window.len(), sum);
        let points = data.x[window.clone()].iter().zip(&data.y[window]);
        for ((x, y), run) in points.zip(&mut self.below).rev() {
            sum.add((x - self.anchor) * self.per_h, *y);
            *run = sum;
        }
        sum = Moments::ZERO;
        self.above.clear();
        self.above.push(sum);
        for (x, y) in data.x[self.at..end].iter().zip(&data.y[self.at..end]) {
            sum.add((x - self.anchor) * self.per_h, *y);
            self.above.push(sum);
        }
    }

    /// The sums at `q` over the points lo..hi for the kernel whose coefficients of u^k are
    /// `coefficients(t)`, t = (q - c)/h.
    #[inline(always)]
    fn sums(&self, q: f64, lo: usize, hi: usize, coefficients: impl Fn(f64) -> [f64; M]) -> (f64, f64) {
        let (below, above) = (&self.below[lo - self.base], &self.above[hi - self.at]);
        let c = coefficients((q - self.anchor) * self.per_h);
        let (mut weight, mut moment) = (0.0, 0.0);
        for k in 0..M {
            weight += c[k] * (below.weight[k] + above.weight[k]);
            moment += c[k] * (below.moment[k] + above.moment[k]);
        }
        (weight, moment)
    }
}

/// The first index from `start` on at which `holds` is false; true values come first.
#[inline(always)]
fn first_beyond(x: &[f64], start: usize, holds: impl Fn(f64) -> bool) -> usize {
    let mut i = start;
    // Four at a time without a branch that could be mispredicted: mostly one step is enough.
    while let Some(four) = x.get(i..i + 4) {
        let count: usize = four.iter().map(|&v| usize::from(holds(v))).sum();
        i += count;
        if count < 4 {
            return i;
        }
    }
    while i < x.len() && holds(x[i]) {
        i += 1;
    }
    i
}

/// Like [`first_beyond`], for an index that may be far: doubles its step, then bisects.
fn far_beyond(x: &[f64], start: usize, holds: impl Fn(f64) -> bool) -> usize {
    let (mut known, mut step) = (start, 1);
    while x.get(known + step - 1).is_some_and(|&v| holds(v)) {
        known += step;
        step *= 2;
    }
    let end = (known + step).min(x.len());
    known + x[known..end].partition_point(|&v| holds(v))
}

/// Sums of a kernel that is one polynomial on [-1, 1].
#[inline(always)]
pub fn whole<const M: usize>(
    data: &Sorted,
    h: f64,
    at: &[f64],
    coefficients: impl Fn(f64) -> [f64; M],
    visit: impl FnMut(usize, Sums),
) {
    slide(
        data,
        at,
        |q, x| q - x > h,
        |q, x| x - q <= h,
        Split::new(h),
        coefficients,
        visit,
    );
}

/// Sums of the triangular kernel: 1 - t + u up to the point, 1 + t - u beyond it.
pub fn halves(data: &Sorted, h: f64, at: &[f64], mut visit: impl FnMut(usize, Sums)) {
    let mut left = vec![(0.0, 0.0, 0); at.len()];
    let keep = |j: usize, sums: Sums| left[j] = (sums.weight, sums.moment, sums.count);
    slide(
        data,
        at,
        |q, x| q - x > h,
        |q, x| x <= q,
        Split::new(h),
        |t| [1.0 - t, 1.0],
        keep,
    );
    let join = |j: usize, sums: Sums| {
        let (weight, moment, count) = left[j];
        visit(
            j,
            Sums {
                weight: weight + sums.weight,
                moment: moment + sums.moment,
                count: count + sums.count,
            },
        );
    };
    slide(
        data,
        at,
        |q, x| x <= q,
        |q, x| x - q <= h,
        Split::new(h),
        |t| [1.0 + t, -1.0],
        join,
    );
}

/// Slides a window over the points: for each `q` of `at` it holds those that are not `below(q, x)` and
/// that are `reached(q, x)`.
#[inline(always)]
fn slide<const M: usize>(
    data: &Sorted,
    at: &[f64],
    below: impl Fn(f64, f64) -> bool,
    reached: impl Fn(f64, f64) -> bool,
    mut split: Split<M>,
    coefficients: impl Fn(f64) -> [f64; M],
    mut visit: impl FnMut(usize, Sums),
) {
    let x = &data.x[..];
    let (mut lo, mut hi, mut j) = (0, 0, 0);
    while j < at.len() {
        let q = at[j];
        lo = far_beyond(x, lo, |x| below(q, x));
        hi = far_beyond(x, hi.max(lo), |x| reached(q, x));
        if lo == hi {
            let none = Sums {
                weight: 0.0,
                moment: 0.0,
                count: 0,
            };
            visit(j, none);
            j += 1;
            continue;
        }
        // All windows that still hold the last point of this one share a split just above it.
        let last = x[hi - 1];
        let end = far_beyond(at, j, |q| !below(q, last)).max(j + 1);
        let highest = far_beyond(x, hi, |x| reached(at[end - 1], x));
        split.make(data, lo..hi, highest);
        for (j, &q) in at.iter().enumerate().take(end).skip(j) {
            lo = first_beyond(x, lo, |x| below(q, x));
            hi = first_beyond(x, hi, |x| reached(q, x));
            let (weight, moment) = split.sums(q, lo, hi, &coefficients);
            let count = hi - lo;
            visit(j, Sums { weight, moment, count });
        }
        j = end;
    }
}

/// 1 - (t - u)^2 in powers of u.
#[inline(always)]
pub fn parabola(t: f64) -> [f64; 3] {
    [(1.0 - t) * (1.0 + t), 2.0 * t, -1.0]
}

/// (1 - (t - u)^2)^2 in powers of u.
#[inline(always)]
pub fn parabola_squared(t: f64) -> [f64; 5] {
    product(parabola(t), parabola(t))
}

/// (1 - (t - u)^2)^3 in powers of u.
#[inline(always)]
pub fn parabola_cubed(t: f64) -> [f64; 7] {
    product(parabola_squared(t), parabola(t))
}

#[inline(always)]
fn product<const A: usize, const B: usize, const C: usize>(p: [f64; A], q: [f64; B]) -> [f64; C] {
    let mut r = [0.0; C];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            r[i + j] += a * b;
        }
    }
    r
}
