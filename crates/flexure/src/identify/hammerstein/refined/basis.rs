//! The nonlinearity's basis: searched breakpoints, searched cubic knots alone, or evenly placed ones, whichever has the least estimated risk.

use super::blocks::Blocks;
use super::cells::Cells;
use super::limits::{CELLS_PER_KNOT, EVEN_KNOTS, GIVEN_COST, GIVEN_MARGIN, JUMP_REACH, NEARLY_SMOOTH, SEARCHED_COST};
use super::linear_part::LinearPart;
use super::piecewise::{PiecewiseCubics, Term, powers};
use super::stepwise::{Costs, OrthogonalFit, stepwise};
use crate::nonlinearity::spline::{banded::Banded, basis::CubicSplines};
use crate::sort;
use crate::vectors::dot;

/// A basis and the values' regression on it.
pub(super) struct Selection {
    pub terms: Vec<Term>,
    pub basis: PiecewiseCubics,
    /// The coefficients of the basis' functions. The first function is constant.
    pub coefficients: Vec<f64>,
}

impl Selection {
    /// The nonlinearity on this basis, before this linear part.
    pub fn blocks(&self, linear: &LinearPart, offset: f64) -> Blocks {
        Blocks {
            basis: self.basis.clone(),
            // The first function is constant, and its coefficient is part of the offset.
            c: self.coefficients[1..].to_vec(),
            linear: linear.clone(),
            offset,
        }
    }
}

/// Chooses a basis for the regression of the values at the samples `u`, beginning with the terms `start`.
///
/// Three bases are compared by the estimated risk: the part that they explain minus the cost of their functions:
/// 1. jumps, kinks and cubic knots at searched places, each at the cost of a search;
/// 2. cubic knots alone at searched places, tried where 1 has jumps or kinks but evenly placed knots are nearly as good: noise may look
///    like a kink;
/// 3. cubic knots at evenly spaced ranks, which cost less since their places are given; taken if clearly better.
pub(super) fn select(cells: &Cells, u: &[f64], values: &[f64], start: &[Term], costs: &Costs) -> Selection {
    let z = &cells.means(values);
    let net = |g: &OrthogonalFit| g.explained() - SEARCHED_COST * costs.variance * g.breakpoints() as f64;
    let mut fit = stepwise(cells, z, start, costs);
    if let Some(even) = EvenSpline::best(cells, z, costs) {
        let even_net = even.net(costs);
        // If evenly placed knots are far worse, the nonlinearity is not smooth.
        let is_rough = |t: &Term| matches!(t, Term::TruncatedPower { degree: 0 | 1, .. });
        if fit.terms.iter().any(is_rough) && even_net > net(&fit) - NEARLY_SMOOTH * SEARCHED_COST * costs.variance {
            let smooth = stepwise(cells, z, &[], &Costs { smooth: true, ..*costs });
            if net(&smooth) > net(&fit) {
                fit = smooth;
            }
        }
        if even_net > net(&fit) + GIVEN_MARGIN * costs.variance {
            let knots = even_knots(cells, even.knots).into_iter();
            let knots = knots.map(|at| Term::TruncatedPower { at, degree: 3 });
            fit = OrthogonalFit::new(cells, z, &powers().chain(knots).collect::<Vec<_>>());
        }
    }
    let terms = jumps_placed(cells, u, values, &fit);
    selection(cells, z, &terms)
}

/// The regression of the cells' values on these terms.
pub(super) fn selection(cells: &Cells, z: &[f64], terms: &[Term]) -> Selection {
    let terms = jumps_joined(cells, &OrthogonalFit::new(cells, z, terms));
    let fit = OrthogonalFit::new(cells, z, &terms);
    Selection {
        basis: PiecewiseCubics::new(cells.unit, &fit.terms, &fit.inverse_of_r().concat()),
        coefficients: fit.coefficients,
        terms: fit.terms,
    }
}

/// The terms without the jumps that a neighbouring kink makes unnecessary.
///
/// Between two neighbouring values of the input there are no samples. If a jump j and a kink of slope change k at t both lie there, one
/// kink at t - j / k has the same values at all samples, if it lies there too.
fn jumps_joined(cells: &Cells, fit: &OrthogonalFit) -> Vec<Term> {
    let c = fit.solution().coefficients;
    let gap = |at: f64| cells.s.partition_point(|s| *s < at);
    let mut terms: Vec<Option<Term>> = fit.terms.iter().copied().map(Some).collect();
    for (j, jump) in fit.terms.iter().enumerate() {
        let Term::TruncatedPower { at: jump, degree: 0 } = *jump else {
            continue;
        };
        let joined = fit.terms.iter().enumerate().find_map(|(k, kink)| match *kink {
            Term::TruncatedPower { at, degree: 1 } if gap(at) == gap(jump) => {
                let moved = at - c[j] / c[k];
                (gap(moved) == gap(jump)).then_some((k, moved))
            }
            _ => None,
        });
        if let Some((k, at)) = joined {
            terms[k] = Some(Term::TruncatedPower { at, degree: 1 });
            terms[j] = None;
        }
    }
    terms.into_iter().flatten().collect()
}

/// The terms with their jumps moved from the cells' limits to the best places between samples.
fn jumps_placed(cells: &Cells, u: &[f64], values: &[f64], fit: &OrthogonalFit) -> Vec<Term> {
    let mut terms = fit.terms.clone();
    let c = fit.solution().coefficients;
    let curve = PiecewiseCubics::new(cells.unit, &fit.terms, &c);
    // For every cell the jumps that may move into it.
    let mut jumps_near = vec![Vec::new(); cells.len()];
    for (j, term) in terms.iter().enumerate() {
        if let Term::TruncatedPower { at, degree: 0 } = term {
            let m = cells.lower[1..].partition_point(|l| l <= at);
            let reach = m.saturating_sub(JUMP_REACH)..(m + JUMP_REACH).min(cells.len());
            jumps_near[reach].iter_mut().for_each(|near| near.push(j));
        }
    }
    // For every jump the samples near it.
    let mut around: Vec<Vec<ResidualAt>> = vec![Vec::new(); terms.len()];
    for ((x, z), m) in u.iter().zip(values).zip(&cells.of) {
        for &j in &jumps_near[*m as usize] {
            around[j].push(ResidualAt {
                at: cells.unit.of(*x),
                value: z - curve.value(*x),
            });
        }
    }
    for ((term, mut points), size) in terms.iter_mut().zip(around).zip(c) {
        if let Term::TruncatedPower { at, degree: 0 } = term {
            sort::by_key(&mut points, |p| p.at);
            *at = best_jump(&points, *at, size);
        }
    }
    terms
}

/// The residual at a sample.
#[derive(Clone, Copy)]
struct ResidualAt {
    at: f64,
    value: f64,
}

/// The place at which a jump of this size fits best, halfway between two samples.
///
/// `points` are the samples around, each with the residual of the jump at `now`:
/// ```text
///   samples     o  o  o  o | o  o  o        | the jump at `now`, which has `split` samples below it
///   moved up               |----->          the curve falls by the jump at each sample that is passed: its residual rises
///   moved down     <-------|                the curve rises by it: the residual falls
/// ```
/// So the change of the sum of squares is a running sum in both directions, and the best place is where it is lowest.
fn best_jump(points: &[ResidualAt], now: f64, size: f64) -> f64 {
    let split = points.partition_point(|p| p.at < now);
    let (mut least, mut best) = (0.0, split);
    let mut change = 0.0;
    for (i, ResidualAt { value, .. }) in points.iter().enumerate().skip(split) {
        change += (value + size).powi(2) - value * value;
        if change < least {
            (least, best) = (change, i + 1);
        }
    }
    change = 0.0;
    for (i, ResidualAt { value, .. }) in points[..split].iter().enumerate().rev() {
        change += (value - size).powi(2) - value * value;
        if change < least {
            (least, best) = (change, i);
        }
    }
    if best == split || best == 0 || best == points.len() || points[best - 1].at == points[best].at {
        return now;
    }
    0.5 * (points[best - 1].at + points[best].at)
}

/// This many knots, evenly by rank.
pub(super) fn even_knots(cells: &Cells, count: usize) -> Vec<f64> {
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

/// A cubic spline with evenly placed knots.
#[derive(Clone, Copy)]
struct EvenSpline {
    knots: usize,
    /// The decrease of the sum of squares.
    explained: f64,
}

impl EvenSpline {
    fn net(&self, costs: &Costs) -> f64 {
        self.explained - GIVEN_COST * costs.variance * self.knots as f64
    }

    /// The spline with the least estimated risk (Mallows' C_p).
    fn best(cells: &Cells, z: &[f64], costs: &Costs) -> Option<EvenSpline> {
        let mut best: Option<EvenSpline> = None;
        for knots in EVEN_KNOTS {
            let inner = even_knots(cells, knots);
            if inner.len() < knots || CELLS_PER_KNOT * knots > cells.len() {
                break;
            }
            let Some(explained) = explained_by_spline(cells, z, &inner) else {
                continue;
            };
            let next = EvenSpline { knots, explained };
            if best.is_none_or(|b| next.net(costs) > b.net(costs)) {
                best = Some(next);
            }
        }
        best
    }
}

/// The decrease of the sum of squares by the cubic spline with these inner knots; `None` if the cells do not determine it.
fn explained_by_spline(cells: &Cells, z: &[f64], inner: &[f64]) -> Option<f64> {
    // These splines live on [0, 1].
    let unit = |s: f64| 0.5 * (s + 1.0);
    let inner = inner.iter().map(|s| unit(*s));
    let breakpoints: Vec<f64> = [0.0].into_iter().chain(inner).chain([1.0]).collect();
    let splines = CubicSplines::new(&breakpoints);
    let mut gram = Banded::zeros(splines.len());
    let mut moment = vec![0.0; splines.len()];
    for ((s, w), z) in cells.s.iter().zip(&cells.count).zip(z) {
        let local = splines.at(unit(*s));
        gram.add_products(local.first, &local.values, *w);
        let own = moment[local.first..].iter_mut().zip(local.values);
        own.for_each(|(m, v)| *m += w * v * z);
    }
    let c = gram.factor()?.solve(moment.clone());
    Some(dot(&c, &moment))
}

#[cfg(test)]
#[path = "basis_tests.rs"]
pub(super) mod tests;
