//! Placing the parts of a diagram, and drawing the lines between them.

use super::Direction;
use super::block::{draw_block, draw_signal, note_size};
use super::shapes::{DrawnShape, circle, head, line, text};
use super::span::{APART, ARROW, CONSTANT, SUM, Span, TURN, span};
use crate::data::Flow;

/// How near to a block's corner a line may enter.
const CORNER: f64 = 14.0;

/// The shapes that were drawn, and how a place along and across becomes a point.
pub(super) struct Canvas {
    pub shapes: Vec<DrawnShape>,
    direction: Direction,
    /// Where the place 0 along is drawn. The sign is 1, or -1 on a way back.
    origin: f64,
    sign: f64,
}

impl Canvas {
    pub(super) fn new(direction: Direction) -> Self {
        Canvas {
            shapes: Vec::new(),
            direction,
            origin: 0.0,
            sign: 1.0,
        }
    }

    fn point(&self, along: f64, across: f64) -> [f64; 2] {
        let (x, y) = self.direction.turned(self.origin + self.sign * along, across);
        [x, y]
    }

    fn span(&self, flow: &Flow) -> Span {
        span(flow, self.direction)
    }

    /// A line through places along and across.
    fn line(&mut self, places: &[[f64; 2]]) {
        let points: Vec<[f64; 2]> = places.iter().map(|p| self.point(p[0], p[1])).collect();
        self.shapes.push(line("line", &points));
    }

    /// A line through places along and across that ends as an arrow.
    fn arrow(&mut self, places: &[[f64; 2]]) {
        self.line(places);
        if let [.., from, to] = places {
            let (from, to) = (self.point(from[0], from[1]), self.point(to[0], to[1]));
            self.shapes.push(head(from, to));
        }
    }

    fn fork(&mut self, along: f64, across: f64) {
        let at = self.point(along, across);
        self.shapes.push(circle("fork", at, 2.6));
    }

    /// The circle of a sum around a place.
    fn sum(&mut self, along: f64, across: f64) {
        let [x, y] = self.point(along, across);
        self.shapes.push(circle("sum", [x, y], SUM));
        self.shapes.push(line("sign", &[[x - 4.0, y], [x + 4.0, y]]));
        self.shapes.push(line("sign", &[[x, y - 4.0], [x, y + 4.0]]));
    }

    /// Draws a part from the entry at `along` on the line `across`; returns where it ends along.
    pub(super) fn flow(&mut self, flow: &Flow, along: f64, across: f64) -> f64 {
        let size = self.span(flow);
        let end = along + size.along;
        let middle = self.point((along + end) / 2.0, across);
        match flow {
            Flow::Signal(name) => draw_signal(name, middle, &mut self.shapes),
            Flow::Block(block) => draw_block(block, middle, &mut self.shapes),
            Flow::Offset(value) => self.offset(value, [along, end], across),
            Flow::Series(parts) => self.series(parts, along, across),
            Flow::Parallel(parts) => self.beside(parts, true, [along, end], across),
            Flow::Sum(parts) => self.beside(parts, false, [along, end], across),
            // The next part draws the lines from them.
            Flow::Together(parts) => {
                for (part, line) in parts.iter().zip(self.places(parts, across)) {
                    let own = self.span(part).along;
                    self.flow(part, end - TURN - own, line);
                }
            }
            Flow::Feedback {
                forward,
                back,
                subtracted,
            } => self.feedback(forward, back, *subtracted, [along, end], across),
            Flow::Coupled { first, between, last } => self.coupled([first, between, last], size, along, across),
        }
        end
    }

    /// Three parts in series with a sum before each of the first two, and the ways back to these on either side.
    fn coupled(&mut self, [first, between, last]: [&Flow; 3], size: Span, along: f64, across: f64) {
        let mut at = along;
        let mut sums = [0.0; 2];
        for (sum, part) in sums.iter_mut().zip([first, between]) {
            if at > along {
                self.arrow(&[[at, across], [at + ARROW, across]]);
                at += ARROW;
            }
            *sum = at + SUM;
            self.sum(*sum, across);
            let start = at + 2.0 * SUM + ARROW;
            self.arrow(&[[at + 2.0 * SUM, across], [start, across]]);
            at = self.flow(part, start, across);
        }
        let taken = at + TURN / 2.0;
        self.arrow(&[[at, across], [at + TURN, across]]);
        let exit = self.flow(last, at + TURN, across);
        self.line(&[[exit, across], [along + size.along, across]]);
        let back = [
            (taken, sums[0], across - size.before, -1.0),
            (exit + TURN / 2.0, sums[1], across + size.after, 1.0),
        ];
        for (from, sum, beside, side) in back {
            self.fork(from, across);
            self.arrow(&[
                [from, across],
                [from, beside],
                [sum, beside],
                [sum, across + side * SUM],
            ]);
            self.minus(sum, across + side * (SUM + 8.0));
        }
    }

    /// The minus sign of a signal that a sum takes.
    fn minus(&mut self, along: f64, across: f64) {
        let sign = self.point(along - 9.0, across + 3.0);
        self.shapes.push(text("minus", sign, "−"));
    }

    /// A constant that comes from the side into a sum.
    fn offset(&mut self, value: &str, [along, end]: [f64; 2], across: f64) {
        let middle = (along + end) / 2.0;
        self.line(&[[along, across], [end, across]]);
        self.sum(middle, across);
        let (width, height) = note_size(value);
        let (_, beside) = self.direction.turned(width, height);
        let edge = across - SUM - CONSTANT;
        self.arrow(&[[middle, edge], [middle, across - SUM]]);
        let [x, y] = self.point(middle, edge - beside / 2.0);
        self.shapes.push(text("note", [x, y + 4.0], value));
    }

    fn series(&mut self, parts: &[Flow], along: f64, across: f64) {
        let mut at = along;
        for (i, part) in parts.iter().enumerate() {
            let end = self.flow(part, at, across);
            let Some(next) = parts.get(i + 1) else { break };
            let entry = end + ARROW;
            match (part, next) {
                (Flow::Together(sources), _) => self.gather(sources, [end - TURN, entry], across, self.span(next)),
                (_, Flow::Parallel(_)) => self.line(&[[end, across], [entry, across]]),
                _ => self.arrow(&[[end, across], [entry, across]]),
            }
            at = entry;
        }
    }

    /// Lines from several parts into the side of the next.
    fn gather(&mut self, sources: &[Flow], [from, to]: [f64; 2], across: f64, next: Span) {
        let lines = self.places(sources, across);
        let side = next.before.min(next.after) - CORNER;
        let last = sources.len().saturating_sub(1).max(1) as f64;
        for (i, line) in lines.into_iter().enumerate() {
            let even = across + side * (2.0 * i as f64 / last - 1.0);
            let enter = if (line - across).abs() <= side { line } else { even };
            let turn = (from + to) / 2.0;
            self.arrow(&[[from, line], [turn, line], [turn, enter], [to, enter]]);
        }
    }

    /// Parts side by side, with lines to each from a fork at `along` if there is one, and from each into a sum at `end`.
    fn beside(&mut self, parts: &[Flow], has_fork: bool, [along, end]: [f64; 2], across: f64) {
        let centre = end - SUM;
        self.sum(centre, across);
        if has_fork {
            self.fork(along, across);
        }
        // The parts end side by side: shorter ones start later, so that their lines to the sum look the same.
        for (part, line) in parts.iter().zip(self.places(parts, across)) {
            let start = centre + SUM - TURN - 2.0 * SUM - self.span(part).along;
            if has_fork {
                self.arrow(&[[along, across], [along, line], [start, line]]);
            }
            let exit = self.flow(part, start, line);
            match (line - across).abs() < SUM {
                true => self.arrow(&[[exit, line], [centre - SUM, line]]),
                false => {
                    let edge = across + SUM * (line - across).signum();
                    self.arrow(&[[exit, line], [centre, line], [centre, edge]]);
                }
            }
        }
    }

    /// The places across of parts side by side.
    fn places(&self, parts: &[Flow], across: f64) -> Vec<f64> {
        let spans: Vec<Span> = parts.iter().map(|part| self.span(part)).collect();
        let all = spans.iter().map(|s| s.across()).sum::<f64>() + APART * spans.len().saturating_sub(1) as f64;
        let mut edge = across - all / 2.0;
        let place = |s: &Span| {
            let line = edge + s.before;
            edge += s.across() + APART;
            line
        };
        spans.iter().map(place).collect()
    }

    /// A loop: the sum, the way forward on the line, and the way back parallel to it.
    fn feedback(&mut self, forward: &Flow, back: &Flow, subtracted: bool, [along, end]: [f64; 2], across: f64) {
        let (front, rear) = (self.span(forward), self.span(back));
        let (first, last) = (along + 2.0 * SUM + TURN, end - TURN);
        let longest = last - first;
        self.sum(along + SUM, across);
        let start = first + (longest - front.along) / 2.0;
        self.arrow(&[[along + 2.0 * SUM, across], [start, across]]);
        let exit = self.flow(forward, start, across);
        self.line(&[[exit, across], [end, across]]);
        let take = end - TURN / 2.0;
        self.fork(take, across);
        let beside = across + front.after + APART + rear.before;
        let (low, high) = (
            first + (longest - rear.along) / 2.0,
            first + (longest + rear.along) / 2.0,
        );
        self.arrow(&[[take, across], [take, beside], [high, beside]]);
        // The way back is drawn mirrored, so that its entry is at the far end.
        let outer = (self.origin, self.sign);
        (self.origin, self.sign) = (self.origin + self.sign * (low + high), -self.sign);
        self.flow(back, low, beside);
        (self.origin, self.sign) = outer;
        self.arrow(&[[low, beside], [along + SUM, beside], [along + SUM, across + SUM]]);
        if subtracted {
            self.minus(along + SUM, across + SUM + 8.0);
        }
    }
}
