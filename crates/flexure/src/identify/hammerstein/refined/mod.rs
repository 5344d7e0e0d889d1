//! The Hammerstein system by prediction error over both blocks, with the plain estimate as the start.
//!
//! $$ Y_n = o + \frac{B(z)}{A(z)} z^{-s} \big(\varphi(X_n) + \xi_n\big) + e_n $$
//! Everything comes from the data: the breakpoints of phi and their kind, the delay s, the order of A and B, and the noise's colour.
//! The plain estimate ([`PlainHammerstein`]) treats the linear part's memory as noise. Here the memory is removed; the remaining problem is
//! efficient least squares.
//!
//! | step | file |
//! |---|---|
//! | 1. the plain estimate on at most 40,000 samples of the joined experiments | `experiments.rs` |
//! | 2. delay and order by Schwarz's criterion of the whitened error, the linear part by covariances | `order.rs` |
//! | 3. an autoregression that whitens the output error, and the memory-removed output | `alternation.rs` |
//! | 4. breakpoints of phi, jumps, kinks and cubic knots, on the memory-removed output; on filtered functions if the input is coloured |
//! `basis.rs`, `stepwise.rs`, `cells.rs`, `piecewise.rs`; `filtered.rs` |
//! | 5. Levenberg-Marquardt steps on all coefficients of both blocks (Ljung 1999, chapter 10) | `blocks.rs`, `linear_part.rs`, `loss.rs`, `descent.rs` |
//! | changes of delay and order, each fitted; after one, steps 3 to 5 again | `structure.rs` |
//! | if the free run is poor, steps 3 to 5 again from the branch of least output error | `output_error.rs` |
//! | from the minimum, steps 3 to 5 again on filtered functions, and without whitening | `views.rs` |
//! | the places of kinks as parameters; those of a usual form | `kinks.rs`, `by_form.rs` |
//! | 6. calibration and standard errors | `calibrated.rs` |
//! | on request, a physical form of phi with a test | `forms.rs`, `form_fit.rs` |
//! | 5 and 6 over shards of a record that is larger than memory | `sharded.rs` |
//! | what a reader sees of these steps | `details.rs` |
//!
//! Steps 2 to 5 are repeated until nothing changes. Every pass is O(n). The input need not be white.
//!
//! Step 3 is generalised least squares. Noise that passes through the linear part has its poles; without whitening, the errors for a
//! resonant system are several times larger.

mod alternation;
mod basis;
mod blocks;
mod by_form;
mod calibrated;
mod cells;
mod descent;
mod details;
mod experiments;
mod filtered;
mod form_fit;
pub(super) mod forms;
mod kinks;
mod limits;
mod linear_part;
mod loss;
mod order;
mod output_error;
mod piecewise;
mod sharded;
mod sharded_bytes;
mod stepwise;
mod structure;
mod views;

use super::calibration::Calibration;
use super::details::named;
use super::options::{HammersteinMethod, PlainHammerstein, RefinedHammerstein};
use super::realisation::ChosenOrder;
use super::{HAMMERSTEIN, MOST_ORDER};
use crate::error::{Error, Result};
use crate::identify::checks::{warn_if_useless, warn_of_range};
use crate::identify::outcome::Verdict;
use crate::identify::request::{Options, Request};
use crate::identify::result::{BlockKind, Detail, Identification, LinearBlock, StaticBlock, Value};
use crate::identify::run::{Run, path};
use crate::identify::warning::Warning;
use crate::interrupt;
use crate::linear::correlation::about_mean;
use crate::model::Block;
use crate::record::Record;
use crate::validation::Estimated;
use alternation::{Alternation, Minimum, input_correlations, memory};
use blocks::Observed;
use calibrated::CalibratedBlocks;
use cells::Cells;
use experiments::Experiments;
pub use forms::PhysicalForm;
use kinks::{PlacedKinks, WithJumps};
pub use limits::MOST_DEGREE;
use limits::{OVERFITTED, OVERFITTED_SAMPLES, START_SAMPLES};
use linear_part::LinearPart;
pub use sharded::{ShardPoint, ShardSums, ShardedHammerstein};

/// The minimum over all parameters, the places of the kinks among them.
struct RefinedMinimum {
    minimum: Minimum,
    extended: WithJumps,
    cells: Cells,
    output_mean: f64,
}

impl RefinedHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort` (fewer
    /// than 100 samples for the fit; too few distinct inputs for the form and its test), `Unit`, [`Error::Parameter`] for a parameter
    /// outside its range.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Identification> {
        self.identify_experiments(&[record], input, output)
    }

    /// Identifies one system from several experiments, each with its own initial state.
    ///
    /// The fresh part is the end of all samples taken in order.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify).
    pub fn identify_experiments(&self, records: &[&Record], input: &str, output: &str) -> Result<Identification> {
        let (inputs, options) = ([input], Options::with_method(HammersteinMethod::Refined(*self)));
        self.identified(&Request::new(records, &inputs, output, options))
    }

    pub(super) fn identified(&self, request: &Request<'_>) -> Result<Identification> {
        self.check()?;
        let (input, output) = (request.input()?, request.output);
        let all = Experiments::new(
            request.records,
            input,
            output,
            request.options.missing,
            self.fresh_share,
        )?;
        match self.plain_estimate(&all, input, output) {
            Ok(plain) => match self.refine(request, &all, &plain)? {
                Some(refined) => Ok(refined),
                None => self.not_refined(request, &all, plain),
            },
            // A plain estimate with the given order may fail where a start with another order leads to one.
            Err(error) if self.order.is_some() => {
                interrupt::check()?;
                let start = RefinedHammerstein { order: None, ..*self }.plain_estimate(&all, input, output);
                let refined = start.ok().map(|start| self.refine(request, &all, &start)).transpose()?;
                let refined = refined.flatten().filter(|refined| Some(refined.order) == self.order);
                refined.ok_or(error)
            }
            Err(error) => Err(error),
        }
    }

    fn check(&self) -> Result<()> {
        if let Some(order) = self.order.filter(|l| *l > MOST_ORDER) {
            return Err(Error::parameter("the order", order as f64, "at most 50"));
        }
        self.calibration.check()
    }

    /// The same method without a noise model.
    fn without_noise_model(&self) -> RefinedHammerstein {
        RefinedHammerstein {
            noise_model: false,
            ..*self
        }
    }

    /// The method of the start.
    fn plain_method(&self) -> PlainHammerstein {
        PlainHammerstein {
            estimator: self.start,
            order: self.order,
            delay: self.delay,
            fresh_share: self.fresh_share,
            ..Default::default()
        }
    }

    /// The plain estimate from the longest experiment, or from its first part if that is enough.
    fn plain_estimate(&self, all: &Experiments, input: &str, output: &str) -> Result<Identification> {
        let longest = all.longest().len();
        let over = |length| {
            self.plain_method()
                .identify(&all.head_of_longest(length, input, output), input, output)
        };
        match over(longest.min(START_SAMPLES)) {
            Err(_) if longest > START_SAMPLES => over(longest),
            result => result,
        }
    }

    /// The refined estimate; `None` if it is no better than the plain one.
    fn refine(
        &self,
        request: &Request<'_>,
        all: &Experiments,
        plain: &Identification,
    ) -> Result<Option<Identification>> {
        let Some(found) = self.refined_minimum(all, plain)? else {
            return Ok(None);
        };
        interrupt::check()?;
        self.outcome(request, all, &found, all.fitted, warnings(plain))
            .map(Some)
    }

    /// The minimum; `None` if it is no better than the plain estimate.
    fn refined_minimum(&self, all: &Experiments, plain: &Identification) -> Result<Option<RefinedMinimum>> {
        let (Some(curve), Some(linear)) = (plain.curve("nonlinearity"), plain.linear("linear")) else {
            return Ok(None);
        };
        let mut observed = Observed::new(all, memory(linear));
        let cells = Cells::new(observed.u);
        let w: Vec<f64> = observed.u.iter().map(|u| curve.value(*u)).collect();
        let w = about_mean(&w);
        let start = LinearPart::new(&linear.b()[plain.delay..], &linear.a()[1..], plain.delay);
        let plain_squares = observed.squares(&start.filter(&observed.experiments, &w));
        let input = input_correlations(observed.u);
        let alternation = Alternation::new(&cells, self, &input, w, start);
        let minimum = alternation.minimum(&mut observed);
        interrupt::check()?;
        // The plain estimate follows the fitted samples' own noise with more parameters.
        let allowed = 1.0 + OVERFITTED + OVERFITTED_SAMPLES / observed.u.len() as f64;
        let minimum = minimum.filter(|m| {
            let squares: f64 = m.blocks.errors(&observed).iter().map(|e| e * e).sum();
            squares <= allowed * plain_squares
        });
        let Some(minimum) = self.or_by_output_error(minimum, all, &cells) else {
            return Ok(None);
        };
        let minimum = self.best_of_views(minimum, all, &cells, &input);
        let observed = &mut Observed::new(all, minimum.memory);
        observed.complete(&minimum.blocks.simulated(observed), minimum.blocks.offset);
        let placed = minimum.with_kinks_placed(&cells, observed);
        let PlacedKinks { minimum, extended } = placed.or_of_a_form(&cells, observed);
        let start = minimum.blocks.linear.clone();
        let minimum = Alternation::new(&cells, self, &input, Vec::new(), start).renewed(minimum, observed);
        let output_mean = observed.output_mean;
        Ok(Some(RefinedMinimum {
            minimum,
            extended,
            cells,
            output_mean,
        }))
    }

    /// The calibrated blocks, the free run over all experiments, and the verdict on the fresh samples after a fit to so many samples.
    fn outcome(
        &self,
        request: &Request<'_>,
        all: &Experiments,
        found: &RefinedMinimum,
        samples: usize,
        mut warnings: Vec<Warning>,
    ) -> Result<Identification> {
        let minimum = &found.minimum;
        let blocks = CalibratedBlocks::new(found, &self.calibration)?;
        warnings.extend(blocks.warning.clone());
        warn_of_range(&blocks.curve, &all.u[all.fitted..], true, &mut warnings);
        let order = minimum.order.clone().unwrap_or_else(|| ChosenOrder {
            order: minimum.blocks.linear.a().len(),
            hankel_singular_values: Vec::new(),
            scores: Vec::new(),
        });
        let mut details = self.details(minimum, &order, &blocks)?;
        let mut curve = StaticBlock {
            band: blocks.band,
            band_label: "95 % pointwise, for this number of breakpoints",
            ..StaticBlock::new(blocks.curve, "piecewise cubic")
        };
        curve.description += &format!(", {}", details::listed(&blocks.breakpoints));
        let linear = LinearBlock {
            system: blocks.linear,
            errors: Some(blocks.errors),
            impulse: None,
        };
        let parameters = parameters(&linear, blocks.breakpoints.len());
        let path = path(request, named(curve, linear));
        let model = path.model(blocks.offset);
        let FreeRun { predicted, verdict } = judged(&model, all, minimum.parameters(), samples)?;
        warn_if_useless(&verdict, &mut warnings);
        if self.form.is_none() && verdict.misses_much() {
            // A form of what is no curve of the system would mislead.
            details.retain(|detail| detail.key != "form");
            details.push(Detail::new("form", Value::None));
        }
        let run = Run {
            model,
            paths: vec![path],
            output_offset: blocks.offset,
            fitted: all.fitted,
            predicted,
            verdicts: vec![verdict],
            warnings,
        };
        Ok(Identification {
            method: "refined".into(),
            order: minimum.blocks.linear.a().len(),
            delay: minimum.blocks.linear.delay,
            parameters,
            details,
            noise_model: Some(minimum.whitening.clone()),
            ..run.identification(&HAMMERSTEIN, request)?
        })
    }

    /// The unchanged plain estimate, if the refinement failed.
    fn not_refined(&self, request: &Request<'_>, all: &Experiments, start: Identification) -> Result<Identification> {
        let method = PlainHammerstein {
            calibration: self.calibration,
            ..self.plain_method()
        };
        let (input, output) = (request.input()?, request.output);
        let longest = all.head_of_longest(all.longest().len(), input, output);
        let mut plain = match method.identify(&longest, input, output) {
            Err(_) if self.calibration == Calibration::default() => start,
            result => result?,
        };
        plain.warnings.push(Warning::NotRefined);
        let FreeRun { predicted, verdict } = judged(&plain.model, all, 0, all.fitted)?;
        for block in plain.paths.iter_mut().flat_map(|p| &mut p.blocks) {
            match &mut block.kind {
                BlockKind::Static(block) => {
                    block.description = StaticBlock::new(block.curve.clone(), "the plain estimate").description;
                }
                BlockKind::Linear(linear) => {
                    linear.impulse = None;
                    plain.parameters = parameters(linear, 0);
                }
                _ => {}
            }
        }
        Ok(Identification {
            method: "refined".into(),
            details: self.details_of_plain(plain.details, plain.delay)?,
            fitted: all.fitted,
            predicted,
            verdicts: vec![verdict.clone()],
            verdict,
            ..plain
        })
    }
}

/// The parameters of both blocks: four of the first cubic piece and one more at every breakpoint, minus the linear part's scale.
fn parameters(linear: &LinearBlock, breakpoints: usize) -> usize {
    let numerator = linear.system.b().len() - linear.delay();
    linear.order() + numerator + breakpoints + 3
}

/// What the plain estimate warns of that holds for the refined one.
fn warnings(plain: &Identification) -> Vec<Warning> {
    let kept = |w: &&Warning| matches!(w, Warning::FewLevels { .. } | Warning::NoDependence { .. });
    plain.warnings.iter().filter(kept).cloned().collect()
}

/// The free run of a model over every experiment, and the verdict on the fresh samples that are not missing.
struct FreeRun {
    predicted: Vec<f64>,
    verdict: Verdict,
}

fn judged(model: &Block, all: &Experiments, parameters: usize, samples: usize) -> Result<FreeRun> {
    let simulate = |part: &std::ops::Range<usize>| model.simulate(&all.u[part.clone()]);
    let predicted: Vec<f64> = all.parts.iter().flat_map(simulate).collect();
    let estimated = Estimated { parameters, samples };
    let fresh = |v: &[f64]| -> Vec<f64> {
        let present = (all.fitted..v.len()).filter(|&i| !all.missing[i]);
        present.map(|i| v[i]).collect()
    };
    let verdict = Verdict::of_estimate(&fresh(&all.u), &fresh(&all.y), &fresh(&predicted), estimated)?;
    Ok(FreeRun { predicted, verdict })
}
