//! A look for the terminal.

use flexure::look::{Clock, Dependence, Direction, Kind};
use flexure::text::{counted, number, p_value, percent};

use super::Inspection;
use crate::lines::{Lines, Tone};

/// Columns and dependences that are printed; the page and JSON have all of them.
pub(super) const COLUMNS: usize = 100;
const ROWS: usize = 12;
/// Notes that are printed, and warnings.
const FINDINGS: usize = 30;

impl Inspection<'_> {
    /// The summary, and the reason for the suggested command.
    pub fn summary(&self) -> Lines {
        let mut lines = Lines::new();
        lines.headline(Tone::Plain, self.headline());
        let mut rows = self.column_rows();
        let more = rows.len().saturating_sub(1 + COLUMNS);
        rows.truncate(1 + COLUMNS);
        let texts = rows[0].iter().take_while(|name| *name == "column" || *name == "unit");
        lines.table(&rows, &(0..texts.count()).collect::<Vec<_>>());
        if more > 0 {
            lines.deeper(|lines| {
                lines.sentence(format!("and {}: see --report or --json", counted(more, "more column")))
            });
        }
        lines.space();
        let dependences = self.dependences();
        lines.sentence(match dependences.is_empty() {
            true => "No column was seen to depend on another (level 1 %, all pairs and lags together).",
            false => "What depends on what (level 1 %, all pairs and lags together):",
        });
        lines.deeper(|lines| {
            dependences
                .iter()
                .take(ROWS)
                .for_each(|d| lines.sentence(self.sentence(d)));
            if dependences.len() > ROWS {
                lines.sentence(format!("and {} more: see --report or --json", dependences.len() - ROWS));
            }
        });
        if !self.findings.is_empty() {
            lines.space();
        }
        for (is_warning, what) in [(false, "note"), (true, "warning")] {
            let found: Vec<_> = self.findings.iter().filter(|f| f.warning == is_warning).collect();
            for finding in found.iter().take(FINDINGS) {
                match is_warning {
                    true => lines.warning(&finding.text),
                    false => lines.note(&finding.text),
                }
            }
            if found.len() > FINDINGS {
                let more = counted(found.len() - FINDINGS, &format!("more {what}"));
                lines.sentence(format!("and {more}: see --report or --json"));
            }
        }
        if let Some(suggestion) = &self.suggestion {
            lines.space();
            lines.sentence(&*suggestion.why);
            suggestion.notes.iter().for_each(|note| lines.sentence(&**note));
        }
        lines
    }

    /// Samples, sample time and duration.
    fn headline(&self) -> String {
        let n = self.file.record.len();
        // With lost rows, the instants last longer than the samples.
        let steps = |clock: &Clock| (clock.duration / clock.usual_step(n)).round() + 1.0;
        let clock = self.look.clock.as_ref().filter(|_| !self.is_even);
        let steps = clock.map_or(n as f64, steps);
        let time = match (self.sample_time, &self.look.clock) {
            (Some(step), _) => format!(", every {} s, {} s in all", plain(step), plain(step * steps)),
            _ => String::new(),
        };
        format!(
            "{}: {} of {}{time}",
            self.file.name(),
            counted(n, "sample"),
            counted(self.look.columns.len(), "column")
        )
    }

    /// A table of the columns, its header first.
    pub(super) fn column_rows(&self) -> Vec<Vec<String>> {
        let header = [
            "column",
            "unit",
            "least",
            "greatest",
            "mean",
            "standard deviation",
            "95 % of power below",
        ];
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        rows.extend(self.look.columns.iter().enumerate().map(|(i, c)| {
            let finite = |v: f64| if v.is_finite() { number(v) } else { "-".to_owned() };
            let power = match self.power_below(i).filter(|_| self.is_signal(i)) {
                Some(frequency) => format!("{} {}", number(frequency), self.frequency_unit()),
                None => "-".to_owned(),
            };
            let unit = self.file.units.get(i).cloned().flatten().unwrap_or_default();
            let numbers = [c.least, c.greatest, c.mean, c.deviation].map(finite);
            [vec![c.name.clone(), unit], numbers.to_vec(), vec![power]].concat()
        }));
        let no_units = rows[1..].iter().all(|row| row[1].is_empty());
        if no_units {
            rows.iter_mut().for_each(|row| drop(row.remove(1)));
        }
        rows
    }

    /// A dependence as a sentence, its size before its test.
    pub(super) fn sentence(&self, d: &Dependence) -> String {
        let (cause, effect) = (self.name(d.cause), self.name(d.effect));
        let follows = match (d.direction, d.delay) {
            (Direction::Forward, 0) => format!("'{effect}' follows '{cause}' {}", self.at_once(d)),
            (Direction::Forward, _) => format!("'{effect}' follows '{cause}' after {}", self.delay(d)),
            (Direction::AtOnce, _) => format!("'{cause}' and '{effect}' change together"),
            (Direction::Both, _) => {
                format!(
                    "'{cause}' and '{effect}' follow each other: feedback, both follow a third, or a periodic input such as a multisine"
                )
            }
        };
        match d.kind {
            Kind::Linear => format!(
                "{follows}; {} of {} is coherent ({})",
                percent(d.coherent),
                match d.direction {
                    Direction::Forward => "its power".to_owned(),
                    Direction::AtOnce | Direction::Both => format!("the power of '{effect}'"),
                },
                p_value(d.p_value)
            ),
            Kind::Square => format!(
                "{follows}, by the square of '{cause}' alone: an even nonlinearity ({})",
                p_value(d.p_value)
            ),
        }
    }

    fn at_once(&self, d: &Dependence) -> String {
        match d.block {
            1 => "without delay".to_owned(),
            block => format!("within {block} samples"),
        }
    }

    /// A delay in samples and seconds.
    pub(super) fn delay(&self, d: &Dependence) -> String {
        if d.direction == Direction::Both {
            return "not told".to_owned();
        }
        match (d.delay, d.block) {
            (0, 1) => return "none".to_owned(),
            (0, block) => return format!("under {block} samples"),
            _ => {}
        }
        let about = if d.block > 1 { "about " } else { "" };
        let samples = if d.delay == 1 { "sample" } else { "samples" };
        let seconds = self
            .sample_time
            .map(|step| format!(" ({} s)", plain(d.delay as f64 * step)));
        format!("{about}{} {samples}{}", d.delay, seconds.unwrap_or_default())
    }
}

/// A number to four digits, without zeros at its end.
pub(super) fn plain(value: f64) -> String {
    let text = number(format!("{value:.3e}").parse().unwrap_or(value));
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
