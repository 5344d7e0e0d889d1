//! The kernel estimates by name: in one column by any rule, in several columns by the rules for them.

use super::shared::{BLOCK_CRITERION, Observations, criterion_name, named, single};
use super::{EstimatorName, LocalBandwidths, NamedEstimator, NamedFit, Rule, Scores, Tuning};
use crate::error::Result;
use crate::nonlinearity::estimator::Estimator;
use crate::nonlinearity::kernel::{Degree, Sorted, check_points, check_weights, leave_one_out};
use crate::nonlinearity::{
    Bandwidth, KernelEstimator, KernelFit, KernelRegression, KernelSearch, LocalKernel, LocalRule, Outside,
};
use crate::selection::{BandwidthSearch, BlockFolds, Criterion, choose_bandwidth};
use crate::sort;

/// Factors between the bandwidth of leave-one-out and the candidates for blocks: from a quarter to eight times.
const FACTORS: std::ops::RangeInclusive<i32> = -4..=6;
/// Values of a profile over several bandwidths.
const PROFILE: usize = 24;

pub(super) fn fit(method: &NamedEstimator, degree: Degree, data: Observations) -> Result<NamedFit> {
    match data.x {
        [x] => line(method, degree, x, data),
        _ => product(method, degree, data),
    }
}

/// One column.
fn line(method: &NamedEstimator, degree: Degree, x: &[f64], observed: Observations) -> Result<NamedFit> {
    let Observations { y, weights, .. } = observed;
    let need = if let Tuning::Fixed(_) = method.tuning { 1 } else { 3 };
    check_points(x, y, need)?;
    if let Some(weights) = weights {
        check_weights(weights, x.len(), need)?;
    }
    let data = Sorted::new(x, y, weights);
    let (bandwidth, scores) = match &method.tuning {
        Tuning::Fixed(values) => (single(method, values)?, None),
        // Uses the sorted data.
        Tuning::FromData(Rule::LeaveOneOut) => {
            let search = BandwidthSearch::with_degree(method.kernel, degree, &data);
            (
                search.bandwidth,
                Some(scores(&search, criterion_name(Criterion::LeaveOneOut))),
            )
        }
        Tuning::FromData(rule) => {
            let choice = choose_bandwidth(rule.for_bandwidth(method.seed), method.kernel, degree, x, y, weights)?;
            // The plug-in rule has no scores.
            let found = (!choice.search.curve.is_empty()).then(|| scores(&choice.search, choice.score));
            (choice.bandwidth(), found)
        }
    };
    let line = one_bandwidth(method, data, bandwidth, degree)?;
    one_line(method, line, scores, observed)
}

/// The local line with local bandwidths; by Lepski's rule, the estimate with one bandwidth if local ones do not predict clearly better.
pub(super) fn local_bandwidth(method: &NamedEstimator, observed: Observations) -> Result<NamedFit> {
    let estimator = LocalKernel {
        kernel: method.kernel,
        rule: match method.tuning {
            Tuning::FromData(Rule::PlugIn) => LocalRule::PlugIn,
            _ => LocalRule::Lepski,
        },
        outside: method.outside,
    };
    let data = estimator.sorted(observed.x, observed.y, observed.weights)?;
    let fit = estimator.fit_sorted(&data)?;
    let global = fit.global();
    // The plug-in rule has no scores.
    let scores = (!global.curve.is_empty()).then(|| scores(global, criterion_name(Criterion::LeaveOneOut)));
    let line = one_bandwidth(method, data, global.bandwidth, Degree::Linear)?;
    if estimator.rule == LocalRule::Lepski && fit.threshold().is_none() {
        let one = NamedEstimator {
            name: EstimatorName::LocalLinear,
            ..method.clone()
        };
        return one_line(&one, line, scores, observed);
    }
    let local = LocalBandwidths {
        windows: fit.table(),
        jumps: fit.jumps().to_vec(),
        threshold: fit.threshold(),
        prediction_error: fit.prediction_error(),
        prediction_error_of_one: fit.prediction_error_of_one(),
        line,
    };
    Ok(NamedFit {
        local: Some(Box::new(local)),
        ..named(method, global.bandwidth, fit, scores, None)
    })
}

/// The estimate with one bandwidth.
fn one_bandwidth(method: &NamedEstimator, data: Sorted, bandwidth: f64, degree: Degree) -> Result<KernelFit> {
    let estimator = KernelRegression {
        kernel: method.kernel,
        bandwidth,
    };
    Ok(estimator.fit_sorted(data)?.with_degree(degree))
}

/// A local line with one bandwidth in the common form.
fn one_line(
    method: &NamedEstimator,
    fit: KernelFit,
    scores: Option<Scores>,
    observed: Observations,
) -> Result<NamedFit> {
    let (bandwidth, degree) = (fit.method().bandwidth, fit.degree());
    let left_out = match &scores {
        Some(s) if s.criterion == criterion_name(Criterion::LeaveOneOut) => score_at(s, bandwidth),
        _ => leave_one_out(fit.data(), method.kernel, degree, &[bandwidth])
            .first()
            .copied(),
    };
    if method.outside == Outside::Nan {
        return Ok(named(method, bandwidth, fit, scores, left_out));
    }
    let estimator = KernelEstimator {
        kernel: method.kernel,
        degree,
        bandwidth: Bandwidth::Fixed(vec![bandwidth]),
        outside: method.outside,
    };
    let fit = estimator.fit(observed.x, observed.y, observed.weights)?;
    Ok(named(method, bandwidth, fit, scores, left_out))
}

/// The score of one of the values that were tried.
fn score_at(scores: &Scores, parameter: f64) -> Option<f64> {
    let place = scores.parameter.iter().position(|p| *p == parameter)?;
    Some(scores.score[place])
}

/// The error of the scores of `search` due to bins.
fn binning_error(search: &BandwidthSearch) -> Option<f64> {
    search.binning.as_ref().map(|binning| binning.error)
}

pub(super) fn scores(search: &BandwidthSearch, criterion: &'static str) -> Scores {
    Scores {
        criterion,
        parameter: search.curve.iter().map(|c| c.bandwidth).collect(),
        score: search.curve.iter().map(|c| c.error).collect(),
        at_edge: search.at_edge,
        binning_error: binning_error(search),
    }
}

/// Several columns.
fn product(method: &NamedEstimator, degree: Degree, Observations { x, y, weights }: Observations) -> Result<NamedFit> {
    let with = |bandwidth| KernelEstimator {
        kernel: method.kernel,
        degree,
        bandwidth,
        outside: method.outside,
    };
    let bandwidth = match &method.tuning {
        Tuning::Fixed(values) => Bandwidth::Fixed(values.clone()),
        Tuning::FromData(Rule::Generalized) => Bandwidth::FromData(Criterion::Generalized),
        Tuning::FromData(_) => Bandwidth::FromData(Criterion::LeaveOneOut),
    };
    let fit = with(bandwidth).fit(x, y, weights)?;
    let named = |fit: crate::nonlinearity::KernelEstimate, scores, left_out| NamedFit {
        name: method.name,
        parameter: fit.bandwidths().to_vec(),
        regression: Box::new(fit),
        scores,
        left_out,
        local: None,
    };
    if method.tuning != Tuning::FromData(Rule::Block) {
        let search = fit.search();
        let scores = search.map(|s| Scores {
            criterion: criterion_name(s.criterion),
            at_edge: s.at_edge,
            ..profile(s)
        });
        let left_out = search
            .filter(|s| s.criterion == Criterion::LeaveOneOut)
            .and_then(best_score);
        return Ok(named(fit, scores, left_out));
    }
    // With the proportions of leave-one-out: only its scale undersmooths.
    let proportions = fit.bandwidths().to_vec();
    let scaled = |factor: f64| Bandwidth::Fixed(proportions.iter().map(|h| factor * h).collect());
    let factors: Vec<f64> = FACTORS.map(|k| (0.5 * f64::from(k)).exp2()).collect();
    let found = BlockFolds::for_data(x[0], y)?.choose(&factors, |f| with(scaled(f)), x, y, weights)?;
    let mean = geometric_mean(&proportions);
    let scores = Scores {
        criterion: BLOCK_CRITERION,
        parameter: factors.iter().map(|f| f * mean).collect(),
        score: found.curve.iter().map(|c| c.error).collect(),
        at_edge: found.at_edge,
        binning_error: None,
    };
    let fit = with(scaled(found.parameter)).fit(x, y, weights)?;
    Ok(named(fit, Some(scores), None))
}

/// The score of the bandwidths that were chosen.
fn best_score(search: &KernelSearch) -> Option<f64> {
    let found = search.curve.iter().rev().find(|c| c.bandwidths == search.bandwidths);
    found.map(|c| c.score).filter(|s| s.is_finite())
}

/// The smallest score among bandwidths with about the same geometric mean; for the chosen ones, the exact score.
fn profile(search: &KernelSearch) -> Scores {
    let mut tried: Vec<(f64, f64)> = (search.curve.iter())
        .map(|c| (geometric_mean(&c.bandwidths), c.score))
        .filter(|(h, score)| h.is_finite() && score.is_finite())
        .collect();
    sort::by_key(&mut tried, |t| t.1);
    sort::by_key(&mut tried, |t| t.0);
    let chosen = (geometric_mean(&search.bandwidths), best_score(search));
    let mut kept: Vec<(f64, f64)> = Vec::new();
    if let (Some(first), Some(last)) = (tried.first().copied(), tried.last().copied()) {
        let ratio = (last.0 / first.0).ln().max(f64::MIN_POSITIVE);
        let bin = |h: f64| ((h / first.0).ln() / ratio * (PROFILE - 1) as f64).round() as usize;
        for group in tried.chunk_by(|a, b| bin(a.0) == bin(b.0)) {
            kept.extend(group.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)));
        }
    }
    if let (h, Some(score)) = chosen {
        kept.retain(|k| k.1 >= score && k.0 != h);
        kept.push((h, score));
        sort::by_key(&mut kept, |k| k.0);
    }
    Scores {
        criterion: "",
        parameter: kept.iter().map(|k| k.0).collect(),
        score: kept.iter().map(|k| k.1).collect(),
        at_edge: false,
        binning_error: None,
    }
}

/// The geometric mean of positive values.
pub(super) fn geometric_mean(values: &[f64]) -> f64 {
    (values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64).exp()
}
