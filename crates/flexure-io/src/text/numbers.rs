//! Numbers as text, and texts that stand for missing samples.

use crate::error::LineProblem;
use crate::options::{Decimal, ReadOptions};

/// Texts that mean a missing sample, as pandas, R and spreadsheets write them. So do an empty field, and one of dashes.
pub(super) const MISSING: [&str; 20] = [
    "nan", "NaN", "NAN", "-nan", "-NaN", "NA", "<NA>", "NaT", "N/A", "n/a", "null", "NULL", "None", "#N/A", "#NV",
    "#DIV/0!", "#VALUE!", "#NUM!", "1.#QNAN", "-1.#IND",
];

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

/// Signs between groups of thousands besides comma and point: apostrophes, and spaces that do not break.
const GROUPING: [char; 6] = ['\'', '’', ' ', '\u{a0}', '\u{202f}', '\u{2009}'];

/// A number with the minus sign and the exponent of programs, and without apostrophes or spaces that group thousands: typesetting has another
/// sign, Fortran writes `1.5D-03`.
fn as_parsed(field: &str) -> String {
    let field = field.replace('\u{2212}', "-");
    let field = match field.contains(GROUPING) {
        true => without_groups(&field),
        false => field,
    };
    match field.find(['D', 'd']) {
        Some(at) if field[at + 1..].starts_with(['+', '-']) => format!("{}e{}", &field[..at], &field[at + 1..]),
        _ => field,
    }
}

/// A number such as `20'050.03` without the signs that group its thousands; other fields as they are.
fn without_groups(field: &str) -> String {
    let whole = field.split([',', '.']).next().unwrap_or_default();
    let mut groups = whole.trim_start_matches(['+', '-']).split(GROUPING);
    let is_digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let first = groups
        .next()
        .is_some_and(|first| (1..=3).contains(&first.len()) && is_digits(first));
    match first && groups.all(|group| group.len() == 3 && is_digits(group)) {
        true => whole.replace(GROUPING, "") + &field[whole.len()..],
        false => field.to_owned(),
    }
}

/// A field with a number and then its unit, `1.5 V`.
pub(super) fn before_unit(field: &str) -> Option<(&str, &str)> {
    let is_unit = |c: char| c.is_alphabetic() || ['%', '°'].contains(&c);
    let (number, unit) = field.split_at(field.find(is_unit)?);
    // Powers of a unit have one digit; other digits are those of a hexadecimal number or a code.
    let digits = unit.bytes().filter(u8::is_ascii_digit).count();
    if digits > 1 || unit.starts_with(['x', 'X']) {
        return None;
    }
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
    let is = |text: &String| text == field || number(text).is_some_and(|value| number(field) == Some(value));
    // Nothing but dashes, of any number, or no character at all.
    field.bytes().all(|b| b == b'-') || MISSING.contains(&field) || options.missing_texts.iter().any(is)
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
