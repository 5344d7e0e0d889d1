//! The columns of a text file: numbers, time stamps, or texts that cannot serve as signals.

use super::stamps::{self, Part, Stamps};
use crate::error::LineProblem;
use crate::options::{Decimal, ReadOptions};
use crate::record_file::Unusable;
use crate::time::is_time;

/// Characters of a bad field that a message quotes.
const QUOTED_CHARACTERS: usize = 40;

/// Texts that mean a missing sample, in addition to an empty field, as pandas, R and spreadsheets write them.
pub(super) const MISSING: [&str; 23] = [
    "nan", "NaN", "NAN", "-nan", "-NaN", "NA", "<NA>", "NaT", "N/A", "n/a", "null", "NULL", "None", "-", "--", "---",
    "#N/A", "#NV", "#DIV/0!", "#VALUE!", "#NUM!", "1.#QNAN", "-1.#IND",
];

/// Seconds in a day.
const DAY: f64 = 86_400.0;

/// The most texts in a column of numbers that may all stand for missing samples. Convention.
const MOST_TEXTS: usize = 5;

/// Words for the two states of a switch: off and on, in lower case. They are 0 and 1.
const SWITCHES: [[&str; 2]; 3] = [["false", "true"], ["off", "on"], ["no", "yes"]];

/// Reads numbers, and notices which decimal sign they have.
#[derive(Debug, Clone, Default)]
pub(super) struct Numbers {
    given: Option<Decimal>,
    /// The first line with a decimal point.
    point: Option<u64>,
    /// The first line with a comma in a number.
    comma: Option<u64>,
    /// Whether a comma can only be a decimal sign: it does not look like one that groups thousands.
    comma_is_certain: bool,
}

impl Numbers {
    pub(super) fn new(given: Option<Decimal>) -> Self {
        Numbers {
            given,
            ..Numbers::default()
        }
    }

    /// The number that `field` is.
    ///
    /// # Errors
    /// [`LineProblem::BothDecimals`] where other numbers have the other decimal sign.
    pub(super) fn number(&mut self, field: &str, line: u64) -> Result<Option<f64>, LineProblem> {
        if let Some(given) = self.given {
            return Ok(with_decimal(field, given));
        }
        let Some(value) = number(field) else { return Ok(None) };
        match field.rfind([',', '.']).map(|at| &field[at..=at]) {
            Some(",") => {
                self.comma.get_or_insert(line);
                self.comma_is_certain |= !groups_thousands(field);
            }
            Some(_) => {
                self.point.get_or_insert(line);
            }
            None => {}
        }
        match (self.point, self.comma) {
            (Some(point), Some(comma)) => Err(LineProblem::BothDecimals { point, comma }),
            _ => Ok(Some(value)),
        }
    }

    /// A sentence on the decimal sign, concluded from all numbers together.
    ///
    /// # Errors
    /// [`LineProblem::AmbiguousComma`] and its line, if commas may also group thousands.
    pub(super) fn conclude(&self) -> Result<Option<&'static str>, (u64, LineProblem)> {
        match self.comma {
            Some(line) if !self.comma_is_certain => Err((line, LineProblem::AmbiguousComma)),
            Some(_) => Ok(Some("the numbers have decimal commas")),
            None => Ok(None),
        }
    }
}

/// A number with a decimal point or comma; where it has both, the first groups thousands.
fn number(field: &str) -> Option<f64> {
    if let Ok(value) = field.parse() {
        return Some(value);
    }
    let field = as_parsed(field);
    match (field.find(','), field.find('.')) {
        (Some(comma), Some(point)) if comma < point => with_decimal(&field, Decimal::Point),
        (Some(_), Some(_)) => with_decimal(&field, Decimal::Comma),
        _ => field.replacen(',', ".", 1).parse().ok(),
    }
}

/// A number with the minus sign and the exponent of programs: typesetting has another sign, Fortran writes `1.5D-03`.
fn as_parsed(field: &str) -> String {
    let field = field.replace('\u{2212}', "-");
    match field.find(['D', 'd']) {
        Some(at) if field[at + 1..].starts_with(['+', '-']) => format!("{}e{}", &field[..at], &field[at + 1..]),
        _ => field,
    }
}

/// A field with a number and then its unit, `1.5 V`.
fn before_unit(field: &str) -> Option<(&str, &str)> {
    let is_unit = |c: char| c.is_alphabetic() || ['%', '°'].contains(&c);
    let (number, unit) = field.split_at(field.find(is_unit)?);
    let ends = |c: char| c.is_ascii_digit() || c == '.' || c.is_whitespace();
    number.ends_with(ends).then(|| (number.trim_end(), unit))
}

/// A number with the decimal sign given; the other sign may group thousands.
fn with_decimal(field: &str, decimal: Decimal) -> Option<f64> {
    let field = as_parsed(field);
    let (point, group) = match decimal {
        Decimal::Point => ('.', ','),
        Decimal::Comma => (',', '.'),
    };
    let (whole, fraction) = match field.split_once(point) {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (&field[..], None),
    };
    let well_grouped = whole
        .trim_start_matches(['+', '-'])
        .split(group)
        .enumerate()
        .all(|(i, digits)| i == 0 && (1..=3).contains(&digits.len()) || digits.len() == 3);
    if whole.contains(group) && !well_grouped {
        return None;
    }
    let whole = whole.replace(group, "");
    fraction
        .map_or(whole.clone(), |fraction| format!("{whole}.{fraction}"))
        .parse()
        .ok()
}

/// Whether a number with a comma looks like one thousand or more, 1,234.
fn groups_thousands(field: &str) -> bool {
    let Some((whole, rest)) = field.split_once(',') else {
        return false;
    };
    let whole = whole.trim_start_matches(['+', '-']);
    (1..=3).contains(&whole.len())
        && !whole.starts_with('0')
        && rest.len() == 3
        && rest.bytes().all(|b| b.is_ascii_digit())
}

/// Whether `field` stands for a sample that is missing.
pub(super) fn is_missing(field: &str, options: &ReadOptions) -> bool {
    field.is_empty() || MISSING.contains(&field) || options.missing_texts.iter().any(|text| text == field)
}

/// The number in `field`, with either decimal sign.
pub(super) fn readable_number(field: &str, options: &ReadOptions) -> Option<f64> {
    options
        .decimal
        .map_or_else(|| number(field), |decimal| with_decimal(field, decimal))
}

/// Whether `field` is a number and its unit.
pub(super) fn has_unit(field: &str, options: &ReadOptions) -> bool {
    before_unit(field).is_some_and(|(number, _)| readable_number(number, options).is_some())
}

/// Whether `field` is a number, a time stamp, or missing: anything but a text.
pub(super) fn is_readable(field: &str, options: &ReadOptions) -> bool {
    is_missing(field, options)
        || readable_number(field, options).is_some()
        || Switch::of(field).is_some()
        || Stamps::of(field, options.time_format.as_deref()).is_some()
}

/// The columns of the band in a file of a curve, which are empty where no band was wanted.
const BAND: [&str; 2] = ["lower", "upper"];

/// The two words of a switch.
#[derive(Clone, Copy, PartialEq)]
struct Switch(&'static [&'static str; 2]);

impl Switch {
    /// The switch that has this word.
    fn of(field: &str) -> Option<Switch> {
        SWITCHES
            .iter()
            .map(Switch)
            .find(|switch| switch.state(field, &mut [false; 2]).is_some())
    }

    /// The state that a word means, 0 or 1, which is then `seen`.
    fn state(self, field: &str, seen: &mut [bool; 2]) -> Option<f64> {
        let state = self.0.iter().position(|word| field.eq_ignore_ascii_case(word))?;
        seen[state] = true;
        Some(state as f64)
    }
}

/// One column as it is read.
pub(super) struct Column<'a> {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
    kind: Kind<'a>,
}

enum Kind<'a> {
    /// Nothing but missing samples yet.
    Undecided,
    Numbers,
    /// Numbers, each with this unit.
    WithUnit(String),
    /// The words of a switch, and which of them occurred.
    Switch(Switch, [bool; 2]),
    Stamps {
        format: Stamps<'a>,
        /// The first instant, in ns, and as it is written.
        first: i64,
        text: String,
    },
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
            kind: Kind::Undecided,
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
            Kind::Text { before, texts, .. } => {
                let may_be_new = before.is_some() || (!texts.is_empty() && texts.len() <= MOST_TEXTS);
                if may_be_new && !field.is_empty() {
                    match is_readable(field, options) {
                        true => *before = None,
                        false if texts.len() <= MOST_TEXTS && !texts.iter().any(|text| text == field) => {
                            texts.push(field.to_owned());
                        }
                        false => {}
                    }
                }
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
            Kind::WithUnit(unit) => match before_unit(field) {
                Some((number, own)) if own == *unit => numbers.number(number, line)?,
                _ => None,
            },
            Kind::Switch(switch, seen) => switch.state(field, seen),
            Kind::Undecided => self.decide(field, line, numbers, options)?,
        };
        match value {
            Some(value) => self.values.push(value),
            None => {
                let text = shorten(field);
                let is_first = matches!(self.kind, Kind::Undecided);
                let why = match is_first {
                    true => Unusable::Is(format!("text, such as '{text}' on line {line}")),
                    false => Unusable::At {
                        line,
                        problem: LineProblem::NotANumber {
                            column: self.name.clone(),
                            sample: self.values.len(),
                            text,
                        },
                    },
                };
                let looks_like_stamp = is_first && stamps::look_like(field);
                let of_numbers = (
                    std::mem::replace(&mut self.kind, Kind::Undecided),
                    std::mem::take(&mut self.values),
                );
                self.kind = Kind::Text {
                    texts: if is_first { Vec::new() } else { vec![field.to_owned()] },
                    why,
                    looks_like_stamp,
                    before: (!is_first).then(|| Box::new(of_numbers)),
                };
            }
        }
        Ok(())
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
            let text = field.to_owned();
            self.kind = Kind::Stamps { format, first, text };
            return Ok(Some(0.0));
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
            self.kind = Kind::WithUnit(unit.to_owned());
        }
        Ok(value)
    }

    /// The unit that stands behind each number.
    pub(super) fn unit(&self) -> Option<&str> {
        match &self.kind {
            Kind::WithUnit(unit) => Some(unit),
            _ => None,
        }
    }

    /// A sentence on the words of a switch.
    pub(super) fn words(&self) -> Option<String> {
        let name = &self.name;
        match self.kind {
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
            _ => None,
        }
    }

    /// The texts among a column's numbers, if they are few.
    pub(super) fn texts(&self) -> &[String] {
        match &self.kind {
            Kind::Text { texts, .. } if texts.len() <= MOST_TEXTS => texts,
            _ => &[],
        }
    }

    /// The number of samples before the texts with which the column ends, where it has such texts.
    pub(super) fn ends_before(&self) -> Option<usize> {
        match &self.kind {
            Kind::Text { before, .. } => before.as_ref().map(|before| before.1.len()),
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
        self.values.truncate(samples);
    }

    /// Why the column cannot serve as a signal, if so.
    pub(super) fn unusable(&self) -> Option<Unusable> {
        match &self.kind {
            Kind::Text { why, .. } => Some(why.clone()),
            Kind::Undecided if !self.values.is_empty() && !BAND.contains(&self.name.as_str()) => {
                Some(Unusable::Is("empty".to_owned()))
            }
            _ => None,
        }
    }

    /// Whether it is text that looks like time stamps of another format.
    pub(super) fn looks_like_stamps(&self) -> bool {
        matches!(
            self.kind,
            Kind::Text {
                looks_like_stamp: true,
                ..
            }
        )
    }

    /// What a column of time stamps has of them.
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

pub(super) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(QUOTED_CHARACTERS).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_signs_are_noticed_and_never_guessed() {
        let conclude = |fields: &[&str]| {
            let mut numbers = Numbers::new(None);
            for (field, line) in fields.iter().zip(1..) {
                numbers.number(field, line).map_err(|problem| (line, problem))?;
            }
            numbers.conclude()
        };
        assert_eq!(conclude(&["1", "2.5", "-3e5"]), Ok(None));
        assert_eq!(
            conclude(&["1", "2,5", "1,250"]),
            Ok(Some("the numbers have decimal commas"))
        );
        assert_eq!(conclude(&["0,125"]), Ok(Some("the numbers have decimal commas")));
        assert_eq!(conclude(&["1", "1,250"]), Err((2, LineProblem::AmbiguousComma)));
        let both = LineProblem::BothDecimals { point: 1, comma: 3 };
        assert_eq!(conclude(&["1.5", "7", "2,5"]), Err((3, both)));
    }

    #[test]
    fn a_given_decimal_sign_leaves_the_other_to_thousands() {
        let cases = [
            ("1,250", Decimal::Comma, Some(1.25)),
            ("1,250", Decimal::Point, Some(1250.0)),
            ("-12,345.5", Decimal::Point, Some(-12345.5)),
            ("1.234.567,5e-1", Decimal::Comma, Some(123_456.75)),
            ("1,25", Decimal::Point, None),
            ("1,5,000", Decimal::Point, None),
            ("x", Decimal::Comma, None),
        ];
        for (field, decimal, expected) in cases {
            assert_eq!(with_decimal(field, decimal), expected, "{field}");
        }
    }
}
