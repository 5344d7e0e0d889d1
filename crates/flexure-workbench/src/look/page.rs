//! A look as the page that shows it.

use anyhow::{Context as _, Result};
use flexure::look::{Dependence, Direction, Kind};
use flexure::text::{p_value, percent};
use flexure_report::data::{Fact, LagPlot, LookPage, NextCommand, Signal, SpectrumPlot, Table};

use super::text::{COLUMNS, plain};
use super::{Inspection, MOST_POWER};
use crate::plots::time_axis;

/// Correlations that are drawn.
const DRAWN: usize = 6;
/// Rows of the table of dependences.
const ROWS: usize = 40;

impl Inspection<'_> {
    /// The page that shows everything; `next` is the suggested command as it is typed; `command` makes the page again.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, next: Option<String>, command: Option<String>) -> Result<String> {
        flexure_report::render_look(&self.page(next, command)).context("the report")
    }

    fn page(&self, next: Option<String>, command: Option<String>) -> LookPage {
        let texts = |warning: bool| -> Vec<String> {
            let found = self.findings.iter().filter(|f| f.warning == warning);
            found.map(|f| f.text.clone()).collect()
        };
        let mut signals: Vec<usize> = (0..self.look.columns.len()).filter(|&i| self.is_drawn(i)).collect();
        let mut notes = texts(false);
        if signals.len() > COLUMNS {
            notes.insert(
                0,
                format!("The first {COLUMNS} of {} signals are drawn.", signals.len()),
            );
            signals.truncate(COLUMNS);
        }
        let dependences = self.dependences();
        LookPage {
            title: self.file.name(),
            subtitle: "A first look at the record: its columns, and which depends on which.".to_owned(),
            next: self.suggestion.as_ref().zip(next).map(|(s, command)| NextCommand {
                command,
                why: s.why.clone(),
                notes: s.notes.clone(),
            }),
            facts: self.facts(),
            warnings: texts(true),
            notes,
            columns: self.column_table(),
            record: signals.iter().map(|&i| self.signal(i)).collect(),
            time: time_axis(self.file, self.sample_time, 0),
            dependences: self.dependence_table(),
            correlations: dependences.iter().take(DRAWN).map(|d| self.lag_plot(d)).collect(),
            spectra: signals.iter().filter_map(|&i| self.spectrum(i)).collect(),
            frequency_unit: self.frequency_unit().to_owned(),
            command,
        }
    }

    /// Whether a column is drawn: not the instants, a count of the samples, or a constant.
    fn is_drawn(&self, column: usize) -> bool {
        let c = &self.look.columns[column];
        Some(column) != self.look.time && !c.constant && !c.counts && c.samples > 0
    }

    fn facts(&self) -> Vec<Fact> {
        let n = self.file.record.len();
        let mut facts = vec![Fact::new("Samples", n.to_string(), "of every column")];
        if let Some(step) = self.sample_time {
            let note = match &self.look.clock {
                Some(clock) if clock.jitter > 0.001 => {
                    format!("the steps differ by up to {:.1} %", 100.0 * clock.jitter)
                }
                _ => format!("{} samples a second", plain(1.0 / step)),
            };
            facts.push(Fact::new("Sample time", format!("{} s", plain(step)), note));
            let longest = match &self.look.clock {
                Some(clock) if self.look.time.is_some() => clock.duration / clock.step * step,
                _ => step * n as f64,
            };
            facts.push(Fact::new(
                "Duration",
                format!("{} s", plain(longest)),
                "from first to last sample",
            ));
        }
        let signals = (0..self.look.columns.len()).filter(|&i| self.is_signal(i)).count();
        let columns = format!("of {} columns", self.look.columns.len());
        facts.push(Fact::new("Signals", signals.to_string(), columns));
        if let Some(most) = self.dependences().into_iter().find(|d| d.kind == Kind::Linear) {
            let of = format!(
                "of the power of '{}' is coherent with '{}'",
                self.name(most.effect),
                self.name(most.cause)
            );
            facts.push(Fact::new("Strongest dependence", percent(most.coherent), of));
        }
        facts
    }

    fn column_table(&self) -> Table {
        let mut rows = self.column_rows();
        let columns = rows.remove(0);
        Table {
            title: "The columns".to_owned(),
            text: "Missing samples are left out of the numbers.".to_owned(),
            columns,
            rows,
            chosen: None,
            ends_in_text: false,
        }
    }

    fn dependence_table(&self) -> Table {
        let row = |d: &Dependence| {
            let (cause, effect) = (self.name(d.cause), self.name(d.effect));
            let direction = match d.direction {
                Direction::Forward => format!("{effect} follows {cause}"),
                Direction::AtOnce => format!("{effect} and {cause} together"),
                Direction::Both => format!("{effect} and {cause}, both ways"),
            };
            let share = match d.kind {
                Kind::Linear => percent(d.coherent),
                Kind::Square => format!("by the square of {cause}"),
            };
            vec![
                direction,
                self.delay(d),
                share,
                p_value(d.p_value).replace("p = ", "").replace("p ", ""),
            ]
        };
        let dependences = self.dependences();
        let more = match dependences.len() > ROWS {
            true => format!(" The {ROWS} strongest of {} are listed.", dependences.len()),
            false => String::new(),
        };
        Table {
            title: "What depends on what".to_owned(),
            text: format!(
                "The columns are whitened, then correlated. All pairs and lags together are tested at the level 1 %. The coherent share is the part \
                 of the later column's power that a linear system could explain.{more}"
            ),
            columns: ["columns", "delay", "coherent share", "p"].map(str::to_owned).to_vec(),
            rows: dependences.into_iter().take(ROWS).map(row).collect(),
            chosen: None,
            ends_in_text: false,
        }
    }

    fn lag_plot(&self, d: &Dependence) -> LagPlot {
        let (cause, effect) = (self.name(d.cause), self.name(d.effect));
        let of = match d.kind {
            Kind::Linear => format!("'{cause}'"),
            Kind::Square => format!("the square of '{cause}'"),
        };
        let means = match d.block {
            1 => String::new(),
            block => format!(" Means of {block} samples are one value each."),
        };
        LagPlot {
            title: format!("{effect} after {cause}"),
            caption: format!("Correlation of '{effect}' with {of} so many samples earlier, both whitened.{means}"),
            lags: d.correlations.lags.clone(),
            values: d.correlations.values.clone(),
            limit: d.correlations.limit,
            level: "99 %".to_owned(),
        }
    }

    fn signal(&self, column: usize) -> Signal {
        let name = self.name(column);
        let label = self.labelled(column);
        let unit = label.strip_prefix(name).unwrap_or_default().trim();
        Signal {
            name: name.to_owned(),
            unit: unit.trim_start_matches('(').trim_end_matches(')').to_owned(),
            values: self.file.record.column(name).map(<[f64]>::to_vec).unwrap_or_default(),
        }
    }

    fn spectrum(&self, column: usize) -> Option<SpectrumPlot> {
        let spectrum = self.look.columns[column].spectrum.as_ref()?;
        let step = self.sample_time.unwrap_or(1.0);
        let Signal { name, unit, .. } = self.signal(column);
        let square = match unit.contains([' ', '/']) {
            true => format!("({unit})²"),
            false => format!("{unit}²"),
        };
        let y_label = match (unit.is_empty(), self.sample_time) {
            (true, _) => "power density".to_owned(),
            (false, Some(_)) => format!("power density ({square}/Hz)"),
            (false, None) => format!("power density ({square})"),
        };
        Some(SpectrumPlot {
            title: format!(
                "{name}: {:.0} % below {} {}",
                100.0 * MOST_POWER,
                plain(spectrum.below(MOST_POWER) / step),
                self.frequency_unit()
            ),
            y_label,
            frequency: spectrum.frequency.iter().map(|f| f / step).collect(),
            density: spectrum.density.iter().map(|d| d * step).collect(),
        })
    }
}
