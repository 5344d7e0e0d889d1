//! Levenberg-Marquardt steps on all parameters of both blocks (Marquardt 1963).

use super::super::super::limits::LARGEST_RADIUS;
use super::blocks::{Blocks, Observed};
use super::limits::{EASED, FIRST_DAMPING, LEAST_FALL, LEAST_TIGHTENED, MOST_DAMPING, TIGHTENED};
use super::loss::Equations;
use crate::interrupt;
use crate::linalg;

/// The equations without one parameter, scaled to a unit diagonal.
pub(super) struct Scaled {
    /// The parameters that are kept.
    pub kept: Vec<usize>,
    /// The square roots of the diagonal.
    pub scale: Vec<f64>,
    /// Row-major.
    pub matrix: Vec<f64>,
}

impl Scaled {
    pub fn new(equations: &Equations, without: usize) -> Scaled {
        let n = equations.parameters();
        let normal = &equations.normal.normal;
        let kept: Vec<usize> = (0..n).filter(|&i| i != without).collect();
        let root = |i: &usize| normal[i * n + i].sqrt();
        let scale: Vec<f64> = (kept.iter().map(root)).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
        let row = |(i, si): (&usize, &f64)| {
            let columns = kept.iter().zip(&scale);
            columns
                .map(|(j, sj)| normal[i * n + j] / (si * sj))
                .collect::<Vec<f64>>()
        };
        let matrix = kept.iter().zip(&scale).flat_map(row).collect();
        Scaled { kept, scale, matrix }
    }

    /// Adds to the diagonal.
    pub fn damp(&mut self, damping: f64) {
        let n = self.kept.len();
        (0..n).for_each(|i| self.matrix[i * n + i] += damping);
    }
}

/// A damped step of all parameters but the fixed one.
fn step(equations: &Equations, fixed: usize, damping: f64) -> Option<Vec<f64>> {
    let mut scaled = Scaled::new(equations, fixed);
    scaled.damp(damping);
    let kept = scaled.kept.iter().zip(&scaled.scale);
    let rhs: Vec<f64> = kept.clone().map(|(i, s)| equations.normal.descent[*i] / s).collect();
    let solution = linalg::solve_positive_definite(&scaled.matrix, &rhs)?;
    let mut step = vec![0.0; equations.parameters()];
    kept.zip(solution).for_each(|((i, s), d)| step[*i] = d / s);
    Some(step)
}

/// Whether all parameters are finite and the linear part is stable.
fn admissible(blocks: &Blocks) -> bool {
    blocks.parameters().iter().all(|p| p.is_finite())
        && (blocks.linear.transfer.poles()).is_some_and(|poles| poles.iter().all(|p| p.norm() <= LARGEST_RADIUS))
}

/// Both blocks, and the equations there.
pub(super) struct Descended {
    pub blocks: Blocks,
    pub equations: Equations,
}

/// Lowers the squared prediction error by at most so many steps.
pub(super) fn descend(mut blocks: Blocks, observed: &Observed, whitening: &[f64], steps: usize) -> Descended {
    let mut equations = blocks.equations(observed, whitening);
    let mut damping = FIRST_DAMPING;
    for _ in 0..steps {
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
                damping = (damping * TIGHTENED).max(LEAST_TIGHTENED);
            }
        }
        let Some(better) = next else { break };
        blocks = better;
        equations = blocks.equations(observed, whitening);
        damping *= EASED;
        if before - equations.normal.cost <= LEAST_FALL * before {
            break;
        }
    }
    Descended { blocks, equations }
}
