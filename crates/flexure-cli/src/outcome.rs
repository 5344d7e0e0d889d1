//! An identification and a verdict as JSON, as a model file and in words.

use anyhow::{Result, bail};
use flexure::Block;
use flexure::identify::{FormFit, Psi, Verdict};
use flexure::nonlinearity::Curve;
use flexure_io::{ModelFile, RecordFile};
use serde_json::{Value, json};

use crate::estimate::{self, Estimate, Method, Own, Plain, Refined};
use crate::method::form_name;
use crate::tuning;

/// Share of the impulse response that is left when a system counts as settled.
pub const SETTLED: f64 = 0.01;

/// What the identification was asked for, beside its result.
pub struct Context<'a> {
    /// The input's column.
    pub input: &'a str,
    /// The output's column.
    pub output: &'a str,
    /// s; `None` if unknown.
    pub sample_time: Option<f64>,
    /// The method with the choices that were given.
    pub method: Method,
}

/// The object that `identify --json` prints.
pub fn identification_json(result: &Estimate, context: &Context) -> Value {
    let curve = &result.nonlinearity;
    let linear = &result.linear;
    let complex = |list: Option<Vec<_>>| -> Vec<[f64; 2]> {
        list.unwrap_or_default()
            .iter()
            .map(|z: &flexure::linear::Complex<f64>| [z.re, z.im])
            .collect()
    };
    let mut object = json!({
        "structure": "hammerstein",
        "method": context.method.name(),
        "input": context.input,
        "output": context.output,
        "sample_time": context.sample_time,
        "order": result.order.order,
        "delay": result.delay,
        "fit_percent": result.verdict.measures.fit_percent,
        "rms": result.verdict.measures.rms,
        "r_squared": result.verdict.measures.r_squared,
        "samples_fitted": result.fitted,
        "samples_fresh": result.verdict.measures.samples,
        "holds": result.verdict.holds(),
        "verdict": result.verdict.words(),
        "residual_tests": tests_json(&result.verdict),
        "nonlinearity": { "x": curve.x(), "y": curve.y(), "lower": result.band_edge(-1.0), "upper": result.band_edge(1.0) },
        "linear": {
            "b": linear.b(),
            "a": linear.a(),
            "poles": complex(linear.poles()),
            "zeros": complex(linear.zeros()),
            "static_gain": linear.static_gain(),
        },
        "output_offset": result.output_offset,
        "order_scores": {
            "order": result.order.scores.iter().map(|s| s.order).collect::<Vec<_>>(),
            "bic": result.order.scores.iter().map(|s| s.bic).collect::<Vec<_>>(),
        },
        "hankel_singular_values": result.order.hankel_singular_values,
        "warnings": result.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    });
    let own = match &result.own {
        Own::Plain(own) => plain_json(own),
        Own::Refined(own) => {
            let errors = own.refined.then_some(&own.linear_errors);
            object["linear"]["b_errors"] = json!(errors.map(|e| &e.b));
            object["linear"]["a_errors"] = json!(errors.map(|e| &e.a));
            refined_json(own)
        }
    };
    if let (Value::Object(fields), Value::Object(own)) = (&mut object, own) {
        fields.extend(own);
    }
    object
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
        "scores": own.scores.as_ref().map(tuning::scores_json),
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
    let mut details = identification_json(result, context);
    if let Value::Object(fields) = &mut details {
        // What the model itself says already.
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
        if let Some(Value::Object(linear)) = fields.get_mut("linear") {
            linear.retain(|name, _| name.ends_with("_errors"));
        }
    }
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: "hammerstein".to_owned(),
        method: context.method.name().to_owned(),
        input: context.input.to_owned(),
        output: context.output.to_owned(),
        sample_time: context.sample_time,
        delay: result.delay,
        order: result.order.order,
        settling: Some(result.model.settling(SETTLED)),
        block: result.model.clone(),
        identification: details,
    }
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
            let kernel = tuning::kernel_words(own.estimator, own.kernel, "", ", ");
            let value = tuning::list(&[own.parameter]);
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
            context.input,
            context.output,
            context.method.name()
        ),
        format!(
            "  fit on fresh data   {:.2} %  (RMS error {}, {} samples)",
            verdict.measures.fit_percent,
            number(verdict.measures.rms),
            verdict.measures.samples
        ),
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

/// Coefficients in brackets, each with its standard error where there is one.
fn coefficients(c: &[f64], errors: Option<&[f64]>) -> String {
    let list = c.iter().enumerate().map(|(i, &v)| {
        let error = errors.and_then(|e| estimate::standard_error(*e.get(i)?));
        match error {
            Some(error) => format!("{} ± {}", number(v), number(error)),
            None => number(v),
        }
    });
    format!("[{}]", list.collect::<Vec<_>>().join(", "))
}

/// The free-run output of a model under a column of a record.
///
/// # Errors
/// Those of [`RecordFile::finite`]; names the first sample for which the model has no finite output.
pub fn predict(block: &Block, file: &RecordFile, input: &str) -> Result<Vec<f64>> {
    let u = file.finite(input)?;
    let y = block.simulate(u);
    let Some(first) = y.iter().position(|v| !v.is_finite()) else {
        return Ok(y);
    };
    // A linear part starts from its input's mean, so that one unknown value spoils the output from the start.
    let unknown = entered(block).and_then(|curve| {
        let sample = u.iter().position(|&u| curve.value(u).is_nan())?;
        Some((curve.x(), sample))
    });
    let (sample, problem) = match unknown {
        Some((x, sample)) => (
            sample,
            format!(
                "column '{input}' is {} at sample {sample}, but the model's nonlinearity is known only from {} to {}; cut such \
                 samples off, or identify the model from a record with a wider range",
                u[sample],
                x[0],
                x[x.len() - 1]
            ),
        ),
        None => (
            first,
            format!(
                "the model's output is {} at sample {first}; check that column '{input}' is in the unit in which the model was identified",
                y[first]
            ),
        ),
    };
    let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
    bail!("{}{line}: {problem}", file.path.display());
}

/// The nonlinearity that the input enters, if it enters one.
fn entered(block: &Block) -> Option<&Curve> {
    match block {
        Block::Static(curve) => Some(curve),
        Block::Series(blocks) => blocks.first().and_then(entered),
        Block::Linear(_) | Block::Parallel(_) => None,
    }
}

/// What of an input lies outside the abscissas of the nonlinearity that it enters.
pub struct Outside {
    /// How many samples.
    pub samples: usize,
    /// Whether the nonlinearity has the value of the nearest end at all of them.
    held: bool,
}

impl Outside {
    /// Looks through `input`.
    pub fn new(block: &Block, input: &[f64]) -> Self {
        let mut found = Outside { samples: 0, held: true };
        let Some(curve) = entered(block) else { return found };
        let (x, last) = (curve.x(), curve.x().len() - 1);
        for &u in input.iter().filter(|&&u| !curve.covers(u)) {
            let end = if u < x[0] { 0 } else { last };
            found.samples += 1;
            found.held &= curve.value(u) == curve.y()[end];
        }
        found
    }

    /// What the user should know about it.
    pub fn warning(&self) -> Option<String> {
        let there = if self.held {
            "held at its end value"
        } else {
            "continued straight"
        };
        (self.samples > 0).then(|| {
            format!(
                "warning: {} input samples lie outside the range in which the nonlinearity was identified; there it is {there}",
                self.samples
            )
        })
    }
}

/// A number to four digits, without an exponent where it is of everyday size.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        let decimals = if size == 0.0 {
            0
        } else {
            (3 - size.log10().floor() as i32).max(0) as usize
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.17391, 2.15, 1234.6, -99999.0, 1e-4, 2.5e7].map(number);
        assert_eq!(shown, ["0", "0.1739", "2.150", "1235", "-99999", "1.000e-4", "2.500e7"]);
    }
}
