//! The initial state of a record, from its first samples.
//!
//! A model describes how the output goes on from a state. It does not know the state at the start of the record. MATLAB's `compare`
//! estimates it, too. Here the states of all linear blocks are fitted by least squares to the measured output, for as long as they matter.
//! The problem is linear for the blocks after the last nonlinearity. The others take a few Gauss-Newton steps.

use crate::error::{Error, Result};
use crate::linear::correlation::variance;
use crate::linear::levenberg_marquardt::{Linearisation, minimise};
use crate::model::Block;

/// A response no longer depends on the state at the start if that effect is below this share of its size.
const SETTLED: f64 = 1e-3;
/// At least this many samples for each state are fitted, if the record has them.
const SAMPLES_A_STATE: usize = 5;
const ITERATIONS: usize = 50;
/// The difference over which derivatives are taken, in the unit of the states' size.
const STEP: f64 = 1e-4;
/// A small weight that fixes a state on which the output does not depend.
const RIDGE: f64 = 1e-7;

/// The states of a model's linear blocks at the start of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialState {
    /// The mean input of every linear block, in the order of the blocks.
    levels: Vec<f64>,
    /// The states minus the steady states at these levels.
    states: Vec<f64>,
    /// The number of samples from which they were estimated.
    samples: usize,
}

impl InitialState {
    /// The number of samples at the start of the record from which the state was estimated.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The output of `block`, the model for which the state was estimated, under the same `input`.
    pub fn simulate(&self, block: &Block, input: &[f64]) -> Vec<f64> {
        self.simulate_inputs(block, &[input])
    }

    /// [`simulate`](Self::simulate) for a block of several inputs.
    pub fn simulate_inputs(&self, block: &Block, inputs: &[&[f64]]) -> Vec<f64> {
        block.simulate_from(inputs, &mut self.levels.as_slice(), &mut self.states.as_slice())
    }
}

/// Estimates the initial state of `block` from the output `measured` under `input`. Samples that were not measured are NaN.
///
/// Only the first samples are used, until the influence of the state has fallen to a thousandth. They are at least five for each state. The
/// search starts from the steady state at the mean input. So the simulation of these samples is never further from the measurement than
/// [`Block::simulate`].
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch`, and `TooShort` for fewer measured samples than the model has states.
///
/// ```
/// use flexure::linear::TransferFunction;
/// use flexure::model::Block;
/// use flexure::validation::estimate_initial_state;
///
/// let block = Block::Linear(TransferFunction::new(vec![1.0], vec![1.0, -0.9])?);
/// // No input, but the system rings out from 5.
/// let measured: Vec<f64> = (0..30).map(|n| 5.0 * 0.9_f64.powi(n)).collect();
/// let state = estimate_initial_state(&block, &[0.0; 30], &measured)?;
/// let simulated = state.simulate(&block, &[0.0; 30]);
/// assert!(simulated.iter().zip(&measured).all(|(s, y)| (s - y).abs() < 1e-6));
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn estimate_initial_state(block: &Block, input: &[f64], measured: &[f64]) -> Result<InitialState> {
    estimate_initial_state_of_inputs(block, &[input], measured)
}

/// [`estimate_initial_state`] for a block of several inputs.
///
/// # Errors
/// Those of [`estimate_initial_state`], and of [`Block::simulate_inputs`].
pub fn estimate_initial_state_of_inputs(block: &Block, inputs: &[&[f64]], measured: &[f64]) -> Result<InitialState> {
    block.check_inputs(inputs)?;
    let input = inputs.first().copied().unwrap_or_default();
    if measured.len() != input.len() {
        return Err(Error::length("the measurement", measured.len(), input.len()));
    }
    let count = block.states();
    let longest = block.settling(SETTLED).max(SAMPLES_A_STATE * count);
    let samples = longest.min(input.len());
    let known: Vec<usize> = (0..samples).filter(|t| measured[*t].is_finite()).collect();
    if known.len() < count {
        return Err(Error::too_short(
            "the estimation of an initial state",
            count,
            known.len(),
        ));
    }
    let mut levels = Vec::new();
    let steady = block.levels(inputs, &mut levels);
    let head: Vec<&[f64]> = inputs.iter().map(|u| &u[..samples]).collect();
    let scale = sizes(block, &head);
    let unit = {
        let size = variance(&steady).sqrt();
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    };
    let simulate = |p: &[f64]| {
        let states: Vec<f64> = p.iter().zip(&scale).map(|(p, s)| p * s).collect();
        block.simulate_from(&head, &mut levels.as_slice(), &mut states.as_slice())
    };
    let linearise = |p: &[f64]| {
        let at = simulate(p);
        let mut residuals: Vec<f64> = known.iter().map(|&t| (at[t] - measured[t]) / unit).collect();
        residuals.extend(p.iter().map(|p| RIDGE * p));
        let column = |i: usize| {
            let shifted = |step: f64| {
                let mut q = p.to_vec();
                q[i] += step;
                simulate(&q)
            };
            let (up, down) = (shifted(STEP), shifted(-STEP));
            let slopes = known.iter().map(|&t| (up[t] - down[t]) / (2.0 * STEP * unit));
            let ridge = (0..count).map(|k| if k == i { RIDGE } else { 0.0 });
            slopes.chain(ridge).collect()
        };
        let finite = residuals.iter().all(|r| r.is_finite());
        finite.then(|| Linearisation {
            jacobian: (0..count).map(column).collect(),
            residuals,
        })
    };
    let found = minimise(vec![0.0; count], ITERATIONS, linearise);
    let scaled = found.map_or(vec![0.0; count], |minimum| minimum.parameters);
    Ok(InitialState {
        levels,
        states: scaled.iter().zip(&scale).map(|(p, s)| p * s).collect(),
        samples,
    })
}

/// The size of every state: the size of its block's output, or 1 if that is constant.
fn sizes(block: &Block, inputs: &[&[f64]]) -> Vec<f64> {
    let mut sizes = Vec::new();
    block.visit(inputs, &mut |part, output| {
        if let Block::Feedback(model) = part {
            // An identified loop has states of unit variance.
            sizes.extend(std::iter::repeat_n(1.0, model.order()));
        }
        if let Block::Linear(system) = part {
            let spread = variance(output).sqrt();
            let size = if spread > 0.0 && spread.is_finite() {
                spread
            } else {
                1.0
            };
            sizes.extend(std::iter::repeat_n(size, system.states()));
        }
    });
    sizes
}

#[cfg(test)]
mod tests {
    use crate::error::DataError;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::linear::TransferFunction;
    use crate::nonlinearity::{Curve, Outside};
    use crate::vectors::dot;

    fn linear(b: &[f64], a: &[f64]) -> Block {
        Block::Linear(TransferFunction::new(b.to_vec(), a.to_vec()).unwrap())
    }

    fn bend() -> Block {
        let (x, y) = (vec![-3.0, -1.0, 1.0, 3.0], vec![-1.6, -1.0, 1.0, 1.4]);
        Block::Static(Curve::new(x, y, Outside::Linear).unwrap())
    }

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.5)).collect()
    }

    fn blocks() -> Vec<Block> {
        let (slow, quick) = (
            linear(&[0.1, 0.05], &[1.0, -1.7, 0.8]),
            linear(&[0.0, 1.0], &[1.0, -0.6]),
        );
        vec![
            slow.clone(),
            Block::Series(vec![bend(), slow.clone()]),
            Block::Series(vec![slow.clone(), bend(), quick.clone()]),
            Block::Parallel(vec![Block::Series(vec![quick, bend()]), slow]),
        ]
    }

    /// The record is the end of a longer one. After the estimation it continues like the longer one.
    #[test]
    fn the_end_of_a_longer_record_is_met() {
        for (i, block) in blocks().iter().enumerate() {
            let long = noise(400, i as u64);
            let output = block.simulate(&long);
            let (u, y) = (&long[330..], &output[330..]);
            let state = estimate_initial_state(block, u, y).unwrap();
            let worst = |simulated: &[f64]| {
                let errors = simulated.iter().zip(y).map(|(s, y)| (s - y).abs());
                errors.fold(0.0, f64::max)
            };
            let (before, after) = (worst(&block.simulate(u)), worst(&state.simulate(block, u)));
            assert!(after < 1e-5 && before > 0.05, "{i}: {after} instead of {before}");
        }
    }

    /// Least squares for a Hammerstein model by its design matrix: the response to every state, from the difference equation.
    #[test]
    fn the_linear_case_is_the_least_squares_solution() {
        let (b, a) = ([0.1, 0.05], [1.0, -1.7, 0.8]);
        let block = Block::Series(vec![bend(), linear(&b, &a)]);
        let (u, e) = (noise(60, 7), noise(60, 8));
        let y: Vec<f64> = block.simulate(&u).iter().zip(&e).map(|(y, e)| y + e).collect();
        let got = estimate_initial_state(&block, &u, &y).unwrap().simulate(&block, &u);
        // Free responses of the transposed direct form: y_n = s1; s1 = s2 - a1 y; s2 = -a2 y.
        let free = |mut s: [f64; 2]| -> Vec<f64> {
            let step = |_| {
                let y = s[0];
                s = [s[1] - a[1] * y, -a[2] * y];
                y
            };
            (0..60).map(step).collect()
        };
        let (p, q) = (free([1.0, 0.0]), free([0.0, 1.0]));
        let base = block.simulate(&u);
        let left: Vec<f64> = y.iter().zip(&base).map(|(y, s)| y - s).collect();
        let (pp, pq, qq) = (dot(&p, &p), dot(&p, &q), dot(&q, &q));
        let (pl, ql) = (dot(&p, &left), dot(&q, &left));
        let determinant = pp * qq - pq * pq;
        let s = [(qq * pl - pq * ql) / determinant, (pp * ql - pq * pl) / determinant];
        for t in 0..60 {
            let want = base[t] + s[0] * p[t] + s[1] * q[t];
            assert!((got[t] - want).abs() < 1e-6, "{t}: {} {want}", got[t]);
        }
    }

    #[test]
    fn missing_samples_are_skipped_and_too_few_refused() {
        let block = &blocks()[2];
        let long = noise(300, 3);
        let output = block.simulate(&long);
        let (u, mut y) = (&long[200..], output[200..].to_vec());
        let truth = y.clone();
        (0..100).step_by(3).for_each(|t| y[t] = f64::NAN);
        let simulated = estimate_initial_state(block, u, &y).unwrap().simulate(block, u);
        assert!(simulated.iter().zip(&truth).all(|(s, y)| (s - y).abs() < 1e-5));
        let error = estimate_initial_state(block, &u[..2], &truth[..2]).unwrap_err();
        assert!(
            matches!(error, Error::Data(DataError::TooShort { need: 3, got: 2, .. })),
            "{error}"
        );
        assert!(matches!(
            estimate_initial_state(block, u, &truth[..5]),
            Err(Error::Data(DataError::LengthMismatch { .. }))
        ));
    }

    #[test]
    fn without_states_there_is_nothing_to_estimate() {
        let state = estimate_initial_state(&bend(), &[0.5, 2.0], &[9.0, 9.0]).unwrap();
        assert_eq!(state.simulate(&bend(), &[0.5, 2.0]), bend().simulate(&[0.5, 2.0]));
    }
}
