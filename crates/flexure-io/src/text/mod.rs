//! Records as text: delimited, with or without a header, or in columns between spaces.
//!
//! [`layout`] decides from the first lines how columns are separated and what their names are. Then every line is read once, and every
//! column becomes numbers, seconds of time stamps, or a column that is no signal.

mod above;
mod below;
mod cell_units;
mod columns;
mod fields;
mod header;
mod known;
mod layout;
mod lines;
mod numbers;
mod restart;
mod rows;
mod stamps;
mod switch;

use std::io::{BufReader, Cursor, Read};
use std::path::Path;

use flexure::Record;

use crate::error::{Error, LineProblem, Result};
use crate::memory::{Budget, LONGEST_TEXT, small_file};
use crate::model::FORMAT as MODEL;
use crate::options::ReadOptions;
use crate::record_file::{Other, RecordFile};
use crate::time::{SECOND, is_time};
use columns::Column;
use fields::SEPARATORS;
use layout::Layout;
use lines::Lines;
use rows::Rows;
use stamps::Part;
pub(crate) use stamps::with_fraction;

/// Bytes at the beginning of a file that decide its layout; more if the first line is longer.
const HEAD: u64 = 1 << 18;
/// The longest line, bytes: a million columns.
const LONGEST_LINE: u64 = 32 << 20;
/// The memory of a column in addition to its samples, bytes: measured. The fields of the first lines are held one by one.
const COLUMN: u64 = 1 << 10;

/// The rows of a table.
fn table<R: Read>(input: R, separator: u8) -> csv::Reader<R> {
    csv::ReaderBuilder::new()
        .delimiter(separator)
        .terminator(csv::Terminator::Any(b'\n'))
        .has_headers(false)
        .flexible(true)
        .from_reader(input)
}

/// The content of a field, without the spaces around it, and without quotation marks after such spaces.
fn content(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    let unquoted = field.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\""));
    unquoted.unwrap_or(field)
}

/// Reads the text record `input`, which `path` names.
pub(crate) fn read(budget: &Budget, path: &Path, mut input: impl Read, options: &ReadOptions) -> Result<RecordFile> {
    let fail = |cause| Error::read(path, cause);
    let at = |(line, problem)| Error::Line {
        path: path.to_owned(),
        line,
        problem,
    };
    let head = head_of(&mut input).map_err(fail)?;
    if let Some(order) = UTF_16.iter().find(|order| head.starts_with(&order.mark)) {
        let text = order.text(&budget.all(Cursor::new(head).chain(input))?);
        let text = text.ok_or_else(|| at((1, LineProblem::NotUtf16)))?;
        return read(budget, path, text.as_bytes(), options);
    }
    if has_carriage_returns_alone(&head) {
        let mut text = budget.all(Cursor::new(head).chain(input))?;
        let ends = text.iter_mut().filter(|byte| **byte == b'\r');
        ends.for_each(|byte| *byte = b'\n');
        return read(budget, path, &text[..], options);
    }
    check_head(&head).map_err(|problem| at((1, problem)))?;
    budget.take(COLUMN * fields(&head), "the list of columns")?;
    let mut layout = layout(&head, path, options, at)?;
    // In a table of one column, a blank line may be a missing sample.
    let heading = match layout.names.len() {
        0 | 1 => 0,
        _ => layout.heading_lines,
    };
    let input = BufReader::with_capacity(HEAD as usize, Cursor::new(head).chain(input));
    let lines = Lines::new(input, layout.skip, layout.separator.is_none()).with_heading(heading);
    let mut rows = table(lines, layout.separator.unwrap_or(b'\t'));
    let mut row = csv::ByteRecord::new();
    let mut table = Rows::new(&layout, options);
    while rows.read_byte_record(&mut row).map_err(|error| fail(error.into()))? {
        budget.numbers(layout.names.len(), "the table")?;
        // Counted back from the end of the row, since empty lines may precede it.
        let line = rows.position().line() - 1;
        let blank = rows.get_mut().gap_above(line);
        table.take(&row, line, blank, &layout).map_err(at)?;
    }
    if let Some(stopped) = rows.get_ref().stopped() {
        return Err(at(stopped));
    }
    let last_line = rows.position().line() - 1;
    let left_out = table.end(last_line, &layout).map_err(at)?;
    layout.notes.extend(left_out);
    let decimals = table.numbers.conclude().map_err(at)?;
    if table.samples == 0 {
        return Err(Error::NoSamples {
            path: path.to_owned(),
            names: layout.names,
        });
    }
    let is_nameless = layout.is_nameless;
    let mut file = assemble(path, layout, table.columns, options)?;
    file.notes.extend(decimals.map(str::to_owned));
    file.is_nameless = is_nameless;
    file.lines = table.lines;
    Ok(file)
}

/// An order of the two bytes of a unit of UTF-16, which spreadsheets write as "Unicode text".
struct Utf16 {
    mark: [u8; 2],
    unit: fn([u8; 2]) -> u16,
}

const UTF_16: [Utf16; 2] = [
    Utf16 {
        mark: [0xff, 0xfe],
        unit: u16::from_le_bytes,
    },
    Utf16 {
        mark: [0xfe, 0xff],
        unit: u16::from_be_bytes,
    },
];

impl Utf16 {
    /// The text behind the mark; `None` if these bytes are no UTF-16.
    fn text(&self, bytes: &[u8]) -> Option<String> {
        let units = bytes[self.mark.len()..].chunks_exact(2);
        let whole = units.remainder().is_empty();
        let text = char::decode_utf16(units.map(|unit| (self.unit)([unit[0], unit[1]])));
        let text: std::result::Result<String, _> = text.collect();
        text.ok().filter(|_| whole)
    }
}

/// Whether lines end as on the first Macintosh computers.
fn has_carriage_returns_alone(head: &[u8]) -> bool {
    head.contains(&b'\r') && !head.contains(&b'\n')
}

/// Refuses what begins like no table.
fn check_head(head: &[u8]) -> std::result::Result<(), LineProblem> {
    if head.len() as u64 > LONGEST_LINE {
        return Err(LineProblem::TooLong { limit: LONGEST_LINE });
    }
    if head.starts_with(b"{") && head.windows(MODEL.len()).any(|part| part == MODEL.as_bytes()) {
        return Err(LineProblem::Model);
    }
    if [&b"{\""[..], b"[{", b"[["]
        .iter()
        .any(|start| head.trim_ascii_start().starts_with(start))
    {
        return Err(LineProblem::Json);
    }
    Ok(())
}

/// The layout of a table with this head; `at` makes the error of a line.
fn layout(head: &[u8], path: &Path, options: &ReadOptions, at: impl Fn((u64, LineProblem)) -> Error) -> Result<Layout> {
    // The last line may be there in part.
    let whole = match head.iter().rposition(|&b| b == b'\n') {
        Some(end) if head.len() as u64 >= HEAD => &head[..=end],
        _ => head,
    };
    let path = || path.to_owned();
    Layout::of(whole, options)
        .map_err(at)?
        .ok_or_else(|| match options.skip {
            0 => Error::Empty { path: path() },
            lines => Error::AllSkipped { path: path(), lines },
        })
}

/// An upper limit of the number of fields in the first line.
fn fields(head: &[u8]) -> u64 {
    let line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let count = |separator| line.iter().filter(|&&byte| byte == separator).count() as u64;
    1 + SEPARATORS.into_iter().chain([b' ']).map(count).max().unwrap_or(0)
}

/// The beginning of a text, including its complete first line unless that is too long.
fn head_of(input: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    loop {
        let read = input.by_ref().take(HEAD).read_to_end(&mut head)?;
        if (read as u64) < HEAD || head.contains(&b'\n') || head.len() as u64 > LONGEST_LINE {
            return Ok(head);
        }
    }
}

/// Dates and times of day in two columns become time stamps in the column of the times; the other column is taken away. If there are
/// other time stamps besides, all columns stay. Returns the name of that column and sentences on it.
fn join_dates(columns: &mut Vec<Column>, units: &mut Vec<Option<String>>) -> Option<(String, Vec<String>)> {
    let stamps: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].part().is_some()).collect();
    let [a, b] = stamps[..] else { return None };
    let (date, time) = match (columns[a].part(), columns[b].part()) {
        (Some(Part::Date), Some(Part::TimeOfDay)) => (a, b),
        (Some(Part::TimeOfDay), Some(Part::Date)) => (b, a),
        _ => return None,
    };
    let time = if date < time { time - 1 } else { time };
    units.remove(date);
    let dates = columns.remove(date);
    columns[time].add_dates(&dates);
    let note = format!(
        "columns '{}' and '{}' are together a date and a time",
        dates.name, columns[time].name
    );
    let notes = dates.words().into_iter().chain([note]).collect();
    Some((dates.name, notes))
}

/// The record of the columns that are signals, and what the others are.
fn assemble(path: &Path, mut layout: Layout, mut columns: Vec<Column>, options: &ReadOptions) -> Result<RecordFile> {
    if let (Some(axis), Some(first)) = (layout.axis, columns.first_mut()) {
        first.put_on(axis);
    }
    let joined = join_dates(&mut columns, &mut layout.units);
    let mut signals = Vec::new();
    let mut units = Vec::new();
    let (mut origins, mut others, mut stamps) = (Vec::new(), Vec::new(), Vec::new());
    let mut notes = layout.notes;
    let mut texts: Vec<String> = Vec::new();
    let (date, joined) = joined.unzip();
    notes.extend(joined.into_iter().flatten());
    for (column, unit) in columns.into_iter().zip(layout.units) {
        for text in column.texts() {
            if !texts.contains(text) {
                texts.push(text.clone());
            }
        }
        if let Some(why) = column.unusable() {
            if column.looks_like_stamps() || is_time(&column.name) {
                stamps.push(others.len());
            }
            others.push(Other { why, name: column.name });
            continue;
        }
        let stamps = column.origin().map(|(instant, origin)| {
            origins.push((column.name.clone(), instant));
            format!(
                "column '{}' has time stamps; it counts the seconds from {origin}",
                column.name
            )
        });
        notes.extend(column.words());
        units.push(match stamps.is_some() {
            true => Some(SECOND.to_owned()),
            false => unit.or(column.unit().map(str::to_owned)),
        });
        notes.extend(stamps);
        signals.push((column.name, column.values));
    }
    if let (Some(format), Some(&first), true) = (&options.time_format, stamps.first(), origins.is_empty()) {
        return Err(Error::TimeFormat {
            path: path.to_owned(),
            format: format.clone(),
            column: others[first].to_string(),
        });
    }
    let record = Record::new(signals).map_err(|error| Error::data(path, error))?;
    if record.is_empty() {
        return Err(others[0].error(path));
    }
    notes.extend(left_out(&others, &stamps));
    Ok(RecordFile {
        units,
        notes,
        dates: date.zip(origins.first().map(|(name, _)| name.clone())),
        origins,
        others,
        texts,
        ..RecordFile::new(record, path)
    })
}

/// A sentence on the columns that are no signals. The first of the `stamps`, which may be instants, comes before all others. A column with
/// some numbers is left out: it is reported when it is used, and by `flexure look`.
pub(crate) fn left_out(others: &[Other], stamps: &[usize]) -> Option<String> {
    let instants = stamps.first().map(|&i| &others[i]);
    let others: Vec<&Other> = others
        .iter()
        .filter(|other| other.is_text() || is_time(&other.name))
        .collect();
    let first = instants.or(others.first().copied())?;
    let name = &first.name;
    let which = match others.len() {
        1 => format!("column '{name}' is left out"),
        2 => {
            let other = others.iter().find(|other| other.name != *name).unwrap_or(&first);
            format!("columns '{name}' and '{}' are left out", other.name)
        }
        count => format!("column '{name}' and {} others are left out", count - 1),
    };
    let reason = format!("{which}: {first}");
    let needs_format = instants.is_some() && first.is_text() && !reason.contains("--time-format");
    let remedy = match needs_format {
        true => {
            " (--time-format says how time stamps or dates are written, as in \"%d.%m.%Y %H:%M:%S%.f\" or \"%m/%d/%Y\")"
        }
        false => "",
    };
    Some(reason + remedy)
}

/// The whole text of a file of at most 16 MiB; of the standard input if `path` is `-`.
///
/// # Errors
/// [`Error::Read`], also for text that is not UTF-8; [`Error::TooLarge`].
pub fn read_text(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let bytes = small_file(path, LONGEST_TEXT)?;
    String::from_utf8(bytes).map_err(|_| Error::read(path, std::io::ErrorKind::InvalidData.into()))
}
