//! The rows of a table: its samples, and rows that are none.

use std::ops::Range;

use super::below::{self, Below};
use super::columns::{self, Column};
use super::content;
use super::fields::{is_drawn, is_rule, text_of};
use super::layout::{Layout, Problem};
use super::numbers::Numbers;
use super::restart::{Waiting, may_restart};
use crate::error::LineProblem;
use crate::options::ReadOptions;
use crate::record_file::SampleLines;

/// What was read so far.
pub(super) struct Rows<'a> {
    pub(super) columns: Vec<Column<'a>>,
    pub(super) numbers: Numbers,
    /// The lines of the samples.
    pub(super) lines: SampleLines,
    pub(super) samples: usize,
    options: &'a ReadOptions,
    /// The rows of header and units.
    headings: Vec<csv::ByteRecord>,
    /// The lines that repeat them.
    repeated: Vec<u64>,
    /// The lines that stand above them where the logger started again.
    above: Vec<u64>,
    waiting: Waiting,
    /// Whether a header was repeated since the last sample: blank lines then mean nothing.
    has_restarted: bool,
    /// The first blank line since the last sample, and the first that a sample follows.
    blank: Option<u64>,
    gap: Option<u64>,
    /// The lines of one text, and those below a header that only separate it.
    remarks: Vec<u64>,
    /// The last runs of samples that are nothing but separators.
    empty: Vec<Range<usize>>,
    below: Below,
}

impl<'a> Rows<'a> {
    pub(super) fn new(layout: &Layout, options: &'a ReadOptions) -> Self {
        Rows {
            columns: layout.names.iter().cloned().map(Column::new).collect(),
            numbers: Numbers::new(options.decimal),
            lines: SampleLines::default(),
            samples: 0,
            options,
            headings: Vec::new(),
            repeated: Vec::new(),
            above: Vec::new(),
            waiting: Waiting::default(),
            has_restarted: false,
            blank: None,
            gap: None,
            remarks: Vec::new(),
            empty: Vec::new(),
            below: Below::default(),
        }
    }

    /// Takes the row of this line; `blank` is the first of the blank lines directly above it.
    ///
    /// # Errors
    /// For a row that can neither be a sample nor be left out.
    pub(super) fn take(
        &mut self,
        row: &csv::ByteRecord,
        line: u64,
        blank: Option<u64>,
        layout: &Layout,
    ) -> Result<(), Problem> {
        let options = self.options;
        if self.headings.len() < layout.heading_lines {
            self.headings.push(row.clone());
            return Ok(());
        }
        // A header of numbers may be a sample too.
        if self.headings.contains(row) && row.iter().any(|field| is_text(field, options)) {
            self.above
                .extend(self.waiting.take().into_iter().map(|(_, line, _)| line));
            self.repeated.push(line);
            if may_restart(layout) {
                (self.has_restarted, self.blank) = (true, None);
            }
            return Ok(());
        }
        if self.samples > 0 && self.waiting.is_for(row, layout, options) {
            self.waiting.add((row.clone(), line, blank));
            return Ok(());
        }
        if !self.waiting.is_empty() {
            self.take_waiting(layout)?;
        }
        self.take_sample(row, line, blank, layout)
    }

    /// Takes the rows that stand above no header.
    fn take_waiting(&mut self, layout: &Layout) -> Result<(), Problem> {
        let mut rows = self.waiting.take().into_iter();
        rows.try_for_each(|(row, line, blank)| self.take_sample(&row, line, blank, layout))
    }

    /// Takes a row that repeats no header.
    fn take_sample(
        &mut self,
        row: &csv::ByteRecord,
        line: u64,
        blank: Option<u64>,
        layout: &Layout,
    ) -> Result<(), Problem> {
        let options = self.options;
        self.blank = self.blank.or(blank.filter(|_| !self.has_restarted));
        if self.samples == 0 && layout.heading_lines > 0 && is_rule(row.iter()) {
            self.remarks.push(line);
            return Ok(());
        }
        match read_row(row, line, &mut self.columns, &mut self.numbers, layout, options) {
            Ok(()) => {
                self.gap = self.gap.or(self.blank.take());
                self.has_restarted = false;
                if row.len() > 1 && row.as_slice().trim_ascii_start().is_empty() {
                    below::note_empty(&mut self.empty, self.samples);
                }
                self.lines.note(self.samples, line);
                self.samples += 1;
                Ok(())
            }
            Err(LineProblem::Ragged { found: 1, .. }) if is_text(&row[0], options) || is_drawn(content(&row[0])) => {
                self.remarks.push(line);
                Ok(())
            }
            Err(problem) => self.below.add(self.samples, (line, problem.before_table(layout.table))),
        }
    }

    /// Ends the table, whose last row is on `last_line`. Returns sentences on the rows that were left out.
    ///
    /// # Errors
    /// For a blank line, or a row with another number of fields, that samples follow.
    pub(super) fn end(&mut self, last_line: u64, layout: &Layout) -> Result<Vec<String>, Problem> {
        self.take_waiting(layout)?;
        let below = std::mem::take(&mut self.below);
        let below = below.cut(&mut self.columns, self.samples, &self.empty, &self.lines, last_line)?;
        let kept = self.columns.iter().map(|column| column.values.len()).max();
        let end = kept.and_then(|kept| self.lines.get(kept.checked_sub(1)?));
        if let Some(blank) = self.gap.filter(|blank| end.is_some_and(|end| end > *blank)) {
            return Err((blank, LineProblem::Blank));
        }
        let lists = [
            (&self.repeated, "repeats the header", "repeat the header"),
            (
                &self.above,
                "stands above a repeated header",
                "stand above a repeated header",
            ),
            (&self.remarks, "is text without a number", "are text without a number"),
        ];
        let said = lists
            .into_iter()
            .filter_map(|(lines, is, are)| left_out(lines, is, are));
        Ok(said.chain(below).collect())
    }
}

/// A sentence on lines that are left out, with what such a line and such lines are.
fn left_out(lines: &[u64], is: &str, are: &str) -> Option<String> {
    match lines {
        [] => None,
        [line] => Some(format!("line {line} {is} and is left out")),
        [first, ..] => Some(format!(
            "{} lines {are} and are left out, the first of them line {first}",
            lines.len()
        )),
    }
}

/// Whether a field is a text: of a header, or a remark such as `*** logger restarted ***`.
pub(super) fn is_text(field: &[u8], options: &ReadOptions) -> bool {
    let field = text_of(content(field));
    !field.is_empty() && !columns::is_readable(&field, options)
}

/// Appends the fields of one row to the columns.
fn read_row<'a>(
    row: &csv::ByteRecord,
    line: u64,
    columns: &mut [Column<'a>],
    numbers: &mut Numbers,
    layout: &Layout,
    options: &'a ReadOptions,
) -> std::result::Result<(), LineProblem> {
    for (end, problem) in [
        (b'\n', LineProblem::UnclosedQuote),
        (b'\r', LineProblem::CarriageReturn),
    ] {
        if row.as_slice().contains(&end) {
            return Err(problem);
        }
    }
    // A separator at the end of every line makes no column.
    let surplus = row.iter().skip(columns.len()).any(|field| !content(field).is_empty());
    let lacks_last = layout.may_lack_last && row.len() + 1 == columns.len();
    if (row.len() < columns.len() && !lacks_last) || surplus {
        return Err(LineProblem::Ragged {
            found: row.len(),
            expected: columns.len(),
            table: None,
            commas: layout.separator == Some(b','),
        });
    }
    let fields = row.iter().chain(lacks_last.then_some(&b""[..]));
    for (column, field) in columns.iter_mut().zip(fields) {
        let mut field = content(field);
        if layout.is_named {
            let value = field.strip_prefix(column.name.as_bytes());
            field = value
                .and_then(|value| value.strip_prefix(b"="))
                .ok_or_else(|| LineProblem::NoName {
                    name: column.name.clone(),
                    text: super::fields::shorten(&text_of(field)),
                })?;
        }
        match std::str::from_utf8(field) {
            Ok(text) => column.push(text, line, numbers, options)?,
            Err(_) => column.push(&text_of(field), line, numbers, options)?,
        }
    }
    Ok(())
}
