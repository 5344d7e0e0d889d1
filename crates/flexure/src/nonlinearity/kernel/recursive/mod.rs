//! The recursive kernel estimate: for streams in one pass, with memory for the evaluation points alone
//! ([`RecursiveKernel`]), and over a record, at any point and with c from the data ([`RecursiveRegression`]).
//!
//! $$ m_n(x) = \frac{\sum_i h_i^{-r} Y_i K((x - X_i)/h_i)}{\sum_i h_i^{-r} K((x - X_i)/h_i)} ,
//!    \qquad h_i = c\,2^{-\gamma \lfloor \log_2 (i + 1) \rfloor}, \; i = 0, 1, \dots $$
//! with r = 1 (after Wolverton & Wagner 1969, Ahmad & Lin 1976) or r = 0 (Devroye & Wagner 1980). An
//! observation's bandwidth depends on its place in the stream alone, so that it is never looked at again and
//! partial sums over parts of the stream add up to those of the whole. It follows c (i + 1)^-gamma from above to
//! within 2^gamma, and stays while the stream doubles: over a record the observations of one bandwidth then make an
//! ordinary kernel sum, at the price of one. The rate is that of (13) (Greblicki & Pawlak 2008, chapter 4, where
//! h_i may be any sequence of that order).

mod levels;
mod regression;

pub use regression::{RecursiveFit, RecursiveRegression};

use super::Kernel;
use crate::error::{Error, Result};

/// How observations with different bandwidths are weighed against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RecursiveForm {
    /// By 1/h_i, as the density estimates of Wolverton & Wagner (1969): all observations count alike.
    #[default]
    WolvertonWagner,
    /// Not at all (Devroye & Wagner 1980): the early, wide windows count for more, which makes the estimate
    /// smoother and more biased.
    DevroyeWagner,
}

/// The recursive kernel estimate.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `kernel` | the weight function | | Epanechnikov |
/// | `form` | the observations' weights | | by 1/h_i |
/// | `bandwidth` | c, the bandwidth of the first observation, in units of x | positive, finite | none |
/// | `exponent` | gamma, how fast the bandwidth shrinks: 1/3 for Lipschitz, 1/5 for smooth m | between 0 and 1 | none |
///
/// ```
/// use flexure::nonlinearity::{Kernel, RecursiveForm, RecursiveKernel};
/// let method = RecursiveKernel {
///     kernel: Kernel::Epanechnikov,
///     form: RecursiveForm::WolvertonWagner,
///     bandwidth: 1.0,
///     exponent: 0.2,
/// };
/// let x = |i: u32| f64::from(i * 37 % 1000) / 1000.0;
/// // Two machines, each with a half of the stream.
/// let mut first = method.start(&[0.25, 0.5])?;
/// let mut second = method.start_from(500, &[0.25, 0.5])?;
/// for i in 0..500 {
///     first.push(x(i), 2.0 * x(i))?;
///     second.push(x(500 + i), 2.0 * x(500 + i))?;
/// }
/// first.merge(&second)?;
/// assert!((first.finish()[1] - 1.0).abs() < 0.05);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecursiveKernel {
    /// The weight function.
    pub kernel: Kernel,
    /// How observations are weighed.
    pub form: RecursiveForm,
    /// c, in the unit of x.
    pub bandwidth: f64,
    /// gamma.
    pub exponent: f64,
}

/// The partial sums over a part of a stream.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveSums {
    method: RecursiveKernel,
    /// The evaluation points in increasing order, and the place of each in the caller's list.
    at: Vec<f64>,
    order: Vec<usize>,
    weight: Vec<f64>,
    moment: Vec<f64>,
    /// The next observation's place in the stream.
    next: u64,
    count: u64,
}

impl RecursiveKernel {
    /// Empty sums at the points `at`, in any order, for the beginning of a stream.
    ///
    /// # Errors
    /// [`Error::InvalidParameter`] for a bandwidth or an exponent out of range, [`Error::NonFinite`] for an
    /// evaluation point that is not finite.
    pub fn start(self, at: &[f64]) -> Result<RecursiveSums> {
        self.start_from(0, at)
    }

    /// [`start`](Self::start) for the part of a stream that begins with its observation `first`, counted from 0.
    ///
    /// # Errors
    /// Those of `start`.
    pub fn start_from(self, first: u64, at: &[f64]) -> Result<RecursiveSums> {
        self.check()?;
        check_finite("at", at, 0)?;
        let mut order: Vec<usize> = (0..at.len()).collect();
        order.sort_by(|&i, &j| at[i].total_cmp(&at[j]));
        Ok(RecursiveSums {
            method: self,
            at: order.iter().map(|&i| at[i]).collect(),
            weight: vec![0.0; at.len()],
            moment: vec![0.0; at.len()],
            order,
            next: first,
            count: 0,
        })
    }

    /// The parameters must be in their ranges.
    fn check(&self) -> Result<()> {
        let refuse = |name: &str, value: f64, requirement: &'static str| {
            Err(Error::InvalidParameter {
                name: name.to_owned(),
                value,
                requirement,
            })
        };
        if !(self.bandwidth > 0.0 && self.bandwidth.is_finite()) {
            return refuse("the bandwidth", self.bandwidth, "positive and finite");
        }
        if !(self.exponent > 0.0 && self.exponent < 1.0) {
            return refuse("the bandwidth's exponent", self.exponent, "between 0 and 1");
        }
        Ok(())
    }

    /// h_i / c for the observations number 2^level to 2^(level + 1) - 1, counted from 1.
    fn shrunk(&self, level: u32) -> f64 {
        (-self.exponent * f64::from(level)).exp2()
    }

    /// What h_i^-r is in proportion to, where h_i / c is `shrunk`.
    fn factor(&self, shrunk: f64) -> f64 {
        match self.form {
            RecursiveForm::WolvertonWagner => 1.0 / shrunk,
            RecursiveForm::DevroyeWagner => 1.0,
        }
    }
}

impl RecursiveSums {
    /// Takes in the next observation, at the cost of a search and of the evaluation points in its reach.
    ///
    /// # Errors
    /// [`Error::NonFinite`], with the observation's place in the stream; the sums stay as they were.
    pub fn push(&mut self, x: f64, y: f64) -> Result<()> {
        check_finite("x", &[x], self.next)?;
        check_finite("y", &[y], self.next)?;
        let kernel = self.method.kernel;
        let shrunk = self.method.shrunk(self.next.saturating_add(1).ilog2());
        let (h, factor) = (self.method.bandwidth * shrunk, self.method.factor(shrunk));
        let reach = kernel.reach() * h;
        let first = self.at.partition_point(|&q| x - q > reach);
        for (j, &q) in self.at.iter().enumerate().skip(first) {
            if q - x > reach {
                break;
            }
            let k = factor * kernel.weight((q - x) / h);
            self.weight[j] += k;
            self.moment[j] += k * y;
        }
        self.next += 1;
        self.count += 1;
        Ok(())
    }

    /// Adds the sums over another part of the same stream.
    ///
    /// The parts may come in any order, and must not overlap: that is the caller's to see to.
    ///
    /// # Errors
    /// [`Error::Unmergeable`] when the methods or the evaluation points differ.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let what = if self.method != other.method {
            "kernels, forms, bandwidths or exponents"
        } else if (&self.at, &self.order) != (&other.at, &other.order) {
            "evaluation points"
        } else {
            for j in 0..self.at.len() {
                self.weight[j] += other.weight[j];
                self.moment[j] += other.moment[j];
            }
            self.next = self.next.max(other.next);
            self.count += other.count;
            return Ok(());
        };
        Err(Error::Unmergeable { what })
    }

    /// The number of observations taken in.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The estimates at the evaluation points, in the order in which these were given: NaN where there has
    /// been no observation within reach. More observations may follow.
    pub fn finish(&self) -> Vec<f64> {
        let mut estimates = vec![f64::NAN; self.at.len()];
        for (j, &i) in self.order.iter().enumerate() {
            if self.weight[j] > 0.0 {
                estimates[i] = self.moment[j] / self.weight[j];
            }
        }
        estimates
    }
}

/// All finite; `first` is the place of the first in its column.
fn check_finite(column: &str, values: &[f64], first: u64) -> Result<()> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(i) => Err(Error::NonFinite {
            column: column.to_owned(),
            sample: first as usize + i,
            value: values[i],
        }),
    }
}

#[cfg(test)]
mod tests;
