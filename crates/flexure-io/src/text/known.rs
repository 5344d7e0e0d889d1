//! Files of loggers, programs and oscilloscopes whose first lines say what they are, and rows that name their fields.

use std::collections::HashSet;

use flexure::text::exact;

use super::above::SEARCHED_LINES;
use super::columns::{self, Axis};
use super::fields::{Line, SEPARATORS, first_lines, is_identifier, rows};
use super::layout::Layout;
use super::numbers;
use crate::options::ReadOptions;
use crate::time::SECOND;

/// How a file of Campbell's loggers begins.
const TOA5: [&[u8]; 2] = [b"\"TOA5\",", b"TOA5,"];

/// How a LabVIEW file begins, and the last line above its tables.
const LABVIEW: &[u8] = b"LabVIEW Measurement";
const LABVIEW_END: &[u8] = b"***End_of_Header***";
/// The first and the last name of a LabVIEW table.
const LABVIEW_X: &[u8] = b"X_Value";
const LABVIEW_COMMENT: &str = "Comment";

/// The first name of a Rigol oscilloscope's file, and the unit below it.
const RIGOL_X: [&str; 2] = ["X", "Sequence"];
/// The last names there. In place of their units there are numbers.
const RIGOL_SETTINGS: [&str; 2] = ["Start", "Increment"];

/// A file whose first lines say what it is.
pub(super) struct Known {
    /// The lines above the names.
    pub(super) skip: u64,
    pub(super) separator: u8,
    /// The rows above the names, each a setting for LabVIEW; `None` for a logger's file, where two lines follow the names: units, and how
    /// the logger formed each value.
    settings: Option<Vec<Vec<String>>>,
}

impl Known {
    pub(super) fn of(head: &[u8], options: &ReadOptions) -> Option<Known> {
        let lines = first_lines(head, 0, SEARCHED_LINES);
        let first = lines.first().filter(|_| options.header != Some(false))?;
        let separator = b',';
        if TOA5.iter().any(|start| first.bytes.starts_with(start)) && options.skip <= first.number {
            let names = rows(lines.get(1..4)?, Some(separator));
            let is_text = |field: &String| numbers::readable_number(field, options).is_none();
            return names.iter().flatten().all(is_text).then_some(Known {
                skip: first.number,
                separator,
                settings: None,
            });
        }
        if !first.bytes.starts_with(LABVIEW) || options.skip > 0 {
            return None;
        }
        let begins = |pair: &[Line]| pair[0].bytes.starts_with(LABVIEW_END) && pair[1].bytes.starts_with(LABVIEW_X);
        let names = 1 + lines.windows(2).position(begins)?;
        let separator = *lines[names].bytes.get(LABVIEW_X.len())?;
        SEPARATORS.contains(&separator).then(|| Known {
            skip: lines[names].number - 1,
            separator,
            settings: Some(rows(&lines[..names], Some(separator))),
        })
    }

    /// Whether a row of units may follow the names, as some programs of LabVIEW write it.
    pub(super) fn leaves_units_open(&self) -> bool {
        self.settings.is_some()
    }

    /// What the first lines say besides the names, and the units below them.
    pub(super) fn complete(&self, layout: &mut Layout, rows: &[Vec<String>], lines: &[Line], options: &ReadOptions) {
        // The row of units is right where it differs.
        let has_own = self.settings.is_some() && layout.heading_lines > 1;
        let mut set_units = |units: &[String]| {
            for (own, unit) in layout.units.iter_mut().zip(units).filter(|(_, unit)| !unit.is_empty()) {
                *own = own.take().filter(|_| has_own).or_else(|| Some(unit.clone()));
            }
        };
        let Some(settings) = &self.settings else {
            set_units(&rows[1]);
            layout.heading_lines = 3;
            layout.notes.push(format!(
                "line {} has the columns' units; line {} says how the logger formed each value, and is left out",
                lines[1].number, lines[2].number
            ));
            return;
        };
        let setting = |name: &str| settings.iter().find(|row| row[0] == name);
        if let Some(units) = setting("Y_Unit_Label") {
            set_units(&[&[String::new()], &units[1..]].concat());
        }
        layout.may_lack_last =
            layout.names.len() > 2 && layout.names.last().is_some_and(|name| name == LABVIEW_COMMENT);
        if setting("X_Dimension").is_none_or(|row| row.get(1).is_none_or(|of| of == "Time")) {
            layout.units[0].get_or_insert(SECOND.to_owned());
            // Of several channels, all have the same.
            let number = |name: &str| {
                let fields = setting(name)?[1..].iter().filter(|field| !field.is_empty());
                let numbers: Option<Vec<f64>> = fields.map(|f| numbers::readable_number(f, options)).collect();
                let numbers = numbers.filter(|all| all.iter().all(|own| *own == all[0]))?;
                numbers.first().copied()
            };
            let is_empty = rows[layout.heading_lines..].iter().all(|row| row[0].is_empty());
            if let (true, Some(start), Some(step)) = (is_empty, number("X0"), number("Delta_X")) {
                let counts = false;
                layout.set_axis(Axis { start, step, counts });
            }
        }
    }
}

impl Layout {
    /// Gives the first column these instants.
    fn set_axis(&mut self, axis: Axis) {
        let Axis { start, step, .. } = axis;
        self.notes.push(format!(
            "column '{}' has the instants that the file states: {} s apart, from {} s",
            self.names[0],
            exact(step),
            exact(start)
        ));
        self.units[0] = Some(SECOND.to_owned());
        self.axis = Some(axis);
    }

    /// Takes the samples' instants from the units row of a Rigol oscilloscope.
    pub(super) fn take_increment(&mut self, units: &[String], options: &ReadOptions) {
        let Some(kept) = self.names.len().checked_sub(2).filter(|kept| *kept > 1) else {
            return;
        };
        let is_rigol = self.names[0] == RIGOL_X[0]
            && units[0].eq_ignore_ascii_case(RIGOL_X[1])
            && self.names[kept..] == RIGOL_SETTINGS;
        let settings = units.get(kept..kept + 2).unwrap_or_default().iter();
        let numbers: Option<Vec<f64>> = settings.map(|f| numbers::readable_number(f, options)).collect();
        if let (true, Some([start, step])) = (is_rigol, numbers.as_deref()) {
            self.set_axis(Axis {
                start: *start,
                step: *step,
                counts: true,
            });
            self.names.truncate(kept);
            self.units.truncate(kept);
        }
    }
}

/// The names in rows of fields such as `t=0.01`, the same in each row.
pub(super) fn names_in_rows(rows: &[Vec<String>], options: &ReadOptions) -> Option<Vec<String>> {
    let name = |field: &String| {
        let (name, value) = field.split_once('=')?;
        let is_value = columns::is_readable(value, options) || numbers::has_unit(value, options);
        (is_value && is_identifier(name)).then(|| name.to_owned())
    };
    let names = |row: &Vec<String>| row.iter().map(name).collect::<Option<Vec<String>>>();
    let first = names(rows.first()?)?;
    let differ = first.iter().collect::<HashSet<_>>().len() == first.len();
    let is_same = |row| names(row).as_ref() == Some(&first);
    (rows.len() > 1 && differ && rows[1..].iter().all(is_same)).then_some(first)
}
