//! Models that are no chain of blocks: NARX and Volterra references, as JSON and in words.

use flexure::identify::{Narx, NarxIdentification, Verdict, Volterra, VolterraIdentification};
use flexure::{Block, Record, Result};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::structure::Structure;
use crate::text::number;

/// How to identify a reference.
pub enum ReferenceMethod {
    /// Past outputs and inputs.
    Narx(Narx),
    /// Past inputs.
    Volterra(Volterra),
}

impl ReferenceMethod {
    /// Identifies a model from `input` to `output`.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Reference> {
        match self {
            ReferenceMethod::Narx(method) => method.identify(record, input, output).map(Reference::Narx),
            ReferenceMethod::Volterra(method) => method.identify(record, input, output).map(Reference::Volterra),
        }
    }
}

/// An identified reference.
pub enum Reference {
    Narx(NarxIdentification),
    Volterra(VolterraIdentification),
}

impl Reference {
    /// How well it does on fresh data.
    pub fn verdict(&self) -> &Verdict {
        match self {
            Reference::Narx(result) => &result.verdict,
            Reference::Volterra(result) => &result.verdict,
        }
    }

    /// The free-run output over the record.
    pub fn predicted(&self) -> &[f64] {
        match self {
            Reference::Narx(result) => &result.predicted,
            Reference::Volterra(result) => &result.predicted,
        }
    }

    /// The object that `identify --json` prints.
    pub fn json(&self, signals: &Signals) -> Value {
        let (mut object, fitted, warnings) = match self {
            Reference::Narx(result) => (narx_json(result), result.fitted, &result.warnings),
            Reference::Volterra(result) => (volterra_json(result), result.fitted, &result.warnings),
        };
        let judged = outcome::judged_json(signals, fitted, self.verdict(), warnings);
        outcome::extend(&mut object, judged);
        object
    }

    /// The file from which `predict` and `validate` work.
    pub fn model_file(&self, signals: &Signals) -> ModelFile {
        let (structure, block, delay, order) = match self {
            Reference::Narx(result) => {
                let model = &result.model;
                (Structure::Narx, Block::Narx(model.clone()), model.delay, model.outputs)
            }
            Reference::Volterra(result) => {
                let model = &result.model;
                (Structure::Volterra, Block::Volterra(model.clone()), model.delay, 0)
            }
        };
        let object = self.json(signals);
        let method = object["method"].as_str().unwrap_or_default().to_owned();
        let mut details = outcome::details(object);
        if let Value::Object(fields) = &mut details {
            // What the block itself says already.
            for field in [
                "terms",
                "constant",
                "first",
                "second",
                "input_level",
                "input_scale",
                "output_scale",
            ] {
                fields.remove(field);
            }
        }
        ModelFile {
            flexure: ModelFile::CURRENT.to_owned(),
            structure: structure.name().to_owned(),
            method,
            input: signals.input.to_owned(),
            output: signals.output.to_owned(),
            sample_time: signals.sample_time,
            delay,
            order,
            settling: Some(block.settling(SETTLED)),
            noise_model: None,
            estimated: self.verdict().estimated,
            block,
            identification: details,
        }
    }

    /// A short account for a terminal.
    pub fn summary(&self, signals: &Signals) -> String {
        let (title, own, warnings) = match self {
            Reference::Narx(result) => ("Polynomial NARX", narx_lines(result), &result.warnings),
            Reference::Volterra(result) => ("Second-order Volterra", volterra_lines(result), &result.warnings),
        };
        let mut lines = vec![
            format!("{title} model from '{}' to '{}'", signals.input, signals.output),
            outcome::fit_line(self.verdict()),
        ];
        lines.extend(own);
        lines.push(format!("  {}", self.verdict().words()));
        lines.push("  A reference without blocks: what a model with blocks should come near to.".to_owned());
        lines.extend(warnings.iter().map(|w| format!("  warning: {w}")));
        lines.join("\n")
    }
}

fn narx_json(result: &NarxIdentification) -> Value {
    let model = &result.model;
    json!({
        "structure": Structure::Narx.name(),
        "method": "ridge",
        "past_outputs": model.outputs,
        "past_inputs": model.inputs,
        "delay": model.delay,
        "degree": result.degree,
        "bounded": result.bounded,
        "constant": model.constant,
        "terms": model.terms.iter().map(|t| json!({ "factors": t.factors, "coefficient": t.coefficient })).collect::<Vec<_>>(),
        "input_scale": model.scales[0],
        "output_scale": model.scales[1],
        "tried": (result.tried.iter())
            .map(|t| json!({
                "past_outputs": t.outputs,
                "past_inputs": t.inputs,
                "degree": t.degree,
                "penalty": t.penalty,
                "relative_error": t.relative_error,
                "bounded": t.bounded,
            }))
            .collect::<Vec<_>>(),
    })
}

fn narx_lines(result: &NarxIdentification) -> Vec<String> {
    let model = &result.model;
    let free = match result.bounded {
        true => "stays within bounds by itself",
        false => "runs away on this record and is held at its bounds",
    };
    vec![
        format!(
            "  lags                {} past outputs, {} past inputs, delay {}",
            model.outputs, model.inputs, model.delay
        ),
        format!(
            "  polynomial          degree {}, {} terms",
            result.degree,
            model.terms.len()
        ),
        format!("  free run            {free}"),
        format!("  structures tried    {}", result.tried.len()),
    ]
}

fn volterra_json(result: &VolterraIdentification) -> Value {
    let model = &result.model;
    let prior = |i: usize| json!({ "size": result.priors[i].size, "decay": result.priors[i].decay });
    json!({
        "structure": Structure::Volterra.name(),
        "method": "marginal-likelihood",
        "delay": model.delay,
        "input_level": model.input_level,
        "constant": model.constant,
        "first": model.first,
        "second": model.second.chunks_exact(model.second_memory.max(1)).collect::<Vec<_>>(),
        "priors": [prior(0), prior(1)],
        "noise": result.noise,
    })
}

fn volterra_lines(result: &VolterraIdentification) -> Vec<String> {
    let model = &result.model;
    let [first, second] = result.priors.map(|p| number(p.decay));
    vec![
        format!("  delay               {}", model.delay),
        format!(
            "  first order         {} lags, decay {first} a sample",
            model.first.len()
        ),
        format!(
            "  second order        {} lags, decay {second} a sample",
            model.second_memory
        ),
        format!("  noise               deviation {}", number(result.noise)),
    ]
}
