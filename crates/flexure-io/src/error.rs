//! Errors of files; each names the file, the place and the remedy.
//!
//! File lines and columns are counted from 1, samples from 0.

use std::io;
use std::path::{Path, PathBuf};

use flexure::error::DataError;
use flexure::text::shown_path;

use crate::topic::Topic;

mod line;

pub use line::LineProblem;

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A computed record would take more memory than there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "{rows} rows of {columns} columns take {} of memory with what they are computed from, but half of the free memory is {}; compute fewer rows",
    crate::memory::size(*.bytes), crate::memory::size(*.limit)
)]
pub struct NoMemory {
    /// Its rows.
    pub rows: usize,
    /// Its columns.
    pub columns: usize,
    /// What they take, bytes.
    pub bytes: u64,
    /// The limit, bytes.
    pub limit: u64,
}

/// What was wrong with a file.
///
/// Every message is complete: it contains the message of its cause. The cause is a plain field and no [`std::error::Error::source`], so
/// that it is not printed twice.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read at all.
    #[error("cannot read {}: {}", shown_path(.path), reason(.cause))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// The file cannot be written; no part of it was left behind.
    #[error("cannot write {}: {}", shown_path(.path), reason(.cause))]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// A folder cannot be made.
    #[error("cannot make the folder {}: {}", shown_path(.path), reason(.cause))]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// A record was to be written under a name without the extension of a format.
    #[error("cannot write {}: a record's file name must end in .csv or .parquet", shown_path(.path))]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The record to be written cannot be represented in a file.
    #[error("cannot write {}: {problem}", shown_path(.path))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What is wrong with the record.
        problem: String,
    },
    /// The file, or what it declares or unpacks to, takes more memory than is allowed.
    #[error("{}: {what} takes more memory than the limit of {}{remedy}", shown_path(.path), crate::memory::size(*.limit))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What takes it.
        what: String,
        /// The limit, bytes.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// The file has no content.
    #[error("{} is empty; a record is a CSV file with a header, whitespace-separated columns, Parquet, MAT, HDF5 or a ROS 2 bag", shown_path(.path))]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file has no content after the lines that are skipped.
    #[error("{} has nothing after the {lines} lines that are skipped; skip fewer", shown_path(.path))]
    AllSkipped {
        /// The file.
        path: PathBuf,
        /// The lines that were to be skipped.
        lines: u64,
    },
    /// The file has columns but no sample.
    #[error("{} has the columns {} but no samples", shown_path(.path), flexure::text::list(names))]
    NoSamples {
        /// The file.
        path: PathBuf,
        /// The columns' names.
        names: Vec<String>,
    },
    /// No column has time stamps of the format that was given.
    #[error("{}: no column has time stamps like '{format}': {column}", shown_path(.path))]
    TimeFormat {
        /// The file.
        path: PathBuf,
        /// The format.
        format: String,
        /// The column that may have time stamps, and what it is.
        column: String,
    },
    /// A text file cannot be understood at one line.
    #[error("{}, line {line}: {problem}", shown_path(.path))]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong there.
        problem: LineProblem,
    },
    /// A binary file ends too early.
    #[error("{} is truncated: {detail}; copy or save it again", shown_path(.path))]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Where it ends and what is missing.
        detail: String,
    },
    /// A binary file contradicts its format or uses a part of it that is not supported.
    #[error("{} cannot be read as {format}: {detail}", shown_path(.path))]
    Content {
        /// The file.
        path: PathBuf,
        /// The format's name.
        format: &'static str,
        /// What is wrong and what to do.
        detail: String,
    },
    /// The part of a bag to be read is unclear, or missing.
    #[error("{}: {problem}; the topics are: {}", shown_path(.path), topic_list(topics))]
    Topics {
        /// The file.
        path: PathBuf,
        /// What is unclear and what to do.
        problem: String,
        /// Whether several topics could be read, and nothing else is wrong.
        choose: bool,
        /// All topics of the bag.
        topics: Vec<Topic>,
    },
    /// A topic or joint was chosen of a file that is no bag.
    #[error("{} is no ROS 2 bag; leave out --topic and --joint", shown_path(.path))]
    NoBag {
        /// The file.
        path: PathBuf,
    },
    /// A column exists in the file, but cannot serve as a signal.
    #[error("{}: '{name}' cannot serve as a signal: it is {what}", shown_path(.path))]
    NotASignal {
        /// The file.
        path: PathBuf,
        /// The column or variable.
        name: String,
        /// What it is instead, and what to do.
        what: String,
    },
    /// The column of sample instants is unclear, or its unit is.
    #[error("{}: {problem}", shown_path(.path))]
    Time {
        /// The file.
        path: PathBuf,
        /// What is unclear and what to do.
        problem: String,
    },
    /// The file was read, but its samples do not serve the purpose.
    #[error("{}{}: {}", shown_path(.path), line_suffix(*.line), missing_samples(.cause))]
    Data {
        /// The file.
        path: PathBuf,
        /// The line of the offending sample, from 1, for text files.
        line: Option<u64>,
        /// What is wrong with the samples.
        cause: Box<flexure::Error>,
    },
    /// A JSON file cannot be understood.
    #[error("{}, line {line}, column {column}: {problem}; models are written by `flexure identify -o`", shown_path(.path))]
    Json {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The column, from 1 (0: before the first character of the line).
        column: usize,
        /// What is wrong there.
        problem: String,
    },
    /// A URDF does not describe a chain.
    #[error("{}, line {line}: {problem}", shown_path(.path))]
    Urdf {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u32,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A JSON file is no model, or a model this version does not know.
    #[error("{}: {problem}", shown_path(.path))]
    Model {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
}

impl Error {
    pub(crate) fn read(path: &Path, cause: io::Error) -> Self {
        let path = path.to_owned();
        match cause.kind() {
            // The packed data end early.
            io::ErrorKind::UnexpectedEof => Error::Truncated {
                path,
                detail: cause.to_string(),
            },
            _ => Error::Read { path, cause },
        }
    }

    pub(crate) fn write(path: &Path, cause: io::Error) -> Self {
        Error::Write {
            path: path.to_owned(),
            cause,
        }
    }

    pub(crate) fn content(path: &Path, format: &'static str, detail: String) -> Self {
        Error::Content {
            path: path.to_owned(),
            format,
            detail,
        }
    }

    /// Samples that cannot be used, on an unknown line.
    pub(crate) fn data(path: &Path, cause: flexure::Error) -> Self {
        Error::Data {
            path: path.to_owned(),
            line: None,
            cause: Box::new(cause),
        }
    }
}

/// The topics of a bag, one behind the other.
fn topic_list(topics: &[Topic]) -> String {
    match topics {
        [] => "none".to_owned(),
        topics => topics.iter().map(Topic::to_string).collect::<Vec<_>>().join("; "),
    }
}

/// The operating system's error, in plain English if it is a common one.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or directory".to_owned(),
        io::ErrorKind::AlreadyExists => "there is a file of this name".to_owned(),
        io::ErrorKind::IsADirectory => "it is a directory, not a file".to_owned(),
        io::ErrorKind::NotADirectory => "a part of its path is not a directory".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::StorageFull => "the disk is full".to_owned(),
        io::ErrorKind::InvalidData => "it is not text in UTF-8".to_owned(),
        _ => error.to_string(),
    }
}

fn line_suffix(line: Option<u64>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line}"))
}

/// The library's message; a NaN of a file may also mean a missing sample.
fn missing_samples(error: &flexure::Error) -> String {
    match error {
        flexure::Error::Data(DataError::NonFinite { column, sample, value }) if value.is_nan() => {
            format!("column '{column}' is NaN or missing at sample {sample}; remove or repair that sample")
        }
        other => other.to_string(),
    }
}
