//! What can be wrong with a page's data.

/// Why a page could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Two lists that belong together differ in length.
    #[error("{part} has {got} values where {need} are needed: give one for each {each}")]
    Length {
        /// The list at fault, as a path into [`crate::data::Page`].
        part: String,
        /// Its length.
        got: usize,
        /// The length it should have.
        need: usize,
        /// What it should have one value for.
        each: &'static str,
    },
    /// The abscissas of a plot are not finite and increasing.
    #[error("{part}[{index}] = {value} is not a finite value above the one before it: sort the abscissas")]
    NotIncreasing {
        /// The list at fault, as a path into [`crate::data::Page`].
        part: String,
        /// The first offending entry, counted from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A logarithmic axis with values that have no logarithm.
    #[error("{part}[0] = {value} has no logarithm: leave out candidates that are not positive, or take a linear axis")]
    NotPositive {
        /// The list at fault, as a path into [`crate::data::Page`].
        part: String,
        /// The offending value.
        value: f64,
    },
    /// An evenly spaced axis with an unusable start or step.
    #[error("{part} starts at {start} and steps by {step}: the start must be finite, the step finite and positive")]
    Axis {
        /// The axis at fault, as a path into [`crate::data::Page`].
        part: String,
        /// Its start.
        start: f64,
        /// Its step.
        step: f64,
    },
    /// An arm whose links have no length.
    #[error("arm.lengths[{index}] = {value}: a link's length must be finite and positive, in metres")]
    LinkLength {
        /// The link, 0 or 1.
        index: usize,
        /// Its length.
        value: f64,
    },
    /// The data could not be written as JSON.
    #[error("the page's data could not be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// The page's template failed.
    #[error("the page's template could not be filled in: {0}")]
    Template(#[from] minijinja::Error),
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
