//! What all fits by name share: they read the parameter as the estimators take it, and return the result in the common form.

use super::{NamedEstimator, NamedFit, Rule, Scores, Tuning};
use crate::error::{Error, ParameterError, Result};
use crate::nonlinearity::estimator::{Choice, Estimator};
use crate::selection::{BlockFolds, Criterion, ScoredParameter, Search};

/// The data of a regression, as given.
#[derive(Clone, Copy)]
pub(super) struct Observations<'a> {
    /// The columns of x.
    pub x: &'a [&'a [f64]],
    /// The ordinates.
    pub y: &'a [f64],
    /// The weights of the points; each counts once without them.
    pub weights: Option<&'a [f64]>,
}

/// Refuses a rule that does not suit the estimator with this number of columns.
pub(super) fn check_rule(method: &NamedEstimator, columns: usize) -> Result<()> {
    if let Tuning::FromData(rule) = method.tuning
        && !rule.suits(method.name, columns)
    {
        return Err(Error::Parameter(ParameterError::RuleUnsuited {
            rule: rule.name(),
            estimator: method.name.title(),
            columns,
            instead: match rule {
                Rule::PlugIn if columns == 1 => "it is made for the local line; take that, or another rule",
                _ => "choose it by another rule, or give it",
            },
        }));
    }
    Ok(())
}

/// The one value that was given for a parameter.
pub(super) fn single(method: &NamedEstimator, values: &[f64]) -> Result<f64> {
    match values {
        [value] => Ok(*value),
        _ => Err(Error::length(method.name.parameter().to_owned(), values.len(), 1)),
    }
}

/// The parameter as a choice of a number; blocks choose on their own.
pub(super) fn number(method: &NamedEstimator) -> Result<Choice<f64>> {
    match &method.tuning {
        Tuning::FromData(Rule::Generalized) => Ok(Choice::FromData(Criterion::Generalized)),
        Tuning::FromData(_) => Ok(Choice::FromData(Criterion::LeaveOneOut)),
        Tuning::Fixed(values) => Ok(Choice::Fixed(single(method, values)?)),
    }
}

/// The parameter as a choice of a count.
pub(super) fn count(method: &NamedEstimator) -> Result<Choice<usize>> {
    match number(method)? {
        Choice::FromData(criterion) => Ok(Choice::FromData(criterion)),
        Choice::Fixed(value) if value >= 0.0 && value.fract() == 0.0 && value < 1e15 => {
            Ok(Choice::Fixed(value as usize))
        }
        Choice::Fixed(value) => Err(Error::parameter(
            format!("the parameter '{}'", method.name.parameter()),
            value,
            "a whole number from 0 to 1e15",
        )),
    }
}

/// How an estimator's fit shows its parameter in the common form.
pub(super) struct Shown<F, P> {
    /// The parameter of a fit.
    pub value: fn(&F) -> f64,
    /// The search of a fit.
    pub search: fn(&F) -> Option<&Search<P>>,
    /// A candidate of that search as the user knows it.
    pub candidate: fn(P) -> f64,
}

/// Fits `make(choice)` with the choice that the method asks for.
pub(super) fn tuned<E, P>(
    method: &NamedEstimator,
    Observations { x, y, weights }: Observations,
    choice: Choice<P>,
    make: impl Fn(Choice<P>) -> E + Sync,
    shown: &Shown<E::Fit, P>,
) -> Result<NamedFit>
where
    E: Estimator,
    P: Copy + PartialEq + Send + Sync,
{
    let fit = make(choice).fit(x, y, weights)?;
    let search = (shown.search)(&fit);
    if method.tuning != Tuning::FromData(Rule::Block) {
        let scores = search.map(|s| Scores {
            criterion: criterion_name(s.criterion),
            parameter: s.curve.iter().map(|c| (shown.candidate)(c.parameter)).collect(),
            score: s.curve.iter().map(|c| c.score(s.criterion)).collect(),
            at_edge: s.at_edge,
            binning_error: None,
        });
        let left_out = search.and_then(chosen).map(|c| c.leave_one_out);
        return Ok(named(method, (shown.value)(&fit), fit, scores, left_out));
    }
    let candidates = search.map_or_else(Vec::new, Search::for_refits);
    let folds = BlockFolds::for_data(x[0], y)?;
    let found = folds.choose(&candidates, |p| make(Choice::Fixed(p)), x, y, weights)?;
    let scores = Scores {
        criterion: BLOCK_CRITERION,
        parameter: candidates.iter().map(|&p| (shown.candidate)(p)).collect(),
        score: found.curve.iter().map(|c| c.error).collect(),
        at_edge: found.at_edge,
        binning_error: None,
    };
    let fit = make(Choice::Fixed(found.parameter)).fit(x, y, weights)?;
    Ok(named(method, (shown.value)(&fit), fit, Some(scores), None))
}

fn chosen<P: Copy + PartialEq>(search: &Search<P>) -> Option<ScoredParameter<P>> {
    search.curve.iter().find(|c| c.parameter == search.parameter).copied()
}

pub(super) fn named(
    method: &NamedEstimator,
    value: f64,
    fit: impl super::Regression + 'static,
    scores: Option<Scores>,
    left_out: Option<f64>,
) -> NamedFit {
    NamedFit {
        name: method.name,
        regression: Box::new(fit),
        parameter: vec![value],
        scores,
        left_out,
        local: None,
    }
}

/// The name of the score of [`Rule::Block`], for all estimators that are refitted.
pub(super) const BLOCK_CRITERION: &str = "cross-validation error over blocks of rows";

pub(super) fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::LeaveOneOut => "leave-one-out error",
        Criterion::Generalized => "generalised cross-validation score",
    }
}
