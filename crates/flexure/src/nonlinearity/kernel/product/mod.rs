//! Kernel regression with product kernels in two to six dimensions:
//! $$ m_n(x) = \frac{\sum_i Y_i \prod_j K((x_j - X_{ij})/h_j)}{\sum_i \prod_j K((x_j - X_{ij})/h_j)} $$
//! and its local linear form (Ruppert and Wand 1994), with weights.
//!
//! The points are ordered by cells ([`cells`]), so that those of a window are a few contiguous runs. The sums over the runs
//! are taken directly ([`sums`]), several points at a time. Where the normal equations of the local plane would lose too
//! many digits, the plane is found by orthogonalisation of the points ([`orthogonal`]).
//!
//! The Gaussian is cut where everything beyond the cut contributes less than 1e-13 of the part inside. The cut is wider where the points
//! inside have little weight.

mod cells;
mod orthogonal;
mod outside;
mod profile;
mod score;
mod sums;

use std::ops::Range;

use super::{Degree, Kernel};
use crate::nonlinearity::Outside;
use crate::nonlinearity::estimator::Checked;
use cells::{Celled, Cells};
use sums::{Columns, Local, Outcome, Sums, SumsOver, Window};

/// Exponent of the Gaussian beyond which a point is negligible in comparison with one at the centre.
const NEGLIGIBLE: f64 = 40.0;
/// If the mean square of the differences, in bandwidths, is at least this, points beyond the Gaussian's cut do not change it.
const BEYOND_CUT: f64 = 1e-3;

/// Points, and the windows through which they are seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Product {
    kernel: Kernel,
    h: Vec<f64>,
    /// In order of their cells.
    points: Columns,
    mean: f64,
    /// The sum of the weights.
    total: f64,
    cells: Cells,
    /// The points' indices among those of positive weight.
    order: Vec<u32>,
    /// The columns' ranges.
    ranges: Vec<(f64, f64)>,
    /// Bandwidths from the centre to the sides of a window.
    reach: f64,
}

/// Calls a method that is generic in the number of dimensions.
macro_rules! in_dimension {
    ($d:expr, $object:ident.$method:ident($($argument:expr),*)) => {
        match $d {
            2 => $object.$method::<2>($($argument),*),
            3 => $object.$method::<3>($($argument),*),
            4 => $object.$method::<4>($($argument),*),
            5 => $object.$method::<5>($($argument),*),
            _ => $object.$method::<6>($($argument),*),
        }
    };
}
use in_dimension;

impl Product {
    /// Puts the points into cells for these positive bandwidths, one per column.
    pub fn new(data: &Checked<'_>, kernel: Kernel, h: &[f64]) -> Product {
        let Some(w) = data.w.filter(|w| w.contains(&0.0)) else {
            return Self::of_all(data, kernel, h);
        };
        let kept = |values: &[f64]| -> Vec<f64> {
            let pairs = values.iter().zip(w);
            pairs.filter(|(_, w)| **w > 0.0).map(|(v, _)| *v).collect()
        };
        let x: Vec<Vec<f64>> = data.x.iter().map(|column| kept(column)).collect();
        let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
        let (y, w) = (kept(data.y), kept(w));
        let positive = Checked {
            x: &x,
            y: &y,
            w: Some(&w),
        };
        Self::of_all(&positive, kernel, h)
    }

    /// Without points of weight zero.
    fn of_all(data: &Checked<'_>, kernel: Kernel, h: &[f64]) -> Product {
        let n = data.y.len();
        let reach = match kernel {
            Kernel::Gaussian => (2.0 * (NEGLIGIBLE + (n as f64).ln())).sqrt(),
            _ => kernel.reach(),
        };
        let widths: Vec<f64> = h.iter().map(|h| (h * reach).min(f64::MAX)).collect();
        let Celled { cells, ranges, order } = Celled::new(data.x, &widths);
        let total = data.w.map_or(n as f64, |w| w.iter().sum());
        // The second pass removes the rounding error of the first, which matters if the offset is large.
        let about = |c: f64| match data.w {
            None => sum(data.y, |_, y| y - c) / total,
            Some(w) => sum(data.y, |i, y| w[i] * (y - c)) / total,
        };
        let first = about(data.y[0]) + data.y[0];
        let mean = first + about(first);
        let gather = |values: &[f64]| -> Vec<f64> { order.iter().map(|&i| values[i as usize]).collect() };
        Product {
            kernel,
            h: h.to_vec(),
            points: Columns {
                x: data.x.iter().map(|column| gather(column)).collect(),
                y: order.iter().map(|&i| data.y[i as usize] - mean).collect(),
                w: data.w.map_or_else(Vec::new, gather),
            },
            mean,
            total,
            cells,
            order,
            ranges,
            reach,
        }
    }

    /// The estimates at the points with the coordinates `x`, in any order.
    pub fn predict(&self, degree: Degree, x: &[&[f64]], outside: Outside) -> Vec<f64> {
        in_dimension!(self.h.len(), self.estimates(degree, x, outside))
    }

    fn window<const D: usize>(&self, at: [f64; D]) -> Window<D> {
        Window {
            at,
            h: std::array::from_fn(|j| self.h[j]),
            per_h: std::array::from_fn(|j| 1.0 / self.h[j]),
        }
    }

    /// The fit at one point; `None` without data in reach.
    fn fit_at<const D: usize>(
        &self,
        degree: Degree,
        sums: SumsOver<D>,
        at: [f64; D],
        runs: &mut Vec<Range<usize>>,
    ) -> Option<Local<D>> {
        let window = self.window(at);
        self.cells.runs(&at, &at, 1.0, runs);
        let mut all = sums.over(&self.points, runs, &window);
        if let Some(share) = self.wider(&all) {
            self.cells.runs(&at, &at, share, runs);
            all = sums.over(&self.points, runs, &window);
        }
        match self.outcome(degree, &all) {
            Outcome::NoData => None,
            Outcome::Fit(fit) => Some(fit),
            Outcome::Unreliable => {
                self.cells.runs(&at, &at, self.widest(), runs);
                orthogonal::fit(self, degree, &at, runs, None)
            }
        }
    }

    /// The fit at point `i` without it, from the points one by one.
    fn fit_without<const D: usize>(&self, degree: Degree, i: usize, runs: &mut Vec<Range<usize>>) -> Option<Local<D>> {
        let at: [f64; D] = std::array::from_fn(|j| self.points.x[j][i]);
        // It is not known how much the others count.
        self.cells.runs(&at, &at, self.widest(), runs);
        orthogonal::fit(self, degree, &at, runs, Some(i))
    }

    /// The fit that follows from the sums within the cut.
    #[inline(always)]
    fn outcome<const D: usize>(&self, degree: Degree, sums: &Sums<D, 1>) -> Outcome<D> {
        // If nearly all weight is at one place, the points with the smallest weights may determine the plane.
        let narrow = |j: usize| sums.s2[j][j][0] < BEYOND_CUT * sums.s0[0];
        if self.kernel == Kernel::Gaussian && degree == Degree::Linear && (0..D).any(narrow) {
            return Outcome::Unreliable;
        }
        sums.fit(degree)
    }

    /// The width of a window that leaves no point out, in windows.
    fn widest(&self) -> f64 {
        self.kernel.reach() / self.reach
    }

    /// The width that a window needs, in windows, if the points outside it are not negligible in comparison with those inside.
    fn wider<const D: usize>(&self, sums: &Sums<D, 1>) -> Option<f64> {
        if self.kernel != Kernel::Gaussian {
            return None;
        }
        let widest = self.kernel.reach();
        let need = if sums.s0[0] > 0.0 {
            (2.0 * (NEGLIGIBLE + (self.total / sums.s0[0]).ln())).sqrt().min(widest)
        } else {
            widest
        };
        (need > self.reach * (1.0 + 1e-9)).then(|| need / self.reach)
    }
}

/// The sum of `term(i, values[i])`, in parts that do not wait for each other.
#[inline(always)]
fn sum(values: &[f64], term: impl Fn(usize, f64) -> f64) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut parts = [0.0; 8];
    for (c, chunk) in chunks.iter().enumerate() {
        for l in 0..8 {
            parts[l] += term(8 * c + l, chunk[l]);
        }
    }
    let done = values.len() - rest.len();
    let rest: f64 = rest.iter().enumerate().map(|(l, &v)| term(done + l, v)).sum();
    parts.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests;
