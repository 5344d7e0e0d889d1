//! Records as Apache Parquet, through the crate's column reader and writer (no Arrow).

mod parts;

use std::cell::Cell;
use std::io::{self, Write};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::{Arc, Once};
use std::thread;

use flexure::{Interrupt, Record};
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use crate::error::{Error, Result};
use crate::memory::Budget;
use crate::record_file::{Other, RecordFile};
use crate::text::left_out;
use crate::units::split_units;
pub use parts::{ParquetParts, TakeRows};

/// The four bytes a Parquet file begins and ends with.
const MAGIC: &[u8] = b"PAR1";
/// Samples read at a time.
const BATCH: usize = 1 << 16;
/// Rows written to one row group.
const ROW_GROUP: usize = 1 << 20;
/// The message for metadata that fail an assertion of the parquet crate (60.1), which then panics.
const CONTRADICTORY: &str = "its metadata contradict themselves; save it again";

/// Reads the Parquet record `file`.
pub(crate) fn read<F: ChunkReader + 'static>(budget: &Budget, path: &Path, file: F) -> Result<RecordFile> {
    check_ends(path, &file)?;
    quietly(AssertUnwindSafe(|| read_checked(budget, path, file))).unwrap_or_else(|_| Err(damaged(path, CONTRADICTORY)))
}

thread_local! {
    /// Whether a panic of this thread is caught and reported as an error.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Catches a panic of `work` without the panic hook's message: the caller reports it as an error.
///
/// The first call puts a filter before the process's panic hook; panics elsewhere pass through it.
pub(crate) fn quietly<T>(work: impl FnOnce() -> T + panic::UnwindSafe) -> thread::Result<T> {
    static FILTER: Once = Once::new();
    FILTER.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !CAUGHT.get() {
                previous(info);
            }
        }));
    });
    let before = CAUGHT.replace(true);
    let result = panic::catch_unwind(work);
    CAUGHT.set(before);
    result
}

/// Runs work within [`quietly`] whose panics are its own.
fn aloud<T>(work: impl FnOnce() -> T) -> thread::Result<T> {
    let before = CAUGHT.replace(false);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    CAUGHT.set(before);
    result
}

/// Reads a file that begins and ends as it should.
fn read_checked<F: ChunkReader + 'static>(budget: &Budget, path: &Path, file: F) -> Result<RecordFile> {
    let content = |error| content(path, error);
    let reader = SerializedFileReader::new(file).map_err(content)?;
    let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
    let schema = reader.metadata().file_metadata().schema_descr();
    let mut signals: Vec<(usize, Kind, Vec<f64>)> = Vec::new();
    let mut others: Vec<Other> = Vec::new();
    for (i, column) in schema.columns().iter().enumerate() {
        match Kind::of(column) {
            Ok(kind) => signals.push((i, kind, Vec::new())),
            Err(what) => others.push(Other::new(column.path().parts()[0].clone(), what)),
        }
    }
    let name = |i: usize| schema.column(i).name().to_owned();
    if rows == 0 {
        let names = signals.iter().map(|(i, ..)| name(*i)).collect();
        return Err(Error::NoSamples {
            path: path.to_owned(),
            names,
        });
    }
    let parts = (reader.num_row_groups() * signals.len()) as u64;
    let mut done = 0;
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(content)?;
        check_places(budget, path, &*group)?;
        let mut kept = Vec::with_capacity(signals.len());
        for (i, kind, mut samples) in signals {
            Interrupt::report(done, parts);
            done += 1;
            // A declared number is not trusted: memory is taken as samples come.
            let allowance = SampleBudget { budget, most: rows };
            let appended = append(&*group, i, kind, &mut samples, &allowance).map_err(content)?;
            match appended.checked(budget, path, &name(i), rows)? {
                None => kept.push((i, kind, samples)),
                Some(other) => others.push(other),
            }
        }
        signals = kept;
    }
    if let Some((i, _, samples)) = signals.iter().find(|(.., samples)| samples.len() != rows) {
        let (name, samples) = (name(*i), samples.len());
        let detail = format!("column '{name}' has {samples} of {rows} samples; save it again");
        return Err(damaged(path, detail));
    }
    let mut names: Vec<String> = signals.iter().map(|(i, ..)| name(*i)).collect();
    let units = split_units(&mut names);
    let columns = names.into_iter().zip(signals.into_iter().map(|(.., samples)| samples));
    let record = Record::new(columns).map_err(|error| damaged(path, error.to_string()))?;
    if record.names().is_empty() {
        let names: Vec<_> = others.iter().map(Other::to_string).collect();
        return Err(damaged(
            path,
            format!("it has no column of numbers: {}", names.join("; ")),
        ));
    }
    Ok(RecordFile {
        units,
        notes: left_out(&others, &[]).into_iter().collect(),
        others,
        ..RecordFile::new(record, path)
    })
}

impl Appended {
    /// Refuses a column that is too large. Returns what a column is instead, if it is no signal.
    fn checked(self, budget: &Budget, path: &Path, name: &str, rows: usize) -> Result<Option<Other>> {
        match self {
            Appended::All => Ok(None),
            Appended::TooLarge => Err(budget.too_large(&format!("column '{name}'"))),
            Appended::TooMany => {
                let detail = format!("column '{name}' has more than the {rows} samples declared; save it again");
                Err(damaged(path, detail))
            }
            // A column with integers that f64 cannot hold is no signal, but the other columns can be read.
            Appended::Inexact => {
                let what = "a column of integers beyond 2^53, which cannot be represented exactly";
                Ok(Some(Other::new(name.to_owned(), what.to_owned())))
            }
        }
    }
}

/// Refuses columns at impossible positions, and those that unpack to more than the memory holds.
fn check_places(budget: &Budget, path: &Path, group: &dyn RowGroupReader) -> Result<()> {
    for column in group.metadata().columns() {
        let unpacked = u64::try_from(column.uncompressed_size()).unwrap_or(0);
        budget.take(unpacked, "a column that is unpacked")?;
        budget.give_back(unpacked);
    }
    let mut columns = group.metadata().columns().iter();
    let outside = columns.any(|column| {
        let dictionary = column.dictionary_page_offset().unwrap_or(0);
        column.data_page_offset() < 0 || dictionary < 0 || column.compressed_size() < 0
    });
    match outside {
        true => Err(damaged(path, "a column lies outside of the file; save it again")),
        false => Ok(()),
    }
}

/// Refuses a file that does not begin and end as a Parquet file does.
fn check_ends(path: &Path, file: &impl ChunkReader) -> Result<()> {
    let mut ends = [[0; 4]; 2];
    let length = file.len();
    if length >= 12 {
        for (end, from) in ends.iter_mut().zip([0, length - 4]) {
            let bytes = file.get_bytes(from, 4).map_err(|error| content(path, error))?;
            end.copy_from_slice(&bytes);
        }
    }
    match ends {
        [first, last] if first == MAGIC && last == MAGIC => Ok(()),
        [first, last] if first == *b"PARE" || last == *b"PARE" => {
            Err(damaged(path, "it is encrypted; save it without encryption"))
        }
        [first, _] if first == MAGIC || length < 12 => Err(Error::Truncated {
            path: path.to_owned(),
            detail: format!("it ends after {length} bytes without Parquet's footer"),
        }),
        _ => Err(damaged(
            path,
            "it does not begin with PAR1; give it the extension of its true format",
        )),
    }
}

fn damaged(path: &Path, detail: impl Into<String>) -> Error {
    Error::content(path, "Parquet", detail.into())
}

fn content(path: &Path, error: ParquetError) -> Error {
    match error {
        ParquetError::EOF(detail) => Error::Truncated {
            path: path.to_owned(),
            detail,
        },
        other => damaged(
            path,
            format!("{other}; save it again, uncompressed or with Snappy or Zstandard"),
        ),
    }
}

/// The kinds of columns that are signals.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Bool,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float,
    Double,
}

impl Kind {
    /// The kind of a flat column of plain numbers, or what it is instead.
    fn of(column: &ColumnDescriptor) -> std::result::Result<Self, String> {
        if column.path().parts().len() != 1 || column.max_rep_level() != 0 || column.max_def_level() > 1 {
            return Err("a nested column; save each signal as a column of its own".to_owned());
        }
        let logical = column.logical_type_ref();
        let converted = column.converted_type();
        let unsigned = match (logical, converted) {
            (Some(LogicalType::Integer(integer)), _) => !integer.is_signed,
            (
                None,
                ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64,
            ) => true,
            (
                None,
                ConvertedType::NONE
                | ConvertedType::INT_8
                | ConvertedType::INT_16
                | ConvertedType::INT_32
                | ConvertedType::INT_64,
            ) => false,
            (Some(other), _) => return Err(format!("a column of type {other:?}; save it as floating-point numbers")),
            (None, other) => return Err(format!("a column of type {other}; save it as floating-point numbers")),
        };
        match (column.physical_type(), unsigned) {
            (Physical::BOOLEAN, _) => Ok(Kind::Bool),
            (Physical::INT32, false) => Ok(Kind::Int32),
            (Physical::INT32, true) => Ok(Kind::UInt32),
            (Physical::INT64, false) => Ok(Kind::Int64),
            (Physical::INT64, true) => Ok(Kind::UInt64),
            (Physical::FLOAT, _) => Ok(Kind::Float),
            (Physical::DOUBLE, _) => Ok(Kind::Double),
            (other, _) => Err(format!("a column of type {other}; save it as floating-point numbers")),
        }
    }
}

/// How appending a column ended.
enum Appended {
    All,
    /// An integer is not exact in f64.
    Inexact,
    /// There are more samples than the file declares.
    TooMany,
    /// There is no memory for them.
    TooLarge,
}

/// How much a column may grow.
struct SampleBudget<'a> {
    budget: &'a Budget<'a>,
    /// Samples.
    most: usize,
}

impl SampleBudget<'_> {
    /// Takes memory for `more` samples.
    fn grow(&self, more: usize, samples: &mut Vec<f64>) -> Appended {
        if samples.len().saturating_add(more) > self.most {
            return Appended::TooMany;
        }
        match self.budget.numbers(more, "").is_ok() && samples.try_reserve(more).is_ok() {
            true => Appended::All,
            false => Appended::TooLarge,
        }
    }
}

/// Appends column `i` of `group` to `samples`, nulls as NaN.
fn append(
    group: &dyn RowGroupReader,
    i: usize,
    kind: Kind,
    samples: &mut Vec<f64>,
    allowance: &SampleBudget,
) -> std::result::Result<Appended, ParquetError> {
    let mut reader = group.get_column_reader(i)?;
    let allowed = &mut |more: usize, samples: &mut Vec<f64>| allowance.grow(more, samples);
    loop {
        match next(&mut reader, kind, samples, allowed)? {
            Some(Appended::All) => {}
            Some(other) => return Ok(other),
            None => return Ok(Appended::All),
        }
    }
}

/// Whether this number of further samples may follow.
type Allowed<'a> = dyn FnMut(usize, &mut Vec<f64>) -> Appended + 'a;

/// Appends the next samples of a column, at most [`BATCH`], nulls as NaN; `None` at its end.
fn next(
    reader: &mut ColumnReader,
    kind: Kind,
    samples: &mut Vec<f64>,
    allowed: &mut Allowed,
) -> std::result::Result<Option<Appended>, ParquetError> {
    // The integers are bounded so that a round trip through f64 keeps them.
    match (reader, kind) {
        (ColumnReader::BoolColumnReader(r), _) => batch(r, samples, allowed, |v| Some(f64::from(u8::from(*v)))),
        (ColumnReader::Int32ColumnReader(r), Kind::UInt32) => {
            batch(r, samples, allowed, |v| Some(f64::from(v.cast_unsigned())))
        }
        (ColumnReader::Int32ColumnReader(r), _) => batch(r, samples, allowed, |v| Some(f64::from(*v))),
        (ColumnReader::Int64ColumnReader(r), Kind::UInt64) => {
            batch(r, samples, allowed, |v| exact(v.cast_unsigned().into()))
        }
        (ColumnReader::Int64ColumnReader(r), _) => batch(r, samples, allowed, |v| exact((*v).into())),
        (ColumnReader::FloatColumnReader(r), _) => batch(r, samples, allowed, |v| Some(f64::from(*v))),
        (ColumnReader::DoubleColumnReader(r), _) => batch(r, samples, allowed, |v| Some(*v)),
        _ => Err(ParquetError::General("a column's type changed".to_owned())),
    }
}

/// An integer as f64, if none of its digits are lost.
pub(crate) fn exact(value: i128) -> Option<f64> {
    let converted = value as f64;
    (converted as i128 == value).then_some(converted)
}

fn batch<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    samples: &mut Vec<f64>,
    allowed: &mut Allowed,
    convert: impl Fn(&T::T) -> Option<f64>,
) -> std::result::Result<Option<Appended>, ParquetError> {
    let mut values: Vec<T::T> = Vec::new();
    let mut levels: Vec<i16> = Vec::new();
    let (rows, ..) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
    if rows == 0 {
        return Ok(None);
    }
    // A required column has no levels: all its values are there.
    levels.resize(rows.max(levels.len()), 1);
    match allowed(levels.len(), samples) {
        Appended::All => {}
        other => return Ok(Some(other)),
    }
    let mut present = values.iter();
    for level in &levels {
        let value = if *level == 0 {
            Some(f64::NAN)
        } else {
            present.next().and_then(&convert)
        };
        match value {
            Some(value) => samples.push(value),
            None => return Ok(Some(Appended::Inexact)),
        }
    }
    Ok(Some(Appended::All))
}

/// Writes `record` under these names as Parquet: required doubles, Snappy.
pub(crate) fn write<W: Write + Send>(out: &mut W, record: &Record, header: &[String]) -> io::Result<()> {
    let fields = header.iter().map(|name| {
        let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
        Ok(Arc::new(field.build()?))
    });
    let fields = fields.collect::<std::result::Result<Vec<_>, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
    // Measured signals hardly repeat values, so a dictionary would not help.
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_created_by(concat!("flexure ", env!("CARGO_PKG_VERSION")).to_owned())
        .build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    for start in (0..record.len()).step_by(ROW_GROUP) {
        let end = record.len().min(start + ROW_GROUP);
        let mut group = writer.next_row_group()?;
        for (_, samples) in record.columns() {
            let Some(mut column) = group.next_column()? else {
                return Err(io::Error::other("the row group has too few columns"));
            };
            column
                .typed::<DoubleType>()
                .write_batch(&samples[start..end], None, None)?;
            column.close()?;
        }
        group.close()?;
    }
    writer.close()?;
    Ok(())
}
