//! Results that are a simpler structure than the fitted one: a linear part that is a mere delay does not count.

use crate::identify::result::{BlockKind, Identification, LinearBlock, NamedBlock};
use crate::identify::structures::WIENER;
use crate::identify::{HAMMERSTEIN, WIENER_HAMMERSTEIN};
use crate::linear::TransferFunction;

/// If the front linear part of a Wiener-Hammerstein system is a mere delay, returns it as a Hammerstein system; if the back one is, as a
/// Wiener system. Other results are unchanged.
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

/// The delay of a system that only delays, in samples.
fn mere_delay(system: &TransferFunction) -> Option<usize> {
    let delay = system.b().iter().position(|b| *b != 0.0)?;
    let alone = system.a().len() == 1 && system.b()[delay] == 1.0 && system.b()[delay + 1..].iter().all(|b| *b == 0.0);
    alone.then_some(delay)
}

/// The system with `delay` more samples of delay.
fn later(system: &TransferFunction, delay: usize) -> Option<TransferFunction> {
    let b = [&vec![0.0; delay][..], system.b()].concat();
    TransferFunction::new(b, system.a().to_vec()).ok()
}
