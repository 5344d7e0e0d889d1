//! What the page of a joint shows.

use serde::Serialize;

use super::{Fact, Flow, Nonlinearity, Prediction, Scatter, Table, Verdict};

/// Everything on the page of a joint's friction and stiffness, or of several axes that were treated alone.
#[derive(Debug, Clone, Default, Serialize)]
pub struct JointPage {
    /// The heading.
    pub title: String,
    /// One sentence below it: what was identified from what.
    pub subtitle: String,
    /// Whether the identified joint explains the motion.
    pub verdict: Option<Verdict>,
    /// The joint as a block diagram, above the numbers of the whole page.
    pub diagram: Option<Flow>,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// The estimated curves.
    pub curves: Vec<JointCurve>,
    /// The physical parameters of the forms that were kept, one table per form.
    pub tables: Vec<ParameterTable>,
    /// The other forms that were tried, a row per form.
    pub others: Option<Table>,
    /// Measured against reconstructed and simulated signals.
    pub motions: Vec<Comparison>,
    /// The results of several axes side by side, a row per axis.
    pub overview: Option<Table>,
    /// Several axes, a section each.
    pub axes: Vec<JointPage>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
    /// The same in Python.
    pub python: Option<String>,
}

/// An estimated curve over its data.
#[derive(Debug, Clone, Serialize)]
pub struct JointCurve {
    /// For example "Friction".
    pub heading: String,
    /// A sentence below the plot.
    pub caption: String,
    /// The curve with its band; its `truth` is the physical form fitted to it, or the simulated truth.
    pub curve: Nonlinearity,
    /// The legend's name for `truth`: "form" or "truth".
    pub dashed: &'static str,
    /// Its data, or none.
    pub points: Scatter,
}

impl JointCurve {
    /// A curve over its data.
    pub fn new(heading: impl Into<String>, caption: impl Into<String>, curve: Nonlinearity, points: Scatter) -> Self {
        JointCurve {
            heading: heading.into(),
            caption: caption.into(),
            curve,
            dashed: "form",
            points,
        }
    }
}

/// The parameters of a form.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterTable {
    /// The form.
    pub heading: String,
    /// Symbol, and value with error and unit.
    pub rows: Vec<[String; 2]>,
    /// A sentence below it.
    pub note: String,
}

/// A measured signal against a computed one.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// What is compared.
    pub heading: String,
    /// What the legend calls the measured signal and the computed one.
    pub names: [&'static str; 2],
    /// The signals.
    pub prediction: Prediction,
    /// What else is to be known of how near they are; empty if nothing.
    pub remark: String,
}
