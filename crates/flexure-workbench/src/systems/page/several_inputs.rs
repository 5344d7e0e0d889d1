//! The page of a model of several inputs, each through blocks of its own.

use anyhow::Result;
use flexure::identify::{InputBranch, MultipleInputsIdentification, Verdict};
use flexure_io::RecordFile;
use flexure_report::data::{Choice, Fact, LinearPart, Nonlinearity, Page, TitledCurve};

use super::{
    Decoration, Judged, Parts, assembled, choice, density, fact, fit_facts, kinks_fact, labelled, linear_part,
    samples_fact,
};
use crate::systems::cascade::LinearBlock;
use crate::systems::nonlinear_ends::{PIECES_WHY, pieces_words};
use crate::systems::outcome::Signals;
use crate::text;

/// Fills in the page.
pub fn page(
    file: &RecordFile,
    signals: &Signals,
    result: &MultipleInputsIdentification,
    decoration: Decoration,
) -> Result<Page> {
    let mut curves = Vec::new();
    for branch in &result.branches {
        let u = &file.record.finite(&branch.input)?[..result.fitted];
        curves.push(nonlinearity(u, branch));
    }
    let linear = result.branches.iter().map(|branch| {
        let block = LinearBlock {
            key: "linear",
            title: "Linear part",
            system: branch.linear.clone(),
        };
        LinearPart {
            words: format!("{}.", text::capitalised(&block.words())),
            ..linear_part(
                &format!("Linear part of '{}'", branch.input),
                &block.system,
                None,
                signals.sample_time,
            )
        }
    });
    let names = result.branches.iter().map(|b| format!("From '{}'", b.input));
    let mut titled = names.zip(curves).map(|(title, curve)| TitledCurve { title, curve });
    let parts = Parts {
        nonlinearity: titled.next().map_or_else(Nonlinearity::default, |first| first.curve),
        curves: titled.collect(),
        linear: linear.collect(),
        choices: choices(result),
        facts: facts(signals, result),
        ..Parts::default()
    };
    let verdict = Verdict::worst(&result.verdicts).ok_or_else(|| anyhow::anyhow!("the model has no input"))?;
    let judged = Judged {
        signals: *signals,
        model: format!(
            "A model of {} inputs, each through a static nonlinearity and linear dynamics of its own,",
            result.branches.len()
        ),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn nonlinearity(u: &[f64], branch: &InputBranch) -> Nonlinearity {
    let curve = &branch.nonlinearity;
    Nonlinearity {
        x_label: labelled(&branch.input),
        y_label: format!("output of the nonlinearity of {}", branch.input),
        x: curve.x().to_vec(),
        y: curve.y().to_vec(),
        density: density(u, curve.x()),
        ..Nonlinearity::default()
    }
}

fn facts(signals: &Signals, result: &MultipleInputsIdentification) -> Vec<Fact> {
    let each = |of: fn(&InputBranch) -> usize| {
        let all: Vec<String> = result.branches.iter().map(|b| of(b).to_string()).collect();
        all.join(" + ")
    };
    let mut facts: Vec<Fact> = (Verdict::worst(&result.verdicts).iter())
        .flat_map(|v| fit_facts(v, signals.output))
        .collect();
    facts.extend([
        fact(
            "Inputs",
            result.branches.len().to_string(),
            "each with blocks of its own",
        ),
        fact(
            "Poles",
            each(|b| b.order),
            "of the inputs' linear parts, by Schwarz's criterion",
        ),
        fact("Delays", each(|b| b.delay), "of the inputs' linear parts, samples"),
        fact(
            "Pieces",
            each(|b| b.breakpoints.len().saturating_sub(1)),
            "cubic ones, of the inputs' nonlinearities",
        ),
    ]);
    let kinks: Vec<usize> = result.branches.iter().map(|b| b.kinks.len()).collect();
    facts.extend(kinks_fact(&kinks));
    facts.push(samples_fact(result.predicted.len(), result.fitted, ""));
    facts
}

fn choices(result: &MultipleInputsIdentification) -> Vec<Choice> {
    let of = |branch: &InputBranch| {
        choice(
            &format!("Nonlinearity of '{}'", branch.input),
            pieces_words(&branch.breakpoints, &branch.kinks),
            PIECES_WHY,
        )
    };
    result.branches.iter().map(of).collect()
}
