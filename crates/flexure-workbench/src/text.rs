//! Numbers and parameters of estimators as text.

use flexure::identify::result::{Score, Values};
use flexure::nonlinearity::{EstimatorName, Kernel, Scores};
use flexure::text::short;
pub use flexure::text::{capitalised, number};
use flexure_report::data::ScoreCurve;
use serde_json::{Value, json};

/// The kernel for reading, where the estimator has one: between `before` and `after`.
pub fn kernel_text(name: EstimatorName, kernel: Kernel, before: &str, after: &str) -> String {
    match name.has_bandwidth() {
        true => format!("{before}{} kernel{after}", kernel.name()),
        false => String::new(),
    }
}

/// The scores as the page draws them; `x` names the column of x.
pub fn score_curve(name: EstimatorName, scores: &Scores, chosen: &[f64], x: &str) -> ScoreCurve {
    crate::systems::score_curve(Score::of_parameter(name, scores, chosen, x))
}

/// How the parameter with the smallest score was found.
pub fn smallest(criterion: &str, scores: &Scores) -> String {
    scores.smallest(criterion)
}

/// The scores as JSON.
pub fn scores_json(scores: &Scores) -> Value {
    json!(Values::from(scores))
}

/// Values of a parameter for reading: whole numbers as they are.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|&v| short(v)).collect::<Vec<_>>().join(", ")
}
