//! Rows between the samples and a header that is repeated: what a logger writes when it starts again.

use super::above::PADDED;
use super::content;
use super::layout::Layout;
use super::rows::is_text;
use crate::options::ReadOptions;

/// The most rows above a repeated header. Convention.
const MOST: usize = 100;

/// A row, its line, and the first of the blank lines directly above it.
pub(super) type Placed = (csv::ByteRecord, u64, Option<u64>);

/// Rows that may stand above a repeated header. They wait until the header comes, or a sample.
#[derive(Default)]
pub(super) struct Waiting(Vec<Placed>);

/// Whether more rows may follow a repeated header in any form. In a table of one column, a blank line may be a missing sample. Instants that
/// the heading states are those of one table.
pub(super) fn may_restart(layout: &Layout) -> bool {
    layout.heading_lines > 0 && layout.names.len() > 1 && layout.axis.is_none()
}

impl Waiting {
    /// Whether a row is to wait: a title, a setting with its name, or nothing but separators. The first row that waits may also be a sample of
    /// which only the beginning was written.
    pub(super) fn is_for(&self, row: &csv::ByteRecord, layout: &Layout, options: &ReadOptions) -> bool {
        let columns = layout.names.len();
        let is_filled = |field: &[u8]| !content(field).is_empty();
        // Most rows are samples: of these, one field is read here.
        if row.len() == columns && row.get(PADDED.min(columns.saturating_sub(1))).is_some_and(is_filled) {
            return false;
        }
        if !may_restart(layout) || self.0.len() == MOST {
            return false;
        }
        let filled = row.iter().rposition(is_filled).map_or(0, |i| i + 1);
        let is_short = filled <= PADDED && filled + 1 < columns;
        let is_cut = row.len() + usize::from(layout.may_lack_last) < columns;
        let is_odd = is_short || is_cut || filled > columns;
        let begins_with_text = || row.iter().next().is_some_and(|field| is_text(field, options));
        filled == 0 || (is_cut && self.0.is_empty()) || (is_odd && begins_with_text())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn add(&mut self, row: Placed) {
        self.0.push(row);
    }

    /// The rows, in order; none waits any longer.
    pub(super) fn take(&mut self) -> Vec<Placed> {
        std::mem::take(&mut self.0)
    }
}
