//! The recursive kernel estimate for streams: one pass, memory for the evaluation points alone.
//!
//! $$ m_n(x) = \frac{\sum_i h_i^{-r} Y_i K((x - X_i)/h_i)}{\sum_i h_i^{-r} K((x - X_i)/h_i)} ,
//!    \qquad h_i = c\,(i + 1)^{-\gamma}, \; i = 0, 1, \dots $$
//! with r = 1 (after Wolverton & Wagner 1969, Ahmad & Lin 1976) or r = 0 (Devroye & Wagner 1980). An
//! observation's bandwidth depends on its place in the stream alone, so that it is never looked at again and
//! partial sums over parts of the stream add up to those of the whole. The rate is that of (13)
//! (Greblicki & Pawlak 2008, chapter 4).

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
}

impl RecursiveSums {
    /// Takes in the next observation, at the cost of a search and of the evaluation points in its reach.
    ///
    /// # Errors
    /// [`Error::NonFinite`], with the observation's place in the stream; the sums stay as they were.
    pub fn push(&mut self, x: f64, y: f64) -> Result<()> {
        check_finite("x", &[x], self.next)?;
        check_finite("y", &[y], self.next)?;
        let RecursiveKernel {
            kernel,
            form,
            bandwidth,
            exponent,
        } = self.method;
        let shrunk = (self.next as f64 + 1.0).powf(-exponent);
        let h = bandwidth * shrunk;
        let factor = match form {
            RecursiveForm::WolvertonWagner => 1.0 / shrunk,
            RecursiveForm::DevroyeWagner => 1.0,
        };
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
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    const AT: [f64; 5] = [0.9, -0.5, 0.0, 7.0, 0.3];

    fn stream(n: usize) -> Vec<(f64, f64)> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        (0..n)
            .map(|_| {
                let x = rng.random_range(-1.0..1.0);
                (x, 1e6 + x * x + rng.random_range(-0.1..0.1))
            })
            .collect()
    }

    fn method(kernel: Kernel, form: RecursiveForm) -> RecursiveKernel {
        RecursiveKernel {
            kernel,
            form,
            bandwidth: 0.8,
            exponent: 0.25,
        }
    }

    #[test]
    fn any_number_of_shards_gives_the_sums_as_they_are_written() {
        let data = stream(3000);
        for kernel in Kernel::ALL {
            for (form, r) in [(RecursiveForm::WolvertonWagner, 1), (RecursiveForm::DevroyeWagner, 0)] {
                let shards = |size: usize| {
                    let mut parts = data.chunks(size).enumerate().map(|(k, part)| {
                        let mut sums = method(kernel, form).start_from((k * size) as u64, &AT).unwrap();
                        part.iter().for_each(|&(x, y)| sums.push(x, y).unwrap());
                        sums
                    });
                    let mut whole = parts.next_back().unwrap();
                    parts.for_each(|part| whole.merge(&part).unwrap());
                    assert_eq!(whole.count(), 3000);
                    whole.finish()
                };
                let (one, ten) = (shards(3000), shards(300));
                for (j, q) in AT.iter().enumerate() {
                    let (mut s, mut t) = (0.0, 0.0);
                    for (i, (x, y)) in data.iter().enumerate() {
                        let h = 0.8 * (i as f64 + 1.0).powf(-0.25);
                        let k = h.powi(-r) * kernel.weight((q - x) / h);
                        s += k;
                        t += k * (y - 1e6);
                    }
                    if s > 0.0 {
                        let want = 1e6 + t / s;
                        assert!((one[j] / want - 1.0).abs() < 1e-12 && (ten[j] / want - 1.0).abs() < 1e-12);
                    } else {
                        assert!(one[j].is_nan() && ten[j].is_nan());
                    }
                }
                assert!(kernel == Kernel::Gaussian || one[3].is_nan());
            }
        }
    }

    #[test]
    fn ten_shards_of_many_points_give_what_one_gives() {
        let data = stream(200_000);
        let run = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner);
        let sums = |from: usize, part: &[(f64, f64)]| {
            let mut sums = run.start_from(from as u64, &AT).unwrap();
            part.iter().for_each(|&(x, y)| sums.push(x, y - 1e6).unwrap());
            sums
        };
        let one = sums(0, &data).finish();
        let mut parts = data.chunks(20_000).enumerate().map(|(k, part)| sums(k * 20_000, part));
        let mut whole = parts.next().unwrap();
        parts.for_each(|part| whole.merge(&part).unwrap());
        for (a, b) in one.iter().zip(whole.finish()).filter(|(a, _)| !a.is_nan()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn the_estimate_converges() {
        let mut sums = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner)
            .start(&AT)
            .unwrap();
        stream(40_000).iter().for_each(|&(x, y)| sums.push(x, y).unwrap());
        for (q, m) in AT.iter().zip(sums.finish()).filter(|(q, _)| q.abs() < 0.9) {
            assert!((m - 1e6 - q * q).abs() < 0.01, "{q} {m}");
        }
    }

    #[test]
    fn bad_input_is_refused_with_its_place() {
        let good = method(Kernel::Uniform, RecursiveForm::DevroyeWagner);
        let message = |exponent, bandwidth, at: &[f64]| {
            let bad = RecursiveKernel {
                exponent,
                bandwidth,
                ..good
            };
            bad.start(at).unwrap_err().to_string()
        };
        assert_eq!(
            message(1.0, 1.0, &[0.0]),
            "the bandwidth's exponent is 1, but must be between 0 and 1"
        );
        assert!(message(0.2, f64::NAN, &[0.0]).contains("the bandwidth is NaN"));
        assert!(message(0.2, 1.0, &[0.0, f64::INFINITY]).contains("column 'at' is inf at sample 1"));
        let mut sums = good.start_from(7, &AT).unwrap();
        sums.push(0.0, 1.0).unwrap();
        let before = sums.clone();
        let refused = sums.push(0.0, f64::NAN).unwrap_err().to_string();
        assert!(refused.contains("column 'y' is NaN at sample 8"), "{refused}");
        assert_eq!(sums, before);
        let other = good.start(&AT[..4]).unwrap();
        let refused = sums.merge(&other).unwrap_err().to_string();
        assert!(refused.contains("evaluation points"), "{refused}");
    }
}
