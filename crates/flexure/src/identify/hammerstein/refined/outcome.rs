//! What a refined identification returns, and how its parameters' uncertainty becomes that of the two blocks.

use super::super::calibration::{Calibrated, Calibration, Estimated};
use super::alternate::Minimum;
use super::cells::Cells;
use super::descent::{fixed, scaled};
use super::loss::Model;
use super::pieces::Term;
use crate::error::Result;
use crate::identify::outcome::{ChosenOrder, Verdict, Warning};
use crate::linalg;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::{Curve, Outside};

/// Evenly spaced points of the tabulated nonlinearity.
const POINTS: usize = 401;
/// Distance of the two points on either side of a jump, in the unit coordinate.
const JUMP: f64 = 1e-9;
/// The normal quantile of a two-sided 95 % band.
const BAND_QUANTILE: f64 = 1.959_963_984_540_054;
/// The step of a numerical derivative, in standard errors.
const STEP: f64 = 1e-2;

/// What changes at a breakpoint of the nonlinearity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BreakpointKind {
    /// The value: a jump.
    Value,
    /// The slope: a kink.
    Slope,
    /// The third derivative, as at a knot of a cubic spline.
    ThirdDerivative,
}

/// A breakpoint that the data asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breakpoint {
    /// Where, in the input's unit.
    pub at: f64,
    /// What changes there.
    pub kind: BreakpointKind,
}

/// Standard errors of the linear part's coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientErrors {
    /// Of [`TransferFunction::b`], zero for the delay's zeros and for what the calibration fixes.
    pub b: Vec<f64>,
    /// Of [`TransferFunction::a`], zero for the leading 1.
    pub a: Vec<f64>,
}

/// The output with the other samples' share taken out: noisy values of the nonlinearity itself, as means over cells
/// of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryRemoved {
    /// The mean input of every cell, increasing.
    pub x: Vec<f64>,
    /// The mean value there, in the scale of the nonlinearity.
    pub value: Vec<f64>,
    /// The number of samples in every cell.
    pub samples: Vec<f64>,
    /// The standard deviation of a single sample's value.
    pub deviation: f64,
}

/// A refined model with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct RefinedIdentification {
    /// The model, ready to simulate.
    pub model: Block,
    /// The static nonlinearity, normalised.
    pub nonlinearity: Curve,
    /// Half width of the pointwise 95 % band at the curve's points: 1.96 standard errors for these breakpoints,
    /// the linear part's uncertainty included.
    pub band: Vec<f64>,
    /// The linear part, normalised; the delay is leading zeros of its numerator. Always stable.
    pub linear: TransferFunction,
    /// Standard errors of its coefficients. They and the band allow for the error's colour by whitening it; where that
    /// is not done (missing samples, no noise model), they take the error for white.
    pub linear_errors: CoefficientErrors,
    /// Added to the linear part's output.
    pub output_offset: f64,
    /// The delay s in samples.
    pub delay: usize,
    /// The order of the linear part.
    pub order: ChosenOrder,
    /// What the nonlinearity was estimated from in the end; empty if not refined.
    pub memory_removed: MemoryRemoved,
    /// The nonlinearity's breakpoints, increasing; it is a cubic polynomial between them.
    pub breakpoints: Vec<Breakpoint>,
    /// The autoregression 1, r_1, r_2, ... that whitens the output error; 1 alone where it is white.
    pub noise_model: Vec<f64>,
    /// The standard deviation of the whitened error, in the unit of y.
    pub noise: f64,
    /// Whether the refinement held; if not, this is the plain estimate, without standard errors.
    pub refined: bool,
    /// Samples `0..fitted` (of all experiments, one after the other) were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on.
    pub verdict: Verdict,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Both blocks in the calibration's scale.
pub(super) struct Blocks {
    pub curve: Curve,
    pub points: MemoryRemoved,
    pub band: Vec<f64>,
    pub linear: TransferFunction,
    pub errors: CoefficientErrors,
    pub offset: f64,
}

/// The covariance of all parameters, row-major, zero for the one that the scale fixes.
fn covariance(minimum: &Minimum) -> Option<Vec<f64>> {
    let n = minimum.normal.gradient.len();
    let skip = fixed(&minimum.model);
    let (mut matrix, scale) = scaled(&minimum.normal, skip);
    let m = scale.len();
    let inverse = linalg::inverse_positive_definite(&matrix, m).or_else(|| {
        (0..m).for_each(|i| matrix[i * m + i] += 1e-9);
        linalg::inverse_positive_definite(&matrix, m)
    })?;
    let power = minimum.noise().powi(2);
    let kept: Vec<usize> = (0..n).filter(|i| *i != skip).collect();
    let mut covariance = vec![0.0; n * n];
    for (p, &i) in kept.iter().enumerate() {
        for (q, &j) in kept.iter().enumerate() {
            covariance[i * n + j] = power * inverse[p * m + q] / (scale[p] * scale[q]);
        }
    }
    Some(covariance)
}

/// What is reported, for one set of parameters.
struct Reported<'a> {
    calibration: &'a Calibration,
    at: &'a [f64],
    output_mean: f64,
    gain_error: f64,
}

impl Reported<'_> {
    fn calibrated(&self, model: &Model) -> Result<Calibrated> {
        let phi = model.combined();
        let d = &model.dynamics;
        self.calibration.apply(&Estimated {
            nonlinearity: &|x| phi.value(x),
            mean: 0.0,
            linear: &TransferFunction::new(d.b.clone(), d.a.clone())?,
            gain_error: self.gain_error,
            output_mean: self.output_mean + model.offset,
        })
    }

    /// phi at the points, b, and a from a_1 on.
    fn values(&self, model: &Model) -> Option<Vec<f64>> {
        let Calibrated { gain, mean, .. } = self.calibrated(model).ok()?;
        let phi = model.combined();
        let d = &model.dynamics;
        let curve = self.at.iter().map(|x| gain * phi.value(*x) + mean);
        let linear = d.b.iter().map(|b| b / gain).chain(d.a[1..].iter().copied());
        Some(curve.chain(linear).collect())
    }
}

/// Scales the blocks and propagates the parameters' covariance to them.
pub(super) fn blocks(
    minimum: &Minimum,
    cells: &Cells,
    calibration: &Calibration,
    output_mean: f64,
    warnings: &mut Vec<Warning>,
) -> Result<Blocks> {
    let model = &minimum.model;
    let at = abscissas(minimum, cells);
    let covariance = covariance(minimum);
    let mut reported = Reported {
        calibration,
        at: &at,
        output_mean,
        gain_error: 0.0,
    };
    if let Some(v) = &covariance {
        reported.gain_error = gain_error(model, v);
    }
    let Calibrated {
        gain,
        mean,
        output_offset,
        warning,
    } = reported.calibrated(model)?;
    warnings.extend(warning);
    let phi = model.combined();
    let ordinates = at.iter().map(|x| gain * phi.value(*x) + mean).collect();
    let curve = Curve::new(at.clone(), ordinates, Outside::Nearest)?;
    let d = &model.dynamics;
    let delayed = |b: Vec<f64>| -> Vec<f64> { std::iter::repeat_n(0.0, d.delay).chain(b).collect() };
    let linear = TransferFunction::new(delayed(d.b.iter().map(|b| b / gain).collect()), d.a.clone())?;
    let errors = covariance
        .and_then(|v| standard_errors(&reported, model, &v))
        .unwrap_or_else(|| vec![0.0; at.len() + d.b.len() + d.a.len() - 1]);
    let (band, rest) = errors.split_at(at.len());
    let (b, a) = rest.split_at(d.b.len());
    Ok(Blocks {
        band: band.iter().map(|e| BAND_QUANTILE * e).collect(),
        errors: CoefficientErrors {
            b: delayed(b.to_vec()),
            a: std::iter::once(0.0).chain(a.iter().copied()).collect(),
        },
        points: MemoryRemoved {
            x: cells.s.iter().map(|s| cells.unit.back(*s)).collect(),
            value: minimum.values.iter().map(|z| gain * z + mean).collect(),
            samples: cells.count.clone(),
            deviation: gain.abs() * minimum.variance.sqrt(),
        },
        curve,
        linear,
        offset: output_offset,
    })
}

/// The standard error of B(1)/A(1).
fn gain_error(model: &Model, covariance: &[f64]) -> f64 {
    let d = &model.dynamics;
    let (sum_a, first) = (d.a.iter().sum::<f64>(), model.c.len() + 1);
    let gain = d.b.iter().sum::<f64>() / sum_a;
    let n = first + d.b.len() + d.a.len() - 1;
    let slope = |i: usize| {
        if i < first + d.b.len() {
            1.0 / sum_a
        } else {
            -gain / sum_a
        }
    };
    let mut variance = 0.0;
    for i in first..n {
        for j in first..n {
            variance += slope(i) * slope(j) * covariance[i * n + j];
        }
    }
    variance.max(0.0).sqrt()
}

/// The standard errors of everything reported: the delta method with numerical derivatives.
fn standard_errors(reported: &Reported, model: &Model, covariance: &[f64]) -> Option<Vec<f64>> {
    let p = model.parameters();
    let n = p.len();
    let mut slopes = Vec::with_capacity(n);
    for i in 0..n {
        let step = STEP * covariance[i * n + i].max(0.0).sqrt();
        if !(step > 0.0) {
            slopes.push(None);
            continue;
        }
        let shifted = |sign: f64| {
            let mut q = p.clone();
            q[i] += sign * step;
            reported.values(&model.with(&q))
        };
        let (up, down) = (shifted(1.0)?, shifted(-1.0)?);
        slopes.push(Some(
            up.iter()
                .zip(&down)
                .map(|(u, d)| (u - d) / (2.0 * step))
                .collect::<Vec<f64>>(),
        ));
    }
    let outputs = slopes.iter().flatten().next()?.len();
    let mut variance = vec![0.0; outputs];
    for i in 0..n {
        for j in 0..n {
            if let (Some(a), Some(b)) = (&slopes[i], &slopes[j]) {
                let v = covariance[i * n + j];
                variance
                    .iter_mut()
                    .zip(a)
                    .zip(b)
                    .for_each(|((s, a), b)| *s += v * a * b);
            }
        }
    }
    let errors: Vec<f64> = variance.iter().map(|v| v.max(0.0).sqrt()).collect();
    errors.iter().all(|e| e.is_finite()).then_some(errors)
}

/// Evenly spaced points, and those around every breakpoint; the levels of an input that has few.
fn abscissas(minimum: &Minimum, cells: &Cells) -> Vec<f64> {
    let unit = cells.unit;
    let mut at: Vec<f64> = match cells.levels(POINTS) {
        Some(levels) => levels,
        None => (0..POINTS)
            .map(|i| unit.back(-1.0 + 2.0 * i as f64 / (POINTS - 1) as f64))
            .collect(),
    };
    if cells.levels(POINTS).is_none() {
        for term in &minimum.terms {
            if let Term::From { at: s, degree } = term {
                at.push(unit.back(*s));
                if *degree == 0 {
                    at.push(unit.back(s - JUMP));
                }
            }
        }
    }
    at.sort_unstable_by(f64::total_cmp);
    at.dedup();
    at
}

/// The breakpoints in order.
pub(super) fn breakpoints(terms: &[Term], cells: &Cells) -> Vec<Breakpoint> {
    let mut all: Vec<Breakpoint> = terms
        .iter()
        .filter_map(|t| match t {
            Term::Power(_) => None,
            Term::From { at, degree } => Some(Breakpoint {
                at: cells.unit.back(*at),
                kind: match degree {
                    0 => BreakpointKind::Value,
                    1 => BreakpointKind::Slope,
                    _ => BreakpointKind::ThirdDerivative,
                },
            }),
        })
        .collect();
    all.sort_by(|a, b| a.at.total_cmp(&b.at));
    all
}
