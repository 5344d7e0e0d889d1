//! A static nonlinearity, linear dynamics, a static nonlinearity.

use super::{Progress, Request, Run, Structure, path, tried_branches};
use crate::error::Result;
use crate::identify::HammersteinWiener;
use crate::identify::block::Stage;
use crate::identify::result::{Detail, Identification, LinearBlock, NamedBlock, Place, StaticBlock, StructureName};

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "hammerstein-wiener",
        title: "Hammerstein-Wiener",
    },
    description: "a static nonlinearity, linear dynamics, a static nonlinearity",
    inputs: 1..=1,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let method = HammersteinWiener {
        fresh_share: request.options.fresh_share,
    };
    let report = &mut |stage: Stage| progress(stage.name());
    let found = method.identify_with(request.record()?, request.input()?, request.output, report)?;
    let input = StaticBlock::spline(found.input_nonlinearity, found.input_breakpoints, found.input_kinks);
    let output = StaticBlock::spline(found.output_nonlinearity, found.output_breakpoints, found.output_kinks);
    let blocks = vec![
        NamedBlock::new("nonlinearity", "Nonlinearity at the input", input),
        NamedBlock::new("linear", "Linear part", LinearBlock::of(found.linear)),
        NamedBlock::new("output_nonlinearity", "Nonlinearity at the output", output),
    ];
    let run = Run {
        model: found.model,
        paths: vec![path(request, blocks)],
        output_offset: 0.0,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    let why = "poles, numerator coefficients and delay added and taken away while Schwarz's criterion of the free-run error falls";
    Ok(Identification {
        tried: found.tried.iter().map(tried_branches).collect(),
        details: vec![Detail::sentence(Place::Choice, "Poles", found.order.to_string(), why)],
        ..run.identification(&ROW, request)?
    })
}
