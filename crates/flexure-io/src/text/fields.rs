//! The lines with content of the beginning of a file, and their fields.

use std::io::Read;

use super::content;
use super::lines::Lines;

/// What may separate the columns, besides spaces.
pub(super) const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// A line with content.
pub(super) struct Line {
    pub(super) number: u64,
    pub(super) bytes: Vec<u8>,
}

/// The first lines with content.
pub(super) fn first_lines(head: &[u8], skip: u64, count: usize) -> Vec<Line> {
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

/// The fields of the lines.
pub(super) fn rows(lines: &[Line], separator: Option<u8>) -> Vec<Vec<String>> {
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

/// Whether a row is a line between header and samples, as tables for reading have it: `|---|:--:|`.
pub(super) fn is_rule<'a>(row: impl Iterator<Item = &'a [u8]>) -> bool {
    let fields: Vec<&[u8]> = row.map(content).filter(|field| !field.is_empty()).collect();
    fields.len() > 1 && fields.into_iter().all(is_drawn)
}

/// Whether a field is a drawn line, such as `-----`. It may also be a missing sample.
pub(super) fn is_drawn(field: &[u8]) -> bool {
    field.len() >= 3 && field.iter().all(|b| b"-=:+".contains(b))
}

/// Whether a text looks like the name of a variable.
pub(super) fn is_identifier(name: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || "_./[]()%°".contains(c);
    name.starts_with(char::is_alphabetic) && name.chars().all(is_part)
}

/// Characters of a bad field that a message quotes.
const QUOTED_CHARACTERS: usize = 40;

/// What to do about fields with names, if this is one.
pub(super) fn named_fields(field: &str) -> &'static str {
    match field.split_once('=') {
        Some((name, _)) if is_identifier(name) => {
            " (fields such as t=0.01 are read where all rows have the same names)"
        }
        _ => "",
    }
}

/// A field as a message quotes it.
pub(super) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(QUOTED_CHARACTERS).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}
