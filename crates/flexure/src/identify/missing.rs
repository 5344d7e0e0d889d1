//! Outputs that are missing, for the structures whose fit needs one at every sample.
//!
//! The model's own output stands in for them; this is repeated until it hardly changes. Such a sample then has no error, so the fit is the
//! one of the others (Huber 1981, section 7.8, for weights of 0 and 1). The verdict leaves them out. Standard errors count them as samples
//! without noise: of a share p, they are too small by the factor 1 - p.

use super::request::{Progress, Request, Structure};
use super::result::Identification;
use super::warning::Warning;
use crate::error::{Error, Result};
use crate::record::bridged;
use crate::validation::FitMeasures;

/// The outputs are settled when the estimates would move by about this many standard errors: the root of the missing samples' share times
/// their RMS change in units of the RMS error. Convention.
const SETTLED: f64 = 0.05;
/// The most fits. From one fit to the next, the change shrinks about by the factor of the missing samples' share.
const ROUNDS: usize = 5;
/// The largest share of missing outputs. Convention: beyond, the start of a search is hardly that of the system.
const MOST_MISSING: f64 = 0.5;

/// A warning with the number of missing outputs, if there are any.
pub(super) fn warning(result: &Identification, request: &Request<'_>) -> Result<Option<Warning>> {
    let (mut missing, mut samples) = (0, 0);
    for record in request.records {
        let output = record.column(request.output)?;
        missing += output.iter().filter(|y| y.is_nan()).count();
        samples += output.len();
    }
    let own = Structure::by_name(result.structure.key).is_some_and(|s| s.is_refined(&request.options));
    Ok((missing > 0).then_some(Warning::MissingOutputs {
        missing,
        samples,
        filled: !own,
    }))
}

/// The identification without the missing outputs.
pub(super) fn identify(
    structure: &Structure,
    request: &Request<'_>,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let measured = request.record()?.column(request.output)?;
    if let Some(sample) = measured.iter().position(|y| y.is_infinite()) {
        return Err(Error::not_finite(request.output, sample, measured[sample]));
    }
    let at: Vec<usize> = (0..measured.len()).filter(|&t| measured[t].is_nan()).collect();
    if at.is_empty() {
        return (structure.identify)(request, progress);
    }
    let (present, least) = (measured.len() - at.len(), (1.0 - MOST_MISSING) * measured.len() as f64);
    if (present as f64) < least {
        return Err(Error::too_short(
            "a fit (besides missing samples)",
            least.ceil() as usize,
            present,
        ));
    }
    let mut whole = bridged(measured);
    let mut round = 0;
    loop {
        round += 1;
        let result = (structure.identify)(&request.with_outputs(&whole), progress)?;
        let change: f64 = at.iter().map(|&t| (result.predicted[t] - whole[t]).powi(2)).sum();
        let rms = FitMeasures::new(&whole, &result.predicted)?.rms;
        if change <= (SETTLED * rms).powi(2) * measured.len() as f64 || round == ROUNDS {
            return Ok(result);
        }
        at.iter().for_each(|&t| whole[t] = result.predicted[t]);
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::error::DataError;
    use crate::identify::request::Options;
    use crate::identify::{AUTO, LINEAR, WIENER};
    use crate::record::Record;
    use crate::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

    /// A saturation behind two poles, in noise: the input, the measured output, and the output without noise.
    fn signals(n: usize, seed: u64) -> [Vec<f64>; 3] {
        let [linear, _] = known_linear_parts();
        let source = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear.clone()).simulate(n, seed);
        let [u, y, y0] = ["u", "y", "y0"].map(|name| source.column(name).unwrap().to_vec());
        let clean: Vec<f64> = linear.simulate(&u).iter().map(|w| w.tanh()).collect();
        let noise = y.iter().zip(&y0).map(|(y, y0)| 0.1 * (y - y0));
        let measured = clean.iter().zip(noise).map(|(y, e)| y + e).collect();
        [u, measured, clean]
    }

    /// Takes away a share of the outputs, some of them in gaps of twenty.
    fn with_gaps(y: &[f64], share: f64) -> Vec<f64> {
        let is_missing = |t: usize| {
            let [one, gap] = [t, 7 + t / 20].map(|k| (k as f64 * 0.754_877_666).fract());
            one < 0.5 * share || gap < 0.5 * share
        };
        y.iter()
            .enumerate()
            .map(|(t, y)| if is_missing(t) { f64::NAN } else { *y })
            .collect()
    }

    fn identified(structure: &Structure, u: &[f64], y: &[f64]) -> Result<Identification> {
        let record = Record::new([("u", u.to_vec()), ("y", y.to_vec())])?;
        let records = [&record];
        let options = Options {
            missing: true,
            ..Options::default()
        };
        structure.identify_with(&Request::new(&records, &["u"], "y", options), &mut |_| {
            ControlFlow::Continue(())
        })
    }

    /// The RMS error of the free run against the output without noise.
    fn error(result: &Identification, clean: &[f64]) -> f64 {
        FitMeasures::new(clean, &result.predicted).unwrap().rms
    }

    #[test]
    fn a_tenth_of_the_outputs_missing_costs_little() {
        for structure in [&WIENER, &LINEAR] {
            let (mut all, mut some, mut interpolated) = (0.0, 0.0, 0.0);
            for seed in 1..3 {
                let [u, y, clean] = signals(2000, seed);
                let gaps = with_gaps(&y, 0.1);
                all += error(&identified(structure, &u, &y).unwrap(), &clean);
                let result = identified(structure, &u, &gaps).unwrap();
                let missing = gaps.iter().filter(|y| y.is_nan()).count();
                assert!(
                    result.warnings.contains(&Warning::MissingOutputs {
                        missing,
                        samples: 2000,
                        filled: true
                    }),
                    "{:?}",
                    result.warnings
                );
                some += error(&result, &clean);
                interpolated += error(&identified(structure, &u, &bridged(&gaps)).unwrap(), &clean);
                // The verdict is on the samples that there are.
                let fresh = result.fitted..2000;
                let errors: Vec<f64> = fresh
                    .map(|t| gaps[t] - result.predicted[t])
                    .filter(|e| !e.is_nan())
                    .collect();
                let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
                assert_eq!(result.verdict.measures.samples, errors.len());
                assert!((result.verdict.measures.rms / rms - 1.0).abs() < 1e-9);
            }
            let name = structure.name.key;
            assert!(some < 1.3 * all, "{name}: {some} {all}");
            assert!(
                structure.name.key == "linear" || some < 0.8 * interpolated,
                "{name}: {some} {interpolated}"
            );
        }
    }

    #[test]
    fn the_structure_is_found_although_outputs_are_missing() {
        let [u, y, _] = signals(2000, 5);
        let result = identified(&AUTO, &u, &with_gaps(&y, 0.05)).unwrap();
        let comparison = result.comparison.as_ref().unwrap();
        assert_eq!(comparison.supported.map(|s| s.key), Some("wiener"), "{comparison:?}");
        assert!(result.verdict.holds());
    }

    #[test]
    fn too_few_outputs_and_infinite_ones_are_refused() {
        let [u, y, _] = signals(1000, 6);
        let most: Vec<f64> = y
            .iter()
            .enumerate()
            .map(|(t, y)| if t % 5 < 3 { f64::NAN } else { *y })
            .collect();
        let refused = identified(&LINEAR, &u, &most);
        assert!(
            matches!(refused, Err(Error::Data(DataError::TooShort { .. }))),
            "{refused:?}"
        );
        let infinite: Vec<f64> = y
            .iter()
            .enumerate()
            .map(|(t, y)| if t == 7 { f64::INFINITY } else { *y })
            .collect();
        let refused = identified(&LINEAR, &u, &infinite);
        assert!(
            matches!(refused, Err(Error::Data(DataError::NonFinite { sample: 7, .. }))),
            "{refused:?}"
        );
        let no_fresh: Vec<f64> = y
            .iter()
            .enumerate()
            .map(|(t, y)| if t >= 750 { f64::NAN } else { *y })
            .collect();
        let refused = identified(&LINEAR, &u, &no_fresh);
        assert!(
            matches!(refused, Err(Error::Data(DataError::TooShort { .. }))),
            "{refused:?}"
        );
    }
}
