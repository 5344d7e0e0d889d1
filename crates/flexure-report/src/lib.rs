//! One self-contained offline HTML page that shows an identification, a regression or a convergence study.
//!
//! [`render`] turns a [`data::Page`] of plain values, [`render_regression`] a [`data::RegressionPage`] and [`render_study`] a
//! [`data::StudyPage`] into one HTML document: style, scripts, plots ([uPlot], embedded) and data are all inside, nothing is ever fetched, and a content security policy in the page forbids it. The text is
//! ordinary HTML, readable without scripts; the data ride along as JSON for the plots.
//!
//! How large records stay small is described in [`limits`].
//!
//! [uPlot]: https://github.com/leeoniya/uPlot

mod check;
pub mod data;
mod decimate;
mod error;
mod joint;
pub mod limits;
mod payload;
mod regression;
mod render;
mod study;
mod text;

pub use error::{Error, Result};
pub use render::{render, render_joint, render_regression, render_study};
