//! The kernels of bounded support as polynomials, and their sums over a sliding window.
//!
//! A window about the point t (in the coordinate u of its moments) has the sum
//! $$ \sum_i w_i K(t - u_i) = \sum_k c_k(t) \sum_i w_i u_i^k , $$
//! where c_k(t) are the coefficients of K(t - u) as a polynomial in u. The triangular kernel has one polynomial up to the
//! point and another one beyond it.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::moments::{Coefficients, Groups};
use super::window_bounds::{Abscissas, PointWindows, Scratch, WindowBounds};
use super::window_sums::{BATCH, RunningSums, WindowSums};
use super::{Degree, Kernel, Sorted, Sums};

/// 1 - (t - u)^2.
#[derive(Clone, Copy)]
struct Parabola;

impl Coefficients<3> for Parabola {
    #[inline(always)]
    fn at(self, t: f64) -> [f64; 3] {
        parabola(t)
    }

    #[inline(always)]
    fn combined(self, t: f64, moments: &[[f64; 2]]) -> [f64; 2] {
        // Horner's rule in t. The searches for a bandwidth spend most of their time here.
        std::array::from_fn(|k| {
            let [m0, m1, m2] = [moments[0][k], moments[1][k], moments[2][k]];
            (m0 - m2) + t * ((m1 + m1) - t * m0)
        })
    }
}

/// 1 - (t - u)^2 in powers of u.
#[inline(always)]
fn parabola(t: f64) -> [f64; 3] {
    [(1.0 - t) * (1.0 + t), 2.0 * t, -1.0]
}

/// (1 - (t - u)^2)^2 in powers of u.
#[inline(always)]
fn parabola_squared(t: f64) -> [f64; 5] {
    product(parabola(t), parabola(t))
}

/// (1 - (t - u)^2)^3 in powers of u.
#[inline(always)]
fn parabola_cubed(t: f64) -> [f64; 7] {
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

/// The triangular kernel's coefficients up to the point: 1 - t + u.
#[inline(always)]
fn rising(t: f64) -> [f64; 2] {
    [1.0 - t, 1.0]
}

/// The triangular kernel's coefficients beyond the point: 1 + t - u.
#[inline(always)]
fn falling(t: f64) -> [f64; 2] {
    [1.0 + t, -1.0]
}

/// A task that needs a kernel's polynomials. M coefficients need N = M moments, and N = M + 2 for the local linear fit.
trait Task {
    /// For a kernel that is one polynomial on [-1, 1].
    fn one_polynomial<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>);

    /// For the triangular kernel.
    fn triangular<const N: usize>(&mut self);
}

/// Does `task` for a kernel of bounded support.
fn perform(task: &mut impl Task, kernel: Kernel, degree: Degree) {
    use Degree::{Constant, Linear};
    match (kernel, degree) {
        (Kernel::Uniform, Constant) => task.one_polynomial::<1, 1>(|_| [1.0]),
        (Kernel::Uniform, Linear) => task.one_polynomial::<1, 3>(|_| [1.0]),
        (Kernel::Triangular, Constant) => task.triangular::<2>(),
        (Kernel::Triangular, Linear) => task.triangular::<4>(),
        (Kernel::Epanechnikov, Constant) => task.one_polynomial::<3, 3>(Parabola),
        (Kernel::Epanechnikov, Linear) => task.one_polynomial::<3, 5>(Parabola),
        (Kernel::Biweight, Constant) => task.one_polynomial::<5, 5>(parabola_squared),
        (Kernel::Biweight, Linear) => task.one_polynomial::<5, 7>(parabola_squared),
        (Kernel::Triweight, Constant) => task.one_polynomial::<7, 7>(parabola_cubed),
        (Kernel::Triweight, Linear) => task.one_polynomial::<7, 9>(parabola_cubed),
        (Kernel::Gaussian, _) => unreachable!("the Gaussian has no bounded support"),
    }
}

/// Visits the sums at each of the increasing points `at` that has any data in reach, for a kernel of bounded support.
pub fn at_points(
    data: &Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    at: &[f64],
    visit: &mut dyn FnMut(usize, Sums),
) {
    perform(&mut AtPoints { data, h, at, visit }, kernel, degree);
}

struct AtPoints<'a> {
    data: &'a Sorted,
    h: f64,
    at: &'a [f64],
    visit: &'a mut dyn FnMut(usize, Sums),
}

impl Task for AtPoints<'_> {
    #[inline(always)]
    fn one_polynomial<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let (h, groups, mut sums) = (self.h, Groups::<N>::new(self.data), RunningSums::default());
        WindowSums::new(self.data, &groups, h, &mut sums).visit(
            self.at,
            0..self.at.len(),
            |x, q| q - x > h,
            |x, q| x - q <= h,
            coefficients,
            &mut *self.visit,
        );
    }

    fn triangular<const N: usize>(&mut self) {
        let groups = Groups::<N>::new(self.data);
        let all = 0..self.at.len();
        visit_triangular(self.data, &groups, self.h, self.at, all, &mut *self.visit);
    }
}

/// The use of the sums at the data's own points.
pub trait Visit {
    /// For point `i`.
    fn visit(&mut self, i: usize, sums: Sums);

    /// For many points at once, with sum w K and sum w K y of the local constants only. No mass exceeds `most`. Returns whether these sums
    /// were enough. If not, every point will be visited.
    fn constants(&mut self, points: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool;
}

/// Visits the data's own points of a range, for a bandwidth.
pub type Pass<'a> = dyn Fn(f64, Range<usize>, &mut dyn Visit) + Sync + 'a;

/// Calls `run` with a function that visits the data's own points, for a kernel of bounded support.
pub fn at_own_points(data: &Sorted, kernel: Kernel, degree: Degree, run: &mut dyn FnMut(&Pass<'_>)) {
    perform(&mut AtOwnPoints { data, run }, kernel, degree);
}

struct AtOwnPoints<'a> {
    data: &'a Sorted,
    run: &'a mut dyn FnMut(&Pass<'_>),
}

impl Task for AtOwnPoints<'_> {
    fn one_polynomial<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let data = self.data;
        let groups = Groups::<N>::new(data);
        let abscissas = Abscissas::new(&data.x);
        // Scratch memory is made once for each thread, not for every bandwidth.
        let unused = Mutex::new(Vec::<(RunningSums<N>, Scratch)>::new());
        let scratch = || unused.lock().unwrap_or_else(PoisonError::into_inner);
        (self.run)(&|h, points, visitor| {
            let (mut running, mut bounds_scratch) = scratch().pop().unwrap_or_default();
            let mut constants = [[0.0; 2]; BATCH];
            let mut sums = WindowSums::new(data, &groups, h, &mut running);
            let mut bounds = WindowBounds::new(&abscissas, h, points, &mut bounds_scratch);
            while let Some(PointWindows { points, starts, ends }) = bounds.next() {
                sums.batches(&data.x[points.clone()], starts, ends, coefficients, |k, batch| {
                    let points = points.start + k..points.start + k + batch.len();
                    if N == M {
                        let constants = &mut constants[..points.len()];
                        batch.constants(constants);
                        if visitor.constants(points.clone(), constants, batch.most()) {
                            return;
                        }
                    }
                    for (k, i) in points.enumerate() {
                        visitor.visit(i, batch.sums(k));
                    }
                });
            }
            scratch().push((running, bounds_scratch));
        });
    }

    fn triangular<const N: usize>(&mut self) {
        let data = self.data;
        let groups = Groups::<N>::new(data);
        (self.run)(&|h, points, visitor| {
            visit_triangular(data, &groups, h, &data.x, points, |i, sums| visitor.visit(i, sums));
        });
    }
}

/// Points for which the sums over the lower half of the window are kept until the sums over the upper half are known.
const TILE: usize = 256;

/// Visits the sums with the triangular kernel at the increasing points `at[range]` that have any data in reach.
#[inline(always)]
fn visit_triangular<const N: usize>(
    data: &Sorted,
    groups: &Groups<N>,
    h: f64,
    at: &[f64],
    range: Range<usize>,
    mut visit: impl FnMut(usize, Sums),
) {
    let (mut sums_below, mut sums_above) = (RunningSums::default(), RunningSums::default());
    let mut below = WindowSums::new(data, groups, h, &mut sums_below);
    let mut above = WindowSums::new(data, groups, h, &mut sums_above);
    let mut both = Vec::with_capacity(TILE);
    for first in range.clone().step_by(TILE) {
        let tile = first..range.end.min(first + TILE);
        both.clear();
        both.resize(tile.len(), Sums::NONE);
        let (starts, middle, ends) = (|x, q| q - x > h, |x, q| x <= q, |x, q| x - q <= h);
        below.visit(at, tile.clone(), starts, middle, rising, |j, sums| {
            both[j - first] = sums
        });
        above.visit(at, tile.clone(), middle, ends, falling, |j, sums| {
            let lower = &mut both[j - first];
            *lower = if lower.mass[0] > 0.0 { *lower + sums } else { sums };
        });
        for (j, sums) in tile.zip(&both) {
            if sums.mass[0] > 0.0 {
                visit(j, *sums);
            }
        }
    }
}
