//! The layout of a text file, decided from its first lines.
//!
//! 1. **Separator**: the one of comma, semicolon, tab and pipe that divides all lines into equally many fields, at least two. If several do, the
//!    one with most readable fields; if none does, spaces.
//! 2. **Header**: a line of texts, or a comment directly above the first row with as many names as there are columns. The file leaves it
//!    open if a column has texts in the second line too, or if the first line has the numbers 0, 1, 2, ..., which pandas writes for
//!    columns without names.
//! 3. **Units**: a second line of texts above numbers.
//!
//! Files of some loggers and programs say in their first lines where the table begins: see [`super::known`].

use std::collections::HashMap;

use super::above::table_below;
use super::columns::{self, Axis};
use super::fields::{Line, SEPARATORS, first_lines, rows};
use super::header::{has_header, has_units, names_in_comment, unit_text};
use super::known::{Known, names_in_rows};
use super::numbers;
use crate::error::LineProblem;
use crate::options::ReadOptions;
use crate::time::INDEX;
use crate::units::split_unit;

/// The number of lines that decide the layout.
const LINES: usize = 20;

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
    /// The instants of the first column, where the heading states them.
    pub(super) axis: Option<Axis>,
    /// Whether rows may end before the last column.
    pub(super) may_lack_last: bool,
    /// Whether each field begins with its column's name, as in `t=0.01`.
    pub(super) is_named: bool,
    /// Whether the file has no names of columns.
    pub(super) is_nameless: bool,
    /// What was decided, as sentences.
    pub(super) notes: Vec<String>,
}

/// The line, and what is wrong on it.
pub(super) type Problem = (u64, LineProblem);

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

/// Whether the first line is a header. Where it may be one or not, a comment with the names decides.
fn begins_with_header(
    rows: &[Vec<String>],
    lines: &[Line],
    options: &ReadOptions,
    is_commented: bool,
) -> Result<bool, Problem> {
    let quoted = |line: &Line| line.bytes.contains(&b'"');
    // Numbers are seldom quoted, but names that look like numbers should be.
    if quoted(&lines[0]) && lines.get(1).is_some_and(|second| !quoted(second)) {
        return Ok(true);
    }
    match has_header(rows, options) {
        Err(_) if is_commented => Ok(false),
        found => found.map_err(|problem| (lines[0].number, problem)),
    }
}

impl Layout {
    /// Decides from the beginning of a file, `None` if it has no content.
    pub(super) fn of(head: &[u8], options: &ReadOptions) -> Result<Option<Self>, Problem> {
        if let Some(first) = first_lines(head, options.skip, 1).first() {
            first.check_text()?;
        }
        let table = table_below(head, options);
        let known = Known::of(head, options);
        let skip = match (&known, &table) {
            (Some(known), _) => known.skip,
            (None, Some(table)) if table.is_sure && options.skip == 0 => table.line - 1,
            _ => options.skip,
        };
        let lines = first_lines(head, skip, LINES);
        let Some(first) = lines.first() else { return Ok(None) };
        let separator = match (options.separator, &known) {
            (Some(' '), _) => None,
            (Some(character), _) => Some(character as u8),
            (None, Some(known)) => Some(known.separator),
            (None, None) => separator(&lines, options)?,
        };
        let mut rows = rows(&lines, separator);
        drop_empty_ends(&mut rows);
        check_quotes(&rows, &lines)?;
        let mut layout = Layout::without_names(separator, skip, &rows[0]);
        layout.table = table.map(|table| table.line);
        if skip > options.skip {
            layout.note(match skip {
                1 => "line 1 stands above the table and is left out".to_owned(),
                last => format!("lines 1 to {last} stand above the table and are left out"),
            });
        }
        if options.header != Some(true)
            && let Some(names) = names_in_rows(&rows, options)
        {
            layout.note(format!("each row has the columns' names, as in {}", rows[0][0]));
            (layout.names, layout.is_named) = (names, true);
            return Ok(Some(layout));
        }
        let commented = match options.header {
            None => names_in_comment(head, first.number, separator, &rows, options),
            Some(_) => None,
        };
        let header = match options.header {
            Some(header) => header,
            None => known.is_some() || begins_with_header(&rows, &lines, options, commented.is_some())?,
        };
        if !header {
            layout.names_without_header(rows, commented, options)?;
            return Ok(Some(layout));
        }
        layout.heading(&rows, &lines, known, options)?;
        Ok(Some(layout))
    }

    /// The layout of rows like this one, whose columns have no names yet.
    fn without_names(separator: Option<u8>, skip: u64, row: &[String]) -> Self {
        Layout {
            separator,
            names: Vec::new(),
            units: vec![None; row.len()],
            heading_lines: 0,
            skip,
            table: None,
            axis: None,
            may_lack_last: false,
            is_named: false,
            is_nameless: false,
            notes: Vec::new(),
        }
    }

    /// Takes the names from a comment, with its line; otherwise numbers the columns.
    fn names_without_header(
        &mut self,
        mut rows: Vec<Vec<String>>,
        commented: Option<(Vec<String>, u64)>,
        options: &ReadOptions,
    ) -> Result<(), Problem> {
        let Some((names, line)) = commented else {
            self.names = (0..rows[0].len()).map(|i| format!("c{i}")).collect();
            self.is_nameless = true;
            self.note(format!(
                "there is no header; the columns are called {}",
                list(&self.names)
            ));
            return Ok(());
        };
        self.note(format!(
            "the names are from the comment on line {line}; --header no leaves the columns without names"
        ));
        rows.insert(0, names);
        self.names(&rows, options).map_err(|problem| (line, problem))
    }

    /// Takes names and units from the first rows.
    fn heading(
        &mut self,
        rows: &[Vec<String>],
        lines: &[Line],
        known: Option<Known>,
        options: &ReadOptions,
    ) -> Result<(), Problem> {
        self.heading_lines = 1;
        self.names(rows, options)
            .map_err(|problem| (lines[0].number, problem))?;
        if known.as_ref().is_none_or(Known::leaves_units_open) && has_units(rows, options) {
            self.heading_lines = 2;
            for (unit, field) in self.units.iter_mut().zip(&rows[1]) {
                let is_text = !columns::is_readable(field, options);
                *unit = unit_text(field).filter(|_| is_text).or(unit.take());
            }
            self.note(format!("line {} has the columns' units", lines[1].number));
            self.take_increment(&rows[1], options);
        }
        if let Some(known) = known {
            known.complete(self, rows, lines, options);
        }
        Ok(())
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

fn list(names: &[String]) -> String {
    match names {
        [first, .., last] if names.len() > 3 => format!("{first} to {last}"),
        _ => names.join(", "),
    }
}
