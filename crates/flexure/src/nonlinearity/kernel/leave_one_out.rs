//! The exact leave-one-out score of one bandwidth or more.

use std::ops::Range;

use rayon::prelude::*;

use super::piece::{self, Coefficients, Job};
use super::sums::residual_without;
use super::sweep::{Grains, TILE};
use super::{Degree, Kernel, Sorted, Sums, for_each_sum};

/// Points are taken in at most so many parts, each of at least so many points: the parts do not depend on
/// the number of threads, nor does therefore the score.
const PARTS: usize = 16;
const PART: usize = 1 << 13;

/// The exact leave-one-out scores sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i of bandwidths.
///
/// A point without any other in reach is predicted by its nearest neighbours.
pub(crate) fn leave_one_out(data: &Sorted, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
    let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
    let mut scores = match kernel {
        Kernel::Gaussian => (bandwidths.par_iter())
            .map(|&h| {
                let mut errors = Errors::new(data, kernel, degree, h);
                for_each_sum(data, kernel, degree, h, &data.x, |i, sums| errors.add(degree, i, sums));
                errors.finish()
            })
            .collect(),
        _ => {
            let mut job = Scores {
                data,
                kernel,
                bandwidths,
                scores: Vec::new(),
            };
            piece::perform(&mut job, kernel, degree);
            job.scores
        }
    };
    scores.iter_mut().for_each(|score| *score /= total);
    scores
}

/// The sums of the squared errors for each bandwidth, for a kernel of bounded support.
struct Scores<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    bandwidths: &'a [f64],
    scores: Vec<f64>,
}

impl Scores<'_> {
    /// Sums `part(h, points)` over all parts, for each bandwidth.
    fn sum(&mut self, part: impl Fn(f64, Range<usize>) -> f64 + Sync) {
        let n = self.data.len();
        let size = PART.max(n.div_ceil(PARTS));
        let parts = n.div_ceil(size);
        let sums: Vec<f64> = (0..parts * self.bandwidths.len())
            .into_par_iter()
            .map(|task| {
                let k = task % parts;
                part(self.bandwidths[task / parts], k * size..n.min((k + 1) * size))
            })
            .collect();
        self.scores = sums.chunks(parts).map(|sums| sums.iter().sum()).collect();
    }
}

impl Job for Scores<'_> {
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let degree = if N > M { Degree::Linear } else { Degree::Constant };
        let (data, kernel) = (self.data, self.kernel);
        let grains = Grains::<N>::new(data);
        self.sum(|h, range| {
            let mut errors = Errors::new(data, kernel, degree, h);
            let at = (&data.x[..], range);
            piece::whole(data, &grains, h, at, coefficients, |i, sums| {
                errors.add(degree, i, sums)
            });
            errors.finish()
        });
    }

    fn halves<const N: usize>(&mut self) {
        let degree = if N > 2 { Degree::Linear } else { Degree::Constant };
        let (data, kernel) = (self.data, self.kernel);
        let grains = Grains::<N>::new(data);
        self.sum(|h, range| {
            let mut errors = Errors::new(data, kernel, degree, h);
            let at = (&data.x[..], range);
            piece::halves(data, &grains, h, at, |i, sums| errors.add(degree, i, sums));
            errors.finish()
        });
    }
}

/// The sum of the squared leave-one-out errors over points that are visited in order, without gaps.
struct Errors<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    /// The last point whose sums had to be made directly, as many may have one abscissa.
    last: (f64, Sums),
    sum: f64,
    /// The local constant's sums over the points before `next`, of which several are worked off at once.
    waiting: Waiting,
    next: usize,
}

/// s, t and the mass of [`Sums`] at `count` points.
struct Waiting {
    s: [f64; TILE],
    t: [f64; TILE],
    mass: [f64; TILE],
    count: usize,
}

impl<'a> Errors<'a> {
    fn new(data: &'a Sorted, kernel: Kernel, degree: Degree, h: f64) -> Self {
        Errors {
            data,
            kernel,
            degree,
            h,
            last: (f64::NAN, Sums::NONE),
            sum: 0.0,
            waiting: Waiting {
                s: [0.0; TILE],
                t: [0.0; TILE],
                mass: [0.0; TILE],
                count: 0,
            },
            next: 0,
        }
    }

    /// Adds point `i`; `degree` is [`Self::degree`], known to the compiler.
    #[inline(always)]
    fn add(&mut self, degree: Degree, i: usize, sums: Sums) {
        if degree == Degree::Constant {
            let waiting = &mut self.waiting;
            let k = waiting.count % TILE;
            waiting.s[k] = sums.s[0];
            waiting.t[k] = sums.t[0];
            waiting.mass[k] = sums.mass[0];
            waiting.count += 1;
            self.next = i + 1;
            if waiting.count == TILE {
                self.work_off();
            }
            return;
        }
        let (y, w) = (self.data.y[i], self.data.weight(i));
        let reliable = sums.reliable(degree);
        let residual = reliable.then(|| sums.residual_without(degree, y, w)).flatten();
        let residual = residual.unwrap_or_else(|| self.direct(i, sums));
        self.sum += w * residual * residual;
    }

    /// Adds the points that wait.
    #[inline(never)]
    fn work_off(&mut self) {
        let Waiting { s, t, mass, count } = &self.waiting;
        let count = *count;
        let first = self.next - count;
        let (s, t, mass) = (&s[..count], &t[..count], &mass[..count]);
        let y = &self.data.y[first..self.next];
        // Two at a time, whose sums stay apart.
        let (mut sums, mut reliable) = ([0.0; 2], true);
        for k in 0..count {
            let w = self.data.weight(first + k);
            let (residual, fast) = residual_without(y[k], w, s[k], t[k], mass[k]);
            reliable &= fast;
            sums[k % 2] += w * residual * residual;
        }
        if reliable {
            self.sum += sums[0] + sums[1];
        } else {
            for k in 0..count {
                let (y, w) = (self.data.y[first + k], self.data.weight(first + k));
                let sums = Sums {
                    mass: [self.waiting.mass[k], 0.0],
                    s: [self.waiting.s[k], 0.0, 0.0],
                    t: [self.waiting.t[k], 0.0],
                    at: 0.0,
                };
                let (residual, fast) = residual_without(y, w, sums.s[0], sums.t[0], sums.mass[0]);
                let residual = if fast { residual } else { self.direct(first + k, sums) };
                self.sum += w * residual * residual;
            }
        }
        self.waiting.count = 0;
    }

    /// The sum over all points.
    fn finish(mut self) -> f64 {
        self.work_off();
        self.sum
    }

    /// The residual of a point where the fast `sums` will not do.
    #[cold]
    #[inline(never)]
    fn direct(&mut self, i: usize, mut sums: Sums) -> f64 {
        let Errors {
            data,
            kernel,
            degree,
            h,
            ..
        } = *self;
        let (x, y, w) = (data.x[i], data.y[i], data.weight(i));
        if !sums.reliable(degree) {
            if self.last.0 != x {
                self.last = (x, data.direct_sums(kernel, degree, h, x, None));
            }
            sums = self.last.1;
        }
        sums.residual_without(degree, y, w).unwrap_or_else(|| {
            let others = data.direct_sums(kernel, degree, h, x, Some(i));
            let fit = others.fit(degree);
            y - fit.map_or_else(|| data.nearest(x, Some(i)), |fit| fit.value)
        })
    }
}
