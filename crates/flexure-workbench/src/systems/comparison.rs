//! What the data say about the structures that were compared: as JSON, in words and on the page.

use flexure::identify::{AutoIdentification, Identified, Refutation, Structure, StructureCandidate};
use flexure_report::data::{Page, Table};
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::structure;
use crate::text::number;

/// The outcome of a comparison of structures.
pub struct Comparison {
    chosen: Structure,
    supported: Option<Structure>,
    as_good: Vec<Structure>,
    not_noise: f64,
    candidates: Vec<StructureCandidate>,
    reasons: Vec<String>,
}

impl Comparison {
    /// The comparison, and the identification of the chosen structure.
    pub fn split(result: AutoIdentification) -> (Self, Identified) {
        let comparison = Comparison {
            chosen: result.chosen.structure(),
            supported: result.supported,
            as_good: result.as_good,
            not_noise: result.not_noise,
            candidates: result.candidates,
            reasons: result.reasons,
        };
        (comparison, result.chosen)
    }

    /// The answer in a few words.
    fn answer(&self) -> String {
        match self.supported {
            Some(structure) => structure.name().to_owned(),
            None => "none of these".to_owned(),
        }
    }

    /// What is said of the model that follows where the data support no structure.
    fn reservation(&self) -> Option<String> {
        self.supported.is_none().then(|| {
            format!(
                "The model is the best of these structures, {}: an approximation under inputs like this one, not the system.",
                self.chosen
            )
        })
    }

    /// The reasons, and the reservation.
    fn sentences(&self) -> impl Iterator<Item = String> {
        self.reasons.iter().cloned().chain(self.reservation())
    }

    /// The object that `identify --structure auto --json` and the model file have.
    pub fn json(&self) -> Value {
        let name = |s: Structure| structure::Structure::from(s).name();
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
            "supported": self.supported.map(name),
            "best": name(self.chosen),
            "as_good": self.as_good.iter().copied().map(name).collect::<Vec<_>>(),
            "not_noise": self.not_noise,
            "reasons": self.reasons,
            "candidates": self.candidates.iter().map(candidate).collect::<Vec<_>>(),
        })
    }

    /// The comparison for a terminal.
    pub fn lines(&self, input: &str, output: &str) -> Vec<String> {
        let mut lines = vec![
            format!("Structure from '{input}' to '{output}': {}", self.answer()),
            format!("  {:<20} {:>10} {:>11} {:>11}", "", "fit", "RMS error", "parameters"),
        ];
        lines.extend(self.candidates.iter().map(|c| {
            let refuted = if c.refuted_by.is_empty() { "" } else { "  refuted" };
            let (fit, rms) = (format!("{:.2} %", c.fit_percent), number(c.rms));
            let name = c.structure.name();
            format!("  {name:<20} {fit:>10} {rms:>11} {:>11}{refuted}", c.parameters)
        }));
        lines.extend(self.sentences().map(|s| format!("  {s}")));
        lines
    }

    /// Puts the comparison onto the page of the chosen structure.
    pub fn show_on(&self, page: &mut Page) {
        let exact = |c: &StructureCandidate| c.structure == self.chosen && c.refuted_by.is_empty();
        page.verdict.holds = self.supported.is_some() && self.candidates.iter().any(exact);
        let reserve = if page.verdict.holds { "" } else { ", though not exactly" };
        page.verdict.headline = match self.supported {
            Some(structure) if self.as_good.is_empty() => {
                format!("The data support one structure{reserve}: {structure}")
            }
            Some(structure) => format!(
                "The data support {structure} and {} alike{reserve}",
                self.as_good.iter().map(|s| s.name()).collect::<Vec<_>>().join(" and ")
            ),
            None if self.candidates.iter().all(|c| !c.refuted_by.is_empty()) => {
                "None of these structures: the data refute them all".to_owned()
            }
            None => "None of these structures is supported by the data".to_owned(),
        };
        let first = self.reasons.first().cloned().into_iter().chain(self.reservation());
        let words: Vec<String> = first.chain([std::mem::take(&mut page.verdict.words)]).collect();
        page.verdict.words = words.join(" ");
        page.candidates.insert(0, self.table());
    }

    fn table(&self) -> Table {
        let rows = self.candidates.iter().map(|c| {
            let by: Vec<String> = c.refuted_by.iter().map(Refutation::to_string).collect();
            let refuted = match by.is_empty() {
                true => "nothing".to_owned(),
                false => by.join("; "),
            };
            vec![
                c.structure.name().to_owned(),
                format!("{:.2} %", c.fit_percent),
                number(c.rms),
                c.parameters.to_string(),
                refuted,
            ]
        });
        let others = self.reasons.iter().skip(1).filter(|r| !r.contains(" is refuted by "));
        let mut words = vec![
            "Each was fitted to the first part of the record and judged on the rest, which none of them has seen. A structure is \
             refuted by another one that predicts significantly better, or by a residual test."
                .to_owned(),
        ];
        words.extend(others.cloned());
        Table {
            title: "Structures that were compared".to_owned(),
            words: words.join(" "),
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
            chosen: (self.candidates.iter()).position(|c| Some(c.structure) == self.supported),
            ends_in_words: true,
        }
    }
}
