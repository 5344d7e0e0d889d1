//! Levenberg-Marquardt with geodesic acceleration (Transtrum & Sethna 2012).
//!
//! The sum of squares of linear blocks around a nonlinearity has long, curved valleys: a static nonlinearity commutes with a delay, so that the front
//! and the back can trade any delay that their poles and zeros imitate. A second-order correction from one more residual,
//! along the step, follows such a valley several times faster.

use super::monitor::Monitor;
use super::products::{inner_products, normal_equations};
use super::rational::convolved;
use crate::linalg;
use crate::linear::levenberg_marquardt::NormalEquations;
use crate::parallel;

/// Damping of the first step, relative to the normal equations' diagonal.
const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-13;
/// Rejected steps in a row before the search is over.
const REJECTIONS: usize = 12;
/// The share of the step over which the second derivative is taken.
const PROBE: f64 = 0.1;
/// The correction is at most this share of the step; beyond, the step is too long.
const LARGEST_CORRECTION: f64 = 0.75;

/// Residuals over parameters; those before sample `from` do not count.
pub(in crate::identify) trait Residuals {
    /// The first residual that counts.
    fn from(&self) -> usize;
    /// All residuals; `None` where the parameters are not admissible.
    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>>;
    /// All residuals and the columns of their derivatives.
    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>);
}

/// Minimises from `start` until a step lowers the sum by less than the share `tolerance`; the parameters and the sum.
///
/// `monitor` is asked before every step. `None` if `start` is not admissible.
pub(in crate::identify) fn descend(
    problem: &impl Residuals,
    start: Vec<f64>,
    iterations: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Option<(Vec<f64>, f64)> {
    let from = problem.from();
    let cost_of = |p: &[f64]| -> Option<f64> {
        let residuals = problem.residuals(p)?;
        let sum: f64 = residuals[from..].iter().map(|r| r * r).sum();
        sum.is_finite().then_some(sum)
    };
    let mut parameters = start;
    let mut cost = cost_of(&parameters)?;
    let mut damping = FIRST_DAMPING;
    for _ in 0..iterations {
        if !monitor.keep_on() {
            break;
        }
        let (residuals, jacobian) = problem.linearise(&parameters);
        let point = Point {
            equations: normal_equations(&residuals, &jacobian, from),
            residuals,
            jacobian,
        };
        let mut accepted = None;
        for _ in 0..REJECTIONS {
            if let Some((step, predicted)) = point.step(problem, &parameters, damping) {
                let candidate: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| p + s).collect();
                if let Some(trial) = cost_of(&candidate).filter(|c| *c < cost) {
                    accepted = Some((candidate, trial, (cost - trial) / predicted.max(f64::MIN_POSITIVE)));
                    break;
                }
            }
            damping *= 5.0;
        }
        let Some((candidate, trial, gain)) = accepted else {
            break;
        };
        let fall = cost - trial;
        damping = match gain {
            g if g > 0.75 => damping / 8.0,
            g if g < 0.25 => damping * 2.0,
            _ => damping / 3.0,
        }
        .max(SMALLEST_DAMPING);
        (parameters, cost) = (candidate, trial);
        if fall <= tolerance * cost {
            break;
        }
    }
    Some((parameters, cost))
}

/// Residuals through an autoregression, to be minimised as those without it.
pub(in crate::identify) struct Whitened<'a, P> {
    pub problem: &'a P,
    /// Monic, in powers of the delay.
    pub filter: &'a [f64],
}

/// [`descend`] on the residuals through a monic polynomial, 1 for the residuals themselves.
pub(in crate::identify) fn descend_through(
    filter: &[f64],
    problem: &impl Residuals,
    start: Vec<f64>,
    iterations: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Option<(Vec<f64>, f64)> {
    if filter.len() == 1 {
        return descend(problem, start, iterations, tolerance, monitor);
    }
    descend(&Whitened { problem, filter }, start, iterations, tolerance, monitor)
}

impl<P: Residuals> Residuals for Whitened<'_, P> {
    fn from(&self) -> usize {
        self.problem.from().max(self.filter.len() - 1)
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        Some(convolved(self.filter, &self.problem.residuals(parameters)?))
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (residuals, jacobian) = self.problem.linearise(parameters);
        (convolved(self.filter, &residuals), self.through(&jacobian))
    }
}

impl<P> Whitened<'_, P> {
    /// The columns through the polynomial.
    pub fn through(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        parallel::batch(columns, |c| convolved(self.filter, c))
    }
}

/// All that is known about a point.
struct Point {
    equations: NormalEquations,
    residuals: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
}

impl Point {
    /// A damped step with its correction, and the fall that the step alone promises; `None` if it is too long to be
    /// trusted.
    fn step(&self, problem: &impl Residuals, at: &[f64], damping: f64) -> Option<(Vec<f64>, f64)> {
        let system = Damped::new(&self.equations, damping);
        let velocity = system.solve(&self.equations.descent)?;
        let predicted = system.predicted(&velocity, &self.equations.descent);
        let probe: Vec<f64> = at.iter().zip(&velocity).map(|(p, v)| p + PROBE * v).collect();
        let ahead = problem.residuals(&probe)?;
        // r(p + h v) = r + h J v + h^2 r_vv / 2, and J'J v is known: J'r_vv without J v itself.
        let first = inner_products(&self.jacobian, &self.residuals, problem.from());
        let moved = inner_products(&self.jacobian, &ahead, problem.from());
        let n = velocity.len();
        let curvature: Vec<f64> = (0..n)
            .map(|i| {
                let row = &self.equations.normal[i * n..(i + 1) * n];
                let linear: f64 = row.iter().zip(&velocity).map(|(g, v)| g * v).sum();
                -2.0 / PROBE * ((moved[i] - first[i]) / PROBE - linear)
            })
            .collect();
        let acceleration = system.solve(&curvature)?;
        let size = |v: &[f64]| {
            v.iter()
                .zip(&system.scale)
                .map(|(v, s)| (v * s).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        if !(2.0 * size(&acceleration) <= LARGEST_CORRECTION * size(&velocity)) {
            return None;
        }
        Some((
            velocity.iter().zip(&acceleration).map(|(v, a)| v + 0.5 * a).collect(),
            predicted,
        ))
    }
}

/// J'J + damping diag(J'J), scaled to a unit diagonal for the factorisation's sake.
struct Damped {
    matrix: Vec<f64>,
    scale: Vec<f64>,
    damping: f64,
}

impl Damped {
    fn new(equations: &NormalEquations, damping: f64) -> Damped {
        let n = equations.descent.len();
        let diagonal = (0..n).map(|i| equations.normal[i * n + i].sqrt());
        let scale: Vec<f64> = diagonal.map(|d| if d > 0.0 { d } else { 1.0 }).collect();
        let mut matrix: Vec<f64> = (0..n * n)
            .map(|k| equations.normal[k] / (scale[k / n] * scale[k % n]))
            .collect();
        (0..n).for_each(|i| matrix[i * n + i] = 1.0 + damping);
        Damped { matrix, scale, damping }
    }

    fn solve(&self, rhs: &[f64]) -> Option<Vec<f64>> {
        let scaled: Vec<f64> = rhs.iter().zip(&self.scale).map(|(r, s)| r / s).collect();
        let x = linalg::solve_positive_definite(&self.matrix, &scaled)?;
        Some(x.iter().zip(&self.scale).map(|(x, s)| x / s).collect())
    }

    /// The fall of the sum of squares that a solution promises.
    fn predicted(&self, step: &[f64], descent: &[f64]) -> f64 {
        let each = step.iter().zip(descent).zip(&self.scale);
        each.map(|((v, d), s)| v * (d + self.damping * s * s * v)).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;

    /// A curved valley: 10 (q - p^2) and 1 - p, p within 3 of the origin.
    struct Valley;

    impl Residuals for Valley {
        fn from(&self) -> usize {
            1
        }
        fn residuals(&self, p: &[f64]) -> Option<Vec<f64>> {
            (p[0].abs() < 3.0).then(|| vec![1e9, 10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]])
        }
        fn linearise(&self, p: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
            let residuals = self.residuals(p).unwrap_or_default();
            (residuals, vec![vec![7.0, -20.0 * p[0], -1.0], vec![7.0, 10.0, 0.0]])
        }
    }

    #[test]
    fn follows_a_curved_valley_in_few_steps() {
        let mut steps = 0;
        let mut count = |_| {
            steps += 1;
            ControlFlow::Continue(())
        };
        let (p, cost) = descend(&Valley, vec![-1.2, 1.0], 100, 1e-12, &mut Monitor::new(&mut count)).unwrap();
        assert!((p[0] - 1.0).abs() < 1e-6 && cost < 1e-12, "{p:?} {cost}");
        assert!(steps < 30, "{steps}");
    }

    #[test]
    fn a_start_that_is_not_admissible_is_refused() {
        let go = &mut |_| ControlFlow::Continue(());
        assert!(descend(&Valley, vec![4.0, 1.0], 10, 1e-9, &mut Monitor::new(go)).is_none());
    }
}
