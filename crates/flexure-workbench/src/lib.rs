//! From a record to its result: a first look, identification, regression and joints, with their warnings. The result is text, JSON, a model
//! file or a page.
//!
//! The command line and the Python package both work through this crate, so that they give the same numbers and the same text. It reads no
//! options and knows no terminal: text is [`Lines`](lines::Lines), which the caller wraps; progress is reported to a callback.

pub mod chains;
pub mod control;
pub mod demo;
pub mod export;
pub mod fleet;
pub mod joints;
mod labels;
pub mod lines;
pub mod look;
mod named;
mod plots;
pub mod preparation;
pub mod regression;
pub mod study;
pub mod systems;
pub mod text;

pub use named::{Named, NamedValue, Spelling};
