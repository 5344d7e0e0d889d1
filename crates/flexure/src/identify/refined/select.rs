//! Which breakpoints, and of what kind: stepwise regression of noisy values of a function on its argument.
//!
//! Forward steps add the truncated power $(s - t)_+^d$, d = 0, 1 or 3, that lowers the sum of squares most,
//! for all t at once by running moments; backward steps drop what is not worth its cost; sweeps move each
//! breakpoint to its best place (Friedman & Silverman 1989; Luo & Wahba 1997). A kink or a jump is one function
//! here, where a spline needs many knots.

use super::pieces::{Pieces, Term, Unit};
use crate::nonlinearity::spline::{banded::Banded, basis::CubicSplines};

/// Most cells that the samples are gathered in.
const MOST_CELLS: usize = 1500;
/// The fewest samples of a cell, but where values tie.
const FEWEST_IN_CELL: usize = 3;
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
/// Numbers of evenly placed knots.
const EVEN: [usize; 14] = [1, 2, 3, 5, 7, 9, 11, 14, 17, 21, 26, 32, 40, 50];
/// Sweeps that move the breakpoints.
const SWEEPS: usize = 4;

/// The argument's samples in cells, once for all regressions on it.
pub(super) struct Cells {
    pub unit: Unit,
    /// The cell of every sample.
    of: Vec<u32>,
    /// Number, mean of s, lower limit of every cell.
    count: Vec<f64>,
    s: Vec<f64>,
    lower: Vec<f64>,
    /// Whether every cell holds one value.
    exact: bool,
    /// Sums of (s - t)^(0, 2, 6) over the samples above t = lower[m].
    norms: [Vec<f64>; 3],
}

/// A basis and the values' regression on it.
pub(super) struct Selection {
    pub terms: Vec<Term>,
    pub basis: Pieces,
    /// The coefficients of the basis' functions, the first of which is constant.
    pub coefficients: Vec<f64>,
}

impl Cells {
    /// Gathers the samples that count.
    pub fn new(u: &[f64]) -> Cells {
        let mut sorted = u.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        let unit = Unit::new(sorted[0], sorted[n - 1]);
        let cells = (n / FEWEST_IN_CELL).clamp(1, MOST_CELLS);
        let mut limits: Vec<f64> = Vec::with_capacity(cells);
        let distinct = {
            let mut d: Vec<f64> = sorted.clone();
            d.dedup();
            d
        };
        let exact = distinct.len() <= cells;
        if exact {
            limits.extend(distinct.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]));
        } else {
            for i in 1..cells {
                let k = sorted.partition_point(|v| *v < sorted[i * n / cells]);
                if k > 0 {
                    let t = 0.5 * sorted[k - 1] + 0.5 * sorted[k];
                    if limits.last().is_none_or(|l| t > *l) {
                        limits.push(t);
                    }
                }
            }
        }
        let mut lower = vec![-1.0];
        lower.extend(limits.iter().map(|t| unit.of(*t)));
        lower.dedup();
        let of: Vec<u32> = u
            .iter()
            .map(|x| lower[1..].partition_point(|l| *l <= unit.of(*x)) as u32)
            .collect();
        let mut count = vec![0.0; lower.len()];
        let mut s = vec![0.0; lower.len()];
        for (x, m) in u.iter().zip(&of) {
            count[*m as usize] += 1.0;
            s[*m as usize] += unit.of(*x);
        }
        s.iter_mut().zip(&count).for_each(|(s, c)| *s /= f64::max(*c, 1.0));
        let mut cells = Cells { unit, of, count, s, lower, exact, norms: Default::default() };
        cells.norms = cells.square_norms();
        cells
    }

    /// The samples' values where there are at most so many.
    pub fn levels(&self, most: usize) -> Option<Vec<f64>> {
        (self.exact && self.len() <= most).then(|| self.s.iter().map(|s| self.unit.back(*s)).collect())
    }

    fn len(&self) -> usize {
        self.count.len()
    }

    /// The cells' means of values at the samples.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.len()];
        for (v, m) in values.iter().zip(&self.of) {
            sums[*m as usize] += v;
        }
        sums.iter().zip(&self.count).map(|(s, c)| s / c.max(1.0)).collect()
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.count.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
    }

    /// Sums of w v (s - t)^d, d = 0, 1, 3, over the cells from m on, t = lower[m].
    fn moments(&self, v: &[f64]) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 4];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let d = last - t;
            last = t;
            mu[3] += d * (3.0 * mu[2] + d * (3.0 * mu[1] + d * mu[0]));
            mu[2] += d * (2.0 * mu[1] + d * mu[0]);
            mu[1] += d * mu[0];
            let (wv, x) = (self.count[m] * v[m], self.s[m] - t);
            mu[0] += wv;
            mu[1] += wv * x;
            mu[2] += wv * x * x;
            mu[3] += wv * x * x * x;
            out[0][m] = mu[0];
            out[1][m] = mu[1];
            out[2][m] = mu[3];
        }
        out
    }

    fn square_norms(&self) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 7];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let d = last - t;
            last = t;
            // Pascal's triangle in place: (x + d)^k from x^k, one d at a time.
            for top in 1..7 {
                for k in (top..7).rev() {
                    mu[k] += d * mu[k - 1];
                }
            }
            let (mut p, x) = (self.count[m], self.s[m] - t);
            for mu in &mut mu {
                *mu += p;
                p *= x;
            }
            out[0][m] = mu[0];
            out[1][m] = mu[2];
            out[2][m] = mu[6];
        }
        out
    }
}

/// A regression that grows term by term.
struct Growing<'a> {
    cells: &'a Cells,
    z: &'a [f64],
    terms: Vec<Term>,
    /// Orthonormal over the cells.
    q: Vec<Vec<f64>>,
    /// term_j = sum_i r[j][i] q_i, i <= j.
    r: Vec<Vec<f64>>,
    /// q' z
    d: Vec<f64>,
    /// For every degree and lower limit: product of the candidate with the residual, and what is left of its norm.
    score: [Vec<f64>; 3],
    left: [Vec<f64>; 3],
}

impl<'a> Growing<'a> {
    fn new(cells: &'a Cells, z: &'a [f64], terms: &[Term]) -> Self {
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
    fn add(&mut self, term: Term) -> bool {
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
    fn mix(&self) -> Vec<Vec<f64>> {
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
    fn solution(&self) -> (Vec<f64>, Vec<f64>) {
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

    fn explained(&self) -> f64 {
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

/// Chooses a basis for the regression of the values at the samples `u` from the terms `start` on.
pub(super) fn select(cells: &Cells, u: &[f64], values: &[f64], start: &[Term], costs: &Costs) -> Selection {
    let z = &cells.means(values);
    let powers = (0..4).map(Term::Power);
    let start: Vec<Term> = powers.chain(start.iter().copied().filter(|t| matches!(t, Term::From { .. }))).collect();
    let mut growing = Growing::new(cells, z, &start);
    let least = PATIENCE * costs.of.iter().copied().fold(f64::INFINITY, f64::min);
    while growing.terms.len() < MOST_TERMS {
        match growing.best(costs) {
            Some((term, gain)) if gain > least && growing.add(term) => {}
            _ => break,
        }
    }
    let mut terms = prune(&growing, costs);
    for _ in 0..SWEEPS {
        let (moved, changed) = sweep(cells, z, terms, costs);
        terms = prune(&Growing::new(cells, z, &moved), costs);
        if !changed {
            break;
        }
    }
    let mut fit = Growing::new(cells, z, &terms);
    let net = |g: &Growing| g.explained() - costs.adapted * (g.terms.len() - 4.min(g.terms.len())) as f64;
    if let Some((count, explained)) = even_knots(cells, z, costs.fixed)
        && explained - costs.fixed * count as f64 > net(&fit) + costs.margin
    {
        let knots = even(cells, count).into_iter().map(|at| Term::From { at, degree: 3 });
        fit = Growing::new(cells, z, &(0..4).map(Term::Power).chain(knots).collect::<Vec<_>>());
    }
    let terms = jumps_placed(cells, u, values, &fit);
    let fit = Growing::new(cells, z, &terms);
    Selection {
        basis: Pieces::new(cells.unit, &fit.terms, &fit.mix().concat()),
        coefficients: fit.d,
        terms: fit.terms,
    }
}

/// The terms, their jumps moved from the cells' limits to between the samples where they fit best.
fn jumps_placed(cells: &Cells, u: &[f64], values: &[f64], fit: &Growing) -> Vec<Term> {
    let mut terms = fit.terms.clone();
    let (c, _) = fit.solution();
    let curve = Pieces::new(cells.unit, &fit.terms, &c);
    // By cell: the jumps in reach.
    let mut near = vec![Vec::new(); cells.len()];
    let mut around: Vec<Vec<(f64, f64)>> = vec![Vec::new(); terms.len()];
    for (j, term) in terms.iter().enumerate() {
        if let Term::From { at, degree: 0 } = term {
            let m = cells.lower[1..].partition_point(|l| l <= at);
            for near in &mut near[m.saturating_sub(REACH)..(m + REACH).min(cells.len())] {
                near.push(j);
            }
        }
    }
    for ((x, z), m) in u.iter().zip(values).zip(&cells.of) {
        for &j in &near[*m as usize] {
            around[j].push((cells.unit.of(*x), z - curve.value(*x)));
        }
    }
    for (j, mut points) in around.into_iter().enumerate() {
        if let Term::From { at, degree: 0 } = terms[j] {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            terms[j] = Term::From { at: best_jump(&points, at, c[j]), degree: 0 };
        }
    }
    terms
}

/// Cells either side in which a jump may move.
const REACH: usize = 3;

/// Where a jump of this size fits the residuals, which are those of it at `now`, best.
fn best_jump(points: &[(f64, f64)], now: f64, size: f64) -> f64 {
    let split = points.partition_point(|p| p.0 < now);
    // Moved right past a point, the curve there falls by the jump; moved left, it rises.
    let (mut best, mut at) = (0.0, split);
    let mut change = 0.0;
    for (i, p) in points.iter().enumerate().skip(split) {
        change += (p.1 + size).powi(2) - p.1 * p.1;
        if change < best {
            (best, at) = (change, i + 1);
        }
    }
    change = 0.0;
    for (i, p) in points[..split].iter().enumerate().rev() {
        change += (p.1 - size).powi(2) - p.1 * p.1;
        if change < best {
            (best, at) = (change, i);
        }
    }
    if at == split || at == 0 || at == points.len() || points[at - 1].0 == points[at].0 {
        return now;
    }
    0.5 * (points[at - 1].0 + points[at].0)
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
    let mut now = criterion(&Growing::new(cells, z, &terms));
    let count = terms.iter().filter(|t| matches!(t, Term::From { .. })).count();
    let first = terms.len() - count;
    for _ in 0..count {
        // The oldest goes to the end of the line.
        let moving = terms.remove(first);
        let mut without = Growing::new(cells, z, &terms);
        let better = without.best(costs).filter(|(term, _)| *term != moving && without.add(*term));
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

/// This many knots, evenly by rank.
fn even(cells: &Cells, count: usize) -> Vec<f64> {
    let total: f64 = cells.count.iter().sum();
    let mut knots = Vec::with_capacity(count);
    let (mut m, mut below) = (0, 0.0);
    for i in 1..=count {
        while m + 1 < cells.len() && below < total * i as f64 / (count + 1) as f64 {
            below += cells.count[m];
            m += 1;
        }
        if knots.last().is_none_or(|k| cells.lower[m] > *k) && m > 0 {
            knots.push(cells.lower[m]);
        }
    }
    knots
}

/// The number of evenly placed knots of a cubic spline with the least estimated risk (Mallows' C_p), and what
/// the spline explains.
fn even_knots(cells: &Cells, z: &[f64], cost: f64) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for count in EVEN {
        let inner = even(cells, count);
        if inner.len() < count || 4 * count > cells.len() {
            break;
        }
        let unit = |s: f64| 0.5 * (s + 1.0);
        let breakpoints: Vec<f64> = [0.0].into_iter().chain(inner.iter().map(|s| unit(*s))).chain([1.0]).collect();
        let splines = CubicSplines::new(&breakpoints);
        let mut gram = Banded::zeros(splines.len());
        let mut moment = vec![0.0; splines.len()];
        for ((s, w), z) in cells.s.iter().zip(&cells.count).zip(z) {
            let (at, v) = splines.values(unit(*s));
            gram.add_products(at, &v, *w);
            moment[at..at + 4].iter_mut().zip(v).for_each(|(m, v)| *m += w * v * z);
        }
        let Some(factor) = gram.factor() else { continue };
        let c = factor.solve(moment.clone());
        let explained: f64 = c.iter().zip(&moment).map(|(c, m)| c * m).sum();
        if best.is_none_or(|b| explained - cost * count as f64 > b.1 - cost * b.0 as f64) {
            best = Some((count, explained));
        }
    }
    best
}
