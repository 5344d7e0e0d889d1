//! Several axes of one log, each of them treated alone: a table, one JSON object and one page.
//!
//! An axis that cannot be identified gets a row with its error; the others go on.

use anyhow::{Result, bail};
use flexure::text::{readable, uncapitalised};
use flexure_report::data::{JointPage, Table};
use serde_json::{Value, json};

use super::later::Later;
use super::row::{COLUMNS, DRIVE, Quantity, Row};
use super::text::typeset;
use super::{Curves, Joint, Trial, Units};
use crate::lines::{Lines, Tone};

/// The most axes of one log.
pub const MOST_AXES: usize = 100;

/// An identified axis, tried out.
pub struct IdentifiedAxis {
    /// What was identified.
    pub joint: Box<dyn Joint>,
    /// What it does when simulated, and on another log.
    pub trial: Trial,
    /// What to know of its columns.
    pub remark: Option<String>,
}

/// An axis to identify.
#[derive(Debug, Clone)]
pub struct NamedAxis {
    /// What distinguishes it.
    pub name: String,
    /// Whether it moves along a line.
    pub prismatic: bool,
}

/// One of several axes.
pub struct Axis {
    /// What distinguishes it.
    pub name: String,
    prismatic: bool,
    /// What was found, or why nothing was.
    pub identified: Result<IdentifiedAxis>,
}

/// Several axes of a log.
pub struct Axes {
    /// The log's name.
    log: String,
    /// The axes, in the order in which they were asked for.
    pub axes: Vec<Axis>,
}

impl Axes {
    /// Identifies the axes, one after the other.
    ///
    /// # Errors
    /// If no axis can be identified.
    pub fn new(
        log: &str,
        axes: Vec<NamedAxis>,
        identify: impl Fn(usize, &NamedAxis) -> Result<IdentifiedAxis>,
    ) -> Result<Axes> {
        let axis = |(i, axis): (usize, NamedAxis)| Axis {
            identified: identify(i, &axis),
            prismatic: axis.prismatic,
            name: axis.name,
        };
        let axes: Vec<Axis> = axes.into_iter().enumerate().map(axis).collect();
        if axes.iter().all(|axis| axis.identified.is_err()) {
            let each = axes.iter().filter_map(|axis| {
                let error = axis.identified.as_ref().err()?;
                Some(format!("axis {}: {error:#}", axis.name))
            });
            bail!(
                "{log}: none of the axes can be identified; {}",
                each.collect::<Vec<_>>().join("; ")
            );
        }
        Ok(Axes {
            log: log.to_owned(),
            axes,
        })
    }

    /// The results, one object per axis.
    pub fn json(&self) -> Value {
        let axes = self.axes.iter().map(|axis| {
            let mut object = match &axis.identified {
                Err(error) => json!({ "error": format!("{error:#}") }),
                Ok(found) => {
                    let mut object = found.joint.tried_json(&found.trial);
                    object["remark"] = json!(found.remark);
                    object["row"] = found.row().json();
                    object
                }
            };
            object["axis"] = json!(axis.name);
            object
        });
        json!({ "joint": "axes", "axes": axes.collect::<Vec<_>>() })
    }

    /// The table, and what to know of every axis.
    pub fn summary(&self) -> Lines {
        let mut lines = Lines::new();
        lines.headline(self.tone(), self.headline());
        let mut rows = vec![self.columns()];
        rows.extend(self.rows());
        let last = rows[0].len() - 1;
        lines.table(&rows, &[0, last]);
        for axis in &self.axes {
            let label = format!("axis {}:", axis.name);
            for (tone, text) in axis.notes() {
                lines.marked(tone, &label, text);
            }
        }
        lines
    }

    /// The page that shows all axes in sections, without the command that makes it again.
    pub fn page(&self) -> JointPage {
        let overview = Table {
            title: "All axes".to_owned(),
            text: format!(
                "Each axis is identified {}. Friction is that of Coulomb and viscous friction with an offset; the sections below have the \
                 curves and the other forms. “Cannot tell” stands for what the data do not determine.",
                self.how()
            ),
            columns: self.columns().iter().map(|name| typeset(name)).collect(),
            rows: self.rows().collect(),
            chosen: None,
            ends_in_text: true,
        };
        JointPage {
            title: format!("Axes of {}", self.log),
            subtitle: format!("{}.", self.headline()),
            overview: Some(overview),
            axes: self.axes.iter().map(Axis::page).collect(),
            ..JointPage::default()
        }
    }

    /// The page as HTML; `command` makes it again, and `python` in Python.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, command: Option<String>, python: Option<String>) -> Result<String> {
        super::html(JointPage {
            command,
            python,
            ..self.page()
        })
    }

    /// The curves of every axis that was identified, with its name.
    ///
    /// # Errors
    /// For curves that cannot be written.
    pub fn curves(&self) -> flexure::Result<Vec<(&str, Curves)>> {
        let mut all = Vec::new();
        for axis in &self.axes {
            if let Ok(found) = &axis.identified {
                let curves = found.joint.curves()?;
                all.extend(curves.into_iter().map(|curves| (axis.name.as_str(), curves)));
            }
        }
        Ok(all)
    }

    fn headline(&self) -> String {
        let identified = self.axes.iter().filter(|axis| axis.identified.is_ok()).count();
        let holds = self.axes.iter().filter(|axis| axis.holds()).count();
        format!(
            "{identified} of {} axes identified, each {}; {holds} {}",
            self.axes.len(),
            self.how(),
            if holds == 1 { "holds" } else { "hold" }
        )
    }

    /// How each axis was taken: alone, or as a joint of a chain.
    fn how(&self) -> String {
        let found = self.axes.iter().filter_map(|axis| axis.identified.as_ref().ok());
        let chain = found.filter_map(|found| found.joint.of_chain()).next();
        chain.map_or_else(|| "alone".to_owned(), |chain| format!("as a joint of {}", chain.name()))
    }

    /// The columns of the table that some axis has.
    fn shown(&self) -> Vec<usize> {
        let has_drive = |axis: &Axis| {
            (axis.identified.as_ref()).is_ok_and(|found| found.row().quantities[DRIVE] != Quantity::Absent)
        };
        let drives = self.axes.iter().any(has_drive);
        (0..COLUMNS.len()).filter(|&i| i != DRIVE || drives).collect()
    }

    fn tone(&self) -> Tone {
        match (
            self.axes.iter().all(Axis::holds),
            self.axes.iter().all(|axis| axis.identified.is_ok()),
        ) {
            (true, _) => Tone::Good,
            (_, true) => Tone::Caution,
            _ => Tone::Bad,
        }
    }

    /// The names of the table's columns.
    fn columns(&self) -> Vec<String> {
        let any = |prismatic: bool| self.axes.iter().any(|axis| axis.prismatic == prismatic);
        let columns = self.shown().into_iter().map(|i| &COLUMNS[i]).map(|column| {
            let [turning, sliding] = [false, true].map(|prismatic| column.unit(&Units::of(prismatic)));
            match any(true) && any(false) && turning != sliding {
                true => format!("{}, {turning} ({sliding})", column.name),
                false => format!("{}, {}", column.name, if any(true) { sliding } else { turning }),
            }
        });
        let first = std::iter::once("axis".to_owned());
        first.chain(columns).chain(["verdict".to_owned()]).collect()
    }

    /// The table's rows.
    fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        let shown = self.shown();
        self.axes.iter().map(move |axis| {
            let (quantities, verdict) = match &axis.identified {
                Ok(found) => {
                    let row = found.row();
                    (row.quantities.map(|q| q.text()), row.verdict)
                }
                Err(_) => (COLUMNS.each_ref().map(|_| Quantity::Absent.text()), "not identified"),
            };
            let name = std::iter::once(readable(&axis.name));
            let quantities = shown.iter().map(|&i| quantities[i].clone());
            name.chain(quantities).chain([verdict.to_owned()]).collect()
        })
    }
}

impl IdentifiedAxis {
    fn row(&self) -> Row {
        self.joint.row(&self.trial)
    }
}

impl Axis {
    fn holds(&self) -> bool {
        self.identified.as_ref().is_ok_and(|found| found.row().holds)
    }

    /// Notes on the axis: on its columns, then its findings; or its error.
    fn notes(&self) -> Vec<(Tone, String)> {
        let units = &Units::of(self.prismatic);
        match &self.identified {
            Err(error) => vec![(Tone::Bad, format!("{error:#}"))],
            Ok(found) => {
                let findings = found.joint.findings();
                let findings = findings.iter().map(ToString::to_string);
                let notes = found.remark.iter().cloned().chain(findings);
                let notes = notes.map(|note| (Tone::Caution, note));
                let later = found.trial.later.as_ref().map(|later| {
                    let tone = if later.holds() { Tone::Plain } else { Tone::Caution };
                    let text = later.text(found.joint.log(), units);
                    (tone, format!("{}: {text}", later.outcome()))
                });
                let row = found.row();
                // What it does on another log has a line of its own.
                let later_holds = found.trial.later.as_ref().is_none_or(Later::holds);
                let why = (!row.holds && later_holds).then_some((Tone::Caution, uncapitalised(&row.why)));
                let chain = found.joint.of_chain().map(|chain| (Tone::Plain, chain.text(units)));
                why.into_iter().chain(chain).chain(notes).chain(later).collect()
            }
        }
    }

    /// Its section of the page.
    fn page(&self) -> JointPage {
        let name = format!("Axis {}", self.name);
        match &self.identified {
            Err(error) => JointPage {
                title: format!("{name}: not identified"),
                subtitle: format!("{error:#}."),
                ..JointPage::default()
            },
            Ok(found) => {
                let mut page = found.joint.page(&found.trial);
                page.title = format!("{name}: {}", page.title.to_lowercase());
                page.warnings.splice(0..0, found.remark.clone());
                page
            }
        }
    }
}
