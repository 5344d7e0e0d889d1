//! The kernels of bounded support as polynomials, and their sums over a sliding window.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::staircase::{Abscissas, Room, Windows};
use super::sweep::{Grains, Runs, STRETCH, Sweep};
use super::{Degree, Kernel, Sorted, Sums};

/// A kernel as a polynomial: its coefficients of the powers of u, at the coordinate t of the point.
pub trait Coefficients<const M: usize>: Copy + Sync {
    /// The coefficients.
    fn at(self, t: f64) -> [f64; M];

    /// The sums of K and of K y out of those of the powers of u.
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
        // By Horner's rule in t, as most of the time goes by here.
        std::array::from_fn(|k| {
            let [m0, m1, m2] = [moments[0][k], moments[1][k], moments[2][k]];
            (m0 - m2) + t * ((m1 + m1) - t * m0)
        })
    }
}

/// Something to be done with a kernel's polynomials: N moments serve M coefficients (N = M) and, for the
/// local linear fit, two powers of u more (N = M + 2).
pub trait Job {
    /// The kernel is one polynomial on [-1, 1].
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>);

    /// The triangular kernel: 1 - t + u up to the point, 1 + t - u beyond it.
    fn halves<const N: usize>(&mut self);
}

/// The triangular kernel's coefficients up to the point.
#[inline(always)]
pub fn rising(t: f64) -> [f64; 2] {
    [1.0 - t, 1.0]
}

/// The triangular kernel's coefficients beyond the point.
#[inline(always)]
pub fn falling(t: f64) -> [f64; 2] {
    [1.0 + t, -1.0]
}

/// Does `job` for a kernel of bounded support.
pub fn perform(job: &mut impl Job, kernel: Kernel, degree: Degree) {
    use Degree::{Constant, Linear};
    match (kernel, degree) {
        (Kernel::Uniform, Constant) => job.whole::<1, 1>(|_| [1.0]),
        (Kernel::Uniform, Linear) => job.whole::<1, 3>(|_| [1.0]),
        (Kernel::Triangular, Constant) => job.halves::<2>(),
        (Kernel::Triangular, Linear) => job.halves::<4>(),
        (Kernel::Epanechnikov, Constant) => job.whole::<3, 3>(Parabola),
        (Kernel::Epanechnikov, Linear) => job.whole::<3, 5>(Parabola),
        (Kernel::Biweight, Constant) => job.whole::<5, 5>(parabola_squared),
        (Kernel::Biweight, Linear) => job.whole::<5, 7>(parabola_squared),
        (Kernel::Triweight, Constant) => job.whole::<7, 7>(parabola_cubed),
        (Kernel::Triweight, Linear) => job.whole::<7, 9>(parabola_cubed),
        (Kernel::Gaussian, _) => unreachable!("the Gaussian has no bounded support"),
    }
}

/// Visits the sums at each of the increasing points `at` that has any data in reach.
pub struct AtPoints<'a> {
    pub data: &'a Sorted,
    pub h: f64,
    pub at: &'a [f64],
    pub visit: &'a mut dyn FnMut(usize, Sums),
}

impl Job for AtPoints<'_> {
    #[inline(always)]
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let grains = Grains::<N>::new(self.data);
        let range = 0..self.at.len();
        whole(
            self.data,
            &grains,
            self.h,
            (self.at, range),
            coefficients,
            &mut *self.visit,
        );
    }

    fn halves<const N: usize>(&mut self) {
        let grains = Grains::<N>::new(self.data);
        halves(
            self.data,
            &grains,
            self.h,
            (self.at, 0..self.at.len()),
            &mut *self.visit,
        );
    }
}

/// What is done with the sums at the data's own points.
pub trait Visit {
    /// For point `i`.
    fn visit(&mut self, i: usize, sums: Sums);

    /// For many points at once by the local constants' s and t alone, where no mass exceeds `most`. Returns
    /// whether that was enough: if not, every point will be visited.
    fn constants(&mut self, points: Range<usize>, sums: &[[f64; 2]], most: f64) -> bool;
}

/// Visits the data's own points of a range, for a bandwidth.
pub type Pass<'a> = dyn Fn(f64, Range<usize>, &mut dyn Visit) + Sync + 'a;

/// Calls `run` with what visits the data's own points, for a kernel of bounded support.
pub fn at_own_points(data: &Sorted, kernel: Kernel, degree: Degree, run: &mut dyn FnMut(&Pass<'_>)) {
    perform(&mut AtOwnPoints { data, run }, kernel, degree);
}

struct AtOwnPoints<'a> {
    data: &'a Sorted,
    run: &'a mut dyn FnMut(&Pass<'_>),
}

impl Job for AtOwnPoints<'_> {
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let data = self.data;
        let grains = Grains::<N>::new(data);
        let abscissas = Abscissas::new(&data.x);
        // Made once for each thread, not for every bandwidth.
        let rooms = Mutex::new(Vec::<(Runs<N>, Room)>::new());
        let taken = || rooms.lock().unwrap_or_else(PoisonError::into_inner);
        (self.run)(&|h, points, visitor| {
            let (mut runs, mut room) = taken().pop().unwrap_or_default();
            let mut constants = [[0.0; 2]; STRETCH];
            let mut sweep = Sweep::new(data, &grains, h, &mut runs);
            let mut windows = Windows::new(&abscissas, h, points, &mut room);
            while let Some((points, starts, ends)) = windows.next() {
                let at = &data.x[points.clone()];
                sweep.stretches(at, (starts, ends), coefficients, |k, stretch| {
                    let points = points.start + k..points.start + k + stretch.len();
                    if N == M {
                        let constants = &mut constants[..points.len()];
                        stretch.constants(constants);
                        if visitor.constants(points.clone(), constants, stretch.most()) {
                            return;
                        }
                    }
                    for (k, i) in points.enumerate() {
                        visitor.visit(i, stretch.sums(k));
                    }
                });
            }
            taken().push((runs, room));
        });
    }

    fn halves<const N: usize>(&mut self) {
        let data = self.data;
        let grains = Grains::<N>::new(data);
        (self.run)(&|h, points, visitor| {
            halves(data, &grains, h, (&data.x, points), |i, sums| visitor.visit(i, sums));
        });
    }
}

/// Visits the sums at the increasing points `at[range]` that have any data in reach.
#[inline(always)]
pub fn whole<const M: usize, const N: usize>(
    data: &Sorted,
    grains: &Grains<N>,
    h: f64,
    (at, range): (&[f64], Range<usize>),
    coefficients: impl Coefficients<M>,
    visit: impl FnMut(usize, Sums),
) {
    let edges = (|x: f64, q: f64| q - x > h, |x: f64, q: f64| x - q <= h);
    Sweep::new(data, grains, h, &mut Runs::default()).visit(at, range, edges, coefficients, visit);
}

/// Points of which a half kernel's sums are kept, until the other half's are there.
const TILE: usize = 256;

/// The same for the triangular kernel.
#[inline(always)]
pub fn halves<const N: usize>(
    data: &Sorted,
    grains: &Grains<N>,
    h: f64,
    (at, range): (&[f64], Range<usize>),
    mut visit: impl FnMut(usize, Sums),
) {
    let (mut runs_below, mut runs_above) = (Runs::default(), Runs::default());
    let mut below = Sweep::new(data, grains, h, &mut runs_below);
    let mut above = Sweep::new(data, grains, h, &mut runs_above);
    let mut both = Vec::with_capacity(TILE);
    for first in range.clone().step_by(TILE) {
        let tile = first..range.end.min(first + TILE);
        both.clear();
        both.resize(tile.len(), Sums::NONE);
        let edges = (|x: f64, q: f64| q - x > h, |x: f64, q: f64| x <= q);
        below.visit(at, tile.clone(), edges, rising, |j, sums| both[j - first] = sums);
        let edges = (|x: f64, q: f64| x <= q, |x: f64, q: f64| x - q <= h);
        above.visit(at, tile.clone(), edges, falling, |j, sums| {
            let left = &mut both[j - first];
            *left = if left.mass[0] > 0.0 { *left + sums } else { sums };
        });
        for (j, sums) in tile.zip(&both) {
            if sums.mass[0] > 0.0 {
                visit(j, *sums);
            }
        }
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
