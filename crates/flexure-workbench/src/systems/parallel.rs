//! Sums of branches: what was identified, as JSON, as a model file and in words.

use std::ops::ControlFlow;

use flexure::identify::{Parallel, ParallelBranch, ParallelIdentification, TriedSum};
use flexure::{Record, Result};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::cascade::{LinearBlock, linear_lines};
use crate::systems::nonlinear_ends::pieces_words;
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::structure::Structure;
use crate::text::number;

/// What the method does.
const METHOD: &str = "prediction-error";
/// What is said of the branches.
pub const ONLY_THE_SUM: &str =
    "the record determines the branches' sum; parts of it can be moved from one branch to another";

/// Identifies the sum from the input to the output; `stage` is told what is being done, and may stop it.
pub fn identify(
    method: &Parallel,
    record: &Record,
    signals: &Signals,
    stage: &dyn Fn(&str) -> ControlFlow<()>,
) -> Result<ParallelIdentification> {
    method.identify_with(record, signals.input, signals.output, &mut |now| stage(now.name()))
}

/// The linear parts of a branch with what is said of them.
pub fn linear_blocks(branch: &ParallelBranch) -> (Option<LinearBlock>, LinearBlock) {
    let front = branch.front.as_ref().map(|system| LinearBlock {
        key: "front",
        title: "front",
        system: system.clone(),
    });
    let back = LinearBlock {
        key: if front.is_some() { "back" } else { "linear" },
        title: if front.is_some() { "back" } else { "linear part" },
        system: branch.back.clone(),
    };
    (front, back)
}

/// What the branches are, in words.
pub fn words(result: &ParallelIdentification) -> &'static str {
    match result.branches.iter().any(|b| b.front.is_some()) {
        true => "linear dynamics, a static nonlinearity, linear dynamics",
        false => "a static nonlinearity, then linear dynamics",
    }
}

/// "3 branches", "1 branch".
pub fn count_words(result: &ParallelIdentification) -> String {
    match result.branches.len() {
        1 => "1 branch".to_owned(),
        n => format!("{n} branches"),
    }
}

/// The object that `identify --json` prints.
pub fn json(result: &ParallelIdentification, signals: &Signals) -> Value {
    let branches = result.branches.iter().map(|b| {
        let (front, back) = linear_blocks(b);
        let mut object = json!({
            "nonlinearity": { "x": b.nonlinearity.x(), "y": b.nonlinearity.y(), "breakpoints": b.breakpoints },
        });
        for block in front.iter().chain([&back]) {
            object[block.key] = outcome::linear_json(&block.system);
            let own = json!({ "order": block.order(), "delay": block.delay() });
            outcome::extend(&mut object[block.key], own);
        }
        object
    });
    let mut object = json!({
        "structure": Structure::Parallel.name(),
        "method": METHOD,
        "order": result.order(),
        "delay": result.delay(),
        "branches": branches.collect::<Vec<_>>(),
        "output_offset": result.output_offset,
        "tried": result.tried.iter().map(tried_json).collect::<Vec<_>>(),
    });
    let judged = outcome::judged_json(signals, result.fitted, &result.verdict, &result.warnings);
    outcome::extend(&mut object, judged);
    object
}

fn tried_json(t: &TriedSum) -> Value {
    json!({
        "front_orders": t.front_orders,
        "back_orders": t.back_orders,
        "pieces": t.pieces,
        "samples": t.samples,
        "relative_error": t.relative_error,
        "bic": t.bic,
    })
}

/// The file from which `predict` and `validate` work.
pub fn model_file(result: &ParallelIdentification, signals: &Signals) -> ModelFile {
    let mut details = outcome::details(json(result, signals));
    if let Value::Object(fields) = &mut details {
        // What the blocks themselves say already.
        fields.remove("branches");
        let breakpoints: Vec<_> = result.branches.iter().map(|b| &b.breakpoints).collect();
        fields.insert("breakpoints".to_owned(), json!(breakpoints));
    }
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: Structure::Parallel.name().to_owned(),
        method: METHOD.to_owned(),
        input: signals.input.to_owned(),
        output: signals.output.to_owned(),
        sample_time: signals.sample_time,
        delay: result.delay(),
        order: result.order(),
        settling: Some(result.model.settling(SETTLED)),
        noise_model: None,
        estimated: result.verdict.estimated,
        block: result.model.clone(),
        identification: details,
    }
}

/// A short account for a terminal.
pub fn summary(result: &ParallelIdentification, signals: &Signals) -> String {
    let mut lines = vec![
        format!(
            "Sum of {} from '{}' to '{}': {}",
            count_words(result),
            signals.input,
            signals.output,
            words(result)
        ),
        outcome::fit_line(&result.verdict),
    ];
    for (i, branch) in result.branches.iter().enumerate() {
        let (front, back) = linear_blocks(branch);
        lines.push(format!("  branch {}", i + 1));
        lines.extend(front.iter().flat_map(linear_lines));
        lines.push(format!(
            "  nonlinearity        {}",
            pieces_words(&branch.breakpoints, &[])
        ));
        lines.extend(linear_lines(&back));
    }
    if result.output_offset != 0.0 {
        lines.push(format!("  output offset       {}", number(result.output_offset)));
    }
    lines.push(format!("  structures tried    {}", result.tried.len()));
    if result.branches.len() > 1 {
        lines.push(format!("  note: {ONLY_THE_SUM}"));
    }
    lines.push(format!("  {}", result.verdict.words()));
    lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}
