//! What a drawing is made of. The template writes the shapes, and escapes their text.

use std::fmt::Write as _;

use serde::Serialize;

/// Length and half width of an arrow's head.
const HEAD: [f64; 2] = [8.0, 4.0];

/// A shape with the class that the style sheet knows.
#[derive(Debug, Serialize)]
pub(crate) enum DrawnShape {
    /// Lines, in the language of SVG's attribute `d`.
    Path {
        /// What it is: "line", "head", "box", "sum", "fork", "axis" or "curve".
        class: &'static str,
        /// The lines.
        d: String,
    },
    /// Text around a point.
    Text {
        /// What it is: "title", "note", "formula", "signal" or "unit".
        class: &'static str,
        /// The middle.
        x: f64,
        /// The base line.
        y: f64,
        /// What is written.
        text: String,
    },
}

/// A line through points.
pub(super) fn line(class: &'static str, points: &[[f64; 2]]) -> DrawnShape {
    let mut d = String::new();
    for (i, [x, y]) in points.iter().enumerate() {
        let letter = if i == 0 { 'M' } else { 'L' };
        let _ = write!(d, "{letter}{} {}", short(*x), short(*y));
    }
    DrawnShape::Path { class, d }
}

/// The head of an arrow from one point to another.
pub(super) fn head(from: [f64; 2], to: [f64; 2]) -> DrawnShape {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
    let (ux, uy) = (dx / length, dy / length);
    let [long, half] = HEAD;
    let back = [to[0] - long * ux, to[1] - long * uy];
    let side = |sign: f64| [back[0] - sign * half * uy, back[1] + sign * half * ux];
    closed("head", &[to, side(1.0), side(-1.0)])
}

fn closed(class: &'static str, points: &[[f64; 2]]) -> DrawnShape {
    match line(class, points) {
        DrawnShape::Path { class, d } => DrawnShape::Path { class, d: d + "Z" },
        text => text,
    }
}

/// A circle around a point.
pub(super) fn circle(class: &'static str, [x, y]: [f64; 2], radius: f64) -> DrawnShape {
    let (left, across) = (short(x - radius), short(2.0 * radius));
    let (y, r) = (short(y), short(radius));
    DrawnShape::Path {
        class,
        d: format!("M{left} {y}a{r} {r} 0 1 0 {across} 0a{r} {r} 0 1 0 -{across} 0Z"),
    }
}

/// A box with round corners around a point.
pub(super) fn rounded([x, y]: [f64; 2], (width, height): (f64, f64)) -> DrawnShape {
    const R: f64 = 7.0;
    let (left, top) = (short(x - width / 2.0 + R), short(y - height / 2.0));
    let (w, h) = (short(width - 2.0 * R), short(height - 2.0 * R));
    DrawnShape::Path {
        class: "box",
        d: format!(
            "M{left} {top}h{w}a{R} {R} 0 0 1 {R} {R}v{h}a{R} {R} 0 0 1 -{R} {R}h-{w}a{R} {R} 0 0 1 -{R} -{R}v-{h}a{R} {R} 0 0 1 {R} -{R}Z"
        ),
    }
}

/// Text around a point on its base line.
pub(super) fn text(class: &'static str, [x, y]: [f64; 2], text: impl Into<String>) -> DrawnShape {
    DrawnShape::Text {
        class,
        x: short(x),
        y: short(y),
        text: text.into(),
    }
}

/// To a tenth, which is finer than a pixel.
fn short(v: f64) -> f64 {
    (v * 10.0).round() / 10.0
}
