//! Levenberg-Marquardt with geodesic acceleration (Transtrum & Sethna 2012).
//!
//! The sum of squares of linear blocks around a nonlinearity has long, curved valleys. A static nonlinearity commutes with a delay, so the
//! front and the back can exchange any delay that their poles and zeros imitate. A second-order correction, from one more residual along
//! the step, follows such a valley several times faster.

use super::limits::{FIRST_DAMPING, LARGEST_CORRECTION, MOST_REJECTIONS, PROBED_SHARE, SMALLEST_DAMPING, StopRule};
use super::monitor::Monitor;
use super::signals::convolved;
use crate::interrupt;
use crate::linear::least_squares::{NormalEquations, UnitDiagonal, inner_products, normal_equations};
use crate::linear::levenberg_marquardt::{Linearisation, Step};
use crate::parallel;
use crate::vectors::dot;

/// Residuals over parameters; those before sample `from` do not count.
pub(in crate::identify) trait Residuals {
    /// The first residual that counts.
    fn from(&self) -> usize;
    /// All residuals; `None` if the parameters are not admissible.
    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>>;
    /// All residuals and the columns of their derivatives.
    fn linearise(&self, parameters: &[f64]) -> Linearisation;
}

/// Where a minimisation ended.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Minimum {
    pub parameters: Vec<f64>,
    /// The sum of squared residuals.
    pub squares: f64,
}

/// Minimises the sum of squared residuals, starting from `start`. `monitor` is asked before every step. `None` if `start` is not
/// admissible.
pub(in crate::identify) fn descend(
    problem: &impl Residuals,
    start: Vec<f64>,
    rule: StopRule,
    monitor: &mut Monitor<'_>,
) -> Option<Minimum> {
    let from = problem.from();
    let cost_of = |p: &[f64]| -> Option<f64> {
        let residuals = problem.residuals(p)?;
        let sum: f64 = residuals[from..].iter().map(|r| r * r).sum();
        sum.is_finite().then_some(sum)
    };
    let mut parameters = start;
    let mut cost = cost_of(&parameters)?;
    let mut damping = FIRST_DAMPING;
    for _ in interrupt::rounds(rule.steps) {
        if !monitor.keep_on() {
            break;
        }
        let at = problem.linearise(&parameters);
        let point = Point {
            equations: normal_equations(&at.residuals, &at.jacobian, from),
            at,
        };
        let mut accepted = None;
        for _ in 0..MOST_REJECTIONS {
            if let Some(Step { change, predicted }) = point.step(problem, &parameters, damping) {
                let candidate: Vec<f64> = parameters.iter().zip(&change).map(|(p, s)| p + s).collect();
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
        if fall <= rule.tolerance * cost {
            break;
        }
    }
    Some(Minimum {
        parameters,
        squares: cost,
    })
}

/// Residuals filtered by an autoregression, as a problem for the same minimisation.
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
    rule: StopRule,
    monitor: &mut Monitor<'_>,
) -> Option<Minimum> {
    match filter.len() {
        1 => descend(problem, start, rule, monitor),
        _ => descend(&Whitened { problem, filter }, start, rule, monitor),
    }
}

impl<P: Residuals> Residuals for Whitened<'_, P> {
    fn from(&self) -> usize {
        self.problem.from().max(self.filter.len() - 1)
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        Some(convolved(self.filter, &self.problem.residuals(parameters)?))
    }

    fn linearise(&self, parameters: &[f64]) -> Linearisation {
        self.whitened(&self.problem.linearise(parameters))
    }
}

impl<P> Whitened<'_, P> {
    /// Residuals and columns through the polynomial.
    pub fn whitened(&self, at: &Linearisation) -> Linearisation {
        Linearisation {
            residuals: convolved(self.filter, &at.residuals),
            jacobian: parallel::batch(&at.jacobian, |c| convolved(self.filter, c)),
        }
    }
}

/// A point with its linearisation.
struct Point {
    equations: NormalEquations,
    at: Linearisation,
}

impl Point {
    /// A damped step with its correction, and the predicted decrease without the correction; `None` if the step is too long to be trusted.
    fn step(&self, problem: &impl Residuals, at: &[f64], damping: f64) -> Option<Step> {
        let system = UnitDiagonal::new(&self.equations);
        let solve = |rhs: &[f64]| system.solve(rhs, |_| 1.0 + damping);
        let velocity = solve(&self.equations.descent)?;
        let probe: Vec<f64> = at.iter().zip(&velocity).map(|(p, v)| p + PROBED_SHARE * v).collect();
        let ahead = problem.residuals(&probe)?;
        // r(p + h v) = r + h J v + h^2 r_vv / 2, and J'J v is known: J'r_vv without J v itself.
        let first = inner_products(&self.at.jacobian, &self.at.residuals, problem.from());
        let moved = inner_products(&self.at.jacobian, &ahead, problem.from());
        let n = velocity.len();
        let curvature: Vec<f64> = (0..n)
            .map(|i| {
                let linear = dot(&self.equations.normal[i * n..(i + 1) * n], &velocity);
                -2.0 / PROBED_SHARE * ((moved[i] - first[i]) / PROBED_SHARE - linear)
            })
            .collect();
        let acceleration = solve(&curvature)?;
        let squares = |v: &[f64]| v.iter().zip(&system.scale).map(|(v, s)| (v * s).powi(2)).sum::<f64>();
        if !(2.0 * squares(&acceleration).sqrt() <= LARGEST_CORRECTION * squares(&velocity).sqrt()) {
            return None;
        }
        let each = velocity.iter().zip(&self.equations.descent).zip(&system.scale);
        Some(Step {
            change: velocity.iter().zip(&acceleration).map(|(v, a)| v + 0.5 * a).collect(),
            predicted: each.map(|((v, d), s)| v * (d + damping * s * s * v)).sum(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::limits::TRIAL;
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
        fn linearise(&self, p: &[f64]) -> Linearisation {
            Linearisation {
                residuals: self.residuals(p).unwrap_or_default(),
                jacobian: vec![vec![7.0, -20.0 * p[0], -1.0], vec![7.0, 10.0, 0.0]],
            }
        }
    }

    #[test]
    fn follows_a_curved_valley_in_few_steps() {
        let mut steps = 0;
        let mut count = |_: &str| {
            steps += 1;
            ControlFlow::Continue(())
        };
        let rule = StopRule::new(100, 1e-12);
        let end = descend(&Valley, vec![-1.2, 1.0], rule, &mut Monitor::new(&mut count)).unwrap();
        assert!((end.parameters[0] - 1.0).abs() < 1e-6 && end.squares < 1e-12, "{end:?}");
        assert!(steps < 30, "{steps}");
    }

    #[test]
    fn a_start_that_is_not_admissible_is_refused() {
        let go = &mut |_: &str| ControlFlow::Continue(());
        assert!(descend(&Valley, vec![4.0, 1.0], TRIAL, &mut Monitor::new(go)).is_none());
    }
}
