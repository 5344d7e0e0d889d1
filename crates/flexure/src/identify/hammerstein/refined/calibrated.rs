//! Both blocks in the calibration's scale, with standard errors.
//!
//! The parameters' covariance is $\sigma^2 (J'J)^{-1}$ at the minimum (Ljung 1999, section 9.4). The reported values also depend on the
//! parameters through the calibration, so the covariance is propagated by the delta method with numerical derivatives. The places of the
//! kinks are among the parameters (`kinks.rs`).

use super::super::calibration::{Calibrated, Calibration, Uncalibrated};
use super::super::delayed;
use super::super::limits::GAIN_TAIL;
use super::RefinedMinimum;
use super::alternation::Minimum;
use super::blocks::Blocks;
use super::cells::Cells;
use super::form_fit::MemoryRemoved;
use super::kinks::WithJumps;
use super::limits::{DERIVATIVE_STEP, END_SHARE, JUMP_WIDTH, POINTS, SINGULAR_RIDGE};
use super::loss::Equations;
use super::piecewise::{Breakpoint, Term, breakpoints};
use crate::error::Result;
use crate::identify::limits::FEW_LEVELS;
use crate::identify::result::CoefficientErrors;
use crate::identify::warning::Warning;
use crate::linear::TransferFunction;
use crate::linear::least_squares::UnitDiagonal;
use crate::nonlinearity::{Curve, Outside};
use crate::quantiles::NORMAL_95;
use crate::vectors::dot;

/// Both blocks in the calibration's scale.
pub(super) struct CalibratedBlocks {
    pub curve: Curve,
    pub memory_removed: MemoryRemoved,
    pub breakpoints: Vec<Breakpoint>,
    pub band: Vec<f64>,
    pub linear: TransferFunction,
    pub errors: CoefficientErrors,
    pub offset: f64,
    pub warning: Option<Warning>,
}

impl CalibratedBlocks {
    /// Scales the blocks and propagates the parameters' covariance to them.
    pub fn new(found: &RefinedMinimum, calibration: &Calibration) -> Result<Self> {
        let RefinedMinimum {
            minimum,
            extended,
            cells,
            output_mean,
        } = found;
        let WithJumps {
            blocks,
            covariance,
            kinks,
            ..
        } = extended;
        let at = abscissas(minimum, cells);
        let place_error = |term: usize| {
            let kink = kinks.iter().find(|kink| kink.term == term)?;
            extended.place_error(kink).map(|error| cells.unit.half * error)
        };
        let reported = Reported {
            calibration,
            at: &at,
            output_mean: *output_mean,
            gain_error: covariance.as_ref().map_or(0.0, |v| v.of_static_gain(blocks)),
        };
        let Calibrated {
            gain,
            mean,
            output_offset,
            warning,
        } = reported.calibrated(blocks)?;
        let phi = blocks.nonlinearity();
        let ordinates = at.iter().map(|x| gain * phi.value(*x) + mean).collect();
        let linear = &blocks.linear;
        let coefficients = linear.b().len() + linear.a().len();
        let spread = covariance.as_ref().and_then(|v| reported.spread(blocks, v));
        let spread = spread.unwrap_or_else(|| Spread::none(at.len(), coefficients));
        let (band, errors) = spread.errors.split_at(at.len());
        let (b, a) = errors.split_at(linear.b().len());
        Ok(CalibratedBlocks {
            band: band.iter().map(|e| NORMAL_95 * e).collect(),
            errors: CoefficientErrors {
                b: [&vec![0.0; linear.delay], b].concat(),
                a: [&[0.0], a].concat(),
                covariance: spread.coefficients,
            },
            breakpoints: breakpoints(&minimum.terms, cells.unit, place_error),
            memory_removed: MemoryRemoved {
                x: cells.s.iter().map(|s| cells.unit.back(*s)).collect(),
                value: minimum.values.iter().map(|z| gain * z + mean).collect(),
                samples: cells.count.clone(),
                deviation: gain.abs() * minimum.variance.sqrt(),
            }
            .allowing_for(minimum.dependence, |x| gain * phi.value(x) + mean, minimum.terms.len()),
            linear: delayed(linear.b(), linear.transfer.a(), gain, linear.delay)?,
            curve: Curve::new(at, ordinates, outside(&minimum.terms, cells))?,
            offset: output_offset,
            warning,
        })
    }
}

/// The covariance of all parameters, row-major, zero for the one that the scale fixes.
pub(super) struct Covariance {
    rows: Vec<f64>,
    parameters: usize,
}

impl Covariance {
    pub fn new(blocks: &Blocks, equations: &Equations) -> Option<Covariance> {
        let n = equations.parameters();
        let fixed = blocks.fixed_parameter();
        let scaled = UnitDiagonal::new(&equations.normal.without(fixed));
        let inverse = (scaled.scaled_inverse(0.0)).or_else(|| scaled.scaled_inverse(SINGULAR_RIDGE))?;
        let power = equations.noise().powi(2);
        let mut rows = vec![0.0; n * n];
        let kept: Vec<usize> = (0..n).filter(|&i| i != fixed).collect();
        for (p, &i) in kept.iter().enumerate() {
            for (q, &j) in kept.iter().enumerate() {
                rows[i * n + j] = power * inverse[p * kept.len() + q] / (scaled.scale[p] * scaled.scale[q]);
            }
        }
        Some(Covariance { rows, parameters: n })
    }

    fn of(&self, i: usize, j: usize) -> f64 {
        self.rows[i * self.parameters + j]
    }

    /// The standard error of a parameter.
    pub fn error(&self, i: usize) -> f64 {
        self.of(i, i).max(0.0).sqrt()
    }

    /// The standard error of the static gain B(1)/A(1) if the scale of the blocks is fixed by the absolute sum S of the response $k_j$. A poorly
    /// known coefficient that fixes it would make all errors large.
    fn of_static_gain(&self, blocks: &Blocks) -> f64 {
        let (at, linear) = (blocks.layout(), &blocks.linear.transfer);
        let k = linear.impulse_response(linear.settling(GAIN_TAIL));
        let all_pole = TransferFunction::monic(vec![1.0], linear.a()[1..].to_vec());
        let by_b = all_pole.impulse_response(k.len());
        let by_a = all_pole.simulate(&k);
        let ratio = k.iter().sum::<f64>() / k.iter().map(|k| k.abs()).sum::<f64>();
        // The derivative of the gain minus ratio S by each k_j.
        let weight: Vec<f64> = k.iter().map(|k| 1.0 - ratio * k.signum()).collect();
        let slope = |i: usize| match at.b.contains(&i) {
            true => dot(weight.get(i - at.b.start..).unwrap_or_default(), &by_b),
            false => -dot(weight.get(i - at.a.start + 1..).unwrap_or_default(), &by_a),
        };
        let slopes: Vec<(usize, f64)> = (at.b.start..at.a.end).map(|i| (i, slope(i))).collect();
        let pairs = slopes.iter().flat_map(|p| slopes.iter().map(move |q| (p, q)));
        let variance: f64 = pairs.map(|((i, p), (j, q))| p * q * self.of(*i, *j)).sum();
        variance.max(0.0).sqrt()
    }
}

/// The reported values for one set of parameters.
struct Reported<'a> {
    calibration: &'a Calibration,
    /// The curve's abscissas.
    at: &'a [f64],
    output_mean: f64,
    gain_error: f64,
}

impl Reported<'_> {
    fn calibrated(&self, blocks: &Blocks) -> Result<Calibrated> {
        let phi = blocks.nonlinearity();
        self.calibration.apply(&Uncalibrated {
            nonlinearity: &|x| phi.value(x),
            mean: 0.0,
            linear: &blocks.linear.transfer,
            gain_error: self.gain_error,
            output_mean: self.output_mean + blocks.offset,
        })
    }

    /// phi at the points, b, and a from a_1 on.
    fn values(&self, blocks: &Blocks) -> Option<Vec<f64>> {
        let Calibrated { gain, mean, .. } = self.calibrated(blocks).ok()?;
        let phi = blocks.nonlinearity();
        let curve = self.at.iter().map(|x| gain * phi.value(*x) + mean);
        let b = blocks.linear.b().iter().map(|b| b / gain);
        Some(curve.chain(b).chain(blocks.linear.a().iter().copied()).collect())
    }

    /// The uncertainty of all these values; `None` if an error is not finite.
    fn spread(&self, blocks: &Blocks, covariance: &Covariance) -> Option<Spread> {
        let p = blocks.parameters();
        // The slopes by the parameters that have an error.
        let mut slopes: Vec<(usize, Vec<f64>)> = Vec::new();
        for i in 0..p.len() {
            let step = DERIVATIVE_STEP * covariance.error(i);
            if !(step > 0.0) {
                continue;
            }
            let shifted = |by: f64| {
                let mut q = p.clone();
                q[i] += by;
                self.values(&blocks.with(&q))
            };
            let (up, down) = (shifted(step)?, shifted(-step)?);
            let slope = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step));
            slopes.push((i, slope.collect()));
        }
        let first = self.at.len();
        let mut variance = vec![0.0; slopes.first()?.1.len()];
        let count = variance.len() - first;
        let mut coefficients = vec![0.0; count * count];
        for (i, a) in &slopes {
            for (j, b) in &slopes {
                let v = covariance.of(*i, *j);
                let terms = variance.iter_mut().zip(a).zip(b);
                terms.for_each(|((s, a), b)| *s += v * a * b);
                for (row, a) in coefficients.chunks_exact_mut(count).zip(&a[first..]) {
                    let terms = row.iter_mut().zip(&b[first..]);
                    terms.for_each(|(s, b)| *s += v * a * b);
                }
            }
        }
        let errors: Vec<f64> = variance.iter().map(|v| v.max(0.0).sqrt()).collect();
        let is_finite = errors.iter().all(|e| e.is_finite());
        is_finite.then_some(Spread { errors, coefficients })
    }
}

/// The uncertainty of the reported values.
struct Spread {
    /// Standard errors of all of them.
    errors: Vec<f64>,
    /// The covariance of b and of a from a_1 on, row by row; empty where it is not known.
    coefficients: Vec<f64>,
}

impl Spread {
    fn none(points: usize, coefficients: usize) -> Self {
        Spread {
            errors: vec![0.0; points + coefficients],
            coefficients: Vec::new(),
        }
    }
}

/// A straight continuation if both end pieces have enough samples to determine their slope; otherwise the end's value.
fn outside(terms: &[Term], cells: &Cells) -> Outside {
    let total: f64 = cells.count.iter().sum();
    let share = |in_piece: &dyn Fn(f64, f64) -> bool| {
        let at = |s: f64| {
            terms
                .iter()
                .all(|t| !matches!(t, Term::TruncatedPower { at, .. } if !in_piece(s, *at)))
        };
        let samples = cells.s.iter().zip(&cells.count).filter(|(s, _)| at(**s));
        samples.map(|(_, count)| count).sum::<f64>() / total
    };
    match share(&|s, at| s < at).min(share(&|s, at| s >= at)) >= END_SHARE {
        true => Outside::Linear,
        false => Outside::Nearest,
    }
}

/// Evenly spaced points, and those around every breakpoint; for an input with few levels, only these.
fn abscissas(minimum: &Minimum, cells: &Cells) -> Vec<f64> {
    let unit = cells.unit;
    let mut at = cells.levels(FEW_LEVELS).unwrap_or_else(|| {
        let even = (0..POINTS).map(|i| unit.back(-1.0 + 2.0 * i as f64 / (POINTS - 1) as f64));
        let around = minimum.terms.iter().flat_map(|term| match *term {
            Term::TruncatedPower { at, degree: 0 } => vec![unit.back(at), unit.back(at - JUMP_WIDTH)],
            Term::TruncatedPower { at, .. } => vec![unit.back(at)],
            Term::Power(_) => Vec::new(),
        });
        even.chain(around).collect()
    });
    at.sort_unstable_by(f64::total_cmp);
    at.dedup();
    at
}
