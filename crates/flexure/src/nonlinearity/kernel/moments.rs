//! Moments of points about an anchor, and groups of neighbouring points by their moments.
//!
//! For a polynomial kernel the sum over a window is a combination of the moments sum w u^k and sum w y u^k,
//! u = (x - c)/h. Moments are only ever added, never subtracted. So no digit is lost to an offset, to clusters, to ties
//! or to heavy tails: |u| never exceeds 2.

use super::{Sorted, Sums};
use crate::parallel;

/// sum w u^k and sum w y u^k for k < N, in pairs.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub struct Moments<const N: usize>(pub [[f64; 2]; N]);

impl<const N: usize> Moments<N> {
    pub const ZERO: Self = Moments([[0.0; 2]; N]);

    /// Adds a point at u with the weight `w` and the weighted ordinate `wy`.
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
    fn scaled(mut self, r: f64) -> Self {
        let mut power = r;
        for k in 1..N {
            self.0[k] = self.0[k].map(|m| power * m);
            power *= r;
        }
        self
    }

    /// The moments of u + d, by Pascal's triangle.
    #[inline(always)]
    fn shifted(mut self, d: f64) -> Self {
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

/// A kernel as a polynomial: its coefficients of the powers of u, for a point at the coordinate t.
pub trait Coefficients<const M: usize>: Copy + Sync {
    /// The coefficients.
    fn at(self, t: f64) -> [f64; M];

    /// The sums of K and of K y from the sums of the powers of u.
    #[inline(always)]
    fn combined(self, t: f64, moments: &[[f64; 2]]) -> [f64; 2] {
        let terms = self.at(t).into_iter().zip(moments);
        terms.fold([0.0; 2], |[s, t], (c, moment)| [s + c * moment[0], t + c * moment[1]])
    }
}

impl<const M: usize, F: Fn(f64) -> [f64; M] + Copy + Sync> Coefficients<M> for F {
    #[inline(always)]
    fn at(self, t: f64) -> [f64; M] {
        self(t)
    }
}

impl Sums {
    /// The sums at the coordinate `t` from the window's moments.
    #[inline(always)]
    pub fn combined<const M: usize, const N: usize>(
        Moments(moments): &Moments<N>,
        t: f64,
        coefficients: impl Coefficients<M>,
    ) -> Self {
        let c = coefficients.at(t);
        let mut sums = Sums {
            mass: [moments[0][0], 0.0],
            at: t,
            ..Sums::NONE
        };
        for k in 0..M {
            sums.s[0] += c[k] * moments[k][0];
            sums.t[0] += c[k] * moments[k][1];
        }
        if N > M {
            sums.mass[1] = moments[2][0];
            for k in 0..M {
                sums.s[1] += c[k] * moments[k + 1][0];
                sums.s[2] += c[k] * moments[k + 2][0];
                sums.t[1] += c[k] * moments[k + 1][1];
            }
        }
        sums
    }
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

/// Points of a group.
pub const GROUP: usize = 32;
/// Groups that one thread makes at a time. For fewer, another thread does not pay.
const PART: usize = 1024;

/// The moments of GROUP neighbouring points about their middle, in units of their half width.
struct Group<const N: usize> {
    middle: f64,
    half_width: f64,
    moments: Moments<N>,
}

/// All points in groups. They serve every bandwidth.
pub struct Groups<const N: usize>(Vec<Group<N>>);

impl<const N: usize> Groups<N> {
    pub fn new(data: &Sorted) -> Self {
        let group = |k: usize| {
            let range = k * GROUP..data.len().min((k + 1) * GROUP);
            let (first, last) = (data.x[range.start], data.x[range.end - 1]);
            let half_width = 0.5 * (last - first);
            let frame = Frame {
                anchor: first + half_width,
                // Points at one abscissa have the offset zero in any unit.
                per_h: if half_width > 0.0 { 1.0 / half_width } else { 1.0 },
            };
            let mut moments = Moments::ZERO;
            data.for_each(range, |x, w, wy| moments.push(frame.u(x), w, wy));
            Group {
                middle: frame.anchor,
                half_width,
                moments,
            }
        };
        let count = data.len().div_ceil(GROUP);
        let part = |k: usize| -> Vec<Group<N>> { (k * PART..count.min((k + 1) * PART)).map(group).collect() };
        Groups(
            parallel::map(count.div_ceil(PART), part)
                .into_iter()
                .flatten()
                .collect(),
        )
    }

    /// Adds group `i` to `sum`.
    #[inline(always)]
    fn add(&self, i: usize, frame: Frame, sum: &mut Moments<N>) {
        let group = &self.0[i];
        let moments = group.moments.scaled(group.half_width * frame.per_h);
        *sum = sum.plus(&moments.shifted(frame.u(group.middle)));
    }
}

/// The sum over a window of groups that moves upward.
///
/// ```text
///    lo          split        hi
/// ----[------------|-----------)----
///      `below[lo]`   `above`
/// ```
///
/// The window is cut at a split. `below` holds the sums of the groups from each one up to the split, `above` that from the
/// split to the end of the window. When the window leaves the split behind, a new split is made at its upper end, and the
/// anchor is moved there. Every group is thus added twice.
pub struct SlidingSum<'a, const N: usize> {
    groups: &'a Groups<N>,
    pub frame: Frame,
    /// The first group above the split.
    split: usize,
    /// The group at which the first sum of `below` begins.
    first: usize,
    below: Vec<Moments<N>>,
    above: Moments<N>,
    /// The groups from the split up to this one are in `above`.
    end: usize,
}

impl<'a, const N: usize> SlidingSum<'a, N> {
    pub fn new(groups: &'a Groups<N>, h: f64) -> Self {
        SlidingSum {
            groups,
            frame: Frame {
                anchor: 0.0,
                per_h: 1.0 / h,
            },
            split: 0,
            first: 0,
            below: Vec::new(),
            above: Moments::ZERO,
            end: 0,
        }
    }

    /// The moments over the groups lo..hi, lo < hi, in the present frame. Neither end may be less than in an earlier call.
    #[inline(never)]
    pub fn over(&mut self, lo: usize, hi: usize) -> Moments<N> {
        if lo >= self.split {
            self.frame.anchor = self.groups.0[hi - 1].middle;
            self.below.clear();
            self.below.resize(hi - lo, Moments::ZERO);
            let mut sum = Moments::ZERO;
            for (below, group) in self.below.iter_mut().zip(lo..hi).rev() {
                self.groups.add(group, self.frame, &mut sum);
                *below = sum;
            }
            (self.first, self.split, self.end) = (lo, hi, hi);
            self.above = Moments::ZERO;
        }
        for group in self.end..hi {
            self.groups.add(group, self.frame, &mut self.above);
        }
        self.end = self.end.max(hi);
        self.below[lo - self.first].plus(&self.above)
    }
}
