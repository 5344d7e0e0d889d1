//! Numbers and parameters of estimators as text.

use flexure::nonlinearity::{EstimatorName, Kernel};
use flexure::text::short;
pub use flexure::text::{capitalised, number};

/// The kernel for reading, where the estimator has one: between `before` and `after`.
pub fn kernel_text(name: EstimatorName, kernel: Kernel, before: &str, after: &str) -> String {
    match name.has_bandwidth() {
        true => format!("{before}{} kernel{after}", kernel.name()),
        false => String::new(),
    }
}

/// A level in percent.
pub fn percent(level: f64) -> String {
    let rounded = (level * 1e4).round() / 1e2;
    rounded.to_string()
}

/// Names for reading: "'u', 'v' and 'w'".
pub fn quoted<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names: Vec<String> = names.into_iter().map(|name| format!("'{name}'")).collect();
    let last = names.pop().unwrap_or_default();
    match names.is_empty() {
        true => last,
        false => format!("{} and {last}", names.join(", ")),
    }
}

/// Values of a parameter for reading: whole numbers as they are.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|&v| short(v)).collect::<Vec<_>>().join(", ")
}

/// A number to at most six digits, without zeros behind them: 0.01, not 0.01000.
pub fn decimal(number: f64) -> String {
    let rounded: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    rounded.to_string()
}

/// A whole number with commas between its groups of three digits: 12,000.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    #[test]
    fn decimals_have_no_zeros_behind_them() {
        let shown = [0.0, 0.01, 4.5, 1.0 / 3.0, 123.456_789, -2e6, 0.1 + 0.2].map(super::decimal);
        assert_eq!(shown, ["0", "0.01", "4.5", "0.333333", "123.457", "-2000000", "0.3"]);
    }

    #[test]
    fn thousands_are_grouped() {
        let shown = [0, 12, 999, 1000, 12_000, 123_456, 1_234_567].map(super::grouped);
        assert_eq!(shown, ["0", "12", "999", "1,000", "12,000", "123,456", "1,234,567"]);
    }
}
