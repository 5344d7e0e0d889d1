//! One Monte Carlo run: a sample, an estimate from it, and the estimate's error.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::super::sample::draw;
use super::setting::{ErrorNorm, EstimatorSetting, Method};
use crate::error::{Error, ParameterError, Result};
use crate::nonlinearity::{
    Bandwidth, Choice, Decay, Degree, Estimator, HaarRegression, Kernel, KernelEstimator, LocalKernel, LocalRule,
    NearestNeighbours, NetworkRegression, Outside, PolynomialRegression, RecursiveForm, RecursiveKernel, Regression,
    SeriesRegression, SplineRegression,
};

/// Fresh inputs over which an L2 error is averaged.
const FRESH: usize = 2000;
/// The number of knots of the spline. Their distance is less than its bandwidth.
const KNOTS: usize = 1000;
/// Beyond the outermost data, the estimate at the nearest of them is taken.
const OUTSIDE: Outside = Outside::Nearest;

/// The mean squared error over the norm's points. `None` if the estimator has no estimate for these data.
pub(super) fn squared_error(setting: &EstimatorSetting, n: usize, seed: u64) -> Result<Option<f64>> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut columns = |n| -> Vec<Vec<f64>> {
        let draw = |_| draw(setting.input, n, &mut rng);
        (0..setting.columns).map(draw).collect()
    };
    let x = columns(n);
    let queries = match setting.norm {
        ErrorNorm::At(q) => vec![vec![q]; setting.columns],
        ErrorNorm::OverInputs => columns(FRESH),
    };
    let m = |columns: &[Vec<f64>]| -> Vec<f64> {
        let point = |i: usize| columns.iter().map(|c| c[i]).collect::<Vec<_>>();
        (0..columns[0].len())
            .map(|i| setting.regressand.value(&point(i)))
            .collect()
    };
    let mut y = m(&x);
    for y in &mut y {
        let e: f64 = StandardNormal.sample(&mut rng);
        *y += setting.noise * e;
    }
    let estimates = match estimate(setting, &x, &y, &queries) {
        Ok(estimates) => estimates,
        Err(Error::Parameter(ParameterError::BeyondData { .. })) => return Ok(None),
        Err(error) => return Err(error),
    };
    let errors = estimates.iter().zip(m(&queries)).map(|(g, m)| (g - m).powi(2));
    let mean = errors.sum::<f64>() / estimates.len() as f64;
    Ok(mean.is_finite().then_some(mean))
}

/// The estimates at the queries, with the parameter from the schedule.
fn estimate(setting: &EstimatorSetting, x: &[Vec<f64>], y: &[f64], queries: &[Vec<f64>]) -> Result<Vec<f64>> {
    let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    let queries: Vec<&[f64]> = queries.iter().map(Vec::as_slice).collect();
    match setting.method {
        Method::WolvertonWagner => recursive(setting, RecursiveForm::WolvertonWagner, &x, y, &queries),
        Method::DevroyeWagner => recursive(setting, RecursiveForm::DevroyeWagner, &x, y, &queries),
        _ => fitted(setting, &x, y)?.predict(&queries),
    }
}

/// The estimates of a recursive estimator, which are updated point by point.
fn recursive(
    setting: &EstimatorSetting,
    form: RecursiveForm,
    x: &[&[f64]],
    y: &[f64],
    queries: &[&[f64]],
) -> Result<Vec<f64>> {
    let method = RecursiveKernel {
        kernel: Kernel::default(),
        form,
        bandwidth: setting.schedule.constant,
        exponent: -setting.schedule.exponent,
    };
    let mut sums = method.start_in_columns(0, queries, &vec![1.0; x.len()])?;
    for (i, y) in y.iter().enumerate() {
        let point: Vec<f64> = x.iter().map(|column| column[i]).collect();
        sums.push_point(&point, *y)?;
    }
    Ok(sums.finish())
}

/// The fit of any other estimator.
fn fitted(setting: &EstimatorSetting, x: &[&[f64]], y: &[f64]) -> Result<Box<dyn Regression>> {
    let (kernel, outside) = (Kernel::default(), OUTSIDE);
    let parameter = setting.schedule.at(y.len());
    let whole = Choice::Fixed(parameter.round().max(1.0) as usize);
    let half = (0.5 * (parameter - 1.0)).round().max(0.0) as usize;
    let by_kernel = |degree| {
        let bandwidth = Bandwidth::Fixed(vec![parameter]);
        let method = KernelEstimator {
            kernel,
            degree,
            bandwidth,
            outside,
        };
        method.fit_boxed(x, y, None)
    };
    let local = |rule| LocalKernel { kernel, rule, outside }.fit_boxed(x, y, None);
    let series = |basis| {
        let terms = Choice::Fixed(2 * half + 1);
        SeriesRegression { basis, terms, outside }.fit_boxed(x, y, None)
    };
    match setting.method {
        Method::KernelConstant | Method::WolvertonWagner | Method::DevroyeWagner => by_kernel(Degree::Constant),
        Method::KernelLinear => by_kernel(Degree::Linear),
        Method::LocalLepski => local(LocalRule::Lepski),
        Method::LocalPlugIn => local(LocalRule::PlugIn),
        Method::Neighbours => NearestNeighbours {
            neighbours: whole,
            outside,
        }
        .fit_boxed(x, y, None),
        Method::Series(basis) => series(basis),
        Method::Haar => {
            let levels = Choice::Fixed(parameter.log2().round().max(0.0) as usize);
            HaarRegression { levels, outside }.fit_boxed(x, y, None)
        }
        Method::Polynomial => {
            let degree = Choice::Fixed(2 * half);
            PolynomialRegression { degree, outside }.fit_boxed(x, y, None)
        }
        Method::Spline => SplineRegression {
            penalty: Choice::Fixed(0.5 * y.len() as f64 * parameter.powi(4)),
            knots: KNOTS,
            outside,
        }
        .fit_boxed(x, y, None),
        Method::Network => NetworkRegression {
            units: whole,
            decay: Decay::Evidence,
            outside,
            ..Default::default()
        }
        .fit_boxed(x, y, None),
    }
}
