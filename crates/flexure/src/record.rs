//! A record: named, sampled signals of equal length, one sample an instant.

use crate::error::{DataError, Error, Result};
use crate::sort;

/// Relative deviation of a time step from the median step that still counts as uniform.
///
/// Loggers print times with a few digits; a step that is off by less than this is rounding, not jitter.
const UNIFORM_TOLERANCE: f64 = 1e-3;

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
        for (name, samples) in columns {
            record.push(name, samples)?;
        }
        Ok(record)
    }

    /// A record of columns that are known to differ in name and agree in length.
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
        if let Some(first) = self.columns.first()
            && first.len() != samples.len()
        {
            return Err(Error::length(name, samples.len(), first.len()));
        }
        self.names.push(name);
        self.columns.push(samples);
        Ok(())
    }

    /// The number of samples a column.
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

    /// The samples of one column, as they are.
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

    /// The sample time in s, from a column of sample instants that must be uniform and increasing.
    ///
    /// The result is the mean step; single steps may deviate by 0.1 % of it (printed digits).
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `TooShort` (fewer than two samples),
    /// `TimeNotIncreasing` and `NonUniformTime`.
    pub fn sample_time(&self, time: &str) -> Result<f64> {
        uniform_step(self.finite(time)?)
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

/// The sizes of a column's largest value whose squares, and whose differences' squares, neither overflow nor vanish.
pub const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// The largest absolute value of a column, if all are finite and their squares neither overflow nor vanish.
pub(crate) fn check_values(column: &str, values: &[f64]) -> Result<f64> {
    if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
        return Err(Error::not_finite(column, sample, values[sample]));
    }
    let largest = values.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    if largest == 0.0 || SIZES.contains(&largest) {
        return Ok(largest);
    }
    let column = column.to_owned();
    Err(Error::Data(DataError::Unit { column, largest }))
}

/// The mean step of uniform, increasing instants `t`.
fn uniform_step(t: &[f64]) -> Result<f64> {
    if t.len() < 2 {
        return Err(Error::too_short("a sample time", 2, t.len()));
    }
    let median = sort::median(t.windows(2).map(|w| w[1] - w[0]).collect());
    // A step may also be off by the rounding of the instants themselves.
    let rounding = 4.0 * f64::EPSILON * t.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let tolerance = UNIFORM_TOLERANCE * median.abs() + rounding;
    for (i, w) in t.windows(2).enumerate() {
        let step = w[1] - w[0];
        if !(step > 0.0) {
            return Err(Error::Data(DataError::TimeNotIncreasing { sample: i + 1, step }));
        }
        if !((step - median).abs() <= tolerance) {
            return Err(Error::Data(DataError::NonUniformTime {
                sample: i + 1,
                step,
                expected: median,
            }));
        }
    }
    Ok((t[t.len() - 1] - t[0]) / (t.len() - 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record::new([("t", vec![0.0, 0.1, 0.2]), ("u", vec![1.0, f64::NAN, 2.0])]).unwrap()
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
