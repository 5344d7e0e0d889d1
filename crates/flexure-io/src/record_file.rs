//! A record with the file it came from, so that every complaint can say where.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flexure::Record;

use crate::error::{Error, Result};
use crate::{mat, parquet_file, text};

/// The longest beginning of a file that tells its format: HDF5's signature may stand at byte 512.
const SIGNATURE_LENGTH: u64 = 520;

/// The first eight bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// How a record was stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text with a header.
    Delimited {
        /// The character between two fields: `,`, `;` or a tab.
        separator: char,
    },
    /// Text without a header, columns separated by spaces or tabs and named c0, c1, ...
    Whitespace,
    /// Apache Parquet.
    Parquet,
    /// MATLAB's MAT-file of level 5 (`-v6`, `-v7`).
    Mat,
    /// No file: made in memory.
    Memory,
}

/// A variable or column that is in the file but is no signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Other {
    pub(crate) name: String,
    /// What it is, completing the sentence "it is ...".
    pub(crate) what: String,
}

/// From which line of a text file each sample comes.
///
/// Only the samples at which the distance between sample and line changes are kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Lines(Vec<(usize, u64)>);

impl Lines {
    /// Notes that `sample` comes from `line`; samples come in order.
    pub(crate) fn note(&mut self, sample: usize, line: u64) {
        if self.get(sample) != Some(line) {
            self.0.push((sample, line));
        }
    }

    pub(crate) fn get(&self, sample: usize) -> Option<u64> {
        let after = self.0.partition_point(|&(first, _)| first <= sample);
        let (first, line) = *self.0.get(after.checked_sub(1)?)?;
        Some(line + (sample - first) as u64)
    }
}

/// A record, and where its samples come from.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordFile {
    /// The signals. Missing samples are NaN.
    pub record: Record,
    /// The file.
    pub path: PathBuf,
    /// How it was stored.
    pub format: Format,
    /// The scalars of a MAT file, in order; empty for all other formats.
    pub constants: Vec<(String, f64)>,
    pub(crate) others: Vec<Other>,
    pub(crate) lines: Lines,
}

impl RecordFile {
    /// A record that came from no file; `name` stands for one in messages and on pages.
    pub fn in_memory(record: Record, name: &str) -> Self {
        RecordFile {
            record,
            path: PathBuf::from(name),
            format: Format::Memory,
            constants: Vec::new(),
            others: Vec::new(),
            lines: Lines::default(),
        }
    }

    /// The samples of one column, as they are.
    ///
    /// # Errors
    /// [`Error::Data`] if there is no such column, [`Error::NotASignal`] if there is one that is
    /// not a sequence of real numbers.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        self.signal(name, Record::column)
    }

    /// The samples of one column, all of them finite.
    ///
    /// # Errors
    /// As [`RecordFile::column`], and [`Error::Data`] with the line of the first sample that is
    /// missing, NaN or infinite.
    pub fn finite(&self, name: &str) -> Result<&[f64]> {
        self.signal(name, Record::finite)
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

    /// Says in which file, and where known on which line, `error` lies.
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

    fn signal<'a, T>(&'a self, name: &str, get: impl Fn(&'a Record, &str) -> flexure::Result<T>) -> Result<T> {
        if let Some(other) = self.others.iter().find(|other| other.name == name) {
            return Err(Error::NotASignal {
                path: self.path.clone(),
                name: other.name.clone(),
                what: other.what.clone(),
            });
        }
        get(&self.record, name).map_err(|error| self.locate(error))
    }
}

/// Reads a record: CSV with a header, whitespace-separated columns without one, Parquet or MAT v5.
///
/// The format comes from the first bytes of the file; where these tell nothing, `.parquet` and `.mat`
/// are taken at their word, and everything else is text. Nothing is guessed in text:
///
/// - The first line that is neither blank nor a comment (`#`) decides. Numbers with whitespace
///   between them are columns without a header, named `c0`, `c1`, ...; a file called `.csv` or
///   `.tsv` must have a header, though.
/// - Otherwise that line is the header. The separator is the comma or the semicolon, whichever the
///   header has (not both), else the tab; a name on its own is a file of one column. Names may be quoted.
/// - An empty field is a missing sample, which is NaN; so is `nan`. Blank lines may only come last.
///
/// A null of a Parquet file is NaN too. The scalars of a MAT file are kept apart as
/// [`RecordFile::constants`]; its vectors, rows or columns alike, must have equal lengths.
///
/// # Errors
/// Says what is wrong, in which file, and where: see [`Error`].
pub fn read_record(path: impl AsRef<Path>) -> Result<RecordFile> {
    let path = path.as_ref();
    let fail = |source| Error::read(path, source);
    let mut file = File::open(path).map_err(fail)?;
    if file.metadata().map_err(fail)?.is_dir() {
        return Err(fail(std::io::ErrorKind::IsADirectory.into()));
    }
    let mut start = Vec::new();
    file.by_ref()
        .take(SIGNATURE_LENGTH)
        .read_to_end(&mut start)
        .map_err(fail)?;
    if start.is_empty() {
        return Err(Error::Empty { path: path.to_owned() });
    }
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let extension = extension.as_deref().unwrap_or("");
    if start.starts_with(b"PAR1") || start.starts_with(b"PARE") || extension == "parquet" {
        return parquet_file::read(path, file);
    }
    if start.starts_with(HDF5) || start.get(512..).is_some_and(|rest| rest.starts_with(HDF5)) {
        return Err(Error::Content {
            path: path.to_owned(),
            format: "MAT v5",
            detail: "it is an HDF5 file, such as MATLAB writes with -v7.3; save it with -v7".to_owned(),
        });
    }
    file.seek(SeekFrom::Start(0)).map_err(fail)?;
    if start.starts_with(b"MATLAB 5.0 MAT-file") || extension == "mat" {
        return mat::read(path, file);
    }
    text::read(path, file, matches!(extension, "csv" | "tsv"))
}
