//! Rows below a table: totals, marks of the end, and rows that were cut off.

use std::ops::Range;

use super::columns::Column;
use crate::error::LineProblem;
use crate::record_file::SampleLines;

/// The most rows below a table. Convention.
const MOST: usize = 5;
/// The fewest samples of a table below which such rows are looked for. Convention: in less, a row that differs is no exception.
const FEWEST: usize = 20;

/// Notes that a sample is nothing but separators. Only the runs of such samples that may end the table are kept.
pub(super) fn note_empty(empty: &mut Vec<Range<usize>>, sample: usize) {
    match empty.last_mut().filter(|run| run.end == sample) {
        Some(run) => run.end += 1,
        None => empty.push(sample..sample + 1),
    }
    if empty.len() > MOST + 1 {
        empty.remove(0);
    }
}

/// The end of the samples before `end` without those of nothing but separators with which they end, unless all are such.
fn without_empty(empty: &[Range<usize>], end: usize) -> usize {
    let run = empty
        .iter()
        .find(|run| run.start > 0 && run.start < end && end <= run.end);
    run.map_or(end, |run| run.start)
}

/// The rows that cannot be samples since they have another number of fields.
#[derive(Default)]
pub(super) struct Below {
    /// The number of samples before the first of them, with its problem.
    first: Option<(usize, (u64, LineProblem))>,
    count: usize,
}

impl Below {
    /// Adds a row behind `samples` samples.
    ///
    /// # Errors
    /// The problem of the first row, if these rows cannot stand below a table.
    pub(super) fn add(&mut self, samples: usize, problem: (u64, LineProblem)) -> Result<(), (u64, LineProblem)> {
        self.count += 1;
        let is_shape = matches!(problem.1, LineProblem::Ragged { .. });
        let (_, first) = self.first.get_or_insert((samples, problem.clone()));
        match is_shape && samples >= FEWEST && self.count <= MOST {
            true => Ok(()),
            false if is_shape => Err(first.clone()),
            false => Err(problem),
        }
    }

    /// Cuts the rows that stand below the table off the columns; returns a sentence on them. They are at most a few
    /// rows at the end, of which each has texts where the table has numbers, or another number of fields. Rows of nothing but separators, `empty`,
    /// end the table too, as blank lines do.
    ///
    /// # Errors
    /// The problem of a row with another number of fields that samples follow.
    pub(super) fn cut(
        self,
        columns: &mut [Column],
        samples: usize,
        empty: &[Range<usize>],
        lines: &SampleLines,
        last_line: u64,
    ) -> Result<Option<String>, (u64, LineProblem)> {
        let fewest = FEWEST.max((samples + self.count).saturating_sub(MOST));
        let texts = columns
            .iter()
            .filter_map(Column::ends_before)
            .filter(|end| *end >= fewest);
        let end = without_empty(empty, texts.min().unwrap_or(samples));
        if let Some((_, problem)) = self.first.clone().filter(|(before, _)| *before < end) {
            return Err(problem);
        }
        if end == samples && self.first.is_none() {
            return Ok(None);
        }
        columns.iter_mut().for_each(|column| column.truncate(end));
        let of_shape = self.first.map(|(_, (line, _))| line);
        // A text below these rows is said apart.
        let last_row = lines.get(samples.saturating_sub(1)).filter(|_| of_shape.is_none());
        let last_line = last_row.unwrap_or(last_line);
        let of_text = lines.get(end).filter(|_| end < samples);
        let first = of_shape.into_iter().chain(of_text).min().unwrap_or(last_line);
        Ok(Some(match last_line > first {
            true => format!("lines {first} to {last_line} stand below the table and are left out"),
            false => format!("line {first} stands below the table and is left out"),
        }))
    }
}
