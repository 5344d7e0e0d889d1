//! A sum of branches from one input.

use super::{Progress, Request, Run, Structure, path};
use crate::error::Result;
use crate::identify::Parallel;
use crate::identify::block::Stage;
use crate::identify::result::{
    Detail, Identification, LinearBlock, NamedBlock, Place, StaticBlock, StructureName, Values,
};
use crate::identify::{ParallelBranch, TriedSum};

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "parallel",
        title: "parallel",
    },
    description: "a sum of branches from one input: each a static nonlinearity and linear dynamics, with linear dynamics before it if needed",
    inputs: 1..=1,
    options: &["branches"],
    complexity: None,
    identify,
};

/// Why branches are not to be read one by one.
const ONLY_THE_SUM: &str =
    "the record determines the branches' sum; parts of it can be moved from one branch to another";

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let method = Parallel {
        branches: request.options.branches,
        fresh_share: request.options.fresh_share,
    };
    let report = &mut |stage: Stage| progress(stage.name());
    let found = method.identify_with(request.record()?, request.input()?, request.output, report)?;
    let with_fronts = found.branches.iter().any(|b| b.front.is_some());
    let run = Run {
        model: found.model,
        paths: found.branches.into_iter().map(|b| path(request, blocks(b))).collect(),
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    let branch = match with_fronts {
        true => "linear dynamics, a static nonlinearity, linear dynamics",
        false => "a static nonlinearity, then linear dynamics",
    };
    let count = counted_branches(run.paths.len());
    let why = format!("smallest Schwarz criterion, unless given; {ONLY_THE_SUM}");
    Ok(Identification {
        description: format!("a sum of {count}: {branch}"),
        details: vec![Detail::sentence(Place::ChoiceAndText, "Branches", count, &why)],
        tried: found.tried.iter().map(tried).collect(),
        is_sum: true,
        ..run.identification(&ROW, request)?
    })
}

fn counted_branches(count: usize) -> String {
    match count {
        1 => "1 branch".to_owned(),
        n => format!("{n} branches"),
    }
}

/// The blocks of a branch, and those of its second way through an instant between the samples.
fn blocks(branch: ParallelBranch) -> Vec<NamedBlock> {
    let curve = StaticBlock::spline(branch.nonlinearity, branch.breakpoints, Vec::new());
    let curve = NamedBlock::new("nonlinearity", "Nonlinearity", curve);
    let back = LinearBlock::of(branch.back);
    match branch.front {
        None => vec![curve, NamedBlock::new("linear", "Linear part", back)],
        Some(front) => vec![
            NamedBlock::new("front", "Front linear part", LinearBlock::of(front)),
            curve,
            NamedBlock::new("back", "Back linear part", back),
        ],
    }
}

fn tried(t: &TriedSum) -> Values {
    Values::new([
        ("front_orders", t.front_orders.as_slice().into()),
        ("back_orders", t.back_orders.as_slice().into()),
        ("pieces", t.pieces.as_slice().into()),
        ("samples", t.samples.into()),
        ("relative_error", t.relative_error.into()),
        ("bic", t.bic.into()),
    ])
}
