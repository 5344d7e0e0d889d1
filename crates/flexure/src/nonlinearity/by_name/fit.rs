//! From a name to a fit: each estimator's own parameters and results in the common form.

use super::recursive::RecursiveFit;
use super::{EstimatorName, NamedEstimator, NamedFit, Scores, Tuning};
use crate::error::{Error, Result};
use crate::nonlinearity::estimator::{Choice, Estimator, Points};
use crate::nonlinearity::kernel::{Degree, Sorted, check_points, check_weights, leave_one_out};
use crate::nonlinearity::{
    Basis, HaarRegression, KernelRegression, NearestNeighbours, PolynomialRegression, SeriesRegression,
    SplineRegression,
};
use crate::selection::{BandwidthSearch, Candidate, Criterion, Search};

type Data<'a> = (&'a [&'a [f64]], &'a [f64], Option<&'a [f64]>);

pub(super) fn fit(method: &NamedEstimator, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<NamedFit> {
    let data = (x, y, weights);
    match method.name {
        EstimatorName::Kernel => kernel(method, Degree::Constant, data),
        EstimatorName::LocalLinear => kernel(method, Degree::Linear, data),
        EstimatorName::Recursive => recursive(method, data),
        EstimatorName::Neighbours => neighbours(method, data),
        EstimatorName::Fourier => series(method, Basis::Fourier, data),
        EstimatorName::Cosine => series(method, Basis::Cosine, data),
        EstimatorName::Legendre => series(method, Basis::Legendre, data),
        EstimatorName::Hermite => series(method, Basis::Hermite, data),
        EstimatorName::Haar => haar(method, data),
        EstimatorName::Polynomial => polynomial(method, data),
        EstimatorName::Spline => spline(method, data),
    }
}

/// The one value that was given for a parameter.
fn single(method: &NamedEstimator, values: &[f64]) -> Result<f64> {
    match values {
        [value] => Ok(*value),
        _ => Err(Error::LengthMismatch {
            name: method.name.parameter().to_owned(),
            got: values.len(),
            expected: 1,
        }),
    }
}

/// The parameter as a choice of a number.
fn number(method: &NamedEstimator) -> Result<Choice<f64>> {
    match &method.tuning {
        Tuning::FromData(criterion) => Ok(Choice::FromData(*criterion)),
        Tuning::Fixed(values) => Ok(Choice::Fixed(single(method, values)?)),
    }
}

/// The parameter as a choice of a count.
fn count(method: &NamedEstimator) -> Result<Choice<usize>> {
    match number(method)? {
        Choice::FromData(criterion) => Ok(Choice::FromData(criterion)),
        Choice::Fixed(value) if value >= 0.0 && value.fract() == 0.0 && value < 1e15 => {
            Ok(Choice::Fixed(value as usize))
        }
        Choice::Fixed(value) => Err(Error::InvalidParameter {
            name: format!("the parameter '{}'", method.name.parameter()),
            value,
            requirement: "a whole number from 0",
        }),
    }
}

fn kernel(method: &NamedEstimator, degree: Degree, (x, y, weights): Data) -> Result<NamedFit> {
    let [x] = x else {
        return Err(Error::ColumnCount {
            what: "a kernel regression",
            got: x.len(),
            expected: "1 column".to_owned(),
        });
    };
    let choice = number(method)?;
    let need = if let Choice::Fixed(_) = choice { 1 } else { 3 };
    check_points(x, y, need)?;
    let data = match weights {
        None => Sorted::new(x, y),
        Some(weights) => {
            check_weights(weights, x.len(), need)?;
            Sorted::weighted(x, y, weights)
        }
    };
    let search = match choice {
        Choice::Fixed(_) => None,
        Choice::FromData(_) => Some(BandwidthSearch::with_degree(method.kernel, degree, &data)),
    };
    let bandwidth = match (choice, &search) {
        (Choice::Fixed(bandwidth), _) => bandwidth,
        (_, search) => search.as_ref().map_or(f64::NAN, |s| s.bandwidth),
    };
    let estimator = KernelRegression {
        kernel: method.kernel,
        bandwidth,
    };
    let fit = estimator.fit_sorted(data)?.with_degree(degree);
    let left_out = match &search {
        Some(s) => s.curve.iter().find(|c| c.bandwidth == bandwidth).map(|c| c.error),
        None => Some(leave_one_out(fit.data(), method.kernel, degree, bandwidth)),
    };
    Ok(NamedFit {
        name: method.name,
        left_out,
        regression: Box::new(fit),
        parameter: vec![bandwidth],
        scores: search.map(|search| Scores {
            criterion: words(Criterion::LeaveOneOut),
            parameter: search.curve.iter().map(|c| c.bandwidth).collect(),
            score: search.curve.iter().map(|c| c.error).collect(),
            at_edge: search.at_edge,
        }),
    })
}

fn recursive(method: &NamedEstimator, (x, y, weights): Data) -> Result<NamedFit> {
    if weights.is_some() {
        return Err(Error::NoWeights {
            what: "the recursive kernel regression",
        });
    }
    Points::new("a recursive kernel regression", 1, x, y, None)?;
    let bandwidth = match number(method)? {
        Choice::Fixed(bandwidth) => bandwidth,
        Choice::FromData(_) => RecursiveFit::bandwidth(method.kernel, x[0], y)?,
    };
    Ok(NamedFit {
        name: method.name,
        regression: Box::new(RecursiveFit::new(method.kernel, bandwidth, x[0], y, method.outside)?),
        parameter: vec![bandwidth],
        scores: None,
        left_out: None,
    })
}

fn neighbours(method: &NamedEstimator, (x, y, weights): Data) -> Result<NamedFit> {
    let estimator = NearestNeighbours {
        neighbours: count(method)?,
        outside: method.outside,
    };
    let fit = estimator.fit(x, y, weights)?;
    let (value, search) = (fit.neighbours() as f64, fit.search().cloned());
    Ok(searched(method, Box::new(fit), value, search.as_ref(), |k| k as f64))
}

fn series(method: &NamedEstimator, basis: Basis, (x, y, weights): Data) -> Result<NamedFit> {
    let estimator = SeriesRegression {
        basis,
        terms: count(method)?,
        outside: method.outside,
    };
    let fit = estimator.fit(x, y, weights)?;
    let (value, search) = (fit.terms() as f64, fit.search().cloned());
    Ok(searched(method, Box::new(fit), value, search.as_ref(), |k| k as f64))
}

fn polynomial(method: &NamedEstimator, (x, y, weights): Data) -> Result<NamedFit> {
    let estimator = PolynomialRegression {
        degree: count(method)?,
        outside: method.outside,
    };
    let fit = estimator.fit(x, y, weights)?;
    // A polynomial has one term more than its degree says.
    let degree = |terms: usize| terms as f64 - 1.0;
    let (value, search) = (degree(fit.terms()), fit.search().cloned());
    Ok(searched(method, Box::new(fit), value, search.as_ref(), degree))
}

fn haar(method: &NamedEstimator, (x, y, weights): Data) -> Result<NamedFit> {
    let estimator = HaarRegression {
        levels: count(method)?,
        outside: method.outside,
    };
    let fit = estimator.fit(x, y, weights)?;
    let (value, search) = (fit.levels() as f64, fit.search().cloned());
    Ok(searched(method, Box::new(fit), value, search.as_ref(), |k| k as f64))
}

fn spline(method: &NamedEstimator, (x, y, weights): Data) -> Result<NamedFit> {
    let estimator = SplineRegression {
        penalty: number(method)?,
        outside: method.outside,
        ..SplineRegression::default()
    };
    let fit = estimator.fit(x, y, weights)?;
    let (value, search) = (fit.penalty(), fit.search().cloned());
    Ok(searched(method, Box::new(fit), value, search.as_ref(), |p| p))
}

/// The common form of a fit whose parameter, as the user knows it, is `value`.
fn searched<P: Copy + PartialEq>(
    method: &NamedEstimator,
    regression: Box<dyn super::Regression>,
    value: f64,
    search: Option<&Search<P>>,
    shown: impl Fn(P) -> f64,
) -> NamedFit {
    let chosen =
        |s: &Search<P>| -> Option<Candidate<P>> { s.curve.iter().find(|c| c.parameter == s.parameter).copied() };
    NamedFit {
        name: method.name,
        regression,
        parameter: vec![value],
        left_out: search.and_then(chosen).map(|c| c.leave_one_out),
        scores: search.map(|s| Scores {
            criterion: words(s.criterion),
            parameter: s.curve.iter().map(|c| shown(c.parameter)).collect(),
            score: s.curve.iter().map(|c| c.score(s.criterion)).collect(),
            at_edge: s.at_edge,
        }),
    }
}

fn words(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::LeaveOneOut => "leave-one-out error",
        Criterion::Generalized => "generalised cross-validation",
    }
}
