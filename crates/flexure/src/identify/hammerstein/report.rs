//! A static nonlinearity, then linear dynamics.

use crate::error::Result;
use crate::identify::hammerstein::{
    Breakpoint, BreakpointKind, FormFit, PlainHammerstein, RefinedHammerstein, RefinedIdentification, RegressionLag,
};
use crate::identify::outcome::{ChosenOrder, PlainIdentification, Psi};
use crate::identify::request::{HammersteinMethod, Progress, Request, Structure};
use crate::identify::result::{
    BlockKind, Detail, Identification, ImpulseEstimate, LinearBlock, NamedBlock, Place, Score, StaticBlock,
    StructureName, Value, Values,
};
use crate::identify::run::{Run, announce, path};
use crate::nonlinearity::Curve;
use crate::text::{capitalised, number, short};

/// Breakpoints of one kind up to so many are listed one by one.
const MOST_LISTED: usize = 6;

/// The identification of a Hammerstein system, by either method.
pub const HAMMERSTEIN: Structure = Structure {
    name: StructureName {
        key: "hammerstein",
        title: "Hammerstein",
    },
    description: "a static nonlinearity, then linear dynamics",
    inputs: 1..=1,
    options: &[
        "method",
        "order",
        "delay",
        "unit",
        "known",
        "form",
        "missing",
        "start",
        "lag",
        "nonlinearity",
        "bandwidth",
        "parameter",
        "kernel",
        "ignore_colour",
    ],
    complexity: Some(2),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    announce("refining on all samples", progress)?;
    match &request.options.hammerstein {
        HammersteinMethod::Plain(method) => {
            let found = method.identify(request.record()?, request.input()?, request.output)?;
            plain(request, method, found)
        }
        HammersteinMethod::Refined { method, form } => {
            let found = method.identify_experiments(request.records, request.input()?, request.output)?;
            let form = form.map(|form| found.fit_form(form)).transpose()?;
            refined(request, method, found, form)
        }
    }
}

/// Why something is as it is, if it was not given.
fn given_or(given: bool, why: &str) -> &str {
    if given { "as given" } else { why }
}

/// "[-1.000, 1.000]", the range of a curve.
fn range(curve: &Curve) -> String {
    let x = curve.x();
    format!("[{}, {}]", number(x[0]), number(x[x.len() - 1]))
}

/// The order, by the scores of `error`; the delay is said elsewhere.
fn order_details(order: &ChosenOrder, given: bool, error: &str) -> Vec<Detail> {
    let (orders, scores): (Vec<usize>, Vec<f64>) = order.scores.iter().map(|s| (s.order, s.bic)).unzip();
    let why = format!("smallest Schwarz criterion of the {error} on the fit's samples");
    let curve = (orders.len() > 1).then(|| Score {
        x_label: "order".to_owned(),
        y_label: "Schwarz's criterion".to_owned(),
        logarithmic: false,
        x: orders.iter().map(|o| *o as f64).collect(),
        y: scores.clone(),
        chosen: order.order as f64,
    });
    let values = Values::new([("order", orders.into()), ("bic", scores.into())]);
    vec![
        Detail::new("order_scores", values)
            .shown(
                Place::Choice,
                "Order",
                format!("l = {}", order.order),
                given_or(given, &why),
            )
            .scored(curve),
        Detail::new("hankel_singular_values", order.hankel_singular_values.as_slice()),
    ]
}

/// Both blocks.
fn blocks(curve: StaticBlock, linear: LinearBlock) -> Vec<NamedBlock> {
    vec![
        NamedBlock::new("nonlinearity", "Nonlinearity", BlockKind::Static(curve)),
        NamedBlock::new("linear", "Linear part", BlockKind::Linear(linear)),
    ]
}

fn plain(request: &Request<'_>, method: &PlainHammerstein, found: PlainIdentification) -> Result<Identification> {
    let estimator = found.estimator;
    let kernel = match estimator.has_bandwidth() {
        true => format!("{} kernel, ", found.kernel.name()),
        false => String::new(),
    };
    let curve = StaticBlock {
        description: format!(
            "{} on {}, {kernel}{} {}",
            estimator.title(),
            range(&found.nonlinearity),
            estimator.parameter(),
            short(found.parameter)
        ),
        curve: found.nonlinearity.clone(),
        band_label: "95 % pointwise, variance only",
        band: found.band.clone(),
        breakpoints: Vec::new(),
        kinks: Vec::new(),
    };
    let linear = LinearBlock {
        system: found.linear.clone(),
        errors: None,
        impulse: Some(ImpulseEstimate {
            values: found.impulse_estimate.clone(),
            limit: found.impulse_limit,
        }),
    };
    let mut details = plain_details(method, &found, request.input()?);
    details.extend(order_details(&found.order, method.order.is_some(), "free-run error"));
    let (order, delay) = (found.order.order, found.delay);
    let run = Run {
        model: found.model,
        paths: vec![path(request, blocks(curve, linear))],
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    Ok(Identification {
        method: "plain",
        order,
        delay,
        details,
        ..run.identification(&HAMMERSTEIN, request)?
    })
}

fn plain_details(method: &PlainHammerstein, found: &PlainIdentification, input: &str) -> Vec<Detail> {
    let estimator = found.estimator;
    let banded = estimator.has_bandwidth();
    let note = match banded {
        true => "half width of the kernel's window, in the input's unit".to_owned(),
        false => format!("of the {} that estimates the nonlinearity", estimator.title()),
    };
    let text = match banded {
        true => format!("h = {} ({} kernel)", number(found.parameter), found.kernel.name()),
        false => format!("{} ({})", short(found.parameter), estimator.title()),
    };
    let how = (found.scores.as_ref()).map_or_else(String::new, |s| s.smallest("leave-one-out cross-validation error"));
    let curve = (found.scores.as_ref()).map(|s| Score::of_parameter(estimator, s, &[found.parameter], input));
    let parameter = capitalised(estimator.parameter());
    let (with, why) = match found.psi {
        Psi::Input => (
            format!("with {input}"),
            "the cross-covariance of a white input and the output is the impulse response up to scale",
        ),
        Psi::Nonlinearity => (
            "with the estimated nonlinearity".to_owned(),
            "the input itself is (nearly) uncorrelated with an even nonlinearity",
        ),
        Psi::DeconvolvedNonlinearity => (
            "with the estimated nonlinearity, deconvolved".to_owned(),
            "the input is not white, so its own covariance had to be taken out of that with the output",
        ),
    };
    let lags = format!("delay {}, regression at lag {}", found.delay, found.regression_lag);
    let scores = found.scores.as_ref();
    vec![
        Detail::new("estimator", estimator.name()),
        Detail::new("parameter", estimator.parameter()),
        Detail::new("value", found.parameter).shown(Place::Fact, &parameter, short(found.parameter), &note),
        Detail::new("kernel", banded.then(|| found.kernel.name())),
        Detail::new("bandwidth", banded.then_some(found.parameter)),
        Detail::new("scores", scores.map(Values::from))
            .shown(
                Place::Choice,
                &parameter,
                text,
                given_or(method.parameter.is_some(), &how),
            )
            .scored(curve),
        Detail::new("bandwidth_scores", scores.filter(|_| banded).map(bandwidth_scores)),
        Detail::new("regression_lag", found.regression_lag).shown(
            Place::Choice,
            "Delay and lag of the regression",
            lags,
            &why_these_lags(method),
        ),
        Detail::new(
            "correlated_with",
            with.trim_start_matches("with the ")
                .replace(&format!("with {input}"), "input"),
        )
        .shown(Place::Choice, "Correlation", with, why),
    ]
}

fn bandwidth_scores(scores: &crate::nonlinearity::Scores) -> Values {
    Values::new([
        ("bandwidth", scores.parameter.as_slice().into()),
        ("error", scores.score.as_slice().into()),
    ])
}

/// How the delay and the lag of the regression came about.
fn why_these_lags(method: &PlainHammerstein) -> String {
    let delay = given_or(
        method.delay.is_some(),
        "the first lag with a significant dependence of the output on the input",
    );
    let lag = match method.regression_lag {
        RegressionLag::Strongest => "that of the strongest dependence",
        RegressionLag::Delay => "the delay",
        RegressionLag::At(_) => "as given",
    };
    format!(
        "the delay is {delay}; the lag of the regression is {lag}, and at every lag the regression gives the same nonlinearity up to \
         scale and offset"
    )
}

fn refined(
    request: &Request<'_>,
    method: &RefinedHammerstein,
    found: RefinedIdentification,
    form: Option<FormFit>,
) -> Result<Identification> {
    let breaks = breakpoint_words(&found.breakpoints);
    let over = range(&found.nonlinearity);
    let details = refined_details(method, &found, form.as_ref(), &breaks);
    let curve = StaticBlock {
        curve: found.nonlinearity,
        band_label: match found.refined {
            true => "95 % pointwise, for these breakpoints",
            false => "95 % pointwise, variance only",
        },
        band: found.band,
        breakpoints: Vec::new(),
        kinks: Vec::new(),
        description: match found.refined {
            true => format!("piecewise cubic on {over}, {breaks}"),
            false => format!("the plain estimate on {over}"),
        },
    };
    let linear = LinearBlock {
        // Cubic pieces: four parameters and one more at every breakpoint; the linear block's scale is theirs.
        system: found.linear,
        errors: found.refined.then_some(found.linear_errors),
        impulse: None,
    };
    let numerator = linear.system.b().len() - linear.delay();
    let parameters = linear.order() + numerator + found.breakpoints.len() + 3;
    let run = Run {
        model: found.model,
        paths: vec![path(request, blocks(curve, linear))],
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    Ok(Identification {
        method: "refined",
        order: found.order.order,
        delay: found.delay,
        parameters,
        details,
        noise_model: found.refined.then_some(found.noise_model),
        ..run.identification(&HAMMERSTEIN, request)?
    })
}

fn refined_details(
    method: &RefinedHammerstein,
    found: &RefinedIdentification,
    form: Option<&FormFit>,
    breaks: &str,
) -> Vec<Detail> {
    let error = if found.refined {
        "whitened error"
    } else {
        "free-run error"
    };
    let mut details = order_details(&found.order, method.order.is_some(), error);
    let why = given_or(
        method.delay.is_some(),
        "the first lag at which the impulse response is clearly not zero",
    );
    details.push(Detail::sentence(Place::Choice, "Delay", found.delay.to_string(), why));
    details.push(Detail::new("refined", found.refined));
    let breakpoints: Vec<Values> = (found.breakpoints.iter())
        .map(|b| Values::new([("at", b.at.into()), ("kind", kind_name(b.kind).into())]))
        .collect();
    let breakpoints = Detail::new("breakpoints", breakpoints);
    if !found.refined {
        let none = |key| Detail::new(key, Value::None);
        details.extend([breakpoints, none("memory_removed"), none("noise"), none("form")]);
        return details;
    }
    let why =
        "jumps, kinks and cubic knots where each lowers the error by more than chance would; a cubic between them";
    details.push(breakpoints.shown(Place::Choice, "Breakpoints of the nonlinearity", breaks, why));
    let count = found.breakpoints.len().to_string();
    details.push(Detail::sentence(
        Place::Fact,
        "Breakpoints",
        count,
        &format!("of the nonlinearity: {breaks}"),
    ));
    let points = &found.memory_removed;
    details.push(
        Detail::new(
            "memory_removed",
            Values::new([
                ("x", points.x.as_slice().into()),
                ("value", points.value.as_slice().into()),
                ("samples", points.samples.as_slice().into()),
                ("deviation", points.deviation.into()),
            ]),
        )
        .unsaved(),
    );
    let noise = Values::new([
        ("model", found.noise_model.as_slice().into()),
        ("deviation", found.noise.into()),
    ]);
    let white = match found.noise_model.len() {
        0 | 1 => "taken as white".to_owned(),
        n => format!("whitened by an autoregression of order {}", n - 1),
    };
    let text = format!("standard deviation {}, {white}", number(found.noise));
    let why = "in the output's unit; a coloured error is whitened by the autoregression of smallest Schwarz criterion, unless samples \
               are missing";
    details.push(Detail::new("noise", noise).shown(Place::ChoiceAndText, "Noise", text, why));
    details.push(form.map_or_else(|| Detail::new("form", Value::None), form_detail));
    details
}

/// A breakpoint's kind in one word.
fn kind_name(kind: BreakpointKind) -> &'static str {
    match kind {
        BreakpointKind::Value => "jump",
        BreakpointKind::Slope => "kink",
        BreakpointKind::ThirdDerivative => "knot",
    }
}

/// Where the nonlinearity breaks, for reading: "kinks at -1.000, 1.000".
fn breakpoint_words(breakpoints: &[Breakpoint]) -> String {
    let kinds = [
        BreakpointKind::Value,
        BreakpointKind::Slope,
        BreakpointKind::ThirdDerivative,
    ];
    let each = kinds.map(|kind| {
        let at: Vec<String> = (breakpoints.iter())
            .filter(|b| b.kind == kind)
            .map(|b| number(b.at))
            .collect();
        let name = kind_name(kind);
        match at.len() {
            0 => String::new(),
            1 => format!("{name} at {}", at[0]),
            n if n <= MOST_LISTED && kind != BreakpointKind::ThirdDerivative => {
                format!("{name}s at {}", at.join(", "))
            }
            n => format!("{n} {name}s"),
        }
    });
    let each: Vec<String> = each.into_iter().filter(|t| !t.is_empty()).collect();
    match each.is_empty() {
        true => "no breakpoint".to_owned(),
        false => each.join("; "),
    }
}

/// A standard error, if it is one: neither the 0 of what has none nor the infinity of what the data do not determine.
fn standard_error(error: f64) -> Option<f64> {
    (error > 0.0 && error.is_finite()).then_some(error)
}

/// The form that was fitted to the nonlinearity, and its test.
fn form_detail(fit: &FormFit) -> Detail {
    let parameters: Vec<Values> = (fit.parameters.iter())
        .map(|p| {
            Values::new([
                ("name", p.name.clone().into()),
                ("value", p.value.into()),
                ("error", standard_error(p.error).into()),
            ])
        })
        .collect();
    let value = Values::new([
        ("name", fit.form.to_string().into()),
        ("parameters", parameters.into()),
        ("statistic", fit.statistic.into()),
        ("degrees_of_freedom", fit.degrees.into()),
        ("limit", fit.limit.into()),
        ("p_value", fit.p_value.into()),
        ("holds", fit.holds().into()),
    ]);
    let text: Vec<String> = (fit.parameters.iter())
        .map(|p| match standard_error(p.error) {
            Some(error) => format!("{} = {} ± {}", p.name, number(p.value), number(error)),
            None if p.error == 0.0 => format!("{} = {}", p.name, number(p.value)),
            None => format!("{} not determined", p.name),
        })
        .collect();
    let why = format!(
        "{}; ± one standard error, for the estimated linear part",
        form_verdict(fit)
    );
    let title = format!("Form {}", fit.form);
    Detail::new("form", value).shown(Place::ChoiceAndText, &title, text.join(", "), &why)
}

/// The test of a form for reading.
fn form_verdict(fit: &FormFit) -> String {
    let verdict = match fit.holds() {
        true => "the data do not refute this form",
        false => "the data refute this form at 1 %",
    };
    let p = match fit.p_value {
        p if p < 0.001 => "p < 0.001".to_owned(),
        p => format!("p = {p:.3}"),
    };
    format!(
        "{verdict} (lack of fit {:.1}, limit {:.1}, {} degrees of freedom, {p})",
        fit.statistic, fit.limit, fit.degrees
    )
}
