//! The reasons in sentences.

use super::Others;
use super::comparison::{Refutation, StructureCandidate};
use super::judge::Judgement;
use super::symptoms::Symptom;
use crate::text::{capitalised, counted, joined, percent};

/// What is supported and why, then what refutes each candidate, then what was not fitted.
pub(super) fn reasons(candidates: &[StructureCandidate], judgement: &Judgement<'_>, others: &Others) -> Vec<String> {
    let name = candidates[judgement.chosen].structure;
    let mut all = vec![answer(candidates, judgement)];
    if !judgement.supported && judgement.verdict.measures.fit_percent > 0.0 {
        all.push(looks_like(&judgement.looks_like));
    }
    for i in &judgement.ties {
        let other = candidates[*i].structure;
        all.push(format!(
            "{other} predicts as well as {name}: these data do not distinguish them."
        ));
    }
    all.extend(more_general(candidates, judgement));
    let refuted = candidates
        .iter()
        .filter(|c| !(judgement.supported && c.structure == name))
        .filter_map(|c| Some((c, strongest(c)?)));
    all.extend(refuted.map(|(c, by)| format!("{} is refuted by {by}.", capitalised(c.structure.title))));
    all.extend(not_fitted(others));
    all
}

/// Which structures the data support, if any, and why.
fn answer(candidates: &[StructureCandidate], judgement: &Judgement<'_>) -> String {
    let (name, verdict) = (candidates[judgement.chosen].structure, judgement.verdict);
    match (judgement.supported, verdict.refutation()) {
        (true, refutation) => {
            let equal = judgement.ties.iter().map(|i| candidates[*i].structure.title);
            let equal: Vec<&str> = std::iter::once(name.title).chain(equal).collect();
            let supported = match equal.len() {
                1 => name.title.to_owned(),
                _ => format!("{} equally", joined(&equal)),
            };
            // Nothing is simpler than the first.
            let simpler = match judgement.chosen {
                0 => "",
                _ => "simpler structures predict worse, and ",
            };
            let why = match refutation {
                None => format!("no residual test refutes {name}."),
                Some(_) => format!(
                    "the misfit that a test sees is negligible, {} of the output's standard deviation.",
                    percent(verdict.misfit())
                ),
            };
            format!("The data support {supported}: {simpler}{why}")
        }
        (false, _) if verdict.measures.fit_percent <= 0.0 => {
            format!("The data support none of these structures: even {name} explains nothing.")
        }
        (false, _) if verdict.residuals.is_none() => {
            format!("The data support none of these structures: too few of them are fresh to test {name}.")
        }
        (false, None) => format!(
            "The data support none of these structures. No other predicts significantly better than {name}, but its error is large and \
             not white: coloured noise, or something that all of them miss."
        ),
        (false, Some(_)) => format!(
            "The data support none of these structures: no other predicts significantly better than {name}, and a residual test refutes it."
        ),
    }
}

/// The structures that hold as well, but are more general than the supported one.
fn more_general(candidates: &[StructureCandidate], judgement: &Judgement<'_>) -> Option<String> {
    let holds = |i: usize, c: &StructureCandidate| {
        judgement.supported && i != judgement.chosen && c.refuted_by.is_empty() && !judgement.ties.contains(&i)
    };
    let as_well = (candidates.iter().enumerate()).filter(|(i, c)| holds(*i, c));
    let as_well: Vec<&str> = as_well.map(|(_, c)| c.structure.title).collect();
    let predict = match as_well.len() {
        0 => return None,
        1 => "predicts",
        _ => "predict",
    };
    let name = candidates[judgement.chosen].structure;
    Some(format!(
        "More general than {name}, {} {predict} as well.",
        joined(&as_well)
    ))
}

/// What was not fitted, or came out as something simpler.
fn not_fitted(others: &Others) -> Vec<String> {
    let simpler = others
        .simpler
        .iter()
        .map(|(more, name)| format!("{more} came out as {name}: one of its linear parts is a mere delay."));
    let left_out = [
        (&others.superfluous, "a simpler structure holds"),
        (&others.too_few_samples, "the samples are too few"),
    ];
    let left_out = left_out.into_iter().filter(|(titles, _)| !titles.is_empty());
    let left_out = left_out.map(|(titles, why)| format!("Not fitted, as {why}: {}.", titles.join(", ")));
    let only = (others.too_long)
        .then(|| "Only these two structures were compared: with so many samples, the others take long.".to_owned());
    simpler.chain(left_out).chain(only).collect()
}

/// The strongest evidence against a candidate: a comparison, otherwise the test that detects the largest share.
fn strongest(c: &StructureCandidate) -> Option<String> {
    let seen = |r: &Refutation| match r {
        Refutation::Comparison { .. } => f64::INFINITY,
        Refutation::Test(t) => t.dependent_share(),
    };
    let first = c.refuted_by.iter().max_by(|a, b| seen(a).total_cmp(&seen(b)))?;
    let others = c.refuted_by.len() - 1;
    let test = match first {
        Refutation::Comparison { .. } => "residual test",
        Refutation::Test(_) => "more residual test",
    };
    Some(match others {
        0 => first.to_string(),
        _ => format!("{first}, and by {}", counted(others, test)),
    })
}

/// A sentence on what the error looks like.
fn looks_like(symptoms: &[(Symptom, f64)]) -> String {
    let all: Vec<&str> = symptoms.iter().map(|(kind, _)| kind.phrase()).collect();
    match all.as_slice() {
        [] => "The cause of the error is unknown: no large part of it looks like a loop, a drift in time, hysteresis or outliers.".to_owned(),
        [first] => format!("Its error looks like {first}."),
        several => format!("Its error looks like the following, the largest part first: {}.", several.join("; ")),
    }
}
