//! Block diagrams: laid out along one direction, drawn as shapes.
//!
//! A diagram is laid out in two coordinates: `along` the signal's way, and `across` it. Drawn to the right, `along` is x; drawn
//! downwards, for narrow screens, it is y. A part knows its extent ([`span`]), and is then placed between an entry and an
//! exit on one line ([`place`]).

mod block;
mod place;
mod shapes;
mod span;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::data::Flow;
use place::Canvas;
pub(crate) use shapes::DrawnShape;
use span::span;

/// Empty space around a drawing.
const MARGIN: f64 = 8.0;

/// A finished drawing.
#[derive(Debug, Serialize)]
pub(crate) struct Drawing {
    width: f64,
    height: f64,
    shapes: Vec<DrawnShape>,
}

/// A diagram, drawn for wide and for narrow screens, and as a sentence.
#[derive(Debug, Serialize)]
pub(crate) struct DiagramText {
    text: String,
    right: Drawing,
    down: Drawing,
}

/// Where the signals run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Direction {
    Right,
    Down,
}

impl Direction {
    /// Extents along and across the signal's way as width and height, or the other way about.
    fn turned(self, along: f64, across: f64) -> (f64, f64) {
        match self {
            Direction::Right => (along, across),
            Direction::Down => (across, along),
        }
    }
}

/// A diagram as text and drawings.
pub(crate) fn diagram(flow: &Flow) -> DiagramText {
    DiagramText {
        text: description(flow),
        right: drawing(flow, Direction::Right),
        down: drawing(flow, Direction::Down),
    }
}

fn drawing(flow: &Flow, direction: Direction) -> Drawing {
    let size = span(flow, direction);
    let mut canvas = Canvas::new(direction);
    canvas.flow(flow, MARGIN, MARGIN + size.before);
    let (width, height) = direction.turned(size.along, size.before + size.after);
    Drawing {
        width: (width + 2.0 * MARGIN).ceil(),
        height: (height + 2.0 * MARGIN).ceil(),
        shapes: canvas.shapes,
    }
}

/// The diagram as a sentence, for readers who do not see it.
fn description(flow: &Flow) -> String {
    let joined = |parts: &[Flow], between: &str| parts.iter().map(description).collect::<Vec<_>>().join(between);
    match flow {
        Flow::Signal(name) => name.clone(),
        Flow::Block(block) if block.note.is_empty() => block.title.clone(),
        Flow::Block(block) => format!("{} ({})", block.title, block.note),
        Flow::Offset(value) => format!("plus {value}"),
        Flow::Series(parts) => joined(parts, ", then "),
        Flow::Parallel(parts) | Flow::Sum(parts) => format!("the sum of [{}]", joined(parts, "] and [")),
        Flow::Together(parts) => joined(parts, " together with "),
        Flow::Feedback {
            forward,
            back,
            subtracted,
        } => {
            let sign = if *subtracted { "subtracted from" } else { "added to" };
            let (forward, back) = (description(forward), description(back));
            format!("a loop: forward [{forward}]; back [{back}], {sign} what enters")
        }
        Flow::Coupled { first, between, last } => {
            let [first, between, last] = [first, between, last].map(|part| description(part));
            format!(
                "[{first}], then [{between}], whose output is subtracted from the input of the first, then [{last}], whose output is subtracted from the input of the second"
            )
        }
    }
}
