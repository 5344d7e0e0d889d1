//! Linear dynamics of the inputs that a model misses.
//!
//! The residual tests regress the error on 25 lags of the input. They can overlook resonances that ring for longer, so their error looks like
//! coloured noise. Here the [linear](super::LINEAR) structure is identified from the inputs to the model's error on the fitted part. If it
//! predicts a part of the error on the fresh part, the error depends on the input.
//!
//! The test is not made for linear models, several records, missing outputs, the option robust, or a negligible error.

use super::LINEAR;
use super::request::{Options, Progress, Request};
use super::result::Identification;
use crate::error::{Error, Result};
use crate::record::Record;
use crate::validation::TestKind;

/// The samples that are tested, and a third of those that are fitted. They bound the time.
const MOST_TESTED: usize = 10_000;
/// The name of the error's column.
const ERROR: &str = "the model's error";

/// The result with one more residual test in its verdicts, if its error is coloured and no test refutes it so far.
pub(super) fn tested(
    mut result: Identification,
    request: &Request<'_>,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let is_own = result.structure == LINEAR.name || result.comparison.is_some();
    if is_own || request.options.robust || !result.verdict.may_miss_dynamics() {
        return Ok(result);
    }
    let [record] = request.records else {
        return Ok(result);
    };
    // Without all outputs there is no error at every sample.
    let Ok(y) = record.finite(request.output) else {
        return Ok(result);
    };
    let part = result.fitted.saturating_sub(3 * MOST_TESTED)..y.len().min(result.fitted + MOST_TESTED);
    let error: Vec<f64> = part.clone().map(|t| y[t] - result.predicted[t]).collect();
    let fitted = result.fitted - part.start;
    let Some(explained) = explained(&error, fitted, &record.slice(part), request, progress)? else {
        return Ok(result);
    };
    let [error, explained] = [&error, &explained].map(|samples| &samples[fitted..]);
    for verdict in result.verdicts.iter_mut().chain([&mut result.verdict]) {
        let estimated = verdict.estimated;
        if let Some(residuals) = &mut verdict.residuals {
            residuals.test_explanation(TestKind::DynamicsOfInput, error, explained, estimated);
        }
    }
    Ok(result)
}

/// The error that linear dynamics predict, if they can be identified from the first `fitted` samples.
fn explained(
    error: &[f64],
    fitted: usize,
    record: &Record,
    request: &Request<'_>,
    progress: &mut Progress<'_>,
) -> Result<Option<Vec<f64>>> {
    let mut columns = vec![(ERROR.to_owned(), error.to_vec())];
    for name in request.inputs {
        columns.push(((*name).to_owned(), record.column(name)?.to_vec()));
    }
    // An input may have the name of the error.
    let Ok(record) = Record::new(columns) else {
        return Ok(None);
    };
    let records = [&record];
    let options = Options::with_fresh_share(1.0 - fitted as f64 / error.len() as f64);
    let request = Request::new(&records, request.inputs, ERROR, options);
    let stage = &mut |stage: &str| progress(&format!("missed dynamics, {stage}"));
    match LINEAR.identify_as_is(&request, stage) {
        Ok(linear) => Ok(Some(linear.predicted)),
        Err(Error::Stopped(why)) => Err(Error::Stopped(why)),
        Err(_) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::ops::ControlFlow;

    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::identify::HAMMERSTEIN;
    use crate::linear::TransferFunction;
    use crate::linear::correlation::mean_square;
    use crate::validation::{ResidualTest, ResidualTests};

    const N: usize = 3000;

    fn input(random: &mut Pcg64) -> Vec<f64> {
        (0..N).map(|_| random.random_range(-1.0..1.0)).collect()
    }

    fn mode(frequency: f64, radius: f64) -> TransferFunction {
        let cosine = (TAU * frequency).cos();
        TransferFunction::new(vec![0.0, 1.0], vec![1.0, -2.0 * radius * cosine, radius * radius]).unwrap()
    }

    fn of(result: &Identification) -> Option<&ResidualTest> {
        let mut tests = result.verdict.residuals.iter().flat_map(|r| &r.tests);
        tests.find(|t| t.kind == TestKind::DynamicsOfInput)
    }

    fn identified(u: Vec<f64>, y: Vec<f64>) -> Identification {
        let record = Record::new([("u", u), ("y", y)]).unwrap();
        HAMMERSTEIN.identify(&record, &["u"], "y").unwrap()
    }

    /// A weak resonance that rings for a hundred samples, under noise of another colour: the test against 25 lags of the input hardly sees it.
    #[test]
    fn a_weak_resonance_is_seen_in_coloured_noise() {
        let mut unseen = 0;
        for seed in 0..4 {
            let mut random = Pcg64::seed_from_u64(seed);
            let u = input(&mut random);
            let noise: Vec<f64> = (0..N).map(|_| StandardNormal.sample(&mut random)).collect();
            let noise = TransferFunction::new(vec![1.0], vec![1.0, -0.9])
                .unwrap()
                .simulate(&noise);
            let ringing = mode(0.05, 0.99).simulate(&u);
            let share = 0.4 * (mean_square(&noise) / mean_square(&ringing)).sqrt();
            let e: Vec<f64> = noise.iter().zip(&ringing).map(|(e, r)| e + share * r).collect();
            let record = Record::new([("u", u.clone()), ("y", e.clone())]).unwrap();
            let records = [&record];
            let request = Request::new(&records, &["u"], "y", Options::default());
            let explained = explained(&e, 3 * N / 4, &record, &request, &mut |_| ControlFlow::Continue(())).unwrap();
            let fresh = 3 * N / 4..;
            let mut tests = ResidualTests::new(&e[fresh.clone()], &u[fresh.clone()]).unwrap();
            let (e, explained) = (&e[fresh.clone()], &explained.unwrap()[fresh]);
            tests.test_explanation(TestKind::DynamicsOfInput, e, explained, None);
            let of = |kind| *tests.tests.iter().find(|t| t.kind == kind).unwrap();
            let test = of(TestKind::DynamicsOfInput);
            // The resonance has 14 % of the error's variance.
            assert!(!test.passed() && test.effect < 0.2, "{test:?}");
            unseen += usize::from(of(TestKind::InputIndependence).passed());
        }
        assert!(unseen >= 2, "{unseen}");
    }

    /// Noise may ring too, but it does not depend on the input.
    #[test]
    fn ringing_noise_does_not_refute_a_model() {
        let mut tested = 0;
        for seed in 0..8 {
            let mut random = Pcg64::seed_from_u64(seed);
            let u = input(&mut random);
            let noise: Vec<f64> = (0..N).map(|_| StandardNormal.sample(&mut random)).collect();
            let x = TransferFunction::new(vec![0.0, 0.3, 0.1], vec![1.0, -1.2, 0.5]).unwrap();
            let x = x.simulate(&u.iter().map(|u| (2.0 * u).tanh()).collect::<Vec<_>>());
            let noise = mode(0.03, 0.97).simulate(&noise);
            let y = x.iter().zip(noise).map(|(x, e)| x + 0.01 * e).collect();
            if let Some(test) = of(&identified(u, y)) {
                tested += 1;
                assert!(test.passed(), "{test:?}");
            }
        }
        assert!(tested >= 6, "{tested}");
    }
}
