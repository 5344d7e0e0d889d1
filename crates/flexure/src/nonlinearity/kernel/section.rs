//! Leave-one-out scores of local constants from data in bins of equal width that lie side by side.
//!
//! The windows about the bins' middles hold equally many bins on either side, so that nothing is searched for, and
//! their moments are differences of running sums, which serve every bandwidth. The bins are taken in sections,
//! each with running sums of its own about its middle: they are never much more than what a window holds, and
//! a difference loses few digits.
//!
//! A bin enters the sums by its data's means and second moments. Of the bins where a window ends a part is in reach,
//! which enters by the kernel's integral over it: as though the bin's data were spread evenly, which rounded ones are
//! not (they have no [`Lattice`]). The score of its data is
//! that about the parabola through the estimates at its middle and its neighbours'.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f64x8};
use rayon::prelude::*;

use super::binned::{ALONE, constant};
use super::lattice::{Columns, Lattice, REACH, SECTION, SPAN};
use super::piece::{Coefficients, Job, perform};
use super::tangents::{LANES, square};
use super::{Degree, Kernel};

/// Middles at which the estimate is made for a section: those of its bins and of one more on either side.
const MIDDLES: usize = SPAN - 2 * (REACH + 1);
/// The unit of the running sums' abscissa in bins, about a bandwidth.
const UNIT: f64 = 64.0;
/// Most moments of which differences are taken: they lose more digits the higher they are.
const MOST_MOMENTS: usize = 5;
/// Windows in which all others' sum of K is less than this, or than this share of the section's data, are summed directly,
/// each bin at its data's mean: there it matters where single points are, and the running sums' rounding would show.
const FEW: f64 = 2.0;
const THIN: f64 = 1e-4;

/// The window of a bandwidth.
#[derive(Clone, Copy)]
struct Window {
    kernel: Kernel,
    /// The bandwidth in bins.
    reach: f64,
    /// Bins on either side of the middle one that are wholly in reach.
    whole: usize,
    /// The weight of the bins next to these, of which a part is.
    edge: f64,
}

impl Window {
    fn new(kernel: Kernel, bandwidth: f64, width: f64) -> Self {
        let reach = bandwidth / width;
        let whole = (reach - 0.5).max(0.0).floor();
        // The mean of K over the part in reach, by Gauss and Legendre's rule, times its length.
        let (middle, half) = (0.5 * (reach + whole + 0.5), 0.5 * (reach - whole - 0.5));
        let nodes = [
            (-0.6_f64.sqrt(), 5.0 / 9.0),
            (0.0, 8.0 / 9.0),
            (0.6_f64.sqrt(), 5.0 / 9.0),
        ];
        let terms = nodes.map(|(node, weight)| weight * kernel.weight((middle + node * half) / reach));
        Window {
            kernel,
            reach,
            whole: whole as usize,
            edge: half * terms.iter().sum::<f64>(),
        }
    }
}

struct Scores<'a> {
    lattice: &'a Lattice,
    kernel: Kernel,
    bandwidths: &'a [f64],
    scores: Option<Vec<f64>>,
}

impl Lattice {
    /// The scores of bandwidths; nothing for other kernels than those of one polynomial of few moments.
    pub fn scores(&self, kernel: Kernel, bandwidths: &[f64]) -> Option<Vec<f64>> {
        let mut scores = Scores {
            lattice: self,
            kernel,
            bandwidths,
            scores: None,
        };
        if kernel != Kernel::Gaussian {
            perform(&mut scores, kernel, Degree::Constant);
        }
        scores.scores
    }
}

impl Job for Scores<'_> {
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        if N != M || M > MOST_MOMENTS {
            return;
        }
        let Scores {
            lattice,
            kernel,
            bandwidths,
            ..
        } = *self;
        let windows: Vec<Window> = bandwidths
            .iter()
            .map(|&h| Window::new(kernel, h, lattice.width))
            .collect();
        if windows.iter().any(|window| window.reach < 1.0 || window.whole > REACH) {
            return;
        }
        let sums: Vec<Vec<f64>> = (0..lattice.len.div_ceil(SECTION))
            .into_par_iter()
            .map(|k| {
                let section = Section::<M>::new(lattice, k * SECTION);
                let squares =
                    |window: &Window| dispatch!(Level::new(), simd => section.squares(simd, *window, coefficients));
                windows.iter().map(squares).collect()
            })
            .collect();
        let total: f64 = lattice.columns.count.iter().sum();
        let of = |k: usize| sums.iter().map(|section| section[k]).sum::<f64>() / total;
        self.scores = Some((0..windows.len()).map(of).collect());
    }

    fn halves<const N: usize>(&mut self) {}
}

impl Columns {
    /// Makes the estimate directly at the data's mean of the k-th bin, in whose window there are few others, and tells the
    /// sum of its data's squared errors.
    #[cold]
    fn square(&self, k: usize, window: Window, value: &mut f64) -> f64 {
        let (mut s, mut t) = (0.0, 0.0);
        for other in (k - window.whole - 1..=k + window.whole + 1).filter(|&other| other != k) {
            let u = self.distance(k, other) / window.reach;
            let w = self.count[other] * window.kernel.weight(u);
            (s, t) = (s + w, t + w * self.y[other]);
        }
        let (all, ordinates) = (s + self.count[k], t + self.count[k] * self.y[k]);
        // A point's share is 1/all: one that is alone is left out at once, as what it leaves is lost in rounding.
        let rest = (all - 1.0) / all;
        let factor;
        (*value, factor) = if self.count[k] > 1.0 || rest > ALONE {
            (ordinates / all, 1.0 / rest)
        } else if s > 0.0 {
            (t / s, 1.0)
        } else {
            (self.nearest(k), 1.0)
        };
        let residual = self.y[k] - *value;
        factor * factor * (self.yy[k] + self.count[k] * residual * residual)
    }

    /// From the mean of a bin to that of another one, in bins.
    fn distance(&self, from: usize, to: usize) -> f64 {
        (to as f64 - from as f64) + (self.x[to] - self.x[from])
    }

    /// The mean of the bin with data nearest to the k-th, or of both; zero where there is no other.
    fn nearest(&self, k: usize) -> f64 {
        let held = |other: &usize| self.count[*other] > 0.0;
        let (below, above) = ((0..k).rev().find(held), (k + 1..self.count.len()).find(held));
        let distance = |other: Option<usize>| other.map_or(f64::INFINITY, |other| self.distance(k, other).abs());
        let (d, e) = (distance(below), distance(above));
        let near = [below.filter(|_| d <= e), above.filter(|_| e <= d)];
        let (count, sum) = near.into_iter().flatten().fold((0.0, 0.0), |(count, sum), other| {
            (count + self.count[other], sum + self.count[other] * self.y[other])
        });
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

/// Neighbouring bins with what surrounds them.
struct Section<'a, const M: usize> {
    lattice: &'a Lattice,
    /// The first of its own bins.
    first: usize,
    /// Running sums of w u^m and of w y u^m, for each m: of the bins of the span before this one.
    runs: [[[f64; SPAN + 1]; M]; 2],
}

impl<'a, const M: usize> Section<'a, M> {
    fn new(lattice: &'a Lattice, first: usize) -> Self {
        let columns = &lattice.columns;
        let [count, x, y, xx, xy] = [&columns.count, &columns.x, &columns.y, &columns.xx, &columns.xy]
            .map(|column| &column[first..first + SPAN]);
        let mut runs = [[[0.0; SPAN + 1]; M]; 2];
        let mut sums = [[0.0; 2]; M];
        for k in 0..SPAN {
            let u = (k as f64 - 0.5 * SPAN as f64 + x[k]) / UNIT;
            let (xx, xy) = (xx[k] / (UNIT * UNIT), xy[k] / UNIT);
            // u^m and its first two derivatives, the second one halved: the data about their means.
            let (mut power, mut first, mut second) = (1.0, 0.0, 0.0);
            for (m, sum) in sums.iter_mut().enumerate() {
                let w = count[k] * power + xx * second;
                *sum = [sum[0] + w, sum[1] + (y[k] * w + xy * first)];
                (runs[0][m][k + 1], runs[1][m][k + 1]) = (sum[0], sum[1]);
                (power, first, second) = (power * u, first * u + power, second * u + first);
            }
        }
        Section { lattice, first, runs }
    }

    /// The sum of the squared leave-one-out errors of the section's data.
    #[inline(always)]
    fn squares<S: Simd, F: Coefficients<M>>(&self, simd: S, window: Window, coefficients: F) -> f64 {
        let (mut values, mut factors) = ([0.0; MIDDLES], [0.0; MIDDLES]);
        let least = self.constants(simd, window, coefficients, (&mut values, &mut factors));
        let enough = FEW.max(THIN * self.runs[0][0][SPAN]);
        let mut squares = 0.0;
        if !(least > enough) {
            let fits = values.iter_mut().zip(&mut factors).enumerate();
            for (middle, (value, factor)) in fits.take(SECTION + 2) {
                let k = self.first + REACH + 1 + middle;
                // The factor is s/rest, and rest = s - 1.
                let thin = !(1.0 / (*factor - 1.0) > enough);
                if self.lattice.columns.count[k] > 0.0 && thin {
                    let square = self.lattice.columns.square(k, window, value);
                    squares += if (1..=SECTION).contains(&middle) { square } else { 0.0 };
                    // The others' sum does without it.
                    *factor = 0.0;
                }
            }
        }
        squares + self.squares_about_parabolas(simd, &values, &factors)
    }

    /// Estimates and factors at the middles, and the least of the others' sums of K at those with data.
    #[inline(always)]
    fn constants<S: Simd, F: Coefficients<M>>(
        &self,
        simd: S,
        window: Window,
        coefficients: F,
        (values, factors): (&mut [f64; MIDDLES], &mut [f64; MIDDLES]),
    ) -> f64 {
        let ratio = UNIT / window.reach;
        let mut terms = [[0.0; MIDDLES]; M];
        for k in 0..MIDDLES {
            let t = ((k + REACH + 1) as f64 - 0.5 * SPAN as f64) / window.reach;
            let mut power = 1.0;
            for (m, c) in coefficients.at(t).into_iter().enumerate() {
                terms[m][k] = c * power;
                power *= ratio;
            }
        }
        let counts = &self.lattice.columns.count[self.first..self.first + SPAN];
        let ordinates = &self.lattice.columns.y[self.first..self.first + SPAN];
        let of = |column: &[f64], k: usize| f64x8::from_slice(simd, &column[k..k + LANES]);
        let mut least = f64x8::splat(simd, f64::INFINITY);
        for k in (0..MIDDLES).step_by(LANES) {
            let (low, high) = (k + REACH + 1 - window.whole, k + REACH + 2 + window.whole);
            let edges = (of(counts, low - 1), of(counts, high));
            let mut s = edges.0 + edges.1;
            let mut t = edges.0 * of(ordinates, low - 1) + edges.1 * of(ordinates, high);
            s *= window.edge;
            t *= window.edge;
            for m in 0..M {
                let term = of(&terms[m], k);
                s += term * (of(&self.runs[0][m], high) - of(&self.runs[0][m], low));
                t += term * (of(&self.runs[1][m], high) - of(&self.runs[1][m], low));
            }
            // An empty bin has no data that would have to be left out.
            let (none, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
            let held = of(counts, k + REACH + 1).simd_gt(none);
            let (value, factor, rest) = constant([s, t], held.select(one, none), one);
            value.store_slice(&mut values[k..k + LANES]);
            factor.store_slice(&mut factors[k..k + LANES]);
            // What is not a number changes nothing, on any processor.
            least = least.min_precise(held.select(rest, f64x8::splat(simd, f64::INFINITY)));
        }
        least.as_array().iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The sum of the data's squared distances from the parabolas about their bins' middles, times the squared factors.
    #[inline(always)]
    fn squares_about_parabolas<S: Simd>(&self, simd: S, values: &[f64; MIDDLES], factors: &[f64; MIDDLES]) -> f64 {
        let Columns {
            count,
            x,
            y,
            xx,
            xy,
            yy,
        } = &self.lattice.columns;
        let none = f64x8::splat(simd, 0.0);
        let mut sums = none;
        for k in (1..=SECTION).step_by(LANES) {
            let of = |column: &[f64], k: usize| f64x8::from_slice(simd, &column[k..k + LANES]);
            let at = |column: &[f64]| of(column, self.first + REACH + 1 + k);
            let (below, middle, above) = (of(values, k - 1), of(values, k), of(values, k + 1));
            let (slope, curvature) = ((above - below) * 0.5, (above - middle) - (middle - below));
            let (count, x, y, factor) = (at(count), at(x), at(y), of(factors, k));
            let value = middle + slope * x;
            let [xx, xy, yy] = [at(xx), at(xy), at(yy)];
            // In the first order of the curvature.
            let bend = curvature * (xx + count * x * x) * (y - value);
            let squares = square((y, count), [xx, xy, yy], (value, factor), slope) - factor * factor * bend;
            sums += count.simd_gt(none).select(squares, none);
        }
        <[f64; LANES]>::from(sums).iter().sum()
    }
}

#[cfg(test)]
#[path = "section_tests.rs"]
mod tests;
