//! The kernels of bounded support as polynomials, and their sums over a sliding window.

use super::window::{Items, Moments, Slider, first_beyond};
use super::{Degree, Kernel, Sorted, Sums};

/// Something to be done with a kernel's polynomials: N moments serve M coefficients (N = M) and, for the
/// local linear fit, two powers of u more (N = M + 2).
pub trait Job {
    /// The kernel is one polynomial on [-1, 1].
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Fn(f64) -> [f64; M] + Copy);

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
        (Kernel::Epanechnikov, Constant) => job.whole::<3, 3>(parabola),
        (Kernel::Epanechnikov, Linear) => job.whole::<3, 5>(parabola),
        (Kernel::Biweight, Constant) => job.whole::<5, 5>(parabola_squared),
        (Kernel::Biweight, Linear) => job.whole::<5, 7>(parabola_squared),
        (Kernel::Triweight, Constant) => job.whole::<7, 7>(parabola_cubed),
        (Kernel::Triweight, Linear) => job.whole::<7, 9>(parabola_cubed),
        (Kernel::Gaussian, _) => unreachable!("the Gaussian has no bounded support"),
    }
}

/// The sums at `q` over the items lo..hi.
#[inline(always)]
pub fn sums<I: Items<N>, const M: usize, const N: usize>(
    slider: &mut Slider<'_, I, N>,
    (lo, hi): (usize, usize),
    q: f64,
    coefficients: impl Fn(f64) -> [f64; M],
) -> Sums {
    if lo >= hi {
        return Sums::NONE;
    }
    let view = slider.seek(lo, hi);
    view.window(lo, hi)
        .map_or(Sums::NONE, |moments| combined(&moments, view.frame.u(q), coefficients))
}

/// The sums at the coordinate `t` out of the window's moments.
#[inline(always)]
fn combined<const M: usize, const N: usize>(
    Moments(moments): &Moments<N>,
    t: f64,
    coefficients: impl Fn(f64) -> [f64; M],
) -> Sums {
    let c = coefficients(t);
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

/// Visits the sums at each of the increasing points `at` that has any data in reach.
pub struct AtPoints<'a, F> {
    pub data: &'a Sorted,
    pub h: f64,
    pub at: &'a [f64],
    pub visit: F,
}

impl<F: FnMut(usize, Sums)> Job for AtPoints<'_, F> {
    #[inline(always)]
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Fn(f64) -> [f64; M] + Copy) {
        let (x, h, at) = (&self.data.x[..], self.h, self.at);
        let begin = |lo, q: f64| first_beyond(x, lo, |x| q - x > h);
        let end = |hi, q: f64| first_beyond(x, hi, |x| x - q <= h);
        let mut slider = Slider::<_, N>::new(self.data, h);
        let (mut lo, mut hi, mut j) = (0, 0, 0);
        while j < at.len() {
            lo = begin(lo, at[j]);
            hi = end(hi.max(lo), at[j]);
            if lo == hi {
                j += 1;
                continue;
            }
            // As long as nothing but the ends of the window moves.
            let view = slider.seek(lo, hi);
            while let Some(moments) = view.window(lo, hi) {
                (self.visit)(j, combined(&moments, view.frame.u(at[j]), coefficients));
                j += 1;
                let Some(&q) = at.get(j) else { break };
                lo = begin(lo, q);
                hi = end(hi, q);
            }
        }
    }

    fn halves<const N: usize>(&mut self) {
        let (x, h) = (&self.data.x[..], self.h);
        let mut sliders = [Slider::<_, N>::new(self.data, h), Slider::<_, N>::new(self.data, h)];
        let (mut lo, mut middle, mut hi) = (0, 0, 0);
        for (j, &q) in self.at.iter().enumerate() {
            lo = first_beyond(x, lo, |x| q - x > h);
            middle = first_beyond(x, middle.max(lo), |x| x <= q);
            hi = first_beyond(x, hi.max(middle), |x| x - q <= h);
            let [left, right] = &mut sliders;
            let left = sums(left, (lo, middle), q, rising);
            let right = sums(right, (middle, hi), q, falling);
            let both = if left.mass[0] > 0.0 { left + right } else { right };
            (self.visit)(j, both);
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
