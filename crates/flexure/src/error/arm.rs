//! What can be wrong with an arm or a chain.

use crate::manipulator::chain::ChainProblem;
use crate::text::exact;

/// What was wrong with an arm or a chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// A part of an arm is not physical.
    #[error("{quantity} of {part} {number} is {} {unit}, but must be {requirement}", exact(*.value))]
    Unphysical {
        /// "link" or "joint".
        part: &'static str,
        /// Which of the two, 1 (shoulder side) or 2 (elbow side).
        number: usize,
        /// The quantity, named as in an arm file.
        quantity: &'static str,
        /// The value that was given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The valid range.
        requirement: &'static str,
    },
    /// An arm's inertia matrix is singular or indefinite in some configuration.
    #[error(
        "the {matrix} of the arm is not positive definite at q2 = {q2} rad (its determinant is {determinant}); \
         check the links' masses, lengths and inertias{hint}"
    )]
    SingularInertia {
        /// Which matrix.
        matrix: &'static str,
        /// The elbow's angle, rad.
        q2: f64,
        /// The determinant of the 2x2 matrix that remains when the motors are eliminated.
        determinant: f64,
        /// A further thing to check, or nothing.
        hint: &'static str,
    },
    /// A chain of links cannot be used.
    #[error("link '{link}': {problem}")]
    Chain {
        /// The link's name.
        link: String,
        /// What is wrong with it.
        problem: ChainProblem,
    },
    /// A chain has a part with which something cannot be done.
    #[error("the chain has {part}: {why}")]
    Unsuited {
        /// What it has.
        part: String,
        /// What cannot be done, and what to do.
        why: &'static str,
    },
    /// The inertia beyond a joint of a chain is not positive.
    #[error("the inertia that joint '{joint}' moves is not positive; check the position and the links' inertias")]
    SingularChain {
        /// The joint's name.
        joint: String,
    },
    /// Deflections were commanded of an arm without flexible joints.
    #[error(
        "a rigid arm has no joint deflections to command; choose the linear or nonlinear model, or drive it by torque"
    )]
    RigidDeflection,
}
