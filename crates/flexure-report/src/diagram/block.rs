//! A single block, and the name of a signal.

use super::shapes::{DrawnShape, line, rounded, text};
use crate::data::{DiagramBlock, Sketch};
use crate::text::name_and_unit;

/// The least width of a block.
const LEAST: f64 = 132.0;
/// Room on either side of the text of a block.
const BESIDE: f64 = 12.0;
/// The height of its middle.
const MIDDLE: f64 = 46.0;
/// The height of a line of text.
const LINE: f64 = 17.0;
/// The width of a usual letter, of titles and signals, and of notes, in a wide font such as DejaVu Sans.
const LETTER: f64 = 8.9;
const SMALL_LETTER: f64 = 7.0;
/// The size of a small curve.
const SKETCH: [f64; 2] = [92.0, 40.0];
/// Most points of a small curve.
const POINTS: usize = 60;
/// The most letters of a signal's name; the rest is left out.
const LONGEST_NAME: usize = 24;

/// The width of a text whose usual letters have this width.
fn width(text: &str, letter: f64) -> f64 {
    let of = |c: char| match c {
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 1.45,
        'i' | 'j' | 'l' | 'f' | 't' | 'r' | 'I' | ' ' | '.' | ',' | '(' | ')' | '/' | '\'' => 0.6,
        _ => 1.0,
    };
    letter * text.chars().map(of).sum::<f64>()
}

/// Width and height of a block.
pub(super) fn block_size(block: &DiagramBlock) -> (f64, f64) {
    let middle = match &block.sketch {
        Sketch::Curve { .. } => SKETCH[0],
        Sketch::Fraction(above, below) => width(above, LETTER).max(width(below, LETTER)),
        Sketch::Formula(formula) => width(formula, LETTER),
    };
    let widest = (width(&block.title, LETTER).max(width(&block.note, SMALL_LETTER))).max(middle);
    // All blocks have one height, with space for a note.
    ((widest + 2.0 * BESIDE).max(LEAST), LINE + 5.0 + MIDDLE + LINE + 5.0)
}

/// Width and height of a signal's name with its unit below it.
pub(super) fn signal_size(name: &str) -> (f64, f64) {
    let (name, unit) = shown(name);
    let widest = width(&name, LETTER).max(width(&unit, SMALL_LETTER));
    (widest + 10.0, 2.0 * LINE)
}

/// Width and height of a short text.
pub(super) fn note_size(text: &str) -> (f64, f64) {
    (width(text, SMALL_LETTER) + 6.0, LINE)
}

/// A signal's name and its unit, as they are written.
fn shown(label: &str) -> (String, String) {
    let (name, unit) = name_and_unit(label);
    let name = match name.chars().count() > LONGEST_NAME {
        true => name.chars().take(LONGEST_NAME - 1).chain(['…']).collect(),
        false => name.to_owned(),
    };
    (name, unit.unwrap_or_default().to_owned())
}

/// A signal's name around a point.
pub(super) fn draw_signal(label: &str, [x, y]: [f64; 2], shapes: &mut Vec<DrawnShape>) {
    let (name, unit) = shown(label);
    if unit.is_empty() {
        shapes.push(text("signal", [x, y + 4.5], name));
        return;
    }
    shapes.push(text("signal", [x, y - 2.5], name));
    shapes.push(text("unit", [x, y + 12.5], unit));
}

/// A block around a point.
pub(super) fn draw_block(block: &DiagramBlock, [x, y]: [f64; 2], shapes: &mut Vec<DrawnShape>) {
    let (across, height) = block_size(block);
    let top = y - height / 2.0;
    shapes.push(rounded([x, y], (across, height)));
    shapes.push(text("title", [x, top + LINE], &*block.title));
    let lower = if block.note.is_empty() { LINE / 2.0 } else { 0.0 };
    let middle = top + LINE + 5.0 + MIDDLE / 2.0 + lower;
    match &block.sketch {
        Sketch::Curve { x: xs, y: ys } => draw_curve(xs, ys, [x, middle], shapes),
        Sketch::Formula(formula) => shapes.push(text("formula", [x, middle + 5.0], &**formula)),
        Sketch::Fraction(above, below) => {
            let letters = above.chars().count().max(below.chars().count()) as f64;
            let half = (letters * LETTER) / 2.0 + 4.0;
            shapes.push(text("formula", [x, middle - 6.0], &**above));
            shapes.push(line("bar", &[[x - half, middle], [x + half, middle]]));
            shapes.push(text("formula", [x, middle + 17.0], &**below));
        }
    }
    if !block.note.is_empty() {
        shapes.push(text("note", [x, y + height / 2.0 - 9.0], &*block.note));
    }
}

/// A small curve around a point, with the axes where they pass it.
fn draw_curve(x: &[f64], y: &[f64], [middle_x, middle_y]: [f64; 2], shapes: &mut Vec<DrawnShape>) {
    let every = x.len().div_ceil(POINTS).max(1);
    // The last point too, which no step may reach.
    let kept = (0..x.len()).filter(|i| i % every == 0 || i + 1 == x.len());
    let points: Vec<[f64; 2]> = kept
        .map(|i| [x[i], y[i]])
        .filter(|point| point.iter().all(|v| v.is_finite()))
        .collect();
    let ends = |k: usize| {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        (points.iter()).fold(none, |(low, high), p| (low.min(p[k]), high.max(p[k])))
    };
    let [width, height] = SKETCH;
    let ((left, right), (low, high)) = (ends(0), ends(1));
    if !(right > left) {
        return;
    }
    let at_x = |v: f64| middle_x - width / 2.0 + width * (v - left) / (right - left);
    let at_y = |v: f64| match high > low {
        true => middle_y + height / 2.0 - height * (v - low) / (high - low),
        false => middle_y,
    };
    if low <= 0.0 && high >= 0.0 {
        shapes.push(line("axis", &[[at_x(left), at_y(0.0)], [at_x(right), at_y(0.0)]]));
    }
    if left <= 0.0 && right >= 0.0 {
        let [bottom, top] = [middle_y + height / 2.0, middle_y - height / 2.0];
        shapes.push(line("axis", &[[at_x(0.0), bottom], [at_x(0.0), top]]));
    }
    let drawn: Vec<[f64; 2]> = points.iter().map(|p| [at_x(p[0]), at_y(p[1])]).collect();
    shapes.push(line("curve", &drawn));
}
