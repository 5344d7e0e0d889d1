//! Kernel estimates in one variable beyond the data and in gaps.

use super::{Degree, Kernel, KernelFit, KernelRegression, Sums};
use crate::error::Result;
use crate::nonlinearity::Outside;
use crate::nonlinearity::estimator::Checked;

/// An estimate in one variable that does not exist everywhere.
pub(super) trait PartialEstimate {
    /// The data's abscissas, increasing.
    fn abscissas(&self) -> &[f64];

    /// The estimates at `x`, in any order; NaN where no data are in reach.
    fn known(&self, x: &[f64]) -> Vec<f64>;

    /// The slope with which the estimate continues from the end `q`; zero where it is not determined.
    fn slope(&self, q: f64) -> f64;

    /// Whether there is a place without data in reach between the neighbouring abscissas `a` and `b`.
    fn has_gap(&self, a: f64, b: f64) -> bool;
}

/// The estimates at `x`, in any order; NaN for NaN.
pub(super) fn predict(fit: &impl PartialEstimate, x: &[f64], outside: Outside) -> Vec<f64> {
    let mut estimates = fit.known(x);
    if outside == Outside::Nan {
        return estimates;
    }
    let away: Vec<(usize, Place)> = (0..x.len())
        .filter_map(|i| Some((i, place(fit, x[i], estimates[i].is_nan())?)))
        .collect();
    let ends = away.iter().flat_map(|(_, place)| match *place {
        Place::Beyond(end) => [end, end],
        Place::Gap(a, b) => [a, b],
    });
    let values = fit.known(&ends.collect::<Vec<f64>>());
    for ((i, place), value) in away.into_iter().zip(values.chunks_exact(2)) {
        let q = x[i];
        estimates[i] = match (place, outside) {
            (Place::Beyond(end), Outside::Linear) => value[0] + fit.slope(end) * (q - end),
            (Place::Beyond(_), _) => value[0],
            (Place::Gap(a, b), Outside::Linear) => value[0] + (value[1] - value[0]) * ((q - a) / (b - a)),
            (Place::Gap(a, b), _) => match (q - a).total_cmp(&(b - q)) {
                std::cmp::Ordering::Less => value[0],
                std::cmp::Ordering::Equal => 0.5 * (value[0] + value[1]),
                std::cmp::Ordering::Greater => value[1],
            },
        };
    }
    estimates
}

/// The place of `q` among the data, if the estimate is not to be taken at `q` itself. `empty` says that it does not exist there.
fn place(fit: &impl PartialEstimate, q: f64, empty: bool) -> Option<Place> {
    let x = fit.abscissas();
    let (low, high) = (x[0], x[x.len() - 1]);
    if q.is_nan() {
        return None;
    }
    if q < low || q > high {
        return Some(Place::Beyond(if q < low { low } else { high }));
    }
    let above = x.partition_point(|&x| x <= q);
    let below = x[above - 1];
    if below == q || above == x.len() {
        return None;
    }
    (empty || fit.has_gap(below, x[above])).then_some(Place::Gap(below, x[above]))
}

/// A fit in one variable that can be continued where it has no data.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    fit: KernelFit,
}

/// The abscissas of data between which, or beyond which, a point lies.
enum Place {
    /// Beyond this end of the range.
    Beyond(f64),
    /// Between two neighbouring abscissas.
    Gap(f64, f64),
}

impl Line {
    pub fn new(data: &Checked<'_>, kernel: Kernel, degree: Degree, bandwidth: f64) -> Result<Line> {
        let method = KernelRegression { kernel, bandwidth };
        let fit = match data.w {
            None => method.fit(data.x[0], data.y),
            Some(w) => method.fit_weighted(data.x[0], data.y, w),
        };
        Ok(Line {
            fit: fit?.with_degree(degree),
        })
    }

    pub fn fit(&self) -> &KernelFit {
        &self.fit
    }

    /// The estimates at `x`, in any order; NaN for NaN.
    pub fn predict(&self, x: &[f64], outside: Outside) -> Vec<f64> {
        predict(self, x, outside)
    }
}

impl PartialEstimate for Line {
    fn abscissas(&self) -> &[f64] {
        &self.fit.data().x
    }

    fn known(&self, x: &[f64]) -> Vec<f64> {
        self.fit.predict(x)
    }

    fn has_gap(&self, a: f64, b: f64) -> bool {
        let method = self.fit.method();
        b - a >= 2.0 * method.kernel.reach() * method.bandwidth
    }

    /// The local line's slope at `q`; zero where it is not determined.
    fn slope(&self, q: f64) -> f64 {
        let KernelRegression { kernel, bandwidth: h } = self.fit.method();
        let here = self.fit.data().direct_sums(kernel, Degree::Linear, h, q, None);
        let ahead = Sums {
            at: here.at + 1.0,
            ..here
        };
        let value = |sums: Sums| sums.fit(Degree::Linear).map_or(0.0, |fit| fit.value);
        (value(ahead) - value(here)) / h
    }
}
