//! A record with its file, so that every error can name the place.

use std::path::{Path, PathBuf};

use flexure::Record;
use flexure::record::check_values;
use flexure::text::shown_path;

use crate::error::{Error, LineProblem, Result};

/// A variable or column that is in the file but is no signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Other {
    pub(crate) name: String,
    pub(crate) why: Unusable,
}

/// Why a column cannot serve as a signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Unusable {
    /// What it is; it completes the sentence "it is ...".
    Is(String),
    /// Dates of which the month or the day may come first.
    Dates(UnsettledDates),
    /// What is wrong on one line of a text file.
    At { line: u64, problem: LineProblem },
}

/// A column of dates with the month or the day first, both of which fit all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct UnsettledDates {
    /// The column.
    pub column: String,
    /// The first date, as it is written.
    pub text: String,
    /// Its line.
    pub line: u64,
    /// The formats with the month and with the day first.
    pub formats: [String; 2],
}

impl UnsettledDates {
    /// What the column is; it completes the sentence "it is ...".
    fn what(&self) -> String {
        let UnsettledDates {
            text, line, formats, ..
        } = self;
        format!(
            "text, such as '{text}' on line {line}, which may begin with the month or the day; say --time-format \"{}\" or \"{}\"",
            formats[0], formats[1]
        )
    }
}

impl std::fmt::Display for UnsettledDates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let UnsettledDates {
            column,
            text,
            line,
            formats: [month, day],
        } = self;
        write!(
            f,
            "column '{column}' has dates that may begin with the day or the month, such as '{text}' on line {line}: say --time-format \"{day}\" if \
             it is the day, --time-format \"{month}\" if it is the month"
        )
    }
}

impl std::fmt::Display for Other {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.why {
            Unusable::Is(what) => write!(f, "'{}' is {what}", self.name),
            Unusable::Dates(dates) => write!(f, "'{}' is {}", self.name, dates.what()),
            Unusable::At { line, problem } => write!(f, "line {line}: {problem}"),
        }
    }
}

impl Other {
    pub(crate) fn new(name: String, what: String) -> Self {
        Other {
            name,
            why: Unusable::Is(what),
        }
    }

    /// Whether the column has no numbers at all, in contrast to numbers with a flaw.
    pub(crate) fn is_text(&self) -> bool {
        matches!(self.why, Unusable::Is(_) | Unusable::Dates(_))
    }

    /// The error when the column is used as a signal.
    pub(crate) fn error(&self, path: &Path) -> Error {
        let path = path.to_owned();
        let no_signal = |what: String| Error::NotASignal {
            path: path.clone(),
            name: self.name.clone(),
            what,
        };
        match &self.why {
            Unusable::Is(what) => no_signal(what.clone()),
            Unusable::Dates(dates) => no_signal(dates.what()),
            Unusable::At { line, problem } => Error::Line {
                path: path.clone(),
                line: *line,
                problem: problem.clone(),
            },
        }
    }

    fn unsettled(&self) -> Option<&UnsettledDates> {
        match &self.why {
            Unusable::Dates(dates) => Some(dates),
            _ => None,
        }
    }
}

/// The line of a text file from which each sample comes.
///
/// Only the samples at which the distance between sample and line changes are kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct SampleLines {
    distances: Vec<(usize, u64)>,
    /// The number of samples if they come from the last line to the first.
    reversed: Option<usize>,
}

impl SampleLines {
    /// Notes that `sample` comes from `line`; samples come in order.
    pub(crate) fn note(&mut self, sample: usize, line: u64) {
        if self.get(sample) != Some(line) {
            self.distances.push((sample, line));
        }
    }

    pub(crate) fn get(&self, sample: usize) -> Option<u64> {
        let sample = match self.reversed {
            Some(samples) => samples.checked_sub(sample + 1)?,
            None => sample,
        };
        let after = self.distances.partition_point(|&(first, _)| first <= sample);
        let (first, line) = *self.distances.get(after.checked_sub(1)?)?;
        Some(line + (sample - first) as u64)
    }

    /// The lines of as many samples in the opposite order.
    pub(crate) fn reverse(&mut self, samples: usize) {
        self.reversed = Some(samples);
    }
}

/// A record, and where its samples come from.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordFile {
    /// The signals. Missing samples are NaN.
    pub record: Record,
    /// The signals' units, where the file has them: one for each column of the record.
    pub units: Vec<Option<String>>,
    /// The file.
    pub path: PathBuf,
    /// Sentences on how the file was understood, if that is not obvious: a decimal comma, a missing header.
    pub notes: Vec<String>,
    /// The scalars of a MAT file, in order; empty for all other formats.
    pub constants: Vec<(String, f64)>,
    /// The origins of time columns stamps, in ns.
    pub(crate) origins: Vec<(String, i64)>,
    pub(crate) others: Vec<Other>,
    /// The texts among the numbers of columns that are therefore no signals.
    pub(crate) texts: Vec<String>,
    /// A column of dates that was joined with one of times of day, and the name of the latter.
    pub(crate) dates: Option<(String, String)>,
    /// Whether messages must not quote the content of the file.
    pub(crate) is_foreign: bool,
    /// Whether the file has no names of columns.
    pub(crate) is_nameless: bool,
    pub(crate) lines: SampleLines,
}

impl RecordFile {
    /// A record that came from no file; `name` stands for one in messages and on pages.
    pub fn in_memory(record: Record, name: &str) -> Self {
        RecordFile::new(record, Path::new(name))
    }

    /// A record of signals without other columns and without line numbers.
    pub(crate) fn new(record: Record, path: &Path) -> Self {
        RecordFile {
            units: vec![None; record.names().len()],
            record,
            path: path.to_owned(),
            notes: Vec::new(),
            constants: Vec::new(),
            origins: Vec::new(),
            others: Vec::new(),
            texts: Vec::new(),
            dates: None,
            is_foreign: false,
            is_nameless: false,
            lines: SampleLines::default(),
        }
    }

    /// The same file with other samples, and a unit for each of their columns; columns of instants keep their names. The new samples have
    /// no lines.
    pub fn with_record(&self, record: Record, units: Vec<Option<String>>) -> Self {
        RecordFile {
            constants: self.constants.clone(),
            origins: self.origins.clone(),
            is_foreign: self.is_foreign,
            others: self
                .others
                .iter()
                .filter(|other| other.unsettled().is_some())
                .cloned()
                .collect(),
            units,
            ..RecordFile::new(record, &self.path)
        }
    }

    /// The file's name without its folder, as a part of a line.
    pub fn name(&self) -> String {
        let name = self.path.file_name();
        name.map(|name| shown_path(name.as_ref())).unwrap_or_default()
    }

    /// The samples of one column, as they are; `name` may include the unit from the header, as in `u [V]`.
    ///
    /// # Errors
    /// [`Error::Data`] if there is no such column, [`Error::NotASignal`] if there is one that is
    /// not a sequence of real numbers.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        self.signal(name, Record::column)
    }

    /// Sentences on columns of numbers that one bad field makes unusable, with that field.
    pub fn flawed(&self) -> impl Iterator<Item = String> {
        let flawed = self.others.iter().filter(|other| !other.is_text());
        flawed.map(|other| format!("{other}; the column is left out"))
    }

    /// Dates that would be the instants, if it was clear whether the month or the day comes first.
    pub fn unsettled_dates(&self) -> Option<&UnsettledDates> {
        self.others.iter().find_map(Other::unsettled)
    }

    /// Whether the file is a text, whose samples have lines.
    pub fn is_text(&self) -> bool {
        self.line(0).is_some()
    }

    /// The few texts among numbers that make columns unusable, and may stand for missing samples:
    /// [`ReadOptions::missing_texts`](crate::ReadOptions::missing_texts).
    pub fn unread_texts(&self) -> &[String] {
        &self.texts
    }

    /// Whether the file has a column or variable of this name, be it a signal or not.
    pub fn has(&self, name: &str) -> bool {
        let name = self.meant(name);
        self.record
            .names()
            .iter()
            .chain(self.others.iter().map(|o| &o.name))
            .any(|own| own == name)
    }

    /// The samples of one column, all of them finite.
    ///
    /// # Errors
    /// As [`RecordFile::column`], and [`Error::Data`] with the line of the first sample that is
    /// missing, NaN or infinite, or where the values are too large or too small for any computation.
    pub fn finite(&self, name: &str) -> Result<&[f64]> {
        self.signal(name, |record, name| {
            let samples = record.finite(name)?;
            check_values(name, samples).map(|_| samples)
        })
    }

    /// The sample time in s, from a column of uniform, increasing instants.
    ///
    /// # Errors
    /// As [`RecordFile::finite`], and [`Error::Data`] with the line of the first step that differs.
    pub fn sample_time(&self, time: &str) -> Result<f64> {
        self.signal(time, Record::sample_time)
    }

    /// The line of the file that `sample` comes from, from 1; `None` for binary formats.
    pub fn line(&self, sample: usize) -> Option<u64> {
        if sample < self.record.len() {
            self.lines.get(sample)
        } else {
            None
        }
    }

    /// Adds the file, and the line if it is known, to `error`.
    ///
    /// `error` must come from this file's whole record: its samples count from the record's first.
    pub fn locate(&self, error: flexure::Error) -> Error {
        let sample = match &error {
            flexure::Error::Data(data) => data.sample(),
            _ => None,
        };
        Error::Data {
            path: self.path.clone(),
            line: sample.and_then(|sample| self.line(sample)),
            cause: Box::new(error),
        }
    }

    pub(crate) fn signal<'a, T>(
        &'a self,
        name: &str,
        get: impl Fn(&'a Record, &str) -> flexure::Result<T>,
    ) -> Result<T> {
        if let Some(other) = self.others.iter().find(|other| other.name == name) {
            return Err(other.error(&self.path));
        }
        get(&self.record, self.meant(name)).map_err(|error| self.locate(error))
    }
}
