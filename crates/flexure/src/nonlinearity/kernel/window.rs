//! Sums over a sliding window by moments that are only ever added, never subtracted.
//!
//! For a polynomial kernel the sum over the window is a combination of the moments
//! sum u^k and sum y u^k, u = (x - c)/h. The window [lo, hi) is kept as two stacks that meet at a
//! split: moments of every suffix of the points below the split are stored, those above it are
//! accumulated. When the lower stack is used up, the split moves to the upper end and the anchor c with
//! it. Every point is so added twice, and as nothing is subtracted no digit is lost to an offset, to
//! clusters, to ties or to heavy tails: |u| never exceeds 2.

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

/// The two stacks.
struct Window<'a, const M: usize> {
    data: &'a Sorted,
    per_h: f64,
    anchor: f64,
    split: usize,
    /// The index that `suffixes[0]` starts at.
    base: usize,
    suffixes: Vec<Moments<M>>,
    end: usize,
    above: Moments<M>,
}

impl<'a, const M: usize> Window<'a, M> {
    fn new(data: &'a Sorted, h: f64) -> Self {
        Window {
            data,
            per_h: 1.0 / h,
            anchor: 0.0,
            split: 0,
            base: 0,
            suffixes: Vec::new(),
            end: 0,
            above: Moments::ZERO,
        }
    }

    /// Moves to the points `lo..hi`, neither of which may decrease from call to call.
    #[inline(always)]
    fn advance(&mut self, lo: usize, hi: usize) {
        if lo >= self.split {
            self.rebuild(lo, hi);
        } else {
            for i in self.end..hi {
                self.above
                    .add((self.data.x[i] - self.anchor) * self.per_h, self.data.y[i]);
            }
        }
        self.end = hi;
    }

    fn rebuild(&mut self, lo: usize, hi: usize) {
        self.split = hi;
        self.base = lo;
        self.above = Moments::ZERO;
        self.suffixes.clear();
        if lo >= hi {
            return;
        }
        self.anchor = self.data.x[hi - 1];
        self.suffixes.resize(hi - lo, Moments::ZERO);
        let mut sum = Moments::ZERO;
        let points = self.data.x[lo..hi].iter().zip(&self.data.y[lo..hi]);
        for ((x, y), suffix) in points.zip(&mut self.suffixes).rev() {
            sum.add((x - self.anchor) * self.per_h, *y);
            *suffix = sum;
        }
    }

    /// The sums at `q` for the kernel whose coefficients of u^k are `coefficients(t)`, t = (q - c)/h.
    #[inline(always)]
    fn sums(&self, q: f64, lo: usize, coefficients: impl Fn(f64) -> [f64; M]) -> (f64, f64) {
        let Some(below) = self.suffixes.get(lo - self.base) else {
            return (0.0, 0.0);
        };
        let c = coefficients((q - self.anchor) * self.per_h);
        let (mut weight, mut moment) = (0.0, 0.0);
        for k in 0..M {
            weight += c[k] * (below.weight[k] + self.above.weight[k]);
            moment += c[k] * (below.moment[k] + self.above.moment[k]);
        }
        (weight, moment)
    }
}

/// Sums of a kernel that is one polynomial on [-1, 1].
#[inline(always)]
pub fn whole<const M: usize>(
    data: &Sorted,
    h: f64,
    at: &[f64],
    coefficients: impl Fn(f64) -> [f64; M],
    mut visit: impl FnMut(usize, Sums),
) {
    let mut window = Window::<M>::new(data, h);
    let x = &data.x;
    let (mut lo, mut hi) = (0, 0);
    for (j, &q) in at.iter().enumerate() {
        while hi < x.len() && x[hi] - q <= h {
            hi += 1;
        }
        while lo < hi && q - x[lo] > h {
            lo += 1;
        }
        window.advance(lo, hi);
        let (weight, moment) = window.sums(q, lo, &coefficients);
        visit(
            j,
            Sums {
                weight,
                moment,
                count: hi - lo,
            },
        );
    }
}

/// Sums of the triangular kernel: 1 - t + u up to the point, 1 + t - u beyond it.
pub fn halves(data: &Sorted, h: f64, at: &[f64], mut visit: impl FnMut(usize, Sums)) {
    let mut left = Window::<2>::new(data, h);
    let mut right = Window::<2>::new(data, h);
    let x = &data.x;
    let (mut lo, mut middle, mut hi) = (0, 0, 0);
    for (j, &q) in at.iter().enumerate() {
        while hi < x.len() && x[hi] - q <= h {
            hi += 1;
        }
        while middle < hi && x[middle] <= q {
            middle += 1;
        }
        while lo < middle && q - x[lo] > h {
            lo += 1;
        }
        left.advance(lo, middle);
        right.advance(middle, hi);
        let below = left.sums(q, lo, |t| [1.0 - t, 1.0]);
        let above = right.sums(q, middle, |t| [1.0 + t, -1.0]);
        visit(
            j,
            Sums {
                weight: below.0 + above.0,
                moment: below.1 + above.1,
                count: hi - lo,
            },
        );
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
