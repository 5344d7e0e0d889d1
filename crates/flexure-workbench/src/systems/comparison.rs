//! What the data say about the structures that were compared: as JSON, as text and on the page.

use flexure::identify::result::StructureName;
use flexure::identify::{Refutation, StructureCandidate, StructureComparison, Symptom};
use flexure::text::{BELOW_ZERO, counted, fit, joined, number};
use flexure_report::data::{Page, Table};
use serde_json::{Value, json};

use crate::lines::{Lines, Tone};

/// What refutes a structure.
const REFUTED: &str =
    "A structure is refuted by another one that predicts significantly better, or by a residual test.";

/// The answer, in short.
fn answer(comparison: &StructureComparison) -> String {
    let Some(structure) = comparison.supported else {
        let nearest = nearest(comparison).map_or(String::new(), |nearest| format!("; {nearest}"));
        return format!("none of these{nearest}");
    };
    structure.title.to_owned()
}

/// The chosen structure and its fit, where no structure is supported and the fit means anything.
fn nearest(comparison: &StructureComparison) -> Option<String> {
    let chosen = comparison
        .candidates
        .iter()
        .find(|c| c.structure == comparison.chosen)?;
    let fit = chosen.fit_percent;
    // A difference that is not printed needs no explanation.
    let shown = |fit: f64| (10.0 * fit).round();
    let has_best_fit = comparison.candidates.iter().all(|c| shown(c.fit_percent) <= shown(fit));
    (fit > 0.0).then(|| match has_best_fit {
        true => format!("{} comes nearest, fit {fit:.1} %", comparison.chosen),
        false => format!(
            "none predicts significantly better than {}, fit {fit:.1} %",
            comparison.chosen
        ),
    })
}

/// The reservation about the chosen model if the data support no structure.
fn reservation(comparison: &StructureComparison) -> Option<String> {
    comparison.supported.is_none().then(|| {
        format!(
            "The {} model is an approximation under inputs like this one, not the system.",
            comparison.chosen
        )
    })
}

/// The object in the output of `identify --structure auto --json` and in the model file.
pub fn json(comparison: &StructureComparison) -> Value {
    let name = |s: StructureName| s.key;
    let refutation = |r: &Refutation| match r {
        Refutation::Comparison { better, ratio, p_value } => {
            json!({ "by": "comparison", "better": name(*better), "squared_error_ratio": ratio, "p_value": p_value })
        }
        Refutation::Test(t) => json!({
            "by": "test",
            "test": t.kind.name(),
            "statistic": t.statistic,
            "limit": t.limit,
            "p_value": t.p_value,
        }),
    };
    let like = |(kind, share): &(Symptom, f64)| json!({ "kind": kind.key(), "share": share });
    let candidate = |c: &StructureCandidate| {
        json!({
            "structure": name(c.structure),
            "fit_percent": c.fit_percent,
            "rms": c.rms,
            "parameters": c.parameters,
            "refuted_by": c.refuted_by.iter().map(refutation).collect::<Vec<_>>(),
            "verdict": c.verdict,
        })
    };
    json!({
        "supported": comparison.supported.is_some(),
        "best": name(comparison.chosen),
        "as_good": comparison.as_good.iter().copied().map(name).collect::<Vec<_>>(),
        "not_noise": comparison.not_noise,
        "looks_like": comparison.looks_like.iter().map(like).collect::<Vec<_>>(),
        "reasons": comparison.reasons,
        "candidates": comparison.candidates.iter().map(candidate).collect::<Vec<_>>(),
    })
}

/// What a fit below zero means, if a candidate has one.
fn below_zero(comparison: &StructureComparison) -> Option<String> {
    let any = comparison.candidates.iter().any(|c| c.fit_percent < 0.0);
    any.then(|| BELOW_ZERO.to_owned())
}

/// The comparison for reading; `columns` says from which columns to which.
pub fn write(comparison: &StructureComparison, columns: &str, lines: &mut Lines) {
    let tone = match comparison.supported {
        Some(_) => Tone::Good,
        None => Tone::Caution,
    };
    lines.headline(tone, format!("Structure {columns}: {}", answer(comparison)));
    let names = comparison.candidates.iter().map(|c| c.structure.title.chars().count());
    let width = names.fold(20, usize::max);
    lines.row(format!(
        "{:<width$} {:>10} {:>11} {:>11}",
        "", "fit", "RMS error", "parameters"
    ));
    for c in &comparison.candidates {
        let refuted = match (c.refuted_by.is_empty(), is_supported(comparison, c)) {
            (true, _) => String::new(),
            (false, false) => format!("  refuted by {}", refuted_by(c)),
            // A test detects the misfit, but it is too small to matter.
            (false, true) => "  negligible misfit".to_owned(),
        };
        let (fit, rms) = (fit(c.fit_percent, 2), number(c.rms));
        let name = c.structure.title;
        lines.row(format!(
            "{name:<width$} {fit:>10} {rms:>11} {:>11}{refuted}",
            c.parameters
        ));
    }
    let any_is_refuted = comparison.candidates.iter().any(|c| !c.refuted_by.is_empty());
    let mut reasons = reasons(comparison).cloned();
    let answer = reasons.next().into_iter();
    let sentences = (answer.chain(any_is_refuted.then(|| REFUTED.to_owned())))
        .chain(below_zero(comparison))
        .chain(reasons)
        .chain(reservation(comparison));
    sentences.for_each(|sentence| lines.sentence(sentence));
}

/// What refutes a candidate, in short.
fn refuted_by(candidate: &StructureCandidate) -> String {
    let better = candidate.refuted_by.iter().find_map(|r| match r {
        Refutation::Comparison { better, .. } => Some(better.title.to_owned()),
        Refutation::Test(_) => None,
    });
    let tests = candidate.refuted_by.len() - usize::from(better.is_some());
    let tests = (tests > 0).then(|| counted(tests, "test"));
    joined(&better.into_iter().chain(tests).collect::<Vec<_>>())
}

/// The reasons without those that a table gives, structure by structure.
fn reasons(comparison: &StructureComparison) -> impl Iterator<Item = &String> {
    comparison.reasons.iter().filter(|r| !r.contains(" is refuted by "))
}

/// Whether the data support this candidate.
fn is_supported(comparison: &StructureComparison, candidate: &StructureCandidate) -> bool {
    comparison.supported == Some(candidate.structure)
}

/// Puts the comparison onto the page of the chosen structure.
pub fn show_on(comparison: &StructureComparison, page: &mut Page) {
    page.verdict.holds = comparison.supported.is_some();
    page.verdict.headline = match comparison.supported {
        Some(structure) if comparison.as_good.is_empty() => {
            format!("The data support {structure}")
        }
        Some(structure) => {
            let all = std::iter::once(&structure).chain(&comparison.as_good);
            let titles: Vec<&str> = all.map(|s| s.title).collect();
            format!("The data support {} equally", joined(&titles))
        }
        None if comparison.candidates.iter().all(|c| !c.refuted_by.is_empty()) => {
            let nearest = nearest(comparison).map_or(String::new(), |nearest| format!("; {nearest}"));
            format!("None of these structures holds{nearest}")
        }
        None => "None of these structures is supported by the data".to_owned(),
    };
    let first = comparison
        .reasons
        .first()
        .cloned()
        .into_iter()
        .chain(reservation(comparison));
    let sentences: Vec<String> = first.chain([std::mem::take(&mut page.verdict.text)]).collect();
    page.verdict.text = sentences.join("\n");
    page.candidates.insert(0, table(comparison));
}

fn table(comparison: &StructureComparison) -> Table {
    let rows = comparison.candidates.iter().map(|c| {
        let by: Vec<String> = c.refuted_by.iter().map(Refutation::to_string).collect();
        let refuted = match (by.is_empty(), is_supported(comparison, c)) {
            (true, _) => "nothing".to_owned(),
            (false, false) => by.join("; "),
            (false, true) => format!("nothing that matters: {} sees a negligible misfit", by.join("; ")),
        };
        vec![
            c.structure.title.to_owned(),
            fit(c.fit_percent, 2),
            number(c.rms),
            c.parameters.to_string(),
            refuted,
        ]
    });
    let mut sentences = vec![format!(
        "Each was fitted to the first part of the record and judged on the rest, which none of them has seen. {REFUTED}"
    )];
    sentences.extend(below_zero(comparison));
    sentences.extend(reasons(comparison).skip(1).cloned());
    Table {
        title: "Structures that were compared".to_owned(),
        text: sentences.join(" "),
        columns: [
            "structure",
            "fit on fresh data",
            "RMS error",
            "parameters",
            "refuted by",
        ]
        .map(String::from)
        .to_vec(),
        rows: rows.collect(),
        chosen: (comparison.candidates.iter()).position(|c| Some(c.structure) == comparison.supported),
        ends_in_text: true,
    }
}
