//! A nonlinearity of several inputs: what was identified, as JSON, as a model file and in words.

use flexure::identify::{JointInputsIdentification, TriedSurface, Verdict};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::cascade::{LinearBlock, linear_lines};
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::several_inputs::METHOD;
use crate::systems::structure::Structure;
use crate::text::number;

/// The linear part with what is said of it.
pub fn linear_block(result: &JointInputsIdentification) -> LinearBlock {
    LinearBlock {
        key: "linear",
        title: "Linear part",
        system: result.linear.clone(),
    }
}

/// "9 by 9 pieces".
pub fn pieces_words(result: &JointInputsIdentification) -> String {
    let each: Vec<String> = (result.nonlinearity.axes().iter())
        .map(|a| a.pieces.to_string())
        .collect();
    format!("{} pieces", each.join(" by "))
}

/// The object that `identify --json` prints.
pub fn json(result: &JointInputsIdentification, signals: &Signals) -> Value {
    let mut object = json!({
        "structure": Structure::JointInputs.name(),
        "method": METHOD,
        "inputs": signals.inputs(),
        "order": result.order,
        "delay": result.delay,
        "nonlinearity": result.nonlinearity,
        "effective_parameters": result.effective_parameters,
        "linear": outcome::linear_json(&result.linear),
        "output_offset": result.output_offset,
        "tried": result.tried.iter().map(tried_json).collect::<Vec<_>>(),
    });
    outcome::extend_judged(&mut object, signals, result.fitted, &result.verdicts, &result.warnings);
    object
}

fn tried_json(t: &TriedSurface) -> Value {
    json!({
        "pieces": t.pieces,
        "effective_parameters": t.effective_parameters,
        "relative_error": t.relative_error,
        "score": t.score,
    })
}

/// The file from which `predict` and `validate` work.
pub fn model_file(result: &JointInputsIdentification, signals: &Signals) -> ModelFile {
    let mut details = outcome::details(json(result, signals));
    if let Value::Object(fields) = &mut details {
        // What the blocks themselves say already.
        fields.remove("linear");
    }
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: Structure::JointInputs.name().to_owned(),
        method: METHOD.to_owned(),
        input: signals.input.to_owned(),
        output: signals.output.to_owned(),
        sample_time: signals.sample_time,
        delay: result.delay,
        order: result.order,
        settling: Some(result.model.settling(SETTLED)),
        noise_model: None,
        estimated: result.verdicts.first().and_then(|v| v.estimated),
        block: result.model.clone(),
        identification: details,
    }
}

/// A short account for a terminal.
pub fn summary(result: &JointInputsIdentification, signals: &Signals) -> String {
    let inputs: Vec<String> = signals.inputs().iter().map(|c| format!("'{c}'")).collect();
    let mut lines = vec![format!(
        "Joint Hammerstein model from {} to '{}'",
        inputs.join(", "),
        signals.output
    )];
    lines.extend(Verdict::worst(&result.verdicts).map(outcome::fit_line));
    lines.push(format!(
        "  nonlinearity        cubic spline surface of {}, worth {} parameters",
        pieces_words(result),
        number(result.effective_parameters)
    ));
    for (name, axis) in signals.inputs().iter().zip(result.nonlinearity.axes()) {
        lines.push(format!("    '{name}' on [{}, {}]", number(axis.low), number(axis.high)));
    }
    lines.extend(linear_lines(&linear_block(result)));
    lines.push(format!("  output offset       {}", number(result.output_offset)));
    lines.extend(Verdict::worst(&result.verdicts).map(|v| format!("  {}", v.words())));
    lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}
