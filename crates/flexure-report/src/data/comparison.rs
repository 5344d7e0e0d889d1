//! What the page of several models on one record shows.

use serde::Serialize;

use super::{Comparison, Table};

/// Several models on one record.
#[derive(Debug, Clone, Serialize)]
pub struct ComparisonPage {
    /// The heading.
    pub title: String,
    /// One sentence below it: what was compared on what.
    pub subtitle: String,
    /// A row a model.
    pub table: Table,
    /// The output against each model's run, in the order of the rows.
    pub runs: Vec<Comparison>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}
