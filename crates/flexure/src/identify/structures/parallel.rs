//! Sums of Wiener-Hammerstein branches or of Hammerstein branches with one input.
//!
//! $$ Y_n = \sum_i H_i(z) f_i(W^{(i)}_n) + e_n, \qquad W^{(i)}_n = G_i(z) U_n $$
//! (Sandberg 1991; Schoukens, Marconato, Pintelon, Vandersteen, Rolain 2015), from the record alone:
//!
//! 1. Hammerstein branches, whose $G_i$ is 1: least squares over all products of B-splines of the input and numerator
//!    coefficients with a common denominator, of orders 0 to 8; the matrix of those products has the number of branches as
//!    its rank, and its dominant parts are the branches;
//! 2. the best of them refined by Levenberg-Marquardt on the simulation error over all parameters of all branches, every
//!    branch with a denominator of its own;
//! 3. pieces of the nonlinearities, poles and numerator coefficients added and taken away, branch by branch, while Schwarz's
//!    criterion falls;
//! 4. Wiener-Hammerstein branches, if the input explains a part of the error of Hammerstein branches: the poles of the best linear
//!    approximation are assigned to the fronts and the backs of all branches. Assignments start at random, and one pole moves at a
//!    time while the same kind of least squares gets better; then steps 2 and 3;
//! 5. the number of branches, unless it is given, and their form by Schwarz's criterion; a last refinement on all samples.
//!
//! Schoukens et al. take the branches' dynamics from linear approximations at several levels of the input. A single
//! record has one level: here the products' dominant parts take their place.
//!
//! The record determines only the sum. Scales and delays can move within a branch. Hammerstein branches can be mixed: the sum is the same
//! with $f = M f'$ and $H' = M^T H$ for any invertible matrix M. Wiener-Hammerstein branches can exchange linear dynamics through a
//! straight part of a nonlinearity. Branches are comparable with physical ones only where the signals that enter their
//! nonlinearities differ.

use std::ops::ControlFlow;

use super::super::block::{Blocks, Monitor, Prepared, Stage, SumResult, TriedSum, blocks, delays, find_sum};
use super::super::outcome::{Verdict, Warning};
use super::super::samples::Samples;
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::Curve;
use crate::record::Record;

/// Most branches that are tried where their number is not given.
const MOST_CHOSEN: usize = 3;
/// Most branches.
const MOST: usize = 5;
/// Samples that the delay is looked for in.
const DELAY_SAMPLES: usize = 10_000;

/// The identification of a sum of branches.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `branches` | number of branches | 1 to 5 | Schwarz's criterion, 1 to 3 |
/// | `fresh_share` | share at the end kept for the verdict | 0.05 to 0.9 | 0.25 |
///
/// ```
/// use flexure::identify::Parallel;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let [slow, fast] = [0.8, -0.5].map(|pole| TransferFunction::new(vec![1.0], vec![1.0, -pole]));
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..3000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let square: Vec<f64> = u.iter().map(|u| u * u).collect();
/// let limited: Vec<f64> = u.iter().map(|u| (3.0 * u).tanh()).collect();
/// let (p, q) = (slow?.simulate(&square), fast?.simulate(&limited));
/// let y: Vec<f64> = p.iter().zip(&q).map(|(p, q)| p + q).collect();
/// let method = Parallel { branches: Some(2), ..Default::default() };
/// let result = method.identify(&Record::new([("u", u), ("y", y)])?, "u", "y")?;
/// assert_eq!(result.branches.len(), 2);
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallel {
    /// The number of branches; `None` lets Schwarz's criterion choose.
    pub branches: Option<usize>,
    /// The share of the record that the verdict is made on.
    pub fresh_share: f64,
}

impl Default for Parallel {
    fn default() -> Self {
        Parallel {
            branches: None,
            fresh_share: 0.25,
        }
    }
}

/// One branch of a sum: linear, static, linear.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelBranch {
    /// The first linear block, of unit static or peak gain; `None` in a Hammerstein branch. Always stable.
    pub front: Option<TransferFunction>,
    /// The static nonlinearity, a cubic spline in tabulated form, straight on beyond the range of the fit.
    pub nonlinearity: Curve,
    /// Its breakpoints, increasing, in the unit of what enters it.
    pub breakpoints: Vec<f64>,
    /// The last linear block, of unit static or peak gain. Always stable.
    pub back: TransferFunction,
}

impl ParallelBranch {
    /// The blocks in series.
    pub fn model(&self) -> Block {
        let front = self.front.iter().map(|front| Block::Linear(front.clone()));
        let rest = [
            Block::Static(self.nonlinearity.clone()),
            Block::Linear(self.back.clone()),
        ];
        Block::Series(front.chain(rest).collect())
    }
}

/// An identified sum of branches with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelIdentification {
    /// The model, ready to simulate: `Parallel` of a `Series` for every branch (for two where a branch's nonlinearity acts
    /// between the samples too), and in series with that the output offset where there is one.
    pub model: Block,
    /// The branches at the samples.
    pub branches: Vec<ParallelBranch>,
    /// Added to the sum of the branches.
    pub output_offset: f64,
    /// The sums that were tried, in order.
    pub tried: Vec<TriedSum>,
    /// Samples `0..fitted` were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on.
    pub verdict: Verdict,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl ParallelIdentification {
    /// The number of poles of all linear blocks.
    pub fn order(&self) -> usize {
        let linear = self.branches.iter().flat_map(|b| b.front.iter().chain([&b.back]));
        linear.map(|g| g.a().len() - 1).sum()
    }

    /// The smallest of the branches' delays, in samples.
    pub fn delay(&self) -> usize {
        let of = |g: &TransferFunction| g.b().iter().take_while(|b| **b == 0.0).count();
        let each = self
            .branches
            .iter()
            .map(|b| b.front.as_ref().map_or(0, of) + of(&b.back));
        each.min().unwrap_or(0)
    }
}

impl Parallel {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// Those of [`Wiener::identify`](crate::identify::Wiener::identify).
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<ParallelIdentification> {
        self.identify_with(record, input, output, &mut |_| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// The result depends neither on `progress` nor on the number of threads.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify), and [`Error::Stopped`] if `progress` stopped it.
    pub fn identify_with(
        &self,
        record: &Record,
        input: &str,
        output: &str,
        progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<ParallelIdentification> {
        let counts = match self.branches {
            None => 1..=MOST_CHOSEN,
            Some(count) if (1..=MOST).contains(&count) => count..=count,
            Some(count) => {
                return Err(Error::parameter(
                    "the number of branches",
                    count as f64,
                    "between 1 and 5",
                ));
            }
        };
        let what = "a fit of branches in parallel (besides the fresh part)";
        let samples = Samples::new(record, input, output, self.fresh_share, what)?;
        let mut monitor = Monitor::new(progress);
        let (u, y) = (&samples.input()[..samples.fitted], &samples.y[..samples.fitted]);
        let prepared = Prepared::with_delay_at_most(u, y, delay(u, y), &mut monitor);
        let found = find_sum(&prepared, counts, &mut monitor);
        monitor.finished()?;
        let InUnits {
            branches,
            offset,
            model,
        } = InUnits::new(&found, &prepared)?;
        let (predicted, verdict, warnings) = samples.judged(&model, found.system.degrees())?;
        Ok(ParallelIdentification {
            model,
            branches,
            output_offset: offset,
            tried: found.tried.into_iter().map(TriedSum::from).collect(),
            fitted: samples.fitted,
            predicted,
            verdict,
            warnings,
        })
    }
}

/// The delay that functions of the input show, less some slack.
fn delay(u: &[f64], y: &[f64]) -> usize {
    let part = u.len().min(DELAY_SAMPLES);
    let prepared = Prepared::with_delay(&u[..part], &y[..part], 0);
    delays(&prepared.data).first().copied().unwrap_or(0)
}

/// A sum in the record's units.
struct InUnits {
    branches: Vec<ParallelBranch>,
    offset: f64,
    model: Block,
}

impl InUnits {
    /// Of a sum that was fitted to prepared signals, whose output's mean the first branch has.
    fn new(found: &SumResult, prepared: &Prepared) -> Result<InUnits> {
        let mut scaled = prepared.clone();
        let (mut branches, mut parallel, mut offset) = (Vec::new(), Vec::new(), 0.0);
        for branch in &found.system.branches {
            let own = blocks(branch, &scaled)?;
            scaled.scales.output.mean = 0.0;
            offset += own.offset;
            let branch = in_units(&own, found.hammerstein)?;
            parallel.push(branch.model());
            if let Some(between) = &own.intersample {
                parallel.push(Block::Series(vec![
                    Block::Linear(between.front.clone()),
                    Block::Static(between.nonlinearity.clone()),
                    Block::Linear(between.back.clone()),
                ]));
            }
            branches.push(branch);
        }
        let mut series = vec![Block::Parallel(parallel)];
        if offset != 0.0 {
            series.push(Block::Offset(offset));
        }
        let model = match <[Block; 1]>::try_from(series) {
            Ok([only]) => only,
            Err(several) => Block::Series(several),
        };
        Ok(InUnits {
            branches,
            offset,
            model,
        })
    }
}

/// A Hammerstein branch's front is only a delay, which is the back's as well; a branch whose front came out so is one too.
fn in_units(own: &Blocks, hammerstein: bool) -> Result<ParallelBranch> {
    let mut passing = own.front.b().iter().skip_while(|b| **b == 0.0);
    let only_delays = own.front.a().len() == 1 && passing.next() == Some(&1.0) && passing.all(|b| *b == 0.0);
    let hammerstein = hammerstein || (only_delays && own.intersample.is_none());
    let (front, back) = match hammerstein {
        true => {
            let delayed = own.front.b().iter().take_while(|b| **b == 0.0).map(|_| 0.0);
            let b = delayed.chain(own.back.b().iter().copied()).collect();
            (None, TransferFunction::new(b, own.back.a().to_vec())?)
        }
        false => (Some(own.front.clone()), own.back.clone()),
    };
    Ok(ParallelBranch {
        front,
        nonlinearity: own.curve.clone(),
        breakpoints: own.breakpoints.clone(),
        back,
    })
}
