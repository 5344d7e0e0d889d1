//! The lines of a text file in the form that the table's reader needs.

use std::collections::VecDeque;
use std::io::{self, BufRead, Read};

use super::LONGEST_LINE;
use super::numbers::MISSING;
use crate::error::LineProblem;

/// The most consecutive lines without content: a packed file of a few bytes can have any number of them. Convention.
const MOST_IDLE: u64 = 10_000_000;

/// Passes lines on with their numbers kept, and empties those that are not part of the table.
///
/// A comment (`#`), a line before the table, or a line of spaces and tabs becomes an empty line, which the reader of the table counts and
/// passes over. Columns between spaces become columns between tabs.
pub(super) struct Lines<R> {
    input: R,
    /// The lines before the table.
    skip: u64,
    /// Whether spaces separate the columns.
    spaces: bool,
    /// The lines of header and units; instruments leave a line blank after them.
    heading: usize,
    line: u64,
    /// The lines with content so far.
    contents: usize,
    /// The first blank line since the last line with content.
    blank: Option<u64>,
    /// The first blank lines of gaps, each with the line of the content that follows. The reader of the table has yet to ask for them.
    gaps: VecDeque<[u64; 2]>,
    /// The lines without content since the last one with content.
    idle: u64,
    /// The line at which reading ended, and why.
    stopped: Option<(u64, LineProblem)>,
    buffer: Vec<u8>,
    position: usize,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(input: R, skip: u64, spaces: bool) -> Self {
        Lines {
            input,
            skip,
            spaces,
            heading: 0,
            line: 0,
            contents: 0,
            blank: None,
            gaps: VecDeque::new(),
            idle: 0,
            stopped: None,
            buffer: Vec::new(),
            position: 0,
        }
    }

    /// With this number of lines of header and units: blank lines after these mean nothing.
    pub(super) fn with_heading(self, heading: usize) -> Self {
        Lines { heading, ..self }
    }

    /// The first blank line directly above this line of content; asked for once, and in order.
    pub(super) fn gap_above(&mut self, content: u64) -> Option<u64> {
        let [blank, _] = *self.gaps.front().filter(|[_, below]| *below <= content)?;
        self.gaps.pop_front();
        Some(blank)
    }

    /// The line at which reading ended, and why.
    pub(super) fn stopped(&self) -> Option<(u64, LineProblem)> {
        self.stopped.clone()
    }

    /// Reads the next line into the buffer; at the end of the file the buffer stays empty.
    fn advance(&mut self) -> io::Result<()> {
        self.buffer.clear();
        self.position = 0;
        let limit = LONGEST_LINE;
        let length = self.input.by_ref().take(limit).read_until(b'\n', &mut self.buffer)?;
        if length == 0 || self.stopped.is_some() {
            self.buffer.clear();
            return Ok(());
        }
        self.line += 1;
        if length as u64 == limit && self.buffer.last() != Some(&b'\n') {
            self.stopped = Some((self.line, LineProblem::TooLong { limit }));
            self.buffer.clear();
            return Ok(());
        }
        self.idle += u64::from(self.line > self.skip);
        if self.idle > MOST_IDLE {
            self.stopped = Some((self.line, LineProblem::WithoutEnd { limit: MOST_IDLE }));
            self.buffer.clear();
            return Ok(());
        }
        // Every line gets the same ending, the last one too.
        while let Some(b'\n' | b'\r') = self.buffer.last() {
            self.buffer.pop();
        }
        self.buffer.push(b'\n');
        // A byte-order mark may also follow comments that a program has put in front of a file.
        if self.contents == 0 && self.buffer.starts_with(b"\xef\xbb\xbf") {
            self.buffer.drain(..3);
        }
        let content = self.buffer.trim_ascii();
        if self.line <= self.skip || is_comment(content) || is_separator_line(content) {
            self.buffer.clear();
            self.buffer.push(b'\n');
        } else if content.is_empty() {
            self.blank.get_or_insert(self.line);
            self.buffer.clear();
            self.buffer.push(b'\n');
        } else {
            if let Some(blank) = self.blank.take()
                && self.contents > self.heading
            {
                self.gaps.push_back([blank, self.line]);
            }
            self.contents += 1;
            self.idle = 0;
            if self.spaces {
                let fields: Vec<&[u8]> = content
                    .split(u8::is_ascii_whitespace)
                    .filter(|field| !field.is_empty())
                    .collect();
                let mut line = fields.join(&b'\t');
                line.push(b'\n');
                self.buffer = line;
            }
        }
        Ok(())
    }
}

/// Whether this line is no part of the table; spreadsheets write `#N/A` for a sample.
fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#")
        && !MISSING
            .iter()
            .any(|text| text.len() > 1 && line.starts_with(text.as_bytes()))
}

/// Whether this is the line by which spreadsheets declare the separator: `sep=;`.
fn is_separator_line(line: &[u8]) -> bool {
    line.len() == 5 && line[..4].eq_ignore_ascii_case(b"sep=")
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.position == self.buffer.len() {
            self.advance()?;
        }
        let count = (self.buffer.len() - self.position).min(out.len());
        out[..count].copy_from_slice(&self.buffer[self.position..self.position + count]);
        self.position += count;
        Ok(count)
    }
}
