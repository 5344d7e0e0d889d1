//! Several inputs, each through a static nonlinearity and linear dynamics of its own.

use super::{Progress, Request, Run, Structure, tried_branches};
use crate::error::Result;
use crate::identify::InputBranch;
use crate::identify::MultipleInputs;
use crate::identify::block::Stage;
use crate::identify::result::{
    Detail, Identification, LinearBlock, NamedBlock, Path, Place, StaticBlock, StructureName,
};

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "multiple-inputs",
        title: "multiple-input Hammerstein",
    },
    description: "several inputs, each through a static nonlinearity and linear dynamics of its own",
    inputs: 1..=usize::MAX,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let method = MultipleInputs {
        fresh_share: request.options.fresh_share,
    };
    let report = &mut |stage: Stage| progress(stage.name());
    let found = method.identify_with(request.record()?, request.inputs, request.output, report)?;
    let count = found.branches.len();
    let run = Run {
        model: found.model.block(),
        paths: found.branches.into_iter().map(path).collect(),
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: found.verdicts,
        warnings: found.warnings,
    };
    let note = "each with blocks of its own";
    Ok(Identification {
        is_sum: true,
        tried: found.tried.iter().map(tried_branches).collect(),
        details: vec![Detail::sentence(Place::Fact, "Inputs", count.to_string(), note)],
        ..run.identification(&ROW, request)?
    })
}

fn path(branch: InputBranch) -> Path {
    let curve = StaticBlock::spline(branch.nonlinearity, branch.breakpoints, branch.kinks);
    Path {
        inputs: vec![branch.input],
        blocks: vec![
            NamedBlock::new("nonlinearity", "Nonlinearity", curve),
            NamedBlock::new("linear", "Linear part", LinearBlock::of(branch.linear)),
        ],
    }
}
