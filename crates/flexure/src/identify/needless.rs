//! Inputs of several that a model does not need.

use super::request::Request;
use super::result::Identification;
use super::warning::Warning;
use crate::error::Result;
use crate::linear::correlation::mean;
use crate::validation::FitMeasures;

/// An input is needless if the error without it is larger by at most this factor. Convention.
const NEEDLESS: f64 = 1.01;

/// Warns of the inputs of several without which the model predicts as well: each is held at its mean, and the offset is adapted.
pub(super) fn warned(mut result: Identification, request: &Request<'_>) -> Result<Identification> {
    let is_said = |w: &Warning| matches!(w, Warning::NeedlessInput { .. });
    let is_useful = result.verdict.measures.fit_percent > 0.0;
    if request.inputs.len() < 2 || !is_useful || result.warnings.iter().any(is_said) {
        return Ok(result);
    }
    let record = request.record()?;
    let columns = request.inputs.iter().map(|input| record.column(input));
    let u: Vec<&[f64]> = columns.collect::<Result<_>>()?;
    let (y, fitted) = (record.column(request.output)?, result.fitted);
    let fresh = |predicted: &[f64]| FitMeasures::new(&y[fitted..], &predicted[fitted..]);
    let all = fresh(&result.predicted)?;
    for (i, input) in request.inputs.iter().enumerate() {
        let held = vec![mean(&u[i][..fitted]); y.len()];
        let mut inputs = u.clone();
        inputs[i] = &held;
        let mut run = result.model.run(&inputs);
        let errors: Vec<f64> = y[..fitted].iter().zip(&run).map(|(y, p)| y - p).collect();
        let offset = mean(&errors);
        run.iter_mut().for_each(|p| *p += offset);
        let without = fresh(&run)?;
        if without.rms <= NEEDLESS * all.rms {
            result.warnings.push(Warning::NeedlessInput {
                input: (*input).to_owned(),
                fit_percent: without.fit_percent,
            });
        }
    }
    Ok(result)
}
