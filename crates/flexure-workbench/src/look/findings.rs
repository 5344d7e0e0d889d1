//! What is worth knowing about a record, in sentences.

use flexure::look::{Clock, Column, ColumnRelation, Look, Relation, Stop};
use flexure::text::{capitalised, counted, exact, number, short};
use flexure_io::RecordFile;

use super::preparations::{even_behind_stamps, parts};
use crate::text::quoted;

/// Samples that a sentence lists.
const LISTED: usize = 3;
/// Jitter of the instants, in steps, that is reported: larger than the rounding of printed digits.
pub const NOTED_JITTER: f64 = 0.01;
/// A column whose power lies below this part of half the sampling frequency is sampled much faster than needed. Convention.
const SLOW: f64 = 0.02;
/// Steps in a column's standard deviation below which its grid is coarse. Convention: the rounding then is a tenth of it or more.
const COARSE: f64 = 3.0;

/// With more steps of rounding in its range, a column's rounding is not reported: it hides behind any noise. Convention.
const FINE: f64 = 5000.0;
/// Deviation of a factor from 1 up to which two columns are nearly the same. Convention.
const SAME_FACTOR: f64 = 1e-3;

/// Something worth knowing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// A sentence.
    pub text: String,
    /// Whether it may spoil an identification.
    pub warning: bool,
}

/// All findings of a record: the instants first, then column by column, then pairs.
pub fn findings(file: &RecordFile, look: &Look, seconds: f64, sample_time: Option<f64>) -> Vec<Finding> {
    let mut list = List {
        file,
        findings: Vec::new(),
    };
    list.clock(look, seconds);
    // Of instants that are not read, the suggestion says why.
    let are_unread = file.unsettled_dates().is_some() || file.unread_instants().is_some();
    if look.time.is_none() && sample_time.is_none() && !are_unread {
        list.note(format!(
            "No column has the sample instants: frequencies are in cycles a sample. --sample-time S says the time between two samples{}.",
            file.sample_time_hint()
        ));
    }
    for flaw in file.flawed().take(LISTED) {
        list.warn(format!("{}.", capitalised(&flaw)));
    }
    let columns = look.columns.iter().enumerate();
    for (_, column) in columns.filter(|(i, _)| Some(*i) != look.time) {
        list.column(column, look.time.is_some());
    }
    list.slow(look);
    list.relations(look, sample_time);
    list.integrations(look);
    list.findings
}

struct List<'a> {
    file: &'a RecordFile,
    findings: Vec<Finding>,
}

/// The end of a list that shows only `shown` of `all`.
fn more(all: usize, shown: usize) -> String {
    match all > shown {
        true => format!(" and {} more", all - shown),
        false => String::new(),
    }
}

impl List<'_> {
    fn note(&mut self, text: String) {
        self.findings.push(Finding { text, warning: false });
    }

    fn warn(&mut self, text: String) {
        self.findings.push(Finding { text, warning: true });
    }

    /// Some samples, with their lines where these are known.
    fn places(&self, samples: &[usize]) -> String {
        let place = |&sample: &usize| match self.file.line(sample) {
            Some(line) => format!("{sample} (line {line})"),
            None => sample.to_string(),
        };
        let listed: Vec<String> = samples.iter().take(LISTED).map(place).collect();
        format!(
            "{} {}{}",
            if samples.len() == 1 { "sample" } else { "samples" },
            listed.join(", "),
            more(samples.len(), LISTED)
        )
    }

    fn clock(&mut self, look: &Look, seconds: f64) {
        let Some(time) = look.time else {
            return;
        };
        let name = &look.columns[time].name;
        let Some(clock) = &look.clock else {
            self.warn(format!("'{name}' should have the instants, but does not increase: name another column by --time, or say the time between two samples by --sample-time."));
            return;
        };
        let [least, greatest] = [look.columns[time].least, look.columns[time].greatest].map(number);
        if least == greatest {
            let unit = match seconds < 0.01 {
                true => format!("{seconds:e}"),
                false => exact(seconds),
            };
            self.note(format!("'{name}' has the sample instants, in units of {unit} s."));
        }
        if clock.missing > 0 {
            self.warn(format!("'{name}' lacks {}.", counted(clock.missing, "instant")));
        }
        if let Some(even) = even_behind_stamps(self.file, Some(name), clock) {
            let within = match even.is_known() {
                true => String::new(),
                false => format!(", within {}", flexure::text::percent(even.uncertainty)),
            };
            self.note(format!(
                "'{name}' repeats {} and skips {}. But no row is there twice, and the number of rows fits one row every {} s{within}: the time stamps jitter, and the samples are even.",
                counted(clock.backwards.len(), "instant"),
                clock.gaps.len(),
                number(even.step * seconds)
            ));
            return;
        }
        let parts = parts(look, self.file, clock);
        if let [_, later @ ..] = &parts[..]
            && !later.is_empty()
        {
            let starts: Vec<usize> = later.iter().map(|part| part.start).collect();
            let ranges = parts
                .iter()
                .take(LISTED)
                .map(|part| format!("{}:{}", part.start, part.end));
            self.warn(format!(
                "'{name}' starts again at {}: the log has {} parts, which sorting by time would mix. flexure prepare FILE --cut-samples A:B -o part.csv takes one of them: {}{}.",
                self.places(&starts),
                parts.len(),
                ranges.collect::<Vec<_>>().join(" or "),
                more(parts.len(), LISTED)
            ));
        } else if !clock.backwards.is_empty() {
            let places = self.places(&clock.backwards);
            self.warn(format!(
                "'{name}' does not increase at {places}: sort the record by time, and remove what is there twice."
            ));
        }
        if let Some(longest) = clock.gaps.iter().map(|g| g.steps).max_by(f64::total_cmp) {
            let samples: Vec<usize> = clock.gaps.iter().map(|g| g.sample).collect();
            self.warn(format!(
                "'{name}' has {}, before {}: about {} lost, the longest gap lasts {} s.",
                counted(clock.gaps.len(), "gap"),
                self.places(&samples),
                counted(clock.lost() as usize, "sample"),
                number(longest * clock.step * seconds)
            ));
        }
        let percent = 100.0 * clock.jitter;
        if !clock.is_uniform && clock.jitter > Clock::UNIFORM {
            self.warn(format!("The steps of '{name}' differ from the median step by up to {percent:.0} %: the samples are not evenly spaced."));
        } else if clock.jitter > NOTED_JITTER {
            self.note(format!(
                "The steps of '{name}' differ from the median step by up to {percent:.0} %: they count as evenly spaced."
            ));
        }
    }

    /// The findings of a column; `has_time` says whether another column has the instants.
    fn column(&mut self, column: &Column, has_time: bool) {
        let name = &column.name;
        let all = self.file.record.len();
        if column.samples == 0 {
            self.warn(format!("'{name}' has no number."));
            return;
        }
        if column.missing > 0 {
            let share = percent(column.missing, all);
            self.warn(format!(
                "'{name}' misses {} ({share}).",
                counted(column.missing, "sample")
            ));
        }
        if column.infinite > 0 {
            self.warn(format!(
                "'{name}' is infinite at {}.",
                counted(column.infinite, "sample")
            ));
        }
        if column.constant {
            self.note(format!("'{name}' is {} throughout.", number(column.least)));
        } else if column.counts && !has_time {
            self.note(format!(
                "'{name}' rises evenly: it counts the samples, or has the instants (then say --time '{name}')."
            ));
        } else if column.counts {
            self.note(format!("'{name}' rises evenly."));
        }
        if let Some(levels) = &column.levels {
            let listed: Vec<String> = levels.iter().take(2 * LISTED).map(|&v| short(v)).collect();
            self.note(format!(
                "'{name}' has {} levels: {}{}.",
                levels.len(),
                listed.join(", "),
                more(levels.len(), 2 * LISTED)
            ));
        }
        if let Some(q) = column.quantisation.filter(|q| q.steps <= FINE) {
            let text = format!(
                "'{name}' is rounded to steps of {}. Its range is {} steps.",
                number(q.step),
                short(q.steps)
            );
            match column.deviation < COARSE * q.step {
                true => self.warn(format!(
                    "{text} These are coarse: its standard deviation is {} steps.",
                    number(column.deviation / q.step)
                )),
                false => self.note(text),
            }
        }
        self.stop(name, "least", column.lower_stop);
        self.stop(name, "greatest", column.upper_stop);
        if !column.outliers.is_empty() {
            let places = self.places(&column.outliers);
            let count = counted(column.outliers.len(), "sample");
            let samples = self.file.record.column(name).unwrap_or_default();
            let mut values = column.outliers.iter().filter_map(|i| samples.get(*i));
            let code = values
                .next()
                .filter(|first| column.outliers.len() > 1 && values.all(|v| v == *first));
            let text = match code {
                Some(code) => format!(
                    "'{name}' is {} in {count}: {places}. That seems to stand for missing samples.",
                    number(*code)
                ),
                None => format!(
                    "'{name}' has {count} far from {} neighbours: {places}.",
                    if column.outliers.len() == 1 { "its" } else { "their" }
                ),
            };
            self.warn(text);
        }
    }

    fn stop(&mut self, name: &str, which: &str, stop: Option<Stop>) {
        if let Some(stop) = stop {
            let share = percent(stop.samples, self.file.record.len());
            self.warn(format!(
                "'{name}' stands at its {which} value {} for {share} of the samples, up to {} in a row: clipped, or held there.",
                number(stop.value),
                stop.longest
            ));
        }
    }

    /// Columns that are computed from others; all derivatives are in one sentence.
    fn relations(&mut self, look: &Look, sample_time: Option<f64>) {
        let name = |i: usize| look.columns[i].name.clone();
        let (mut columns, mut of) = (Vec::new(), Vec::new());
        for k in &look.relations {
            match k.relation {
                Relation::Derivative { .. } => {
                    columns.push(name(k.column));
                    of.push(name(k.of));
                }
                Relation::Multiple { factor, left } if (factor - 1.0).abs() < left.max(SAME_FACTOR) => {
                    self.note(format!(
                        "'{}' and '{}' are nearly the same: they differ by {} of their standard deviation.",
                        name(k.of),
                        name(k.column),
                        flexure::text::percent(left.max((factor - 1.0).abs()))
                    ))
                }
                Relation::Multiple { factor, .. } => {
                    self.note(format!(
                        "'{}' is '{}' times {}.",
                        name(k.column),
                        name(k.of),
                        number(factor)
                    ));
                }
            }
        }
        let factor = if sample_time.is_some() { "" } else { ", times a factor" };
        match columns.len() {
            0 => {}
            1 => self.note(format!(
                "{} is the derivative of {}{factor}.",
                quoted(columns.iter().map(String::as_str)),
                quoted(of.iter().map(String::as_str))
            )),
            _ => self.note(format!(
                "{} are the derivatives of {}{factor}, in this order.",
                quoted(columns.iter().map(String::as_str)),
                quoted(of.iter().map(String::as_str))
            )),
        }
    }

    /// Columns that integrate a column which is no derivative itself.
    fn integrations(&mut self, look: &Look) {
        let name = |i: usize| look.columns[i].name.clone();
        for input in 0..look.columns.len() {
            let is_derivative =
                |k: &ColumnRelation| k.column == input && matches!(k.relation, Relation::Derivative { .. });
            let outputs: Vec<String> = (look.integrations.iter())
                .filter(|i| i.input == input && !look.relations.iter().any(is_derivative))
                .map(|i| name(i.output))
                .collect();
            let input = name(input);
            match &outputs[..] {
                [] => {}
                [output] => self.note(format!(
                    "'{output}' integrates '{input}': it does not settle while the record lasts."
                )),
                _ => self.note(format!(
                    "{} integrate '{input}': they do not settle while the record lasts.",
                    quoted(outputs.iter().map(String::as_str))
                )),
            }
        }
    }

    /// Whether all signals are sampled much faster than they change.
    fn slow(&mut self, look: &Look) {
        let signals = look
            .columns
            .iter()
            .enumerate()
            .filter(|(i, c)| Some(*i) != look.time && c.is_signal());
        let below = signals.filter_map(|(_, c)| Some(c.spectrum.as_ref()?.below(super::MOST_POWER)));
        let highest = below.fold(0.0, f64::max);
        if highest > 0.0 && highest < SLOW * 0.5 {
            self.note(format!(
                "All signals have 95 % of their power in the lowest {} of the frequencies that this sampling can show: they are sampled faster than needed.",
                flexure::text::percent(highest / 0.5)
            ));
        }
    }
}

fn percent(part: usize, all: usize) -> String {
    flexure::text::percent(part as f64 / all.max(1) as f64)
}
