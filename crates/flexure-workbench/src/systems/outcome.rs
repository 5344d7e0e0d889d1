//! An identification and a verdict as JSON, as a model file and in words.

use flexure::identify::{FormFit, Psi, Verdict, Warning};
use flexure::linear::{Complex, TransferFunction};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::systems::estimate::{self, Estimate, Method, Own, Plain, Refined};
use crate::systems::form::form_name;
use crate::systems::several_inputs;
use crate::text::{self, number};

/// Share of the impulse response that is left when a system counts as settled.
pub const SETTLED: f64 = 0.01;

/// The signals that a model is identified from.
#[derive(Clone, Copy)]
pub struct Signals<'a> {
    /// The input's column; a list, separated by commas, for a model of several inputs.
    pub input: &'a str,
    /// The output's column.
    pub output: &'a str,
    /// s; `None` if unknown.
    pub sample_time: Option<f64>,
    /// Whether `input` is a list.
    pub several: bool,
}

impl<'a> Signals<'a> {
    /// The inputs' columns.
    pub fn inputs(&self) -> Vec<&'a str> {
        match self.several {
            true => several_inputs::columns(self.input),
            false => vec![self.input],
        }
    }
}

/// What the identification of a Hammerstein model was asked for, beside its result.
pub struct Context<'a> {
    /// Columns and sample time.
    pub signals: Signals<'a>,
    /// The method with the choices that were given.
    pub method: Method,
}

/// The object that `identify --json` prints.
pub fn identification_json(result: &Estimate, context: &Context) -> Value {
    let curve = &result.nonlinearity;
    let mut object = json!({
        "structure": "hammerstein",
        "method": context.method.name(),
        "order": result.order.order,
        "delay": result.delay,
        "nonlinearity": { "x": curve.x(), "y": curve.y(), "lower": result.band_edge(-1.0), "upper": result.band_edge(1.0) },
        "linear": linear_json(&result.linear),
        "output_offset": result.output_offset,
        "order_scores": {
            "order": result.order.scores.iter().map(|s| s.order).collect::<Vec<_>>(),
            "bic": result.order.scores.iter().map(|s| s.bic).collect::<Vec<_>>(),
        },
        "hankel_singular_values": result.order.hankel_singular_values,
    });
    extend(
        &mut object,
        judged_json(&context.signals, result.fitted, &result.verdict, &result.warnings),
    );
    let own = match &result.own {
        Own::Plain(own) => plain_json(own),
        Own::Refined(own) => {
            let errors = own.refined.then_some(&own.linear_errors);
            object["linear"]["b_errors"] = json!(errors.map(|e| &e.b));
            object["linear"]["a_errors"] = json!(errors.map(|e| &e.a));
            refined_json(own)
        }
    };
    extend(&mut object, own);
    object
}

/// What every structure's object has.
pub fn judged_json(signals: &Signals, fitted: usize, verdict: &Verdict, warnings: &[Warning]) -> Value {
    json!({
        "input": signals.input,
        "output": signals.output,
        "sample_time": signals.sample_time,
        "fit_percent": verdict.measures.fit_percent,
        "rms": verdict.measures.rms,
        "r_squared": verdict.measures.r_squared,
        "samples_fitted": fitted,
        "samples_fresh": verdict.measures.samples,
        "holds": verdict.holds(),
        "verdict": verdict.words(),
        "residual_tests": tests_json(verdict),
        "warnings": warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// Adds what every structure's object has, for a model of several inputs: by the verdict that says most against it.
pub fn extend_judged(object: &mut Value, signals: &Signals, fitted: usize, verdicts: &[Verdict], warnings: &[Warning]) {
    if let Some(verdict) = Verdict::worst(verdicts) {
        extend(object, judged_json(signals, fitted, verdict, warnings));
    }
}

/// A linear part.
pub fn linear_json(linear: &TransferFunction) -> Value {
    json!({
        "b": linear.b(),
        "a": linear.a(),
        "poles": parts(linear.poles()),
        "zeros": parts(linear.zeros()),
        "static_gain": linear.static_gain(),
    })
}

/// Real and imaginary parts.
pub fn parts(list: Option<Vec<Complex<f64>>>) -> Vec<[f64; 2]> {
    list.unwrap_or_default().iter().map(|z| [z.re, z.im]).collect()
}

/// Adds the fields of another object.
pub fn extend(object: &mut Value, other: Value) {
    if let (Value::Object(fields), Value::Object(other)) = (object, other) {
        fields.extend(other);
    }
}

/// What only the plain method has.
fn plain_json(own: &Plain) -> Value {
    let banded = own.estimator.has_bandwidth();
    json!({
        "regression_lag": own.regression_lag,
        "estimator": own.estimator.name(),
        "parameter": own.estimator.parameter(),
        "value": own.parameter,
        "kernel": banded.then(|| own.kernel.name()),
        "bandwidth": banded.then_some(own.parameter),
        "correlated_with": match own.psi { Psi::Input => "input", Psi::Nonlinearity => "estimated nonlinearity", Psi::DeconvolvedNonlinearity => "estimated nonlinearity, deconvolved" },
        "scores": own.scores.as_ref().map(text::scores_json),
        "bandwidth_scores": own.scores.as_ref().filter(|_| banded).map(|s| json!({
            "bandwidth": s.parameter,
            "error": s.score,
        })),
    })
}

/// What only the refined method has.
fn refined_json(own: &Refined) -> Value {
    let points = &own.memory_removed;
    json!({
        "refined": own.refined,
        "breakpoints": own.breakpoints.iter().map(|b| json!({ "at": b.at, "kind": estimate::kind_name(b.kind) })).collect::<Vec<_>>(),
        "memory_removed": own.refined.then(|| json!({
            "x": points.x,
            "value": points.value,
            "samples": points.samples,
            "deviation": points.deviation,
        })),
        "noise": own.refined.then(|| json!({ "model": own.noise_model, "deviation": own.noise })),
        "form": own.form.as_ref().map(form_json),
    })
}

fn form_json(fit: &FormFit) -> Value {
    let parameters: Vec<Value> = (fit.parameters.iter())
        .map(|p| json!({ "name": p.name, "value": p.value, "error": estimate::standard_error(p.error) }))
        .collect();
    json!({
        "name": form_name(fit.form),
        "parameters": parameters,
        "statistic": fit.statistic,
        "degrees_of_freedom": fit.degrees,
        "limit": fit.limit,
        "p_value": fit.p_value,
        "holds": fit.holds(),
    })
}

/// The residual tests of a verdict.
pub fn tests_json(verdict: &Verdict) -> Value {
    let tests = verdict.residuals.iter().flat_map(|r| &r.tests);
    tests
        .map(|t| {
            json!({
                "name": t.kind.name(),
                "statistic": t.statistic,
                "degrees_of_freedom": t.degrees,
                "limit": t.limit,
                "p_value": t.p_value,
                "passed": t.passed(),
                "refutes": t.kind.refutes(),
            })
        })
        .collect()
}

/// The file from which `predict` and `validate` work.
pub fn model_file(result: &Estimate, context: &Context) -> ModelFile {
    let mut details = details(identification_json(result, context));
    if let Some(Value::Object(linear)) = details.get_mut("linear") {
        linear.retain(|name, _| name.ends_with("_errors"));
    }
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: "hammerstein".to_owned(),
        method: context.method.name().to_owned(),
        input: context.signals.input.to_owned(),
        output: context.signals.output.to_owned(),
        sample_time: context.signals.sample_time,
        delay: result.delay,
        order: result.order.order,
        settling: Some(result.model.settling(SETTLED)),
        noise_model: match &result.own {
            Own::Refined(own) if own.refined => Some(own.noise_model.clone()),
            _ => None,
        },
        estimated: result.verdict.estimated,
        block: result.model.clone(),
        identification: details,
    }
}

/// Of an identification's object, what a model file does not say already.
pub fn details(mut object: Value) -> Value {
    if let Value::Object(fields) = &mut object {
        for field in [
            "structure",
            "method",
            "input",
            "output",
            "sample_time",
            "order",
            "delay",
            "nonlinearity",
            "memory_removed",
        ] {
            fields.remove(field);
        }
    }
    object
}

/// A short account for a terminal.
pub fn summary(result: &Estimate, context: &Context) -> String {
    let Estimate {
        verdict,
        linear,
        nonlinearity,
        ..
    } = result;
    let x = nonlinearity.x();
    let range = format!("[{}, {}]", number(x[0]), number(x[x.len() - 1]));
    let (estimated, errors) = match &result.own {
        Own::Plain(own) => {
            let kernel = text::kernel_words(own.estimator, own.kernel, "", ", ");
            let value = text::list(&[own.parameter]);
            let estimator = own.estimator.title();
            let parameter = own.estimator.parameter();
            (format!("{estimator} on {range}, {kernel}{parameter} {value}"), None)
        }
        Own::Refined(own) if own.refined => (
            format!("piecewise cubic on {range}, {}", own.breakpoint_words()),
            Some(&own.linear_errors),
        ),
        Own::Refined(_) => (format!("the plain estimate on {range}"), None),
    };
    let mut lines = vec![
        format!(
            "Hammerstein model from '{}' to '{}', method {}",
            context.signals.input,
            context.signals.output,
            context.method.name()
        ),
        fit_line(verdict),
        format!("  nonlinearity        {estimated}"),
        format!(
            "  linear part         order {}, delay {}, static gain {}",
            result.order.order,
            result.delay,
            number(linear.static_gain())
        ),
        format!("    b = {}", coefficients(linear.b(), errors.map(|e| &*e.b))),
        format!("    a = {}", coefficients(linear.a(), errors.map(|e| &*e.a))),
    ];
    if let Own::Refined(own) = &result.own {
        if own.refined {
            let words = own.noise_words();
            lines.push(format!(
                "  noise               deviation {}, {words}",
                number(own.noise)
            ));
        }
        if let Some(fit) = &own.form {
            lines.push(format!(
                "  form                {}: {}",
                form_name(fit.form),
                estimate::form_parameters(fit)
            ));
            lines.push(format!("    {}", estimate::form_verdict(fit)));
        }
    }
    lines.push(format!("  {}", verdict.words()));
    lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}

/// How well a model does on fresh data.
pub fn fit_line(verdict: &Verdict) -> String {
    format!(
        "  fit on fresh data   {:.2} %  (RMS error {}, {} samples)",
        verdict.measures.fit_percent,
        number(verdict.measures.rms),
        verdict.measures.samples
    )
}

/// Coefficients in brackets, each with its standard error where there is one.
pub fn coefficients(c: &[f64], errors: Option<&[f64]>) -> String {
    let list = c.iter().enumerate().map(|(i, &v)| {
        let error = errors.and_then(|e| estimate::standard_error(*e.get(i)?));
        match error {
            Some(error) => format!("{} ± {}", number(v), number(error)),
            None => number(v),
        }
    });
    format!("[{}]", list.collect::<Vec<_>>().join(", "))
}
