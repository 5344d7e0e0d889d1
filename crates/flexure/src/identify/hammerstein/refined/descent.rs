//! Levenberg-Marquardt steps on all parameters of both blocks (Marquardt 1963).

use super::super::super::limits::LARGEST_RADIUS;
use super::blocks::{Blocks, Observed};
use super::limits::{DAMPING_AFTER_FALL, DAMPING_AFTER_RISE, FIRST_DAMPING, LEAST_FALL, LEAST_RAISED, MOST_DAMPING};
use super::loss::Equations;
use crate::interrupt;
use crate::linear::least_squares::UnitDiagonal;

/// A damped step of all parameters except the fixed one.
pub(super) fn step(equations: &Equations, fixed: usize, damping: f64) -> Option<Vec<f64>> {
    let others = equations.normal.without(fixed);
    let mut step = UnitDiagonal::new(&others).solve(&others.descent, |d| d + damping)?;
    step.insert(fixed, 0.0);
    Some(step)
}

/// Whether all parameters are finite and the linear part is stable.
pub(super) fn admissible(blocks: &Blocks) -> bool {
    blocks.parameters().iter().all(|p| p.is_finite())
        && (blocks.linear.transfer.poles()).is_some_and(|poles| poles.iter().all(|p| p.norm() <= LARGEST_RADIUS))
}

/// The damping after a step that does not lower the squared error.
pub(super) fn raised(damping: f64) -> f64 {
    (damping * DAMPING_AFTER_RISE).max(LEAST_RAISED)
}

/// Both blocks, and the equations there.
pub(super) struct Descended {
    pub blocks: Blocks,
    pub equations: Equations,
}

/// Lowers the squared prediction error with at most `steps` steps.
pub(super) fn descend(mut blocks: Blocks, observed: &Observed, whitening: &[f64], steps: usize) -> Descended {
    let mut equations = blocks.equations(observed, whitening);
    let mut damping = FIRST_DAMPING;
    for _ in interrupt::rounds(steps) {
        let fixed = blocks.fixed_parameter();
        let before = equations.normal.cost;
        let mut next = None;
        while next.is_none() && damping < MOST_DAMPING && !interrupt::requested() {
            let trial = step(&equations, fixed, damping).map(|step| {
                let p: Vec<f64> = blocks.parameters().iter().zip(step).map(|(p, d)| p + d).collect();
                blocks.with(&p)
            });
            let trial = trial.filter(admissible);
            next = trial.filter(|b| b.squares(observed, whitening) < before);
            if next.is_none() {
                damping = raised(damping);
            }
        }
        let Some(better) = next else { break };
        blocks = better;
        equations = blocks.equations(observed, whitening);
        damping *= DAMPING_AFTER_FALL;
        if before - equations.normal.cost <= LEAST_FALL * before {
            break;
        }
    }
    Descended { blocks, equations }
}
