//! The exact leave-one-out score of one bandwidth or more.

use std::ops::Range;

use rayon::prelude::*;

use super::piece::{self, Coefficients, Job};
use super::staircase::{Abscissas, Windows};
use super::sums::{DIRECT_BELOW, residual_without};
use super::sweep::{Grains, STRETCH, Stretch, Sweep};
use super::{Degree, Kernel, Sorted, Sums, for_each_sum};

/// Points are summed in parts of at least so many: the parts do not depend on the number of threads, nor does
/// therefore the score.
const PART: usize = 1 << 17;
/// Residuals that are taken at a time.
const LANES: usize = 4;

/// The exact leave-one-out scores sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i of bandwidths.
///
/// A point without any other in reach is predicted by its nearest neighbours.
pub(crate) fn leave_one_out(data: &Sorted, kernel: Kernel, degree: Degree, bandwidths: &[f64]) -> Vec<f64> {
    let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
    let mut scores = match kernel {
        Kernel::Gaussian => (bandwidths.par_iter())
            .map(|&h| {
                let mut errors = Errors::new(data, kernel, degree, h);
                for_each_sum(data, kernel, degree, h, &data.x, |i, sums| errors.add(i, sums));
                errors.sum
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
        let tasks: Vec<(usize, Range<usize>)> = (self.bandwidths.iter().enumerate())
            .flat_map(|(k, &h)| {
                let size = self.part(h);
                (0..n).step_by(size).map(move |first| (k, first..n.min(first + size)))
            })
            .collect();
        let sums: Vec<f64> = (tasks.par_iter())
            .map(|(k, points)| part(self.bandwidths[*k], points.clone()))
            .collect();
        self.scores = vec![0.0; self.bandwidths.len()];
        for ((k, _), sum) in tasks.iter().zip(sums) {
            self.scores[*k] += sum;
        }
    }

    /// The size of a part: not much smaller than a window, as its windows are searched for from its first one on.
    fn part(&self, h: f64) -> usize {
        let x = &self.data.x;
        let parts = 0.25 * (x[x.len() - 1] - x[0]) / h;
        PART.max(x.len().div_ceil((parts as usize).max(1)))
    }
}

impl Job for Scores<'_> {
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let degree = if N > M { Degree::Linear } else { Degree::Constant };
        let (data, kernel) = (self.data, self.kernel);
        let grains = Grains::<N>::new(data);
        let abscissas = Abscissas::new(&data.x);
        self.sum(|h, points| {
            let mut errors = Errors::new(data, kernel, degree, h);
            let mut sweep = Sweep::new(data, &grains, h);
            let mut windows = Windows::new(&abscissas, h, points);
            while let Some((points, starts, ends)) = windows.next() {
                sweep.stretches(&data.x[points.clone()], (starts, ends), coefficients, |k, stretch| {
                    errors.add_stretch(points.start + k, stretch);
                });
            }
            errors.sum
        });
    }

    fn halves<const N: usize>(&mut self) {
        let degree = if N > 2 { Degree::Linear } else { Degree::Constant };
        let (data, kernel) = (self.data, self.kernel);
        let grains = Grains::<N>::new(data);
        self.sum(|h, points| {
            let mut errors = Errors::new(data, kernel, degree, h);
            piece::halves(data, &grains, h, (&data.x, points), |i, sums| errors.add(i, sums));
            errors.sum
        });
    }
}

/// The sum of the squared leave-one-out errors.
struct Errors<'a> {
    data: &'a Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    /// The last point whose sums had to be made directly, as many may have one abscissa.
    last: (f64, Sums),
    sum: f64,
    /// A stretch's sums of local constants.
    constants: [[f64; 2]; STRETCH],
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
            constants: [[0.0; 2]; STRETCH],
        }
    }

    /// Adds point `i`.
    #[inline(always)]
    fn add(&mut self, i: usize, sums: Sums) {
        let (y, w) = (self.data.y[i], self.data.weight(i));
        let reliable = self.degree == Degree::Constant || sums.reliable(self.degree);
        let residual = reliable.then(|| sums.residual_without(self.degree, y, w)).flatten();
        let residual = residual.unwrap_or_else(|| self.direct(i, sums));
        self.sum += w * residual * residual;
    }

    /// Adds the points from `first` on.
    #[inline(always)]
    fn add_stretch<F: Coefficients<M>, const M: usize, const N: usize>(
        &mut self,
        first: usize,
        stretch: &Stretch<'_, F, N>,
    ) {
        if N == M {
            stretch.constants(&mut self.constants);
            let points = first..first + stretch.len();
            if self.add_constants(points, DIRECT_BELOW * stretch.most()) {
                return;
            }
        }
        for k in 0..stretch.len() {
            self.add(first + k, stretch.sums(k));
        }
    }

    /// Adds points by the local constants' sums, unless those without the point are at most `enough` for any.
    #[inline(never)]
    fn add_constants(&mut self, points: Range<usize>, enough: f64) -> bool {
        let (y, sums) = (&self.data.y[points.clone()], &self.constants[..points.len()]);
        let (sum, least) = match self.data.weights() {
            None => squares(y, sums, |_| 1.0),
            Some(w) => {
                let w = &w[points];
                squares(y, sums, |k| w[k])
            }
        };
        let enough = least > enough && !sum.is_nan();
        if enough {
            self.sum += sum;
        }
        enough
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

/// The weighted sum of the squared residuals from the local constants without each point, and the least of the
/// others' sums of K.
#[inline(always)]
fn squares(y: &[f64], sums: &[[f64; 2]], weight: impl Fn(usize) -> f64) -> (f64, f64) {
    // Several at a time, that none waits for the one before.
    let (mut sum, mut least) = ([0.0; LANES], [f64::INFINITY; LANES]);
    let mut add = |k: usize, lane: usize| {
        let w = weight(k);
        let (residual, rest) = residual_without(y[k], w, sums[k]);
        sum[lane] += w * residual * residual;
        least[lane] = if rest < least[lane] { rest } else { least[lane] };
    };
    let whole = y.len() / LANES * LANES;
    for first in (0..whole).step_by(LANES) {
        for lane in 0..LANES {
            add(first + lane, lane);
        }
    }
    for k in whole..y.len() {
        add(k, 0);
    }
    (sum.iter().sum(), least.into_iter().fold(f64::INFINITY, f64::min))
}
