//! What has to be known of a record in parts before anything is fitted to it.

use std::path::Path;

use anyhow::Result;
use flexure::Record;
use flexure::error::DataError;
use flexure::simulation::batch;
use flexure::text::shown_path;
use flexure_io::{ColumnChecksum, ParquetParts, RecordMark};

/// The relative difference of two sample times that still count as the same.
const SAME_STEP: f64 = 1e-3;
/// The share of a step by which the step from one part to the next may differ. It is that of instants within a part.
const GAP: f64 = 0.5;

/// A row and its input.
#[derive(Clone, Copy)]
struct Extreme {
    row: u64,
    value: f64,
}

/// The sample instants of consecutive rows.
#[derive(Clone, Copy)]
struct Instants {
    first: f64,
    last: f64,
    step: f64,
}

/// Some consecutive rows.
struct Part {
    end: u64,
    lowest: Extreme,
    highest: Extreme,
    checksums: [ColumnChecksum; 2],
    instants: Option<Instants>,
}

/// A record of an input and an output, which are finite, at uniform instants if these are known.
pub struct Survey {
    /// The mark of the whole record.
    pub mark: RecordMark,
    /// The rows of the least and the greatest input.
    pub extremes: [u64; 2],
}

impl Survey {
    /// Reads all parts, whose columns are the input, the output and, if there is one, that of the sample instants.
    ///
    /// # Errors
    /// As [`ParquetParts::read`]; [`flexure_io::Error::Data`] with the row of the first sample that is not finite, and of the first
    /// instant that is not on a uniform grid.
    pub fn new(parts: &ParquetParts, names: &[&str], path: &Path) -> Result<Survey> {
        let all: Vec<usize> = (0..parts.count()).collect();
        let mut found: Option<Part> = None;
        for part in batch(&all, |part| surveyed(parts, *part, names)) {
            let Some(part) = part? else { continue };
            found = Some(match found {
                None => part,
                Some(before) => before.followed_by(part).map_err(|error| parts.locate(error))?,
            });
        }
        let Some(whole) = found else {
            anyhow::bail!("{}: it has no rows", shown_path(path));
        };
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        Ok(Survey {
            mark: RecordMark::of_columns(&name, whole.end as usize, &whole.checksums),
            extremes: [whole.lowest.row, whole.highest.row],
        })
    }
}

/// A part; `None` if it is empty.
fn surveyed(parts: &ParquetParts, part: usize, names: &[&str]) -> flexure_io::Result<Option<Part>> {
    let mut found: Option<Part> = None;
    parts.read(part, &mut |row, columns| {
        let rows = Part::new(row, columns, names).and_then(|rows| match found.take() {
            None => Ok(rows),
            Some(before) => before.followed_by(rows),
        });
        found = Some(rows.map_err(|error| parts.locate(error))?);
        Ok(())
    })?;
    Ok(found)
}

impl Part {
    fn new(row: u64, columns: &[Vec<f64>], names: &[&str]) -> flexure::Result<Part> {
        for (name, samples) in names.iter().zip(columns) {
            if let Some(i) = samples.iter().position(|v| !v.is_finite()) {
                return Err(flexure::Error::Data(DataError::NonFinite {
                    column: (*name).to_owned(),
                    sample: row as usize + i,
                    value: samples[i],
                }));
            }
        }
        let mut checksums = [ColumnChecksum::default(), ColumnChecksum::default()];
        for (checksum, samples) in checksums.iter_mut().zip(columns) {
            checksum.push(samples);
        }
        let u = &columns[0];
        let extreme = |i: usize| Extreme {
            row: row + i as u64,
            value: u[i],
        };
        let (mut lowest, mut highest) = (0, 0);
        for (i, value) in u.iter().enumerate() {
            if *value < u[lowest] {
                lowest = i;
            }
            if *value > u[highest] {
                highest = i;
            }
        }
        let instants = columns.get(2).map(|t| Instants::new(row, t, names[2])).transpose()?;
        Ok(Part {
            end: row + u.len() as u64,
            lowest: extreme(lowest),
            highest: extreme(highest),
            checksums,
            instants: instants.flatten(),
        })
    }

    /// These rows and those that follow.
    fn followed_by(mut self, next: Part) -> flexure::Result<Part> {
        if let (Some(own), Some(others)) = (&self.instants, &next.instants) {
            own.check_next(others, self.end as usize)?;
        }
        for (own, others) in self.checksums.iter_mut().zip(&next.checksums) {
            own.append(others);
        }
        let instants = match (self.instants, next.instants) {
            (Some(own), Some(others)) => Some(Instants {
                last: others.last,
                ..own
            }),
            (own, others) => own.or(others),
        };
        let lower = |a: Extreme, b: Extreme| if b.value < a.value { b } else { a };
        let higher = |a: Extreme, b: Extreme| if b.value > a.value { b } else { a };
        Ok(Part {
            end: next.end,
            lowest: lower(self.lowest, next.lowest),
            highest: higher(self.highest, next.highest),
            checksums: self.checksums,
            instants,
        })
    }
}

impl Instants {
    /// The instants of the rows from `row` on; `None` for a single one.
    fn new(row: u64, t: &[f64], name: &str) -> flexure::Result<Option<Instants>> {
        let [first, .., last] = *t else {
            return Ok(None);
        };
        let clock = Record::new([(name, t.to_vec())])?.sample_clock(name);
        let step = clock.map_err(|error| moved(error, row as usize))?.step;
        Ok(Some(Instants { first, last, step }))
    }

    /// Refuses instants of the rows from `row` on that do not continue the grid.
    fn check_next(&self, next: &Instants, row: usize) -> flexure::Result<()> {
        let step = next.first - self.last;
        let not_uniform = |step: f64| {
            let expected = self.step;
            let (sample, step) = (row, step);
            flexure::Error::Data(DataError::NonUniformTime { sample, step, expected })
        };
        if !(step > 0.0) {
            return Err(flexure::Error::Data(DataError::TimeNotIncreasing { sample: row, step }));
        }
        if !((step - self.step).abs() <= GAP * self.step) {
            return Err(not_uniform(step));
        }
        if !((next.step - self.step).abs() <= SAME_STEP * self.step) {
            return Err(not_uniform(next.step));
        }
        Ok(())
    }
}

/// The error about a sample, counted from the record's beginning.
fn moved(error: flexure::Error, by: usize) -> flexure::Error {
    match error {
        flexure::Error::Data(DataError::NonUniformTime { sample, step, expected }) => DataError::NonUniformTime {
            sample: sample + by,
            step,
            expected,
        }
        .into(),
        flexure::Error::Data(DataError::TimeNotIncreasing { sample, step }) => DataError::TimeNotIncreasing {
            sample: sample + by,
            step,
        }
        .into(),
        other => other,
    }
}
