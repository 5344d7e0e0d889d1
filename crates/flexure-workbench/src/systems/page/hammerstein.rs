//! The page of a Hammerstein model.

use anyhow::Result;
use flexure_io::RecordFile;
use flexure_report::data::{Fact, LinearPart, Nonlinearity, Page};

use super::choices::{choices, given_or};
use super::{
    Decoration, Judged, Parts, Truth, assembled, density, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::systems::estimate::{Estimate, Own};
use crate::systems::outcome::Context;
use crate::text;

/// Fills in the page.
pub fn page(file: &RecordFile, context: &Context, result: &Estimate, mut decoration: Decoration) -> Result<Page> {
    let u = file.record.finite(context.signals.input)?;
    let parts = Parts {
        facts: facts(context, result),
        nonlinearity: nonlinearity(u, context, result, decoration.truth.take()),
        linear: vec![linear(context, result)],
        choices: choices(context, result),
        candidates: Vec::new(),
        ..Parts::default()
    };
    let judged = Judged {
        signals: context.signals,
        model: "A Hammerstein model (a static nonlinearity, then linear dynamics)".to_owned(),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict: &result.verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn facts(context: &Context, result: &Estimate) -> Vec<Fact> {
    let mut facts = fit_facts(&result.verdict, context.signals.output).to_vec();
    facts.extend([
        fact(
            "Order",
            result.order.order.to_string(),
            given_or(
                context.method.order().is_some(),
                "order of the linear part, by Schwarz's criterion",
            ),
        ),
        fact(
            "Delay",
            samples(result.delay),
            given_or(
                context.method.delay().is_some(),
                "the first lag at which the output depends on the input",
            ),
        ),
    ]);
    match &result.own {
        Own::Plain(own) => facts.push(fact(
            &text::capitalised(own.estimator.parameter()),
            text::list(&[own.parameter]),
            &match own.estimator.has_bandwidth() {
                true => "half width of the kernel's window, in the input's unit".to_owned(),
                false => format!("of the {} that estimates the nonlinearity", own.estimator.title()),
            },
        )),
        Own::Refined(own) if own.refined => facts.push(fact(
            "Breakpoints",
            own.breakpoints.len().to_string(),
            &format!("of the nonlinearity: {}", own.breakpoint_words()),
        )),
        Own::Refined(_) => {}
    }
    let left_out = match result.missing_fresh() {
        0 => String::new(),
        n => format!(" ({n} of those missing)"),
    };
    facts.push(samples_fact(result.predicted.len(), result.fitted, &left_out));
    facts
}

fn nonlinearity(u: &[f64], context: &Context, result: &Estimate, truth: Option<Truth>) -> Nonlinearity {
    let curve = &result.nonlinearity;
    let x = curve.x().to_vec();
    let (truth, truth_label) = match truth {
        Some(truth) => (x.iter().map(|&x| (truth.phi)(x)).collect(), truth.label),
        None => (Vec::new(), String::new()),
    };
    Nonlinearity {
        x_label: labelled(context.signals.input),
        y_label: "nonlinearity's output".to_owned(),
        y: curve.y().to_vec(),
        lower: result.band_edge(-1.0),
        upper: result.band_edge(1.0),
        band_label: match &result.own {
            Own::Refined(own) if own.refined => "95 % pointwise, for these breakpoints",
            _ => "95 % pointwise, variance only",
        }
        .to_owned(),
        density: density(&u[..result.fitted], &x),
        truth,
        truth_label,
        x,
    }
}

fn linear(context: &Context, result: &Estimate) -> LinearPart {
    let shown = match &result.own {
        Own::Plain(own) => Some(own.impulse_estimate.len()),
        Own::Refined(_) => None,
    };
    let mut part = linear_part("Linear part", &result.linear, shown, context.signals.sample_time);
    if let Own::Plain(own) = &result.own {
        part.impulse_estimate.clone_from(&own.impulse_estimate);
        part.impulse_limit = own.impulse_limit;
    }
    part
}
