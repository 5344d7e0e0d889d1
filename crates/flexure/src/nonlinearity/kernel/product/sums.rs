//! Kernel sums at a point in several dimensions, and the fit that they make.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};

use super::super::{Degree, Kernel};
use super::profile;
use crate::wide::widest;

/// The sum of squares of a coordinate about its mean, without the part along the coordinates before it, has lost too many digits if it is
/// below this share of the sum about the window's centre.
const RELIABLE: f64 = 1e-3;

/// Points column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    pub x: Vec<Vec<f64>>,
    /// Centred ordinates.
    pub y: Vec<f64>,
    /// Empty where all weights are 1.
    pub w: Vec<f64>,
}

impl Columns {
    #[inline(always)]
    pub fn weight(&self, i: usize) -> f64 {
        if self.w.is_empty() { 1.0 } else { self.w[i] }
    }
}

/// A window: its centre and its bandwidths.
#[derive(Clone, Copy)]
pub struct Window<const D: usize> {
    pub at: [f64; D],
    pub h: [f64; D],
    pub per_h: [f64; D],
}

/// sum w K, sum w K u_j, sum w K u_j u_k (`s2[j][k]`, j <= k), and the first two multiplied by the centred ordinates, with u = (X - at)/h
/// of the [`Window`]. Each is kept as L partial sums over every L-th point. For the local constant fit the sums with u are zero.
#[derive(Clone, Copy)]
pub struct Sums<const D: usize, const L: usize> {
    pub s0: [f64; L],
    pub s1: [[f64; L]; D],
    pub s2: [[[f64; L]; D]; D],
    pub t0: [f64; L],
    pub t1: [[f64; L]; D],
}

impl<const D: usize, const L: usize> Sums<D, L> {
    pub const ZERO: Self = Sums {
        s0: [0.0; L],
        s1: [[0.0; L]; D],
        s2: [[[0.0; L]; D]; D],
        t0: [0.0; L],
        t1: [[0.0; L]; D],
    };

    /// Adds one point for each lane, with the weights `k`.
    #[inline(always)]
    fn add<const LINEAR: bool>(&mut self, k: &[f64; L], u: [&[f64; L]; D], y: &[f64; L]) {
        for l in 0..L {
            self.s0[l] += k[l];
            self.t0[l] += k[l] * y[l];
        }
        if LINEAR {
            for j in 0..D {
                let ku: [f64; L] = std::array::from_fn(|l| k[l] * u[j][l]);
                for l in 0..L {
                    self.s1[j][l] += ku[l];
                    self.t1[j][l] += ku[l] * y[l];
                }
                for i in 0..=j {
                    for l in 0..L {
                        self.s2[i][j][l] += ku[l] * u[i][l];
                    }
                }
            }
        }
    }

    /// The sums of all lanes.
    #[inline(always)]
    fn folded(&self) -> Sums<D, 1> {
        let fold = |lanes: &[f64; L]| [lanes.iter().sum::<f64>()];
        Sums {
            s0: fold(&self.s0),
            s1: std::array::from_fn(|j| fold(&self.s1[j])),
            s2: std::array::from_fn(|i| std::array::from_fn(|j| fold(&self.s2[i][j]))),
            t0: fold(&self.t0),
            t1: std::array::from_fn(|j| fold(&self.t1[j])),
        }
    }
}

/// Points whose weights are found together.
const BLOCK: usize = 64;
/// The room of a block. A part is filled in whole registers and may end up to one register behind the block.
const CAPACITY: usize = BLOCK + REGISTER;
/// Points that the local constant adds at a time.
const REGISTER: usize = 8;
/// Points that the local plane, with its many sums, adds at a time.
const PLANE_REGISTER: usize = 4;

/// The sums over the runs of points, a block at a time: first the weights of its points, then the sums over them.
///
/// ```text
/// runs:    [-----)   [---------)  [---)      of points in order of their cells
/// blocks:  |..........|..........|...0|      of BLOCK points, the last one filled up with weights of zero
/// ```
#[inline(always)]
fn over_runs<const D: usize, const L: usize, const LINEAR: bool>(
    kernel: Kernel,
    points: &Columns,
    runs: &[Range<usize>],
    window: &Window<D>,
) -> Sums<D, 1> {
    let n = points.y.len();
    let mut sums = Sums::<D, L>::ZERO;
    let mut k = [0.0; CAPACITY];
    let mut y = [0.0; CAPACITY];
    let mut u = [[0.0; CAPACITY]; D];
    let mut filled = 0;
    for run in runs {
        let mut first = run.start;
        while first < run.end {
            let count = (run.end - first).min(BLOCK - filled);
            // Whole registers are filled, so the last one may hold points behind the run. `filled` does not count them: the next part
            // overwrites them, or they get the weight zero below.
            let part = first..(first + count.next_multiple_of(REGISTER)).min(n);
            let to = filled..filled + part.len();
            first += count;
            filled += count;
            let x: [&[f64]; D] = std::array::from_fn(|j| &points.x[j][part.clone()]);
            weigh(kernel, window, x, &mut k[to.clone()]);
            if !points.w.is_empty() {
                times(&mut k[to.clone()], &points.w[part.clone()]);
            }
            y[to.clone()].copy_from_slice(&points.y[part]);
            if LINEAR {
                for j in 0..D {
                    scaled(&mut u[j][to.clone()], x[j], window.at[j], window.per_h[j]);
                }
            }
            if filled == BLOCK {
                add_block::<D, L, LINEAR>(&mut sums, &k, &u, &y, BLOCK / L);
                filled = 0;
            }
        }
    }
    let rest = filled..filled.next_multiple_of(L);
    k[rest.clone()].fill(0.0);
    if LINEAR {
        // A point may be too far away for a finite coordinate, and zero times infinity is no number.
        u.iter_mut().for_each(|u| u[rest.clone()].fill(0.0));
    }
    add_block::<D, L, LINEAR>(&mut sums, &k, &u, &y, rest.end / L);
    sums.folded()
}

/// The sums of the local constant with the Epanechnikov kernel over the runs of points, without blocks. Searches for
/// bandwidths in several columns spend most of their time here, and take 0.5 to 0.85 of the time with blocks.
#[inline(always)]
fn over_runs_of_parabolas<S: Simd, const D: usize>(
    simd: S,
    points: &Columns,
    runs: &[Range<usize>],
    window: &Window<D>,
) -> Sums<D, 1> {
    let none = f64x8::splat(simd, 0.0);
    let lanes = f64x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let (mut s, mut t) = (none, none);
    for run in runs.iter().filter(|run| !run.is_empty()) {
        // One to eight points remain for the last register.
        let eights = (run.len() - 1) / REGISTER;
        let last = run.start + eights * REGISTER;
        let x: [_; D] = std::array::from_fn(|j| &points.x[j][run.start..last].as_chunks::<REGISTER>().0[..eights]);
        let y = &points.y[run.start..last].as_chunks::<REGISTER>().0[..eights];
        for c in 0..eights {
            let mut k = parabolas(simd, std::array::from_fn(|j| &x[j][c][..]), window);
            if !points.w.is_empty() {
                k *= f64x8::from_slice(simd, &points.w[run.start + c * REGISTER..][..REGISTER]);
            }
            s += k;
            t += k * f64x8::from_slice(simd, &y[c]);
        }
        // The last points of the run, in a register with points that may belong to other runs. At the data's end the register starts
        // earlier. Only lanes from `from` to before `end` count: those before are added already.
        let first = last.min(points.y.len() - REGISTER);
        let eight = first..first + REGISTER;
        let mut k = parabolas(simd, std::array::from_fn(|j| &points.x[j][eight.clone()]), window);
        if !points.w.is_empty() {
            k *= f64x8::from_slice(simd, &points.w[eight.clone()]);
        }
        let from = f64x8::splat(simd, (last - first) as f64);
        let end = f64x8::splat(simd, (run.end - first) as f64);
        k = lanes.simd_lt(end).select(lanes.simd_lt(from).select(none, k), none);
        s += k;
        t += k * f64x8::from_slice(simd, &points.y[eight]);
    }
    Sums {
        s0: [s.as_array().iter().sum()],
        t0: [t.as_array().iter().sum()],
        ..Sums::ZERO
    }
}

/// The weights of points with these coordinates.
#[inline(always)]
fn parabolas<S: Simd, const D: usize>(simd: S, x: [&[f64]; D], window: &Window<D>) -> f64x8<S> {
    let mut k = f64x8::splat(simd, 1.0);
    for j in 0..D {
        let u = (f64x8::from_slice(simd, x[j]) - window.at[j]) * window.per_h[j];
        k *= (1.0 - u * u).max_precise(f64x8::splat(simd, 0.0));
    }
    k
}

/// Adds the points of this many chunks of a block.
#[inline(always)]
fn add_block<const D: usize, const L: usize, const LINEAR: bool>(
    sums: &mut Sums<D, L>,
    k: &[f64; CAPACITY],
    u: &[[f64; CAPACITY]; D],
    y: &[f64; CAPACITY],
    chunks: usize,
) {
    let chunks_of = |values| -> &[[f64; L]] { <[f64]>::as_chunks(values).0 };
    let (k, y) = (chunks_of(&k[..]), chunks_of(&y[..]));
    let u: [_; D] = std::array::from_fn(|j| chunks_of(&u[j][..]));
    let mut local = *sums;
    for c in 0..chunks.min(BLOCK / L) {
        local.add::<LINEAR>(&k[c], std::array::from_fn(|j| &u[j][c]), &y[c]);
    }
    *sums = local;
}

/// The products of the kernels.
///
/// The Epanechnikov kernel in two and three dimensions has one zipped loop. A loop that checks an index might end early, and
/// its last turns would not be vectorised.
#[inline(always)]
fn weigh<const D: usize>(kernel: Kernel, window: &Window<D>, x: [&[f64]; D], k: &mut [f64]) {
    let parabola = |j: usize, x: f64| {
        let u = (x - window.at[j]) * window.per_h[j];
        profile::positive(1.0 - u * u)
    };
    match (kernel, &x[..]) {
        (Kernel::Epanechnikov, [a, b]) => {
            for (k, (a, b)) in k.iter_mut().zip(a.iter().zip(*b)) {
                *k = parabola(0, *a) * parabola(1, *b);
            }
        }
        (Kernel::Epanechnikov, [a, b, c]) => {
            for (k, ((a, b), c)) in k.iter_mut().zip(a.iter().zip(*b).zip(*c)) {
                *k = parabola(0, *a) * parabola(1, *b) * parabola(2, *c);
            }
        }
        _ => {
            profile::start(kernel, k);
            for j in 0..D {
                profile::factor(kernel, x[j], window.at[j], window.h[j], k);
            }
            profile::finish(kernel, k);
        }
    }
}

/// Multiplies the kernel by the points' weights.
#[inline(always)]
fn times(k: &mut [f64], w: &[f64]) {
    k.iter_mut().zip(w).for_each(|(k, w)| *k *= w);
}

/// u = (x - at)/h.
#[inline(always)]
fn scaled(u: &mut [f64], x: &[f64], at: f64, per_h: f64) {
    u.iter_mut().zip(x).for_each(|(u, x)| *u = (x - at) * per_h);
}

/// The fit at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local<const D: usize> {
    /// The estimate minus the ordinates' mean.
    pub value: f64,
    /// The share that an observation of weight 1 at this point would have in the estimate.
    pub leverage: f64,
    /// The slopes per bandwidth; zeros of a local constant.
    pub slope: [f64; D],
}

/// The fit that follows from the sums.
pub enum Outcome<const D: usize> {
    /// No points are in reach.
    NoData,
    Fit(Local<D>),
    /// The sums have lost too many digits. The fit has to be found from the points one by one.
    Unreliable,
}

impl<const D: usize> Sums<D, 1> {
    /// The fit of this degree.
    #[inline(always)]
    pub fn fit(&self, degree: Degree) -> Outcome<D> {
        let s0 = self.s0[0];
        if !(s0 > 0.0) {
            return Outcome::NoData;
        }
        let mean = Local {
            value: self.t0[0] / s0,
            leverage: 1.0 / s0,
            slope: [0.0; D],
        };
        if degree == Degree::Constant {
            return Outcome::Fit(mean);
        }
        self.plane(mean)
    }

    /// The local plane, by Cholesky's decomposition of the sums about the points' mean.
    #[inline(always)]
    fn plane(&self, mean: Local<D>) -> Outcome<D> {
        let per_s0 = mean.leverage;
        let centre: [f64; D] = std::array::from_fn(|j| self.s1[j][0] * per_s0);
        // With the Cholesky factor, lower a = -centre, the way from the points' mean to the window's centre, and
        // lower b = t1 - t0 centre. Then a'b is the plane's rise along that way, and a'a is the amount that the plane adds to the leverage.
        let mut lower = [[0.0; D]; D];
        let (mut a, mut b) = ([0.0; D], [0.0; D]);
        for j in 0..D {
            for i in 0..=j {
                let mut sum = self.s2[i][j][0] - self.s1[i][0] * centre[j];
                for k in 0..i {
                    sum -= lower[j][k] * lower[i][k];
                }
                if i < j {
                    lower[j][i] = sum / lower[i][i];
                } else if sum > RELIABLE * self.s2[j][j][0] {
                    lower[j][j] = sum.sqrt();
                } else {
                    return Outcome::Unreliable;
                }
            }
            let (mut p, mut r) = (-centre[j], self.t1[j][0] - centre[j] * self.t0[0]);
            for k in 0..j {
                p -= lower[j][k] * a[k];
                r -= lower[j][k] * b[k];
            }
            a[j] = p / lower[j][j];
            b[j] = r / lower[j][j];
        }
        let mut slope = [0.0; D];
        for j in (0..D).rev() {
            let mut sum = b[j];
            for k in j + 1..D {
                sum -= lower[k][j] * slope[k];
            }
            slope[j] = sum / lower[j][j];
        }
        Outcome::Fit(Local {
            value: mean.value + (0..D).map(|j| a[j] * b[j]).sum::<f64>(),
            leverage: mean.leverage + a.iter().map(|a| a * a).sum::<f64>(),
            slope,
        })
    }
}

/// How the sums for one kernel and degree are made.
#[derive(Clone, Copy)]
pub struct SumsOver<const D: usize> {
    kernel: Kernel,
    degree: Degree,
}

impl<const D: usize> SumsOver<D> {
    /// The sums that a fit of this degree needs.
    pub fn new(kernel: Kernel, degree: Degree) -> Self {
        SumsOver { kernel, degree }
    }

    /// The sums over the runs of points.
    #[inline(never)]
    pub fn over(&self, points: &Columns, runs: &[Range<usize>], window: &Window<D>) -> Sums<D, 1> {
        match self.degree {
            Degree::Constant if self.kernel == Kernel::Epanechnikov && points.y.len() >= REGISTER => {
                dispatch!(Level::new(), simd => over_runs_of_parabolas(simd, points, runs, window))
            }
            Degree::Constant => widest(
                #[inline(always)]
                || over_runs::<D, REGISTER, false>(self.kernel, points, runs, window),
            ),
            Degree::Linear => widest(
                #[inline(always)]
                || over_runs::<D, PLANE_REGISTER, true>(self.kernel, points, runs, window),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with the general way for all kernels, on runs of any length up to the data's end, for every width of registers.
    #[test]
    fn parabolas_without_a_block_are_those_with_one() {
        let n = 61;
        let column = |rate: f64| -> Vec<f64> { (0..n).map(|i| (rate * f64::from(i)).sin()).collect() };
        let mut points = Columns {
            x: vec![column(1.0), column(1.7), column(2.9)],
            y: column(0.3),
            w: Vec::new(),
        };
        let window = Window {
            at: [0.1, -0.2, 0.3],
            h: [1.5; 3],
            per_h: [1.0 / 1.5; 3],
        };
        for weights in [Vec::new(), column(0.01)] {
            points.w = weights;
            for length in 0..30 {
                let runs = [3..3 + length, 36..37, 61 - length..61];
                let blocks = over_runs::<3, REGISTER, false>(Kernel::Epanechnikov, &points, &runs, &window);
                for level in [Level::new(), Level::baseline()] {
                    let sums = dispatch!(level, simd => over_runs_of_parabolas(simd, &points, &runs, &window));
                    for (a, b) in [(sums.s0, blocks.s0), (sums.t0, blocks.t0)] {
                        assert!((a[0] - b[0]).abs() < 1e-13, "{length}, {level:?}: {a:?}, {b:?}");
                    }
                }
            }
        }
    }
}
