//! Outliers of the output: found in every result, and left out of the fit on request.
//!
//! A sample is an outlier if its error in the free run stands alone: it is far from the running median of five errors, in units of the
//! usual deviation nearby and of the errors themselves. Effects that a model cannot follow seldom do this: such errors come in groups.
//!
//! To leave a sample out, the model's own output replaces it; this is repeated until the outliers stay the same. It is the M-estimate with
//! weight 1 below the limit and 0 above, by Huber's (1981, section 7.8) pseudo-values, which work for all structures. For the first fit,
//! samples that stand alone in the output itself are interpolated, since a fit ruined by outliers does not show them.

use super::request::{Options, Progress, Request, Structure};
use super::result::{Detail, Identification};
use super::warning::Warning;
use crate::error::Result;
use crate::outliers::standing_alone;
use crate::record::{Record, bridged};
use crate::text::counted;

/// The initial state counts as forgotten when this share of its effect remains. Convention.
const SETTLED: f64 = 0.01;
/// The largest share of a record whose errors may come from the unknown initial state. Convention.
const LONGEST_START: f64 = 0.1;
/// The share of the output's variance below which a fit may have been ruined. Convention.
const RUINED: f64 = 0.5;
/// The most fits. Two are enough if the first finds all outliers.
const ROUNDS: usize = 5;

fn output(request: &Request<'_>) -> Result<Vec<f64>> {
    let each = request.records.iter().map(|record| record.column(request.output));
    Ok(each.collect::<Result<Vec<_>>>()?.concat())
}

/// The outliers among the errors of a model. At the start of a record the state is unknown, so those errors are not judged.
fn outliers(request: &Request<'_>, measured: &[f64], result: &Identification) -> Vec<usize> {
    let mut errors: Vec<f64> = measured.iter().zip(&result.predicted).map(|(y, p)| y - p).collect();
    let settling = result.model.settling(SETTLED);
    let mut first = 0;
    for record in request.records {
        let judged_from = settling.min((LONGEST_START * record.len() as f64) as usize);
        errors[first..first + judged_from].fill(f64::NAN);
        first += record.len();
    }
    standing_alone(&errors)
}

/// Adds a warning about the outliers of a result.
pub(super) fn warned(mut result: Identification, request: &Request<'_>) -> Result<Identification> {
    let is_said = |w: &Warning| matches!(w, Warning::Outliers { .. });
    if !result.warnings.iter().any(is_said) {
        let output = output(request)?;
        let mut samples = outliers(request, &output, &result);
        // An outlier that ruined the fit is far from the rest of the output, but hardly from the model.
        if result.verdict.measures.r_squared < RUINED {
            samples.extend(standing_alone(&output));
            samples.sort_unstable();
            samples.dedup();
        }
        say(&mut result, samples, false);
    }
    Ok(result)
}

fn say(result: &mut Identification, samples: Vec<usize>, left_out: bool) {
    if !samples.is_empty() {
        result.details.push(Detail::new("outliers", samples.clone()));
        result.warnings.push(Warning::Outliers { samples, left_out });
    }
}

/// The identification without the output's outliers.
pub(super) fn identify(
    structure: &Structure,
    request: &Request<'_>,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let measured = output(request)?;
    let mut found = standing_alone(&measured);
    let mut kept = measured.clone();
    found.iter().for_each(|t| kept[*t] = f64::NAN);
    let mut kept = match found.is_empty() {
        true => kept,
        false => filled(&measured, &bridged(&kept), &found),
    };
    let mut round = 0;
    loop {
        round += 1;
        let records = with_output(request, &kept)?;
        let records: Vec<&Record> = records.iter().collect();
        let options = Options {
            robust: false,
            ..request.options.clone()
        };
        let inner = Request::new(&records, request.inputs, request.output, options);
        let stage = &mut |stage: &str| progress(&format!("without {}, {stage}", counted(found.len(), "outlier")));
        let mut result = structure.identify_as_is(&inner, stage)?;
        let next = outliers(request, &measured, &result);
        if next == found || round == ROUNDS {
            result.warnings.retain(|w| !matches!(w, Warning::Outliers { .. }));
            result.details.retain(|d| d.key != "outliers");
            say(&mut result, found, true);
            return Ok(result);
        }
        kept = filled(&measured, &result.predicted, &next);
        found = next;
    }
}

/// The signal with the values of another one at some samples.
fn filled(signal: &[f64], by: &[f64], at: &[usize]) -> Vec<f64> {
    let mut filled = signal.to_vec();
    at.iter().for_each(|t| filled[*t] = by[*t]);
    filled
}

/// The records with another output.
fn with_output(request: &Request<'_>, y: &[f64]) -> Result<Vec<Record>> {
    let mut rest = y;
    let mut with = |record: &&Record| -> Result<Record> {
        let (mine, others) = rest.split_at(record.len());
        rest = others;
        let column = |(name, samples): (&str, &[f64])| match name == request.output {
            true => (name.to_owned(), mine.to_vec()),
            false => (name.to_owned(), samples.to_vec()),
        };
        Record::new(record.columns().map(column))
    };
    request.records.iter().map(&mut with).collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::identify::{HAMMERSTEIN, LINEAR};
    use crate::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

    const AT: [usize; 7] = [31, 260, 777, 778, 1100, 1390, 1820];

    /// A dead zone with two poles, 2000 samples, and the same with seven outliers of up to 60 standard deviations of the output.
    fn records() -> [Record; 2] {
        let [linear, _] = known_linear_parts();
        let clean = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear).simulate(2000, 3);
        let [u, mut y] = ["u", "y"].map(|name| clean.column(name).unwrap().to_vec());
        let spread = crate::linear::correlation::variance(&y).sqrt();
        let record = |y: &[f64]| Record::new([("u", u.clone()), ("y", y.to_vec())]).unwrap();
        let before = record(&y);
        for (k, at) in AT.iter().enumerate() {
            y[*at] += spread * (20.0 + 7.0 * k as f64) * if k % 3 == 0 { -1.0 } else { 1.0 };
        }
        [before, record(&y)]
    }

    fn identified(structure: &Structure, record: &Record, robust: bool) -> Identification {
        let records = [record];
        let options = Options {
            robust,
            ..Options::default()
        };
        let request = Request::new(&records, &["u"], "y", options);
        structure
            .identify_with(&request, &mut |_| std::ops::ControlFlow::Continue(()))
            .unwrap()
    }

    fn said(result: &Identification) -> Option<(Vec<usize>, bool)> {
        result.warnings.iter().find_map(|w| match w {
            Warning::Outliers { samples, left_out } => Some((samples.clone(), *left_out)),
            _ => None,
        })
    }

    #[test]
    fn outliers_are_named_and_the_robust_fit_is_that_without_them() {
        let [clean, spoiled] = records();
        for structure in [&HAMMERSTEIN, &LINEAR] {
            let truth = identified(structure, &clean, false);
            assert_eq!(said(&truth), None);
            let plain = identified(structure, &spoiled, false);
            // The outliers spoil this fit, and may make another sample stand alone.
            let (named, left_out) = said(&plain).unwrap();
            assert!(!left_out && named.len() <= AT.len() + 1, "{named:?}");
            assert!(AT.iter().all(|at| named.contains(at)), "{named:?}");
            let robust = identified(structure, &spoiled, true);
            assert_eq!(said(&robust), Some((AT.to_vec(), true)));
            // The errors of the three models on the clean output.
            let y = clean.column("y").unwrap();
            let error = |found: &Identification| -> f64 {
                let errors = y.iter().zip(&found.predicted).map(|(y, p)| (y - p).powi(2));
                errors.sum::<f64>().sqrt()
            };
            let [truth, plain, robust] = [&truth, &plain, &robust].map(error);
            assert!(robust < 1.02 * truth, "{robust} {truth}");
            assert!(plain > 1.2 * truth, "{plain} {truth}");
        }
    }

    #[test]
    fn a_robust_fit_of_a_record_without_outliers_is_the_plain_one() {
        let [clean, _] = records();
        let [plain, robust] = [false, true].map(|robust| identified(&LINEAR, &clean, robust));
        assert_eq!(plain, robust);
    }

    #[test]
    fn normal_noise_has_no_outliers_and_a_step_is_none() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let mut noise: Vec<f64> = (0..200_000).map(|_| StandardNormal.sample(&mut rng)).collect();
        assert!(standing_alone(&noise).is_empty());
        noise[70_000..].iter_mut().for_each(|v| *v += 100.0);
        assert!(standing_alone(&noise).is_empty());
        noise[500] = f64::NAN;
        noise[900] = 30.0;
        noise[901] = -30.0;
        assert_eq!(standing_alone(&noise), [900, 901]);
    }
}
