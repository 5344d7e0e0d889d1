//! A model is blocks in series, in parallel or in a loop; a block is a static nonlinearity or a linear system.
//!
//! Hammerstein is `Series[Static, Linear]`, Wiener `Series[Linear, Static]`, Wiener-Hammerstein
//! `Series[Linear, Static, Linear]`, a sum of them `Parallel[Series[..], ..]`, a Hammerstein model of several inputs
//! `Inputs[Series[..], ..]`, or `Series[Surface, Linear]` where they act jointly: all are values of one type, so simulating, saving and
//! exporting are each one walk over it. The references without blocks are blocks themselves.

mod feedback;
mod narx;
mod volterra;

use serde::{Deserialize, Serialize};

pub use feedback::{FeedbackLevels, FeedbackModel, LoopInput, LoopOutput, LoopRun};
pub use narx::{NarxModel, NarxTerm};
pub use volterra::VolterraModel;

use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::nonlinearity::{Curve, Surface};
use crate::parallel;

/// The largest lag of a model that can be simulated.
const LARGEST_LAG: usize = 1_000_000;

/// A block, or several in series or in parallel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A memoryless nonlinearity.
    Static(Curve),
    /// A linear, time-invariant, discrete-time system.
    Linear(TransferFunction),
    /// Blocks in cascade, the input entering the first.
    Series(Vec<Block>),
    /// Blocks that share their input and whose outputs add up.
    Parallel(Vec<Block>),
    /// One block for each input; their outputs add up.
    Inputs(Vec<Block>),
    /// A number that is added.
    Offset(f64),
    /// A memoryless nonlinearity of several inputs.
    Surface(Surface),
    /// A static nonlinearity in a feedback loop.
    Feedback(Box<FeedbackModel>),
    /// A polynomial of past outputs and inputs.
    Narx(NarxModel),
    /// A Volterra series.
    Volterra(VolterraModel),
}

impl Block {
    /// The free-run response to `input`, one value per sample; a model with several inputs gets this one for each.
    ///
    /// Every linear block starts in the steady state that belongs to the mean of its input.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        self.run(&[input])
    }

    /// [`simulate`](Self::simulate) under several inputs.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch` if there are not as many as [`inputs`](Self::inputs), or if they differ in length.
    pub fn simulate_inputs(&self, inputs: &[&[f64]]) -> Result<Vec<f64>> {
        self.check_inputs(inputs)?;
        Ok(self.run(inputs))
    }

    /// [`simulate_inputs`](Self::simulate_inputs), but every linear block starts in the steady state that belongs to the first sample of
    /// its input: no sample of the output depends on later inputs. This is how an exported model starts.
    ///
    /// # Errors
    /// Those of [`simulate_inputs`](Self::simulate_inputs).
    pub fn simulate_from_first(&self, inputs: &[&[f64]]) -> Result<Vec<f64>> {
        self.check_inputs(inputs)?;
        Ok(self.walk(inputs, &mut |block, entering| {
            let input = first(entering);
            let level = input.first().copied().unwrap_or_default();
            match block {
                Block::Linear(system) => system.simulate_from(input, level, &[]),
                Block::Feedback(model) => model.run_from(input, level, &[]).output,
                _ => block.respond(entering),
            }
        }))
    }

    /// Whether it has a loop whose linear part is unstable by itself ([`FeedbackModel::is_unstable_alone`]).
    pub fn has_unstable_loop(&self) -> bool {
        match self {
            Block::Feedback(model) => model.is_unstable_alone(),
            Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) => {
                blocks.iter().any(Block::has_unstable_loop)
            }
            _ => false,
        }
    }

    /// The number of inputs.
    pub fn inputs(&self) -> usize {
        match self {
            Block::Static(_) | Block::Linear(_) | Block::Offset(_) => 1,
            Block::Feedback(_) | Block::Narx(_) | Block::Volterra(_) => 1,
            Block::Surface(surface) => surface.inputs(),
            Block::Inputs(blocks) => blocks.len(),
            Block::Series(blocks) => blocks.first().map_or(1, Block::inputs),
            Block::Parallel(blocks) => blocks.iter().map(Block::inputs).max().unwrap_or(1),
        }
    }

    /// Refuses inputs that are not the block's.
    pub(crate) fn check_inputs(&self, inputs: &[&[f64]]) -> Result<()> {
        let mismatch = |name: String, got: usize, expected: usize| Error::length(name, got, expected);
        if inputs.len() != self.inputs() {
            return Err(mismatch("the inputs".to_owned(), inputs.len(), self.inputs()));
        }
        let samples = inputs.first().map_or(0, |u| u.len());
        match inputs.iter().position(|u| u.len() != samples) {
            Some(i) => Err(mismatch(format!("input {i}"), inputs[i].len(), samples)),
            None => Ok(()),
        }
    }

    /// The response to inputs of one length; the last one stands for missing ones.
    pub(crate) fn run(&self, inputs: &[&[f64]]) -> Vec<f64> {
        self.walk(inputs, &mut Block::respond)
    }

    /// The response to `inputs`; `report` is called with every block that contains no other block, in order, and with its output.
    pub(crate) fn visit(&self, inputs: &[&[f64]], report: &mut impl FnMut(&Block, &[f64])) -> Vec<f64> {
        self.walk(inputs, &mut |block, entering| {
            let output = block.respond(entering);
            report(block, &output);
            output
        })
    }

    /// The mean input of every linear block over a free run under `inputs`, in the order of the blocks.
    pub(crate) fn levels(&self, inputs: &[&[f64]], levels: &mut Vec<f64>) -> Vec<f64> {
        self.walk(inputs, &mut |block, entering| {
            if let Block::Linear(_) | Block::Feedback(_) = block {
                let input = first(entering);
                levels.push(input.iter().sum::<f64>() / input.len().max(1) as f64);
            }
            block.respond(entering)
        })
    }

    /// The response to `inputs` if every linear block starts in the steady state for its level, plus its states
    /// ([`TransferFunction::simulate_from`]); both lists have the order of the blocks.
    pub(crate) fn simulate_from(&self, inputs: &[&[f64]], levels: &mut &[f64], states: &mut &[f64]) -> Vec<f64> {
        self.walk(inputs, &mut |block, entering| match block {
            Block::Linear(_) | Block::Feedback(_) => {
                let (level, others) = levels.split_first().unwrap_or((&0.0, &[]));
                let (own, rest) = states.split_at(block.states().min(states.len()));
                (*levels, *states) = (others, rest);
                match block {
                    Block::Feedback(model) => model.run_from(first(entering), *level, own).output,
                    Block::Linear(system) => system.simulate_from(first(entering), *level, own),
                    _ => Vec::new(),
                }
            }
            _ => block.respond(entering),
        })
    }

    /// The response; `respond` gives that of every block that contains no other block.
    fn walk(&self, inputs: &[&[f64]], respond: &mut impl FnMut(&Block, &[&[f64]]) -> Vec<f64>) -> Vec<f64> {
        let samples = first(inputs).len();
        match self {
            Block::Series(blocks) => {
                let Some((front, others)) = blocks.split_first() else {
                    return first(inputs).to_vec();
                };
                let entering = front.walk(inputs, respond);
                others.iter().fold(entering, |signal, b| b.walk(&[&signal], respond))
            }
            Block::Parallel(blocks) => added(blocks.iter().map(|b| b.walk(inputs, respond)), samples),
            Block::Inputs(blocks) => {
                let each = blocks.iter().enumerate();
                added(each.map(|(i, b)| b.walk(&[nth(inputs, i)], respond)), samples)
            }
            _ => respond(self, inputs),
        }
    }

    /// The response of a block that contains no other block.
    fn respond(&self, inputs: &[&[f64]]) -> Vec<f64> {
        let input = first(inputs);
        match self {
            Block::Static(curve) => parallel::numbers(input.len(), |i| curve.value(input[i])),
            Block::Linear(system) => system.simulate_from_mean(input),
            Block::Offset(offset) => input.iter().map(|u| u + offset).collect(),
            Block::Feedback(model) => model.simulate(input),
            Block::Narx(model) => model.simulate(input),
            Block::Volterra(model) => model.simulate(input),
            Block::Surface(surface) => {
                let all: Vec<&[f64]> = (0..surface.inputs()).map(|i| nth(inputs, i)).collect();
                surface.values(&all)
            }
            Block::Series(_) | Block::Parallel(_) | Block::Inputs(_) => self.run(inputs),
        }
    }

    /// The number of states of all linear blocks.
    pub fn states(&self) -> usize {
        match self {
            Block::Static(_) | Block::Offset(_) | Block::Surface(_) | Block::Narx(_) | Block::Volterra(_) => 0,
            Block::Linear(system) => system.states(),
            Block::Feedback(model) => model.order(),
            Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) => {
                blocks.iter().map(Block::states).sum()
            }
        }
    }

    /// The samples after which the response depends on the initial state only by `share` of its size: the longest cascade's sum of its
    /// linear blocks' settling times.
    pub fn settling(&self, share: f64) -> usize {
        match self {
            Block::Static(_) | Block::Offset(_) | Block::Surface(_) => 0,
            Block::Linear(system) => system.settling(share),
            Block::Feedback(model) => model.settling(share),
            Block::Narx(model) => model.settling(share),
            Block::Volterra(model) => model.memory(),
            Block::Series(blocks) => blocks.iter().map(|b| b.settling(share)).sum(),
            Block::Parallel(blocks) | Block::Inputs(blocks) => {
                blocks.iter().map(|b| b.settling(share)).max().unwrap_or(0)
            }
        }
    }
}

fn first<'a>(inputs: &[&'a [f64]]) -> &'a [f64] {
    inputs.first().copied().unwrap_or_default()
}

/// The input of this index; the last one stands for missing ones.
fn nth<'a>(inputs: &[&'a [f64]], i: usize) -> &'a [f64] {
    inputs.get(i).or(inputs.last()).copied().unwrap_or_default()
}

/// The sum of signals.
fn added(signals: impl Iterator<Item = Vec<f64>>, samples: usize) -> Vec<f64> {
    let mut sum = vec![0.0; samples];
    for signal in signals {
        sum.iter_mut().zip(signal).for_each(|(total, value)| *total += value);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nonlinearity::Outside;

    fn wiener_hammerstein() -> Block {
        let curve = Curve::new(vec![-1.0, 0.0, 2.0], vec![1.0, 0.0, 3.0], Outside::Linear).unwrap();
        let linear = |b: Vec<f64>, a: Vec<f64>| Block::Linear(TransferFunction::new(b, a).unwrap());
        Block::Series(vec![
            linear(vec![0.0, 0.5], vec![1.0, -0.8]),
            Block::Static(curve),
            linear(vec![1.0, 0.3], vec![1.0, -0.9]),
        ])
    }

    #[test]
    fn a_run_from_the_first_sample_rests_under_a_constant_and_does_not_know_the_future() {
        let block = wiener_hammerstein();
        // Static gains 2.5 and 13, and f(5) = 7.5.
        for y in block.simulate_from_first(&[&[2.0; 30]]).unwrap() {
            assert!((y - 13.0 * 7.5).abs() < 1e-11, "{y}");
        }
        let u: Vec<f64> = (0..50).map(|n| (0.7 * f64::from(n)).sin()).collect();
        let whole = block.simulate_from_first(&[&u]).unwrap();
        assert_eq!(block.simulate_from_first(&[&u[..20]]).unwrap(), whole[..20]);
        assert_ne!(block.simulate(&u)[..20], block.simulate(&u[..20]));
        assert!(block.simulate_from_first(&[&u, &u]).is_err());
    }
}
