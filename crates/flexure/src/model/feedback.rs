//! A static nonlinearity in a feedback loop: linear dynamics around it.
//!
//! $$ x_{k+1} = A x_k + B_u \tilde u_k + B_w \tilde w_k, \quad
//!    y_k = C_y x_k + D_{yu} \tilde u_k + D_{yw} \tilde w_k + \bar y, \quad
//!    z_k = C_z x_k + D_{zu} \tilde u_k + \bar z, \quad w_k = f(z_k) $$
//! with $\tilde u = u - \bar u$ and $\tilde w = w - \bar w$. There is no direct path from w to z, so every step is explicit.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::linear::TransferFunction;
use crate::nonlinearity::Curve;
use crate::vectors::dot;

/// The largest order of a model that can be simulated. Convention.
const LARGEST_ORDER: usize = 100;
/// An output this many times larger than the nonlinearity's range and levels has run away.
const RUN_AWAY: f64 = 1e6;
/// A coefficient of a transfer function this much smaller than the largest is rounding.
const ROUNDING: f64 = 1e-12;
/// Points of the nonlinearity at which the loop is linearised to find its settling time.
const SETTLING_POINTS: usize = 9;
/// The settling time of a loop that settles at none of these points.
const UNSETTLED: usize = 1000;

/// Linear dynamics around a static nonlinearity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeedbackModel {
    /// The state's matrix A, row by row.
    pub state: Vec<Vec<f64>>,
    /// From the input to the state: $B_u$.
    pub input_to_state: Vec<f64>,
    /// From the nonlinearity to the state: $B_w$.
    pub nonlinearity_to_state: Vec<f64>,
    /// From the state to the output: $C_y$.
    pub state_to_output: Vec<f64>,
    /// From the state to the nonlinearity's input: $C_z$.
    pub state_to_nonlinearity: Vec<f64>,
    /// Directly from the input to the output: $D_{yu}$.
    pub input_to_output: f64,
    /// Directly from the nonlinearity to the output: $D_{yw}$.
    pub nonlinearity_to_output: f64,
    /// Directly from the input to the nonlinearity's input: $D_{zu}$.
    pub input_to_nonlinearity: f64,
    /// The levels that are subtracted or added.
    pub levels: FeedbackLevels,
    /// f.
    pub nonlinearity: Curve,
}

/// The values of all signals at the linear part's zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FeedbackLevels {
    /// The level of the input.
    pub input: f64,
    /// The level of the nonlinearity's output.
    pub nonlinearity: f64,
    /// The level of the output.
    pub output: f64,
    /// The level of the nonlinearity's input.
    pub entering: f64,
}

/// A signal that enters the linear part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopInput {
    /// The input.
    Input,
    /// The nonlinearity's output.
    Nonlinearity,
}

/// A signal that leaves the linear part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopOutput {
    /// The output.
    Output,
    /// What enters the nonlinearity.
    Nonlinearity,
}

/// A free run: the output, and the nonlinearity's input.
pub struct LoopRun {
    /// The output; NaN after the loop has run away.
    pub output: Vec<f64>,
    /// What enters the nonlinearity.
    pub entering: Vec<f64>,
}

impl FeedbackModel {
    /// A loop that has not settled after this many samples under a constant input has no steady state to start from.
    pub const LONGEST_REST: usize = 100_000;
    /// The change of the state from sample to sample, relative to its size, below which a loop has settled: the size of rounding.
    pub const AT_REST: f64 = 1e-13;

    /// The number of states.
    pub fn order(&self) -> usize {
        self.state.len()
    }

    /// The free run from the steady state that belongs to the input's mean; the output is NaN where it has run away.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        self.run(input).output
    }

    /// [`simulate`](Self::simulate), and the nonlinearity's input.
    pub fn run(&self, input: &[f64]) -> LoopRun {
        let level = input.iter().sum::<f64>() / input.len().max(1) as f64;
        self.run_from(input, level, &[])
    }

    /// The free run from the steady state that belongs to a constant input, plus `state`; states that are missing are zero.
    pub fn run_from(&self, input: &[f64], level: f64, state: &[f64]) -> LoopRun {
        let mut x = self.rest(level);
        x.iter_mut().zip(state).for_each(|(x, s)| *x += s);
        let mut run = LoopRun {
            output: Vec::with_capacity(input.len()),
            entering: Vec::with_capacity(input.len()),
        };
        let limit = self.run_away();
        for &u in input {
            let step = self.step(&mut x, u);
            if !(step.output.abs() <= limit && step.entering.abs() <= limit) {
                break;
            }
            run.output.push(step.output);
            run.entering.push(step.entering);
        }
        run.output.resize(input.len(), f64::NAN);
        run.entering.resize(input.len(), f64::NAN);
        run
    }

    /// The state in which the loop rests under a constant input; zero if it does not come to rest.
    fn rest(&self, level: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.order()];
        let limit = self.run_away();
        for _ in 0..Self::LONGEST_REST {
            let before = x.clone();
            let step = self.step(&mut x, level);
            if !(step.output.abs() <= limit) {
                break;
            }
            let size = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if x.iter()
                .zip(&before)
                .all(|(a, b)| (a - b).abs() <= Self::AT_REST * size)
            {
                return x;
            }
        }
        vec![0.0; self.order()]
    }

    /// The size beyond which the output or the nonlinearity's input has run away.
    pub fn run_away(&self) -> f64 {
        let FeedbackLevels { output, entering, .. } = self.levels;
        let (x, y) = (self.nonlinearity.x(), self.nonlinearity.y());
        let sizes = [x[0], x[x.len() - 1], y[0], y[y.len() - 1], output, entering];
        RUN_AWAY * sizes.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
    }

    fn step(&self, x: &mut [f64], u: f64) -> LoopStep {
        let FeedbackLevels {
            input,
            nonlinearity,
            output,
            entering,
        } = self.levels;
        let u = u - input;
        let z = entering + dot(&self.state_to_nonlinearity, x) + self.input_to_nonlinearity * u;
        let w = self.nonlinearity.value(z) - nonlinearity;
        let y = output + dot(&self.state_to_output, x) + self.input_to_output * u + self.nonlinearity_to_output * w;
        let inputs = self.input_to_state.iter().zip(&self.nonlinearity_to_state);
        let next: Vec<f64> = (self.state.iter().zip(inputs))
            .map(|(row, (bu, bw))| dot(row, x) + bu * u + bw * w)
            .collect();
        x.copy_from_slice(&next);
        LoopStep { output: y, entering: z }
    }

    /// Whether the linear part is unstable without the nonlinearity. From a wrong initial state, such a loop may never come back to the data.
    pub fn is_unstable_alone(&self) -> bool {
        let around = self.transfer_function(LoopInput::Nonlinearity, LoopOutput::Nonlinearity);
        around.is_ok_and(|around| !around.is_stable_or_integrates())
    }

    /// The transfer function of the linear part between two of its signals.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data): `NonFinite`.
    pub fn transfer_function(&self, from: LoopInput, to: LoopOutput) -> Result<TransferFunction> {
        let n = self.order();
        let b = match from {
            LoopInput::Input => &self.input_to_state,
            LoopInput::Nonlinearity => &self.nonlinearity_to_state,
        };
        let c = match to {
            LoopOutput::Output => &self.state_to_output,
            LoopOutput::Nonlinearity => &self.state_to_nonlinearity,
        };
        let d = match (from, to) {
            (LoopInput::Input, LoopOutput::Output) => self.input_to_output,
            (LoopInput::Nonlinearity, LoopOutput::Output) => self.nonlinearity_to_output,
            (LoopInput::Input, LoopOutput::Nonlinearity) => self.input_to_nonlinearity,
            (LoopInput::Nonlinearity, LoopOutput::Nonlinearity) => 0.0,
        };
        // Faddeev and LeVerrier: adj(zI - A) = M_1 z^(n-1) + M_2 z^(n-2) + ..., M_1 = I, M_(k+1) = A M_k + a_k I.
        let mut m: Vec<Vec<f64>> = (0..n).map(|i| unit(n, i)).collect();
        let (mut numerator, mut denominator) = (vec![d], vec![1.0]);
        for k in 1..=n {
            let mb: Vec<f64> = m.iter().map(|row| dot(row, b)).collect();
            let am: Vec<Vec<f64>> = (self.state.iter())
                .map(|row| (0..n).map(|j| (0..n).map(|i| row[i] * m[i][j]).sum()).collect())
                .collect();
            let a = -(0..n).map(|i| am[i][i]).sum::<f64>() / k as f64;
            numerator.push(d * a + dot(c, &mb));
            denominator.push(a);
            m = am;
            (0..n).for_each(|i| m[i][i] += a);
        }
        // Cancelled coefficients leave rounding errors, which would give zeros far away.
        let size = numerator.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
        numerator
            .iter_mut()
            .filter(|b| b.abs() <= ROUNDING * size)
            .for_each(|b| *b = 0.0);
        TransferFunction::new(numerator, denominator)
    }

    /// The loop with a straight line of this slope in place of the nonlinearity: linear from the input to the output.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data): `NonFinite`.
    pub fn with_slope(&self, slope: f64) -> Result<TransferFunction> {
        let mut linear = self.clone();
        for (i, b) in self.nonlinearity_to_state.iter().enumerate() {
            let row = linear.state[i].iter_mut().zip(&self.state_to_nonlinearity);
            row.for_each(|(a, c)| *a += b * slope * c);
            linear.input_to_state[i] += b * slope * self.input_to_nonlinearity;
        }
        let direct = self.nonlinearity_to_output * slope;
        let output = linear.state_to_output.iter_mut().zip(&self.state_to_nonlinearity);
        output.for_each(|(c, z)| *c += direct * z);
        linear.input_to_output += direct * self.input_to_nonlinearity;
        linear.transfer_function(LoopInput::Input, LoopOutput::Output)
    }

    /// What enters the nonlinearity while the loop rests under the input's level.
    pub fn resting_point(&self) -> f64 {
        let FeedbackLevels { input, entering, .. } = self.levels;
        entering + dot(&self.state_to_nonlinearity, &self.rest(input))
    }

    /// The mean slope of the nonlinearity between two points.
    pub fn mean_slope(&self, low: f64, high: f64) -> f64 {
        let rise = self.nonlinearity.value(high) - self.nonlinearity.value(low);
        if high > low { rise / (high - low) } else { 0.0 }
    }

    /// Samples after which the response depends on the initial state only by `share` of its size. The loop is linearised at points over the
    /// nonlinearity's range; the slowest one that settles counts.
    pub fn settling(&self, share: f64) -> usize {
        let x = self.nonlinearity.x();
        let (low, high) = (x[0], x[x.len() - 1]);
        let width = (high - low) / SETTLING_POINTS as f64;
        let closed = |i: usize| {
            let [left, right] = [i, i + 1].map(|k| low + width * k as f64);
            self.with_slope(self.mean_slope(left, right)).ok()?.poles()
        };
        let radii = (0..SETTLING_POINTS).filter_map(closed);
        let radii = radii.map(|poles| poles.iter().map(|p| p.norm()).fold(0.0, f64::max));
        let slowest = radii.filter(|r| *r < 1.0 - 1e-9).reduce(f64::max);
        slowest.map_or(UNSETTLED, |radius| {
            (share.ln() / radius.max(1e-6).ln()).ceil() as usize + 1
        })
    }

    /// What is wrong with a model that was read; `None` if it can be simulated.
    pub fn problem(&self) -> Option<String> {
        let n = self.order();
        if !(1..=LARGEST_ORDER).contains(&n) {
            return Some(format!(
                "a feedback model has {n} states, but must have 1 to {LARGEST_ORDER}"
            ));
        }
        let columns = [
            &self.input_to_state,
            &self.nonlinearity_to_state,
            &self.state_to_output,
            &self.state_to_nonlinearity,
        ];
        if self.state.iter().chain(columns).any(|row| row.len() != n) {
            return Some(format!("a feedback model of {n} states has a matrix of another size"));
        }
        let FeedbackLevels {
            input,
            nonlinearity,
            output,
            entering,
        } = self.levels;
        let direct = [
            self.input_to_output,
            self.nonlinearity_to_output,
            self.input_to_nonlinearity,
        ];
        let numbers = self.state.iter().chain(columns).flatten().chain(&direct);
        let finite = numbers
            .chain(&[input, nonlinearity, output, entering])
            .all(|v| v.is_finite());
        if !finite {
            return Some("a feedback model has a number that is not finite".to_owned());
        }
        let too_large = !self.run_away().is_finite();
        too_large.then(|| "a feedback model has numbers so large that its signals cannot be computed".to_owned())
    }
}

/// One sample of a run.
struct LoopStep {
    output: f64,
    entering: f64,
}

fn unit(n: usize, i: usize) -> Vec<f64> {
    (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()
}
