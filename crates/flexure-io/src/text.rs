//! Records as text: delimited with a header, or whitespace-separated without one.
//!
//! One line reader serves both, so that every complaint names the true line of the file, whatever
//! comments and blank lines stand before it.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flexure::Record;

use crate::error::{Error, LineProblem, Result};
use crate::record_file::{Lines, RecordFile};

/// Bytes read at a time.
const BUFFER: usize = 1 << 18;
/// Characters of a bad field that a message quotes.
const QUOTED_CHARACTERS: usize = 40;

/// The lines of a file that hold something, one at a time.
struct LineReader<'a> {
    path: &'a Path,
    input: BufReader<File>,
    buffer: Vec<u8>,
    line: u64,
    /// The first blank line since the last line with content.
    blank: Option<u64>,
}

impl<'a> LineReader<'a> {
    fn new(path: &'a Path, file: File) -> Self {
        LineReader {
            path,
            input: BufReader::with_capacity(BUFFER, file),
            buffer: Vec::new(),
            line: 0,
            blank: None,
        }
    }

    /// Reads the next line that is neither blank nor a comment into `buffer`; false at the end.
    fn advance(&mut self) -> Result<bool> {
        self.blank = None;
        loop {
            self.buffer.clear();
            let count = self
                .input
                .read_until(b'\n', &mut self.buffer)
                .map_err(|e| Error::read(self.path, e))?;
            if count == 0 {
                return Ok(false);
            }
            self.line += 1;
            if self.line == 1 && self.buffer.starts_with(b"\xef\xbb\xbf") {
                self.buffer.drain(..3);
            }
            for end in [b'\n', b'\r'] {
                if self.buffer.last() == Some(&end) {
                    self.buffer.pop();
                }
            }
            match self.buffer.iter().find(|b| !b.is_ascii_whitespace()) {
                None => {
                    self.blank.get_or_insert(self.line);
                }
                Some(b'#') => {}
                Some(_) if self.buffer.contains(&b'\r') => return Err(self.error(LineProblem::CarriageReturn)),
                Some(_) => return Ok(true),
            }
        }
    }

    fn error(&self, problem: LineProblem) -> Error {
        Error::Line {
            path: self.path.to_owned(),
            line: self.line,
            problem,
        }
    }
}

/// Reads the text record `file`; `delimited` says that its name promises a header.
pub(crate) fn read(path: &Path, file: File, delimited: bool) -> Result<RecordFile> {
    let mut lines = LineReader::new(path, file);
    if !lines.advance()? {
        return Err(Error::Empty { path: path.to_owned() });
    }
    let layout = Layout::of(&lines.buffer, delimited).map_err(|problem| lines.error(problem))?;
    if layout.has_header() && !lines.advance()? {
        return Err(Error::NoSamples {
            path: path.to_owned(),
            names: layout.names,
        });
    }
    let mut columns = vec![Vec::new(); layout.names.len()];
    let mut origin = Lines::default();
    let mut sample = 0;
    loop {
        origin.note(sample, lines.line);
        layout
            .parse(&lines.buffer, sample, &mut columns)
            .map_err(|problem| lines.error(problem))?;
        sample += 1;
        if !lines.advance()? {
            break;
        }
        if let Some(line) = lines.blank {
            return Err(Error::Line {
                path: path.to_owned(),
                line,
                problem: LineProblem::Blank,
            });
        }
    }
    let columns = layout.names.into_iter().zip(columns);
    let record = Record::new(columns).map_err(|error| Error::data(path, error))?;
    Ok(RecordFile {
        lines: origin,
        ..RecordFile::new(record, path)
    })
}

/// The whole text of a file.
///
/// # Errors
/// [`Error::Read`], also for text that is not UTF-8.
pub fn read_text(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    std::fs::read_to_string(path).map_err(|cause| Error::read(path, cause))
}

/// How the lines of a file are laid out.
struct Layout {
    names: Vec<String>,
    /// The byte between fields; `None`: whitespace, and no header.
    separator: Option<u8>,
}

impl Layout {
    /// Decides from the first line with content.
    fn of(line: &[u8], delimited: bool) -> std::result::Result<Self, LineProblem> {
        let outside = outside_quotes(line);
        let has = |byte| outside.contains(&byte);
        let words = || line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        let separator = match (has(b','), has(b';')) {
            (true, true) => return Err(LineProblem::MixedSeparators),
            (true, false) => b',',
            (false, true) => b';',
            (false, false) if words().all(|w| looks_numeric(w) || number(w).is_some()) && !delimited => {
                let names = (0..words().count()).map(|i| format!("c{i}")).collect();
                return Ok(Layout { names, separator: None });
            }
            (false, false) if outside.trim_ascii().contains(&b'\t') => b'\t',
            (false, false) => {
                // Quoted names leave nothing but their quotation marks outside.
                if let Some(word) = words().next().filter(|w| looks_numeric(w)) {
                    return Err(LineProblem::NumericHeader { text: shorten(word) });
                }
                if outside.trim_ascii().contains(&b' ') {
                    return Err(LineProblem::SpacedHeader);
                }
                b','
            }
        };
        Ok(Layout {
            names: header(line, separator)?,
            separator: Some(separator),
        })
    }

    fn has_header(&self) -> bool {
        self.separator.is_some()
    }

    /// Appends the numbers of one line, which is `sample`, to the columns.
    fn parse(&self, line: &[u8], sample: usize, columns: &mut [Vec<f64>]) -> std::result::Result<(), LineProblem> {
        let Some(separator) = self.separator else {
            let words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
            return self.push(words, sample, columns);
        };
        if line.contains(&b'"') {
            let fields = quoted_fields(line, separator)?;
            return self.push(fields.iter().map(|f| f.text.as_ref()), sample, columns);
        }
        self.push(line.split(|&b| b == separator), sample, columns)
    }

    fn push<'a>(
        &self,
        mut fields: impl Iterator<Item = &'a [u8]>,
        sample: usize,
        columns: &mut [Vec<f64>],
    ) -> std::result::Result<(), LineProblem> {
        let expected = columns.len();
        for (i, column) in columns.iter_mut().enumerate() {
            let Some(field) = fields.next() else {
                return Err(LineProblem::Ragged { found: i, expected });
            };
            let field = field.trim_ascii();
            let value = if field.is_empty() {
                Some(f64::NAN)
            } else {
                number(field)
            };
            let Some(value) = value else {
                return Err(LineProblem::NotANumber {
                    column: self.names[i].clone(),
                    sample,
                    text: shorten(field),
                });
            };
            column.push(value);
        }
        match fields.count() {
            0 => Ok(()),
            more => Err(LineProblem::Ragged {
                found: expected + more,
                expected,
            }),
        }
    }
}

/// One field of a line, unquoted and trimmed unless it was quoted.
struct Field<'a> {
    text: Cow<'a, [u8]>,
    quoted: bool,
}

/// The names of a header line: none empty, none twice, none a bare number.
fn header(line: &[u8], separator: u8) -> std::result::Result<Vec<String>, LineProblem> {
    let mut names: Vec<String> = Vec::new();
    for (i, field) in quoted_fields(line, separator)?.into_iter().enumerate() {
        if field.text.is_empty() {
            return Err(LineProblem::UnnamedColumn { column: i + 1 });
        }
        if !field.quoted && looks_numeric(&field.text) {
            return Err(LineProblem::NumericHeader {
                text: shorten(&field.text),
            });
        }
        let name = String::from_utf8(field.text.into_owned()).map_err(|_| LineProblem::NotUtf8)?;
        if let Some(first) = names.iter().position(|n| *n == name) {
            return Err(LineProblem::DuplicateName {
                name,
                first: first + 1,
                second: i + 1,
            });
        }
        names.push(name);
    }
    Ok(names)
}

/// Splits a line at the separators outside quotation marks; `""` within them is one mark (RFC 4180).
fn quoted_fields(line: &[u8], separator: u8) -> std::result::Result<Vec<Field<'_>>, LineProblem> {
    let mut fields = Vec::new();
    let mut rest = Some(line);
    while let Some(start) = rest {
        let text = start.trim_ascii_start();
        let quoted = text.first() == Some(&b'"') && separator != b'"';
        let (text, after) = if quoted {
            let (text, after) = unquote(&text[1..]).ok_or(LineProblem::UnclosedQuote)?;
            let gap = after.iter().position(|&b| b == separator).unwrap_or(after.len());
            if !after[..gap].trim_ascii().is_empty() {
                return Err(LineProblem::UnclosedQuote);
            }
            (Cow::Owned(text), after.get(gap + 1..))
        } else {
            let end = start.iter().position(|&b| b == separator).unwrap_or(start.len());
            (Cow::Borrowed(start[..end].trim_ascii()), start.get(end + 1..))
        };
        fields.push(Field { text, quoted });
        rest = after;
    }
    Ok(fields)
}

/// The text up to the closing quotation mark, and what follows that mark.
fn unquote(mut rest: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let mut text = Vec::new();
    loop {
        let mark = rest.iter().position(|&b| b == b'"')?;
        text.extend_from_slice(&rest[..mark]);
        rest = &rest[mark + 1..];
        if rest.first() != Some(&b'"') {
            return Some((text, rest));
        }
        text.push(b'"');
        rest = &rest[1..];
    }
}

/// The bytes of a line that are not between quotation marks.
fn outside_quotes(line: &[u8]) -> Vec<u8> {
    let mut quoted = false;
    line.iter()
        .copied()
        .filter(|&b| {
            quoted ^= b == b'"';
            !quoted
        })
        .collect()
}

fn number(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Whether this is a number and cannot be a name: `nan` and `inf` could be names.
pub(crate) fn looks_numeric(field: &[u8]) -> bool {
    matches!(field.first(), Some(b'0'..=b'9' | b'+' | b'-' | b'.')) && number(field).is_some()
}

fn shorten(field: &[u8]) -> String {
    let text = String::from_utf8_lossy(field);
    let mut short: String = text.chars().take(QUOTED_CHARACTERS).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}
