//! Which structure: linear, Hammerstein, Wiener, Wiener-Hammerstein, Hammerstein-Wiener, a loop, parallel branches; or none of these. For
//! several inputs: linear, a Hammerstein branch for each, or one nonlinearity of all.
//!
//! All candidates are fitted to the first part of the record and compared on the rest, which none of them has seen:
//!
//! - A candidate is **refuted by a comparison** if its squared error is significantly larger than the best one's (paired test with
//!   dependence allowed for, see [`PairedComparison`](crate::validation::PairedComparison); 1 %, shared out among the
//!   comparisons) and larger by at least 2 %. The smallest error alone decides nothing: if one of two structures contains the other, either
//!   may have it by chance. A candidate with an even larger error than a refuted one that is no more general is refuted too.
//! - It is **refuted by a test** if one of the [residual tests](crate::validation::ResidualTests) rejects it (1 %, shared out among
//!   the tests), and the misfit that the test detects is not negligible.
//! - **Chosen** is the simplest candidate that no comparison refutes: of those that hold, if any does. Hammerstein and Wiener are equally
//!   simple; if both are equally good, the result says so.
//! - It is **supported** if its [verdict](super::Verdict::holds) is that it holds: no test refutes it, or the misfit that a test detects is
//!   negligible, and its error is white noise or small. Otherwise the data support none of these structures; this is the right answer for
//!   hysteresis or a drift.
//!
//! If a simple candidate leaves white noise, more complex ones are not fitted. A loop and parallel branches contain most others and take
//! longest: they are fitted only if nothing simpler both holds, with a misfit below 0.1 % of the output's standard deviation, and has the
//! least error so far. A loop is fitted nevertheless if the fit is below 98 % and most of the error follows from its own past: so do the errors on hysteresis, which
//! no test of a dependence on the input may see. Nothing here is random.
//!
//! If no candidate holds, the result says what the error of the chosen one looks like: something in a loop, a drift in time,
//! hysteresis, outliers.
//!
//! What cannot be decided: a Wiener-Hammerstein system in which one linear block has hardly any memory is nearly a Wiener or a Hammerstein
//! system, and is found as such. Another structure is not refuted if one of these imitates it to within the noise.

mod comparison;
mod judge;
mod limits;
mod reasons;
mod remainder;
mod simpler;
mod symptoms;
#[cfg(test)]
mod tests;

use super::LINEAR;
use super::limits::FEWEST_SAMPLES;
use super::registry::structures;
use super::request::{Options, Progress, Rank, Request, Structure};
use super::result::{Identification, StructureName};
use super::samples::Samples;
use super::warning::Warning;
use crate::error::{DataError, Error, Result};
pub use comparison::{Refutation, StructureCandidate, StructureComparison};
use judge::{Judged, judge};
use limits::{MOST_COMPARED, MOST_ELSEWHERE};
pub use symptoms::Symptom;

/// The structures that are compared for this number of inputs, simplest first.
fn compared_structures(inputs: usize) -> Vec<&'static Structure> {
    let takes = |s: &&Structure| s.rank.is_some() && s.inputs.contains(&inputs);
    // For one input, a structure of several is one of the others.
    let own = |s: &&Structure| inputs > 1 || s.rank == Some(Rank::Linear) || !s.has_several_inputs();
    let mut all: Vec<&Structure> = structures().iter().filter(takes).filter(own).collect();
    all.sort_by_key(|s| s.rank);
    all
}

/// The identification of a system of unknown structure: the result is that of the chosen structure, with its
/// [`comparison`](Identification::comparison).
///
/// ```
/// use flexure::identify::AUTO;
/// use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
///
/// let [linear, _] = known_linear_parts();
/// let system = KnownHammerstein { process_noise: 0.0, ..KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear) };
/// let result = AUTO.identify(&system.simulate(4000, 1), &["u"], "y")?;
/// let comparison = result.comparison.unwrap();
/// assert_eq!(comparison.supported.unwrap().key, "hammerstein");
/// # Ok::<(), flexure::Error>(())
/// ```
pub const AUTO: Structure = Structure {
    name: StructureName {
        key: "auto",
        title: "auto",
    },
    description: "the simplest of the others that the data support, or a verdict that they support none",
    inputs: 1..=usize::MAX,
    options: &[],
    rank: None,
    identify,
};

/// The fit in errors about too few samples.
const COMPARISON: &str = "a comparison of structures (besides the fresh part)";

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples_at_least(COMPARISON, FEWEST_SAMPLES)?;
    let request = request.with_options(Options {
        missing: request.options.missing,
        ..Options::with_fresh_share(request.options.fresh_share)
    });
    compare(&samples, &request, None, progress)
}

/// Fits all structures, simplest first, unless a simpler one suffices, and compares them. The `known` fit of one of them is not made again.
fn compare(
    samples: &Samples<'_>,
    request: &Request<'_>,
    mut known: Option<Identification>,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let mut fitted: Vec<Identification> = Vec::new();
    let mut others = Others::default();
    for structure in compared_structures(request.inputs.len()) {
        let judged: Vec<Judged<'_>> = judged(samples, &fitted);
        let least = judged.iter().map(Judged::error).fold(f64::INFINITY, f64::min);
        let known = known.take_if(|known| known.structure == structure.name);
        if known.is_none() && judged.iter().any(|j| j.suffices(structure, least)) {
            others.superfluous.push(structure.name.title);
            continue;
        }
        let stage = &mut |stage: &str| progress(&format!("{}, {stage}", structure.name));
        let identified = known.map_or_else(|| structure.identify_with(request, stage), Ok);
        match identified {
            Err(Error::Data(DataError::TooShort { .. })) if !fitted.is_empty() => {
                others.too_few_samples.push(structure.name.title);
            }
            identified => {
                let found = simpler::simpler(identified?);
                let same = fitted.iter_mut().find(|other| other.structure == found.structure);
                if found.structure != structure.name {
                    others.simpler.push((structure.name.title, found.structure.title));
                }
                match same {
                    None => fitted.push(found),
                    // The structure's own fit is kept if it holds: it gives more, such as breakpoints and the noise.
                    Some(other) if other.verdict.holds() => {}
                    Some(other) if found.verdict.measures.rms < other.verdict.measures.rms => *other = found,
                    Some(_) => {}
                }
            }
        }
    }
    Ok(compared(samples, fitted, &others))
}

/// The result of a [`HAMMERSTEIN`](super::HAMMERSTEIN) identification of one record. If it does not hold, the result of [`AUTO`], which does not
/// repeat this identification and has it among the compared ones.
///
/// This is for users who gave no structure. With more than 50,000 fitted samples, a comparison of all structures can take minutes. Then only linear
/// dynamics are compared with the Hammerstein model; their result is returned, with the comparison, if they predict significantly better.
/// The result is unchanged for several records, with the options `robust` or `missing`, with fewer than 200 fitted samples, if outliers
/// hide whether the model holds, and if more than a tenth of the fresh input lies outside the fitted range.
///
/// # Errors
/// [`Error::Stopped`] if `progress` stopped it.
///
/// ```
/// use flexure::identify::{HAMMERSTEIN, Options, Request, or_another};
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use std::ops::ControlFlow;
///
/// // Five resonances: more poles than a Hammerstein model has.
/// let mut random = rand_pcg::Pcg64::new(1, 1);
/// let u: Vec<f64> = (0..3000).map(|_| rand::RngExt::random_range(&mut random, -1.0..1.0)).collect();
/// let mut y = vec![0.0; 3000];
/// for frequency in [0.03_f64, 0.09, 0.16, 0.27, 0.38] {
///     let turn = std::f64::consts::TAU * frequency;
///     let radius = (-0.01 * turn).exp();
///     let mode = TransferFunction::new(vec![0.0, 1.0], vec![1.0, -2.0 * radius * turn.cos(), radius * radius])?;
///     y.iter_mut().zip(mode.simulate(&u)).for_each(|(y, part)| *y += part + 0.3 * rand::RngExt::random_range(&mut random, -1.0..1.0));
/// }
/// let record = Record::new([("u", u), ("y", y)])?;
/// let (records, go_on) = ([&record], &mut |_: &str| ControlFlow::Continue(()));
/// let request = Request::new(&records, &["u"], "y", Options::default());
/// let hammerstein = HAMMERSTEIN.identify_with(&request, go_on)?;
/// let result = or_another(hammerstein, &request, go_on)?;
/// assert_eq!(result.structure.key, "linear");
/// assert!(result.verdict.holds());
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn or_another(
    hammerstein: Identification,
    request: &Request<'_>,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let verdict = &hammerstein.verdict;
    let is_judged = verdict.residuals.is_some() && verdict.hidden_by.is_none();
    let can_be_compared = request.records.len() == 1 && !request.options.robust && !request.options.missing;
    let is_elsewhere = |w: &Warning| matches!(w, Warning::OutsideRange { percent, .. } if *percent > MOST_ELSEWHERE);
    let is_outside = hammerstein.warnings.iter().any(is_elsewhere);
    if verdict.holds() || !is_judged || !can_be_compared || is_outside {
        return Ok(hammerstein);
    }
    let Ok(samples) = request.samples_at_least(COMPARISON, FEWEST_SAMPLES) else {
        return Ok(hammerstein);
    };
    if samples.fitted <= MOST_COMPARED {
        return match compare(&samples, request, Some(hammerstein.clone()), progress) {
            Err(Error::Stopped(stopped)) => Err(Error::Stopped(stopped)),
            compared => Ok(compared.unwrap_or(hammerstein)),
        };
    }
    let stage = &mut |stage: &str| progress(&format!("{}, {stage}", LINEAR.name));
    let linear = match LINEAR.identify_with(request, stage) {
        Ok(linear) => linear,
        Err(stopped @ Error::Stopped(_)) => return Err(stopped),
        Err(_) => return Ok(hammerstein),
    };
    let others = Others {
        too_long: true,
        ..Others::default()
    };
    let result = compared(&samples, vec![linear, hammerstein.clone()], &others);
    let by_comparison = |r: &Refutation| matches!(r, Refutation::Comparison { .. });
    let candidates = result.comparison.iter().flat_map(|c| &c.candidates);
    let refuted = candidates.filter(|c| c.refuted_by.iter().any(by_comparison));
    let is_worse = refuted.map(|c| c.structure).any(|s| s == hammerstein.structure);
    Ok(if is_worse { result } else { hammerstein })
}

/// The titles of structures that are not among the candidates.
#[derive(Default)]
struct Others {
    /// Whether other structures were not compared, as that takes long for many samples.
    too_long: bool,
    /// Titles of structures that were not fitted because a simpler one holds.
    superfluous: Vec<&'static str>,
    too_few_samples: Vec<&'static str>,
    /// Titles of structures whose fit is a simpler structure, with the simpler one's title.
    simpler: Vec<(&'static str, &'static str)>,
}

/// The rank of a structure.
fn rank(structure: StructureName) -> Option<Rank> {
    Structure::by_name(structure.key).and_then(|s| s.rank)
}

/// The fitted candidates on the fresh samples.
fn judged<'a>(samples: &Samples<'_>, fitted: &'a [Identification]) -> Vec<Judged<'a>> {
    let y = samples.fresh(samples.y);
    let of = |i: &'a Identification| Judged::new(i.structure, &i.verdict, &y, samples.fresh(&i.predicted));
    fitted.iter().map(of).collect()
}

/// The comparison of the fitted candidates.
fn compared(samples: &Samples<'_>, mut fitted: Vec<Identification>, others: &Others) -> Identification {
    let u: Vec<Vec<f64>> = samples.u.iter().map(|u| samples.fresh(u)).collect();
    let u: Vec<&[f64]> = u.iter().map(Vec::as_slice).collect();
    let judged = judged(samples, &fitted);
    let judgement = judge(&judged, &u);
    let candidates: Vec<StructureCandidate> = fitted
        .iter()
        .zip(&judgement.refuted_by)
        .map(|(i, refuted_by)| StructureCandidate {
            structure: i.structure,
            fit_percent: i.verdict.measures.fit_percent,
            rms: i.verdict.measures.rms,
            parameters: i.parameters,
            refuted_by: refuted_by.clone(),
            verdict: i.verdict.text(),
        })
        .collect();
    let chosen = candidates[judgement.chosen].structure;
    let comparison = StructureComparison {
        chosen,
        supported: judgement.supported.then_some(chosen),
        as_good: judgement.ties.iter().map(|i| candidates[*i].structure).collect(),
        not_noise: judgement.not_noise,
        looks_like: judgement.looks_like.clone(),
        reasons: reasons::reasons(&candidates, &judgement, others),
        candidates,
    };
    Identification {
        comparison: Some(comparison),
        ..fitted.swap_remove(judgement.chosen)
    }
}
