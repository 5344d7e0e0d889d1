//! Several experiments of one system: their records, one after the other.

use std::path::PathBuf;

use anyhow::{Result, bail};
use flexure::Record;
use flexure::text::{exact, shown_path};
use flexure_io::RecordFile;
use flexure_workbench::systems::{Task, check};

use crate::arguments::Usage;
use crate::columns::Connected;
use crate::reading::SAME_SAMPLE_TIME;
use crate::source::Source;

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
    /// The `first` record, and those at the paths `others`: from each, the `connected` columns; and their sample time.
    ///
    /// # Errors
    /// Names the record, the column and the line.
    pub fn read(
        source: &Source,
        first: RecordFile,
        others: &[PathBuf],
        connected: &Connected,
        sample_time: Option<f64>,
        may_miss: bool,
    ) -> Result<Self> {
        let all = connected.all();
        let mut columns = vec![Vec::new(); all.len()];
        let (mut samples, mut names) = (Vec::new(), Vec::new());
        let mut known: Option<(f64, String)> = None;
        let files = std::iter::once(Ok(first)).chain(others.iter().map(|path| source.reading.read(path)));
        for file in files {
            let file = source.prepared(file?, &connected.all(), &[&connected.output], None)?;
            check(&file, &connected.inputs(), &connected.output, may_miss)?;
            for (name, column) in all.iter().zip(&mut columns) {
                column.extend_from_slice(file.column(name)?);
            }
            samples.push(file.record.len());
            let path = shown_path(&file.path);
            match (source.reading.sample_time(&file, sample_time, &all)?, &known) {
                (Some(own), Some((first, of))) if (own - first).abs() > SAME_SAMPLE_TIME * first => bail!(
                    "{path}: the sample time is {} s, but that of {of} is {} s; experiments of one system need the same: resample one of them",
                    exact(own),
                    exact(*first)
                ),
                (Some(own), None) => known = Some((own, path.clone())),
                _ => {}
            }
            names.push(path);
        }
        let record = Record::new(all.into_iter().zip(columns))?;
        Ok(Experiments {
            file: RecordFile::in_memory(record, &names.join(", ")),
            samples,
            sample_time: known.map(|k| k.0),
        })
    }
}

/// Refuses several records for a task that takes only one.
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
