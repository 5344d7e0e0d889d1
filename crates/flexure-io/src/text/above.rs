//! A table below other lines.

use super::fields::{SEPARATORS, first_lines, is_drawn, rows};
use super::header::are_names;
use super::{columns, numbers};
use crate::options::ReadOptions;

/// How many lines are searched for a table below other lines, and the fewest lines that such a table must have.
pub(super) const SEARCHED_LINES: usize = 100;
const TABLE_LINES: usize = 3;

/// The most fields with content in a line above a table that is padded to its width.
pub(super) const PADDED: usize = 2;

/// The most lines of a header and units.
const HEADINGS: usize = 2;

/// A table below other lines.
pub(super) struct TableBelow {
    /// The line on which it seems to begin.
    pub(super) line: u64,
    /// Whether the lines above can be left out: the table has its own header and more fields than every line above, or each line above is a text
    /// that the separator of the table does not divide. Such a text may still have the names, between spaces.
    pub(super) is_sure: bool,
}

/// Looks for a table below other lines. The first line has another number of fields. The lines of the table have equally many, and numbers in the
/// same columns, except for a header and a line of units.
pub(super) fn table_below(head: &[u8], options: &ReadOptions) -> Option<TableBelow> {
    let lines = first_lines(head, options.skip, SEARCHED_LINES);
    let given = options
        .separator
        .map(|given| Some(given as u8).filter(|given| *given != b' '));
    // Where a separator divides all lines alike, none of them is only a text.
    let divides_all = |separator| {
        let rows = rows(&lines, Some(separator));
        let width = rows.first().map_or(0, Vec::len);
        width > 1 && rows.len() == lines.len() && rows.iter().all(|row| row.len() == width)
    };
    let has_texts = !SEPARATORS.into_iter().any(divides_all);
    let candidates = SEPARATORS.map(Some).into_iter().chain([None]);
    let candidates = candidates.filter(|separator| given.is_none_or(|given| given == *separator));
    let found = candidates.filter_map(|separator| {
        let rows = rows(&lines, separator);
        let rows = first_table(&rows, options).filter(|_| rows.len() == lines.len())?;
        let last = rows.last()?;
        let is_number =
            |field: &String| numbers::readable_number(field, options).is_some() || numbers::has_unit(field, options);
        let numbers: Vec<usize> = (0..last.len()).filter(|&i| is_number(&last[i])).collect();
        let is_readable = |field: &String| is_number(field) || columns::is_readable(field, options);
        let is_sample = |row: &Vec<String>| numbers.iter().all(|&i| is_readable(&row[i]));
        let is_heading = |row: &Vec<String>| numbers.iter().all(|&i| !is_readable(&row[i]));
        // Not every column has a unit, nor a name.
        let texts = |row: &Vec<String>| numbers.iter().filter(|&&i| !is_readable(&row[i])).count();
        let empty = |row: &Vec<String>| numbers.iter().filter(|&&i| row[i].is_empty()).count();
        let has_texts_only = |row: &Vec<String>| texts(row) > 0 && texts(row) + empty(row) == numbers.len();
        let is_mostly_filled = |row: &Vec<String>| texts(row) > empty(row);
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
        let headings = match &block[..samples] {
            [.., names, last] if is_heading(names) && has_texts_only(last) => HEADINGS,
            [.., last] if has_texts_only(last) && is_mostly_filled(last) => 1,
            _ => 0,
        };
        let has_lines_before =
            (padded > 0 || rows[0].len() != last.len()) && block.len() - samples + headings >= TABLE_LINES;
        let first = others + 1 + samples - headings;
        let above = &rows[..first];
        let has_header = headings > 0 && above.iter().all(|row| filled(row) < last.len());
        let is_text = |row: &Vec<String>| row.len() == 1 && (!is_readable(&row[0]) || is_drawn(row[0].as_bytes()));
        let words = |row: &Vec<String>| row[0].split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let is_below_texts = has_texts
            && headings == 0
            && options.header != Some(true)
            && numbers.len() > 1
            && above.iter().all(is_text)
            && above.last().is_none_or(|last| !are_names(&words(last), block, options))
            && separator.is_some_and(|separator| divides(separator, block));
        let is_sure = has_header || is_below_texts;
        // A table may have more lines of names than are read.
        let is_name = |&i: &usize| rows[i].len() == last.len() && has_texts_only(&rows[i]);
        let named = (others + 1..first).rev().take_while(is_name).last();
        let begins = named.filter(|_| !is_sure).unwrap_or(first);
        let table = || TableBelow {
            line: lines[begins].number,
            is_sure,
        };
        let is_divided = is_sure && separator.is_some();
        (has_lines_before && last.len() > 1 && !numbers.is_empty()).then(|| (is_divided, last.len(), table()))
    });
    // Where another separator divides the rows, spaces are parts of the fields.
    found
        .max_by_key(|(is_divided, width, table)| (table.is_sure, *is_divided, *width))
        .map(|(_, _, table)| table)
}

/// The rows up to the end of the first table, where its header is repeated: a logger started again. Otherwise all rows.
fn first_table<'a>(rows: &'a [Vec<String>], options: &ReadOptions) -> Option<&'a [Vec<String>]> {
    let is_text = |field: &String| !field.is_empty() && !columns::is_readable(field, options);
    let is_names = |row: &Vec<String>| {
        row.len() > 1 && row.iter().any(is_text) && row.iter().all(|field| field.is_empty() || is_text(field))
    };
    let begins_with_text = |row: &Vec<String>| row.iter().find(|field| !field.is_empty()).is_none_or(is_text);
    let is_sample = |row: &Vec<String>, names: &Vec<String>| row.len() == names.len() && !begins_with_text(row);
    let repeats = (0..rows.len()).filter(|&again| is_names(&rows[again])).find(|&again| {
        let names = rows[..again].iter().position(|row| *row == rows[again]);
        let between = names.map_or(&[][..], |names| &rows[names + 1..again]);
        between.iter().filter(|row| is_sample(row, &rows[again])).count() >= TABLE_LINES
    });
    let Some(again) = repeats else { return Some(rows) };
    let end = rows[..again].iter().rposition(|row| is_sample(row, &rows[again]))?;
    Some(&rows[..=end])
}

/// Whether a separator can only divide these rows. A comma may be a decimal sign, unless there are decimal points, or an odd number of fields.
fn divides(separator: u8, rows: &[Vec<String>]) -> bool {
    let any = |is: fn(&String) -> bool| rows.iter().flatten().any(is);
    separator != b','
        || any(|field| field.contains('.') && field.parse::<f64>().is_ok())
        || rows[0].len() % 2 == 1 && !any(|field| field.contains(char::is_whitespace))
}
