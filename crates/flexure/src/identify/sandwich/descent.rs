//! Levenberg-Marquardt where a trial is cheap and a linearisation is not.

use super::monitor::Monitor;
use crate::linalg;
use crate::linear::levenberg_marquardt::NormalEquations;

/// Damping of the first step, relative to the normal equations' diagonal.
const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-13;
/// Rejected steps in a row before the search is over.
const REJECTIONS: usize = 12;

/// A sum of squares over parameters.
pub(super) trait SumOfSquares {
    /// The sum of squares; `None` where the parameters are not admissible.
    fn cost(&self, parameters: &[f64]) -> Option<f64>;
    /// Its linearisation.
    fn normal_equations(&self, parameters: &[f64]) -> Option<NormalEquations>;
}

/// Minimises from `start` until a step lowers the sum by less than the share `tolerance`; the parameters and the sum.
///
/// `monitor` is asked before every step. `None` if `start` is not admissible.
pub(super) fn descend(
    problem: &impl SumOfSquares,
    start: Vec<f64>,
    iterations: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Option<(Vec<f64>, f64)> {
    let mut parameters = start;
    let mut cost = problem.cost(&parameters).filter(|c| c.is_finite())?;
    let mut damping = FIRST_DAMPING;
    for _ in 0..iterations {
        if !monitor.keep_on() {
            break;
        }
        let point = problem.normal_equations(&parameters)?;
        let mut accepted = None;
        for _ in 0..REJECTIONS {
            if let Some((step, predicted)) = damped_step(&point, damping) {
                let candidate: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p + s).collect();
                if let Some(trial) = problem.cost(&candidate).filter(|c| *c < cost) {
                    let gain = (cost - trial) / predicted.max(f64::MIN_POSITIVE);
                    accepted = Some((candidate, trial, gain));
                    break;
                }
            }
            damping *= 8.0;
        }
        let Some((candidate, trial, gain)) = accepted else {
            break;
        };
        let fall = cost - trial;
        damping = match gain {
            g if g > 0.75 => damping / 12.0,
            g if g < 0.25 => damping * 3.0,
            _ => damping / 2.0,
        }
        .max(SMALLEST_DAMPING);
        (parameters, cost) = (candidate, trial);
        if std::env::var("TRACE").is_ok() { println!("      {cost:.6e} gain {gain:.3} damping {damping:.1e}"); }
        if fall <= tolerance * cost {
            break;
        }
    }
    Some((parameters, cost))
}

/// The step that solves (J'J + damping diag(J'J)) step = -J'r, and the fall it promises.
fn damped_step(point: &NormalEquations, damping: f64) -> Option<(Vec<f64>, f64)> {
    let n = point.descent.len();
    // Scaled to a unit diagonal, for the factorisation's sake.
    let scale: Vec<f64> = (0..n)
        .map(|i| point.normal[i * n + i].sqrt())
        .map(|d| if d > 0.0 { d } else { 1.0 })
        .collect();
    let mut matrix = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..n {
            matrix[i * n + j] = point.normal[i * n + j] / (scale[i] * scale[j]);
        }
        matrix[i * n + i] = 1.0 + damping;
    }
    let rhs: Vec<f64> = point.descent.iter().zip(&scale).map(|(d, s)| d / s).collect();
    let step = linalg::solve_positive_definite(&matrix, &rhs)?;
    let predicted = step.iter().zip(&rhs).map(|(s, r)| s * (r + damping * s)).sum();
    Some((step.iter().zip(&scale).map(|(v, s)| v / s).collect(), predicted))
}
