//! A regularised Volterra series of second order: a reference without blocks.

use super::{Progress, Request, Run, Structure, path};
use crate::error::Result;
use crate::identify::Volterra;
use crate::identify::result::{BlockKind, Detail, Identification, NamedBlock, Place, StructureName, Values};
use crate::model::Block;
use crate::text::number;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "volterra",
        title: "second-order Volterra",
    },
    description: "a regularised Volterra series of second order: a reference without blocks",
    inputs: 1..=1,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, _: &mut Progress<'_>) -> Result<Identification> {
    let method = Volterra {
        fresh_share: request.options.fresh_share,
    };
    let found = method.identify(request.record()?, request.input()?, request.output)?;
    let model = found.model;
    let priors = found
        .priors
        .map(|p| Values::new([("size", p.size.into()), ("decay", p.decay.into())]));
    let [first, second] = found
        .priors
        .map(|p| format!("size {}, decay {} a sample", number(p.size), number(p.decay)));
    let why = "largest marginal likelihood of a tuned-correlated prior";
    let lags = format!("{} and {}", model.first.len(), model.second_memory);
    let details = vec![
        Detail::sentence(Place::Fact, "Lags", lags, "of the kernels of first and second order"),
        Detail::new("noise", found.noise).shown(Place::Fact, "Noise", number(found.noise), "standard deviation"),
        Detail::sentence(Place::ChoiceAndText, "First-order prior", first, why),
        Detail::sentence(Place::ChoiceAndText, "Second-order prior", second, why),
        Detail::new("priors", priors.to_vec()),
    ];
    let delay = model.delay;
    let run = Run {
        paths: vec![path(
            request,
            vec![NamedBlock::new(
                "volterra",
                "Kernels",
                BlockKind::Volterra(model.clone()),
            )],
        )],
        model: Block::Volterra(model),
        output_offset: 0.0,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    Ok(Identification {
        method: "marginal-likelihood",
        delay,
        details,
        ..run.identification(&ROW, request)?
    })
}
