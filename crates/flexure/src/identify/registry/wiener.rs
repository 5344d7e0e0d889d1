//! Linear dynamics, then a static nonlinearity.

use super::{Progress, Request, Run, Structure, path, start_details, tried_cascade};
use crate::error::Result;
use crate::identify::WienerStart;
use crate::identify::result::{Identification, LinearBlock, NamedBlock, StaticBlock, StructureName};
use crate::identify::structures::wiener;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "wiener",
        title: "Wiener",
    },
    description: "linear dynamics, then a static nonlinearity",
    inputs: 1..=1,
    options: &[],
    complexity: Some(2),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let found = request.fit_prepared("a Wiener fit (besides the fresh part)", progress, wiener::fit)?;
    let curve = StaticBlock::spline(found.nonlinearity, found.breakpoints, found.kinks);
    let blocks = vec![
        NamedBlock::new("linear", "Linear part", LinearBlock::of(found.linear)),
        NamedBlock::new("nonlinearity", "Nonlinearity", curve),
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
    let start = match found.start {
        WienerStart::LinearApproximation => "those of the best linear approximation",
        WienerStart::HigherMoments => {
            "those of an impulse response from higher moments of input and output, which did better than linear approximations"
        }
    };
    Ok(Identification {
        details: start_details(start, &found.approximations, &run.paths),
        parameters: found.tried.last().map_or(1, |t| t.parameters()),
        tried: found.tried.iter().map(tried_cascade).collect(),
        ..run.identification(&ROW, request)?
    })
}
