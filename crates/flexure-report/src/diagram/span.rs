//! How much space a part of a diagram takes.

use super::Direction;
use super::block::{block_size, note_size, signal_size};
use crate::data::Flow;

/// Between two parts in series: the length of an arrow.
pub(super) const ARROW: f64 = 30.0;
/// Between the fork and what it leads to, and between that and the sum.
pub(super) const TURN: f64 = 30.0;
/// Between two parts side by side.
pub(super) const APART: f64 = 18.0;
/// The radius of a sum's circle.
pub(super) const SUM: f64 = 10.0;
/// The length of a constant's arrow into a sum.
pub(super) const CONSTANT: f64 = 18.0;
/// Half the extent of a line without any part on it.
const LINE: f64 = 12.0;

/// The extent of a part: along the signal's way, and across it before and after the line through entry and exit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub along: f64,
    pub before: f64,
    pub after: f64,
}

impl Span {
    fn centred(direction: Direction, width: f64, height: f64) -> Self {
        let (along, across) = direction.turned(width, height);
        Span {
            along,
            before: across / 2.0,
            after: across / 2.0,
        }
    }

    pub(super) fn across(self) -> f64 {
        self.before + self.after
    }
}

/// The extent of a part.
pub(super) fn span(flow: &Flow, direction: Direction) -> Span {
    match flow {
        Flow::Signal(name) => {
            let (width, height) = signal_size(name);
            Span::centred(direction, width, height)
        }
        Flow::Block(block) => {
            let (width, height) = block_size(block);
            Span::centred(direction, width, height)
        }
        Flow::Offset(value) => {
            let (width, height) = note_size(value);
            let (along, across) = direction.turned(width, height);
            Span {
                // The text of the constant may extend over the arrows on either side of the sum.
                along: (along - 2.0 * ARROW).max(2.0 * SUM),
                before: SUM + CONSTANT + across,
                after: SUM,
            }
        }
        Flow::Series(parts) => series(parts, direction),
        Flow::Parallel(parts) => beside(parts, direction, 2.0 * TURN + 2.0 * SUM),
        Flow::Sum(parts) => beside(parts, direction, TURN + 2.0 * SUM),
        Flow::Together(parts) => beside(parts, direction, TURN),
        Flow::Coupled { first, between, last } => {
            let parts = [first, between, last].map(|part| span(part, direction));
            let widest = |of: fn(&Span) -> f64| parts.iter().map(of).fold(LINE, f64::max);
            Span {
                along: parts.iter().map(|part| part.along).sum::<f64>() + 4.0 * SUM + 3.0 * ARROW + 2.0 * TURN,
                before: widest(|part| part.before) + APART,
                after: widest(|part| part.after) + APART,
            }
        }
        Flow::Feedback { forward, back, .. } => {
            let (forward, back) = (span(forward, direction), span(back, direction));
            Span {
                along: loop_length(forward, back),
                before: forward.before.max(LINE),
                after: forward.after + APART + back.across(),
            }
        }
    }
}

fn series(parts: &[Flow], direction: Direction) -> Span {
    let spans = || parts.iter().map(|part| span(part, direction));
    let arrows = ARROW * parts.len().saturating_sub(1) as f64;
    Span {
        along: spans().map(|s| s.along).sum::<f64>() + arrows,
        before: spans().map(|s| s.before).fold(LINE, f64::max),
        after: spans().map(|s| s.after).fold(LINE, f64::max),
    }
}

/// Parts side by side, around the line in their middle; `ends` is what fork and sum take.
fn beside(parts: &[Flow], direction: Direction, ends: f64) -> Span {
    let spans: Vec<Span> = parts.iter().map(|part| span(part, direction)).collect();
    let across = spans.iter().map(|s| s.across()).sum::<f64>() + APART * spans.len().saturating_sub(1) as f64;
    Span {
        along: spans.iter().map(|s| s.along).fold(0.0, f64::max) + ends,
        before: across / 2.0,
        after: across / 2.0,
    }
}

/// The sum at the entry, the longer of both ways with arrows at its ends, and the point at which the way back leaves.
fn loop_length(forward: Span, back: Span) -> f64 {
    2.0 * SUM + forward.along.max(back.along) + 2.0 * TURN
}
