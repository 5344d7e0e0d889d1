//! The kernels of bounded support as polynomials, and their sums over a sliding window.
//!
//! A window about the point t (in the coordinate u of its moments) has the sum
//! $$ \sum_i w_i K(t - u_i) = \sum_k c_k(t) \sum_i w_i u_i^k , $$
//! where c_k(t) are the coefficients of K(t - u) as a polynomial in u. The triangular kernel has one polynomial up to the
//! point and another one beyond it.

use super::window_sums::{Moments, WindowSums};
use super::{Degree, Kernel, Sorted, Sums};

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

/// Visits the sums at each of the increasing points `at` that has any data in reach, for a kernel of bounded support.
///
/// M coefficients need N = M moments, and N = M + 2 for the local linear fit.
pub fn at_points(
    data: &Sorted,
    (kernel, degree): (Kernel, Degree),
    h: f64,
    at: &[f64],
    visit: &mut dyn FnMut(usize, Sums),
) {
    use Degree::{Constant, Linear};
    match (kernel, degree) {
        (Kernel::Uniform, Constant) => one_polynomial::<1, 1>(data, h, at, |_| [1.0], visit),
        (Kernel::Uniform, Linear) => one_polynomial::<1, 3>(data, h, at, |_| [1.0], visit),
        (Kernel::Triangular, Constant) => triangular::<2>(data, h, at, visit),
        (Kernel::Triangular, Linear) => triangular::<4>(data, h, at, visit),
        (Kernel::Epanechnikov, Constant) => one_polynomial::<3, 3>(data, h, at, parabola, visit),
        (Kernel::Epanechnikov, Linear) => one_polynomial::<3, 5>(data, h, at, parabola, visit),
        (Kernel::Biweight, Constant) => one_polynomial::<5, 5>(data, h, at, parabola_squared, visit),
        (Kernel::Biweight, Linear) => one_polynomial::<5, 7>(data, h, at, parabola_squared, visit),
        (Kernel::Triweight, Constant) => one_polynomial::<7, 7>(data, h, at, parabola_cubed, visit),
        (Kernel::Triweight, Linear) => one_polynomial::<7, 9>(data, h, at, parabola_cubed, visit),
        (Kernel::Gaussian, _) => unreachable!("the Gaussian has no bounded support"),
    }
}

/// The sums at the coordinate `t` out of the window's moments, by the kernel's coefficients there.
#[inline(always)]
fn combined<const M: usize, const N: usize>(Moments(moments): &Moments<N>, t: f64, c: [f64; M]) -> Sums {
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

/// For a kernel that is one polynomial on [-1, 1].
#[inline(always)]
fn one_polynomial<const M: usize, const N: usize>(
    data: &Sorted,
    h: f64,
    at: &[f64],
    coefficients: impl Fn(f64) -> [f64; M],
    visit: &mut dyn FnMut(usize, Sums),
) {
    let mut window = WindowSums::<N>::new(data, h);
    for (j, &q) in at.iter().enumerate() {
        if let Some(moments) = window.over(|x| q - x > h, |x| x - q <= h) {
            let t = window.coordinate(q);
            visit(j, combined(&moments, t, coefficients(t)));
        }
    }
}

/// For the triangular kernel: the sums over the lower and the upper half of the window.
fn triangular<const N: usize>(data: &Sorted, h: f64, at: &[f64], visit: &mut dyn FnMut(usize, Sums)) {
    let (mut lower, mut upper) = (WindowSums::<N>::new(data, h), WindowSums::<N>::new(data, h));
    for (j, &q) in at.iter().enumerate() {
        let below = lower.over(|x| q - x > h, |x| x <= q).map(|moments| {
            let t = lower.coordinate(q);
            combined(&moments, t, rising(t))
        });
        let above = upper.over(|x| x <= q, |x| x - q <= h).map(|moments| {
            let t = upper.coordinate(q);
            combined(&moments, t, falling(t))
        });
        match (below, above) {
            (Some(below), Some(above)) => visit(j, below + above),
            (Some(sums), None) | (None, Some(sums)) => visit(j, sums),
            (None, None) => {}
        }
    }
}
