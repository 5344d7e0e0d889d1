//! What may be wrong with one line of a text file.

use flexure::text::counted;

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
    /// A number has another unit than those above.
    #[error(
        "column '{column}' holds '{text}' at sample {sample}, but the numbers above are in {unit}: write all of them in one unit"
    )]
    OtherUnit {
        /// The column's name.
        column: String,
        /// The sample, from 0.
        sample: usize,
        /// The field's text, shortened to 40 characters.
        text: String,
        /// The unit of the numbers above.
        unit: String,
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
