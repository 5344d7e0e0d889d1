//! Errors of files; each names the file, the place and the remedy.
//!
//! File lines and columns are counted from 1, samples from 0.

use std::io;
use std::path::{Path, PathBuf};

use flexure::error::DataError;
use flexure::text::{counted, shown_path};

use crate::topic::Topic;

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

/// What is wrong with one line of a text file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LineProblem {
    /// The line has more or fewer fields than there are columns.
    #[error(
        "{} where there {}; {}", counted(*.found, "field"), columns(*.expected), ragged_remedy([*.found, *.expected], *.table, *.commas)
    )]
    Ragged {
        /// Fields on this line.
        found: usize,
        /// Columns of the file.
        expected: usize,
        /// The line on which the table seems to begin, if other lines precede it.
        table: Option<u64>,
        /// Whether commas separate the columns.
        commas: bool,
    },
    /// A field is text where a number should be.
    #[error(
        "column '{column}' holds '{text}' at sample {sample}, which is not a number (numbers look like -1.5e-3; --missing-text '{text}' takes it for a missing sample; --time-format is for time stamps)"
    )]
    NotANumber {
        /// The column's name.
        column: String,
        /// The sample, from 0.
        sample: usize,
        /// The field's text, shortened to 40 characters.
        text: String,
    },
    /// A field lacks the name that the fields of its column begin with.
    #[error(
        "'{text}' does not begin with '{name}=', as this field does in the first row; correct the line, or remove it"
    )]
    NoName {
        /// The column's name.
        name: String,
        /// The field's text, shortened to 40 characters.
        text: String,
    },
    /// The first line has texts and numbers, and the columns below the texts have texts too.
    #[error(
        "this line has texts as well as the number {text}; say --header yes if it has the columns' names, --header no if it is the first sample"
    )]
    NumericHeader {
        /// The number.
        text: String,
    },
    /// The first line has the numbers 0, 1, 2, ...
    #[error(
        "this line has the numbers 0, 1, 2, ...; say --header yes if these are the columns' names, --header no if they are the first sample"
    )]
    CountedHeader,
    /// Two header fields are the same.
    #[error(
        "the header names both column {first} and column {second} '{name}'; column names must differ (or say --header no --skip-lines 1: the columns are then called c0, c1, ...)"
    )]
    DuplicateName {
        /// The name.
        name: String,
        /// The first column of that name, from 1.
        first: usize,
        /// The second column of that name, from 1.
        second: usize,
    },
    /// Two separators divide the lines equally well.
    #[error("what separates the columns is unclear; say --separator comma, semicolon, tab, pipe or space")]
    MixedSeparators,
    /// Some numbers have decimal points, others decimal commas.
    #[error(
        "a number has a decimal point on line {point} and a decimal comma on line {comma}; say --decimal point or --decimal comma: the other sign then groups thousands"
    )]
    BothDecimals {
        /// The first line with a decimal point.
        point: u64,
        /// The first line with a comma in a number.
        comma: u64,
    },
    /// Every comma in a number may group thousands.
    #[error(
        "a comma in a number may be a decimal comma or group thousands; say --decimal comma (1,250 is 1.25) or --decimal point (1,250 is 1250)"
    )]
    AmbiguousComma,
    /// A quotation mark is never closed.
    #[error("a quotation mark is not closed on this line, or text follows where it is closed")]
    UnclosedQuote,
    /// A blank line has data after it.
    #[error("this line is blank but data follow it; remove it, or write nan for a missing sample")]
    Blank,
    /// The file is a model.
    #[error("this is a model, not a record; a command takes models first, then the record")]
    Model,
    /// The file is JSON.
    #[error("this is JSON, not a table; write it as CSV, one row a sample (pandas: read_json and to_csv)")]
    Json,
    /// The line is longer than any table's.
    #[error("this line is longer than {}, which no table has; is it a text file?", crate::memory::size(*.limit))]
    TooLong {
        /// The longest line that is read, bytes.
        limit: u64,
    },
    /// Too many lines without content follow each other.
    #[error("more than {limit} lines without numbers follow each other; is it a table?")]
    WithoutEnd {
        /// The most that are passed over.
        limit: u64,
    },
    /// The line contains a bare carriage return.
    #[error("there is a carriage return within the line; end the lines with line feeds")]
    CarriageReturn,
    /// The file is packed.
    #[error("the file is packed, as a workbook (.xlsx) is; save its sheet as CSV")]
    Packed,
    /// The file is a workbook before 2007.
    #[error("the file is an old workbook (.xls) or document; save its sheet as CSV")]
    OldWorkbook,
    /// The file is no text.
    #[error("the file is no text, or its encoding is not known; save it as CSV in UTF-8")]
    NotText,
    /// The text is marked as UTF-16, and is none.
    #[error("the text is marked as UTF-16, but is not; save it in UTF-8")]
    NotUtf16,
}

impl LineProblem {
    /// With the line on which the table seems to begin.
    pub(crate) fn before_table(mut self, begins: Option<u64>) -> Self {
        if let LineProblem::Ragged { table, .. } = &mut self {
            *table = begins;
        }
        self
    }
}

/// How many columns there are, as the end of a sentence.
fn columns(count: usize) -> String {
    let verb = if count == 1 { "is" } else { "are" };
    format!("{verb} {}", counted(count, "column"))
}

/// What to do about a line with more or fewer fields than columns.
fn ragged_remedy([found, expected]: [usize; 2], table: Option<u64>, commas: bool) -> String {
    match table {
        _ if commas && expected > 1 && found == 2 * expected => "that is twice as many. If the numbers have decimal commas, commas cannot also separate the columns: write decimal points, or semicolons between the columns".to_owned(),
        Some(line) => format!("if the table begins on line {line}, say --skip-lines {}", line - 1),
        None => "every line must have one field a column: remove it if it is no sample (--skip-lines N leaves out N lines before the table, --separator says what separates the columns)".to_owned(),
    }
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
