//! Values on the command line, checked while they are read, so that wrong ones are wrong usage.

use std::str::FromStr;

use anyhow::{Result, bail};
use flexure::nonlinearity::Kernel;
use flexure_io::RecordFile;

/// The column of sample instants in records that Flexure writes, and looks for in others.
pub const TIME: &str = "t";
/// Relative difference of two sample times that still counts as none (printed digits).
const SAME_SAMPLE_TIME: f64 = 1e-3;

/// `auto` or a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Auto<T> {
    /// Choose it from data.
    Auto,
    /// Take this.
    Given(T),
}

impl<T: Copy> Auto<T> {
    /// The value, if one was given.
    pub fn given(self) -> Option<T> {
        match self {
            Auto::Auto => None,
            Auto::Given(value) => Some(value),
        }
    }
}

/// `auto` or a whole number from 0.
pub fn auto_count(text: &str) -> Result<Auto<usize>, String> {
    if text == "auto" {
        return Ok(Auto::Auto);
    }
    text.parse()
        .map(Auto::Given)
        .map_err(|_| "expected 'auto' or a whole number from 0".to_owned())
}

/// `auto` or a positive number.
pub fn auto_positive(text: &str) -> Result<Auto<f64>, String> {
    if text == "auto" {
        Ok(Auto::Auto)
    } else {
        positive(text).map(Auto::Given)
    }
}

/// A positive, finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match f64::from_str(text) {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

/// A kernel by name.
pub fn kernel(text: &str) -> Result<Kernel, String> {
    Kernel::ALL.into_iter().find(|k| k.name() == text).ok_or_else(|| {
        let names: Vec<&str> = Kernel::ALL.iter().map(|k| k.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// A point `X=PHI` at which the nonlinearity is known.
pub fn known_point(text: &str) -> Result<[f64; 2], String> {
    let number = |t: &str| f64::from_str(t.trim()).ok().filter(|v| v.is_finite());
    match text.split_once('=').map(|(x, phi)| (number(x), number(phi))) {
        Some((Some(x), Some(phi))) => Ok([x, phi]),
        _ => Err("expected X=PHI, two numbers, for example 0=0".to_owned()),
    }
}

/// The sample time of a record in s: as given, or from its column `t`; `None` if neither tells.
pub fn sample_time(file: &RecordFile, given: Option<f64>) -> Result<Option<f64>> {
    let recorded = match file.record.names().iter().any(|n| n == TIME) {
        true => Some(file.sample_time(TIME)?),
        false => None,
    };
    if let (Some(given), Some(recorded)) = (given, recorded)
        && (given - recorded).abs() > SAME_SAMPLE_TIME * recorded
    {
        bail!(
            "{}: column '{TIME}' has a sample time of {recorded} s, but --sample-time says {given} s; leave the option out or correct the column",
            file.path.display()
        );
    }
    Ok(given.or(recorded))
}

/// Refuses a record whose sample time is not the model's.
pub fn same_sample_time(file: &RecordFile, model: Option<f64>) -> Result<()> {
    if let (Some(model), Some(recorded)) = (model, sample_time(file, None)?)
        && (model - recorded).abs() > SAME_SAMPLE_TIME * model
    {
        bail!(
            "{}: the sample time is {recorded} s, but the model was identified at {model} s; resample the record",
            file.path.display()
        );
    }
    Ok(())
}
