//! A block diagram: what the signals pass, from the inputs to the output.

use serde::Serialize;

/// A part of a block diagram: one signal runs through it, from its entry to its exit.
///
/// A diagram begins and ends with [`Flow::Signal`]. For a Hammerstein system it is
/// `Series[Signal, Block, Block, Signal]`, for a sum of two `Series[Signal, Parallel[Series[..], Series[..]], Signal]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Flow {
    /// A signal by its name, the unit in parentheses at the end, for example "torque (N m)".
    Signal(String),
    /// A block.
    Block(DiagramBlock),
    /// A constant that is added to the signal, for reading, for example "0.21 rad/s".
    Offset(String),
    /// Parts one after the other.
    Series(Vec<Flow>),
    /// The same signal enters all parts, and what leaves them is added up.
    Parallel(Vec<Flow>),
    /// Each part begins with its own signal, and what leaves them is added up.
    Sum(Vec<Flow>),
    /// Several signals that enter the next block side by side; each part begins with its own signal.
    Together(Vec<Flow>),
    /// What leaves `forward` passes `back`, and is added to what enters `forward` or, if `subtracted`, taken from it.
    Feedback {
        /// From the sum to the exit.
        forward: Box<Flow>,
        /// From the exit back to the sum.
        back: Box<Flow>,
        /// Whether the sum takes the signal that comes back with a minus sign.
        subtracted: bool,
    },
    /// Three parts in series, the middle one acting on both others, for example a spring between two masses: what leaves `between` is taken
    /// from what enters `first`, and what leaves `last` from what leaves `first`.
    Coupled {
        /// From the first sum to the second.
        first: Box<Flow>,
        /// From the second sum on.
        between: Box<Flow>,
        /// From there to the exit.
        last: Box<Flow>,
    },
}

/// A block of a diagram.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagramBlock {
    /// What it is called, for example "Nonlinearity".
    pub title: String,
    /// What its middle shows.
    pub sketch: Sketch,
    /// A short description, for example "order 3, delay 2"; may be empty.
    pub note: String,
}

/// What the middle of a block shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Sketch {
    /// A small curve through points.
    Curve {
        /// Abscissas, increasing.
        x: Vec<f64>,
        /// Ordinates.
        y: Vec<f64>,
    },
    /// A fraction, for example "B(z)" over "A(z)".
    Fraction(String, String),
    /// A formula in one line, for example "f(u, v)".
    Formula(String),
}
