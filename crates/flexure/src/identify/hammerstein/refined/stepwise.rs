//! Stepwise regression on truncated powers with breakpoints from the data.
//!
//! Forward steps add the truncated power $(s - t)_+^d$, d = 0, 1 or 3, that lowers the sum of squares most,
//! for all t at once by running moments; backward steps drop what is not worth its cost; sweeps move each
//! breakpoint to its best place (Friedman & Silverman 1989; Luo & Wahba 1997). A kink or a jump is one function
//! here, where a spline needs many knots.

use super::cells::Cells;
use super::pieces::Term;
use crate::interrupt;

/// Most functions of a basis.
const MOST_TERMS: usize = 40;
/// A candidate of which no more than this share is left by the others is none.
const DEPENDENT: f64 = 1e-9;
/// A term of which no more is left is a combination of the others.
const ROUNDING: f64 = 1e-13;
/// Degrees of the truncated powers.
const DEGREES: [u8; 3] = [0, 1, 3];
/// Forward steps go on while the gain exceeds this share of a function's cost: two may only pay together.
const PATIENCE: f64 = 0.4;
/// More breakpoints than this are not moved.
const MOST_MOVED: usize = 16;
/// Sweeps that move the breakpoints.
const SWEEPS: usize = 4;

/// A regression that grows term by term.
pub(super) struct Growing<'a> {
    cells: &'a Cells,
    z: &'a [f64],
    pub terms: Vec<Term>,
    /// Orthonormal over the cells.
    q: Vec<Vec<f64>>,
    /// term_j = sum_i r[j][i] q_i, i <= j.
    r: Vec<Vec<f64>>,
    /// q' z
    pub d: Vec<f64>,
    /// For every degree and lower limit: product of the candidate with the residual, and what is left of its norm.
    score: [Vec<f64>; 3],
    left: [Vec<f64>; 3],
}

impl<'a> Growing<'a> {
    pub fn new(cells: &'a Cells, z: &'a [f64], terms: &[Term]) -> Self {
        let mut growing = Growing {
            cells,
            z,
            terms: Vec::new(),
            q: Vec::new(),
            r: Vec::new(),
            d: Vec::new(),
            score: cells.moments(z),
            left: cells.norms.clone(),
        };
        for term in terms {
            growing.add(*term);
        }
        growing
    }

    /// Adds a term, unless the others span it.
    pub fn add(&mut self, term: Term) -> bool {
        let cells = self.cells;
        let mut v: Vec<f64> = cells.s.iter().map(|s| term.value(*s)).collect();
        let size = cells.dot(&v, &v);
        let mut r = vec![0.0; self.q.len() + 1];
        for _ in 0..2 {
            for (q, r) in self.q.iter().zip(&mut r) {
                let share = cells.dot(q, &v);
                *r += share;
                v.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
            }
        }
        let rest = cells.dot(&v, &v);
        if !(rest > ROUNDING * size) {
            return false;
        }
        let norm = rest.sqrt();
        r[self.q.len()] = norm;
        v.iter_mut().for_each(|v| *v /= norm);
        let d = cells.dot(&v, self.z);
        let p = cells.moments(&v);
        for k in 0..3 {
            for ((s, l), p) in self.score[k].iter_mut().zip(&mut self.left[k]).zip(&p[k]) {
                *s -= d * p;
                *l -= p * p;
            }
        }
        self.terms.push(term);
        self.q.push(v);
        self.r.push(r);
        self.d.push(d);
        true
    }

    /// The candidate with the largest gain less its cost, and its gain.
    fn best(&self, costs: &Costs) -> Option<(Term, f64)> {
        let mut best: Option<(Term, f64, f64)> = None;
        for (k, degree) in DEGREES.into_iter().enumerate() {
            for m in 1..self.cells.len() {
                let left = self.left[k][m];
                if !(left > DEPENDENT * self.cells.norms[k][m]) || (degree == 0 && left < costs.fewest) {
                    continue;
                }
                let gain = self.score[k][m] * self.score[k][m] / left;
                let net = gain - costs.of[k];
                if best.is_none_or(|b| net > b.2) {
                    let at = self.cells.lower[m];
                    best = Some((Term::From { at, degree }, gain, net));
                }
            }
        }
        best.map(|b| (b.0, b.1))
    }

    /// The rows of the inverse of r: q_i = sum_j mix[i][j] term_j.
    pub fn mix(&self) -> Vec<Vec<f64>> {
        let n = self.r.len();
        let mut mix = vec![vec![0.0; n]; n];
        for i in 0..n {
            // q_i = (term_i - sum_{k<i} r[i][k] q_k) / r[i][i]
            mix[i][i] = 1.0;
            for k in 0..i {
                let share = self.r[i][k];
                let (done, now) = mix.split_at_mut(i);
                now[0].iter_mut().zip(&done[k]).for_each(|(a, b)| *a -= share * b);
            }
            let norm = self.r[i][i];
            mix[i].iter_mut().for_each(|v| *v /= norm);
        }
        mix
    }

    /// The terms' coefficients and the inverse of their Gram matrix, row-major.
    pub fn solution(&self) -> (Vec<f64>, Vec<f64>) {
        let (mix, n) = (self.mix(), self.terms.len());
        let mut c = vec![0.0; n];
        let mut inverse = vec![0.0; n * n];
        for (row, d) in mix.iter().zip(&self.d) {
            for j in 0..n {
                c[j] += row[j] * d;
                for k in 0..n {
                    inverse[j * n + k] += row[j] * row[k];
                }
            }
        }
        (c, inverse)
    }

    /// The number of terms with a breakpoint.
    pub fn breakpoints(&self) -> usize {
        self.terms.iter().filter(|t| matches!(t, Term::From { .. })).count()
    }

    pub fn explained(&self) -> f64 {
        self.d.iter().map(|d| d * d).sum()
    }
}

/// What a function must gain to be worth it, in the squared unit of the values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Costs {
    /// By degree 0, 1, 3 of truncated powers.
    pub of: [f64; 3],
    /// Of x^2 and x^3.
    pub power: f64,
    /// Of a function with a searched breakpoint, in the estimate of the risk.
    pub adapted: f64,
    /// Of one with a given breakpoint.
    pub fixed: f64,
    /// By how much given breakpoints must be better than searched ones.
    pub margin: f64,
    /// The fewest samples either side of a jump.
    pub fewest: f64,
}

impl Costs {
    /// The same without jumps and kinks.
    pub fn smooth(&self) -> Costs {
        Costs {
            of: [f64::INFINITY, f64::INFINITY, self.of[2]],
            ..*self
        }
    }

    fn term(&self, term: Term) -> f64 {
        match term {
            Term::Power(0 | 1) => f64::NEG_INFINITY,
            Term::Power(_) => self.power,
            Term::From { degree: 0, .. } => self.of[0],
            Term::From { degree: 1, .. } => self.of[1],
            Term::From { .. } => self.of[2],
        }
    }
}

/// Forward steps from the given breakpoints, backward steps, and sweeps.
pub(super) fn stepwise<'a>(cells: &'a Cells, z: &'a [f64], start: &[Term], costs: &Costs) -> Growing<'a> {
    let powers = (0..4).map(Term::Power);
    let breakpoints = start.iter().copied().filter(|t| matches!(t, Term::From { .. }));
    let mut growing = Growing::new(cells, z, &powers.chain(breakpoints).collect::<Vec<_>>());
    let least = PATIENCE * costs.of.iter().copied().fold(f64::INFINITY, f64::min);
    while growing.terms.len() < MOST_TERMS && !interrupt::requested() {
        match growing.best(costs) {
            Some((term, gain)) if gain > least && growing.add(term) => {}
            _ => break,
        }
    }
    let mut fit = Growing::new(cells, z, &prune(&growing, costs));
    for _ in 0..SWEEPS {
        if fit.breakpoints() > MOST_MOVED || interrupt::requested() {
            break;
        }
        let (moved, changed) = sweep(cells, z, fit.terms, costs);
        fit = Growing::new(cells, z, &moved);
        if !changed {
            break;
        }
        fit = Growing::new(cells, z, &prune(&fit, costs));
    }
    fit
}

/// The terms that are left when the least worthy is dropped until all are worth their cost.
fn prune(fit: &Growing, costs: &Costs) -> Vec<Term> {
    let n = fit.terms.len();
    let (mut c, mut inverse) = fit.solution();
    let mut kept: Vec<usize> = (0..n).collect();
    loop {
        // Without term j the sum of squares rises by c_j^2 over the inverse's diagonal entry.
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

/// Moves every breakpoint in turn to where it gains most, of whatever degree.
fn sweep(cells: &Cells, z: &[f64], mut terms: Vec<Term>, costs: &Costs) -> (Vec<Term>, bool) {
    let mut changed = false;
    let criterion = |g: &Growing| g.explained() - g.terms.iter().map(|t| costs.term(*t).max(0.0)).sum::<f64>();
    let here = Growing::new(cells, z, &terms);
    let (mut now, count) = (criterion(&here), here.breakpoints());
    let first = terms.len() - count;
    for _ in 0..count {
        if interrupt::requested() {
            break;
        }
        // The oldest goes to the end of the line.
        let moving = terms.remove(first);
        let mut without = Growing::new(cells, z, &terms);
        let better = without
            .best(costs)
            .filter(|(term, _)| *term != moving && without.add(*term));
        let next = criterion(&without);
        match better {
            Some((term, _)) if next > now + 1e-9 * now.abs() => {
                terms.push(term);
                (now, changed) = (next, true);
            }
            _ => terms.push(moving),
        }
    }
    (terms, changed)
}

#[cfg(test)]
#[path = "stepwise_tests.rs"]
mod tests;
