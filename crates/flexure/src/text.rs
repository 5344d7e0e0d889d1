//! Numbers and text for readers.

use std::borrow::Cow;
use std::path::Path;

/// A number to four digits, without an exponent if its size is ordinary.
///
/// ```
/// assert_eq!(flexure::text::number(0.17391), "0.1739");
/// assert_eq!(flexure::text::number(2.5e7), "2.500e7");
/// ```
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        let rounded = format!("{size:.3e}").parse().unwrap_or(size);
        let decimals = if size == 0.0 {
            0
        } else {
            (3 - f64::log10(rounded).floor() as i32).max(0) as usize
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

/// A number as [`number`] writes it. A whole number below a million has no decimals.
pub fn short(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e6 {
        format!("{value}")
    } else {
        number(value)
    }
}

/// A number to at most six digits, without trailing zeros: 0.01, not 0.01000. If it would have many zeros, it has an exponent.
pub fn decimal(number: f64) -> String {
    exact(format!("{number:.5e}").parse().unwrap_or(number))
}

/// A number with all of its digits. If it would have many zeros, it has an exponent.
///
/// ```
/// assert_eq!(flexure::text::exact(0.25), "0.25");
/// assert_eq!(flexure::text::exact(2.1e91), "2.1e91");
/// ```
pub fn exact(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-12..1e16 => value.to_string(),
        size if size.is_finite() => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// The names in a list of readable length.
///
/// ```
/// let names: Vec<String> = (0..1000).map(|i| format!("c{i}")).collect();
/// assert!(flexure::text::list(&names).ends_with("c18, c19 and 980 more"));
/// ```
pub fn list(names: &[impl AsRef<str>]) -> String {
    /// More names than this are only counted.
    const MOST: usize = 20;
    let shown = names.iter().take(MOST).map(|name| shortened(name.as_ref()));
    let shown = shown.collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MOST) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Parts of a sentence: "u, v and w".
///
/// ```
/// assert_eq!(flexure::text::joined(&["u", "v", "w"]), "u, v and w");
/// ```
pub fn joined(parts: &[impl AsRef<str>]) -> String {
    let parts: Vec<&str> = parts.iter().map(AsRef::as_ref).collect();
    match parts[..] {
        [] => String::new(),
        [one] => one.to_owned(),
        [ref others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}

/// A name, shortened if it is very long.
///
/// ```
/// assert_eq!(flexure::text::shortened("torque"), "torque");
/// ```
pub fn shortened(name: &str) -> String {
    /// Characters of a long name.
    const MOST: usize = 60;
    match name.char_indices().nth(MOST) {
        None => name.to_owned(),
        Some((end, _)) => format!("{}...", &name[..end]),
    }
}

/// The text with control characters written as `\\u001b`, except for line breaks and tabs: a terminal would take them as commands. Marks
/// that change the direction of a text or break a line are written in the same way, and so are invisible characters without a width.
///
/// ```
/// assert_eq!(flexure::text::visible("a\u{1b}[31mb"), r"a\u001b[31mb");
/// assert_eq!(flexure::text::visible("u\u{200b}"), r"u\u200b");
/// ```
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_command(c) && c != '\n' && c != '\t')
}

/// The path of a file as a part of a line: as [`visible`] shows it, and without line breaks.
///
/// ```
/// # use std::path::Path;
/// assert_eq!(flexure::text::shown_path(Path::new("a\nerror: b.csv")), r"a\u000aerror: b.csv");
/// ```
pub fn shown_path(path: &Path) -> String {
    escaped(&path.to_string_lossy(), is_command).into_owned()
}

fn is_command(c: char) -> bool {
    let directs = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    // The joiners U+200C and U+200D are not included: some scripts need them.
    directs || c.is_control() || matches!(c, '\u{200b}' | '\u{2060}' | '\u{feff}')
}

fn escaped(text: &str, is_unwanted: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_unwanted) {
        return Cow::Borrowed(text);
    }
    let shown = text.chars().map(|c| match is_unwanted(c) {
        true => format!("\\u{:04x}", u32::from(c)),
        false => c.to_string(),
    });
    Cow::Owned(shown.collect())
}

/// The text as [`visible`] shows it, with long runs of letters shortened.
///
/// ```
/// let text = format!("no column '{}' here", "x".repeat(1_000_000));
/// assert!(flexure::text::readable(&text).len() < 500);
/// ```
pub fn readable(text: &str) -> String {
    /// Characters of a long word.
    const MOST: usize = 400;
    let short = |word: &str| match word.char_indices().nth(MOST) {
        None => word.to_owned(),
        Some((end, _)) => {
            let space = word.trim_end().len();
            format!("{}...{}", &word[..end], &word[space..])
        }
    };
    visible(text).split_inclusive(char::is_whitespace).map(short).collect()
}

/// A p-value as it is usually written: to two digits, and not below 1e-6, as no distribution is known so well there.
///
/// ```
/// assert_eq!(flexure::text::p_value(0.02345), "p = 0.023");
/// assert_eq!(flexure::text::p_value(2.31e-87), "p < 1e-6");
/// ```
pub fn p_value(p: f64) -> String {
    match p {
        p if p < 1e-6 => "p < 1e-6".to_owned(),
        p if p < 1e-3 => format!("p = {p:.0e}"),
        p => format!("p = {}", digits(p, 2)),
    }
}

/// A share in percent to two digits, without an exponent. Below 0.01 % and between 99 and 100 % only that is said.
///
/// ```
/// assert_eq!(flexure::text::percent(0.000234), "0.023 %");
/// assert_eq!(flexure::text::percent(0.4567), "46 %");
/// assert_eq!(flexure::text::percent(1e-9), "less than 0.01 %");
/// ```
pub fn percent(share: f64) -> String {
    match 100.0 * share {
        p if p > 0.0 && p < 0.01 => "less than 0.01 %".to_owned(),
        p if p > 99.0 && p < 100.0 => "over 99 %".to_owned(),
        p => format!("{} %", digits(p, 2)),
    }
}

/// A fit in percent to this many decimals. How far a fit is below zero means nothing: there, a constant is better ([`BELOW_ZERO`]).
///
/// ```
/// assert_eq!(flexure::text::fit(96.328, 2), "96.33 %");
/// assert_eq!(flexure::text::fit(-444.0, 2), "below 0 %");
/// ```
pub fn fit(percent: f64, decimals: usize) -> String {
    match percent < 0.0 {
        true => "below 0 %".to_owned(),
        false => format!("{percent:.decimals$} %"),
    }
}

/// What a fit below zero means.
pub const BELOW_ZERO: &str = "A fit below 0 % is worse than a constant: the output's mean would have a smaller error.";

/// A share near 1 in percent, with enough decimals to show the difference from 100: 99.4, 99.98.
///
/// ```
/// assert_eq!(flexure::text::nearly_all(0.99398), "99.4 %");
/// assert_eq!(flexure::text::nearly_all(0.999968), "99.997 %");
/// assert_eq!(flexure::text::nearly_all(1.0), "100 %");
/// ```
pub fn nearly_all(share: f64) -> String {
    let missing = 100.0 * (1.0 - share);
    if !(missing >= 1e-6) {
        return "100 %".to_owned();
    }
    let decimals = (-missing.log10()).ceil().max(1.0) as usize;
    format!("{:.decimals$} %", 100.0 * share)
}

/// A number to this many digits, without an exponent. Whole numbers keep all their digits.
pub fn digits(value: f64, count: i32) -> String {
    let size = value.abs();
    if !(size > 0.0 && size.is_finite()) {
        return format!("{value:.0}");
    }
    let decimals = (count - 1 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

/// A value and its standard error to the same decimal place, the error to two digits: `0.5321 ± 0.0012`.
///
/// ```
/// assert_eq!(flexure::text::with_error(0.532149, 0.00123), "0.5321 ± 0.0012");
/// assert_eq!(flexure::text::with_error(12343.0, 678.0), "12340 ± 680");
/// assert_eq!(flexure::text::with_error(1.5e-7, 2.2e-9), "(1.500 ± 0.022)e-7");
/// assert_eq!(flexure::text::with_error(-0.0123, 4.1), "-0.012 ± 4.1");
/// ```
pub fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite() && value.is_finite()) {
        return number(value);
    }
    let size = value.abs().max(error);
    if !(1e-3..1e5).contains(&size) {
        let exponent = size.log10().floor() as i32;
        // The quotient is finite for powers of ten up to 300.
        let scale = 10_f64.powi(exponent.clamp(-300, 300));
        return format!("({})e{exponent}", with_error(value / scale, error / scale));
    }
    if error < NEARLY_EXACT * value.abs() {
        return format!("{} ± {error:.0e}", number(value));
    }
    let place = error_place(error);
    let unit = 10_f64.powi(-place);
    let rounded = |v: f64| (v / unit).round() * unit;
    if rounded(value) == 0.0 && value != 0.0 {
        return format!("{} ± {}", digits(value, 2), digits(error, 2));
    }
    let decimals = place.max(0) as usize;
    format!("{:.decimals$} ± {:.decimals$}", rounded(value), rounded(error))
}

/// If the relative error is below this, a value would have more digits than anybody reads.
const NEARLY_EXACT: f64 = 1e-6;

/// The decimal place of an error's second digit: 4 for 0.0012; negative before the point.
fn error_place(error: f64) -> i32 {
    // 0.00996 is 0.010, whose second digit is a place further to the left.
    let rounded: f64 = format!("{error:.1e}").parse().unwrap_or(error);
    1 - rounded.log10().floor() as i32
}

/// The text with a capital letter at the start.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The text without a capital letter at the start, as it goes on after a colon.
pub fn uncapitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

/// A count with its noun.
///
/// ```
/// assert_eq!(flexure::text::counted(1, "piece"), "1 piece");
/// assert_eq!(flexure::text::counted(3, "piece"), "3 pieces");
/// ```
pub fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::{nearly_all, number, p_value, percent, with_error};

    #[test]
    fn decimals_have_no_zeros_behind_them() {
        let shown = [0.0, 0.01, 4.5, 1.0 / 3.0, 123.456_789, -2e6, 0.1 + 0.2].map(super::decimal);
        assert_eq!(shown, ["0", "0.01", "4.5", "0.333333", "123.457", "-2000000", "0.3"]);
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.17391, 0.99999, 2.15, 1234.6, -99999.0, 1e-4, 2.5e7].map(number);
        assert_eq!(
            shown,
            ["0", "0.1739", "1.000", "2.150", "1235", "-99999", "1.000e-4", "2.500e7"]
        );
    }

    #[test]
    fn value_and_error_end_at_the_same_place_unless_the_value_would_vanish() {
        let cases = [
            (0.5321, 0.00123, "0.5321 ± 0.0012"),
            (-0.5321, 0.000996, "-0.5321 ± 0.0010"),
            (12.0, 3.0, "12.0 ± 3.0"),
            (0.0, 0.25, "0.00 ± 0.25"),
            (0.0004, 0.2, "0.00040 ± 0.20"),
            (98765.0, 1234.0, "98800 ± 1200"),
            (9.99999e4, 12.0, "100000 ± 12"),
            (2.5e7, 1.3e5, "(2.500 ± 0.013)e7"),
            (-4e-6, 2e-5, "(-0.4 ± 2.0)e-5"),
            (1.0, 1e-9, "1.000 ± 1e-9"),
            (0.25, f64::NAN, "0.2500"),
            (0.25, 0.0, "0.2500"),
            (0.25, f64::INFINITY, "0.2500"),
        ];
        for (value, error, text) in cases {
            assert_eq!(with_error(value, error), text);
        }
    }

    #[test]
    fn probabilities_and_shares_have_two_digits() {
        let p = [0.5, 0.0499, 0.01234, 0.000321, 1e-6, 0.99e-6, 0.0].map(p_value);
        assert_eq!(
            p,
            [
                "p = 0.50",
                "p = 0.050",
                "p = 0.012",
                "p = 3e-4",
                "p = 1e-6",
                "p < 1e-6",
                "p < 1e-6"
            ]
        );
        let shares = [1.0, 0.998, 0.0234, 0.00012, 1e-5, 0.0].map(percent);
        assert_eq!(
            shares,
            ["100 %", "over 99 %", "2.3 %", "0.012 %", "less than 0.01 %", "0 %"]
        );
        let most = [0.5, 0.9, 0.9949, 0.99951, 0.999_999_8, 1.0 - 1e-12].map(nearly_all);
        assert_eq!(most, ["50.0 %", "90.0 %", "99.5 %", "99.95 %", "99.99998 %", "100 %"]);
    }
}
