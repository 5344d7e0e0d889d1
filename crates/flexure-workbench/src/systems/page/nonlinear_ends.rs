//! The page of a Hammerstein-Wiener model.

use anyhow::Result;
use flexure::identify::HammersteinWienerIdentification;
use flexure_io::RecordFile;
use flexure_report::data::{Choice, Fact, LinearPart, Nonlinearity, Page, TitledCurve};

use super::{
    Decoration, Judged, Parts, assembled, choice, density, fact, fit_facts, kinks_fact, labelled, linear_part, samples,
    samples_fact,
};
use crate::systems::nonlinear_ends::{PIECES_WHY, linear_block, pieces_words};
use crate::systems::outcome::Signals;
use crate::text;

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
            words: format!("{}.", text::capitalised(&block.words())),
            ..linear_part(block.title, &block.system, None, signals.sample_time)
        }],
        choices: choices(result),
        curves: vec![output(signals, result)],
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
    ]);
    facts.extend(kinks_fact(&[result.input_kinks.len(), result.output_kinks.len()]));
    facts.push(samples_fact(result.predicted.len(), result.fitted, ""));
    facts
}

fn nonlinearity(u: &[f64], signals: &Signals, result: &HammersteinWienerIdentification) -> Nonlinearity {
    let curve = &result.input_nonlinearity;
    Nonlinearity {
        x_label: labelled(signals.input),
        y_label: "output of the nonlinearity at the input".to_owned(),
        x: curve.x().to_vec(),
        y: curve.y().to_vec(),
        density: density(&u[..result.fitted], curve.x()),
        ..Nonlinearity::default()
    }
}

fn choices(result: &HammersteinWienerIdentification) -> Vec<Choice> {
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

fn output(signals: &Signals, result: &HammersteinWienerIdentification) -> TitledCurve {
    let curve = &result.output_nonlinearity;
    TitledCurve {
        title: "Nonlinearity at the output".to_owned(),
        curve: Nonlinearity {
            x_label: "output of the linear part".to_owned(),
            y_label: labelled(signals.output),
            x: curve.x().to_vec(),
            y: curve.y().to_vec(),
            ..Nonlinearity::default()
        },
    }
}
