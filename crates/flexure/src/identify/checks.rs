//! Checks before and after an identification: refusals and warnings.

use super::limits::{
    CONSTANT, FEW_LEVELS, FRESH_SHARES, MOST_OUTSIDE, NEGLIGIBLE_COLOUR, SLIGHTLY_OUTSIDE, WHITENESS_LAGS,
};
use std::ops::Range;

use super::outcome::Verdict;
use super::warning::Warning;
use crate::error::{DataError, Error, Result};
use crate::linear::correlation::{cross_covariance, variance};
use crate::nonlinearity::{Curve, Outside};
use crate::record::check_values;
use crate::validation::whiteness;

/// The number of fitted samples if this share at the end is kept for the verdict; refuses a share that is out of range.
pub(super) fn fresh_part(fresh_share: f64, samples: usize) -> Result<usize> {
    if !FRESH_SHARES.contains(&fresh_share) {
        return Err(Error::parameter("the fresh share", fresh_share, "between 0.05 and 0.9"));
    }
    Ok(samples - (fresh_share * samples as f64).round() as usize)
}

/// Refuses columns that do not vary over the part of the fit or over the fresh part.
pub(super) fn both_vary(columns: &[(&str, &[f64])], fitted: usize) -> Result<()> {
    for (column, samples) in columns {
        must_vary(column, samples, 0..fitted, "used for the fit")?;
        must_vary(column, samples, fitted..samples.len(), "kept for the verdict")?;
    }
    Ok(())
}

/// Refuses a column that does not vary over `part` by more than rounding.
fn must_vary(column: &str, samples: &[f64], part: Range<usize>, purpose: &'static str) -> Result<()> {
    let largest = check_values(column, samples)?;
    let varies = |v: &[f64], beside: f64| variance(v).sqrt() > CONSTANT * beside;
    let own = &samples[part.clone()];
    if varies(own, largest) {
        return Ok(());
    }
    let (column, value) = (column.to_owned(), samples[part.start]);
    if !varies(samples, largest) {
        return Err(Error::constant(column, value));
    }
    if varies(own, own.iter().fold(0.0_f64, |m, v| m.max(v.abs()))) {
        let sample = samples.iter().position(|v| v.abs() == largest).unwrap_or(0);
        let value = samples[sample];
        return Err(Error::Data(DataError::Outlier { column, sample, value }));
    }
    Err(Error::Data(DataError::ConstantPart {
        column,
        value,
        first: part.start,
        last: part.end - 1,
        purpose,
    }))
}

/// The values that the input takes, in order of appearance, if they are too few for a curve.
pub(crate) fn few_levels(u: &[f64]) -> Option<Vec<f64>> {
    let mut levels: Vec<f64> = Vec::new();
    for &v in u {
        if !levels.contains(&v) {
            levels.push(v);
        }
        if levels.len() > FEW_LEVELS {
            return None;
        }
    }
    Some(levels)
}

/// Warns if the input takes too few values for a curve.
pub(super) fn warn_of_levels(u: &[f64], warnings: &mut Vec<Warning>) {
    warnings.extend(few_levels(u).map(|levels| Warning::FewLevels { levels: levels.len() }));
}

/// The largest autocorrelation in absolute value of an input that is not white, and its lag.
pub(super) struct Colour {
    pub largest: f64,
    pub lag: usize,
}

/// The colour of an input that is so far from white that the correlation estimate suffers.
pub(super) fn colour(u: &[f64]) -> Option<Colour> {
    let lags = WHITENESS_LAGS.min(u.len() / 5);
    let r = cross_covariance(u, u, lags);
    let (lag, largest) = (1..=lags)
        .map(|j| (j, r[j] / r[0]))
        .fold((0, 0.0_f64), |a, b| if b.1.abs() > a.1.abs() { b } else { a });
    let coloured = !whiteness(u, lags).passed() && largest.abs() > NEGLIGIBLE_COLOUR;
    coloured.then_some(Colour { largest, lag })
}

/// Warns if the model predicts no better than the output's mean.
pub(super) fn warn_if_useless(verdict: &Verdict, warnings: &mut Vec<Warning>) {
    let fit_percent = verdict.measures.fit_percent;
    if fit_percent <= 0.0 {
        warnings.push(Warning::Useless { fit_percent });
    }
}

/// Warns if what enters a curve in the fresh part, the input itself or a signal behind it, often lies outside the curve's range.
pub(super) fn warn_of_range(curve: &Curve, fresh: &[f64], is_input: bool, warnings: &mut Vec<Warning>) {
    let outside = fresh.iter().filter(|&&u| !curve.covers(u)).count();
    let percent = 100.0 * outside as f64 / fresh.len() as f64;
    let x = curve.x();
    let (low, high) = (x[0], x[x.len() - 1]);
    let beyond = fresh.iter().map(|&u| (low - u).max(u - high));
    let farthest = beyond.fold(0.0, f64::max) / (high - low);
    if percent > MOST_OUTSIDE && farthest > SLIGHTLY_OUTSIDE {
        warnings.push(Warning::OutsideRange {
            percent,
            is_input,
            low,
            high,
            farthest,
            continued: curve.outside() == Outside::Linear,
        });
    }
}
