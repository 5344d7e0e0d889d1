//! Flexure itself.

use flexure::nonlinearity::{
    Basis, Choice, Degree, Estimator, HaarRegression, Kernel, KernelRegression, NearestNeighbours, Outside,
    PolynomialRegression, Regression, SeriesRegression, SplineRegression,
};
use flexure::selection::{BandwidthSearch, Criterion};

use crate::job::{Call, Data, Job, Outcome, Result};

pub fn call(job: &Job) -> Result<Call> {
    let outside = Outside::Nearest;
    match job.text("task")? {
        "kernel" => {
            let (degree, kernel) = (degree(job)?, kernel(job)?);
            let method = KernelRegression {
                kernel,
                bandwidth: job.number("h")?,
            };
            Ok(Box::new(move |data: &Data| {
                Ok(method.evaluate(degree, &data.x[0], &data.y, None, &data.at[0])?.into())
            }))
        }
        "bandwidth" => {
            let degree = degree(job)?;
            Ok(Box::new(move |data: &Data| search_and_evaluate(degree, data)))
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
        other => Err(format!("no task {other}").into()),
    }
}

fn search_and_evaluate(degree: Degree, data: &Data) -> Result<Outcome> {
    let (x, y, kernel) = (&data.x[0], &data.y, Kernel::Epanechnikov);
    let bandwidth = BandwidthSearch::search(kernel, degree, x, y, None)?.bandwidth;
    Ok(Outcome {
        estimates: KernelRegression { kernel, bandwidth }.evaluate(degree, x, y, None, &data.at[0])?,
        chosen: Some(format!("h={bandwidth:.4}")),
    })
}

/// The estimates of a method without a choice.
fn estimates<E: Estimator + Clone + 'static>(method: E) -> Call {
    Box::new(move |data| {
        Ok(method
            .clone()
            .fit(&data.columns(), &data.y, None)?
            .predict(&data.points())?
            .into())
    })
}

/// The estimates of a method that chooses, and what it chose.
fn chosen<E: Estimator + Clone + 'static>(method: E, choice: fn(&E::Fit) -> String) -> Call {
    Box::new(move |data| {
        let fit = method.clone().fit(&data.columns(), &data.y, None)?;
        Ok(Outcome {
            estimates: fit.predict(&data.points())?,
            chosen: Some(choice(&fit)),
        })
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
