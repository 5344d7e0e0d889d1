//! An identified system and a verdict as JSON.

use flexure::identify::result::{BlockKind, Detail, FeedbackBlock, LinearBlock, NamedBlock, Path, StaticBlock};
use flexure::identify::{NarxModel, Verdict, VolterraModel};
use flexure::linear::Complex;
use serde_json::{Value, json};

use super::comparison;
use super::task::Identified;

impl Identified {
    /// The object that `flexure identify --json` prints.
    pub fn json(&self) -> Value {
        let result = &self.result;
        let mut object = findings(self, |_| true);
        object["structure"] = json!(result.structure.key);
        object["method"] = json!(result.method);
        object["input"] = json!(result.inputs.join(","));
        object["inputs"] = json!(result.inputs);
        object["output"] = json!(result.output);
        object["sample_time"] = json!(self.sample_time);
        object["order"] = json!(result.order);
        object["delay"] = json!(result.delay);
        if result.is_sum {
            object["branches"] = result.paths.iter().map(branch).collect();
        } else {
            let blocks = result.blocks().flat_map(block);
            blocks.for_each(|(role, value)| object[role] = value);
        }
        object
    }
}

/// The results in addition to the model itself: the verdict, what was tried, and the details that `kept` lets through.
pub fn findings(identified: &Identified, kept: fn(&Detail) -> bool) -> Value {
    let result = &identified.result;
    let verdict = &result.verdict;
    let mut object = json!({
        "output_offset": result.output_offset,
        "tried": result.tried,
        "fit_percent": verdict.measures.fit_percent,
        "rms": verdict.measures.rms,
        "r_squared": verdict.measures.r_squared,
        "samples_fitted": identified.in_parts.map_or(result.fitted, |fitted| fitted.samples),
        "samples_fresh": verdict.measures.samples,
        "holds": verdict.holds(),
        "misfit": verdict.misfit(),
        "verdict": verdict.text(),
        "residual_tests": tests(verdict),
        "warnings": result.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    });
    for detail in result.details.iter().filter(|d| !d.key.is_empty() && kept(d)) {
        object[detail.key] = json!(detail.value);
    }
    if let Some(comparison) = &result.comparison {
        object["comparison"] = comparison::json(comparison);
    }
    if let Some(periodic) = &identified.periodic {
        object["best_linear_approximation"] = periodic.json();
    }
    object
}

/// One of the paths of a sum.
fn branch(path: &Path) -> Value {
    let mut object = json!({
        "input": path.inputs.join(","),
        "order": path.order(),
        "delay": path.delay(),
    });
    let blocks = path.blocks.iter().flat_map(block);
    blocks.for_each(|(role, value)| object[role] = value);
    object
}

/// A block under its role; a model without blocks by its own names.
fn block(block: &NamedBlock) -> Vec<(&str, Value)> {
    match &block.kind {
        BlockKind::Static(own) => vec![(&*block.role, curve(own))],
        BlockKind::Linear(own) => vec![(&*block.role, linear(own))],
        BlockKind::Surface(own) => vec![(&*block.role, json!(own))],
        BlockKind::Feedback(own) => feedback(block, own),
        BlockKind::Narx(model) => narx(model),
        BlockKind::Volterra(model) => volterra(model),
    }
}

fn curve(block: &StaticBlock) -> Value {
    let mut object = json!({ "x": block.curve.x(), "y": block.curve.y() });
    if !block.band_label.is_empty() {
        object["lower"] = json!(block.band_edge(-1.0));
        object["upper"] = json!(block.band_edge(1.0));
    }
    if !block.breakpoints.is_empty() {
        object["breakpoints"] = json!(block.breakpoints);
        object["kinks"] = json!(block.kinks);
        if !block.kink_errors.is_empty() {
            object["kink_errors"] = json!(block.kink_errors);
        }
    }
    object
}

fn linear(block: &LinearBlock) -> Value {
    let system = &block.system;
    let mut object = json!({
        "order": block.order(),
        "delay": block.delay(),
        "b": system.b(),
        "a": system.a(),
        "poles": parts(system.poles()),
        "zeros": parts(system.zeros()),
        "static_gain": system.static_gain(),
    });
    if let Some(errors) = &block.errors {
        object["b_errors"] = json!(errors.b);
        object["a_errors"] = json!(errors.a);
    }
    object
}

/// The nonlinearity of a loop, the ways through its linear part, and the state space.
fn feedback<'a>(block: &'a NamedBlock, own: &FeedbackBlock) -> Vec<(&'a str, Value)> {
    let parts = own.linear_parts();
    let mut all = vec![(&*block.role, curve(&own.nonlinearity))];
    all.extend(parts.iter().map(|part| (part.role, linear(&part.block))));
    let model = &own.model;
    let state_space = json!({
        "state": model.state,
        "input_to_state": model.input_to_state,
        "nonlinearity_to_state": model.nonlinearity_to_state,
        "state_to_output": model.state_to_output,
        "state_to_nonlinearity": model.state_to_nonlinearity,
        "input_to_output": model.input_to_output,
        "nonlinearity_to_output": model.nonlinearity_to_output,
        "input_to_nonlinearity": model.input_to_nonlinearity,
        "levels": model.levels,
    });
    all.push(("state_space", state_space));
    all
}

fn narx(model: &NarxModel) -> Vec<(&'static str, Value)> {
    vec![
        ("past_outputs", json!(model.outputs)),
        ("past_inputs", json!(model.inputs)),
        ("constant", json!(model.constant)),
        ("terms", json!(model.terms)),
        ("input_scale", json!(model.scales[0])),
        ("output_scale", json!(model.scales[1])),
    ]
}

fn volterra(model: &VolterraModel) -> Vec<(&'static str, Value)> {
    let rows = model.second.chunks_exact(model.second_memory.max(1));
    vec![
        ("input_level", json!(model.input_level)),
        ("constant", json!(model.constant)),
        ("first", json!(model.first)),
        ("second", rows.map(|row| json!(row)).collect()),
    ]
}

/// Real and imaginary parts.
pub fn parts(list: Option<Vec<Complex<f64>>>) -> Vec<[f64; 2]> {
    list.unwrap_or_default().iter().map(|z| [z.re, z.im]).collect()
}

/// The residual tests of a verdict.
pub fn tests(verdict: &Verdict) -> Value {
    let tests = verdict.residuals.iter().flat_map(|r| &r.tests);
    tests
        .map(|t| {
            json!({
                "name": t.kind.name(),
                "statistic": t.statistic,
                "degrees_of_freedom": t.degrees,
                "limit": t.limit,
                "p_value": t.p_value,
                "level": t.level,
                "effect": t.effect,
                "passed": t.passed(),
                "refutes": t.kind.refutes(),
            })
        })
        .collect()
}
