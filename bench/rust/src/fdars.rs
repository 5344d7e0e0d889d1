//! The crate fdars-core. Its smoothers sum over all points for every point of evaluation; its bandwidth search
//! builds the n x n smoothing matrix for every candidate, equally spaced over its own range.

use fdars_core::smoothing::{CvCriterion, knn_smoother, local_linear, nadaraya_watson, optim_bandwidth};

use crate::job::{Call, Data, Job, Outcome, Result};

pub fn call(job: &Job) -> Result<Call> {
    match job.text("task")? {
        "kernel" => {
            let (h, kernel) = (job.number("h")?, job.text("kernel")?.to_owned());
            let smoother = match job.number("degree")? {
                0 => nadaraya_watson,
                _ => local_linear,
            };
            Ok(Box::new(move |data: &Data| {
                Ok(smoother(&data.x[0], &data.y, &data.at[0], h, &kernel)?.into())
            }))
        }
        "bandwidth" => {
            let candidates = job.number("candidates")?;
            Ok(Box::new(move |data: &Data| {
                let (x, y) = (&data.x[0], &data.y);
                let h = optim_bandwidth(x, y, None, CvCriterion::Cv, "epanechnikov", candidates).h_opt;
                Ok(Outcome {
                    estimates: nadaraya_watson(x, y, &data.at[0], h, "epanechnikov")?,
                    chosen: Some(format!("h={h:.4}")),
                })
            }))
        }
        "neighbours" => {
            let k = job.number("k")?;
            Ok(Box::new(move |data: &Data| {
                Ok(knn_smoother(&data.x[0], &data.y, &data.at[0], k)?.into())
            }))
        }
        other => Err(format!("fdars-core has no {other}").into()),
    }
}
