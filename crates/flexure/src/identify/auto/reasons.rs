//! The reasons in sentences.

use super::compared_structures;
use super::comparison::{Refutation, StructureCandidate};
use super::judge::Judgement;
use crate::text::{capitalised, percent};

/// What is supported and why, then what refutes each candidate, then what was not fitted.
pub(super) fn reasons(candidates: &[StructureCandidate], judgement: &Judgement<'_>) -> Vec<String> {
    let chosen = &candidates[judgement.chosen];
    let name = chosen.structure;
    let verdict = judgement.verdict;
    let mut all = vec![match (judgement.supported, verdict.refutation()) {
        (true, None) => {
            format!("The data support {name}: no simpler structure predicts as well, and no residual test refutes it.")
        }
        (true, Some(_)) => format!(
            "The data support {name}: no simpler structure predicts as well, and the misfit that a test sees is negligible, {} of the \
             output's standard deviation.",
            percent(verdict.misfit())
        ),
        (false, _) if verdict.measures.fit_percent <= 0.0 => {
            format!("The data support none of these structures: the best, {name}, explains nothing.")
        }
        (false, _) if verdict.residuals.is_none() => {
            format!("The data support none of these structures: too few of them are fresh to test the best, {name}.")
        }
        (false, None) => format!(
            "The data support none of these structures: the error of the best, {name}, is large and not white, which is noise or something \
             that all of them miss."
        ),
        (false, Some(_)) => format!(
            "The data support none of these structures: the best, {name}, is refuted, and at least {} of its squared error is not noise. \
             A nonlinearity in feedback or parallel branches would do that.",
            percent(judgement.not_noise)
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
