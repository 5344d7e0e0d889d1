//! Recursive least squares in square-root information form.
//!
//! The upper triangular R and the vector z with \\(R^T R = \sum \lambda^{k-i} \phi_i \phi_i^T\\), \\(R^T z = \sum \lambda^{k-i} \phi_i y_i\\)
//! take a new row by Givens rotations (Bierman 1977, Factorization Methods for Discrete Sequential Estimation, chapter IV). This is the QR
//! factorisation of the batch problem, row by row: unlike in the covariance form, rounding errors do not grow with the number of samples,
//! and without forgetting the estimate is the batch one. A drifting parameter, in the Kalman form, inflates the covariance \\(P = (R^T
//! R)^{-1}\\) by \\(\sigma_w^2\\) per sample relative to the noise; the information then loses a share, and so stays bounded.

use super::checkpoint::Checkpoint;
use crate::error::{Error, Result};

/// How past samples are weighted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Memory {
    /// All samples count equally.
    All,
    /// Each sample counts this much relative to the next one; above 0, below 1.
    Forgetting(f64),
    /// The parameters take random steps of this variance, relative to that of the noise; positive.
    Drift(f64),
}

impl Memory {
    fn check(self) -> Result<()> {
        match self {
            Memory::All => Ok(()),
            Memory::Forgetting(factor) if factor > 0.0 && factor < 1.0 => Ok(()),
            Memory::Forgetting(factor) => Err(Error::parameter("the forgetting factor", factor, "above 0 and below 1")),
            Memory::Drift(variance) if variance > 0.0 && variance.is_finite() => Ok(()),
            Memory::Drift(variance) => Err(Error::parameter(
                "the drift's variance",
                variance,
                "positive and finite",
            )),
        }
    }
}

/// The first bytes of a checkpoint.
const MARK: [u8; 8] = *b"FLXRLS01";
/// The most parameters: the cost of a sample grows with their square.
const MOST_PARAMETERS: usize = 1000;

/// A linear regression that learns.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastSquares {
    memory: Memory,
    n: usize,
    /// Rows of R, each from its diagonal on, followed by z: `n + 1 - i` numbers for row i.
    rows: Vec<f64>,
    /// The sum of squared residuals, with the same forgetting.
    squares: f64,
    /// The number of samples, and their sum of weights.
    samples: u64,
    weight: f64,
    scratch: Vec<f64>,
}

impl LeastSquares {
    /// A regression with `n` parameters; `prior` is the prior knowledge of each: the inverse of its standard deviation, relative to the
    /// noise's.
    ///
    /// # Errors
    /// [`Error::Parameter`] for no parameters, more than 1000, or a memory or a prior outside its range.
    pub fn new(n: usize, memory: Memory, prior: f64) -> Result<Self> {
        memory.check()?;
        if !(1..=MOST_PARAMETERS).contains(&n) {
            return Err(Error::parameter("the number of parameters", n as f64, "from 1 to 1000"));
        }
        if !(prior >= 0.0 && prior.is_finite()) {
            return Err(Error::parameter("the prior", prior, "not negative and finite"));
        }
        let mut rows = Vec::with_capacity(n * (n + 3) / 2);
        for i in 0..n {
            rows.push(prior);
            rows.extend(std::iter::repeat_n(0.0, n - i));
        }
        Ok(LeastSquares {
            memory,
            n,
            rows,
            squares: 0.0,
            samples: 0,
            weight: 0.0,
            scratch: vec![0.0; n + 1],
        })
    }

    /// Takes a row of regressors with its value; a row is ignored if one of its squares is not finite.
    pub fn push(&mut self, row: &[f64], y: f64) {
        let bounded = |v: &f64| (v * v).is_finite();
        if row.len() != self.n || !bounded(&y) || !row.iter().all(bounded) {
            return;
        }
        self.forget();
        self.scratch[..self.n].copy_from_slice(row);
        self.scratch[self.n] = y;
        let mut start = 0;
        for i in 0..self.n {
            let length = self.n + 1 - i;
            let (r, x) = (&mut self.rows[start..start + length], &mut self.scratch[i..]);
            start += length;
            if x[0] == 0.0 {
                continue;
            }
            // The squares of small values may be zero, those of large values infinite.
            let square = r[0] * r[0] + x[0] * x[0];
            let size = if square.is_normal() {
                square.sqrt()
            } else {
                r[0].hypot(x[0])
            };
            let (c, s) = (r[0] / size, x[0] / size);
            for (r, x) in r.iter_mut().zip(x.iter_mut()) {
                let (a, b) = (*r, *x);
                *r = c * a + s * b;
                *x = c * b - s * a;
            }
        }
        self.squares += self.scratch[self.n] * self.scratch[self.n];
        self.samples += 1;
        self.weight += 1.0;
    }

    fn forget(&mut self) {
        match self.memory {
            Memory::All => {}
            Memory::Forgetting(factor) => {
                let root = factor.sqrt();
                self.rows.iter_mut().for_each(|v| *v *= root);
                self.squares *= factor;
                self.weight *= factor;
            }
            Memory::Drift(variance) => {
                // (P + v I)^-1 = R'R (I + v R'R)^-1; each row's own information bounds the share it loses.
                let mut start = 0;
                for i in 0..self.n {
                    let length = self.n + 1 - i;
                    let row = &mut self.rows[start..start + length];
                    let keep = 1.0 / (1.0 + variance * row[0] * row[0]).sqrt();
                    row.iter_mut().for_each(|v| *v *= keep);
                    start += length;
                }
            }
        }
    }

    /// The number of parameters.
    pub fn parameters(&self) -> usize {
        self.n
    }

    /// The samples taken.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The residuals' variance.
    pub fn noise_variance(&self) -> f64 {
        self.squares / (self.weight - self.n as f64).max(f64::MIN_POSITIVE)
    }

    /// The estimate; `None` as long as the rows do not determine it.
    pub fn estimate(&self) -> Option<Vec<f64>> {
        let mut x = vec![0.0; self.n];
        let largest = self.diagonal().fold(0.0, |m: f64, d| m.max(d.abs()));
        let mut end = self.rows.len();
        for i in (0..self.n).rev() {
            let row = &self.rows[end - (self.n + 1 - i)..end];
            end -= row.len();
            if !(row[0].abs() > 1e-13 * largest) {
                return None;
            }
            let known: f64 = row[1..self.n - i].iter().zip(&x[i + 1..]).map(|(r, x)| r * x).sum();
            x[i] = (row[self.n - i] - known) / row[0];
        }
        Some(x)
    }

    fn diagonal(&self) -> impl Iterator<Item = f64> {
        let mut start = 0;
        (0..self.n).map(move |i| {
            let here = start;
            start += self.n + 1 - i;
            self.rows[here]
        })
    }

    /// A checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (kind, value) = match self.memory {
            Memory::All => (0_u64, 0.0),
            Memory::Forgetting(factor) => (1, factor),
            Memory::Drift(variance) => (2, variance),
        };
        let mut bytes = MARK.to_vec();
        for whole in [self.n as u64, kind, self.samples] {
            bytes.extend(whole.to_le_bytes());
        }
        for number in [value, self.squares, self.weight].iter().chain(&self.rows) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    /// The state of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that are no checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut checkpoint = Checkpoint::new(bytes);
        let mark = checkpoint.word()?;
        let [n, kind, samples] = [(); 3].map(|()| checkpoint.whole());
        let (n, kind, value) = (n?, kind?, checkpoint.finite()?);
        checkpoint.check(mark == MARK && (1..=MOST_PARAMETERS as u64).contains(&n) && kind <= 2)?;
        let memory = match kind {
            0 => Memory::All,
            1 => Memory::Forgetting(value),
            _ => Memory::Drift(value),
        };
        let mut state = LeastSquares::new(n as usize, memory, 0.0)?;
        state.samples = samples?;
        state.squares = checkpoint.finite()?;
        state.weight = checkpoint.finite()?;
        for value in &mut state.rows {
            *value = checkpoint.finite()?;
        }
        checkpoint.end()?;
        Ok(state)
    }
}
