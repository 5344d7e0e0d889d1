//! Flexure itself.

use flexure::Record;
use flexure::identify::RefinedHammerstein;
use flexure::nonlinearity::{
    Bandwidth, Basis, Choice, Degree, Estimator, EstimatorName, HaarRegression, Kernel, KernelEstimator,
    KernelRegression, LocalKernel, NamedEstimator, NearestNeighbours, NetworkRegression, Outside, PolynomialRegression,
    Regression, Rule, SeriesRegression, SplineRegression, Tuning,
};
use flexure::selection::{BandwidthRule, Criterion, LeaveOneOut, choose_bandwidth};

use crate::job::{Call, Data, Job, Outcome, Result};

pub fn call(job: &Job) -> Result<Call> {
    let outside = Outside::Nearest;
    let dimension: usize = job.number("dimension")?;
    match job.text("task")? {
        "kernel" if dimension > 1 => Ok(estimates(product(job)?)),
        "kernel" => {
            let (degree, kernel) = (degree(job)?, kernel(job)?);
            let method = KernelRegression {
                kernel,
                bandwidth: job.number("h")?,
            };
            Ok(Box::new(move |data: &Data| {
                let fit = method.fit(&data.x[0], &data.y)?.with_degree(degree);
                Ok(fit.predict(&data.at[0]).into())
            }))
        }
        "leave-one-out" => {
            let method = product(job)?;
            Ok(Box::new(move |data: &Data| {
                let score = method.score(Criterion::LeaveOneOut, &data.columns(), &data.y, None)?;
                Ok(vec![score].into())
            }))
        }
        "scores" => {
            let degree = degree(job)?;
            let bandwidths = log_spaced(0.02, 1.0, job.number("candidates")?);
            Ok(Box::new(move |data: &Data| {
                let (x, y) = (&data.x[0], &data.y);
                let search = LeaveOneOut {
                    degree,
                    ..Default::default()
                };
                let scores = search.exact_scores(x, y, None, &bandwidths)?;
                Ok(scores.iter().map(|s| s.error).collect::<Vec<f64>>().into())
            }))
        }
        "bandwidth" if dimension > 1 => {
            let method = KernelEstimator {
                degree: degree(job)?,
                ..Default::default()
            };
            Ok(chosen(method, |fit| {
                let each: Vec<String> = fit.bandwidths().iter().map(|h| format!("{h:.4}")).collect();
                format!("h={}", each.join(","))
            }))
        }
        "bandwidth" => {
            let (degree, name) = (degree(job)?, job.text("rule")?);
            let rule = BandwidthRule::from_name(name).ok_or(format!("no rule {name}"))?;
            Ok(Box::new(move |data: &Data| choose_and_evaluate(rule, degree, data)))
        }
        "local-bandwidths" => {
            let method = LocalKernel {
                outside,
                ..Default::default()
            };
            Ok(chosen(method, |fit| match fit.threshold() {
                Some(_) => format!("local, {} jumps", fit.jumps().len()),
                None => format!("h={:.4}", fit.global().bandwidth),
            }))
        }
        "neighbours" => {
            let neighbours = Choice::Fixed(job.number("k")?);
            Ok(estimates(NearestNeighbours { neighbours, outside }))
        }
        "neighbours-chosen" => {
            let method = NearestNeighbours {
                outside,
                ..Default::default()
            };
            Ok(chosen(method, |fit| format!("k={}", fit.neighbours())))
        }
        "polynomial" => {
            let degree = Choice::Fixed(job.number("degree")?);
            Ok(estimates(PolynomialRegression { degree, outside }))
        }
        "series-chosen" => {
            let basis = basis(job.text("basis")?)?;
            let method = SeriesRegression {
                basis,
                outside,
                ..Default::default()
            };
            Ok(chosen(method, |fit| format!("terms={}", fit.terms())))
        }
        "haar" => {
            let levels = Choice::Fixed(job.number("levels")?);
            Ok(estimates(HaarRegression { levels, outside }))
        }
        "spline-chosen" => {
            let method = SplineRegression {
                penalty: Choice::FromData(Criterion::Generalized),
                outside,
                ..Default::default()
            };
            Ok(chosen(method, |fit| format!("lambda={:.3e}", fit.penalty())))
        }
        "network" => {
            let units = Choice::Fixed(job.number("units")?);
            Ok(estimates(NetworkRegression {
                units,
                outside,
                ..Default::default()
            }))
        }
        "regressor" => {
            let method = NamedEstimator {
                name: EstimatorName::LocalLinear,
                tuning: match job.number("h") {
                    Ok(h) => Tuning::Fixed(vec![h]),
                    Err(_) => Tuning::FromData(Rule::LeaveOneOut),
                },
                outside,
                ..Default::default()
            };
            Ok(Box::new(move |data: &Data| {
                let fit = method.fit(&data.columns(), &data.y, None)?;
                Ok(fit.regression.predict(&data.points())?.into())
            }))
        }
        "hammerstein" => Ok(Box::new(|data: &Data| {
            let record = Record::new([("u", data.x[0].clone()), ("y", data.y.clone())])?;
            Ok(RefinedHammerstein::default().identify(&record, "u", "y")?.predicted.into())
        })),
        other => Err(format!("no task {other}").into()),
    }
}

fn choose_and_evaluate(rule: BandwidthRule, degree: Degree, data: &Data) -> Result<Outcome> {
    let (x, y, kernel) = (&data.x[0], &data.y, Kernel::Epanechnikov);
    let bandwidth = choose_bandwidth(rule, kernel, degree, x, y, None)?.bandwidth();
    Ok(Outcome {
        estimates: KernelRegression { kernel, bandwidth }
            .fit(x, y)?
            .with_degree(degree)
            .predict(&data.at[0]),
        chosen: Some(format!("h={bandwidth:.4}")),
    })
}

/// The estimates of a method that chooses no parameter.
fn estimates<E: Estimator + Clone + 'static>(method: E) -> Call {
    Box::new(move |data| {
        Ok(method
            .clone()
            .fit(&data.columns(), &data.y, None)?
            .predict(&data.points())?
            .into())
    })
}

/// The estimates of a method that chooses a parameter, and the chosen value.
fn chosen<E: Estimator + Clone + 'static>(method: E, choice: fn(&E::Fit) -> String) -> Call {
    Box::new(move |data| {
        let fit = method.clone().fit(&data.columns(), &data.y, None)?;
        Ok(Outcome {
            estimates: fit.predict(&data.points())?,
            chosen: Some(choice(&fit)),
        })
    })
}

/// `count` bandwidths from `low` to `high`, evenly spaced in their logarithm.
fn log_spaced(low: f64, high: f64, count: usize) -> Vec<f64> {
    let step = (high / low).ln() / count.saturating_sub(1).max(1) as f64;
    (0..count).map(|i| low * (step * i as f64).exp()).collect()
}

/// The product kernel with one bandwidth for all columns.
fn product(job: &Job) -> Result<KernelEstimator> {
    Ok(KernelEstimator {
        kernel: kernel(job)?,
        degree: degree(job)?,
        bandwidth: Bandwidth::Fixed(vec![job.number("h")?]),
        ..Default::default()
    })
}

fn degree(job: &Job) -> Result<Degree> {
    match job.text("degree")? {
        "0" => Ok(Degree::Constant),
        "1" => Ok(Degree::Linear),
        other => Err(format!("degree={other} is neither 0 nor 1").into()),
    }
}

fn kernel(job: &Job) -> Result<Kernel> {
    let name = job.text("kernel")?;
    let known = Kernel::ALL.into_iter().find(|k| k.name() == name);
    Ok(known.ok_or(format!("no kernel {name}"))?)
}

fn basis(name: &str) -> Result<Basis> {
    let known = Basis::ALL.into_iter().find(|b| b.name() == name);
    Ok(known.ok_or(format!("no basis {name}"))?)
}
