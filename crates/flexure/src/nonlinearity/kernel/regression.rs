//! The kernel estimate (13), of a system's nonlinearity (21), with a given bandwidth: fit, evaluation and standard errors.

use super::sorted::Increasing;
use super::{Degree, Kernel, Sorted, Sums, for_each_sum};
use crate::error::{Error, Result};
use crate::record::check_values;

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
    /// Sorts the points and keeps them. Every evaluation then costs O(1), after a sort of the points of evaluation.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a bandwidth that is not positive and finite,
    /// [`Error::Data`]: `LengthMismatch`, `NonFinite`, and `TooShort` without any point.
    pub fn fit(self, x: &[f64], y: &[f64]) -> Result<KernelFit> {
        check_points(x, y, 1)?;
        self.fit_sorted(Sorted::new(x, y, None))
    }

    /// [`fit`](Self::fit) with weights of the observations, as of least squares: an observation of weight 2 counts as two observations, and
    /// one of weight 0 does not count.
    ///
    /// # Errors
    /// Those of `fit`, [`Error::Parameter`] for a negative weight, and [`Error::Data`]: `TooShort` without any
    /// point of positive weight.
    pub fn fit_weighted(self, x: &[f64], y: &[f64], weights: &[f64]) -> Result<KernelFit> {
        check_points(x, y, 1)?;
        check_weights(weights, x.len(), 1)?;
        self.fit_sorted(Sorted::new(x, y, Some(weights)))
    }

    pub(crate) fn fit_sorted(self, data: Sorted) -> Result<KernelFit> {
        self.check()?;
        Ok(KernelFit {
            method: self,
            degree: Degree::Constant,
            data,
        })
    }

    pub(super) fn check(self) -> Result<()> {
        if !(self.bandwidth > 0.0 && self.bandwidth.is_finite()) {
            return Err(Error::parameter("the bandwidth", self.bandwidth, "positive and finite"));
        }
        Ok(())
    }
}

/// Checks weights for `points` points: they are finite and not negative, and at least `need` are positive.
pub(crate) fn check_weights(weights: &[f64], points: usize, need: usize) -> Result<()> {
    if weights.len() != points {
        return Err(Error::length("weights", weights.len(), points));
    }
    if let Some(sample) = weights.iter().position(|w| !(*w >= 0.0 && w.is_finite())) {
        return Err(Error::parameter(
            format!("the weight of sample {sample}"),
            weights[sample],
            "zero or positive, and finite",
        ));
    }
    check_values("weights", weights)?;
    let positive = weights.iter().filter(|w| **w > 0.0).count();
    if positive < need {
        return Err(Error::too_short(
            "a kernel regression (counting samples of positive weight)",
            need,
            positive,
        ));
    }
    Ok(())
}

/// Checks that the points are finite and that there are at least `need`.
pub(crate) fn check_points(x: &[f64], y: &[f64], need: usize) -> Result<()> {
    if x.len() != y.len() {
        return Err(Error::length("y", y.len(), x.len()));
    }
    if x.len() < need {
        return Err(Error::too_short("a kernel regression", need, x.len()));
    }
    check_values("x", x)?;
    check_values("y", y)?;
    Ok(())
}

/// A fitted kernel regression.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelFit {
    method: KernelRegression,
    degree: Degree,
    data: Sorted,
}

impl KernelFit {
    /// The same data with a polynomial of another degree fitted around every point: a constant unless this
    /// is called.
    ///
    /// The local line (Fan 1993) falls back to the local constant where the points in reach do not determine a line. That is so if the
    /// standard deviation of their abscissas, weighted by the kernel, is below 1e-9 bandwidths.
    #[must_use]
    pub fn with_degree(mut self, degree: Degree) -> Self {
        self.degree = degree;
        self
    }

    /// The degree of the polynomial that is fitted around every point.
    pub fn degree(&self) -> Degree {
        self.degree
    }

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
        let Increasing { order, values: at } = Increasing::new(x);
        let mut estimates = vec![f64::NAN; x.len()];
        self.for_each(&at, |j, sums| {
            estimates[order[j]] = sums.fit(self.degree).map_or(f64::NAN, |fit| self.data.mean + fit.value);
        });
        estimates
    }

    /// Pointwise standard errors of the estimate at the increasing points `at`, allowing for noise
    /// whose variance depends on x: sum K^2 r^2 / (sum K)^2 with the residuals r. They measure the
    /// variance alone, not the smoothing bias. NaN where no data are within reach.
    pub fn standard_errors(&self, at: &[f64]) -> Vec<f64> {
        let KernelRegression { kernel, bandwidth: h } = self.method;
        let mut squares = vec![None; self.data.len()];
        self.for_each(&self.data.x, |i, sums| {
            // A point's own share in its fit makes its residual too small. So the residual from the fit without the point is taken.
            let residual = sums.residual_without(self.degree, self.data.y[i], self.data.weight(i));
            squares[i] = residual.map(|r| r * r);
        });
        // A point alone in its window says nothing about the noise. The mean over the others takes its place.
        let known: Vec<f64> = squares.iter().copied().flatten().filter(|s| s.is_finite()).collect();
        let typical = known.iter().sum::<f64>() / known.len().max(1) as f64;
        let squares: Vec<f64> = squares.into_iter().map(|s| s.unwrap_or(typical)).collect();
        at.iter()
            .map(|&q| {
                let sums = self.data.direct_sums(kernel, self.degree, h, q, None);
                let range = self.data.within(q, kernel.reach() * h);
                let variance: f64 = range
                    .map(|i| {
                        let x = self.data.x[i];
                        let k = self.data.weight(i) * kernel.weight((q - x) / h);
                        (k * sums.share(self.degree, (x - q) / h)).powi(2) * squares[i]
                    })
                    .sum();
                if sums.s[0] > 0.0 { variance.sqrt() } else { f64::NAN }
            })
            .collect()
    }

    fn for_each(&self, at: &[f64], visit: impl FnMut(usize, Sums)) {
        for_each_sum(
            &self.data,
            self.method.kernel,
            self.degree,
            self.method.bandwidth,
            at,
            visit,
        );
    }
}

/// The centred estimate at point `i` from the others, by direct summation.
#[cold]
#[inline(never)]
pub(super) fn direct_without(data: &Sorted, kernel: Kernel, degree: Degree, h: f64, i: usize) -> f64 {
    let others = data.direct_sums(kernel, degree, h, data.x[i], Some(i));
    others
        .fit(degree)
        .map_or_else(|| data.nearest(data.x[i], Some(i)), |fit| fit.value)
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
