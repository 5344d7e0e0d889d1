//! Levenberg-Marquardt steps on all parameters of both blocks.

use super::loss::{Data, Model, Normal};
use crate::interrupt;
use crate::linalg;

/// Poles are kept within this radius.
const LARGEST_RADIUS: f64 = 0.9999;
/// A step that lowers the sum of squares by no more than this share is the last.
const TOLERANCE: f64 = 1e-7;
/// The first damping, in diagonal entries.
const DAMPING: f64 = 1e-7;
/// Larger damping moves nothing any more.
const MOST_DAMPING: f64 = 1e4;

/// The parameter that the scale convention fixes: the numerator's largest coefficient.
pub(super) fn fixed(model: &Model) -> usize {
    let b = &model.dynamics.b;
    let largest = (0..b.len()).max_by(|&i, &j| b[i].abs().total_cmp(&b[j].abs()));
    model.c.len() + 1 + largest.unwrap_or(0)
}

/// The matrix without row and column `skip`, scaled to a unit diagonal, and the scales.
pub(super) fn scaled(normal: &Normal, skip: usize) -> (Vec<f64>, Vec<f64>) {
    let n = normal.gradient.len();
    let kept: Vec<usize> = (0..n).filter(|&i| i != skip).collect();
    let scale: Vec<f64> = kept
        .iter()
        .map(|&i| normal.matrix[i * n + i].sqrt())
        .map(|s| if s > 0.0 { s } else { 1.0 })
        .collect();
    let mut matrix = Vec::with_capacity(kept.len() * kept.len());
    for (i, si) in kept.iter().zip(&scale) {
        matrix.extend(
            kept.iter()
                .zip(&scale)
                .map(|(j, sj)| normal.matrix[i * n + j] / (si * sj)),
        );
    }
    (matrix, scale)
}

fn step(normal: &Normal, skip: usize, damping: f64) -> Option<Vec<f64>> {
    let (mut matrix, scale) = scaled(normal, skip);
    let n = scale.len();
    for i in 0..n {
        matrix[i * n + i] += damping;
    }
    let gradient = normal.gradient.iter().enumerate().filter(|(i, _)| *i != skip);
    let rhs: Vec<f64> = gradient.zip(&scale).map(|((_, g), s)| g / s).collect();
    let mut step: Vec<f64> = linalg::solve_positive_definite(&matrix, &rhs)?;
    step.iter_mut().zip(&scale).for_each(|(d, s)| *d /= s);
    step.insert(skip, 0.0);
    Some(step)
}

fn admissible(model: &Model) -> bool {
    let d = &model.dynamics;
    model.parameters().iter().all(|p| p.is_finite())
        && linalg::roots(&d.a).is_some_and(|poles| poles.iter().all(|p| p.norm() <= LARGEST_RADIUS))
}

/// Lowers the squared prediction error by at most so many steps; the model and its equations.
pub(super) fn descend(mut model: Model, data: &Data, whitening: &[f64], steps: usize) -> (Model, Normal) {
    let mut normal = model.normal(data, whitening);
    let mut damping = DAMPING;
    for _ in 0..steps {
        let skip = fixed(&model);
        let mut next = None;
        while next.is_none() && damping < MOST_DAMPING && !interrupt::requested() {
            let trial = step(&normal, skip, damping).map(|d| {
                let p: Vec<f64> = model.parameters().iter().zip(d).map(|(p, d)| p + d).collect();
                model.with(&p)
            });
            next = trial
                .filter(admissible)
                .filter(|m| m.squares(data, whitening).0 < normal.squares);
            if next.is_none() {
                damping = (damping * 30.0).max(1e-5);
            }
        }
        let Some(better) = next else { break };
        let before = normal.squares;
        model = better;
        normal = model.normal(data, whitening);
        damping *= 0.1;
        if before - normal.squares <= TOLERANCE * before {
            break;
        }
    }
    (model, normal)
}
