//! Fitting and evaluating the kernel estimate (13), and its exact leave-one-out score.

use super::{Kernel, Sorted, Sums, for_each_sum};
use crate::error::{Error, Result};

/// The kernel regression estimate (13) with a given bandwidth.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `kernel` | the weight function | | Epanechnikov |
/// | `bandwidth` | half width of the window (Gaussian: standard deviation), in units of x | positive, finite | none: see [`crate::selection`] |
///
/// ```
/// use flexure::nonlinearity::{Kernel, KernelRegression};
/// let x: Vec<f64> = (0..200).map(|i| i as f64 / 100.0 - 1.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x * x).collect();
/// let fit = KernelRegression { kernel: Kernel::Epanechnikov, bandwidth: 0.1 }.fit(&x, &y)?;
/// assert!((fit.value(0.5) - 0.25).abs() < 0.01);
/// assert!(fit.value(3.0).is_nan()); // no data within reach
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelRegression {
    /// The weight function.
    pub kernel: Kernel,
    /// The bandwidth h, in the unit of x.
    pub bandwidth: f64,
}

impl KernelRegression {
    /// Keeps the sorted points; every evaluation then costs O(1) after a sort of the query points.
    ///
    /// # Errors
    /// [`Error::InvalidParameter`] for a bandwidth that is not positive and finite,
    /// [`Error::LengthMismatch`], [`Error::NonFinite`], and [`Error::TooShort`] without any point.
    pub fn fit(self, x: &[f64], y: &[f64]) -> Result<KernelFit> {
        check_points(x, y, 1)?;
        self.fit_sorted(Sorted::new(x, y))
    }

    pub(crate) fn fit_sorted(self, data: Sorted) -> Result<KernelFit> {
        if !(self.bandwidth > 0.0 && self.bandwidth.is_finite()) {
            return Err(Error::InvalidParameter {
                name: "the bandwidth".to_owned(),
                value: self.bandwidth,
                requirement: "positive and finite",
            });
        }
        Ok(KernelFit { method: self, data })
    }
}

/// Finite points, at least `need` of them.
pub(crate) fn check_points(x: &[f64], y: &[f64], need: usize) -> Result<()> {
    if x.len() != y.len() {
        return Err(Error::LengthMismatch {
            name: "y".to_owned(),
            got: y.len(),
            expected: x.len(),
        });
    }
    if x.len() < need {
        return Err(Error::TooShort {
            what: "a kernel regression",
            need,
            got: x.len(),
        });
    }
    for (column, values) in [("x", x), ("y", y)] {
        if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::NonFinite {
                column: column.to_owned(),
                sample,
                value: values[sample],
            });
        }
    }
    Ok(())
}

/// A fitted kernel regression.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelFit {
    method: KernelRegression,
    data: Sorted,
}

impl KernelFit {
    /// The kernel and the bandwidth.
    pub fn method(&self) -> KernelRegression {
        self.method
    }

    pub(crate) fn data(&self) -> &Sorted {
        &self.data
    }

    /// The estimate at `x`: NaN where no data are within reach.
    pub fn value(&self, x: f64) -> f64 {
        self.predict(&[x])[0]
    }

    /// The estimates at `x`, in any order: NaN where no data are within reach, and for NaN.
    pub fn predict(&self, x: &[f64]) -> Vec<f64> {
        let mut order: Vec<usize> = (0..x.len()).filter(|&i| x[i].is_finite()).collect();
        order.sort_unstable_by(|&i, &j| x[i].total_cmp(&x[j]));
        let at: Vec<f64> = order.iter().map(|&i| x[i]).collect();
        let mut estimates = vec![f64::NAN; x.len()];
        self.for_each(&at, |j, sums| {
            estimates[order[j]] = self.data.mean + sums.moment / sums.weight;
        });
        estimates
    }

    /// Pointwise standard errors of the estimate at the increasing points `at`, allowing for noise
    /// whose variance depends on x: sum K^2 r^2 / (sum K)^2 with the residuals r. They measure the
    /// variance alone, not the smoothing bias. NaN where no data are within reach.
    pub fn standard_errors(&self, at: &[f64]) -> Vec<f64> {
        let KernelRegression { kernel, bandwidth: h } = self.method;
        let mut squares = vec![0.0; self.data.len()];
        self.for_each(&self.data.x, |i, sums| {
            // A point's own share in its fit makes its residual too small; divide that out.
            let rest = (sums.weight - 1.0).max(f64::MIN_POSITIVE) / sums.weight;
            let residual = (self.data.y[i] - sums.moment / sums.weight) / rest;
            squares[i] = if residual.is_finite() { residual * residual } else { 0.0 };
        });
        at.iter()
            .map(|&q| {
                let (mut weight, mut variance) = (0.0, 0.0);
                for i in self.data.within(q, kernel.reach() * h) {
                    let k = kernel.weight((q - self.data.x[i]) / h);
                    weight += k;
                    variance += k * k * squares[i];
                }
                variance.sqrt() / weight
            })
            .collect()
    }

    fn for_each(&self, at: &[f64], visit: impl FnMut(usize, Sums)) {
        for_each_sum(&self.data, self.method.kernel, self.method.bandwidth, at, visit);
    }
}

/// The exact leave-one-out score (1/n) sum_i (Y_i - m_{n,-i}(X_i))^2 for one bandwidth.
///
/// A point without any other in reach is predicted by its nearest neighbours.
pub(crate) fn leave_one_out(data: &Sorted, kernel: Kernel, h: f64) -> f64 {
    let mut total = 0.0;
    for_each_sum(data, kernel, h, &data.x, |i, sums| {
        let y = data.y[i];
        // K(0) = 1 is the point's own weight: y - m_{-i} = (y sum K - sum K y) / (sum K - 1).
        let rest = sums.weight - 1.0;
        let residual = if rest > super::DIRECT_BELOW * sums.count as f64 {
            (y * sums.weight - sums.moment) / rest
        } else {
            let others = data.direct_sums(kernel, h, data.x[i], Some(i));
            if others.weight > 0.0 {
                y - others.moment / others.weight
            } else {
                y - data.nearest(data.x[i], Some(i))
            }
        };
        total += residual * residual;
    });
    total / data.len() as f64
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
