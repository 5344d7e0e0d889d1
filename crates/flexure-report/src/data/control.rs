//! What the page of a control scenario shows.

use serde::Serialize;

use super::{ArmMotion, Axis, Fact, Signal, Table};

/// Controllers of an arm, compared on one motion.
#[derive(Debug, Clone, Serialize)]
pub struct ControlPage {
    /// The heading.
    pub title: String,
    /// One sentence below it: what was compared on what.
    pub subtitle: String,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// A row per controller.
    pub table: Table,
    /// The tip over its reference, the reference first.
    pub paths: Vec<TipPathPlot>,
    /// Distances of the tip from its reference, and torques.
    pub signals: Vec<Signal>,
    /// The instants of the signals.
    pub time: Axis,
    /// The arm in motion.
    pub arm: Option<ArmMotion>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}

/// A path of the tip.
#[derive(Debug, Clone, Serialize)]
pub struct TipPathPlot {
    /// Whose it is.
    pub name: String,
    /// Abscissas, m.
    pub x: Vec<f64>,
    /// Ordinates, m, as many.
    pub y: Vec<f64>,
}
