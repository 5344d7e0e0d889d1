//! The Hammerstein system by prediction error over both blocks, from the plain estimate on.
//!
//! $$ Y_n = o + \frac{B(z)}{A(z)} z^{-s} \big(\varphi(X_n) + \xi_n\big) + e_n $$
//! with everything from the data: phi's breakpoints and their kind, the delay s, the order of A and B, and the
//! noise's colour. The plain estimate ([`PlainHammerstein`]) treats the linear part's memory as noise; here that is
//! taken out, and what remains is an efficient least-squares problem:
//!
//! 1. start: the plain estimate on at most 40,000 samples;
//! 2. delay and order by Schwarz's criterion of the whitened error, the linear part from the nonlinearity's output by
//!    covariances;
//! 3. the output error whitened by an autoregression (generalised least squares: noise that passes through
//!    the linear part has its poles, and costs a resonant system several times its accuracy otherwise);
//! 4. breakpoints: jumps, kinks and cubic knots where the memory-removed output asks for them;
//! 5. Levenberg-Marquardt on all coefficients of both blocks (Ljung 1999, chapter 10).
//!
//! Steps 2 to 5 are repeated until nothing changes. Every pass is O(n). No white input is needed.

mod alternate;
mod cells;
mod descent;
mod dynamics;
mod forms;
mod gather;
mod loss;
mod outcome;
mod pieces;
mod select;
mod stepwise;

use super::calibration::Calibration;
use super::{MOST_ORDER, PlainHammerstein, cascade};
use crate::error::{Error, Result};
use crate::identify::checks::{fresh_part, warn_if_useless, warn_of_colour, warn_of_range};
use crate::identify::outcome::{ChosenOrder, Identification, Verdict, Warning};
use crate::interrupt;
use crate::linear::correlation::mean;
use crate::model::Block;
use crate::nonlinearity::{Curve, EstimatorName};
use crate::record::Record;
use crate::validation::Estimated;
use alternate::{Minimum, Start, alternate};
use cells::Cells;
pub use forms::{Form, FormFit, FormParameter};
use gather::Gathered;
use loss::{Data, Dynamics, filter};
pub use outcome::{Breakpoint, BreakpointKind, CoefficientErrors, MemoryRemoved, RefinedIdentification};

/// The plain estimate starts from at most so many samples.
const START: usize = 40_000;
/// Samples beyond the impulse response's settling that do not count at the start of an experiment.
const AFTER_SETTLING: usize = 30;
/// At most this share of an experiment is left out for its unknown initial state.
const LEFT_OUT: usize = 10;

/// The plain estimate's error on its own samples is below the noise by no more than this share and so many samples'.
const OVERFITTED: f64 = 0.02;
const OVERFITTED_SAMPLES: f64 = 20.0;

/// The refined identification of a Hammerstein system.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `order` | order of the linear part | 0 to 50 | Schwarz's criterion, 0 to 8 |
/// | `delay` | delay s in samples | below a quarter of the record | the first clear lag |
/// | `calibration` | convention for scale and offset | | unit static gain |
/// | `start` | estimator of the nonlinearity that the refinement starts from | | the kernel's, as in (21) |
/// | `noise_model` | whiten the output error by an autoregression | | true |
/// | `missing` | NaN in the output are missing samples; the error is then not whitened | | false: refused |
/// | `fresh_share` | share at the end kept for the verdict | 0.05 to 0.9 | 0.25 |
///
/// ```
/// use flexure::identify::RefinedHammerstein;
/// use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
///
/// let [linear, _] = known_linear_parts();
/// let system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
/// let result = RefinedHammerstein::default().identify(&system.simulate(20_000, 2), "u", "y")?;
/// assert_eq!((result.delay, result.order.order, result.breakpoints.len()), (0, 2, 2)); // the dead zone's two kinks
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinedHammerstein {
    /// The order of the linear part.
    pub order: Option<usize>,
    /// The delay in samples.
    pub delay: Option<usize>,
    /// The convention for scale and offset.
    pub calibration: Calibration,
    /// The estimator of the nonlinearity that the refinement starts from.
    pub start: EstimatorName,
    /// Whether to whiten the output error.
    pub noise_model: bool,
    /// Whether NaN in the output are missing samples.
    pub missing: bool,
    /// The share of the samples that the verdict is made on.
    pub fresh_share: f64,
}

impl Default for RefinedHammerstein {
    fn default() -> Self {
        RefinedHammerstein {
            order: None,
            delay: None,
            calibration: Calibration::default(),
            start: EstimatorName::Kernel,
            noise_model: true,
            missing: false,
            fresh_share: 0.25,
        }
    }
}

impl RefinedHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort` (fewer
    /// than 100 samples for the fit), `Unit`, [`Error::Parameter`] for a parameter outside its range.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<RefinedIdentification> {
        self.identify_experiments(&[record], input, output)
    }

    /// Identifies one system from several experiments, each with an initial state of its own.
    ///
    /// The fresh part is the end of all samples taken in order.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify).
    pub fn identify_experiments(
        &self,
        records: &[&Record],
        input: &str,
        output: &str,
    ) -> Result<RefinedIdentification> {
        self.check()?;
        let all = Gathered::new(records, input, output, self.missing, self.fresh_share)?;
        let start = self.plain_estimate(&all, input, output)?;
        let mut warnings: Vec<Warning> = Vec::new();
        let kept = |w: &&Warning| matches!(w, Warning::FewLevels { .. } | Warning::NoDependence { .. });
        warnings.extend(start.warnings.iter().filter(kept).cloned());
        let colour = &mut Vec::new();
        warn_of_colour(&all.u[..all.fitted], colour);
        if let Some(Warning::InputNotWhite { largest, lag }) = colour.first() {
            let (largest, lag) = (*largest, *lag);
            warnings.push(Warning::ColouredInput { largest, lag });
        }
        self.refine(&all, &start, &mut warnings)?
            .map_or_else(|| self.plain(&all, start, input, output), Ok)
    }

    fn check(&self) -> Result<()> {
        fresh_part(self.fresh_share, 0)?;
        if let Some(order) = self.order.filter(|l| *l > MOST_ORDER) {
            return Err(Error::parameter("the order", order as f64, "at most 50"));
        }
        self.calibration.check()
    }

    /// The plain estimate from the longest experiment, or its first part where that is enough.
    fn plain_estimate(&self, all: &Gathered, input: &str, output: &str) -> Result<Identification> {
        let longest = all.longest();
        let plain = PlainHammerstein {
            estimator: self.start,
            order: self.order,
            delay: self.delay,
            fresh_share: self.fresh_share,
            ..Default::default()
        };
        let over = |length: usize| {
            let part = longest.start..longest.start + length;
            let columns = [(input, all.u[part.clone()].to_vec()), (output, all.y[part].to_vec())];
            plain.identify(&Record::from_equal(columns), input, output)
        };
        match over(longest.len().min(START)) {
            Err(_) if longest.len() > START => over(longest.len()),
            result => result,
        }
    }

    /// The refined model; `None` if it is no better than the plain one.
    fn refine(
        &self,
        all: &Gathered,
        start: &Identification,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<RefinedIdentification>> {
        let u = &all.u[..all.fitted];
        let output_mean = mean(&all.y[..all.fitted]);
        let parts = all.fitted_parts();
        let memory = start.linear.settling(0.01).max(10);
        let mut counts: Vec<bool> = all.missing[..all.fitted].iter().map(|m| !m).collect();
        for part in &parts {
            let left_out = (memory + AFTER_SETTLING).min(part.len() / LEFT_OUT);
            counts[part.start..part.start + left_out].fill(false);
        }
        let mut data = Data {
            u,
            y: all.y[..all.fitted].iter().map(|y| y - output_mean).collect(),
            parts,
            counts,
            missing: (0..all.fitted).filter(|&i| all.missing[i]).collect(),
        };
        let cells = Cells::new(u);
        let mut w: Vec<f64> = u.iter().map(|u| start.nonlinearity.value(*u)).collect();
        let level = mean(&w);
        w.iter_mut().for_each(|w| *w -= level);
        let dynamics = Dynamics {
            b: start.linear.b()[start.delay..].to_vec(),
            a: start.linear.a().to_vec(),
            delay: start.delay,
        };
        let plain_squares = data.squares(&filter(&dynamics, &data.parts, &w));
        let from = Start {
            w,
            dynamics,
            order: self.order,
            delay: self.delay,
            memory,
            whiten: self.noise_model && data.missing.is_empty(),
        };
        let minimum = alternate(&mut data, &cells, from);
        interrupt::check()?;
        let Some(minimum) = minimum else {
            return Ok(None);
        };
        let squares: f64 = minimum.model.errors(&data).iter().map(|e| e * e).sum();
        // The plain estimate follows the fitted samples' own noise with more parameters.
        let allowed = 1.0 + OVERFITTED + OVERFITTED_SAMPLES / data.u.len() as f64;
        if !(squares <= allowed * plain_squares) {
            return Ok(None);
        }
        self.outcome(all, &minimum, &cells, output_mean, warnings).map(Some)
    }

    fn outcome(
        &self,
        all: &Gathered,
        minimum: &Minimum,
        cells: &Cells,
        output_mean: f64,
        warnings: &mut Vec<Warning>,
    ) -> Result<RefinedIdentification> {
        let blocks = outcome::blocks(minimum, cells, &self.calibration, output_mean, warnings)?;
        let model = cascade(&blocks.curve, &blocks.linear, blocks.offset)?;
        let (predicted, verdict) = judged(&model, all, &blocks.curve, minimum.parameters(), warnings)?;
        let d = &minimum.model.dynamics;
        let order = minimum.chosen.as_ref().map(|c| c.order.clone());
        Ok(RefinedIdentification {
            model,
            nonlinearity: blocks.curve,
            band: blocks.band,
            linear: blocks.linear,
            linear_errors: blocks.errors,
            output_offset: blocks.offset,
            delay: d.delay,
            order: order.unwrap_or_else(|| ChosenOrder {
                order: d.a.len() - 1,
                hankel_singular_values: Vec::new(),
                scores: Vec::new(),
            }),
            memory_removed: blocks.points,
            breakpoints: outcome::breakpoints(&minimum.terms, cells),
            noise_model: minimum.whitening.clone(),
            noise: minimum.noise(),
            refined: true,
            fitted: all.fitted,
            predicted,
            verdict,
            warnings: std::mem::take(warnings),
        })
    }

    /// The plain estimate as it is, where the refinement failed.
    fn plain(&self, all: &Gathered, start: Identification, input: &str, output: &str) -> Result<RefinedIdentification> {
        let longest = all.longest();
        let columns = [
            (input, all.u[longest.clone()].to_vec()),
            (output, all.y[longest].to_vec()),
        ];
        let plain = PlainHammerstein {
            estimator: self.start,
            order: self.order,
            delay: self.delay,
            calibration: self.calibration,
            fresh_share: self.fresh_share,
            ..Default::default()
        }
        .identify(&Record::from_equal(columns), input, output)
        .or_else(|e| {
            if self.calibration == Calibration::default() {
                Ok(start)
            } else {
                Err(e)
            }
        })?;
        let mut warnings = plain.warnings;
        warnings.push(Warning::NotRefined);
        let model = cascade(&plain.nonlinearity, &plain.linear, plain.output_offset)?;
        let (predicted, verdict) = judged(&model, all, &plain.nonlinearity, 0, &mut Vec::new())?;
        Ok(RefinedIdentification {
            band: plain.band,
            linear_errors: CoefficientErrors {
                b: vec![0.0; plain.linear.b().len()],
                a: vec![0.0; plain.linear.a().len()],
            },
            noise: verdict.measures.rms,
            model,
            nonlinearity: plain.nonlinearity,
            linear: plain.linear,
            output_offset: plain.output_offset,
            delay: plain.delay,
            order: plain.order,
            memory_removed: MemoryRemoved {
                x: Vec::new(),
                value: Vec::new(),
                samples: Vec::new(),
                deviation: 0.0,
            },
            breakpoints: Vec::new(),
            noise_model: vec![1.0],
            refined: false,
            fitted: all.fitted,
            predicted,
            verdict,
            warnings,
        })
    }
}

/// The free run of a model of so many parameters over every experiment, and the verdict on the fresh samples that are not
/// missing.
fn judged(
    model: &Block,
    all: &Gathered,
    curve: &Curve,
    parameters: usize,
    warnings: &mut Vec<Warning>,
) -> Result<(Vec<f64>, Verdict)> {
    let mut predicted = Vec::with_capacity(all.u.len());
    for part in &all.parts {
        predicted.extend(model.simulate(&all.u[part.clone()]));
    }
    let estimated = Estimated {
        parameters,
        samples: all.fitted,
    };
    let present = |v: &[f64]| -> Vec<f64> {
        (all.fitted..v.len())
            .filter(|&i| !all.missing[i])
            .map(|i| v[i])
            .collect()
    };
    let verdict = Verdict::of_estimate(&present(&all.u), &present(&all.y), &present(&predicted), estimated)?;
    warn_of_range(curve, &all.u[all.fitted..], warnings);
    warn_if_useless(&verdict, warnings);
    Ok((predicted, verdict))
}
