//! What a page says was chosen from data, and why.

use flexure::identify::{PlainHammerstein, Psi, RegressionLag};
use flexure_report::data::{Choice, ScoreCurve};

use crate::systems::estimate::{self, Estimate, Method, Own, Plain, Refined};
use crate::systems::form::form_name;
use crate::systems::outcome::Context;
use crate::text::{self, number};

/// Why something is as it is, if it was not given.
pub fn given_or(given: bool, why: &str) -> &str {
    if given { "as given" } else { why }
}

/// All choices, in order.
pub fn choices(context: &Context, result: &Estimate) -> Vec<Choice> {
    match (&context.method, &result.own) {
        (Method::Plain(method), Own::Plain(own)) => plain(context, method, result, own),
        (_, Own::Plain(own)) => plain(context, &PlainHammerstein::default(), result, own),
        (_, Own::Refined(own)) => refined(context, result, own),
    }
}

fn choice(name: &str, value: String, why: &str, curve: Option<ScoreCurve>) -> Choice {
    Choice {
        name: name.to_owned(),
        value,
        why: why.to_owned(),
        curve,
    }
}

/// The order, whose scores are those of `error`.
fn order(context: &Context, result: &Estimate, error: &str) -> Choice {
    let scores = &result.order.scores;
    let curve = (scores.len() > 1).then(|| ScoreCurve {
        x_label: "order".to_owned(),
        y_label: "Schwarz's criterion".to_owned(),
        log_x: false,
        x: scores.iter().map(|s| s.order as f64).collect(),
        y: scores.iter().map(|s| s.bic).collect(),
        chosen: result.order.order as f64,
    });
    let why = format!("smallest Schwarz criterion of the {error} on the fit's samples");
    choice(
        "Order",
        format!("l = {}", result.order.order),
        given_or(context.method.order().is_some(), &why),
        curve,
    )
}

fn refined(context: &Context, result: &Estimate, own: &Refined) -> Vec<Choice> {
    let delay = choice(
        "Delay",
        result.delay.to_string(),
        given_or(
            context.method.delay().is_some(),
            "the first lag at which the impulse response is clearly not zero",
        ),
        None,
    );
    if !own.refined {
        return vec![order(context, result, "free-run error"), delay];
    }
    let mut all = vec![
        order(context, result, "whitened error"),
        delay,
        choice(
            "Breakpoints of the nonlinearity",
            own.breakpoint_words(),
            "jumps, kinks and cubic knots where each lowers the error by more than chance would; a cubic between them",
            None,
        ),
        choice(
            "Noise",
            format!("standard deviation {}, {}", number(own.noise), own.noise_words()),
            "in the output's unit; a coloured error is whitened by the autoregression of smallest Schwarz criterion, unless samples are missing",
            None,
        ),
    ];
    all.extend(own.form.as_ref().map(|fit| {
        choice(
            &format!("Form {}", form_name(fit.form)),
            estimate::form_parameters(fit),
            &format!(
                "{}; ± one standard error, for the estimated linear part",
                estimate::form_verdict(fit)
            ),
            None,
        )
    }));
    all
}

fn plain(context: &Context, method: &PlainHammerstein, result: &Estimate, own: &Plain) -> Vec<Choice> {
    let estimator = own.estimator;
    let scores = own.scores.as_ref();
    let how = scores.map_or_else(String::new, |s| {
        text::smallest("leave-one-out cross-validation error", s)
    });
    let scores = scores.map(|s| text::score_curve(estimator, s, &[own.parameter], context.signals.input));
    vec![
        choice(
            &text::capitalised(estimator.parameter()),
            match estimator.has_bandwidth() {
                true => format!("h = {} ({} kernel)", number(own.parameter), own.kernel.name()),
                false => format!("{} ({})", text::list(&[own.parameter]), estimator.title()),
            },
            given_or(method.parameter.is_some(), &how),
            scores,
        ),
        order(context, result, "free-run error"),
        choice(
            "Delay and lag of the regression",
            format!("delay {}, regression at lag {}", result.delay, own.regression_lag),
            &why_these_lags(method),
            None,
        ),
        choice(
            "Correlation",
            match own.psi {
                Psi::Input => format!("with {}", context.signals.input),
                Psi::Nonlinearity => "with the estimated nonlinearity".to_owned(),
                Psi::DeconvolvedNonlinearity => "with the estimated nonlinearity, deconvolved".to_owned(),
            },
            match own.psi {
                Psi::Input => {
                    "the cross-covariance of a white input and the output is the impulse response up to scale"
                }
                Psi::Nonlinearity => "the input itself is (nearly) uncorrelated with an even nonlinearity",
                Psi::DeconvolvedNonlinearity => {
                    "the input is not white, so its own covariance had to be taken out of that with the output"
                }
            },
            None,
        ),
    ]
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
