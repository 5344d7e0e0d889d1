//! Intervals of parameters by the likelihood's profile: the other values that fit equally well.
//!
//! A standard error follows from the curvature at the minimum. If two terms are nearly equal, very different values fit equally well; or
//! there may be several minima. A standard error shows neither. Therefore each parameter is moved away step by step, and all others are
//! fitted again, until the objective has grown by more than chance (Venzon & Moolgavkar 1988).

use super::condensed::{Condensed, FormedCurve, Held, Minimum};
use super::form_fit::FormFit;
use super::layout::FormParameter;
use super::limits::{LEAST_UNIT, PROFILE_STEPS};
use crate::parallel;
use crate::quantiles::CHI_SQUARED_95;

/// The intervals of all unknowns of a fit whose condensed minimum is `best`; they include other `minima` that fit as well.
pub(super) fn intervals(
    condensed: &Condensed,
    curves: &[FormedCurve],
    fit: &FormFit,
    best: &Minimum,
    minima: &[Minimum],
) -> Vec<[f64; 2]> {
    let n = fit.solution.x.len();
    let scale = fit.solution.squares / (2.0 * fit.solution.lines() as f64 - n as f64).max(1.0);
    let parameters: Vec<FormParameter> = fit.layout.parameters().collect();
    let of_parameters = parallel::batch(&parameters, |&parameter| {
        let (unknown, value) = (fit.layout.unknown(parameter), best.value(parameter));
        // A factor near zero is no scale for its uncertainty.
        let unit = match parameter {
            FormParameter::Factor(_) => value.abs().max(LEAST_UNIT * fit.solution.covariance.error(unknown)),
            FormParameter::Log(_) => 1.0,
        };
        // If the noise differs from the weights, sums of squares grow more slowly.
        let given = fit.solution.covariance.at(unknown, unknown).max(f64::MIN_POSITIVE);
        let inflation = (fit.covariance.at(unknown, unknown) / given).max(1.0);
        let allowed = CHI_SQUARED_95 * scale * inflation;
        let end = |sign: f64| -> f64 {
            let mut start = best.logs.clone();
            let (mut last_step, mut last_root) = (0.0, 0.0);
            for step in PROFILE_STEPS {
                let held = Held {
                    parameter,
                    value: value + sign * step * unit,
                };
                let Some(found) = condensed.minimum(curves, &start, Some(held)) else {
                    return f64::INFINITY;
                };
                // The root of the growth is nearly linear.
                let root = ((found.objective - best.objective).max(0.0) / allowed).sqrt();
                if root >= 1.0 {
                    let share = (1.0 - last_root) / (root - last_root);
                    return last_step + share * (step - last_step);
                }
                (start, last_step, last_root) = (found.logs, step, root);
            }
            f64::INFINITY
        };
        let mut interval = [value - unit * end(-1.0), value + unit * end(1.0)];
        for other in minima.iter().filter(|m| m.objective - best.objective < allowed) {
            let v = other.value(parameter);
            interval = [interval[0].min(v), interval[1].max(v)];
        }
        // The interval is shifted to the result of the equations themselves.
        let shift = fit.solution.x[unknown] - value;
        [interval[0] + shift, interval[1] + shift]
    });
    [vec![[f64::NAN; 2]; fit.layout.fixed], of_parameters].concat()
}
