//! The page of a regression: checked, reduced to what is plotted, and put into words.

mod check;
mod payload;
mod scatter;
mod text;

pub(crate) use check::check;
pub(crate) use payload::payload;
pub(crate) use scatter::{Cloud, cloud};
pub(crate) use text::text;
