//! The paths of the inputs, block by block.

use std::borrow::Cow;

use super::flats::flats;
use crate::linear::TransferFunction;
use crate::model::{FeedbackModel, LoopInput, LoopOutput, NarxModel, VolterraModel};
use crate::nonlinearity::{Curve, Surface};
use crate::text::{counted, joined, number, with_error};

/// A kink with a larger standard error, as a share of the curve's range, is not named: a smooth curve may have it. Convention.
const VAGUE: f64 = 0.1;
/// An end nearer to zero, as a share of the curve's range, is zero to rounding.
const ROUNDING: f64 = 1e-12;

/// Blocks in series.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The columns that enter the first block.
    pub inputs: Vec<String>,
    /// The blocks in the signal's order.
    pub blocks: Vec<NamedBlock>,
}

impl Path {
    /// The number of poles of all linear blocks.
    pub fn order(&self) -> usize {
        self.linear().map(LinearBlock::order).sum()
    }

    /// The total delay of all linear blocks, in samples.
    pub fn delay(&self) -> usize {
        self.linear().map(LinearBlock::delay).sum()
    }

    /// The linear blocks that act at the samples.
    pub fn linear(&self) -> impl Iterator<Item = &LinearBlock> {
        self.main().filter_map(NamedBlock::linear)
    }

    /// The static nonlinearities that act at the samples.
    pub fn curves(&self) -> impl Iterator<Item = &StaticBlock> {
        self.main().filter_map(NamedBlock::curve)
    }

    /// The blocks that act at the samples.
    pub fn main(&self) -> impl Iterator<Item = &NamedBlock> {
        self.blocks.iter().filter(|b| !b.between_samples)
    }
}

/// A block and its role in the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedBlock {
    /// Its name in JSON and in files, for example "front"; unique within a path.
    pub role: Cow<'static, str>,
    /// Its heading, for example "Front linear part".
    pub title: Cow<'static, str>,
    /// Whether it belongs to the second way through the blocks, which acts at an instant between the samples.
    pub between_samples: bool,
    /// The block itself.
    pub kind: BlockKind,
}

/// A block of one kind, with its errors and description.
#[derive(Debug, Clone, PartialEq)]
pub enum BlockKind {
    /// A static nonlinearity of one input.
    Static(StaticBlock),
    /// Linear dynamics.
    Linear(LinearBlock),
    /// A static nonlinearity of several inputs.
    Surface(Surface),
    /// A static nonlinearity in a feedback loop.
    Feedback(Box<FeedbackBlock>),
    /// A polynomial of past outputs and inputs.
    Narx(NarxModel),
    /// A Volterra series.
    Volterra(VolterraModel),
}

impl NamedBlock {
    /// A block that acts at the samples.
    pub fn new(role: impl Into<Cow<'static, str>>, title: impl Into<Cow<'static, str>>, kind: BlockKind) -> Self {
        NamedBlock {
            role: role.into(),
            title: title.into(),
            between_samples: false,
            kind,
        }
    }

    /// The static nonlinearity of one input, if it is one or has one in its loop.
    pub fn curve(&self) -> Option<&StaticBlock> {
        match &self.kind {
            BlockKind::Static(block) => Some(block),
            BlockKind::Feedback(block) => Some(&block.nonlinearity),
            _ => None,
        }
    }

    /// The linear dynamics, if it is one.
    pub fn linear(&self) -> Option<&LinearBlock> {
        match &self.kind {
            BlockKind::Linear(block) => Some(block),
            _ => None,
        }
    }
}

/// A static nonlinearity in a feedback loop.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedbackBlock {
    /// The loop.
    pub model: FeedbackModel,
    /// Its nonlinearity.
    pub nonlinearity: StaticBlock,
}

/// A linear system inside a loop, or the loop as a whole.
pub struct LoopPart {
    /// Its name in JSON, for example "input_to_output".
    pub role: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What it is, as a phrase.
    pub meaning: String,
    /// The transfer function.
    pub block: LinearBlock,
}

/// The part of the nonlinearity's range over which its slope is taken where the loop rests. Convention.
const SMALL: f64 = 0.02;

impl FeedbackBlock {
    /// The ways through the linear part: from the input and from the nonlinearity, to the output and to the nonlinearity.
    pub fn linear_parts(&self) -> Vec<LoopPart> {
        use {LoopInput as From, LoopOutput as To};
        let way = |from, to| self.model.transfer_function(from, to).ok();
        [
            LoopPart::new(
                "input_to_output",
                "Linear part, input to output",
                "the way past the nonlinearity",
                way(From::Input, To::Output),
            ),
            LoopPart::new(
                "nonlinearity_to_output",
                "Linear part, nonlinearity to output",
                "what the nonlinearity adds to the output",
                way(From::Nonlinearity, To::Output),
            ),
            LoopPart::new(
                "input_to_nonlinearity",
                "Linear part, input to nonlinearity",
                "how the input reaches the nonlinearity, beside the loop",
                way(From::Input, To::Nonlinearity),
            ),
            LoopPart::new(
                "around",
                "Linear part, nonlinearity back to itself",
                "the way around the loop",
                way(From::Nonlinearity, To::Nonlinearity),
            ),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// The loop as a whole, from the input to the output, with a straight line in place of the nonlinearity: its slope where the loop rests,
    /// and its mean slope.
    pub fn whole(&self) -> Vec<LoopPart> {
        let x = self.model.nonlinearity.x();
        let [first, last] = [x[0], x[x.len() - 1]];
        let (low, high) = match self.nonlinearity.breakpoints[..] {
            [low, .., high] => (low, high),
            _ => (first, last),
        };
        // One cubic goes on beyond the data, half their range on either side.
        let beyond = match self.nonlinearity.pieces() == 1 && self.nonlinearity.kinks.is_empty() {
            true => (high - low) / 4.0,
            false => 0.0,
        };
        let (low, high) = (low + beyond, high - beyond);
        let half = SMALL / 2.0 * (high - low);
        let at = self.model.resting_point().max(first + half).min(last - half);
        let large = format!(
            "the nonlinearity as a straight line, with its mean slope from {} to {}",
            number(low),
            number(high)
        );
        let with = |low, high| self.model.with_slope(self.model.mean_slope(low, high)).ok();
        [
            LoopPart::new(
                "whole_small",
                "Whole loop at small amplitudes",
                "the nonlinearity as a straight line, with its slope where the loop rests",
                with(at - half, at + half),
            ),
            LoopPart::new("whole_large", "Whole loop at large amplitudes", large, with(low, high)),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

impl LoopPart {
    fn new(
        role: &'static str,
        title: &'static str,
        meaning: impl Into<String>,
        system: Option<TransferFunction>,
    ) -> Option<LoopPart> {
        let (errors, impulse) = (None, None);
        let block = LinearBlock {
            system: system?,
            errors,
            impulse,
        };
        Some(LoopPart {
            role,
            title,
            meaning: meaning.into(),
            block,
        })
    }
}

/// A static nonlinearity.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticBlock {
    /// Its table.
    pub curve: Curve,
    /// Half width of the pointwise 95 % band at the curve's points; empty where there is none.
    pub band: Vec<f64>,
    /// What the band is, for example "95 % pointwise, variance only"; empty where there is none.
    pub band_label: &'static str,
    /// The ends of the cubic pieces of a spline, increasing, in the unit of its input; otherwise empty.
    pub breakpoints: Vec<f64>,
    /// Points at which the slope of a spline changes at once, increasing, in the same unit.
    pub kinks: Vec<f64>,
    /// Their standard errors; empty where they are not known.
    pub kink_errors: Vec<f64>,
    /// How it was estimated, for reading.
    pub description: String,
}

impl StaticBlock {
    /// A cubic spline with kinks.
    pub fn spline(curve: Curve, breakpoints: Vec<f64>, kinks: Vec<f64>) -> Self {
        let mut block = StaticBlock {
            curve,
            band: Vec::new(),
            band_label: "",
            breakpoints,
            kinks,
            kink_errors: Vec::new(),
            description: String::new(),
        };
        block.describe_spline();
        block
    }

    /// Standard errors of the kinks of a spline, as many as there are kinks.
    pub(in crate::identify) fn set_kink_errors(&mut self, errors: Vec<f64>) {
        self.kink_errors = errors;
        self.describe_spline();
    }

    fn describe_spline(&mut self) {
        let [low, high] = [self.breakpoints.first(), self.breakpoints.last()].map(|x| x.copied().unwrap_or_default());
        let range = high - low;
        self.description = format!(
            "cubic spline of {} on [{}, {}]{}{}",
            counted(self.pieces(), "piece"),
            end(low, range),
            end(high, range),
            places(&self.kinks, &self.kink_errors, range),
            flats(self.curve.x(), self.curve.y(), [low, high])
        );
    }

    /// A curve by an estimator of this name.
    pub fn new(curve: Curve, estimator: &str) -> Self {
        let x = curve.x();
        let (low, high) = (x[0], x[x.len() - 1]);
        let [low, high] = [low, high].map(|x| end(x, high - low));
        let description = format!("{estimator} on [{low}, {high}]");
        StaticBlock {
            curve,
            band: Vec::new(),
            band_label: "",
            breakpoints: Vec::new(),
            kinks: Vec::new(),
            kink_errors: Vec::new(),
            description,
        }
    }

    /// The kinks whose places the data determine, as the description lists them.
    pub fn clear_kinks(&self) -> Vec<f64> {
        let x = self.curve.x();
        let range = x[x.len() - 1] - x[0];
        let is_clear = |i: &usize| self.kink_errors.get(*i).is_none_or(|error| *error <= VAGUE * range);
        (0..self.kinks.len()).filter(is_clear).map(|i| self.kinks[i]).collect()
    }

    /// The number of cubic pieces of a spline.
    pub fn pieces(&self) -> usize {
        self.breakpoints.len().saturating_sub(1)
    }

    /// The lower (`sign` -1) or upper (1) edge of the band; empty where there is none.
    pub fn band_edge(&self, sign: f64) -> Vec<f64> {
        let points = self.curve.y().iter().zip(&self.band);
        points.map(|(y, b)| y + sign * b).collect()
    }
}

/// An end of a curve on a range of this size.
fn end(x: f64, range: f64) -> String {
    number(if x.abs() < ROUNDING * range { 0.0 } else { x })
}

/// The places of the kinks, as a continuation of the description of a spline.
fn places(kinks: &[f64], errors: &[f64], range: f64) -> String {
    let place = |(i, at): (usize, &f64)| match errors.get(i) {
        Some(error) if *error > VAGUE * range => None,
        Some(error) => Some(with_error(*at, *error)),
        None => Some(number(*at)),
    };
    let places: Vec<String> = kinks.iter().enumerate().filter_map(place).collect();
    match places.as_slice() {
        [] => String::new(),
        [one] => format!(", kink at {one}"),
        several => format!(", kinks at {}", joined(several)),
    }
}

/// Linear dynamics.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearBlock {
    /// The transfer function; the delay is leading zeros of its numerator. Always stable.
    pub system: TransferFunction,
    /// Standard errors of its coefficients, if known.
    pub errors: Option<CoefficientErrors>,
    /// The estimated impulse response, from lag 0, to which it was fitted, if there is one.
    pub impulse: Option<ImpulseEstimate>,
}

/// An estimated impulse response.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpulseEstimate {
    /// From lag 0.
    pub values: Vec<f64>,
    /// A value of pure noise lies within this distance of zero with a probability of 99 %.
    pub limit: f64,
}

/// Standard errors of a transfer function's coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientErrors {
    /// Errors of [`TransferFunction::b`]; zero for the delay's zeros and for a coefficient that the calibration fixes.
    pub b: Vec<f64>,
    /// Errors of [`TransferFunction::a`]; zero for the leading 1.
    pub a: Vec<f64>,
    /// The covariance of the coefficients, row by row: first those of b after the delay, then those of a from the second on. Empty if it is
    /// not known, as for a model from a file.
    pub covariance: Vec<f64>,
}

impl CoefficientErrors {
    /// The errors from the covariance of `count` coefficients of b after a delay, and all coefficients of a except the first.
    pub(in crate::identify) fn new(covariance: Vec<f64>, delay: usize, count: usize) -> Self {
        let size = covariance.len().isqrt();
        let error = |i: usize| covariance[i * size + i].max(0.0).sqrt();
        CoefficientErrors {
            b: std::iter::repeat_n(0.0, delay).chain((0..count).map(error)).collect(),
            a: std::iter::once(0.0).chain((count..size).map(error)).collect(),
            covariance,
        }
    }
}

impl LinearBlock {
    /// A transfer function without standard errors.
    pub fn of(system: TransferFunction) -> BlockKind {
        BlockKind::Linear(LinearBlock {
            system,
            errors: None,
            impulse: None,
        })
    }

    /// Its delay in samples.
    pub fn delay(&self) -> usize {
        self.system.delay()
    }

    /// Its number of poles.
    pub fn order(&self) -> usize {
        self.system.a().len() - 1
    }
}
