//! The columns of a record that a system connects.

/// The names of the columns of a system's signals.
#[derive(Debug, Clone, Copy)]
pub struct SystemColumns<'a> {
    /// The inputs' columns.
    pub inputs: &'a [&'a str],
    /// The output's column.
    pub output: &'a str,
}
