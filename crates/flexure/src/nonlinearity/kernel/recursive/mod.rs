//! The recursive kernel estimate. For streams it takes one pass and memory for the evaluation points only ([`RecursiveKernel`]). Over a
//! record it is known at any point, and c can be chosen from the data ([`RecursiveRegression`]).
//!
//! $$ m_n(x) = \frac{\sum_i h_i^{-r} Y_i K((x - X_i)/h_i)}{\sum_i h_i^{-r} K((x - X_i)/h_i)} ,
//!    \qquad h_i = c\,2^{-\gamma \lfloor \log_2 (i + 1) \rfloor}, \; i = 0, 1, \dots $$
//! with r = 1 (after Wolverton & Wagner 1969, Ahmad & Lin 1976) or r = 0 (Devroye & Wagner 1980). An observation's bandwidth depends only
//! on its place in the stream. So an observation is never needed again, and partial sums over parts of the stream add up to the sums of the
//! whole. The bandwidth follows c (i + 1)^-gamma from above to within a factor 2^gamma, and stays the same while the stream doubles. Over a
//! record the observations of one bandwidth then make an ordinary kernel sum. The rate is that of (13) (Greblicki & Pawlak 2008, chapter 4,
//! where h_i may be any sequence of that order). In d columns K is a product, the bandwidths of all columns shrink by the same factor, and
//! the weight is h_i^(-r d).

mod levels;
mod regression;

pub use regression::{RecursiveFit, RecursiveRegression};

use super::Kernel;
use crate::error::{DataError, Error, ParameterError, Result};
use crate::nonlinearity::estimator::{MOST_COLUMNS, columns};
use crate::sort::order;

/// The weights of observations with different bandwidths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RecursiveForm {
    /// Weights 1/h_i, as in the density estimates of Wolverton & Wagner (1969): all observations count equally.
    #[default]
    WolvertonWagner,
    /// Equal weights (Devroye & Wagner 1980): the early, wide windows count more, and the estimate is smoother and more biased.
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
    /// Each column's bandwidth as a multiple of the method's.
    proportions: Vec<f64>,
    /// The columns of the evaluation points, sorted by the first column, and the place of each point in the caller's list.
    at: Vec<Vec<f64>>,
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
    /// [`Error::Parameter`] for a bandwidth or an exponent out of range, [`Error::Data`]: `NonFinite` for an
    /// evaluation point that is not finite.
    pub fn start(self, at: &[f64]) -> Result<RecursiveSums> {
        self.start_from(0, at)
    }

    /// [`start`](Self::start) for the part of a stream that begins with its observation `first`, counted from 0.
    ///
    /// # Errors
    /// Those of `start`.
    pub fn start_from(self, first: u64, at: &[f64]) -> Result<RecursiveSums> {
        self.start_in_columns(first, &[at], &[1.0])
    }

    /// [`start_from`](Self::start_from) in one to six columns: `at` holds the columns of the evaluation points, and the
    /// bandwidths of column j are those of the method times `proportions[j]`.
    ///
    /// ```
    /// use flexure::nonlinearity::{Kernel, RecursiveForm, RecursiveKernel};
    /// let method = RecursiveKernel {
    ///     kernel: Kernel::Epanechnikov,
    ///     form: RecursiveForm::WolvertonWagner,
    ///     bandwidth: 0.5,
    ///     exponent: 1.0 / 6.0,
    /// };
    /// let mut sums = method.start_in_columns(0, &[&[0.5], &[0.5]], &[1.0, 1.0])?;
    /// for i in 0..1000 {
    ///     let (a, b) = (f64::from(i % 25) / 25.0, f64::from(i / 25) / 40.0);
    ///     sums.push_point(&[a, b], a - b)?;
    /// }
    /// assert!(sums.finish()[0].abs() < 0.05);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of `start`; [`Error::Parameter`]: `ColumnCount` for no column, more than six, or another number of proportions;
    /// [`Error::Data`]: `LengthMismatch` for columns of different lengths; [`Error::Parameter`] for a proportion that is not
    /// positive.
    pub fn start_in_columns(self, first: u64, at: &[&[f64]], proportions: &[f64]) -> Result<RecursiveSums> {
        self.check()?;
        let counted = |what, got, expected| Err(Error::Parameter(ParameterError::ColumnCount { what, got, expected }));
        if !(1..=MOST_COLUMNS).contains(&at.len()) {
            return counted(
                "a recursive kernel",
                at.len(),
                format!("1 to {}", columns(MOST_COLUMNS)),
            );
        }
        if proportions.len() != at.len() {
            return counted("the list of proportions", proportions.len(), columns(at.len()));
        }
        if let Some(&value) = proportions.iter().find(|p| !(**p > 0.0 && p.is_finite())) {
            return Err(Error::parameter("a column's proportion", value, "positive and finite"));
        }
        for column in at {
            check_finite("at", column, 0)?;
            if column.len() != at[0].len() {
                return Err(Error::length("at", column.len(), at[0].len()));
            }
        }
        let order = order(&at[..1]);
        let sorted = |column: &&[f64]| order.iter().map(|&i| column[i]).collect();
        Ok(RecursiveSums {
            method: self,
            proportions: proportions.to_vec(),
            at: at.iter().map(sorted).collect(),
            weight: vec![0.0; order.len()],
            moment: vec![0.0; order.len()],
            order,
            next: first,
            count: 0,
        })
    }

    /// The parameters must be in their ranges.
    fn check(&self) -> Result<()> {
        let refuse =
            |name: &str, value: f64, requirement: &'static str| Err(Error::parameter(name, value, requirement));
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

    /// A factor proportional to h_i^-r, with h_i / c = `shrunk`.
    fn factor(&self, shrunk: f64) -> f64 {
        match self.form {
            RecursiveForm::WolvertonWagner => 1.0 / shrunk,
            RecursiveForm::DevroyeWagner => 1.0,
        }
    }
}

impl RecursiveSums {
    /// Takes in the next observation of one column. The cost is a search and the evaluation points in its reach.
    ///
    /// # Errors
    /// [`Error::Data`]: `NonFinite`, with the observation's place in the stream, and [`Error::Parameter`]: `ColumnCount` where the evaluation
    /// points have several columns; the sums stay as they were.
    pub fn push(&mut self, x: f64, y: f64) -> Result<()> {
        self.push_point(&[x], y)
    }

    /// [`push`](Self::push) in any number of columns: `x` holds the observation's coordinates.
    ///
    /// # Errors
    /// Those of `push`.
    pub fn push_point(&mut self, x: &[f64], y: f64) -> Result<()> {
        if x.len() != self.at.len() {
            return Err(Error::Parameter(ParameterError::ColumnCount {
                what: "an observation",
                got: x.len(),
                expected: columns(self.at.len()),
            }));
        }
        for x in x {
            check_finite("x", &[*x], self.next)?;
        }
        check_finite("y", &[y], self.next)?;
        let kernel = self.method.kernel;
        let shrunk = self.method.shrunk(self.next.saturating_add(1).ilog2());
        let factor = self.method.factor(shrunk).powi(x.len() as i32);
        let bandwidth = |j: usize| self.method.bandwidth * shrunk * self.proportions[j];
        let (first, h) = (&self.at[0], bandwidth(0));
        let reach = kernel.reach() * h;
        let from = first.partition_point(|&q| x[0] - q > reach);
        for (i, &q) in first.iter().enumerate().skip(from) {
            if q - x[0] > reach {
                break;
            }
            let mut k = factor * kernel.weight((q - x[0]) / h);
            for j in 1..x.len() {
                let (distance, h) = (self.at[j][i] - x[j], bandwidth(j));
                let inside = distance.abs() <= kernel.reach() * h;
                k *= if inside { kernel.weight(distance / h) } else { 0.0 };
            }
            self.weight[i] += k;
            self.moment[i] += k * y;
        }
        self.next += 1;
        self.count += 1;
        Ok(())
    }

    /// Adds the sums over another part of the same stream.
    ///
    /// The parts may come in any order. The caller must make sure that they do not overlap.
    ///
    /// # Errors
    /// [`Error::Data`]: `Unmergeable` when the methods or the evaluation points differ.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let what = if self.method != other.method {
            "kernels, forms, bandwidths or exponents"
        } else if (&self.at, &self.order) != (&other.at, &other.order) {
            "evaluation points"
        } else if self.proportions != other.proportions {
            "columns' bandwidths"
        } else {
            for j in 0..self.weight.len() {
                self.weight[j] += other.weight[j];
                self.moment[j] += other.moment[j];
            }
            self.next = self.next.max(other.next);
            self.count += other.count;
            return Ok(());
        };
        Err(Error::Data(DataError::Unmergeable { what }))
    }

    /// The number of observations taken in.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The estimates at the evaluation points, in the order given. NaN where no observation was within reach. More observations may follow.
    pub fn finish(&self) -> Vec<f64> {
        let mut estimates = vec![f64::NAN; self.weight.len()];
        for (j, &i) in self.order.iter().enumerate() {
            if self.weight[j] > 0.0 {
                estimates[i] = self.moment[j] / self.weight[j];
            }
        }
        estimates
    }
}

/// Checks that all values are finite; `first` is the place of the first value in its column.
fn check_finite(column: &str, values: &[f64], first: u64) -> Result<()> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(i) => Err(Error::not_finite(column, first as usize + i, values[i])),
    }
}

#[cfg(test)]
mod tests;
