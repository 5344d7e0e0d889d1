//! The columns of a text file: numbers, time stamps, or texts that cannot serve as signals.

use super::cell_units::CellUnit;
use super::fields::{named_fields, shorten};
use super::numbers::{Numbers, before_unit, has_unit, is_missing, readable_number};
use super::stamps::{self, Part, Stamps};
use super::switch::Switch;
use crate::error::LineProblem;
use crate::options::ReadOptions;
use crate::record_file::{UnsettledDates, Unusable};
use crate::time::{DAY, is_time};

/// The most texts in a column of numbers that may all stand for missing samples. Convention.
const MOST_TEXTS: usize = 5;

/// Whether `field` is a number, a time stamp, or missing: anything but a text.
pub(super) fn is_readable(field: &str, options: &ReadOptions) -> bool {
    is_missing(field, options)
        || readable_number(field, options).is_some()
        || Switch::of(field).is_some()
        || Stamps::of(field, options.time_format.as_deref()).is_some()
        || (options.time_format.is_none() && !Stamps::with_slashes(field).is_empty())
}

/// The columns of the band in a file of a curve, which are empty where no band was wanted.
const BAND: [&str; 2] = ["lower", "upper"];

/// Evenly spaced instants, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub(super) start: f64,
    pub(super) step: f64,
    /// Whether the column counts the samples; otherwise it is empty.
    pub(super) counts: bool,
}

/// One column as it is read.
pub(super) struct Column<'a> {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
    /// How its infinite samples are written.
    infinite: Vec<String>,
    kind: Kind<'a>,
    /// A sentence on the row that settled whether the month or the day comes first.
    settled: Option<String>,
}

enum Kind<'a> {
    /// Nothing but missing samples yet.
    Undecided,
    Numbers,
    /// Numbers, each with its unit.
    WithUnit(CellUnit),
    /// The words of a switch, and which of them occurred.
    Switch(Switch, [bool; 2]),
    Stamps {
        format: Stamps<'a>,
        /// The first instant, in ns, and as it is written.
        first: i64,
        text: String,
    },
    /// Dates with the month or the day first, both of which fit all rows so far, and the first of them with its line.
    Slashes(Box<[Column<'a>; 2]>, String, u64),
    Text {
        why: Unusable,
        /// Whether the text looks like a time stamp of another format.
        looks_like_stamp: bool,
        /// The texts among the numbers, up to one more than [`MOST_TEXTS`].
        texts: Vec<String>,
        /// What the column was before this text, as long as only such texts follow: they may stand below the table.
        before: Option<Box<(Kind<'a>, Vec<f64>)>>,
    },
}

impl<'a> Column<'a> {
    pub(super) fn new(name: String) -> Self {
        Column {
            name,
            values: Vec::new(),
            infinite: Vec::new(),
            kind: Kind::Undecided,
            settled: None,
        }
    }

    /// Appends `field`, of `line`.
    ///
    /// # Errors
    /// As [`Numbers::number`].
    pub(super) fn push(
        &mut self,
        field: &str,
        line: u64,
        numbers: &mut Numbers,
        options: &'a ReadOptions,
    ) -> Result<(), LineProblem> {
        let value = match &mut self.kind {
            Kind::Slashes(..) => return self.push_date(field, line, numbers, options),
            Kind::Text { .. } => {
                self.push_text(field, options);
                return Ok(());
            }
            _ if is_missing(field, options) => Some(f64::NAN),
            Kind::Stamps { format, first, .. } => {
                let (part, last) = (format.part(), self.values.last().copied());
                let value = format.nanoseconds(field).map(|t| seconds(t, *first));
                value.map(|value| {
                    if part == Part::TimeOfDay {
                        on_its_day(value, last)
                    } else {
                        value
                    }
                })
            }
            Kind::Numbers => numbers.number(field, line)?,
            Kind::WithUnit(unit) => unit.number(field, line, numbers)?,
            Kind::Switch(switch, seen) => switch.state(field, seen),
            Kind::Undecided => self.decide(field, line, numbers, options)?,
        };
        match value {
            Some(value) => self.push_value(value, field),
            None => self.become_text(field, line),
        }
        Ok(())
    }

    /// Appends a field to a column of dates of both orders. A number above 12 leaves one of them.
    fn push_date(
        &mut self,
        field: &str,
        line: u64,
        numbers: &mut Numbers,
        options: &'a ReadOptions,
    ) -> Result<(), LineProblem> {
        let Kind::Slashes(both, ..) = &mut self.kind else {
            return Ok(());
        };
        for column in both.iter_mut() {
            column.push(field, line, numbers, options)?;
        }
        let fit = both.each_ref().map(|column| column.part().is_some());
        if fit[0] != fit[1] {
            let fitting = std::mem::replace(&mut both[usize::from(fit[1])], Column::new(String::new()));
            *self = fitting.with_order(field, line);
        }
        Ok(())
    }

    /// Notes a field of a column of texts.
    fn push_text(&mut self, field: &str, options: &ReadOptions) {
        let Kind::Text { before, texts, .. } = &mut self.kind else {
            return;
        };
        let may_be_new = before.is_some() || (!texts.is_empty() && texts.len() <= MOST_TEXTS);
        if !may_be_new || field.is_empty() {
            return;
        }
        match is_readable(field, options) || has_unit(field, options) {
            true => *before = None,
            false if texts.len() <= MOST_TEXTS && !texts.iter().any(|text| text == field) => {
                texts.push(field.to_owned());
            }
            false => {}
        }
    }

    /// Appends a number, which `field` stands for.
    fn push_value(&mut self, value: f64, field: &str) {
        let is_new = || !self.infinite.iter().any(|text| text == field);
        if value.is_infinite() && self.infinite.len() < MOST_TEXTS && is_new() {
            self.infinite.push(field.to_owned());
        }
        self.values.push(value);
    }

    /// Makes this a column of texts, since `field` is one.
    fn become_text(&mut self, field: &str, line: u64) {
        let text = shorten(field);
        let is_first = matches!(self.kind, Kind::Undecided);
        let unit = self.unit().filter(|_| before_unit(field).is_some()).map(str::to_owned);
        let (column, sample) = (self.name.clone(), self.values.len());
        let why = match (is_first, unit) {
            (true, _) => Unusable::Is(format!("text, such as '{text}' on line {line}{}", named_fields(field))),
            (false, None) => Unusable::At {
                line,
                problem: LineProblem::NotANumber { column, sample, text },
            },
            (false, Some(unit)) => Unusable::At {
                line,
                problem: LineProblem::OtherUnit {
                    column,
                    sample,
                    text,
                    unit,
                },
            },
        };
        let is_no_number = matches!(
            why,
            Unusable::At {
                problem: LineProblem::NotANumber { .. },
                ..
            }
        );
        let of_numbers = (
            std::mem::replace(&mut self.kind, Kind::Undecided),
            std::mem::take(&mut self.values),
        );
        self.kind = Kind::Text {
            texts: if is_no_number {
                vec![field.to_owned()]
            } else {
                Vec::new()
            },
            why,
            looks_like_stamp: is_first && stamps::look_like(field),
            before: (!is_first).then(|| Box::new(of_numbers)),
        };
    }

    /// The first sample decides the kind; its value, `None` for a text.
    fn decide(
        &mut self,
        field: &str,
        line: u64,
        numbers: &mut Numbers,
        options: &'a ReadOptions,
    ) -> Result<Option<f64>, LineProblem> {
        if let Some(value) = numbers.number(field, line)? {
            self.kind = Kind::Numbers;
            return Ok(Some(value));
        }
        if let Some((format, first)) = Stamps::of(field, options.time_format.as_deref()) {
            self.begin_stamps(format, first, field);
            return Ok(Some(0.0));
        }
        if options.time_format.is_none() {
            match Stamps::with_slashes(field)[..] {
                [(format, first)] => {
                    self.begin_stamps(format, first, field);
                    *self = std::mem::replace(self, Column::new(String::new())).with_order(field, line);
                    return Ok(Some(0.0));
                }
                [month, day] => {
                    let both = [month, day].map(|(format, first)| {
                        let mut column = Column::new(self.name.clone());
                        column.values = [&self.values[..], &[0.0]].concat();
                        column.begin_stamps(format, first, field);
                        column
                    });
                    self.kind = Kind::Slashes(Box::new(both), field.to_owned(), line);
                    return Ok(Some(0.0));
                }
                _ => {}
            }
        }
        if let Some(switch) = Switch::of(field) {
            let mut seen = [false; 2];
            let state = switch.state(field, &mut seen);
            self.kind = Kind::Switch(switch, seen);
            return Ok(state);
        }
        let Some((number, unit)) = before_unit(field) else {
            return Ok(None);
        };
        let value = numbers.number(number, line)?;
        if value.is_some() {
            self.kind = Kind::WithUnit(CellUnit::new(unit));
        }
        Ok(value)
    }

    fn begin_stamps(&mut self, format: Stamps<'a>, first: i64, field: &str) {
        let text = field.to_owned();
        self.kind = Kind::Stamps { format, first, text };
    }

    /// With a sentence on the order of day and month, which this field settles.
    fn with_order(mut self, field: &str, line: u64) -> Self {
        if let Kind::Stamps { format, .. } = self.kind {
            let order = match format.format().starts_with("%m") {
                true => "month before the day",
                false => "day before the month",
            };
            self.settled = Some(format!(
                "column '{}' has the {order}, as '{field}' on line {line} shows",
                self.name
            ));
        }
        self
    }

    /// The unit that stands behind each number.
    pub(super) fn unit(&self) -> Option<&str> {
        match &self.kind {
            Kind::WithUnit(unit) => Some(&unit.unit),
            _ => None,
        }
    }

    /// A sentence on the words of a switch, or on the order of day and month.
    pub(super) fn words(&self) -> Option<String> {
        let name = &self.name;
        match &self.kind {
            Kind::WithUnit(unit) => unit.words(name),
            Kind::Switch(Switch([off, on]), [true, true]) => Some(format!(
                "column '{name}' has the words {off} and {on}; they are taken as 0 and 1"
            )),
            Kind::Switch(Switch(words), seen) => {
                let state = usize::from(seen[1]);
                Some(format!(
                    "column '{name}' has the word {}; it is taken as {state}",
                    words[state]
                ))
            }
            _ => self.settled.clone(),
        }
    }

    /// The texts among a column's numbers that may stand for missing samples, if they are few: also those of infinite numbers.
    pub(super) fn texts(&self) -> &[String] {
        match &self.kind {
            Kind::Text { texts, .. } if texts.len() <= MOST_TEXTS => texts,
            Kind::Text { .. } => &[],
            Kind::Slashes(both, ..) => both[0].texts(),
            _ => &self.infinite,
        }
    }

    /// The number of samples before the texts with which the column ends, where it has such texts.
    pub(super) fn ends_before(&self) -> Option<usize> {
        match &self.kind {
            Kind::Text { before, .. } => before.as_ref().map(|before| before.1.len()),
            Kind::Slashes(both, ..) => both[0].ends_before(),
            // An instant that is missing at the end belongs to no sample.
            _ if self.part().is_some() || is_time(&self.name) => {
                let known = self.values.iter().rposition(|t| t.is_finite())? + 1;
                (known < self.values.len()).then_some(known)
            }
            _ => None,
        }
    }

    /// Keeps the first samples, before any text with which the column ends.
    pub(super) fn truncate(&mut self, samples: usize) {
        if let Kind::Text { before, .. } = &mut self.kind
            && let Some(before) = before.take_if(|before| before.1.len() >= samples)
        {
            (self.kind, self.values) = *before;
        }
        if let Kind::Slashes(both, ..) = &mut self.kind {
            both.iter_mut().for_each(|column| column.truncate(samples));
        }
        self.values.truncate(samples);
    }

    /// Why the column cannot serve as a signal, if so.
    pub(super) fn unusable(&self) -> Option<Unusable> {
        match &self.kind {
            Kind::Text { why, .. } => Some(why.clone()),
            Kind::Slashes(both, text, line) => Some(both[0].unusable().unwrap_or_else(|| {
                let formats = both.each_ref().map(|column| match column.kind {
                    Kind::Stamps { format, .. } => format.format().to_owned(),
                    _ => String::new(),
                });
                Unusable::Dates(UnsettledDates {
                    column: self.name.clone(),
                    text: text.clone(),
                    line: *line,
                    formats,
                })
            })),
            Kind::Undecided if !self.values.is_empty() && !BAND.contains(&self.name.as_str()) => {
                Some(Unusable::Is("empty".to_owned()))
            }
            _ => None,
        }
    }

    /// Whether it is text that looks like time stamps of another format.
    pub(super) fn looks_like_stamps(&self) -> bool {
        match self.kind {
            Kind::Text { looks_like_stamp, .. } => looks_like_stamp,
            Kind::Slashes(..) => true,
            _ => false,
        }
    }

    /// What a time column stamps has of them.
    pub(super) fn part(&self) -> Option<Part> {
        match &self.kind {
            Kind::Stamps { format, .. } => Some(format.part()),
            _ => None,
        }
    }

    /// Times of day become time stamps by the dates of another column.
    pub(super) fn add_dates(&mut self, dates: &Column) {
        if let (Kind::Stamps { first, text, .. }, Some((first_date, date))) = (&mut self.kind, dates.origin()) {
            // The dates say the day.
            let start = *first as f64 / 1e9;
            let times = self.values.iter_mut();
            times.for_each(|time| *time = (start + *time).rem_euclid(DAY) - start);
            *first += first_date;
            *text = format!("{date} {text}");
            self.values
                .iter_mut()
                .zip(&dates.values)
                .for_each(|(time, date)| *time += date);
        }
    }

    /// Takes the instants that the heading of the file states.
    pub(super) fn put_on(&mut self, axis: Axis) {
        match self.kind {
            Kind::Undecided if !axis.counts => {
                self.kind = Kind::Numbers;
                self.values = (0..self.values.len()).map(|k| k as f64).collect();
            }
            Kind::Numbers if axis.counts => {}
            _ => return,
        }
        self.values.iter_mut().for_each(|t| *t = axis.start + axis.step * *t);
    }

    /// For time stamps, the origin of their seconds: in ns, and as written in the file.
    pub(super) fn origin(&self) -> Option<(i64, &str)> {
        match &self.kind {
            Kind::Stamps { first, text, .. } => Some((*first, text)),
            _ => None,
        }
    }
}

fn seconds(instant: i64, first: i64) -> f64 {
    (instant - first) as f64 / 1e9
}

/// A time of day on the day that is nearest to the sample before: logs pass midnight.
fn on_its_day(value: f64, last: Option<f64>) -> f64 {
    match last.filter(|last| last.is_finite()) {
        Some(last) => value + DAY * ((last - value) / DAY).round(),
        None => value,
    }
}
