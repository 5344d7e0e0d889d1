//! Hammerstein-Wiener models: what was identified, as JSON, as a model file and in words.

use flexure::identify::{HammersteinWienerIdentification, TriedBranches};
use flexure::nonlinearity::Curve;
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::cascade::{LinearBlock, linear_lines};
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::structure::Structure;
use crate::text::number;

/// What the method does.
const METHOD: &str = "prediction-error";

/// The linear part with what is said of it.
pub fn linear_block(result: &HammersteinWienerIdentification) -> LinearBlock {
    LinearBlock {
        key: "linear",
        title: "Linear part",
        system: result.linear.clone(),
    }
}

/// The object that `identify --json` prints.
pub fn json(result: &HammersteinWienerIdentification, signals: &Signals) -> Value {
    let curve = |c: &Curve, breakpoints: &[f64], kinks: &[f64]| json!({ "x": c.x(), "y": c.y(), "breakpoints": breakpoints, "kinks": kinks });
    let mut object = json!({
        "structure": Structure::HammersteinWiener.name(),
        "method": METHOD,
        "order": result.order,
        "delay": result.delay,
        "nonlinearity": curve(&result.input_nonlinearity, &result.input_breakpoints, &result.input_kinks),
        "linear": outcome::linear_json(&result.linear),
        "output_nonlinearity": curve(&result.output_nonlinearity, &result.output_breakpoints, &result.output_kinks),
        "tried": result.tried.iter().map(tried_json).collect::<Vec<_>>(),
    });
    let judged = outcome::judged_json(signals, result.fitted, &result.verdict, &result.warnings);
    outcome::extend(&mut object, judged);
    object
}

/// A structure that was tried.
pub fn tried_json(t: &TriedBranches) -> Value {
    json!({
        "orders": t.orders,
        "numerators": t.numerators,
        "delays": t.delays,
        "input_pieces": t.input_pieces,
        "output_pieces": t.output_pieces,
        "input_kinks": t.input_kinks,
        "output_kinks": t.output_kinks,
        "samples": t.samples,
        "relative_error": t.relative_error,
        "bic": t.bic,
    })
}

/// The file from which `predict` and `validate` work.
pub fn model_file(result: &HammersteinWienerIdentification, signals: &Signals) -> ModelFile {
    let mut details = outcome::details(json(result, signals));
    if let Value::Object(fields) = &mut details {
        // What the blocks themselves say already.
        fields.remove("linear");
        fields.remove("output_nonlinearity");
        fields.insert("input_breakpoints".to_owned(), json!(result.input_breakpoints));
        fields.insert("output_breakpoints".to_owned(), json!(result.output_breakpoints));
        fields.insert("input_kinks".to_owned(), json!(result.input_kinks));
        fields.insert("output_kinks".to_owned(), json!(result.output_kinks));
    }
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: Structure::HammersteinWiener.name().to_owned(),
        method: METHOD.to_owned(),
        input: signals.input.to_owned(),
        output: signals.output.to_owned(),
        sample_time: signals.sample_time,
        delay: result.delay,
        order: result.order,
        settling: Some(result.model.settling(SETTLED)),
        noise_model: None,
        estimated: result.verdict.estimated,
        block: result.model.clone(),
        identification: details,
    }
}

/// Why a nonlinearity has the pieces and kinks that it has.
pub const PIECES_WHY: &str = "smallest Schwarz criterion; breakpoints are dense where the curve bends, kinks where very strong evidence asks for them";

/// A nonlinearity in words.
pub fn pieces_words(breakpoints: &[f64], kinks: &[f64]) -> String {
    let end = |x: Option<&f64>| x.map_or_else(String::new, |x| number(*x));
    let pieces = breakpoints.len().saturating_sub(1);
    format!(
        "cubic spline of {pieces} piece{} on [{}, {}]{}",
        if pieces == 1 { "" } else { "s" },
        end(breakpoints.first()),
        end(breakpoints.last()),
        kinks_words(kinks)
    )
}

/// Where the kinks are, to follow what is said of a spline.
fn kinks_words(kinks: &[f64]) -> String {
    let places: Vec<String> = kinks.iter().map(|at| number(*at)).collect();
    match places.as_slice() {
        [] => String::new(),
        [one] => format!(", kink at {one}"),
        [first @ .., last] => format!(", kinks at {} and {last}", first.join(", ")),
    }
}

/// A short account for a terminal.
pub fn summary(result: &HammersteinWienerIdentification, signals: &Signals) -> String {
    let mut lines = vec![
        format!(
            "Hammerstein-Wiener model from '{}' to '{}'",
            signals.input, signals.output
        ),
        outcome::fit_line(&result.verdict),
        format!(
            "  nonlinearity        {}",
            pieces_words(&result.input_breakpoints, &result.input_kinks)
        ),
    ];
    lines.extend(linear_lines(&linear_block(result)));
    lines.push(format!(
        "  at the output       {}",
        pieces_words(&result.output_breakpoints, &result.output_kinks)
    ));
    lines.push(format!("  structures tried    {}", result.tried.len()));
    lines.push(format!("  {}", result.verdict.words()));
    lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}
