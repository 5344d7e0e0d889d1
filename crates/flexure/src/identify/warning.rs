//! Warnings for the user of a model.

use crate::text::{self, number};

/// From this share of missing outputs on, it is said that error bars are too narrow. Convention: a hundredth of an error bar does not matter.
const NOTICED: f64 = 0.01;
/// The most outliers that are named by their sample.
const NAMED_OUTLIERS: usize = 5;

/// Something that the user should know before trusting the model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The input's samples depend on one another.
    #[error(
        "the input is not white (its largest autocorrelation is {largest:.2} at lag {lag}), which the plain method \
         assumes: the covariances were deconvolved and the other lags taken out of the regression, which is less exact"
    )]
    InputNotWhite {
        /// The largest autocorrelation in absolute value.
        largest: f64,
        /// Its lag.
        lag: usize,
    },
    /// The input takes few values.
    #[error(
        "the input has only {levels} levels: a nonlinearity at the input {}",
        match levels {
            2 => "cannot be distinguished from a straight line",
            _ => "is known at those alone, and drawn straight between them",
        }
    )]
    FewLevels {
        /// The number of distinct values.
        levels: usize,
    },
    /// The output does not seem to depend on the input.
    #[error("the output shows no significant dependence on the input at lags 0 to {lags}: the model is not reliable")]
    NoDependence {
        /// The last lag that was looked at.
        lags: usize,
    },
    /// The cross-validation score is best at the end of its range.
    #[error(
        "the cross-validation score is smallest at the edge of the bandwidths tried ({bandwidth}): the nonlinearity is constant, or rougher than the data resolve"
    )]
    BandwidthAtEdge {
        /// The bandwidth.
        bandwidth: f64,
    },
    /// The linear part was still far from settled at the last lag that the record allows.
    #[error(
        "the impulse response has not settled after {lags} samples, the most that this record allows: sample more slowly, or record for longer"
    )]
    NotSettled {
        /// The last lag that was used.
        lags: usize,
    },
    /// The static gain nearly vanishes, so that the linear part could not be scaled to a unit one.
    #[error(
        "the linear part's static gain nearly vanishes: its first coefficient is 1 instead, and the output's mean is kept as an offset"
    )]
    NoStaticGain,
    /// The fresh part's input leaves the range in which the nonlinearity was estimated.
    #[error(
        "{percent:.1} % of {} lies outside the range [{}, {}] of the fit, by up to {} of the range; outside it, the curve {}",
        if *.is_input { "the fresh part's input" } else { "what enters the nonlinearity in the fresh part" },
        number(*.low), number(*.high), text::percent(*.farthest), if *.continued { "continues as a straight line" } else { "is held at its end value" }
    )]
    OutsideRange {
        /// Share of the fresh samples.
        percent: f64,
        /// Whether the input itself enters the curve.
        is_input: bool,
        /// Smallest input of the fit.
        low: f64,
        /// Largest input of the fit.
        high: f64,
        /// How far outside the farthest one is, as a share of the range.
        farthest: f64,
        /// Whether the curve continues straight there; otherwise it has the value of its end.
        continued: bool,
    },
    /// The model predicts no better than the output's mean.
    #[error(
        "the free-run error on fresh data exceeds the output's own spread (fit {}): the model explains nothing",
        text::fit(*.fit_percent, 1)
    )]
    Useless {
        /// The fit on fresh data.
        fit_percent: f64,
    },
    /// A model of several inputs predicts as well without one of them.
    #[error(
        "the data show no effect of '{input}': with that input held at its mean the fit on fresh data is {} too; leave it out",
        text::fit(*fit_percent, 2)
    )]
    NeedlessInput {
        /// The input.
        input: String,
        /// The fit without it.
        fit_percent: f64,
    },
    /// The refinement found nothing better than the plain estimate.
    #[error("the refinement did not lower the error of the plain estimate, which is returned without standard errors")]
    NotRefined,
    /// The score of an estimator without a bandwidth is best at the end of its range.
    #[error(
        "the cross-validation score is smallest at the edge of the values tried ({parameter} {value}): the nonlinearity is rougher than these resolve"
    )]
    ParameterAtEdge {
        /// The parameter's name.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// The output does not settle under a constant input.
    #[error(
        "'{output}' integrates '{input}', as a position integrates a force, and does not settle: a joint's friction and inertia \
         explain that (`flexure joint`). Of the structures, only linear has poles for it; for a nonlinearity identify the output's difference"
    )]
    IntegratedOutput {
        /// The column that is integrated.
        input: String,
        /// The column that integrates it.
        output: String,
    },
    /// The input reacts to the output's noise at the same sample, so the delay is at least one sample.
    #[error(
        "'{input}' reacts to the noise of '{output}' within the same sample, as the output of a controller does. Therefore the model has a delay \
         of at least one sample. Without a delay it would contain a part of the controller"
    )]
    InputReacts {
        /// The input.
        input: String,
        /// The output.
        output: String,
    },
    /// Samples of the output that stand alone, far from the model.
    #[error("{}", outliers(samples, *.left_out))]
    Outliers {
        /// Their indices, of all experiments one after the other.
        samples: Vec<usize>,
        /// Whether they were left out.
        left_out: bool,
    },
    /// Outputs are missing.
    #[error(
        "{missing} of {samples} outputs are missing and left out{}",
        match *missing as f64 / *samples as f64 {
            share if *filled && share >= NOTICED => {
                format!(": in the fit, the model's own values stand in for them, which makes error bars {} too narrow", text::percent(share))
            }
            _ => String::new(),
        }
    )]
    MissingOutputs {
        /// The number of missing outputs.
        missing: usize,
        /// The number of samples.
        samples: usize,
        /// Whether the model's own outputs were in their places in the fit.
        filled: bool,
    },
    /// The start of a cascade's search is weak.
    #[error(
        "the best linear approximation explains only {percent:.1} % of the output's variance, from which a cascade's poles and \
         zeros are hardly known: give the input a mean where the nonlinearity is steep, or record for longer"
    )]
    WeakLinearApproximation {
        /// The share explained.
        percent: f64,
    },
}

/// The sentence on outliers: their number, and the first of them.
fn outliers(samples: &[usize], left_out: bool) -> String {
    let (count, several) = (samples.len(), samples.len() > 1);
    let mut at: Vec<String> = samples.iter().take(NAMED_OUTLIERS).map(usize::to_string).collect();
    if count > at.len() {
        at.push(format!("{} more", count - at.len()));
    }
    let what = if several { "outliers" } else { "outlier" };
    let (samples, are) = if several {
        ("samples", "were")
    } else {
        ("sample", "was")
    };
    match left_out {
        true => format!(
            "{count} {what} of the output {are} left out ({samples} {})",
            at.join(", ")
        ),
        false => format!(
            "the output has {count} {what}, far from the model and from the neighbouring samples ({samples} {}): the option robust (--robust) leaves \
             them out of the fit",
            at.join(", ")
        ),
    }
}
