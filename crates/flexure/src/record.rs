//! A record: named, sampled signals of equal length, with one sample for each instant.

use std::collections::HashSet;

use crate::error::{DataError, Error, Result};
use crate::sort;

/// If a time step deviates from the median step by more than this, in steps, samples are missing and not just late.
const GAP: f64 = 0.5;
/// Largest deviation of an instant from the uniform grid, in steps, that counts as jitter of the logger's clock.
///
/// If a sample is late by a tenth of a step, its error is a tenth of the signal's change over the step.
const JITTER: f64 = 0.1;

/// The uniform clock of a record's instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleClock {
    /// The sample time.
    pub step: f64,
    /// The largest deviation of an instant from the uniform grid, in steps. Its cause is printed digits or an inexact clock.
    pub jitter: f64,
}

/// Named columns of equal length, in order.
///
/// Samples may be NaN or infinite until they are used: [`Record::finite`] refuses those.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Record {
    /// Builds a record from `(name, samples)` pairs.
    ///
    /// # Errors
    /// [`Error::Data`]: `DuplicateColumn` and `LengthMismatch`.
    pub fn new<N: Into<String>>(columns: impl IntoIterator<Item = (N, Vec<f64>)>) -> Result<Self> {
        let mut record = Record::default();
        let mut taken = HashSet::new();
        for (name, samples) in columns {
            let name = name.into();
            if !taken.insert(name.clone()) {
                return Err(Error::Data(DataError::DuplicateColumn { name }));
            }
            record.push_other(name, samples)?;
        }
        Ok(record)
    }

    /// A record of columns that are known to have different names and equal lengths.
    pub(crate) fn from_equal<const N: usize>(columns: [(&str, Vec<f64>); N]) -> Self {
        Record {
            names: columns.iter().map(|c| c.0.to_owned()).collect(),
            columns: columns.into_iter().map(|c| c.1).collect(),
        }
    }

    /// Adds a column at the end.
    ///
    /// # Errors
    /// [`Error::Data`]: `DuplicateColumn` and `LengthMismatch`.
    pub fn push(&mut self, name: impl Into<String>, samples: Vec<f64>) -> Result<()> {
        let name = name.into();
        if self.names.contains(&name) {
            return Err(Error::Data(DataError::DuplicateColumn { name }));
        }
        self.push_other(name, samples)
    }

    /// Adds a column whose name is known to be new.
    fn push_other(&mut self, name: String, samples: Vec<f64>) -> Result<()> {
        if let Some(first) = self.columns.first()
            && first.len() != samples.len()
        {
            return Err(Error::length(name, samples.len(), first.len()));
        }
        self.names.push(name);
        self.columns.push(samples);
        Ok(())
    }

    /// The number of samples in each column.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether there is no sample at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The columns' names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Names and samples, in order.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.names
            .iter()
            .map(String::as_str)
            .zip(self.columns.iter().map(Vec::as_slice))
    }

    /// The samples of one column, unchecked.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        match self.names.iter().position(|n| n == name) {
            Some(i) => Ok(&self.columns[i]),
            None => Err(Error::Data(DataError::MissingColumn {
                name: name.to_owned(),
                available: self.names.clone(),
            })),
        }
    }

    /// The samples of one column, all of them finite.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`.
    pub fn finite(&self, name: &str) -> Result<&[f64]> {
        let samples = self.column(name)?;
        match samples.iter().position(|v| !v.is_finite()) {
            None => Ok(samples),
            Some(sample) => Err(Error::not_finite(name, sample, samples[sample])),
        }
    }

    /// The sample time: the step of [`Record::sample_clock`], from a column of uniform, increasing sample instants.
    ///
    /// # Errors
    /// As [`Record::sample_clock`].
    pub fn sample_time(&self, time: &str) -> Result<f64> {
        Ok(self.sample_clock(time)?.step)
    }

    /// The clock of a column of sample instants, which must be uniform and increasing.
    ///
    /// The step is that of the least-squares line through the instants, to as many digits as the instants support. Instants may deviate from the uniform grid by a tenth of a step.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `TooShort` (fewer than two samples),
    /// `TimeNotIncreasing` and `NonUniformTime`.
    pub fn sample_clock(&self, time: &str) -> Result<SampleClock> {
        sample_clock(self.finite(time)?)
    }

    /// The samples `range` of every column.
    ///
    /// # Panics
    /// If the range is not within the record.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Record {
        Record {
            names: self.names.clone(),
            columns: self.columns.iter().map(|c| c[range.clone()].to_vec()).collect(),
        }
    }
}

/// The allowed sizes of a column's largest value. Within them, neither the squares of values nor those of their differences overflow or
/// vanish.
pub const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// The largest absolute value of a column, if all are finite and their squares neither overflow nor vanish.
pub fn check_values(column: &str, values: &[f64]) -> Result<f64> {
    if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
        return Err(Error::not_finite(column, sample, values[sample]));
    }
    let largest = values.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    if largest == 0.0 || SIZES.contains(&largest) {
        return Ok(largest);
    }
    let column = column.to_owned();
    let is_huge = |v: &f64| v.abs() > *SIZES.end();
    // A few huge values among others are wrong. If most are huge, the unit is too small.
    let huge = values.iter().filter(|v| is_huge(v)).count();
    Err(Error::Data(match values.iter().position(is_huge) {
        Some(sample) if 2 * huge < values.len() => DataError::TooLarge {
            column,
            sample,
            value: values[sample],
        },
        _ => DataError::Unit { column, largest },
    }))
}

/// The clock of uniform, increasing instants `t`.
pub(crate) fn sample_clock(t: &[f64]) -> Result<SampleClock> {
    if t.len() < 2 {
        return Err(Error::too_short("a sample time", 2, t.len()));
    }
    let step = |i: usize| t[i] - t[i - 1];
    let median = sort::median((1..t.len()).map(step).collect());
    let not_uniform = |sample| {
        let (step, expected) = (step(sample), median);
        Err(Error::Data(DataError::NonUniformTime { sample, step, expected }))
    };
    for sample in 1..t.len() {
        let step = step(sample);
        if !(step > 0.0) {
            return Err(Error::Data(DataError::TimeNotIncreasing { sample, step }));
        }
        if !((step - median).abs() <= GAP * median) {
            return not_uniform(sample);
        }
    }
    let mean = least_squares_step(t);
    let late = |i: usize| (t[i] - t[0]) / mean - i as f64;
    let (mut earliest, mut latest) = (0.0_f64, 0.0_f64);
    for sample in 1..t.len() {
        earliest = earliest.min(late(sample));
        latest = latest.max(late(sample));
        if latest - earliest > 2.0 * JITTER {
            return not_uniform(sample);
        }
    }
    let jitter = (latest - earliest) / 2.0;
    Ok(SampleClock {
        step: rounded_step(mean, t, jitter * mean),
        jitter,
    })
}

/// The slope of the least-squares line through the instants over their numbers. The mean step would depend only on the first and the last
/// instant.
fn least_squares_step(t: &[f64]) -> f64 {
    let middle = (t.len() - 1) as f64 / 2.0;
    let places = || (0..t.len()).map(|i| i as f64 - middle);
    let product: f64 = places().zip(t).map(|(place, t_i)| place * (t_i - t[0])).sum();
    product / places().map(|place| place * place).sum::<f64>()
}

/// The samples; missing ones are put on the straight line between their neighbours. Zeros if all are missing.
pub(crate) fn bridged(samples: &[f64]) -> Vec<f64> {
    let mut out = samples.to_vec();
    let known: Vec<usize> = (0..out.len()).filter(|&i| !out[i].is_nan()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else {
        return vec![0.0; out.len()];
    };
    out[..first].fill(samples[first]);
    out[last..].fill(samples[last]);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for i in a + 1..b {
            let share = (i - a) as f64 / (b - a) as f64;
            out[i] = samples[a] + share * (samples[b] - samples[a]);
        }
    }
    out
}

/// The shortest decimal that the instants `t` cannot distinguish from their mean step: 0.01, not 0.009999999999999998. The instants are off by up to `deviation`,
/// and by the rounding of floating-point numbers.
pub(crate) fn rounded_step(mean: f64, t: &[f64], deviation: f64) -> f64 {
    let largest = t.iter().fold(0.0_f64, |largest, t| largest.max(t.abs()));
    let uncertainty = (2.0 * f64::EPSILON * largest + deviation) / (t.len() - 1) as f64;
    // The rounding of a sum of `t.len()` terms.
    let rounding = f64::EPSILON * mean * (t.len() as f64).sqrt();
    let to_digits = |digits: usize| format!("{mean:.digits$e}").parse().unwrap_or(mean);
    let mut rounded = (0..16).map(to_digits);
    rounded
        .find(|step| (step - mean).abs() <= uncertainty.max(rounding))
        .unwrap_or(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record::new([("t", vec![0.0, 0.1, 0.2]), ("u", vec![1.0, f64::NAN, 2.0])]).unwrap()
    }

    #[test]
    fn what_is_missing_is_bridged() {
        let nan = f64::NAN;
        assert_eq!(bridged(&[nan, 1.0, nan, nan, 4.0, nan]), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(bridged(&[nan, nan]), [0.0, 0.0]);
    }

    #[test]
    fn columns_are_found_by_name_and_a_missing_one_lists_the_others() {
        let r = record();
        assert_eq!(r.column("t").unwrap(), &[0.0, 0.1, 0.2]);
        let message = r.column("y").unwrap_err().to_string();
        assert_eq!(message, "no column 'y'; the columns are: t, u");
    }

    #[test]
    fn lengths_and_names_are_checked() {
        let mut r = record();
        assert!(matches!(
            r.push("y", vec![0.0]),
            Err(Error::Data(DataError::LengthMismatch {
                got: 1,
                expected: 3,
                ..
            }))
        ));
        assert!(matches!(
            r.push("u", vec![0.0; 3]),
            Err(Error::Data(DataError::DuplicateColumn { .. }))
        ));
        assert_eq!(r.names(), ["t", "u"]);
    }

    #[test]
    fn a_non_finite_sample_is_located() {
        let error = record().finite("u").unwrap_err();
        assert!(matches!(error, Error::Data(DataError::NonFinite { sample: 1, .. })));
    }

    #[test]
    fn sample_time_is_the_mean_step() {
        let t: Vec<f64> = (0..1000).map(|i| 1e6 + 0.01 * i as f64).collect();
        let r = Record::new([("t", t)]).unwrap();
        assert!((r.sample_time("t").unwrap() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_sample_time_has_the_digits_that_the_instants_support() {
        let step_of = |t: Vec<f64>| Record::new([("t", t)]).unwrap().sample_time("t").unwrap();
        for (start, step) in [
            (0.0, 0.01),
            (0.3, 0.01),
            (1.7e9, 0.01),
            (-2.0, 0.1),
            (5.0, 1e-4),
            (0.0, 2.5),
            (0.1, 48.0),
        ] {
            for n in [2, 3, 100, 4001] {
                let t = (0..n).map(|i| start + step * f64::from(i)).collect();
                // Two instants of 1.7e9 s determine their step only to 2e-7 s.
                let known = if start > 1e9 { 1e-6 / f64::from(n) } else { 0.0 };
                assert!((step_of(t) - step).abs() <= known, "{start} {step} {n}");
            }
        }
        // A step that is not a short decimal stays unchanged.
        let rate = |n: u32| step_of((0..n).map(|i| f64::from(i) / 48e3).collect());
        assert!((rate(4000) * 48e3 - 1.0).abs() < 1e-14, "{}", rate(4000));
        // Printed to 1e-6, a third of a millisecond is known to 1e-9.
        let printed = step_of((0..1000).map(|i| (f64::from(i) / 3e3 * 1e6).round() / 1e6).collect());
        assert!(
            (printed - 1.0 / 3e3).abs() < 1e-9 && printed.to_string().len() < 14,
            "{printed}"
        );
    }

    /// Instants late by a random share of a step, up to `jitter` to either side.
    fn jittered(jitter: f64) -> Record {
        let late = |i: usize| jitter * (0.7 * (i * i) as f64).sin();
        let t: Vec<f64> = (0..1000).map(|i| 0.01 * (i as f64 + late(i))).collect();
        Record::new([("t", t)]).unwrap()
    }

    #[test]
    fn a_clock_may_jitter_by_a_tenth_of_a_step() {
        let clock = jittered(0.05).sample_clock("t").unwrap();
        assert!((clock.step - 0.01).abs() < 2e-6, "{clock:?}");
        assert!((clock.jitter - 0.05).abs() < 1e-3, "{clock:?}");
        let drifting: Vec<f64> = (0..1000).map(|i| 0.01 * (i as f64 + 1e-5 * (i * i) as f64)).collect();
        for record in [jittered(0.12), Record::new([("t", drifting)]).unwrap()] {
            assert!(matches!(
                record.sample_clock("t"),
                Err(Error::Data(DataError::NonUniformTime { .. }))
            ));
        }
    }

    #[test]
    fn a_gap_in_time_is_located() {
        let r = Record::new([("t", vec![0.0, 0.1, 0.2, 0.4, 0.5])]).unwrap();
        assert!(matches!(
            r.sample_time("t"),
            Err(Error::Data(DataError::NonUniformTime { sample: 3, .. }))
        ));
        let backwards = Record::new([("t", vec![0.0, -0.1, -0.2])]).unwrap();
        assert!(backwards.sample_time("t").is_err());
    }
}
