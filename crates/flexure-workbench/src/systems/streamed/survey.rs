//! What has to be known of a record in parts before anything is fitted to it.

use std::ops::Range;
use std::path::Path;

use anyhow::Result;
use flexure::Record;
use flexure::error::DataError;
use flexure::simulation::batch;
use flexure::text::shown_path;
use flexure_io::{ColumnChecksum, ParquetParts, RecordMark};

use crate::plots::median;

/// The share of a step by which all instants together may deviate from the uniform grid, to both sides. It is that of a record in memory.
const JITTER: f64 = 0.1;
/// The share of a step by which a single one may deviate from the typical one, as in a record in memory.
const GAP: f64 = 0.5;

/// A row and a value there.
#[derive(Clone, Copy)]
struct At {
    row: u64,
    value: f64,
}

/// Some consecutive rows.
struct Part {
    end: u64,
    /// Of the rows that are fitted.
    lowest: Option<At>,
    highest: Option<At>,
    checksums: [ColumnChecksum; 2],
    /// The first and the last instant of each batch of rows, in order.
    instants: Vec<At>,
}

/// A record of an input and an output, which are finite, at uniform instants if these are known.
pub struct Survey {
    /// The mark of the whole record.
    pub mark: RecordMark,
    /// The rows of the least and the greatest input that is fitted.
    pub extremes: Vec<u64>,
    /// The mean step of the instants, in their unit, if the record has some.
    pub step: Option<f64>,
}

impl Survey {
    /// Reads all rows in these ranges, which follow each other, so many `at_once`. The columns are the input, the output and, if there is
    /// one, that of the sample instants. The first `fitted` rows are those of the fit.
    ///
    /// # Errors
    /// As [`ParquetParts::read_rows`]; [`flexure_io::Error::Data`] with the row of the first sample that is not finite, and of the first
    /// instant that is not on a uniform grid.
    pub fn new(
        (parts, path): (&ParquetParts, &Path),
        names: &[&str],
        (ranges, at_once): (&[Range<u64>], usize),
        fitted: u64,
    ) -> Result<Survey> {
        let mut whole: Option<Part> = None;
        for some in ranges.chunks(at_once) {
            for part in batch(some, |rows| surveyed(parts, rows.clone(), names, fitted)) {
                Part::append(&mut whole, part?);
            }
        }
        let Some(whole) = whole else {
            anyhow::bail!("{}: it has no rows", shown_path(path));
        };
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        Ok(Survey {
            mark: RecordMark::of_columns(&name, whole.end as usize, &whole.checksums),
            extremes: [whole.lowest, whole.highest]
                .iter()
                .flatten()
                .map(|at| at.row)
                .collect(),
            step: uniform_step(&whole.instants).map_err(|error| parts.locate(error))?,
        })
    }
}

/// Some rows; `None` if there are none.
fn surveyed(parts: &ParquetParts, rows: Range<u64>, names: &[&str], fitted: u64) -> flexure_io::Result<Option<Part>> {
    let mut found: Option<Part> = None;
    parts.read_rows(rows, &mut |row, columns| {
        let part = Part::new(row, columns, names, fitted).map_err(|error| parts.locate(error))?;
        Part::append(&mut found, Some(part));
        Ok(())
    })?;
    Ok(found)
}

impl Part {
    fn new(row: u64, columns: &[Vec<f64>], names: &[&str], fitted: u64) -> flexure::Result<Part> {
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
        let of_fit = u.iter().take(fitted.saturating_sub(row).min(u.len() as u64) as usize);
        let (mut lowest, mut highest) = (None, None);
        for (row, value) in (row..).zip(of_fit.copied()) {
            let at = Some(At { row, value });
            (lowest, highest) = (lower(lowest, at), higher(highest, at));
        }
        let instants = match columns.get(2) {
            Some(t) => ends(row, t, names[2])?,
            None => Vec::new(),
        };
        Ok(Part {
            end: row + u.len() as u64,
            lowest,
            highest,
            checksums,
            instants,
        })
    }

    /// Adds the rows that follow.
    fn append(all: &mut Option<Part>, next: Option<Part>) {
        let (Some(own), Some(next)) = (all.as_mut(), &next) else {
            *all = all.take().or(next);
            return;
        };
        own.end = next.end;
        own.lowest = lower(own.lowest, next.lowest);
        own.highest = higher(own.highest, next.highest);
        for (own, others) in own.checksums.iter_mut().zip(&next.checksums) {
            own.append(others);
        }
        own.instants.extend_from_slice(&next.instants);
    }
}

fn lower(a: Option<At>, b: Option<At>) -> Option<At> {
    match (a, b) {
        (Some(own), Some(other)) if other.value < own.value => b,
        (Some(_), _) => a,
        (None, _) => b,
    }
}

fn higher(a: Option<At>, b: Option<At>) -> Option<At> {
    match (a, b) {
        (Some(own), Some(other)) if other.value > own.value => b,
        (Some(_), _) => a,
        (None, _) => b,
    }
}

/// The first and the last of the instants of consecutive rows, which are uniform.
fn ends(row: u64, t: &[f64], name: &str) -> flexure::Result<Vec<At>> {
    if t.len() > 1 {
        let clock = Record::new([(name, t.to_vec())])?.sample_clock(name);
        clock.map_err(|error| moved(error, row as usize))?;
    }
    let at = |i: usize| At {
        row: row + i as u64,
        value: t[i],
    };
    Ok((0..t.len()).step_by(t.len().saturating_sub(1).max(1)).map(at).collect())
}

/// The step of a uniform grid through instants of these rows; `None` without two of them.
fn uniform_step(instants: &[At]) -> flexure::Result<Option<f64>> {
    let (Some(first), Some(last)) = (instants.first(), instants.last()) else {
        return Ok(None);
    };
    if first.row == last.row {
        return Ok(None);
    }
    let step = |pair: &[At]| (pair[1].value - pair[0].value) / (pair[1].row - pair[0].row) as f64;
    let typical = median(instants.windows(2).map(step));
    // The steps from one batch to the next, and those within a batch of two samples.
    for pair in instants.windows(2).filter(|pair| pair[1].row == pair[0].row + 1) {
        let (sample, step, expected) = (pair[1].row as usize, step(pair), typical);
        if !(step > 0.0) {
            return Err(DataError::TimeNotIncreasing { sample, step }.into());
        }
        if !((step - expected).abs() <= GAP * expected) {
            return Err(DataError::NonUniformTime { sample, step, expected }.into());
        }
    }
    let expected = (last.value - first.value) / (last.row - first.row) as f64;
    let (mut earliest, mut latest) = (0.0_f64, 0.0_f64);
    for pair in instants.windows(2) {
        let late = (pair[1].value - first.value) / expected - (pair[1].row - first.row) as f64;
        (earliest, latest) = (earliest.min(late), latest.max(late));
        if !(latest - earliest <= 2.0 * JITTER) {
            let (sample, step) = (pair[1].row as usize, step(pair));
            return Err(DataError::NonUniformTime { sample, step, expected }.into());
        }
    }
    Ok(Some(expected))
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
