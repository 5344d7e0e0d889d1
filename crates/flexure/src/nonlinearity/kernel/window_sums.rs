//! Moments over a window that slides over sorted points.
//!
//! For a polynomial kernel the sum over a window is a combination of the moments sum w u^k and sum w y u^k,
//! u = (x - c)/h. Moments are only ever added, never subtracted. So no digit is lost to an offset, to clusters, to ties
//! or to heavy tails: |u| never exceeds 2.
//!
//! ```text
//!    start         split        end
//! ----[--------------|-----------)----
//!      `below`          `above`
//! ```
//!
//! The window is cut at a split. `below` holds the moments of the points from each one up to the split, `above` those from the
//! split to the end of the window. When the window leaves the split behind, a new split is made at its upper end, and the
//! anchor c is moved there. Every point is thus added twice, whatever the bandwidth.

use super::Sorted;

/// sum w u^k and sum w y u^k for k < N, in pairs.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub struct Moments<const N: usize>(pub [[f64; 2]; N]);

impl<const N: usize> Moments<N> {
    const ZERO: Self = Moments([[0.0; 2]; N]);

    /// Adds a point at u of weight `w` and of weighted ordinate `wy`.
    #[inline(always)]
    fn push(&mut self, u: f64, w: f64, wy: f64) {
        let mut power = [w, wy];
        for k in 0..N {
            self.0[k][0] += power[0];
            self.0[k][1] += power[1];
            power = [power[0] * u, power[1] * u];
        }
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        for k in 0..N {
            sum.0[k][0] += other.0[k][0];
            sum.0[k][1] += other.0[k][1];
        }
        sum
    }
}

/// A window that moves upward over sorted points.
pub struct WindowSums<'a, const N: usize> {
    data: &'a Sorted,
    per_h: f64,
    anchor: f64,
    /// The last window.
    start: usize,
    end: usize,
    /// The first point above the split.
    split: usize,
    /// Entry k: the last k points below the split.
    below: Vec<Moments<N>>,
    above: Moments<N>,
    /// The points from the split up to this one are in `above`.
    added: usize,
}

impl<'a, const N: usize> WindowSums<'a, N> {
    pub fn new(data: &'a Sorted, h: f64) -> Self {
        WindowSums {
            data,
            per_h: 1.0 / h,
            anchor: 0.0,
            start: 0,
            end: 0,
            split: 0,
            below: Vec::new(),
            above: Moments::ZERO,
            added: 0,
        }
    }

    /// The moments over the window that begins after the last x for which `below` is true and ends with the last for which
    /// `within` is; nothing if it is empty. Neither end may be less than in any call before.
    #[inline(always)]
    pub fn over(&mut self, below: impl Fn(f64) -> bool, within: impl Fn(f64) -> bool) -> Option<Moments<N>> {
        let x = &self.data.x[..];
        self.start = first_beyond(x, self.start, below);
        self.end = first_beyond(x, self.end.max(self.start), within);
        if self.start == self.end {
            return None;
        }
        if self.start >= self.split {
            self.cut();
        }
        let mut above = self.above;
        self.data
            .for_each(self.added..self.end, |x, w, wy| above.push(self.coordinate(x), w, wy));
        (self.above, self.added) = (above, self.end);
        Some(self.below[self.split - self.start].plus(&self.above))
    }

    /// The coordinate u of the last moments.
    #[inline(always)]
    pub fn coordinate(&self, x: f64) -> f64 {
        (x - self.anchor) * self.per_h
    }

    /// Makes a new split at the end of the window.
    #[inline(never)]
    fn cut(&mut self) {
        (self.split, self.added) = (self.end, self.end);
        self.anchor = self.data.x[self.end - 1];
        self.above = Moments::ZERO;
        let (anchor, per_h, data) = (self.anchor, self.per_h, self.data);
        let mut sum = Moments::ZERO;
        let sums = (self.start..self.end).rev().map(|i| {
            let w = data.weight(i);
            sum.push((data.x[i] - anchor) * per_h, w, w * data.y[i]);
            sum
        });
        self.below.clear();
        self.below.push(Moments::ZERO);
        self.below.extend(sums);
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
    // The index may be far: the step is doubled, then the last interval bisected.
    let mut step = 1;
    while x.get(i + step - 1).is_some_and(|&v| holds(v)) {
        i += step;
        step *= 2;
    }
    let end = (i + step).min(x.len());
    i + x[i..end].partition_point(|&v| holds(v))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Beside sums point by point, about the same anchor.
    #[test]
    fn windows_hold_the_moments_of_their_points() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for n in [1, 2, 7, 100, 2000] {
            let mut draw = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..n).map(|_| f(rng.random())).collect() };
            let w = draw(&|u| 0.5 + u);
            let y = draw(&|u| u - 0.5);
            let lines = [
                draw(&|u| u),
                draw(&|u| 1e6 + u),
                draw(&|u| (std::f64::consts::PI * (u - 0.5)).tan()),
                draw(&|u| (6.0 * u).floor() / 6.0),
                draw(&|u| (4.0 * u).floor() + 1e-9 * u),
                draw(&|_| 2.0),
            ];
            for x in &lines {
                let data = Sorted::new(x, &y, Some(&w));
                for h in [1e-300, 1e-10, 1e-3, 1.0 / 6.0, 0.3, 0.9, 2.0, 1e9] {
                    let mut windows = WindowSums::<4>::new(&data, h);
                    for &q in &data.x {
                        let got = windows.over(|x| q - x > h, |x| x - q <= h).unwrap();
                        let (mut want, mut size) = (Moments::<4>::ZERO, Moments::<4>::ZERO);
                        for i in data.within(q, h) {
                            let (u, w) = (windows.coordinate(data.x[i]), data.weight(i));
                            assert!(u.abs() <= 2.0 + 1e-9, "{u}");
                            want.push(u, w, w * data.y[i]);
                            size.push(u.abs(), w, w * data.y[i].abs());
                        }
                        for k in 0..4 {
                            for side in 0..2 {
                                let error = (got.0[k][side] - want.0[k][side]).abs();
                                assert!(error <= 1e-13 * size.0[k][side], "n={n} h={h} q={q} k={k}");
                            }
                        }
                    }
                }
            }
        }
    }
}
