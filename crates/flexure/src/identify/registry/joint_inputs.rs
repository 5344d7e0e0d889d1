//! Several inputs that act jointly: one static nonlinearity of all of them, then linear dynamics.

use super::{Progress, Request, Run, Structure, path};
use crate::error::Result;
use crate::identify::block::Stage;
use crate::identify::result::{
    BlockKind, Detail, Identification, LinearBlock, NamedBlock, Place, Score, StructureName, Values,
};
use crate::identify::{JointInputs, TriedSurface};
use crate::text::number;

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "joint-inputs",
        title: "joint Hammerstein",
    },
    description: "two to four inputs: one static nonlinearity of all of them, then linear dynamics",
    inputs: 2..=4,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let method = JointInputs {
        fresh_share: request.options.fresh_share,
    };
    let report = &mut |stage: Stage| progress(stage.name());
    let found = method.identify_with(request.record()?, request.inputs, request.output, report)?;
    let pieces: Vec<String> = (found.nonlinearity.axes().iter())
        .map(|a| a.pieces.to_string())
        .collect();
    let scores = scores(&found.tried, found.nonlinearity.axes()[0].pieces);
    let blocks = vec![
        NamedBlock::new(
            "nonlinearity",
            "Joint nonlinearity",
            BlockKind::Surface(found.nonlinearity),
        ),
        NamedBlock::new("linear", "Linear part", LinearBlock::of(found.linear)),
    ];
    let run = Run {
        model: found.model,
        paths: vec![path(request, blocks)],
        output_offset: found.output_offset,
        fitted: found.fitted,
        predicted: found.predicted,
        verdicts: found.verdicts,
        warnings: found.warnings,
    };
    let why = "smallest generalised cross-validation score; the penalty on its bending, one for every input, maximises the marginal likelihood";
    let worth = Detail::new("effective_parameters", found.effective_parameters).shown(
        Place::Fact,
        "Parameters",
        number(found.effective_parameters),
        "that the nonlinearity is worth under its penalty",
    );
    let text = format!("{} pieces", pieces.join(" by "));
    Ok(Identification {
        tried: found.tried.iter().map(tried).collect(),
        details: vec![
            worth,
            Detail::sentence(Place::Choice, "Nonlinearity", text, why).scored(Some(scores)),
        ],
        ..run.identification(&ROW, request)?
    })
}

fn tried(t: &TriedSurface) -> Values {
    Values::new([
        ("pieces", t.pieces.into()),
        ("effective_parameters", t.effective_parameters.into()),
        ("relative_error", t.relative_error.into()),
        ("score", t.score.into()),
    ])
}

/// The scores by the number of pieces, each once.
fn scores(tried: &[TriedSurface], chosen: usize) -> Score {
    let mut tried = tried.to_vec();
    tried.sort_by_key(|t| t.pieces);
    tried.dedup_by_key(|t| t.pieces);
    Score {
        x_label: "pieces along every input".to_owned(),
        y_label: "relative error, by generalised cross-validation".to_owned(),
        logarithmic: true,
        x: tried.iter().map(|t| t.pieces as f64).collect(),
        y: tried.iter().map(|t| t.score).collect(),
        chosen: chosen as f64,
    }
}
