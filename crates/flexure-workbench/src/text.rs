//! Numbers and parameters of estimators as text.

use flexure::nonlinearity::{EstimatorName, Kernel};
pub use flexure::text::{capitalised, decimal, number};
use flexure::text::{joined, short};

/// The kernel for reading, between `before` and `after`; empty if the estimator has none.
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
    let names: Vec<String> = names.into_iter().map(|name| format!("'{name}'")).collect();
    joined(&names)
}

/// A joint for reading: its name, after the word "joint" if the name does not have it.
pub fn joint_name(name: &str) -> String {
    match name.to_lowercase().contains("joint") {
        true => name.to_owned(),
        false => format!("joint {name}"),
    }
}

/// Values of a parameter for reading: whole numbers as they are.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|&v| short(v)).collect::<Vec<_>>().join(", ")
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
    fn the_word_joint_is_not_doubled() {
        let shown = ["joint1", "shoulder_pan_Joint", "elbow", "'elbow'"].map(super::joint_name);
        assert_eq!(shown, ["joint1", "shoulder_pan_Joint", "joint elbow", "joint 'elbow'"]);
    }

    #[test]
    fn thousands_are_grouped() {
        let shown = [0, 12, 999, 1000, 12_000, 123_456, 1_234_567].map(super::grouped);
        assert_eq!(shown, ["0", "12", "999", "1,000", "12,000", "123,456", "1,234,567"]);
    }
}
