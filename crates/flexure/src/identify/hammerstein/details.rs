//! What a reader is shown of the steps: parameter, delay, correlation and order, each with the reason for its choice.

use super::Estimate;
use super::correlation::Psi;
use super::options::{PlainHammerstein, RegressionLag};
use super::realisation::ChosenOrder;
use crate::identify::result::{BlockKind, Detail, LinearBlock, NamedBlock, Place, Score, StaticBlock, Values};
use crate::text::{capitalised, number, short};

/// Both blocks with their names.
pub(super) fn named(curve: StaticBlock, linear: LinearBlock) -> Vec<NamedBlock> {
    vec![
        NamedBlock::new("nonlinearity", "Nonlinearity", BlockKind::Static(curve)),
        NamedBlock::new("linear", "Linear part", BlockKind::Linear(linear)),
    ]
}

/// Why something is as it is, if it was not given.
pub(super) fn given_or(given: bool, why: &str) -> &str {
    if given { "as given" } else { why }
}

/// The order, by the scores of `error`.
pub(super) fn of_order(order: &ChosenOrder, given: bool, error: &str) -> Vec<Detail> {
    let (orders, scores): (Vec<usize>, Vec<f64>) = order.scores.iter().map(|s| (s.order, s.bic)).unzip();
    let least = order.scores.iter().min_by(|a, b| a.bic.total_cmp(&b.bic));
    let smallest = format!("smallest Schwarz criterion of the {error} on the fit's samples");
    let why = match least.filter(|least| least.order != order.order) {
        Some(least) => format!(
            "order {} has the {smallest}. Order {} was taken, as it fits the samples better",
            least.order, order.order
        ),
        None => smallest,
    };
    let labels = ["order", "Schwarz's criterion"];
    let curve = (orders.len() > 1).then(|| Score::of_numbers(labels, &orders, scores.clone(), order.order));
    let values = Values::new([("order", orders.into()), ("bic", scores.into())]);
    vec![
        Detail::new("order_scores", values)
            .shown(Place::Choice, "Order", order.order.to_string(), given_or(given, &why))
            .scored(curve),
        Detail::new("hankel_singular_values", order.hankel_singular_values.as_slice()),
    ]
}

impl PlainHammerstein {
    /// What the steps of the method chose.
    pub(super) fn details(&self, estimate: &Estimate, order: &ChosenOrder, input: &str) -> Vec<Detail> {
        let mut details = self.parameter_details(estimate, input);
        details.push(self.lag_detail(estimate));
        details.push(correlation_detail(estimate.response.psi, input));
        details.extend(of_order(order, self.order.is_some(), "free-run error"));
        details
    }

    /// The estimator's kernel and parameter, for example "epanechnikov kernel, bandwidth 0.1".
    pub(super) fn tuning_text(&self, parameter: f64) -> String {
        let kernel = match self.estimator.has_bandwidth() {
            true => format!("{} kernel, ", self.kernel.name()),
            false => String::new(),
        };
        format!("{kernel}{} {}", self.estimator.parameter(), short(parameter))
    }

    /// The estimator's tuning parameter.
    fn parameter_details(&self, estimate: &Estimate, input: &str) -> Vec<Detail> {
        let (estimator, kernel) = (self.estimator, self.kernel.name());
        let (value, scores) = (estimate.regression.parameter, estimate.regression.scores.as_ref());
        let has_bandwidth = estimator.has_bandwidth();
        let (note, text) = match has_bandwidth {
            true => (
                "half width of the kernel's window, in the input's unit".to_owned(),
                format!("h = {} ({kernel} kernel)", number(value)),
            ),
            false => (
                format!("of the {} that estimates the nonlinearity", estimator.title()),
                format!("{} ({})", short(value), estimator.title()),
            ),
        };
        let why = scores.map_or_else(String::new, |s| s.smallest("leave-one-out cross-validation error"));
        let curve = scores.map(|s| Score::of_parameter(estimator, s, &[value], input));
        let title = capitalised(estimator.parameter());
        let bandwidth_scores = scores.filter(|_| has_bandwidth).map(|s| {
            Values::new([
                ("bandwidth", s.parameter.as_slice().into()),
                ("error", s.score.as_slice().into()),
            ])
        });
        vec![
            Detail::new("estimator", estimator.name()),
            Detail::new("parameter", estimator.parameter()),
            Detail::new("value", value).shown(Place::Fact, &title, short(value), &note),
            Detail::new("kernel", has_bandwidth.then_some(kernel)),
            Detail::new("bandwidth", has_bandwidth.then_some(value)),
            Detail::new("scores", scores.map(Values::from))
                .shown(Place::Choice, &title, text, given_or(self.parameter.is_some(), &why))
                .scored(curve),
            Detail::new("bandwidth_scores", bandwidth_scores),
        ]
    }

    /// The delay and the lag of the regression.
    fn lag_detail(&self, estimate: &Estimate) -> Detail {
        let text = format!(
            "delay {}, regression at lag {}",
            estimate.delay, estimate.regression_lag
        );
        let delay = given_or(
            self.delay.is_some(),
            "the first lag with a significant dependence of the output on the input",
        );
        let lag = match self.regression_lag {
            RegressionLag::Strongest => "that of the strongest dependence",
            RegressionLag::Delay => "the delay",
            RegressionLag::At(_) => "as given",
        };
        let why = format!(
            "the delay is {delay}; the lag of the regression is {lag}, and at every lag the regression gives the same nonlinearity up \
             to scale and offset"
        );
        let title = "Delay and lag of the regression";
        Detail::new("regression_lag", estimate.regression_lag).shown(Place::Choice, title, text, &why)
    }
}

/// What the output was correlated with.
fn correlation_detail(psi: Psi, input: &str) -> Detail {
    let (value, text, why) = match psi {
        Psi::Input => (
            "input",
            format!("with {input}"),
            "the cross-covariance of a white input and the output is the impulse response up to scale",
        ),
        Psi::Nonlinearity => (
            "estimated nonlinearity",
            "with the estimated nonlinearity".to_owned(),
            "the input itself is (nearly) uncorrelated with an even nonlinearity",
        ),
        Psi::DeconvolvedNonlinearity => (
            "estimated nonlinearity, deconvolved",
            "with the estimated nonlinearity, deconvolved".to_owned(),
            "the input is not white, so its own covariance had to be taken out of that with the output",
        ),
    };
    Detail::new("correlated_with", value).shown(Place::Choice, "Correlation", text, why)
}
