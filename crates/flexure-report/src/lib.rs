//! One self-contained offline HTML page that shows a first look at a record, an identification, a regression, a convergence study or a moving chain.
//!
//! [`render`] turns a [`data::Page`] of plain values, [`render_joint`] a [`data::JointPage`], and so on, into one HTML document. Style, scripts,
//! plots ([uPlot], embedded) and data are all inside. Nothing is ever fetched, and a content security policy in the page forbids it.
//! The text is ordinary HTML, readable without scripts; the data ride along as JSON for the plots.
//!
//! How large records stay small is described in [`limits`].
//!
//! [uPlot]: https://github.com/leeoniya/uPlot

mod check;
mod comparison;
mod control;
pub mod data;
mod decimate;
mod diagram;
mod error;
mod joint;
pub mod limits;
mod look;
mod motion;
mod payload;
mod regression;
mod render;
mod study;
mod text;
mod typeset;

/// The style of all pages, for use on other pages.
pub const STYLE: &str = include_str!("../assets/page.css");

pub use error::{Error, Result};
pub use render::{
    render, render_comparison, render_control, render_joint, render_look, render_motion, render_regression,
    render_study,
};
