//! The recursive kernel estimate by name, over the points in their order.

use super::shared::{Observations, Shown, named, number, tuned};
use super::{NamedEstimator, NamedFit, Rule, Scores, Tuning};
use crate::error::Result;
use crate::nonlinearity::kernel::Degree;
use crate::nonlinearity::{Choice, Estimator, RecursiveFit, RecursiveRegression};
use crate::selection::choose_bandwidth;

pub(super) fn fit(method: &NamedEstimator, data: Observations) -> Result<NamedFit> {
    let make = |bandwidth| RecursiveRegression {
        kernel: method.kernel,
        bandwidth,
        outside: method.outside,
        ..RecursiveRegression::default()
    };
    match method.tuning {
        Tuning::FromData(rule @ (Rule::Bootstrap | Rule::BlockBootstrap { .. })) => resampled(method, rule, make, data),
        _ => {
            let shown = Shown {
                value: RecursiveFit::bandwidth,
                search: RecursiveFit::search,
                candidate: |c| c,
            };
            tuned(method, data, number(method)?, make, &shown)
        }
    }
}

/// The estimate with the first bandwidth c chosen such that the typical bandwidth equals the bootstrap's choice for the estimate with one
/// bandwidth.
fn resampled(
    method: &NamedEstimator,
    rule: Rule,
    make: impl Fn(Choice<f64>) -> RecursiveRegression,
    Observations { x, y, weights }: Observations,
) -> Result<NamedFit> {
    // The value does not matter; this fit checks the data as for every other rule.
    let first = make(Choice::Fixed(1.0)).fit(x, y, weights)?;
    let per_bandwidth = 1.0 / first.typical_bandwidth();
    let rule = rule.for_bandwidth(method.seed);
    let choice = choose_bandwidth(rule, method.kernel, Degree::Constant, x[0], y, weights)?;
    let scores = Scores {
        criterion: match method.tuning {
            Tuning::FromData(Rule::Bootstrap) => {
                "wild bootstrap's mean squared error with the typical bandwidth for all"
            }
            _ => "block bootstrap's mean squared error with the typical bandwidth for all",
        },
        parameter: choice
            .search
            .curve
            .iter()
            .map(|c| per_bandwidth * c.bandwidth)
            .collect(),
        score: choice.search.curve.iter().map(|c| c.error).collect(),
        at_edge: choice.search.at_edge,
        binning_error: None,
    };
    let c = per_bandwidth * choice.bandwidth();
    let fit = make(Choice::Fixed(c)).fit(x, y, weights)?;
    Ok(named(method, c, fit, Some(scores), None))
}
