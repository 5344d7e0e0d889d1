//! The nonlinearity's basis for a coloured or held input: regression on functions that are filtered like the output.
//!
//! $$ \tilde y_n = \sum_j c_j\, \tilde G(z)\, h_j(u_n) + \tilde e_n, \quad \tilde G = \frac{R B}{A} z^{-s} $$
//! R whitens the error, so this regression is efficient for any input. For a white input the memory-removed output of `alternation.rs` is
//! as good, and faster. For others its noise is correlated from sample to sample. A breakpoint there must be penalised as if only one
//! sample showed it, so kinks that the record shows clearly are missed.
//!
//! Breakpoints are first chosen among places evenly spaced by rank, then moved in finer and finer steps.

use super::basis::{Selection, even_knots, selection};
use super::blocks::Observed;
use super::cells::{Cells, DEGREES};
use super::limits::{
    CELLS_BETWEEN, DEPENDENT, ENTRY_COST, FILTERED_PLACES, FILTERED_SAMPLES, FREE_POWERS, GIVEN_COST, JUMP_COST,
    MOST_TERMS, MOVED_PLACES, PATIENCE, SWEEPS,
};
use super::linear_part::LinearPart;
use super::piecewise::{Term, powers};
use crate::interrupt;
use crate::linear::least_squares::regression;

/// The whitened output, and the filter from a function of the input to it.
struct Filtered<'a> {
    cells: &'a Cells,
    observed: &'a Observed<'a>,
    filter: &'a LinearPart,
    y: Vec<f64>,
}

/// Chooses a basis for the output of the linear part `filter`. This includes the whitening filter `whitening`.
pub(super) fn select_filtered(
    cells: &Cells,
    observed: &Observed,
    filter: &LinearPart,
    whitening: &[f64],
) -> Option<Selection> {
    let head = observed.head(FILTERED_SAMPLES);
    let white = LinearPart::moving_average(whitening).filter(&head.experiments, &head.y);
    let data = Filtered {
        cells,
        observed: &head,
        filter,
        y: counted(&white, &head.counts),
    };
    data.searched().map(|sweep| sweep.selection(cells))
}

/// Places evenly by rank, and others between two that are far apart if cells lie there.
///
/// Where a controlled input stays only for short times there are few samples, and no place by rank is near a kink.
fn places(cells: &Cells) -> Vec<f64> {
    let spacing = 2.0 / FILTERED_PLACES as f64;
    let mut by_rank = even_knots(cells, FILTERED_PLACES).into_iter().peekable();
    let mut places = Vec::new();
    let (mut last, mut cells_since) = (-1.0, 0);
    for &limit in &cells.lower[1..] {
        cells_since += 1;
        let is_by_rank = by_rank.next_if(|place| *place <= limit).is_some();
        let to = by_rank.peek().copied().unwrap_or(1.0);
        let is_far = limit - last >= spacing && to - limit >= 0.5 * spacing && cells_since >= CELLS_BETWEEN;
        if is_by_rank || is_far {
            places.push(limit);
            (last, cells_since) = (limit, 0);
        }
    }
    places
}

/// The samples that count.
fn counted(signal: &[f64], counts: &[bool]) -> Vec<f64> {
    let pairs = signal.iter().zip(counts);
    pairs.filter(|(_, counts)| **counts).map(|(v, _)| *v).collect()
}

impl Filtered<'_> {
    /// A term filtered like the output, at the samples that count.
    fn column(&self, term: Term) -> Vec<f64> {
        if term == Term::Power(0) {
            return vec![1.0; self.y.len()];
        }
        let of = |x: &f64| term.value(self.cells.unit.of(*x));
        let signal: Vec<f64> = self.observed.u.iter().map(of).collect();
        let filtered = self.filter.filter(&self.observed.experiments, &signal);
        counted(&filtered, &self.observed.counts)
    }

    /// A regression on none of these terms yet.
    fn sweep(&self, terms: Vec<Term>) -> Sweep {
        let columns: Vec<Vec<f64>> = terms.iter().map(|term| self.column(*term)).collect();
        Sweep::new(terms, &self.y, &columns)
    }

    /// Jumps, kinks and cubic knots at searched places.
    fn searched(&self) -> Option<Sweep> {
        let places = places(self.cells);
        let breakpoints = places
            .iter()
            .flat_map(|at| DEGREES.map(|degree| Term::TruncatedPower { at: *at, degree }));
        let all = self.sweep(powers().chain(breakpoints).collect());
        // Starts from a straight line and from a cubic: with a cubic, kinks may get wrong places; with a line, a smooth curve needs many.
        let starts = [2, usize::from(FREE_POWERS)].map(|count| all.clone().chosen_from(count));
        let variance = starts.iter().map(Sweep::variance).fold(f64::INFINITY, f64::min);
        let risk = |sweep: &Sweep| sweep.squares() + variance * sweep.price();
        let best = starts.iter().min_by(|a, b| risk(a).total_cmp(&risk(b)))?;
        let mut terms = best.chosen();
        let mut spacing = self.cells.len() / (places.len() + 1);
        while spacing > 1 {
            if interrupt::requested() {
                return None;
            }
            spacing = spacing.div_ceil(MOVED_PLACES);
            terms = self.moved(&terms, spacing);
        }
        let mut last = self.sweep(terms);
        (0..last.terms.len()).for_each(|k| last.add(k));
        last.reduce();
        Some(last)
    }

    /// The terms with every breakpoint at its best place, among places that are `spacing` cells apart.
    fn moved(&self, terms: &[Term], spacing: usize) -> Vec<Term> {
        let mut all = terms.to_vec();
        // The other places of each term, as ranges of `all`.
        let mut near = Vec::new();
        for term in terms {
            let first = all.len();
            if let Term::TruncatedPower { at, degree } = *term {
                let m = self.cells.lower[1..].partition_point(|l| *l <= at);
                let steps = (1..=MOVED_PLACES).map(|k| k * spacing);
                let places = steps.flat_map(|step| [m.checked_sub(step), Some(m + step)]).flatten();
                let inner = places.filter(|m| (1..self.cells.len()).contains(m));
                all.extend(inner.map(|m| Term::TruncatedPower {
                    at: self.cells.lower[m],
                    degree,
                }));
            }
            near.push(first..all.len());
        }
        let mut sweep = self.sweep(all);
        (0..terms.len()).for_each(|k| sweep.add(k));
        for (k, near) in near.into_iter().enumerate() {
            if !sweep.inside[k] || near.is_empty() {
                continue;
            }
            sweep.toggle(k);
            let best = near.chain([k]).max_by(|i, j| sweep.gain(*i).total_cmp(&sweep.gain(*j)));
            sweep.toggle(best.unwrap_or(k));
        }
        sweep.chosen()
    }
}

/// A regression whose terms can be added and removed, by the sweep operator on the matrix of all products (Goodnight 1979).
#[derive(Clone)]
struct Sweep {
    terms: Vec<Term>,
    inside: Vec<bool>,
    /// Row-major, with the products of the output in the last row and column.
    matrix: Vec<f64>,
    norms: Vec<f64>,
    samples: usize,
}

impl Sweep {
    fn new(terms: Vec<Term>, y: &[f64], columns: &[Vec<f64>]) -> Sweep {
        let equations = regression(y, columns, 0);
        let (n, size) = (terms.len(), terms.len() + 1);
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            matrix[i * size..][..n].copy_from_slice(&equations.normal[i * n..][..n]);
            matrix[i * size + n] = equations.descent[i];
            matrix[n * size + i] = equations.descent[i];
        }
        matrix[n * size + n] = equations.cost;
        Sweep {
            inside: vec![false; n],
            norms: (0..n).map(|i| matrix[i * size + i]).collect(),
            samples: y.len(),
            terms,
            matrix,
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.matrix[i * (self.terms.len() + 1) + j]
    }

    fn squares(&self) -> f64 {
        self.at(self.terms.len(), self.terms.len()).max(0.0)
    }

    fn variance(&self) -> f64 {
        let used = self.inside.iter().filter(|inside| **inside).count();
        self.squares() / self.samples.saturating_sub(used).max(1) as f64
    }

    /// The decrease of the sum of squares with one more term.
    fn gain(&self, k: usize) -> f64 {
        let rest = self.at(k, k);
        if self.inside[k] || !(rest > DEPENDENT * self.norms[k]) {
            return f64::NEG_INFINITY;
        }
        self.at(k, self.terms.len()).powi(2) / rest
    }

    /// The increase of the sum of squares without one of the terms.
    fn loss(&self, k: usize) -> f64 {
        self.at(k, self.terms.len()).powi(2) / self.at(k, k)
    }

    /// Adds or removes a term.
    fn toggle(&mut self, k: usize) {
        let size = self.terms.len() + 1;
        let pivot = self.at(k, k);
        let mut row = self.matrix[k * size..][..size].to_vec();
        row.iter_mut().for_each(|v| *v /= pivot);
        for i in (0..size).filter(|i| *i != k) {
            let own = &mut self.matrix[i * size..][..size];
            let factor = own[k];
            own.iter_mut().zip(&row).for_each(|(v, r)| *v -= factor * r);
            own[k] = -factor / pivot;
        }
        row[k] = 1.0 / pivot;
        self.matrix[k * size..][..size].copy_from_slice(&row);
        self.inside[k] = !self.inside[k];
    }

    /// Adds a term, unless the others span it.
    fn add(&mut self, k: usize) {
        if self.gain(k).is_finite() {
            self.toggle(k);
        }
    }

    /// The regression with the terms that are worth their price; the search begins with the first `count` terms.
    fn chosen_from(mut self, count: usize) -> Sweep {
        (0..count).for_each(|k| self.add(k));
        for _ in 0..SWEEPS {
            let before = self.inside.clone();
            self.extend();
            self.reduce();
            self.exchange();
            if self.inside == before {
                break;
            }
        }
        self.reduce();
        self
    }

    /// Replaces each term with a breakpoint by the best available one.
    fn exchange(&mut self) {
        for k in 0..self.terms.len() {
            if self.inside[k] && self.terms[k].is_breakpoint() {
                self.toggle(k);
                self.toggle(self.best().unwrap_or(k));
            }
        }
    }

    /// The unused term that lowers the sum of squares most.
    fn best(&self) -> Option<usize> {
        (0..self.terms.len()).max_by(|i, j| self.gain(*i).total_cmp(&self.gain(*j)))
    }

    /// The total price of the used terms, in noise variances.
    fn price(&self) -> f64 {
        self.chosen().into_iter().map(price).sum()
    }

    /// Adds terms as long as they may be worth it: two may be worth their price only together.
    fn extend(&mut self) {
        for _ in 0..MOST_TERMS {
            let Some(best) = self
                .best()
                .filter(|k| self.gain(*k) > PATIENCE * ENTRY_COST * self.variance())
            else {
                break;
            };
            self.toggle(best);
        }
    }

    /// Removes terms that are not worth their cost.
    fn reduce(&mut self) {
        loop {
            let removable = |k: &usize| self.inside[*k] && self.terms[*k] != Term::Power(0);
            let excess = |k: usize| self.loss(k) / self.variance() - price(self.terms[k]);
            let least = (0..self.terms.len())
                .filter(removable)
                .min_by(|i, j| excess(*i).total_cmp(&excess(*j)));
            let used = self.inside.iter().filter(|inside| **inside).count();
            match least.filter(|k| used > 2 && excess(*k) < 0.0) {
                Some(k) => self.toggle(k),
                None => return,
            }
        }
    }

    fn chosen(&self) -> Vec<Term> {
        let pairs = self.terms.iter().zip(&self.inside);
        pairs.filter(|(_, inside)| **inside).map(|(term, _)| *term).collect()
    }

    /// The basis of the used terms, with the coefficients of this curve.
    fn selection(&self, cells: &Cells) -> Selection {
        let inside: Vec<usize> = (0..self.terms.len()).filter(|k| self.inside[*k]).collect();
        let value = |s: &f64| -> f64 {
            let parts = inside
                .iter()
                .map(|k| self.at(*k, self.terms.len()) * self.terms[*k].value(*s));
            parts.sum()
        };
        let curve: Vec<f64> = cells.s.iter().map(value).collect();
        selection(cells, &curve, &self.chosen())
    }
}

/// The price of a term, in noise variances.
fn price(term: Term) -> f64 {
    match term {
        Term::Power(_) => GIVEN_COST,
        Term::TruncatedPower { degree: 0, .. } => JUMP_COST,
        Term::TruncatedPower { .. } => ENTRY_COST,
    }
}

#[cfg(test)]
#[path = "filtered_tests.rs"]
mod tests;
