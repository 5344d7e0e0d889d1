//! The squared prediction error and its Gauss-Newton equations, in one pass over the samples, with pieces in parallel.
//!
//! $$ \tilde e_n = R(z)\Big(y_n - o - \frac{B(z)}{A(z)} z^{-s} \sum_i c_i q_i(u_n)\Big) $$
//! with the autoregression R of the output error (1 for none). It is linear in c, o and, for fixed A, in B;
//! the derivatives are the filtered basis and the filtered signals themselves (Ljung 1999, chapter 10).

use std::ops::Range;

use super::blocks::{Blocks, Layout, Observed};
use super::limits::{CHUNK, ROWS};
use super::linear_part::{LinearPart, polynomial_product};
use crate::interrupt;
use crate::linear::Piece;
use crate::linear::least_squares::NormalEquations;
use crate::parallel;
use crate::vectors::dot;

/// The normal equations of the prediction error: J is the derivative of the prediction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equations {
    /// The number of errors.
    pub count: usize,
    pub normal: NormalEquations,
}

impl Equations {
    /// Adds the equations of other errors.
    pub fn add(&mut self, other: &Equations) {
        self.count += other.count;
        self.normal.add(&other.normal);
    }

    /// The number of parameters.
    pub fn parameters(&self) -> usize {
        self.normal.descent.len()
    }

    /// The standard deviation of an error.
    pub fn noise(&self) -> f64 {
        let free = self.count.saturating_sub(self.parameters()).max(1);
        (self.normal.cost / free as f64).sqrt()
    }

    /// Schwarz's criterion of the errors for this number of parameters; smaller is better.
    pub fn schwarz(&self, parameters: usize) -> f64 {
        let n = self.count.max(1) as f64;
        n * (self.normal.cost / n).max(f64::MIN_POSITIVE).ln() + parameters as f64 * n.ln()
    }
}

impl Blocks {
    /// The sum of squared prediction errors.
    pub fn squares(&self, observed: &Observed, whitening: &[f64]) -> f64 {
        let simulated = self.simulated(observed);
        let errors: Vec<f64> = (observed.y.iter().zip(simulated))
            .map(|(y, s)| y - self.offset - s)
            .collect();
        let white = LinearPart::moving_average(whitening).filter(&observed.experiments, &errors);
        let counted = white.iter().zip(&observed.counts).filter(|(_, counts)| **counts);
        counted.map(|(e, _)| e * e).sum()
    }

    /// The Gauss-Newton equations.
    pub fn equations(&self, observed: &Observed, whitening: &[f64]) -> Equations {
        let n = self.layout().len();
        let of_experiment = |experiment: &Range<usize>| {
            let pieces = self.linear.transfer.pieces(experiment.len());
            let within = experiment.clone();
            pieces.into_iter().map(move |piece| (within.clone(), piece))
        };
        let pieces: Vec<(Range<usize>, Piece)> = observed.experiments.iter().flat_map(of_experiment).collect();
        let of_piece = |(experiment, piece): &(Range<usize>, Piece)| {
            let mut batch = Batch::new(n);
            self.add_piece(observed, experiment.clone(), piece, whitening, &mut batch);
            batch.sums
        };
        let mut equations = Batch::new(n).sums;
        for sums in parallel::batch(&pieces, of_piece) {
            equations.add(&sums);
        }
        for i in 0..n {
            for j in 0..i {
                equations.normal.normal[j * n + i] = equations.normal.normal[i * n + j];
            }
        }
        equations
    }

    /// The samples before one, without which its error and its derivatives are the same to rounding.
    pub fn reach(&self, whitening: &[f64]) -> usize {
        self.linear.transfer.forgotten() + Sensitivities::new(self, whitening).history + self.linear.delay
    }

    /// Adds the errors of a piece of an experiment. The signals begin a while before it, and have settled by then.
    fn add_piece(
        &self,
        observed: &Observed,
        experiment: Range<usize>,
        piece: &Piece,
        whitening: &[f64],
        batch: &mut Batch,
    ) {
        let (u, y) = (&observed.u[experiment.clone()], &observed.y[experiment.clone()]);
        let counts = &observed.counts[experiment];
        let mut signals = Sensitivities::new(self, whitening);
        // Earlier by the lengths of the whitening filter and the numerator too.
        let begin = piece.begin.saturating_sub(signals.history);
        let white_y = LinearPart::moving_average(whitening)
            .transfer
            .simulate(&y[begin..piece.end]);
        let gain: f64 = whitening.iter().sum();
        let delay = self.linear.delay;
        for start in (begin..piece.end).step_by(CHUNK) {
            interrupt::leave();
            let length = CHUNK.min(piece.end - start);
            for i in 0..length {
                let n = start + i;
                let simulated = signals.advance(i, n.checked_sub(delay).map(|n| u[n]));
                if counts[n] && n >= piece.from {
                    let error = white_y[n - begin] - gain * self.offset - simulated;
                    signals.derivatives(i, gain, batch.next_row(error));
                }
            }
            signals.keep_history(length);
        }
        batch.flush();
    }
}

/// The signals whose values are the derivatives of the prediction, over a chunk of samples and those just before it.
///
/// ```text
///   row                 0 ........ history-1 | history ............ history+CHUNK-1
///   sample              before the chunk     | the chunk's
///
///   u(n-s) -> basis q_i -> B R / A -> filtered f_i                   derivative by c_i
///          -> phi w = sum c_i q_i -> R / A -> by_b                   derivative by b_j: by_b, j rows earlier
///                                 -> B R / A -> 1 / A -> by_a        derivative by a_j: -by_a, j rows earlier
/// ```
/// Each filter reaches back over at most `history` rows. After a chunk its last `history` rows become the first ones.
struct Sensitivities<'a> {
    blocks: &'a Blocks,
    whitening: &'a [f64],
    /// B R.
    taps: Vec<f64>,
    coefficients: Vec<f64>,
    layout: Layout,
    history: usize,
    /// The number of functions of the basis, the width of a row of the next two.
    width: usize,
    basis: Vec<f64>,
    filtered: Vec<f64>,
    phi: Vec<f64>,
    by_b: Vec<f64>,
    by_a: Vec<f64>,
}

impl<'a> Sensitivities<'a> {
    fn new(blocks: &'a Blocks, whitening: &'a [f64]) -> Sensitivities<'a> {
        let taps = polynomial_product(blocks.linear.b(), whitening);
        let history = (taps.len())
            .max(blocks.linear.a().len() + 1)
            .max(blocks.linear.b().len());
        let (rows, width) = (history + CHUNK, blocks.basis.size());
        Sensitivities {
            coefficients: blocks.coefficients(),
            layout: blocks.layout(),
            basis: vec![0.0; rows * width],
            filtered: vec![0.0; rows * width],
            phi: vec![0.0; rows],
            by_b: vec![0.0; rows],
            by_a: vec![0.0; rows],
            blocks,
            whitening,
            taps,
            history,
            width,
        }
    }

    /// Computes all signals at the chunk's sample i from the delayed input (`None` before its first sample). Returns the prediction there.
    fn advance(&mut self, i: usize, u: Option<f64>) -> f64 {
        let (row, width) = (self.history + i, self.width);
        let a = self.blocks.linear.a();
        let (older, rest) = self.basis.split_at_mut(row * width);
        let basis = &mut rest[..width];
        match u {
            Some(u) => self.blocks.basis.values(u, basis),
            None => basis.fill(0.0),
        }
        self.phi[row] = dot(&self.coefficients, basis);
        let (before, rest) = self.filtered.split_at_mut(row * width);
        let filtered = &mut rest[..width];
        filtered
            .iter_mut()
            .zip(&*basis)
            .for_each(|(f, q)| *f = self.taps[0] * q);
        for (m, tap) in self.taps.iter().enumerate().skip(1) {
            let earlier = &older[(row - m) * width..][..width];
            filtered.iter_mut().zip(earlier).for_each(|(f, q)| *f += tap * q);
        }
        for (m, a) in (1..).zip(a) {
            let earlier = &before[(row - m) * width..][..width];
            filtered.iter_mut().zip(earlier).for_each(|(f, q)| *f -= a * q);
        }
        let simulated = dot(&self.coefficients, filtered);
        let mut by_b: f64 = self
            .whitening
            .iter()
            .enumerate()
            .map(|(m, r)| r * self.phi[row - m])
            .sum();
        let mut by_a = simulated;
        for (m, a) in (1..).zip(a) {
            by_b -= a * self.by_b[row - m];
            by_a -= a * self.by_a[row - m];
        }
        self.by_b[row] = by_b;
        self.by_a[row] = by_a;
        simulated
    }

    /// The derivatives of the prediction at the chunk's sample i by all parameters.
    fn derivatives(&self, i: usize, gain: f64, out: &mut [f64]) {
        let (row, at) = (self.history + i, &self.layout);
        // The first function of the basis is constant and has no coefficient.
        out[at.c.clone()].copy_from_slice(&self.filtered[row * self.width + 1..][..self.width - 1]);
        out[at.offset] = gain;
        for (j, out) in out[at.b.clone()].iter_mut().enumerate() {
            *out = self.by_b[row - j];
        }
        for (j, out) in (1..).zip(&mut out[at.a.clone()]) {
            *out = -self.by_a[row - j];
        }
    }

    /// Moves the last rows of a chunk of this length to the place of the rows before the next chunk.
    fn keep_history(&mut self, length: usize) {
        let kept = length..length + self.history;
        for rows in [&mut self.basis, &mut self.filtered] {
            rows.copy_within(kept.start * self.width..kept.end * self.width, 0);
        }
        for signal in [&mut self.phi, &mut self.by_b, &mut self.by_a] {
            signal.copy_within(kept.clone(), 0);
        }
    }
}

/// The equations' sums (the lower triangle of J'J), and rows of the Jacobian with their errors that are still to be added.
struct Batch {
    sums: Equations,
    rows: Vec<f64>,
    errors: [f64; ROWS],
    used: usize,
}

impl Batch {
    fn new(parameters: usize) -> Batch {
        Batch {
            sums: Equations {
                normal: NormalEquations::zero(parameters),
                count: 0,
            },
            rows: vec![0.0; ROWS * parameters],
            errors: [0.0; ROWS],
            used: 0,
        }
    }

    /// The row for the derivatives of the next error.
    fn next_row(&mut self, error: f64) -> &mut [f64] {
        if self.used == ROWS {
            self.flush();
        }
        self.errors[self.used] = error;
        self.used += 1;
        let n = self.sums.parameters();
        &mut self.rows[(self.used - 1) * n..][..n]
    }

    fn flush(&mut self) {
        let n = self.sums.parameters();
        self.rows[self.used * n..].fill(0.0);
        self.errors[self.used..].fill(0.0);
        let NormalEquations { cost, descent, normal } = &mut self.sums.normal;
        let (ab, cd) = self.rows.split_at(2 * n);
        let ((a, b), (c, d)) = (ab.split_at(n), cd.split_at(n));
        let e = self.errors;
        for i in 0..n {
            let (pa, pb, pc, pd) = (a[i], b[i], c[i], d[i]);
            descent[i] += pa * e[0] + pb * e[1] + pc * e[2] + pd * e[3];
            let row = &mut normal[i * n..][..=i];
            for ((((m, a), b), c), d) in row.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *m += pa * a + pb * b + pc * c + pd * d;
            }
        }
        *cost += e.iter().map(|e| e * e).sum::<f64>();
        self.sums.count += self.used;
        self.used = 0;
    }
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;
