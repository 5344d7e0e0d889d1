//! What the page of a simulated chain shows.

use serde::Serialize;

use super::{Axis, Fact, Signal};

/// The motion of a chain.
#[derive(Debug, Clone, Serialize)]
pub struct MotionPage {
    /// The heading.
    pub title: String,
    /// One sentence below it: what moves, and how.
    pub subtitle: String,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// The chain in motion.
    pub chain: ChainMotion,
    /// The signals of the record.
    pub signals: Vec<Signal>,
    /// The instants of the signals and of the motion.
    pub time: Axis,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}

/// Points that move in space, and the lines between them.
#[derive(Debug, Clone, Serialize)]
pub struct ChainMotion {
    /// One sentence: what is drawn.
    pub caption: String,
    /// The lines, by the numbers of their points.
    pub lines: Vec<[usize; 2]>,
    /// The points at every instant, m; the first one is the base.
    pub points: Vec<Vec<[f64; 3]>>,
    /// Whether the base moves.
    pub free_base: bool,
}
