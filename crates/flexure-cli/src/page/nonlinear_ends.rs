//! The page of a Hammerstein-Wiener model.

use anyhow::Result;
use flexure::identify::HammersteinWienerIdentification;
use flexure_io::RecordFile;
use flexure_report::data::{Choice, Fact, LinearPart, Nonlinearity, Page, Table};

use super::{
    Decoration, Judged, Parts, assembled, density, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::nonlinear_ends::{PIECES_WHY, linear_block, pieces_words};
use crate::outcome::{Signals, number};
use crate::tuning;

/// Values of the nonlinearity at the output that the page shows.
const VALUES: usize = 21;

/// Fills in the page.
pub fn page(
    file: &RecordFile,
    signals: &Signals,
    result: &HammersteinWienerIdentification,
    decoration: Decoration,
) -> Result<Page> {
    let u = file.record.finite(signals.input)?;
    let block = linear_block(result);
    let parts = Parts {
        facts: facts(signals, result),
        nonlinearity: nonlinearity(u, signals, result),
        linear: vec![LinearPart {
            words: format!("{}.", tuning::capitalised(&block.words())),
            ..linear_part(block.title, &block.system, None, signals.sample_time)
        }],
        choices: choices(result),
        candidates: vec![output(signals, result)],
        ..Parts::default()
    };
    let judged = Judged {
        signals: *signals,
        model: "A Hammerstein-Wiener model (a static nonlinearity, linear dynamics, a static nonlinearity)".to_owned(),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict: &result.verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn facts(signals: &Signals, result: &HammersteinWienerIdentification) -> Vec<Fact> {
    let pieces = |breakpoints: &[f64]| breakpoints.len().saturating_sub(1);
    let both = format!(
        "{} + {}",
        pieces(&result.input_breakpoints),
        pieces(&result.output_breakpoints)
    );
    let mut facts = fit_facts(&result.verdict, signals.output).to_vec();
    facts.extend([
        fact(
            "Poles",
            result.order.to_string(),
            "of the linear part, by Schwarz's criterion",
        ),
        fact("Delay", samples(result.delay), "of the linear part"),
        fact("Pieces", both, "cubic ones, of the nonlinearities at input and output"),
        samples_fact(result.predicted.len(), result.fitted, ""),
    ]);
    facts
}

fn nonlinearity(u: &[f64], signals: &Signals, result: &HammersteinWienerIdentification) -> Nonlinearity {
    let curve = &result.input_nonlinearity;
    Nonlinearity {
        x_label: labelled(signals.input),
        y_label: "output of the nonlinearity at the input".to_owned(),
        x: curve.x().to_vec(),
        y: curve.y().to_vec(),
        lower: Vec::new(),
        upper: Vec::new(),
        band_label: String::new(),
        density: density(&u[..result.fitted], curve.x()),
        truth: Vec::new(),
        truth_label: String::new(),
    }
}

fn choices(result: &HammersteinWienerIdentification) -> Vec<Choice> {
    let choice = |name: &str, value: String, why: &str| Choice {
        name: name.to_owned(),
        value,
        why: why.to_owned(),
        curve: None,
    };
    vec![
        choice(
            "Poles",
            result.order.to_string(),
            "poles, numerator coefficients and delay added and taken away while Schwarz's criterion of the free-run error falls",
        ),
        choice(
            "Nonlinearity at the input",
            pieces_words(&result.input_breakpoints, &result.input_kinks),
            PIECES_WHY,
        ),
        choice(
            "Nonlinearity at the output",
            pieces_words(&result.output_breakpoints, &result.output_kinks),
            PIECES_WHY,
        ),
    ]
}

/// The nonlinearity at the output as a table.
fn output(signals: &Signals, result: &HammersteinWienerIdentification) -> Table {
    let curve = &result.output_nonlinearity;
    let (low, high) = (curve.x()[0], curve.x()[curve.x().len() - 1]);
    let row = |i: usize| {
        let x = low + (high - low) * i as f64 / (VALUES - 1) as f64;
        vec![number(x), number(curve.value(x))]
    };
    Table {
        title: "Nonlinearity at the output".to_owned(),
        words: "What the linear part gives, and what becomes of it; the model's file has the whole curve.".to_owned(),
        columns: vec!["linear part's output".to_owned(), labelled(signals.output)],
        rows: (0..VALUES).map(row).collect(),
        chosen: None,
        ends_in_words: false,
    }
}
