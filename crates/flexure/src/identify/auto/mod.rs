//! Which structure: linear, Hammerstein, Wiener or Wiener-Hammerstein, or none of these.
//!
//! All candidates are fitted to the first part of the record and compared on the rest, which none of them has seen:
//!
//! - A candidate is **refuted by a comparison** if its squared error is significantly larger than the best one's (paired test with
//!   dependence allowed for, see [`PairedComparison`](crate::validation::PairedComparison); 1 %, shared out among the
//!   comparisons) and larger by at least 2 %. The smallest error as such decides nothing: of two structures one of which contains
//!   the other, either may happen to have it.
//! - It is **refuted by a test** if one of the [residual tests](crate::validation::ResidualTests) rejects it (1 %, shared out among
//!   the tests).
//! - **Chosen** is the simplest candidate that no comparison refutes. Hammerstein and Wiener are equally simple; where both are as
//!   good, the result says so.
//! - It is **supported** if no test refutes it, or if what the test sees is small: the candidate explains at least nine tenths of
//!   the output's variance, and a general regression of its error on the input's and the prediction's powers explains less than a
//!   tenth of the error's variance out of sample, so that the error is, as far as that regression sees, within 5 % of the noise floor.
//!   Otherwise the data support none of these structures, as they should where the nonlinearity is in a
//!   feedback path.
//!
//! Where a simple candidate leaves white noise, more complex ones are not fitted. Nothing here is random.
//!
//! What cannot be told: a cascade one block of which hardly has a memory is nearly a Wiener or a Hammerstein system, and found as
//! such; a structure outside the four that one of them imitates to within the noise is not refuted.

mod judge;
mod remainder;
#[cfg(test)]
mod tests;
mod words;

use std::fmt;
use std::ops::ControlFlow;

use super::block::{Monitor, Stage};
use super::hammerstein::{RefinedHammerstein, RefinedIdentification};
use super::outcome::{Verdict, Warning};
use super::samples::Samples;
use super::structures::linear::{LinearIdentification, fit as fit_linear};
use super::structures::wiener::{WienerIdentification, fit as fit_wiener};
use super::structures::wiener_hammerstein::{WienerHammersteinIdentification, fit as fit_wiener_hammerstein};
use crate::error::Result;
use crate::model::Block;
use crate::record::Record;
use crate::validation::ResidualTest;
use judge::{Judged, judge};

/// A block structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Structure {
    /// Linear.
    Linear,
    /// Static, linear.
    Hammerstein,
    /// Linear, static.
    Wiener,
    /// Linear, static, linear.
    WienerHammerstein,
}

impl Structure {
    /// All four, simplest first.
    pub const ALL: [Structure; 4] = [
        Structure::Linear,
        Structure::Hammerstein,
        Structure::Wiener,
        Structure::WienerHammerstein,
    ];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Linear => "linear",
            Structure::Hammerstein => "Hammerstein",
            Structure::Wiener => "Wiener",
            Structure::WienerHammerstein => "Wiener-Hammerstein",
        }
    }

    /// The number of blocks: structures contain others of fewer blocks.
    pub fn complexity(self) -> usize {
        match self {
            Structure::Linear => 1,
            Structure::Hammerstein | Structure::Wiener => 2,
            Structure::WienerHammerstein => 3,
        }
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// An identification of one of the structures.
#[derive(Debug, Clone, PartialEq)]
pub enum Identified {
    /// Linear, by [`Linear`](super::Linear).
    Linear(LinearIdentification),
    /// Hammerstein, by [`RefinedHammerstein`].
    Hammerstein(RefinedIdentification),
    /// Wiener, by [`Wiener`](super::Wiener).
    Wiener(WienerIdentification),
    /// Wiener-Hammerstein, by [`WienerHammerstein`](super::WienerHammerstein).
    WienerHammerstein(WienerHammersteinIdentification),
}

impl Identified {
    /// Which structure it is.
    pub fn structure(&self) -> Structure {
        match self {
            Identified::Linear(_) => Structure::Linear,
            Identified::Hammerstein(_) => Structure::Hammerstein,
            Identified::Wiener(_) => Structure::Wiener,
            Identified::WienerHammerstein(_) => Structure::WienerHammerstein,
        }
    }

    /// The model, ready to simulate.
    pub fn model(&self) -> &Block {
        match self {
            Identified::Linear(r) => &r.model,
            Identified::Hammerstein(r) => &r.model,
            Identified::Wiener(r) => &r.model,
            Identified::WienerHammerstein(r) => &r.model,
        }
    }

    /// The free-run output over all samples.
    pub fn predicted(&self) -> &[f64] {
        match self {
            Identified::Linear(r) => &r.predicted,
            Identified::Hammerstein(r) => &r.predicted,
            Identified::Wiener(r) => &r.predicted,
            Identified::WienerHammerstein(r) => &r.predicted,
        }
    }

    /// The verdict on the fresh samples.
    pub fn verdict(&self) -> &Verdict {
        match self {
            Identified::Linear(r) => &r.verdict,
            Identified::Hammerstein(r) => &r.verdict,
            Identified::Wiener(r) => &r.verdict,
            Identified::WienerHammerstein(r) => &r.verdict,
        }
    }

    /// What the user should know.
    pub fn warnings(&self) -> &[Warning] {
        match self {
            Identified::Linear(r) => &r.warnings,
            Identified::Hammerstein(r) => &r.warnings,
            Identified::Wiener(r) => &r.warnings,
            Identified::WienerHammerstein(r) => &r.warnings,
        }
    }

    /// The number of parameters that the data determine: poles, numerator coefficients from the first that is not zero, and those of
    /// the nonlinearity, less what only fixes scales.
    pub fn parameters(&self) -> usize {
        let rational = |g: &crate::linear::TransferFunction| {
            let leading = g.b().iter().take_while(|b| **b == 0.0).count();
            g.a().len() - 1 + g.b().len() - leading
        };
        match self {
            Identified::Linear(r) => rational(&r.linear) + 1,
            // Cubic pieces: four parameters and one more at every breakpoint; the linear block's scale is theirs.
            Identified::Hammerstein(r) => rational(&r.linear) + r.breakpoints.len() + 3,
            Identified::Wiener(r) => r.tried.last().map_or(1, |t| t.parameters()),
            Identified::WienerHammerstein(r) => r.tried.last().map_or(1, |t| t.parameters()),
        }
    }
}

/// What speaks against a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refutation {
    /// A residual test rejects it.
    Test(ResidualTest),
    /// Another candidate predicts significantly better.
    Comparison {
        /// The better one.
        better: Structure,
        /// The ratio of the mean squared errors, above 1.
        ratio: f64,
        /// The probability of such a difference if both predict equally well.
        p_value: f64,
    },
}

/// A row of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureCandidate {
    /// The structure.
    pub structure: Structure,
    /// The fit on fresh samples, percent.
    pub fit_percent: f64,
    /// The RMS of the error there, in the unit of y.
    pub rms: f64,
    /// The number of parameters.
    pub parameters: usize,
    /// What refutes it; a comparison first, then the tests.
    pub refuted_by: Vec<Refutation>,
    /// The verdict of this candidate taken for itself, in words.
    pub verdict: String,
}

/// The chosen identification, and what the data say about all structures.
#[derive(Debug, Clone, PartialEq)]
pub struct AutoIdentification {
    /// The identification of the simplest structure that no comparison refutes; if none is supported, the best that these structures
    /// can do.
    pub chosen: Identified,
    /// The structure that the data support, if any.
    pub supported: Option<Structure>,
    /// Structures as simple as the chosen one that predict as well: the data do not tell these apart.
    pub as_good: Vec<Structure>,
    /// All that were fitted, simplest first.
    pub candidates: Vec<StructureCandidate>,
    /// The share of the chosen one's squared error that a general function of the input explains; looked for only where a test
    /// refutes it, zero otherwise.
    pub not_noise: f64,
    /// Why, in sentences.
    pub reasons: Vec<String>,
    /// Samples `0..fitted` were used for the fits, the rest for the comparison.
    pub fitted: usize,
}

/// The identification of a system of unknown structure.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `fresh_share` | share at the end kept for the comparison | 0.05 to 0.9 | 0.25 |
/// | `exhaustive` | fit all structures, even where a simple one leaves white noise | | false |
///
/// ```
/// use flexure::identify::{Auto, Structure};
/// use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
///
/// let [linear, _] = known_linear_parts();
/// let system = KnownHammerstein { process_noise: 0.0, ..KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear) };
/// let result = Auto::default().identify(&system.simulate(4000, 1), "u", "y")?;
/// assert_eq!(result.supported, Some(Structure::Hammerstein));
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Auto {
    /// The share of the record that the structures are compared on.
    pub fresh_share: f64,
    /// Whether to fit all structures in any case.
    pub exhaustive: bool,
}

impl Default for Auto {
    fn default() -> Self {
        Auto {
            fresh_share: 0.25,
            exhaustive: false,
        }
    }
}

impl Auto {
    /// Identifies the system from `input` to `output`, and its structure.
    ///
    /// # Errors
    /// Those of [`Wiener::identify`](super::Wiener::identify).
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<AutoIdentification> {
        self.identify_with(record, input, output, &mut |_, _| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step with the structure that is being fitted; it stops the
    /// identification by returning [`ControlFlow::Break`].
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify), and [`Error::Stopped`](crate::Error::Stopped) if `progress` stopped it.
    pub fn identify_with(
        &self,
        record: &Record,
        input: &str,
        output: &str,
        progress: &mut dyn FnMut(Structure, Stage) -> ControlFlow<()>,
    ) -> Result<AutoIdentification> {
        let what = "a comparison of structures (besides the fresh part)";
        let samples = Samples::new(record, input, output, self.fresh_share, what)?;
        let fresh = samples.fitted..samples.y.len();
        let mut fitted: Vec<Identified> = Vec::new();

        let report = &mut |stage| progress(Structure::Linear, stage);
        let mut monitor = Monitor::new(report);
        let prepared = samples.prepared(&mut monitor);
        monitor.finished()?;
        for structure in Structure::ALL {
            let judged = |i: &Identified| {
                let (y, predicted) = (&samples.y[fresh.clone()], &i.predicted()[fresh.clone()]);
                Judged::new(i.structure(), i.verdict(), y, predicted).leaves_white_noise()
            };
            let simpler = |i: &&Identified| i.structure().complexity() < structure.complexity();
            if !self.exhaustive && fitted.iter().filter(simpler).any(judged) {
                continue;
            }
            let report = &mut |stage| progress(structure, stage);
            let mut monitor = Monitor::new(report);
            fitted.push(match structure {
                Structure::Linear => Identified::Linear(fit_linear(&samples, &prepared, &mut monitor)?),
                Structure::Hammerstein => {
                    monitor.stage = Stage::Refinement;
                    monitor.keep_on();
                    monitor.finished()?;
                    let method = RefinedHammerstein {
                        fresh_share: self.fresh_share,
                        ..Default::default()
                    };
                    Identified::Hammerstein(method.identify(record, input, output)?)
                }
                Structure::Wiener => Identified::Wiener(fit_wiener(&samples, &prepared, &mut monitor)?),
                Structure::WienerHammerstein => {
                    Identified::WienerHammerstein(fit_wiener_hammerstein(&samples, &prepared, &mut monitor)?)
                }
            });
        }
        Ok(compared(&samples, fitted))
    }
}

/// The comparison of what was fitted.
fn compared(samples: &Samples<'_>, mut fitted: Vec<Identified>) -> AutoIdentification {
    let fresh = samples.fitted..samples.y.len();
    let (u, y) = (&samples.input()[fresh.clone()], &samples.y[fresh.clone()]);
    let judged: Vec<Judged<'_>> = fitted
        .iter()
        .map(|i| Judged::new(i.structure(), i.verdict(), y, &i.predicted()[fresh.clone()]))
        .collect();
    let judgement = judge(&judged, u);
    let candidates: Vec<StructureCandidate> = fitted
        .iter()
        .zip(&judgement.refuted_by)
        .map(|(i, refuted_by)| StructureCandidate {
            structure: i.structure(),
            fit_percent: i.verdict().measures.fit_percent,
            rms: i.verdict().measures.rms,
            parameters: i.parameters(),
            refuted_by: refuted_by.clone(),
            verdict: i.verdict().words(),
        })
        .collect();
    let reasons = words::reasons(&candidates, &judgement);
    let structure = candidates[judgement.chosen].structure;
    AutoIdentification {
        supported: judgement.supported.then_some(structure),
        as_good: judgement.ties.iter().map(|i| candidates[*i].structure).collect(),
        not_noise: judgement.not_noise,
        chosen: fitted.swap_remove(judgement.chosen),
        candidates,
        reasons,
        fitted: samples.fitted,
    }
}
