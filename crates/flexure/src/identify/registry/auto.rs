//! The structure itself.

use super::{Progress, Request, Structure};
use crate::error::Result;
use crate::identify::Auto;
use crate::identify::result::{Identification, StructureName};

pub(super) const ROW: Structure = Structure {
    name: StructureName {
        key: "auto",
        title: "auto",
    },
    description: "that of the others which the data support; or none of them",
    inputs: 1..=1,
    options: &[],
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let method = Auto {
        fresh_share: request.options.fresh_share,
        ..Default::default()
    };
    method.identify_with(
        request.record()?,
        request.input()?,
        request.output,
        &mut |structure, stage| progress(&format!("{structure}, {stage}")),
    )
}
