//! Nonlinear least squares for a few parameters (Marquardt 1963, with the gain-ratio damping of
//! Nielsen 1999).

use super::least_squares::{NormalEquations, normal_equations};
use crate::interrupt;
use crate::linalg;

/// A step that lowers the sum of squares by at most this share is the last: this is near the effect of rounding.
const TOLERANCE: f64 = 1e-12;
/// The damping of the first step, relative to the diagonal of J'J (Nielsen 1999).
const FIRST_DAMPING: f64 = 1e-3;
/// A step with more damping than this is zero to rounding.
const MOST_DAMPING: f64 = 1e16;

/// Residuals and their derivatives: `jacobian[p]` is the column of parameter p.
pub(crate) struct Linearisation {
    pub residuals: Vec<f64>,
    pub jacobian: Vec<Vec<f64>>,
}

/// Where a minimisation ended.
pub(crate) struct Minimum {
    pub parameters: Vec<f64>,
    pub equations: NormalEquations,
}

/// Minimises the sum of squares of the residuals from `start`.
///
/// `evaluate` returns `None` if the parameters are not admissible (for example an unstable system); such a step is shortened. `None` if
/// `start` is not admissible.
pub(crate) fn minimise(
    start: Vec<f64>,
    iterations: usize,
    evaluate: impl Fn(&[f64]) -> Option<Linearisation>,
) -> Option<Minimum> {
    minimise_squares(start, iterations, |p| {
        evaluate(p).map(|at| normal_equations(&at.residuals, &at.jacobian, 0))
    })
}

/// [`minimise`] for residuals that are only known through their normal equations.
pub(crate) fn minimise_squares(
    start: Vec<f64>,
    iterations: usize,
    evaluate: impl Fn(&[f64]) -> Option<NormalEquations>,
) -> Option<Minimum> {
    let mut parameters = start;
    let mut point = evaluate(&parameters)?;
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    for _ in interrupt::rounds(iterations) {
        if interrupt::requested() {
            break;
        }
        let Some(Step { change, predicted }) = damped_step(&point, damping) else {
            break;
        };
        let candidate: Vec<f64> = parameters.iter().zip(&change).map(|(p, s)| p + s).collect();
        if let Some(trial) = evaluate(&candidate).filter(|t| t.cost < point.cost) {
            let fall = point.cost - trial.cost;
            let gain = fall / predicted.max(f64::MIN_POSITIVE);
            damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
            growth = 2.0;
            let converged = fall <= TOLERANCE * point.cost;
            (parameters, point) = (candidate, trial);
            if converged {
                break;
            }
        } else {
            damping *= growth;
            growth *= 2.0;
            if !(damping < MOST_DAMPING) {
                break;
            }
        }
    }
    Some(Minimum {
        parameters,
        equations: point,
    })
}

/// A step and the predicted decrease of the sum of squares.
pub(crate) struct Step {
    pub change: Vec<f64>,
    pub predicted: f64,
}

/// The step that solves (J'J + damping diag(J'J)) step = -J'r.
fn damped_step(point: &NormalEquations, damping: f64) -> Option<Step> {
    let n = point.descent.len();
    let mut normal = point.normal.clone();
    let diagonal: Vec<f64> = (0..n).map(|i| normal[i * n + i].max(f64::MIN_POSITIVE)).collect();
    for i in 0..n {
        normal[i * n + i] += damping * diagonal[i];
    }
    let change = linalg::solve_positive_definite(&normal, &point.descent)?;
    let predicted = (0..n).map(|i| change[i] * (point.descent[i] + damping * diagonal[i] * change[i]));
    Some(Step {
        predicted: predicted.sum(),
        change,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_minimum_of_rosenbrock_s_valley() {
        let evaluate = |p: &[f64]| {
            Some(Linearisation {
                residuals: vec![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]],
                jacobian: vec![vec![-20.0 * p[0], -1.0], vec![10.0, 0.0]],
            })
        };
        let minimum = minimise(vec![-1.2, 1.0], 200, evaluate).unwrap();
        let (p, cost) = (minimum.parameters, minimum.equations.cost);
        assert!(
            (p[0] - 1.0).abs() < 1e-8 && (p[1] - 1.0).abs() < 1e-8 && cost < 1e-16,
            "{p:?} {cost}"
        );
    }

    #[test]
    fn stays_where_the_parameters_are_admissible() {
        // The minimum of (p - 3)^2 with p < 2 refused.
        let evaluate = |p: &[f64]| {
            (p[0] < 2.0).then(|| Linearisation {
                residuals: vec![p[0] - 3.0],
                jacobian: vec![vec![1.0]],
            })
        };
        let p = minimise(vec![0.0], 100, evaluate).unwrap().parameters;
        assert!(p[0] < 2.0 && p[0] > 1.9, "{p:?}");
    }
}
