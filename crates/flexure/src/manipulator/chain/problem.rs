//! What can be wrong with a chain.

use crate::text::exact;

/// What is wrong with one link of a chain, or with the joint that carries it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainProblem {
    /// Two links, or two joints, have the same name.
    #[error("its name is used twice; names must differ")]
    DuplicateName,
    /// The parent does not come before the link.
    #[error("its parent is number {parent}, which does not come before it; list every link after its parent")]
    Parent {
        /// The parent's index.
        parent: usize,
    },
    /// A number is not finite or out of its range.
    #[error("{quantity} is {}, but must be {requirement}", exact(*.value))]
    Number {
        /// What the number is, with its unit.
        quantity: &'static str,
        /// The value that was given.
        value: f64,
        /// The valid range.
        requirement: &'static str,
    },
    /// A joint's axis has no direction.
    #[error("its joint's axis is zero; give a direction")]
    NoAxis,
    /// A rotation matrix does not rotate.
    #[error("its placement is not a rotation; the columns must be orthonormal and right-handed")]
    NotARotation,
    /// Moments of inertia that no distribution of mass has.
    #[error(
        "its moments of inertia belong to no body: the principal ones are {} kg m^2, and each must be at most the sum of the other \
         two; check the matrix about the centre of mass",
        principal.map(exact).join(", ")
    )]
    Inertia {
        /// The principal moments of inertia, kg m^2, ascending.
        principal: [f64; 3],
    },
    /// An inertia matrix that is not symmetric.
    #[error("its inertia matrix is not symmetric")]
    NotSymmetric,
    /// A link that moves has no mass.
    #[error("it moves, but neither it nor what is fixed to it has a mass; give its inertia")]
    Massless,
    /// The bending axes of a beam are not across it.
    #[error("its beam needs a direction and one or two axes across it, and across each other, about which it bends")]
    BeamAxes,
    /// A link of an arm of finite elements or modes does not move in the plane.
    #[error(
        "elements and modes bend in the plane of x and y, in which it does not move: {what}; make its beams of segments"
    )]
    OutOfPlane {
        /// What does not.
        what: &'static str,
    },
    /// The joint of a beam with a spring at its root has no inertia between both.
    #[error(
        "its joint moves nothing but the spring at the root of its beam; give the link a mass and an inertia, which are its hub, or put the \
         springs in the middle of the segments"
    )]
    NoHub,
    /// The limits exclude each other.
    #[error("its lower limit {} lies above its upper limit {}", exact(*.lower), exact(*.upper))]
    Limits {
        /// The lower limit, rad or m.
        lower: f64,
        /// The upper limit, rad or m.
        upper: f64,
    },
    /// Nothing moves.
    #[error("the chain has no joint that moves")]
    NothingMoves,
}
