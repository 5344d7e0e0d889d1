//! The page of a regression: checked, reduced to what is plotted, and put into text.

mod check;
mod payload;
mod scatter;
mod text;

pub(crate) use check::{check, surface as check_surface};
pub(crate) use payload::{SurfacePlot, payload, surface};
pub(crate) use scatter::{Cloud, cloud};
pub(crate) use text::text;
