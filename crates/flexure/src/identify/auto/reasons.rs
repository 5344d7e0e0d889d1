//! The reasons in sentences.

use super::compared_structures;
use super::comparison::{Refutation, StructureCandidate};
use super::judge::Judgement;
use super::limits::NEAR_NOISE;
use crate::text::capitalised;

/// What is supported and why, then what refutes each candidate, then what was not fitted.
pub(super) fn reasons(candidates: &[StructureCandidate], judgement: &Judgement) -> Vec<String> {
    let chosen = &candidates[judgement.chosen];
    let name = chosen.structure;
    let percent = 100.0 * judgement.not_noise;
    let tests = chosen.refuted_by.len();
    let mut all = vec![match (judgement.supported, tests) {
        (true, 0) => {
            format!("The data support {name}: no simpler structure predicts as well, and no residual test refutes it.")
        }
        (true, _) => format!(
            "The data support {name}: no simpler structure predicts as well. A test sees that it is not exact, but a \
             regression of its error on the input finds only {percent:.1} % of the squared error to depend on it."
        ),
        (false, 0) => format!(
            "The data support none of the structures: the best, {name}, explains nothing or could not be tested."
        ),
        (false, _) if judgement.not_noise < NEAR_NOISE => format!(
            "The data support none of these structures: the best, {name}, is refuted, and its error is too large to be taken for \
             noise. Nonlinear feedback or parallel branches would do that."
        ),
        (false, _) => format!(
            "The data support none of these structures: the best, {name}, is refuted, and at least {percent:.1} % of its \
             squared error is not noise but depends on the input. Nonlinear feedback or parallel branches would do that."
        ),
    }];
    for i in &judgement.ties {
        let other = candidates[*i].structure;
        all.push(format!(
            "{other} predicts as well as {name}: these data do not distinguish them."
        ));
    }
    for c in candidates.iter().filter(|c| !c.refuted_by.is_empty()) {
        let by: Vec<String> = c.refuted_by.iter().map(Refutation::to_string).collect();
        all.push(format!(
            "{} is refuted by {}.",
            capitalised(c.structure.title),
            by.join("; by ")
        ));
    }
    let skipped: Vec<&str> = compared_structures()
        .iter()
        .filter(|s| candidates.iter().all(|c| c.structure != s.name))
        .map(|s| s.name.title)
        .collect();
    if !skipped.is_empty() {
        all.push(format!(
            "Not fitted, as a simpler structure leaves white noise: {}.",
            skipped.join(", ")
        ));
    }
    all
}
