//! Systems of several inputs: what was identified, as JSON and in words.

use std::ops::ControlFlow;

use flexure::Record;
use flexure::identify::{MultipleInputs, MultipleInputsIdentification, Verdict};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::cascade::{LinearBlock, linear_lines};
use crate::systems::nonlinear_ends::{pieces_words, tried_json};
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::structure::Structure;
use crate::text::number;

/// What the method does.
pub const METHOD: &str = "prediction-error";

/// The columns of a list, separated by commas.
pub fn columns(list: &str) -> Vec<&str> {
    list.split(',').map(str::trim).collect()
}

/// Identifies the system from the inputs of a list to `output`; `stage` is told what is being done, and may stop it.
pub fn identify(
    method: &MultipleInputs,
    record: &Record,
    signals: &Signals,
    stage: &dyn Fn(&str) -> ControlFlow<()>,
) -> flexure::Result<MultipleInputsIdentification> {
    method.identify_with(record, &columns(signals.input), signals.output, &mut |now| {
        stage(now.name())
    })
}

/// The object that `identify --json` prints.
pub fn json(result: &MultipleInputsIdentification, signals: &Signals) -> Value {
    let branches = result.branches.iter().map(|b| {
        json!({
            "input": b.input,
            "order": b.order,
            "delay": b.delay,
            "nonlinearity": {
                "x": b.nonlinearity.x(),
                "y": b.nonlinearity.y(),
                "breakpoints": b.breakpoints,
                "kinks": b.kinks,
            },
            "linear": outcome::linear_json(&b.linear),
        })
    });
    let mut object = json!({
        "structure": Structure::MultipleInputs.name(),
        "method": METHOD,
        "inputs": columns(signals.input),
        "branches": branches.collect::<Vec<_>>(),
        "output_offset": result.output_offset,
        "tried": result.tried.iter().map(tried_json).collect::<Vec<_>>(),
    });
    outcome::extend_judged(&mut object, signals, result.fitted, &result.verdicts, &result.warnings);
    object
}

/// The file from which `predict` and `validate` work.
pub fn model_file(result: &MultipleInputsIdentification, signals: &Signals) -> flexure::Result<ModelFile> {
    let mut details = outcome::details(json(result, signals));
    if let Value::Object(fields) = &mut details {
        // What the blocks themselves say already.
        fields.remove("branches");
        let breakpoints: Vec<_> = result.branches.iter().map(|b| &b.breakpoints).collect();
        fields.insert("breakpoints".to_owned(), json!(breakpoints));
        let kinks: Vec<_> = result.branches.iter().map(|b| &b.kinks).collect();
        fields.insert("kinks".to_owned(), json!(kinks));
    }
    let block = result.model.block()?;
    Ok(ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: Structure::MultipleInputs.name().to_owned(),
        method: METHOD.to_owned(),
        input: signals.input.to_owned(),
        output: signals.output.to_owned(),
        sample_time: signals.sample_time,
        delay: result.branches.iter().map(|b| b.delay).min().unwrap_or(0),
        order: result.branches.iter().map(|b| b.order).sum(),
        settling: Some(block.settling(SETTLED)),
        noise_model: None,
        estimated: result.verdicts.first().and_then(|v| v.estimated),
        block,
        identification: details,
    })
}

/// A short account for a terminal.
pub fn summary(result: &MultipleInputsIdentification, signals: &Signals) -> String {
    let inputs: Vec<String> = columns(signals.input).iter().map(|c| format!("'{c}'")).collect();
    let mut lines = vec![format!("Model from {} to '{}'", inputs.join(", "), signals.output)];
    lines.extend(Verdict::worst(&result.verdicts).map(outcome::fit_line));
    for branch in &result.branches {
        lines.push(format!("  from '{}'", branch.input));
        lines.push(format!(
            "  nonlinearity        {}",
            pieces_words(&branch.breakpoints, &branch.kinks)
        ));
        lines.extend(linear_lines(&LinearBlock {
            key: "linear",
            title: "Linear part",
            system: branch.linear.clone(),
        }));
    }
    lines.push(format!("  output offset       {}", number(result.output_offset)));
    lines.push(format!("  structures tried    {}", result.tried.len()));
    lines.extend(Verdict::worst(&result.verdicts).map(|v| format!("  {}", v.words())));
    lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}
