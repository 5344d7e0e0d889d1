//! Linear dynamics, a static nonlinearity, linear dynamics.

use super::{Progress, Request, Run, Structure, path, start_details, tried_cascade};
use crate::error::Result;
use crate::identify::block::Intersample;
use crate::identify::result::{Detail, Identification, LinearBlock, NamedBlock, Place, StaticBlock, StructureName};
use crate::identify::structures::wiener_hammerstein;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "wiener-hammerstein",
        title: "Wiener-Hammerstein",
    },
    description: "linear dynamics, a static nonlinearity, linear dynamics",
    inputs: 1..=1,
    options: &[],
    complexity: Some(3),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let what = "a Wiener-Hammerstein fit (besides the fresh part)";
    let found = request.fit_prepared(what, progress, wiener_hammerstein::fit)?;
    let curve = StaticBlock::spline(found.nonlinearity, found.breakpoints, found.kinks);
    let mut blocks = vec![
        NamedBlock::new("front", "Front linear part", LinearBlock::of(found.front)),
        NamedBlock::new("nonlinearity", "Nonlinearity", curve),
        NamedBlock::new("back", "Back linear part", LinearBlock::of(found.back)),
    ];
    let second = found.intersample.is_some();
    blocks.extend(found.intersample.into_iter().flat_map(between_samples));
    let run = Run {
        model: found.model,
        paths: vec![path(request, blocks)],
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    let start = "those of the best linear approximation, shared out in every way";
    let mut details = start_details(start, &found.approximations, &run.paths);
    details.extend(second.then(|| {
        let why = "the nonlinearity acts between the samples too: a second branch, with the same nonlinearity and the same poles, adds to \
                   the output; chosen by Schwarz's criterion";
        Detail::sentence(Place::ChoiceAndText, "Between the samples", "2 instants", why)
    }));
    Ok(Identification {
        details,
        parameters: found.tried.last().map_or(1, |t| t.parameters()),
        tried: found.tried.iter().map(tried_cascade).collect(),
        ..run.identification(&ROW, request)?
    })
}

/// The blocks of the second way, through an instant between the samples.
pub(super) fn between_samples(second: Intersample) -> [NamedBlock; 3] {
    let curve = StaticBlock::spline(second.nonlinearity, Vec::new(), Vec::new());
    [
        NamedBlock::new(
            "intersample_front",
            "Front, between the samples",
            LinearBlock::of(second.front),
        ),
        NamedBlock::new("intersample_nonlinearity", "Nonlinearity, between the samples", curve),
        NamedBlock::new(
            "intersample_back",
            "Back, between the samples",
            LinearBlock::of(second.back),
        ),
    ]
    .map(|block| NamedBlock {
        between_samples: true,
        ..block
    })
}
