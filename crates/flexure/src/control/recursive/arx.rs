//! Linear and Hammerstein systems that learn, in equation-error form:
//!
//! $$ y_n = -a_1 y_{n-1} - \dots - a_l y_{n-l} + \sum_{j=0}^{l} \sum_m b_j c_m g_m(u_{n-d-j}) + e_n $$
//!
//! The products \\(b_j c_m\\) are estimated as free parameters; their matrix has rank one, and its dominant singular vectors are b and c
//! (Bai 1998, An optimal two-stage identification algorithm for Hammerstein-Wiener nonlinear systems, Automatica 34).

use super::checkpoint::Checkpoint;
use super::least_squares::{LeastSquares, Memory};
use crate::error::{Error, Result};

/// The longest history: order and delay together, samples.
const LONGEST: usize = 1000;

/// Signals of the last samples, the newest first.
#[derive(Debug, Clone, PartialEq)]
struct Lags {
    values: Vec<f64>,
}

impl Lags {
    fn new(length: usize) -> Self {
        Lags {
            values: vec![0.0; length],
        }
    }

    fn push(&mut self, value: f64) {
        self.values.rotate_right(1);
        if let Some(first) = self.values.first_mut() {
            *first = value;
        }
    }
}

/// A Hammerstein system that learns.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveHammerstein {
    order: usize,
    delay: usize,
    /// The powers of the input.
    degree: usize,
    u: Lags,
    y: Lags,
    seen: usize,
    row: Vec<f64>,
    fit: LeastSquares,
}

/// The present estimate of a Hammerstein system.
#[derive(Debug, Clone, PartialEq)]
pub struct HammersteinEstimate {
    /// The denominator in z^-1, from 1 on.
    pub a: Vec<f64>,
    /// The numerator in z^-1, whose first coefficient of largest size is positive and whose squares sum to 1.
    pub b: Vec<f64>,
    /// The coefficients of u, u^2, ... of the nonlinearity.
    pub powers: Vec<f64>,
    /// The constant in the output's equation.
    pub offset: f64,
}

impl RecursiveHammerstein {
    /// A system of this order and delay, with a polynomial of this degree before it.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an order above 50, a degree outside 1 to 15, a longer history than 1000 samples, or a memory outside its range.
    pub fn new(order: usize, delay: usize, degree: usize, memory: Memory) -> Result<Self> {
        if order > 50 {
            return Err(Error::parameter("order", order as f64, "at most 50"));
        }
        if !(1..=15).contains(&degree) {
            return Err(Error::parameter("degree", degree as f64, "from 1 to 15"));
        }
        if order + delay > LONGEST {
            return Err(Error::parameter(
                "delay",
                delay as f64,
                "at most 1000 samples with the order",
            ));
        }
        let parameters = order + (order + 1) * degree + 1;
        Ok(RecursiveHammerstein {
            order,
            delay,
            degree,
            u: Lags::new(order + delay + 1),
            y: Lags::new(order),
            seen: 0,
            row: vec![0.0; parameters],
            fit: LeastSquares::new(parameters, memory, 0.0)?,
        })
    }

    /// Takes a sample of input and output; after a value that is not finite, the history begins again.
    pub fn push(&mut self, u: f64, y: f64) {
        if !(u.is_finite() && y.is_finite()) {
            self.seen = 0;
            return;
        }
        self.u.push(u);
        self.seen += 1;
        if self.seen > self.order + self.delay {
            let (own, rest) = self.row.split_at_mut(self.order);
            for (x, y) in own.iter_mut().zip(&self.y.values) {
                *x = -y;
            }
            let lagged = &self.u.values[self.delay..];
            for (powers, u) in rest.chunks_exact_mut(self.degree).zip(lagged) {
                let mut power = 1.0;
                for x in powers {
                    power *= u;
                    *x = power;
                }
            }
            if let Some(last) = self.row.last_mut() {
                *last = 1.0;
            }
            self.fit.push(&self.row, y);
        }
        self.y.push(y);
    }

    /// The regression's coefficients, not split; `None` as long as the samples do not determine them.
    pub fn coefficients(&self) -> Option<Vec<f64>> {
        self.fit.estimate()
    }

    /// The system, with its products split; `None` as long as the samples do not determine it.
    pub fn estimate(&self) -> Option<HammersteinEstimate> {
        let all = self.fit.estimate()?;
        let (own, rest) = all.split_at(self.order);
        let (products, offset) = rest.split_at(rest.len() - 1);
        let (mut b, mut powers) = dominant(products, self.degree)?;
        let largest = b.iter().fold(0.0, |m: f64, v| if v.abs() > m.abs() { *v } else { m });
        let sign = largest.signum();
        b.iter_mut().for_each(|v| *v *= sign);
        powers.iter_mut().for_each(|v| *v *= sign);
        Some(HammersteinEstimate {
            a: std::iter::once(1.0).chain(own.iter().copied()).collect(),
            b,
            powers,
            offset: offset[0],
        })
    }

    /// A checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for whole in [self.order, self.delay, self.degree, self.seen] {
            bytes.extend((whole as u64).to_le_bytes());
        }
        for value in self.u.values.iter().chain(&self.y.values) {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend(self.fit.to_bytes());
        bytes
    }

    /// The state of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that are no checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut checkpoint = Checkpoint::new(bytes);
        let [order, delay, degree, seen] = [(); 4].map(|()| checkpoint.count());
        let (order, delay) = (order?, delay?);
        checkpoint.check(order <= 50 && delay <= LONGEST)?;
        let mut state = RecursiveHammerstein::new(order, delay, degree?, Memory::All)?;
        state.seen = seen?;
        for value in state.u.values.iter_mut().chain(&mut state.y.values) {
            *value = checkpoint.finite()?;
        }
        state.fit = LeastSquares::from_bytes(checkpoint.rest())?;
        checkpoint.check(state.fit.parameters() == state.row.len())?;
        Ok(state)
    }
}

/// Rounds of the power iteration; a rank-one matrix with noise needs few.
const ROUNDS: usize = 200;

/// The dominant singular vectors of a row-major matrix: the left one of length 1, the right one with the singular value.
fn dominant(matrix: &[f64], columns: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let rows: Vec<&[f64]> = matrix.chunks_exact(columns).collect();
    let mut left: Vec<f64> = rows
        .iter()
        .map(|r| r.iter().map(|v| v * v).sum::<f64>().sqrt())
        .collect();
    let mut right = vec![0.0; columns];
    // Starts along the largest row, whose sign the others follow.
    let largest = (0..rows.len()).max_by(|&i, &j| left[i].total_cmp(&left[j]))?;
    for (i, row) in rows.iter().enumerate() {
        left[i] = row.iter().zip(rows[largest]).map(|(a, b)| a * b).sum();
    }
    for _ in 0..ROUNDS {
        let size = left.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        left.iter_mut().for_each(|v| *v /= size);
        for (j, right) in right.iter_mut().enumerate() {
            *right = rows.iter().zip(&left).map(|(r, l)| r[j] * l).sum();
        }
        let length: f64 = right.iter().map(|v| v * v).sum();
        let next: Vec<f64> = rows
            .iter()
            .map(|r| r.iter().zip(&right).map(|(a, b)| a * b).sum::<f64>() / length)
            .collect();
        let change = next.iter().zip(&left).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if change < 1e-15 {
            break;
        }
        left = next;
    }
    Some((left, right))
}

/// A linear system that learns.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveArx(RecursiveHammerstein);

impl RecursiveArx {
    /// A system of this order and delay.
    ///
    /// # Errors
    /// Those of [`RecursiveHammerstein::new`].
    pub fn new(order: usize, delay: usize, memory: Memory) -> Result<Self> {
        RecursiveHammerstein::new(order, delay, 1, memory).map(RecursiveArx)
    }

    /// Takes a sample of input and output.
    pub fn push(&mut self, u: f64, y: f64) {
        self.0.push(u, y);
    }

    /// Numerator and denominator in z^-1, and the constant in the output's equation; `None` as long as the samples do not determine them.
    pub fn estimate(&self) -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let all = self.0.coefficients()?;
        let (own, rest) = all.split_at(self.0.order);
        let (b, offset) = rest.split_at(rest.len() - 1);
        let a = std::iter::once(1.0).chain(own.iter().copied()).collect();
        Some((b.to_vec(), a, offset[0]))
    }

    /// A checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.to_bytes()
    }

    /// The state of a checkpoint.
    ///
    /// # Errors
    /// Those of [`RecursiveHammerstein::from_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        RecursiveHammerstein::from_bytes(bytes).map(RecursiveArx)
    }
}
