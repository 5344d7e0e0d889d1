//! Everything that can go wrong, with the facts in the fields.
//!
//! Messages say what is wrong, where, and what to do about it; samples are counted from 0.

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What was wrong with the data, the parameters or the computation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A record has no column of this name.
    #[error("no column '{name}'; the columns are: {}", .available.join(", "))]
    MissingColumn {
        /// The name that was asked for.
        name: String,
        /// The names that exist, in order.
        available: Vec<String>,
    },
    /// Two columns of a record have the same name.
    #[error("two columns are named '{name}'; column names must differ")]
    DuplicateColumn {
        /// The name that occurs twice.
        name: String,
    },
    /// Two sequences that belong together differ in length.
    #[error("'{name}' has {got} samples where {expected} were expected; all columns must have the same length")]
    LengthMismatch {
        /// The offending sequence.
        name: String,
        /// Its length.
        got: usize,
        /// The length of the others.
        expected: usize,
    },
    /// A sample is NaN or infinite.
    #[error("column '{column}' is {value} at sample {sample}; remove or repair that sample")]
    NonFinite {
        /// The column's name.
        column: String,
        /// The sample's index, from 0.
        sample: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A signal that must vary does not.
    #[error("column '{column}' is constant ({value}); nothing can be identified from it")]
    Constant {
        /// The column's name.
        column: String,
        /// Its one value.
        value: f64,
    },
    /// There are fewer samples than the computation needs.
    #[error("{what} needs at least {need} samples, but there are {got}")]
    TooShort {
        /// What was to be computed.
        what: &'static str,
        /// The smallest number of samples that will do.
        need: usize,
        /// The number there is.
        got: usize,
    },
    /// The time column's steps differ.
    #[error(
        "the sample times are not uniform: the step to sample {sample} is {step} s, but the typical step is {expected} s; resample the record to a uniform time"
    )]
    NonUniformTime {
        /// The sample at the end of the odd step, from 0.
        sample: usize,
        /// The odd step, s.
        step: f64,
        /// The median step, s.
        expected: f64,
    },
    /// A parameter is outside its valid range.
    #[error("{name} is {value}, but must be {requirement}")]
    InvalidParameter {
        /// The parameter's name.
        name: String,
        /// The value that was given.
        value: f64,
        /// The valid range in words, for example "positive and finite".
        requirement: &'static str,
    },
    /// A study was stopped from outside.
    #[error("stopped after {done} of {total} samples, as asked")]
    Stopped {
        /// The samples simulated so far.
        done: usize,
        /// Those of the whole study.
        total: usize,
    },
    /// A signal that must vary does not in a part of the record.
    #[error(
        "column '{column}' is constant ({value}) at samples {first} to {last}, which are {purpose}; cut them off, or change the fresh share"
    )]
    ConstantPart {
        /// The column's name.
        column: String,
        /// Its value there.
        value: f64,
        /// The part's first sample.
        first: usize,
        /// The part's last sample.
        last: usize,
        /// What the part is needed for.
        purpose: &'static str,
    },
}
