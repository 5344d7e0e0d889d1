//! A polynomial of past outputs and inputs: a reference without blocks.

use super::{Progress, Request, Run, Structure, path};
use crate::error::Result;
use crate::identify::result::{BlockKind, Detail, Identification, NamedBlock, Place, StructureName, Values};
use crate::identify::{Narx, TriedNarx};
use crate::model::Block;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "narx",
        title: "polynomial NARX",
    },
    description: "a polynomial of past outputs and inputs: a reference without blocks",
    inputs: 1..=1,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, _: &mut Progress<'_>) -> Result<Identification> {
    let method = Narx {
        fresh_share: request.options.fresh_share,
    };
    let found = method.identify(request.record()?, request.input()?, request.output)?;
    let model = found.model;
    let (order, delay) = (model.outputs, model.delay);
    let lags = format!("{} + {}", model.outputs, model.inputs);
    let free = match found.bounded {
        true => "stays within bounds by itself",
        false => "runs away on this record and is held at its bounds",
    };
    let tried: Vec<Values> = found.tried.iter().map(tried).collect();
    let why =
        "smallest free-run error on the last quarter of the fit's samples, among models that stay within bounds there";
    let held = "what is fed back is held within an output's span beyond what the fit saw";
    let details = vec![
        Detail::sentence(Place::Fact, "Lags", lags, "past outputs and inputs"),
        Detail::new("degree", found.degree).shown(Place::Fact, "Degree", found.degree.to_string(), "of the polynomial"),
        Detail::sentence(Place::Fact, "Terms", model.terms.len().to_string(), "monomials"),
        Detail::sentence(
            Place::Choice,
            "Lags and degree",
            format!("{} structures tried", tried.len()),
            why,
        ),
        Detail::new("bounded", found.bounded).shown(Place::ChoiceAndText, "Free run", free, held),
    ];
    let run = Run {
        paths: vec![path(
            request,
            vec![NamedBlock::new("narx", "Terms", BlockKind::Narx(model.clone()))],
        )],
        model: Block::Narx(model),
        output_offset: 0.0,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: vec![found.verdict],
        warnings: found.warnings,
    };
    Ok(Identification {
        method: "ridge",
        order,
        delay,
        tried,
        details,
        ..run.identification(&ROW, request)?
    })
}

fn tried(t: &TriedNarx) -> Values {
    Values::new([
        ("past_outputs", t.outputs.into()),
        ("past_inputs", t.inputs.into()),
        ("degree", t.degree.into()),
        ("penalty", t.penalty.into()),
        ("relative_error", t.relative_error.into()),
        ("bounded", t.bounded.into()),
    ])
}
