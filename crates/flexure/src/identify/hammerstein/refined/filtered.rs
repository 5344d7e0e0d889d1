//! The nonlinearity's basis under an input that is coloured or held: regression on functions that are filtered as the output is.
//!
//! $$ \tilde y_n = \sum_j c_j\, \tilde G(z)\, h_j(u_n) + \tilde e_n, \quad \tilde G = \frac{R B}{A} z^{-s} $$
//! R whitens the error, so that this is an efficient regression for any input. The memory-removed output of `alternation.rs` is as good for a
//! white input, and a thousand places cost little there; for others its noise depends from sample to sample, and a function is only
//! believed where it would be seen in a single sample.
//!
//! Places are compared on a grid, evenly by rank, then moved on finer ones.

use super::basis::{Selection, even_knots, level_terms, selection};
use super::blocks::Observed;
use super::cells::{Cells, DEGREES};
use super::limits::{
    DEPENDENT, ENTRY_COST, EVEN_KNOTS, FILTERED_PLACES, FILTERED_SAMPLES, FREE_POWERS, GIVEN_COST, GIVEN_MARGIN,
    JUMP_COST, MOST_EVEN_FILTERED, MOST_TERMS, MOVED_PLACES, PATIENCE, SEARCHED_COST,
};
use super::linear_part::LinearPart;
use super::piecewise::Term;
use crate::identify::block::regression;
use crate::interrupt;

/// The whitened output, and the filter from a function of the input to it.
struct Filtered<'a> {
    cells: &'a Cells,
    observed: &'a Observed<'a>,
    filter: &'a LinearPart,
    y: Vec<f64>,
}

/// A regression on some terms.
struct Fit {
    terms: Vec<Term>,
    coefficients: Vec<f64>,
    squares: f64,
    /// What its functions cost, in noise variances.
    cost: f64,
}

/// Chooses a basis for the output behind the linear part `filter`, which whitens too; `whitening` is that part of it.
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
    let searched = data.searched()?;
    let even = data.even();
    let levels = level_terms(cells, observed.u).and_then(|terms| data.given(terms));
    let others: Vec<Fit> = even.into_iter().chain(levels).collect();
    let free = |fit: &Fit| data.y.len().saturating_sub(fit.terms.len()).max(1) as f64;
    let all = others.iter().chain([&searched]);
    let variance = all.map(|fit| fit.squares / free(fit)).fold(f64::INFINITY, f64::min);
    let risk = |fit: &Fit, margin: f64| fit.squares + (fit.cost + margin) * variance;
    let mut best = (risk(&searched, 0.0), searched);
    for fit in others {
        let next = risk(&fit, GIVEN_MARGIN);
        if next < best.0 {
            best = (next, fit);
        }
    }
    Some(best.1.selection(cells))
}

fn counted(signal: &[f64], counts: &[bool]) -> Vec<f64> {
    let pairs = signal.iter().zip(counts);
    pairs.filter(|(_, counts)| **counts).map(|(v, _)| *v).collect()
}

impl Fit {
    fn selection(&self, cells: &Cells) -> Selection {
        let value = |s: &f64| -> f64 {
            let pairs = self.terms.iter().zip(&self.coefficients);
            pairs.map(|(term, c)| c * term.value(*s)).sum()
        };
        let curve: Vec<f64> = cells.s.iter().map(value).collect();
        selection(cells, &curve, &self.terms)
    }
}

impl Filtered<'_> {
    fn column(&self, term: Term) -> Vec<f64> {
        if term == Term::Power(0) {
            return vec![1.0; self.y.len()];
        }
        let of = |x: &f64| term.value(self.cells.unit.of(*x));
        let signal: Vec<f64> = self.observed.u.iter().map(of).collect();
        let filtered = self.filter.filter(&self.observed.experiments, &signal);
        counted(&filtered, &self.observed.counts)
    }

    fn sweep(&self, terms: Vec<Term>) -> Sweep {
        let columns: Vec<Vec<f64>> = terms.iter().map(|term| self.column(*term)).collect();
        Sweep::new(terms, &self.y, &columns)
    }

    /// Jumps, kinks and cubic knots at searched places.
    fn searched(&self) -> Option<Fit> {
        let places = even_knots(self.cells, FILTERED_PLACES);
        let powers = (0..FREE_POWERS as u8).map(Term::Power);
        let breakpoints = places
            .iter()
            .flat_map(|at| DEGREES.map(|degree| Term::TruncatedPower { at: *at, degree }));
        let mut sweep = self.sweep(powers.chain(breakpoints).collect());
        for power in 0..FREE_POWERS {
            sweep.add(power);
        }
        sweep.extend();
        sweep.reduce();
        let mut terms = sweep.chosen();
        let mut spacing = self.cells.len() / (places.len() + 1).max(1);
        while spacing > 1 && terms.len() > FREE_POWERS.min(terms.len()) - 1 {
            if interrupt::requested() {
                return None;
            }
            spacing = spacing.div_ceil(MOVED_PLACES).max(1);
            terms = self.moved(&terms, spacing);
            if spacing == 1 {
                break;
            }
        }
        let mut last = self.sweep(terms);
        (0..last.terms.len()).for_each(|k| last.add(k));
        last.reduce();
        Some(last.fit(SEARCHED_COST))
    }

    /// Every breakpoint where it fits best among places that are so many cells apart.
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

    /// The cubic spline with evenly placed knots of least estimated risk.
    fn even(&self) -> Option<Fit> {
        let knots = EVEN_KNOTS.into_iter().filter(|k| *k <= MOST_EVEN_FILTERED);
        let of = |count: usize| {
            let knots = even_knots(self.cells, count).into_iter();
            let knots = knots.map(|at| Term::TruncatedPower { at, degree: 3 });
            self.given((0..4).map(Term::Power).chain(knots).collect())
        };
        let all: Vec<Fit> = knots.filter_map(of).collect();
        let n = self.y.len() as f64;
        let variance = all.iter().map(|fit| fit.squares / n).fold(f64::INFINITY, f64::min);
        let risk = |fit: &Fit| fit.squares + fit.cost * variance;
        all.into_iter().min_by(|a, b| risk(a).total_cmp(&risk(b)))
    }

    /// The fit on given terms; `None` where they depend on one another.
    fn given(&self, terms: Vec<Term>) -> Option<Fit> {
        let mut sweep = self.sweep(terms);
        (0..sweep.terms.len()).for_each(|k| sweep.add(k));
        sweep.inside.iter().all(|inside| *inside).then(|| sweep.fit(GIVEN_COST))
    }
}

/// A regression whose terms can be added and removed, by the sweep operator on the matrix of all products (Goodnight 1979).
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

    /// By how much the sum of squares falls with a term that is outside.
    fn gain(&self, k: usize) -> f64 {
        let rest = self.at(k, k);
        if self.inside[k] || !(rest > DEPENDENT * self.norms[k]) {
            return f64::NEG_INFINITY;
        }
        self.at(k, self.terms.len()).powi(2) / rest
    }

    /// By how much it rises without a term that is inside.
    fn loss(&self, k: usize) -> f64 {
        self.at(k, self.terms.len()).powi(2) / self.at(k, k)
    }

    /// Takes a term in or out.
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

    /// Takes a term in, unless the others span it.
    fn add(&mut self, k: usize) {
        if self.gain(k).is_finite() {
            self.toggle(k);
        }
    }

    /// Takes in terms while they may pay, as two may only pay together.
    fn extend(&mut self) {
        for _ in 0..MOST_TERMS {
            let best = (0..self.terms.len()).max_by(|i, j| self.gain(*i).total_cmp(&self.gain(*j)));
            let Some(best) = best.filter(|k| self.gain(*k) > PATIENCE * ENTRY_COST * self.variance()) else {
                break;
            };
            self.toggle(best);
        }
    }

    /// Takes out terms that are not worth their cost.
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

    fn fit(&self, each: f64) -> Fit {
        let inside: Vec<usize> = (0..self.terms.len()).filter(|k| self.inside[*k]).collect();
        let breakpoints = inside
            .iter()
            .filter(|k| matches!(self.terms[**k], Term::TruncatedPower { .. }))
            .count();
        Fit {
            coefficients: inside.iter().map(|k| self.at(*k, self.terms.len())).collect(),
            terms: self.chosen(),
            squares: self.squares(),
            cost: each * breakpoints as f64,
        }
    }
}

/// What a term must be worth, in noise variances.
fn price(term: Term) -> f64 {
    match term {
        Term::Power(_) => GIVEN_COST,
        Term::TruncatedPower { degree: 0, .. } => JUMP_COST,
        Term::TruncatedPower { .. } => ENTRY_COST,
    }
}
