//! The nonlinearity's basis: searched breakpoints, cubic knots alone, or evenly placed ones, whichever has the
//! least estimated risk.

use super::cells::Cells;
use super::pieces::{Pieces, Term};
use super::stepwise::{Costs, Growing, stepwise};
use crate::nonlinearity::spline::{banded::Banded, basis::CubicSplines};

/// Numbers of evenly placed knots.
const EVEN: [usize; 14] = [1, 2, 3, 5, 7, 9, 11, 14, 17, 21, 26, 32, 40, 50];
/// Evenly placed knots within so many adapted functions' cost: cubic knots alone are worth a search.
const SMOOTH: f64 = 2.0;
/// Cells either side in which a jump may move.
const REACH: usize = 3;

/// A basis and the values' regression on it.
pub(super) struct Selection {
    pub terms: Vec<Term>,
    pub basis: Pieces,
    /// The coefficients of the basis' functions, the first of which is constant.
    pub coefficients: Vec<f64>,
}

/// Chooses a basis for the regression of the values at the samples `u` from the terms `start` on.
pub(super) fn select(cells: &Cells, u: &[f64], values: &[f64], start: &[Term], costs: &Costs) -> Selection {
    let z = &cells.means(values);
    let net = |g: &Growing| g.explained() - costs.adapted * g.breakpoints() as f64;
    let mut fit = stepwise(cells, z, start, costs);
    if let Some((count, explained)) = even_knots(cells, z, costs.fixed) {
        let even_net = explained - costs.fixed * count as f64;
        // Where given knots do far worse, the nonlinearity is not smooth.
        let rough = fit.terms.iter().any(|t| matches!(t, Term::From { degree: 0 | 1, .. }));
        if rough && even_net > net(&fit) - SMOOTH * costs.adapted {
            let smooth = stepwise(cells, z, &[], &costs.smooth());
            if net(&smooth) > net(&fit) {
                fit = smooth;
            }
        }
        if even_net > net(&fit) + costs.margin {
            let knots = even(cells, count).into_iter().map(|at| Term::From { at, degree: 3 });
            fit = Growing::new(cells, z, &(0..4).map(Term::Power).chain(knots).collect::<Vec<_>>());
        }
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
            terms[j] = Term::From {
                at: best_jump(&points, at, c[j]),
                degree: 0,
            };
        }
    }
    terms
}

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
        let breakpoints: Vec<f64> = [0.0]
            .into_iter()
            .chain(inner.iter().map(|s| unit(*s)))
            .chain([1.0])
            .collect();
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

#[cfg(test)]
#[path = "select_tests.rs"]
pub(super) mod tests;
