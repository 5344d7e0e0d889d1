//! Leave-one-out and generalised cross-validation scores.

use std::ops::Range;

use super::sums::{Columns, Local, Outcome, SumsOver};
use super::{Degree, Product, in_dimension, orthogonal};
use crate::nonlinearity::kernel::choice::Errors;
use crate::parallel;

/// Fewest points of one piece. Pieces do not depend on the number of threads, so that the sums do not either.
const PIECE: usize = 256;
/// If a cell has at least this many points, the points around it are copied to one place first.
const GATHERED_FROM: usize = 3;
/// Number of windows from which the mean number of points in a window is estimated.
const SAMPLES: usize = 200;
/// If the other points' share in a fit is below this, the fit without the point is found from the points one by one.
const SHARE: f64 = 1e-3;

impl Product {
    /// The sums of squared errors over the points `i` of positive weight for which `scored` is true. `alone` returns the estimate, minus
    /// the mean, at a point that has no other in reach.
    pub fn errors(
        &self,
        degree: Degree,
        scored: &(impl Fn(usize) -> bool + Sync),
        alone: &(impl Fn(usize) -> f64 + Sync),
    ) -> Errors {
        in_dimension!(self.h.len(), self.sum_errors(degree, scored, alone))
    }

    fn sum_errors<const D: usize>(
        &self,
        degree: Degree,
        scored: &(impl Fn(usize) -> bool + Sync),
        alone: &(impl Fn(usize) -> f64 + Sync),
    ) -> Errors {
        let mut pieces: Vec<Vec<Range<usize>>> = Vec::new();
        for cell in self.cells.groups() {
            match pieces.last_mut() {
                Some(piece) if cell.start - piece[0].start < PIECE => piece.push(cell),
                _ => pieces.push(vec![cell]),
            }
        }
        let sums = SumsOver::<D>::new(self.kernel, degree);
        let errors = parallel::batch(&pieces, |piece| {
            let (mut scratch, mut errors) = (Scratch::default(), Errors::default());
            for cell in piece {
                let of = |i: &usize| scored(self.order[*i] as usize);
                let of_cell: Vec<usize> = cell.clone().filter(of).collect();
                self.score_cell::<D>(degree, sums, &of_cell, alone, &mut scratch, &mut errors);
            }
            errors
        });
        errors.into_iter().fold(Errors::default(), Errors::plus)
    }

    /// Adds the errors at these points of one cell.
    fn score_cell<const D: usize>(
        &self,
        degree: Degree,
        sums: SumsOver<D>,
        at: &[usize],
        alone: &impl Fn(usize) -> f64,
        scratch: &mut Scratch,
        errors: &mut Errors,
    ) {
        let gathered = at.len() >= GATHERED_FROM;
        if gathered {
            self.copy_nearby::<D>(at, scratch);
        }
        let Scratch { near, whole, runs } = scratch;
        let whole = std::slice::from_ref(&*whole);
        for &i in at {
            let q: [f64; D] = std::array::from_fn(|j| self.points.x[j][i]);
            let outcome = if gathered {
                let all = sums.over(near, whole, &self.window(q));
                // The point itself is in the window, so the Gaussian's window need not be wider.
                self.outcome(degree, &all)
            } else {
                self.cells.runs(&q, &q, 1.0, runs);
                self.outcome(degree, &sums.over(&self.points, runs, &self.window(q)))
            };
            let (y, w) = (self.points.y[i], self.points.weight(i));
            let (fit, sure) = match outcome {
                Outcome::Fit(fit) => (fit, true),
                _ => (self.fit_by_orthogonalisation(degree, q, runs), false),
            };
            let rest = 1.0 - w * fit.leverage;
            let residual = y - fit.value;
            let left_out = if sure && rest > SHARE {
                residual / rest
            } else {
                let without = self.fit_without::<D>(degree, i, runs);
                y - without.map_or_else(|| alone(self.order[i] as usize), |fit| fit.value)
            };
            errors.add(w, fit.leverage, residual, left_out);
        }
    }

    /// The fit at a point of the data, from the points one by one.
    fn fit_by_orthogonalisation<const D: usize>(
        &self,
        degree: Degree,
        q: [f64; D],
        runs: &mut Vec<Range<usize>>,
    ) -> Local<D> {
        self.cells.runs(&q, &q, self.widest(), runs);
        let none = Local {
            value: 0.0,
            leverage: 0.0,
            slope: [0.0; D],
        };
        orthogonal::fit(self, degree, &q, runs, None).unwrap_or(none)
    }

    /// Copies the points that a window about any of the points `at` could hold.
    fn copy_nearby<const D: usize>(&self, at: &[usize], scratch: &mut Scratch) {
        let fold = |j: usize, f: fn(f64, f64) -> f64| {
            let along = at.iter().map(|&i| self.points.x[j][i]);
            along.reduce(f).unwrap_or(f64::NAN)
        };
        let low: [f64; D] = std::array::from_fn(|j| fold(j, f64::min));
        let high: [f64; D] = std::array::from_fn(|j| fold(j, f64::max));
        self.cells.runs(&low, &high, 1.0, &mut scratch.runs);
        scratch.near.x.resize(D, Vec::new());
        let copy = |to: &mut Vec<f64>, from: &[f64]| {
            to.clear();
            for run in &scratch.runs {
                to.extend_from_slice(&from[run.clone()]);
            }
        };
        for (to, from) in scratch.near.x.iter_mut().zip(&self.points.x) {
            copy(to, from);
        }
        copy(&mut scratch.near.y, &self.points.y);
        if !self.points.w.is_empty() {
            copy(&mut scratch.near.w, &self.points.w);
        }
        scratch.whole = 0..scratch.near.y.len();
    }

    /// The approximate mean number of points in a window around a point of the data.
    pub fn pairs(&self) -> f64 {
        let (n, mut runs) = (self.points.y.len(), Vec::new());
        let step = n.div_ceil(SAMPLES);
        let at = |i: usize| -> Vec<f64> { self.points.x.iter().map(|column| column[i]).collect() };
        let mut count = 0;
        for i in (0..n).step_by(step) {
            self.cells.runs(&at(i), &at(i), 1.0, &mut runs);
            count += runs.iter().map(Range::len).sum::<usize>();
        }
        count as f64 / n.div_ceil(step) as f64
    }
}

/// Memory that is used again for every cell of a piece.
struct Scratch {
    near: Columns,
    whole: Range<usize>,
    runs: Vec<Range<usize>>,
}

impl Default for Scratch {
    fn default() -> Self {
        Scratch {
            near: Columns {
                x: Vec::new(),
                y: Vec::new(),
                w: Vec::new(),
            },
            whole: 0..0,
            runs: Vec::new(),
        }
    }
}
