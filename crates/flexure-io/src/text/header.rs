//! Names and units of columns: whether the first rows have them, or a comment above the first row.

use std::collections::HashSet;

use super::fields::{Line, is_identifier, is_rule, rows};
use super::{columns, numbers};
use crate::error::LineProblem;
use crate::options::ReadOptions;
use crate::time::is_time;
use crate::units::split_unit;

/// Whether the first row is a header.
///
/// # Errors
/// For a row that may be a header or a sample.
pub(super) fn has_header(rows: &[Vec<String>], options: &ReadOptions) -> Result<bool, LineProblem> {
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

/// Whether the second row has units.
pub(super) fn has_units(rows: &[Vec<String>], options: &ReadOptions) -> bool {
    let [_, second, third, ..] = rows else { return false };
    let is_text = |field: &String| !columns::is_readable(field, options) && !numbers::has_unit(field, options);
    // Some instruments write a setting there, into a column without samples.
    let is_setting = |i: usize| rows[2..].iter().all(|row| row.get(i).is_none_or(String::is_empty));
    let is_unit = |(i, field): (usize, &String)| is_text(field) || could_be_name(field) || is_setting(i);
    !is_rule(second.iter().map(|field| field.as_bytes()))
        && second.iter().any(is_text)
        && second.iter().enumerate().all(is_unit)
        && second
            .iter()
            .zip(third)
            .any(|(unit, value)| is_text(unit) && !is_text(value))
}

/// A unit from a row of units: with or without brackets.
pub(super) fn unit_text(field: &str) -> Option<String> {
    let text = field.trim_matches(['[', ']', '(', ')']).trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// The names in a comment directly above the first row, as NumPy writes them, and the line of the comment.
///
/// The comment is divided like the rows, and has as many fields: names that differ. Between spaces these must be names beyond doubt:
/// see [`are_names`]. Of two comments that could both have the names, the second is taken if it has one of time: otherwise it may have the units.
pub(super) fn names_in_comment(
    head: &[u8],
    first: u64,
    separator: Option<u8>,
    samples: &[Vec<String>],
    options: &ReadOptions,
) -> Option<(Vec<String>, u64)> {
    let names = |line: u64| {
        let text = head
            .split(|&b| b == b'\n')
            .nth(usize::try_from(line.checked_sub(1)?).ok()?)?;
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text).trim_ascii();
        let bytes = text.strip_prefix(b"#")?.trim_ascii_start().to_vec();
        let names = rows(&[Line { number: line, bytes }], separator).pop()?;
        let differ = names.iter().collect::<HashSet<_>>().len() == names.len();
        // Settings such as `rate = 100` or `rig: 5` are no names.
        let is_setting = |name: &String| name.contains('=') || name.contains(": ");
        let is_number = |name: &String| numbers::readable_number(name, options).is_some();
        let is_name = |name: &String| !(name.is_empty() || is_number(name) || is_setting(name));
        let fits = names.len() > 1 && names.len() == samples[0].len() && differ && names.iter().all(is_name);
        fits.then_some(names)
    };
    let line = first.checked_sub(1).filter(|line| *line > options.skip)?;
    let found = names(line)?;
    let has_time = || found.iter().any(|name| is_time(&split_unit(name).0));
    let is_certain = match separator {
        None => are_names(&found, samples, options),
        Some(_) => has_time() || names(line - 1).is_none(),
    };
    is_certain.then_some((found, line))
}

/// Whether words are the names of the columns, and no sentence of as many words: one is a name of time, above numbers that increase, and the
/// others look like names of variables.
pub(super) fn are_names(words: &[String], samples: &[Vec<String>], options: &ReadOptions) -> bool {
    let time = words.iter().position(|word| is_time(&split_unit(word).0));
    words.len() == samples[0].len()
        && words.iter().all(|word| is_identifier(word))
        && time.is_some_and(|time| increases(samples, time, options))
}

/// Whether a column of the first rows increases.
fn increases(samples: &[Vec<String>], column: usize, options: &ReadOptions) -> bool {
    let value = |row: &Vec<String>| numbers::readable_number(row.get(column)?, options);
    let values: Vec<Option<f64>> = samples.iter().map(value).collect();
    values.windows(2).all(|pair| pair[0].is_some() && pair[0] < pair[1])
}
