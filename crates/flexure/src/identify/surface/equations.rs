//! The penalised least-squares problem of one Gauss-Newton step: its equations, and the likeliest penalties.

use super::super::block::{Rational, Signals};
use super::fit::Fit;
use super::limits::{
    FORGOTTEN, LEAST_SHARE, LEAST_SQUARES, OVERSTEP, PENALTIES, PENALTY_STEPS, RIDGE, SEGMENT, SETTLED, ZERO_EIGENVALUE,
};
use crate::linalg;
use crate::linear::least_squares::{NormalEquations, normal_equations};
use crate::linear::levenberg_marquardt::Linearisation;
use crate::nonlinearity::{SurfaceAxis, products};
use crate::vectors::{add, dot};

/// The normal equations of the output error: the columns are the filtered products of splines, the linear part's derivatives and a
/// constant.
///
/// Columns: the surface's coefficients, the linear part's parameters without the numerator's largest coefficient, which fixes the
/// scale, and the offset.
pub(super) fn equations(fit: &Fit, data: &Signals, free: bool) -> NormalEquations {
    let samples = data.y.len();
    let warm = fit.delay + fit.linear.settling(FORGOTTEN);
    let parts = (data.from..samples).step_by(SEGMENT).map(|start| {
        let end = samples.min(start + SEGMENT);
        let first = start.saturating_sub(warm);
        let u = data.u.iter().map(|u| u[first..end].to_vec()).collect();
        let part = Signals::new(u, data.y[first..end].to_vec(), start - first);
        let Linearisation { residuals, jacobian } = linearised(fit, &part, free);
        normal_equations(&residuals, &jacobian, part.from)
    });
    let sum = parts.reduce(|mut sum, next| {
        sum.add(&next);
        sum
    });
    sum.unwrap_or(NormalEquations::zero(0))
}

/// The linear part's parameters that are free: all except the numerator's largest.
pub(super) fn free_parameters(linear: &Rational) -> Vec<usize> {
    let largest = (0..linear.b.len()).max_by(|i, j| linear.b[*i].abs().total_cmp(&linear.b[*j].abs()));
    let all = 0..linear.parameters().len();
    all.filter(|i| Some(*i) != largest).collect()
}

/// The output error and its derivatives.
fn linearised(fit: &Fit, data: &Signals, free: bool) -> Linearisation {
    let axes = fit.surface.axes();
    let samples = data.y.len();
    let mut columns = vec![vec![0.0; samples]; fit.surface.coefficients().len()];
    let mut point = vec![0.0; axes.len()];
    for n in fit.delay..samples {
        point.iter_mut().zip(&data.u).for_each(|(x, u)| *x = u[n - fit.delay]);
        products(axes, &point, &mut |j, value| columns[j][n] = value);
    }
    let g = &fit.linear;
    let mut v = vec![0.0; samples];
    for (column, c) in columns.iter_mut().zip(fit.surface.coefficients()) {
        add(&mut v, *c, column);
        *column = g.run(column);
    }
    let all_pole = g.all_pole(&v);
    let output = g.numerator(&all_pole);
    if free {
        let mut derivatives = g.derivatives(&all_pole, &output);
        let free = free_parameters(g).into_iter();
        columns.extend(free.map(|i| std::mem::take(&mut derivatives[i])));
    }
    columns.push(vec![1.0; samples]);
    let errors = output.iter().zip(&data.y).map(|(p, y)| p + fit.offset - y);
    Linearisation {
        residuals: errors.collect(),
        jacobian: columns,
    }
}

/// Second differences along every axis: the penalties' matrices, and the eigenvalues for their pseudo-determinant.
pub(super) struct Penalty {
    /// Row-major, one per axis.
    matrices: Vec<Vec<f64>>,
    /// The eigenvalues of every matrix in the basis that they share.
    eigenvalues: Vec<Vec<f64>>,
    size: usize,
}

impl Penalty {
    /// `None` if an eigenvalue iteration fails.
    pub fn new(axes: &[SurfaceAxis]) -> Option<Penalty> {
        let counts: Vec<usize> = axes.iter().map(SurfaceAxis::splines).collect();
        let size: usize = counts.iter().product();
        let index = |j: usize, axis: usize| j / counts[axis + 1..].iter().product::<usize>() % counts[axis];
        let (mut matrices, mut eigenvalues) = (Vec::new(), Vec::new());
        for (axis, &m) in counts.iter().enumerate() {
            let own = squared_second_differences(m);
            let step: usize = counts[axis + 1..].iter().product();
            let mut matrix = vec![0.0; size * size];
            for i in 0..size {
                let at = index(i, axis);
                for k in 0..m {
                    matrix[i * size + i - at * step + k * step] = own[at * m + k];
                }
            }
            matrices.push(matrix);
            let along = linalg::symmetric_eigen(&own, m)?.values;
            let floor = ZERO_EIGENVALUE * along.iter().copied().fold(0.0, f64::max);
            let clean = |e: f64| if e > floor { e } else { 0.0 };
            eigenvalues.push((0..size).map(|j| clean(along[index(j, axis)])).collect());
        }
        Some(Penalty {
            matrices,
            eigenvalues,
            size,
        })
    }

    /// c'Sc of every axis.
    pub fn roughness(&self, c: &[f64]) -> Vec<f64> {
        self.matrices
            .iter()
            .map(|matrix| {
                let rows = matrix.chunks_exact(self.size).zip(c);
                rows.map(|(row, ci)| ci * dot(row, c)).sum()
            })
            .collect()
    }

    /// tr(S^- S_a) of every axis for the sum S of all with these weights.
    fn shares(&self, weights: &[f64]) -> Vec<f64> {
        let total = |j: usize| -> f64 { self.eigenvalues.iter().zip(weights).map(|(e, w)| w * e[j]).sum() };
        let share = |e: &Vec<f64>| {
            let each = (0..self.size).filter(|j| e[*j] > 0.0).map(|j| e[j] / total(j));
            each.sum()
        };
        self.eigenvalues.iter().map(share).collect()
    }
}

/// D'D for the second differences D of `m` values, row-major.
fn squared_second_differences(m: usize) -> Vec<f64> {
    let mut own = vec![0.0; m * m];
    let weights = [1.0, -2.0, 1.0];
    for first in 0..m.saturating_sub(2) {
        for (i, a) in weights.iter().enumerate() {
            for (k, b) in weights.iter().enumerate() {
                own[(first + i) * m + first + k] += a * b;
            }
        }
    }
    own
}

/// The solution of penalised normal equations under the likeliest penalties.
pub(super) struct Solution {
    /// All unknowns: the surface's coefficients themselves, the change of the others.
    pub unknowns: Vec<f64>,
    pub weights: Vec<f64>,
    /// The effective number of parameters of the surface's coefficients.
    pub effective: f64,
}

/// Minimises $|y - J x|^2 + \sum_a \lambda_a c'S_a c$ for the equations about the coefficients `c`, where the penalties $\lambda_a$ follow
/// from `weights` by Fellner & Schall's steps towards the largest marginal likelihood (Wood & Fasiolo 2017, eq. (4)). `None` if the
/// equations cannot be solved.
pub(super) fn likeliest(
    equations: &NormalEquations,
    penalty: &Penalty,
    c: &[f64],
    weights: &[f64],
    samples: usize,
) -> Option<Solution> {
    let (n, size) = (equations.descent.len(), penalty.size);
    // About the origin of the coefficients, not their present values.
    let row = |i: usize| &equations.normal[i * n..i * n + size];
    let moved: Vec<f64> = (0..n).map(|i| dot(row(i), c)).collect();
    let rhs: Vec<f64> = equations.descent.iter().zip(&moved).map(|(d, m)| d + m).collect();
    let cost = equations.cost + 2.0 * dot(c, &equations.descent) + dot(c, &moved);
    let typical = (0..size).map(|i| equations.normal[i * n + i]).sum::<f64>() / size as f64;
    let bounds = PENALTIES.map(|p| p * typical.max(f64::MIN_POSITIVE));
    let mut weights: Vec<f64> = weights
        .iter()
        .map(|w| (w * typical).clamp(bounds[0], bounds[1]))
        .collect();
    let mut last = None;
    for _ in 0..PENALTY_STEPS {
        let Fixed { unknowns, traces } = under(equations, penalty, &weights, &rhs, typical)?;
        let roughness = penalty.roughness(&unknowns[..size]);
        let effective = size as f64 - dot(&traces, &weights);
        let quadratic: f64 = (0..n)
            .map(|i| unknowns[i] * dot(&equations.normal[i * n..(i + 1) * n], &unknowns))
            .sum();
        let squares = (cost - 2.0 * dot(&unknowns, &rhs) + quadratic).max(LEAST_SQUARES * cost);
        let variance = squares / (samples as f64 - effective - (n - size) as f64).max(1.0);
        let shares = penalty.shares(&weights);
        let next: Vec<f64> = (0..weights.len())
            .map(|a| {
                let gain = (shares[a] - traces[a]).max(LEAST_SHARE);
                let ratio = variance * gain / roughness[a].max(f64::MIN_POSITIVE);
                let target = weights[a] * ratio.powf(OVERSTEP);
                target.clamp(bounds[0], bounds[1])
            })
            .collect();
        let before = last.as_ref().map_or(f64::INFINITY, |s: &Solution| s.effective);
        last = Some(Solution {
            unknowns,
            weights: weights.iter().map(|w| w / typical).collect(),
            effective,
        });
        if !((effective - before).abs() > SETTLED * effective.max(1.0)) {
            break;
        }
        weights = next;
    }
    last.filter(|s| s.unknowns.iter().all(|v| v.is_finite()))
}

/// The solution under fixed penalties.
struct Fixed {
    unknowns: Vec<f64>,
    /// $\mathrm{tr}(A^{-1} S_a)$ of every axis, for the matrix A of the penalised equations.
    traces: Vec<f64>,
}

/// Solves the equations with this right-hand side under penalties of these weights.
fn under(equations: &NormalEquations, penalty: &Penalty, weights: &[f64], rhs: &[f64], typical: f64) -> Option<Fixed> {
    let (n, size) = (rhs.len(), penalty.size);
    let mut matrix = equations.normal.clone();
    for i in 0..n {
        matrix[i * n + i] += RIDGE * (matrix[i * n + i] + typical);
    }
    for (s, w) in penalty.matrices.iter().zip(weights) {
        for i in 0..size {
            let to = &mut matrix[i * n..i * n + size];
            to.iter_mut()
                .zip(&s[i * size..(i + 1) * size])
                .for_each(|(m, s)| *m += w * s);
        }
    }
    let inverse = linalg::inverse_positive_definite(&matrix, n)?;
    let trace = |s: &Vec<f64>| {
        let row = |i: usize| dot(&s[i * size..(i + 1) * size], &inverse[i * n..i * n + size]);
        (0..size).map(row).sum()
    };
    Some(Fixed {
        unknowns: (0..n).map(|i| dot(&inverse[i * n..(i + 1) * n], rhs)).collect(),
        traces: penalty.matrices.iter().map(trace).collect(),
    })
}

/// The penalised part of the cost, for weights relative to the equations' typical entry.
pub(super) fn penalised(penalty: &Penalty, c: &[f64], weights: &[f64], equations: &NormalEquations) -> f64 {
    let n = equations.descent.len();
    let typical = (0..penalty.size).map(|i| equations.normal[i * n + i]).sum::<f64>() / penalty.size as f64;
    let each = penalty.roughness(c).into_iter().zip(weights);
    each.map(|(r, w)| w * typical * r).sum()
}
