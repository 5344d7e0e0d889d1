//! The page of a nonlinearity of several inputs.

use anyhow::Result;
use flexure::identify::{JointInputsIdentification, Verdict};
use flexure_io::RecordFile;
use flexure_report::data::{
    Choice, Fact, LinearPart, Nonlinearity, Page, Scatter, ScoreCurve, Surface, TitledCurve, TitledSurface,
};

use super::{
    Decoration, Judged, Parts, assembled, density, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::systems::joint_inputs::{linear_block, pieces_words};
use crate::systems::outcome::Signals;
use crate::text::{self, number};

/// Points of the picture along either side, and of a curve.
const GRID: usize = 81;
const POINTS: usize = 201;

/// Fills in the page.
pub fn page(
    file: &RecordFile,
    signals: &Signals,
    result: &JointInputsIdentification,
    decoration: Decoration,
) -> Result<Page> {
    let names = signals.inputs();
    let mut inputs = Vec::new();
    for name in &names {
        inputs.push(&file.record.finite(name)?[..result.fitted]);
    }
    let middle: Vec<f64> = inputs.iter().map(|u| median(u)).collect();
    let block = linear_block(result);
    let parts = Parts {
        facts: facts(signals, result),
        surface: Some(surface(result, &names, &inputs, &middle)),
        curves: (0..names.len())
            .map(|i| section(result, &names, &inputs, &middle, i))
            .collect(),
        linear: vec![LinearPart {
            words: format!("{}.", text::capitalised(&block.words())),
            ..linear_part(block.title, &block.system, None, signals.sample_time)
        }],
        choices: vec![pieces(result)],
        ..Parts::default()
    };
    let verdict = Verdict::worst(&result.verdicts).ok_or_else(|| anyhow::anyhow!("the model has no input"))?;
    let judged = Judged {
        signals: *signals,
        model: format!("One nonlinearity of {} inputs, then linear dynamics,", names.len()),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn even(low: f64, high: f64, points: usize) -> Vec<f64> {
    let place = |i: usize| low + (high - low) * i as f64 / (points - 1) as f64;
    (0..points).map(place).collect()
}

/// The other inputs' places, in words.
fn others(names: &[&str], middle: &[f64], shown: &[usize]) -> String {
    let kept = (0..names.len()).filter(|i| !shown.contains(i));
    let words: Vec<String> = kept.map(|i| format!("{} = {}", names[i], number(middle[i]))).collect();
    words.join(", ")
}

/// The surface over the first two inputs.
fn surface(result: &JointInputsIdentification, names: &[&str], inputs: &[&[f64]], middle: &[f64]) -> TitledSurface {
    let axes = result.nonlinearity.axes();
    let (x, y) = (
        even(axes[0].low, axes[0].high, GRID),
        even(axes[1].low, axes[1].high, GRID),
    );
    let mut at = middle.to_vec();
    let mut z = Vec::with_capacity(x.len() * y.len());
    for b in &y {
        for a in &x {
            (at[0], at[1]) = (*a, *b);
            z.push(result.nonlinearity.value(&at));
        }
    }
    let kept = match names.len() {
        2 => String::new(),
        _ => format!(
            " The other inputs stay at their medians: {}.",
            others(names, middle, &[0, 1])
        ),
    };
    TitledSurface {
        title: "Joint nonlinearity".to_owned(),
        words: format!(
            "The estimate as colours with contours; the dots are the data: where there are few, trust it less. Beyond their range the \
             model keeps the value at the edge.{kept}"
        ),
        surface: Surface {
            x_label: labelled(names[0]),
            y_label: labelled(names[1]),
            z_label: "output of the nonlinearity".to_owned(),
            x,
            y,
            z,
            points: Scatter {
                x: inputs[0].to_vec(),
                y: inputs[1].to_vec(),
            },
        },
    }
}

/// The curve along one input while the others stay at their medians.
fn section(
    result: &JointInputsIdentification,
    names: &[&str],
    inputs: &[&[f64]],
    middle: &[f64],
    along: usize,
) -> TitledCurve {
    let axis = result.nonlinearity.axes()[along];
    let x = even(axis.low, axis.high, POINTS);
    let mut at = middle.to_vec();
    let value = |x: &f64| {
        at[along] = *x;
        result.nonlinearity.value(&at)
    };
    TitledCurve {
        title: format!("Along {} at {}", names[along], others(names, middle, &[along])),
        curve: Nonlinearity {
            x_label: labelled(names[along]),
            y_label: "output of the nonlinearity".to_owned(),
            y: x.iter().map(value).collect(),
            density: density(inputs[along], &x),
            x,
            ..Nonlinearity::default()
        },
    }
}

fn facts(signals: &Signals, result: &JointInputsIdentification) -> Vec<Fact> {
    let mut facts: Vec<Fact> = (Verdict::worst(&result.verdicts).iter())
        .flat_map(|v| fit_facts(v, signals.output))
        .collect();
    facts.extend([
        fact(
            "Poles",
            result.order.to_string(),
            "of the linear part, by Schwarz's criterion",
        ),
        fact("Delay", samples(result.delay), "of the linear part"),
        fact(
            "Parameters",
            number(result.effective_parameters),
            "that the nonlinearity is worth under its penalty",
        ),
        samples_fact(result.predicted.len(), result.fitted, ""),
    ]);
    facts
}

fn pieces(result: &JointInputsIdentification) -> Choice {
    let mut tried = result.tried.clone();
    tried.sort_by_key(|t| t.pieces);
    tried.dedup_by_key(|t| t.pieces);
    let chosen = result.nonlinearity.axes()[0].pieces;
    Choice {
        name: "Nonlinearity".to_owned(),
        value: pieces_words(result),
        why: "smallest generalised cross-validation score; the penalty on its bending, one for every input, maximises the \
              marginal likelihood"
            .to_owned(),
        curve: Some(ScoreCurve {
            x_label: "pieces along every input".to_owned(),
            y_label: "relative error, by generalised cross-validation".to_owned(),
            log_x: true,
            x: tried.iter().map(|t| t.pieces as f64).collect(),
            y: tried.iter().map(|t| t.score).collect(),
            chosen: chosen as f64,
        }),
    }
}
