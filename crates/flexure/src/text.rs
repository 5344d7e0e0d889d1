//! Numbers and text for readers.

/// A number to four digits, without an exponent where it is of everyday size.
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

/// A number as [`number`] writes it, a whole number below a million without decimals.
pub fn short(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e6 {
        format!("{value}")
    } else {
        number(value)
    }
}

/// The text with a capital letter at the start.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// "1 piece", "3 pieces".
pub(crate) fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.17391, 0.99999, 2.15, 1234.6, -99999.0, 1e-4, 2.5e7].map(number);
        assert_eq!(
            shown,
            ["0", "0.1739", "1.000", "2.150", "1235", "-99999", "1.000e-4", "2.500e7"]
        );
    }
}
