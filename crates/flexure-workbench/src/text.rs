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

/// Values of a parameter for reading: whole numbers as they are.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|&v| short(v)).collect::<Vec<_>>().join(", ")
}
