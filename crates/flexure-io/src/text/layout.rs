//! The layout of a text file, decided from its first lines.
//!
//! 1. **Separator**: the one of comma, semicolon, tab and pipe that divides all lines into equally many fields, at least two. If several do, the
//!    one with most readable fields; if none does, spaces.
//! 2. **Header**: a line of texts. The file leaves it open if a column has texts in the second line too, or if the first line has the
//!    numbers 0, 1, 2, ..., which pandas writes for columns without names.
//! 3. **Units**: a second line of texts above numbers.

use std::collections::HashMap;
use std::io::Read;

use super::lines::Lines;
use super::{columns, numbers};
use crate::error::LineProblem;
use crate::options::ReadOptions;
use crate::time::INDEX;
use crate::units::split_unit;

/// The number of lines that decide the layout.
const LINES: usize = 20;

/// How many lines are searched for a table below other lines, and the fewest lines that such a table must have.
const SEARCHED_LINES: usize = 100;
const TABLE_LINES: usize = 3;

/// The most fields with content in a line above a table that is padded to its width.
const PADDED: usize = 2;

/// The most lines of a header and units.
const HEADINGS: usize = 2;

/// What may separate the columns, besides spaces.
pub(super) const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// The first bytes of a packed file, such as a workbook, and of a workbook before 2007.
const PACKED: &[u8] = b"PK\x03\x04";
const OLD_WORKBOOK: &[u8] = b"\xd0\xcf\x11\xe0";

/// How the lines of a file are laid out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// The byte between two fields; `None`: spaces.
    pub(super) separator: Option<u8>,
    /// The columns' names, without their units.
    pub(super) names: Vec<String>,
    /// The columns' units.
    pub(super) units: Vec<Option<String>>,
    /// The lines of header and units.
    pub(super) heading_lines: usize,
    /// The lines in front of the table, which are left out.
    pub(super) skip: u64,
    /// The line on which the table seems to begin where other lines precede it.
    pub(super) table: Option<u64>,
    /// What was decided, as sentences.
    pub(super) notes: Vec<String>,
}

/// The line, and what is wrong on it.
pub(super) type Problem = (u64, LineProblem);

/// A line with content.
struct Line {
    number: u64,
    bytes: Vec<u8>,
}

impl Line {
    /// Refuses a line that is not text in UTF-8.
    fn check_text(&self) -> Result<(), Problem> {
        let begins = |with: &[u8]| self.bytes.starts_with(with);
        match self.bytes.contains(&0) {
            _ if begins(PACKED) => Err((self.number, LineProblem::Packed)),
            _ if begins(OLD_WORKBOOK) => Err((self.number, LineProblem::OldWorkbook)),
            true => Err((self.number, LineProblem::NotText)),
            false => Ok(()),
        }
    }
}

/// A separator at the end of every line makes no column.
fn drop_empty_ends(rows: &mut [Vec<String>]) {
    while rows[0].len() > 1 {
        let last = rows[0].len() - 1;
        if !rows.iter().all(|row| row.get(last).is_none_or(String::is_empty)) {
            return;
        }
        rows.iter_mut().for_each(|row| row.truncate(last));
    }
}

/// Refuses quoted fields that continue on the next line.
fn check_quotes(rows: &[Vec<String>], lines: &[Line]) -> Result<(), Problem> {
    for (row, line) in rows.iter().zip(lines) {
        for (end, problem) in [('\n', LineProblem::UnclosedQuote), ('\r', LineProblem::CarriageReturn)] {
            if row.iter().any(|field| field.contains(end)) {
                return Err((line.number, problem));
            }
        }
    }
    Ok(())
}

impl Layout {
    /// Decides from the beginning of a file, `None` if it has no content.
    pub(super) fn of(head: &[u8], options: &ReadOptions) -> Result<Option<Self>, Problem> {
        if let Some(first) = first_lines(head, options.skip, 1).first() {
            first.check_text()?;
        }
        let table = table_below(head, options);
        let skip = match &table {
            Some(table) if table.is_sure && options.skip == 0 => table.line - 1,
            _ => options.skip,
        };
        let lines = first_lines(head, skip, LINES);
        let Some(first) = lines.first() else { return Ok(None) };
        let separator = match options.separator {
            Some(' ') => None,
            Some(character) => Some(character as u8),
            None => separator(&lines, options)?,
        };
        let mut rows = rows(&lines, separator);
        drop_empty_ends(&mut rows);
        check_quotes(&rows, &lines)?;
        let mut layout = Layout {
            separator,
            names: Vec::new(),
            units: vec![None; rows[0].len()],
            heading_lines: 0,
            skip,
            table: table.map(|table| table.line),
            notes: Vec::new(),
        };
        if skip > options.skip {
            layout.note(match skip {
                1 => "line 1 stands above the table and is left out".to_owned(),
                last => format!("lines 1 to {last} stand above the table and are left out"),
            });
        }
        let quoted = |line: &Line| line.bytes.contains(&b'"');
        let header = match options.header {
            Some(header) => header,
            // Numbers are seldom quoted, but names that look like numbers should be.
            None if quoted(first) && lines.get(1).is_some_and(|second| !quoted(second)) => true,
            None => has_header(&rows, options).map_err(|problem| (first.number, problem))?,
        };
        if !header {
            layout.names = (0..rows[0].len()).map(|i| format!("c{i}")).collect();
            layout.note(format!(
                "there is no header; the columns are called {}",
                list(&layout.names)
            ));
            return Ok(Some(layout));
        }
        layout.heading_lines = 1;
        layout
            .names(&rows, options)
            .map_err(|problem| (first.number, problem))?;
        if has_units(&rows, options) {
            layout.heading_lines = 2;
            for (unit, field) in layout.units.iter_mut().zip(&rows[1]) {
                let is_text = !columns::is_readable(field, options);
                *unit = unit_text(field).filter(|_| is_text).or(unit.take());
            }
            layout.note(format!("line {} has the columns' units", lines[1].number));
        }
        Ok(Some(layout))
    }

    fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Names and units from the header.
    fn names(&mut self, rows: &[Vec<String>], options: &ReadOptions) -> Result<(), LineProblem> {
        let mut sharing: HashMap<String, usize> = HashMap::new();
        for field in &rows[0] {
            *sharing.entry(split_unit(field).0).or_default() += 1;
        }
        let mut places: HashMap<String, usize> = HashMap::new();
        for (i, field) in rows[0].iter().enumerate() {
            let (mut name, unit) = split_unit(field);
            let own = name.clone();
            if name.is_empty() {
                name = self.unnamed(i, rows, options);
            }
            // Two columns that differ only in their units keep the units in their names.
            let others = sharing.get(&name).map_or(0, |count| count - usize::from(own == name));
            if others > 0 {
                name = field.clone();
            }
            if let Some(first) = places.insert(name.clone(), i) {
                return Err(LineProblem::DuplicateName {
                    name,
                    first: first + 1,
                    second: i + 1,
                });
            }
            self.names.push(name);
            self.units[i] = unit;
        }
        Ok(())
    }

    /// A name for column `i`, which has none: pandas writes its index without a name.
    fn unnamed(&mut self, i: usize, rows: &[Vec<String>], options: &ReadOptions) -> String {
        let counts = rows[1..].iter().enumerate().all(|(k, row)| {
            let value = row.get(i).and_then(|field| numbers::readable_number(field, options));
            let first = rows[1]
                .get(i)
                .and_then(|field| numbers::readable_number(field, options));
            matches!((value, first), (Some(value), Some(first)) if value == first + k as f64)
        });
        let name = if i == 0 && counts && !rows[0].iter().any(|name| name == INDEX) {
            INDEX.to_owned()
        } else {
            format!("c{i}")
        };
        self.note(format!("column {} has no name; it is called {name}", i + 1));
        name
    }
}

fn first_lines(head: &[u8], skip: u64, count: usize) -> Vec<Line> {
    let mut text = Vec::new();
    // Reading from memory does not fail.
    let _ = Lines::new(head, skip, false).read_to_end(&mut text);
    let lines = text.split(|&b| b == b'\n').zip(1..);
    lines
        .filter(|(bytes, _)| !bytes.trim_ascii().is_empty())
        .map(|(bytes, number)| Line {
            number,
            bytes: bytes.to_vec(),
        })
        .take(count)
        .collect()
}

/// A table below other lines.
struct TableBelow {
    /// The line on which it seems to begin.
    line: u64,
    /// Whether it has its own header and more fields than every line above. Then the lines above can be left out.
    is_sure: bool,
}

/// Looks for a table below other lines. The first line has another number of fields. The lines of the table have equally many, and numbers in the
/// same columns, except for a header and a line of units.
fn table_below(head: &[u8], options: &ReadOptions) -> Option<TableBelow> {
    let lines = first_lines(head, options.skip, SEARCHED_LINES);
    let found = SEPARATORS.map(Some).into_iter().chain([None]).filter_map(|separator| {
        let rows = rows(&lines, separator);
        let last = rows.last().filter(|_| rows.len() == lines.len())?;
        let is_number =
            |field: &String| numbers::readable_number(field, options).is_some() || numbers::has_unit(field, options);
        let numbers: Vec<usize> = (0..last.len()).filter(|&i| is_number(&last[i])).collect();
        let is_readable = |field: &String| is_number(field) || columns::is_readable(field, options);
        let is_sample = |row: &Vec<String>| numbers.iter().all(|&i| is_readable(&row[i]));
        let is_heading = |row: &Vec<String>| numbers.iter().all(|&i| !is_readable(&row[i]));
        let filled = |row: &Vec<String>| row.iter().rposition(|field| !field.is_empty()).map_or(0, |i| i + 1);
        // A spreadsheet pads the lines above its table.
        let is_short = |row: &Vec<String>| filled(row) <= PADDED && filled(row) + 1 < last.len();
        let has_numbers = |row: &Vec<String>| numbers.iter().any(|&i| is_number(&row[i]));
        let is_padded = |row: &&Vec<String>| row.len() == last.len() && is_short(row) && !has_numbers(row);
        let padded = rows.iter().take_while(is_padded).count();
        let others = rows.iter().rposition(|row| row.len() != last.len());
        let others = others.max(padded.checked_sub(1))?;
        let block = &rows[others + 1..];
        let samples = block.iter().rposition(|row| !is_sample(row)).map_or(0, |i| i + 1);
        let headings = block[..samples]
            .iter()
            .rev()
            .take(HEADINGS)
            .take_while(|row| is_heading(row))
            .count();
        let has_lines_before =
            (padded > 0 || rows[0].len() != last.len()) && block.len() - samples + headings >= TABLE_LINES;
        let first = others + 1 + samples - headings;
        let table = || TableBelow {
            line: lines[first].number,
            is_sure: headings > 0 && rows[..first].iter().all(|row| filled(row) < last.len()),
        };
        (has_lines_before && last.len() > 1 && !numbers.is_empty()).then(|| (last.len(), table()))
    });
    found
        .max_by_key(|(width, table)| (table.is_sure, *width))
        .map(|(_, table)| table)
}

/// Step 1; see the module.
fn separator(lines: &[Line], options: &ReadOptions) -> Result<Option<u8>, Problem> {
    let first = &lines[0];
    let regular = |rows: &[Vec<String>]| rows[0].len() > 1 && rows.iter().all(|row| row.len() == rows[0].len());
    let separators = SEPARATORS.into_iter().map(Some).chain([None]);
    let candidates: Vec<_> = separators
        .map(|separator| (separator, rows(lines, separator)))
        .collect();
    let readable = |rows: &[Vec<String>]| -> usize {
        let data = rows.iter().skip(usize::from(rows.len() > 1)).flatten();
        data.filter(|field| columns::is_readable(field, options)).count()
    };
    let mut best: Vec<(Option<u8>, usize)> = Vec::new();
    for (separator, rows) in candidates.iter().filter(|(_, rows)| regular(rows)) {
        let count = readable(rows);
        match best.first() {
            Some(&(_, other)) if other > count => {}
            Some(&(_, other)) if other == count => best.push((*separator, count)),
            _ => best = vec![(*separator, count)],
        }
    }
    // Spaces within names or around another separator do not separate.
    if best.len() > 1 {
        best.retain(|(separator, _)| separator.is_some());
    }
    match best[..] {
        [(separator, _)] => Ok(separator),
        [] => Ok(irregular(&candidates, options)),
        _ => Err((first.number, LineProblem::MixedSeparators)),
    }
}

/// The separator of lines with different numbers of fields, or with one field: a line that differs is reported later, with its number.
fn irregular(candidates: &[(Option<u8>, Vec<Vec<String>>)], options: &ReadOptions) -> Option<u8> {
    let most = |rows: &Vec<Vec<String>>| rows[1..].iter().filter(|row| row.len() > 1).count() + rows[0].len().min(2);
    let (separator, rows) = candidates
        .iter()
        .rev()
        .max_by_key(|(_, rows)| most(rows))
        .unwrap_or(&candidates[0]);
    // In a file of one column, the name may have spaces.
    let is_name = rows[0].iter().any(|field| !columns::is_readable(field, options));
    if separator.is_none() && is_name && rows[1..].iter().all(|row| row.len() == 1) {
        return Some(b',');
    }
    *separator
}

/// Step 2; see the module.
fn has_header(rows: &[Vec<String>], options: &ReadOptions) -> Result<bool, LineProblem> {
    let readable = |field: &String| columns::is_readable(field, options);
    let is_text = |field: &String| !readable(field);
    let first = &rows[0];
    if first.iter().all(|field| readable(field) && !could_be_name(field)) {
        let counted = first.iter().filter(|f| !f.is_empty()).enumerate();
        let default_names = first.len() > 1
            && rows.len() > 1
            && counted.clone().all(|(i, field)| *field == i.to_string())
            && counted.count() + 1 >= first.len();
        return if default_names {
            Err(LineProblem::CountedHeader)
        } else {
            Ok(false)
        };
    }
    if first.iter().all(|field| is_text(field) || could_be_name(field)) {
        return Ok(true);
    }
    // A text above a number can only be a name.
    let is_number = |field: &String| readable(field) && !numbers::is_missing(field, options);
    let above_number =
        |(i, field): (usize, &String)| is_text(field) && rows[1..].iter().any(|row| row.get(i).is_some_and(is_number));
    if first.iter().enumerate().any(above_number) {
        return Ok(true);
    }
    let number = first.iter().find(|field| readable(field)).cloned().unwrap_or_default();
    Err(LineProblem::NumericHeader { text: number })
}

/// Whether a field that reads as a missing sample, or as infinity, is rather a column's name.
fn could_be_name(field: &str) -> bool {
    !field.bytes().any(|b| b.is_ascii_digit())
}

/// Step 3; see the module.
fn has_units(rows: &[Vec<String>], options: &ReadOptions) -> bool {
    let [_, second, third, ..] = rows else { return false };
    let is_text = |field: &String| !columns::is_readable(field, options) && !numbers::has_unit(field, options);
    // Some instruments write a setting there, into a column without samples.
    let is_setting = |i: usize| rows[2..].iter().all(|row| row.get(i).is_none_or(String::is_empty));
    let is_unit = |(i, field): (usize, &String)| is_text(field) || could_be_name(field) || is_setting(i);
    !super::rows::is_rule(second.iter().map(|field| field.as_bytes()))
        && second.iter().any(is_text)
        && second.iter().enumerate().all(is_unit)
        && second
            .iter()
            .zip(third)
            .any(|(unit, value)| is_text(unit) && !is_text(value))
}

/// A unit from a row of units: with or without brackets.
fn unit_text(field: &str) -> Option<String> {
    let text = field.trim_matches(['[', ']', '(', ')']).trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// The fields of the lines.
fn rows(lines: &[Line], separator: Option<u8>) -> Vec<Vec<String>> {
    let Some(separator) = separator else {
        let parts = |line: &Line| {
            text_of(&line.bytes)
                .split_ascii_whitespace()
                .map(str::to_owned)
                .collect()
        };
        return lines.iter().map(parts).collect();
    };
    let lines: Vec<&[u8]> = lines.iter().map(|line| &line.bytes[..]).collect();
    let text = lines.join(&b'\n');
    let table = super::table(&text[..], separator)
        .into_byte_records()
        .map_while(Result::ok);
    let texts = |row: csv::ByteRecord| row.iter().map(|field| text_of(super::content(field))).collect();
    table.map(texts).collect()
}

/// Text in UTF-8, otherwise in Latin-1: instruments write units such as degrees and micrometres in it.
pub(super) fn text_of(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

fn list(names: &[String]) -> String {
    match names {
        [first, .., last] if names.len() > 3 => format!("{first} to {last}"),
        _ => names.join(", "),
    }
}
