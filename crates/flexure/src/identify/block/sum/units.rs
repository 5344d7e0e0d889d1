//! A sum of branches in the record's units.

use super::super::{Blocks, Form, Prepared, blocks};
use super::search::SearchResult;
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::Curve;

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
    /// The blocks in cascade.
    pub fn model(&self) -> Block {
        let front = self.front.iter().map(|front| Block::Linear(front.clone()));
        let rest = [
            Block::Static(self.nonlinearity.clone()),
            Block::Linear(self.back.clone()),
        ];
        Block::Series(front.chain(rest).collect())
    }
}

/// A sum in the record's units.
pub(in crate::identify) struct InUnits {
    pub branches: Vec<ParallelBranch>,
    pub offset: f64,
    pub model: Block,
}

impl InUnits {
    /// Of a sum that was fitted to prepared signals, whose output's mean the first branch has.
    pub fn new(found: &SearchResult, prepared: &Prepared) -> Result<InUnits> {
        let mut scaled = prepared.clone();
        let (mut branches, mut parallel, mut offset) = (Vec::new(), Vec::new(), 0.0);
        for cascade in &found.sum.branches {
            let own = blocks(cascade, &scaled)?;
            scaled.scales.output.mean = 0.0;
            offset += own.offset;
            let branch = branch(&own, found.form)?;
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

/// A Hammerstein branch's front is only a delay, which is the back's as well; a cascade whose front came out so is one too.
fn branch(own: &Blocks, form: Form) -> Result<ParallelBranch> {
    let mut passing = own.front.b().iter().skip_while(|b| **b == 0.0);
    let only_delays = own.front.a().len() == 1 && passing.next() == Some(&1.0) && passing.all(|b| *b == 0.0);
    let hammerstein = form == Form::Hammerstein || (only_delays && own.intersample.is_none());
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
