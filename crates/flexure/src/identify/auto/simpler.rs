//! What came out as a simpler structure than was fitted: a linear part that is a mere delay is none.

use crate::identify::result::{BlockKind, Identification, LinearBlock, NamedBlock};
use crate::identify::structures::WIENER;
use crate::identify::{HAMMERSTEIN, WIENER_HAMMERSTEIN};
use crate::linear::TransferFunction;

/// A Wiener-Hammerstein system whose front linear part is a mere delay as the Hammerstein system that it is, and one whose back linear part
/// is one as the Wiener system; anything else as it is.
///
/// The blocks' outputs differ while the first samples fill the delay.
pub(super) fn simpler(mut found: Identification) -> Identification {
    let [path] = &mut found.paths[..] else {
        return found;
    };
    if found.structure != WIENER_HAMMERSTEIN.name {
        return found;
    }
    let [front, curve, back] = &path.blocks[..] else {
        return found;
    };
    let (BlockKind::Linear(first), BlockKind::Linear(last)) = (&front.kind, &back.kind) else {
        return found;
    };
    let linear = |of: &LinearBlock, delay: Option<usize>| {
        let system = later(&of.system, delay?)?;
        let block = LinearBlock { system, ..of.clone() };
        Some(NamedBlock::new("linear", "Linear part", BlockKind::Linear(block)))
    };
    let (row, blocks) = match (
        linear(last, mere_delay(&first.system)),
        linear(first, mere_delay(&last.system)),
    ) {
        (Some(linear), _) => (&HAMMERSTEIN, vec![curve.clone(), linear]),
        (None, Some(linear)) => (&WIENER, vec![linear, curve.clone()]),
        (None, None) => return found,
    };
    path.blocks = blocks;
    Identification {
        structure: row.name,
        description: row.description.to_owned(),
        model: path.model(found.output_offset),
        ..found
    }
}

/// The samples by which a system delays, where it does nothing else.
fn mere_delay(system: &TransferFunction) -> Option<usize> {
    let delay = system.b().iter().position(|b| *b != 0.0)?;
    let alone = system.a().len() == 1 && system.b()[delay] == 1.0 && system.b()[delay + 1..].iter().all(|b| *b == 0.0);
    alone.then_some(delay)
}

/// A system with so many samples of delay more.
fn later(system: &TransferFunction, delay: usize) -> Option<TransferFunction> {
    let b = [&vec![0.0; delay][..], system.b()].concat();
    TransferFunction::new(b, system.a().to_vec()).ok()
}
