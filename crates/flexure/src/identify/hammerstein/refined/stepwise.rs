//! Stepwise regression on truncated powers with breakpoints from the data.
//!
//! Forward steps add the truncated power $(s - t)_+^d$, d = 0, 1 or 3, that lowers the sum of squares most. All t are compared
//! at once by running sums. Backward steps drop each function that is not worth its cost. Sweeps move every breakpoint to its best
//! place (Friedman & Silverman 1989; Luo & Wahba 1997). A kink or a jump is one function here; a spline needs many knots for it.

use super::cells::{Cells, DEGREES};
use super::limits::{
    DEPENDENT, ENTRY_COST, FEWEST_AT_JUMP, LEAST_GAIN, MOST_MOVED, MOST_TERMS, PATIENCE, ROUNDING, SWEEPS,
};
use super::piecewise::{Term, powers};
use crate::interrupt;
use crate::vectors::add;

/// A regression of the cells' values z that is extended term by term.
///
/// The terms are orthonormalised over the cells (Gram-Schmidt): term_j = sum_{i <= j} r[j][i] q_i. Then a further candidate v lowers
/// the sum of squares by
/// $$ \frac{\langle v, \text{residual} \rangle^2}{\|v\|^2 - \sum_i \langle v, q_i \rangle^2}. $$
/// Numerator and denominator are kept for every candidate, the truncated powers of all degrees at all cells' lower limits. A new q
/// changes them by its products with all candidates, which are running sums ([`Cells::moments`]).
pub(super) struct OrthogonalFit<'a> {
    cells: &'a Cells,
    z: &'a [f64],
    pub terms: Vec<Term>,
    q: Vec<Vec<f64>>,
    r: Vec<Vec<f64>>,
    /// The products of q and z: the coefficients of q.
    pub coefficients: Vec<f64>,
    /// The product of every candidate with the residual, by degree and cell.
    product: [Vec<f64>; 3],
    /// The squared norm of every candidate without its part along q.
    norm: [Vec<f64>; 3],
}

/// A term that may be added, and the decrease of the sum of squares by it.
#[derive(Clone, Copy)]
struct NextTerm {
    term: Term,
    gain: f64,
}

/// The terms' coefficients and the inverse of their Gram matrix, row-major.
pub(super) struct TermCoefficients {
    pub coefficients: Vec<f64>,
    inverse: Vec<f64>,
}

impl<'a> OrthogonalFit<'a> {
    pub fn new(cells: &'a Cells, z: &'a [f64], terms: &[Term]) -> Self {
        let mut fit = OrthogonalFit {
            cells,
            z,
            terms: Vec::new(),
            q: Vec::new(),
            r: Vec::new(),
            coefficients: Vec::new(),
            product: cells.moments(z),
            norm: cells.norms.clone(),
        };
        for term in terms {
            fit.add(*term);
        }
        fit
    }

    /// Adds a term, unless the others span it.
    pub fn add(&mut self, term: Term) -> bool {
        let cells = self.cells;
        let mut v: Vec<f64> = cells.s.iter().map(|s| term.value(*s)).collect();
        let size = cells.dot(&v, &v);
        let mut r = vec![0.0; self.q.len() + 1];
        // Two passes make it orthogonal to within rounding.
        for _ in 0..2 {
            for (q, r) in self.q.iter().zip(&mut r) {
                let share = cells.dot(q, &v);
                *r += share;
                add(&mut v, -share, q);
            }
        }
        let rest = cells.dot(&v, &v);
        if !(rest > ROUNDING * size) {
            return false;
        }
        let norm = rest.sqrt();
        r[self.q.len()] = norm;
        v.iter_mut().for_each(|v| *v /= norm);
        let coefficient = cells.dot(&v, self.z);
        let along = cells.moments(&v);
        for k in 0..DEGREES.len() {
            for ((product, norm), p) in self.product[k].iter_mut().zip(&mut self.norm[k]).zip(&along[k]) {
                *product -= coefficient * p;
                *norm -= p * p;
            }
        }
        self.terms.push(term);
        self.q.push(v);
        self.r.push(r);
        self.coefficients.push(coefficient);
        true
    }

    /// The candidate with the largest gain.
    fn best(&self, costs: &Costs) -> Option<NextTerm> {
        let mut best: Option<NextTerm> = None;
        for (k, degree) in DEGREES.into_iter().enumerate().filter(|(_, d)| costs.allows(*d)) {
            for m in 1..self.cells.len() {
                let norm = self.norm[k][m];
                if !(norm > DEPENDENT * self.cells.norms[k][m]) || (degree == 0 && norm < FEWEST_AT_JUMP) {
                    continue;
                }
                let gain = self.product[k][m] * self.product[k][m] / norm;
                if best.is_none_or(|b| gain > b.gain) {
                    let at = self.cells.lower[m];
                    let term = Term::TruncatedPower { at, degree };
                    best = Some(NextTerm { term, gain });
                }
            }
        }
        best
    }

    /// The inverse of r: q_i = sum_j inverse[i][j] term_j.
    pub fn inverse_of_r(&self) -> Vec<Vec<f64>> {
        let n = self.r.len();
        let mut inverse = vec![vec![0.0; n]; n];
        for i in 0..n {
            // q_i = (term_i - sum_{k<i} r[i][k] q_k) / r[i][i]
            inverse[i][i] = 1.0;
            for k in 0..i {
                let share = self.r[i][k];
                let (done, now) = inverse.split_at_mut(i);
                add(&mut now[0], -share, &done[k]);
            }
            let norm = self.r[i][i];
            inverse[i].iter_mut().for_each(|v| *v /= norm);
        }
        inverse
    }

    /// The coefficients of the terms themselves.
    pub fn solution(&self) -> TermCoefficients {
        let (inverse_of_r, n) = (self.inverse_of_r(), self.terms.len());
        let mut c = vec![0.0; n];
        let mut inverse = vec![0.0; n * n];
        for (row, d) in inverse_of_r.iter().zip(&self.coefficients) {
            for j in 0..n {
                c[j] += row[j] * d;
                for k in 0..n {
                    inverse[j * n + k] += row[j] * row[k];
                }
            }
        }
        TermCoefficients {
            coefficients: c,
            inverse,
        }
    }

    /// The number of terms with a breakpoint.
    pub fn breakpoints(&self) -> usize {
        self.terms.iter().filter(|term| term.is_breakpoint()).count()
    }

    /// The decrease of the sum of squares by the terms.
    pub fn explained(&self) -> f64 {
        self.coefficients.iter().map(|d| d * d).sum()
    }
}

/// The costs that a function's gain must exceed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Costs {
    /// The noise's variance in a sample, the unit of all costs.
    pub variance: f64,
    /// Whether jumps and kinks are excluded.
    pub smooth: bool,
}

impl Costs {
    fn allows(&self, degree: u8) -> bool {
        degree == 3 || !self.smooth
    }

    /// The least gain of a function.
    fn entry(&self) -> f64 {
        ENTRY_COST * self.variance
    }

    /// The least gain of this term; a straight line is free.
    fn term(&self, term: Term) -> f64 {
        match term {
            Term::Power(0 | 1) => f64::NEG_INFINITY,
            _ => self.entry(),
        }
    }
}

/// Forward steps from the given breakpoints, backward steps, and sweeps.
pub(super) fn stepwise<'a>(cells: &'a Cells, z: &'a [f64], start: &[Term], costs: &Costs) -> OrthogonalFit<'a> {
    let breakpoints = start.iter().copied().filter(Term::is_breakpoint);
    let mut fit = OrthogonalFit::new(cells, z, &powers().chain(breakpoints).collect::<Vec<_>>());
    let least = PATIENCE * costs.entry();
    while fit.terms.len() < MOST_TERMS && !interrupt::requested() {
        match fit.best(costs) {
            Some(NextTerm { term, gain }) if gain > least && fit.add(term) => {}
            _ => break,
        }
    }
    let mut fit = OrthogonalFit::new(cells, z, &prune(&fit, costs));
    for _ in 0..SWEEPS {
        if fit.breakpoints() > MOST_MOVED || interrupt::requested() {
            break;
        }
        let Some(moved) = sweep(cells, z, fit.terms.clone(), costs) else {
            break;
        };
        let moved = OrthogonalFit::new(cells, z, &moved);
        fit = OrthogonalFit::new(cells, z, &prune(&moved, costs));
    }
    fit
}

/// Drops the least valuable term until all are worth their cost. Returns the remaining terms.
///
/// Without term j the sum of squares rises by c_j^2 / v_jj, with v the inverse of the terms' Gram matrix. The other coefficients and
/// the inverse follow without a new fit: c_k becomes c_k - c_j v_kj / v_jj, and v_kl becomes v_kl - v_kj v_lj / v_jj.
fn prune(fit: &OrthogonalFit, costs: &Costs) -> Vec<Term> {
    let n = fit.terms.len();
    let TermCoefficients {
        coefficients: mut c,
        mut inverse,
    } = fit.solution();
    let mut kept: Vec<usize> = (0..n).collect();
    loop {
        let worst = kept
            .iter()
            .map(|&j| (j, c[j] * c[j] / inverse[j * n + j] - costs.term(fit.terms[j])))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((j, net)) = worst else { break };
        if !(net < 0.0) {
            break;
        }
        kept.retain(|&k| k != j);
        let column: Vec<f64> = (0..n).map(|k| inverse[k * n + j]).collect();
        let (share, pivot) = (c[j] / column[j], column[j]);
        for &k in &kept {
            c[k] -= column[k] * share;
            for &l in &kept {
                inverse[k * n + l] -= column[k] * column[l] / pivot;
            }
        }
    }
    kept.into_iter().map(|j| fit.terms[j]).collect()
}

/// Moves every breakpoint in turn to its best place, with any degree. Returns the terms; `None` if none has moved.
fn sweep(cells: &Cells, z: &[f64], mut terms: Vec<Term>, costs: &Costs) -> Option<Vec<Term>> {
    let mut changed = false;
    let criterion = |g: &OrthogonalFit| g.explained() - g.terms.iter().map(|t| costs.term(*t).max(0.0)).sum::<f64>();
    let here = OrthogonalFit::new(cells, z, &terms);
    let (mut now, count) = (criterion(&here), here.breakpoints());
    let first = terms.len() - count;
    for _ in 0..count {
        if interrupt::requested() {
            break;
        }
        // The oldest is taken out, and its replacement goes to the end.
        let moving = terms.remove(first);
        let mut without = OrthogonalFit::new(cells, z, &terms);
        let better = without
            .best(costs)
            .filter(|better| better.term != moving && without.add(better.term));
        let next = criterion(&without);
        match better {
            Some(better) if next > now + LEAST_GAIN * now.abs() => {
                terms.push(better.term);
                (now, changed) = (next, true);
            }
            _ => terms.push(moving),
        }
    }
    changed.then_some(terms)
}

#[cfg(test)]
#[path = "stepwise_tests.rs"]
mod tests;
