//! What a refined identification returns.

use super::cells::Cells;
use super::piecewise::Term;
use crate::identify::outcome::{ChosenOrder, Verdict, Warning};
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::Curve;
use crate::sort;

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

impl Breakpoint {
    /// Those of a basis, in order.
    pub(super) fn of(terms: &[Term], cells: &Cells) -> Vec<Breakpoint> {
        let breakpoint = |t: &Term| match t {
            Term::Power(_) => None,
            Term::TruncatedPower { at, degree } => Some(Breakpoint {
                at: cells.unit.back(*at),
                kind: match degree {
                    0 => BreakpointKind::Value,
                    1 => BreakpointKind::Slope,
                    _ => BreakpointKind::ThirdDerivative,
                },
            }),
        };
        let mut all: Vec<Breakpoint> = terms.iter().filter_map(breakpoint).collect();
        sort::by_key(&mut all, |b| b.at);
        all
    }
}
