//! Several experiments of one system: their records, one after the other.

use std::path::PathBuf;

use anyhow::{Result, bail};
use flexure::Record;
use flexure_io::{RecordFile, read_record};
use flexure_workbench::systems::{Task, check};

use crate::arguments::{self, SAME_SAMPLE_TIME, Usage};

/// The records of experiments, as one.
pub struct Experiments {
    /// The input and the output of all of them, in order.
    pub file: RecordFile,
    /// The samples of each.
    pub samples: Vec<usize>,
    /// Their sample time in s, where it is known.
    pub sample_time: Option<f64>,
}

impl Experiments {
    /// Reads them: columns `input` and `output` of each, and their sample time.
    ///
    /// # Errors
    /// Names the record, the column and the line.
    pub fn read(
        paths: &[PathBuf],
        (input, output): (&str, &str),
        sample_time: Option<f64>,
        may_miss: bool,
    ) -> Result<Self> {
        let (mut u, mut y, mut samples) = (Vec::new(), Vec::new(), Vec::new());
        let mut known: Option<(f64, &PathBuf)> = None;
        for path in paths {
            let file = read_record(path)?;
            check(&file, &[input], output, may_miss)?;
            u.extend_from_slice(file.column(input)?);
            y.extend_from_slice(file.column(output)?);
            samples.push(file.record.len());
            match (arguments::sample_time(&file, sample_time, &[input, output])?, known) {
                (Some(own), Some((first, of))) if (own - first).abs() > SAME_SAMPLE_TIME * first => bail!(
                    "{}: the sample time is {own} s, but that of {} is {first} s; experiments of one system need the same: resample one of them",
                    path.display(),
                    of.display()
                ),
                (Some(own), None) => known = Some((own, path)),
                _ => {}
            }
        }
        let record = Record::new([(input.to_owned(), u), (output.to_owned(), y)])?;
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        Ok(Experiments {
            file: RecordFile::in_memory(record, &names.join(", ")),
            samples,
            sample_time: known.map(|k| k.0),
        })
    }
}

/// Refuses several records for what takes one.
pub fn refuse(records: usize, task: &Task, other: Option<&'static str>) -> Result<(), Usage> {
    match (records, task.takes_experiments(), other) {
        (..=1, ..) | (_, true, None) => Ok(()),
        (_, true, Some(option)) => Err(Usage(format!(
            "{option} is for one record, and {records} are named; name one, or leave the option out"
        ))),
        (_, false, _) => Err(Usage(format!(
            "{records} records are as many experiments of one system, which only --structure hammerstein by the refined method takes; name one \
             record"
        ))),
    }
}
