//! Linear dynamics alone.

use super::{Progress, Request, Run, Structure, path, start_details};
use crate::error::Result;
use crate::identify::result::{Detail, Identification, LinearBlock, NamedBlock, StructureName, Value};
use crate::identify::structures::linear;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "linear",
        title: "linear",
    },
    description: "linear dynamics alone",
    inputs: 1..=1,
    options: &[],
    complexity: Some(1),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let found = request.fit_prepared("a linear fit (besides the fresh part)", progress, linear::fit)?;
    let linear = NamedBlock::new("linear", "Linear part", LinearBlock::of(found.linear));
    let run = Run {
        model: found.model,
        paths: vec![path(request, vec![linear])],
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    let start = "the order of the linear approximation with the smallest Schwarz criterion";
    let mut details = start_details(start, &found.approximations, &run.paths);
    details.push(Detail::new("nonlinearity", Value::None).unsaved());
    Ok(Identification {
        details,
        ..run.identification(&ROW, request)?
    })
}
