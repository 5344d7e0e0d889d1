//! What else fits as well: intervals of parameters by the likelihood's profile.
//!
//! A standard error is the curvature at the minimum. Where two terms are nearly alike, a valley runs from there to values far
//! away, or the minimum has neighbours, and a standard error says nothing of either. So each parameter is moved away
//! step by step, everything else following, until the objective has grown by more than chance (Venzon & Moolgavkar 1988).

use super::condensed::{Condensed, Held, Lowest};
use super::shaping::{Shape, Shapely};

/// The quantile of 95 % of chi squared with one degree of freedom.
const CHI_SQUARED: f64 = 3.841_458_820_694_124;
/// Distances from the minimum: of logarithms, and of factors as shares of them. What is not refuted at the last has no limit.
const STEPS: [f64; 9] = [0.02, 0.05, 0.12, 0.3, 0.6, 1.0, 1.8, 3.0, 4.6];

/// A factor's distances are shares of no less than this many of its standard errors.
const LEAST_UNIT: f64 = 4.0;

/// The intervals of all unknowns of a fit whose condensed minimum is `best`; other `minima` that fit as well are in them.
pub(super) fn intervals(
    condensed: &Condensed,
    shapes: &[Shape],
    fit: &Shapely,
    best: &Lowest,
    minima: &[Lowest],
) -> Vec<[f64; 2]> {
    let n = fit.solution.x.len();
    let fixed = n - best.factors.len() - best.logs.len();
    let lines: usize = fit.solution.residuals.iter().map(Vec::len).sum();
    let scale = fit.solution.squares / (2.0 * lines as f64 - n as f64).max(1.0);
    let mut intervals = vec![[f64::NAN; 2]; fixed];
    for unknown in fixed..n {
        let at = unknown - fixed;
        let (value, held): (f64, Box<dyn Fn(f64) -> Held>) = match at.checked_sub(best.factors.len()) {
            None => (best.factors[at], Box::new(move |v| Held::Factor(at, v))),
            Some(log) => (best.logs[log], Box::new(move |v| Held::Log(log, v))),
        };
        // A factor near zero is no measure of its own uncertainty.
        let own = fit.solution.error(unknown);
        let unit = match at < best.factors.len() {
            true => value.abs().max(LEAST_UNIT * own),
            false => 1.0,
        };
        // Where the errors are not those that the weights say, sums of squares grow the more slowly.
        let i = unknown * n + unknown;
        let inflation = (fit.covariance[i] / fit.solution.covariance[i].max(f64::MIN_POSITIVE)).max(1.0);
        let allowed = CHI_SQUARED * scale * inflation;
        let end = |sign: f64| -> f64 {
            let (mut start, mut before) = (best.logs.clone(), (0.0, 0.0));
            for step in STEPS {
                let Some(found) = condensed.lowest(shapes, &start, Some(held(value + sign * step * unit))) else {
                    return f64::INFINITY;
                };
                // The root of the growth is as good as linear.
                let root = ((found.objective - best.objective).max(0.0) / allowed).sqrt();
                if root >= 1.0 {
                    let share = (1.0 - before.1) / (root - before.1);
                    return before.0 + share * (step - before.0);
                }
                (start, before) = (found.logs, (step, root));
            }
            f64::INFINITY
        };
        let mut interval = [value - unit * end(-1.0), value + unit * end(1.0)];
        for other in minima.iter().filter(|m| m.objective - best.objective < allowed) {
            let v = match at.checked_sub(other.factors.len()) {
                None => other.factors[at],
                Some(log) => other.logs[log],
            };
            interval = [interval[0].min(v), interval[1].max(v)];
        }
        // About the value with which the equations themselves end.
        let shift = fit.solution.x[unknown] - value;
        intervals.push([interval[0] + shift, interval[1] + shift]);
    }
    intervals
}
