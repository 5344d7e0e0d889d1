//! Chains that are ready to use, of figures of our own: they have the joints and roughly the sizes of the robots that they resemble.

use super::model::{Base, ChainLink, ChainParameters, JointMotion, LinkInertia};
use crate::manipulator::{JointKind, Link, space_arm};

/// A chain that is ready to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChainPreset {
    /// The two-link space arm of [`space_arm`] on a free-floating base of 120 kg.
    FreeSpaceArm,
    /// A manipulator of seven joints on a free-floating base of 4000 kg.
    SpaceManipulator,
    /// An arm of six joints on the ground, with the order of axes of Universal Robots' arms.
    SixJointArm,
    /// An arm of seven joints on the ground, with the order of axes of Franka's arm.
    SevenJointArm,
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const GROUND: [f64; 3] = [0.0, 0.0, -9.81];

impl ChainPreset {
    /// All of them.
    pub const ALL: [ChainPreset; 4] = [
        ChainPreset::FreeSpaceArm,
        ChainPreset::SpaceManipulator,
        ChainPreset::SixJointArm,
        ChainPreset::SevenJointArm,
    ];

    /// Its name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            ChainPreset::FreeSpaceArm => "free-space-arm",
            ChainPreset::SpaceManipulator => "space-manipulator",
            ChainPreset::SixJointArm => "six-joint-arm",
            ChainPreset::SevenJointArm => "seven-joint-arm",
        }
    }

    /// What it is, in a line.
    pub fn description(self) -> &'static str {
        match self {
            ChainPreset::FreeSpaceArm => "the two-link space arm on a free-floating base of 120 kg",
            ChainPreset::SpaceManipulator => "a manipulator of seven joints on a free-floating base of 4000 kg",
            ChainPreset::SixJointArm => "an arm of six joints on the ground, like Universal Robots' UR5",
            ChainPreset::SevenJointArm => "an arm of seven joints on the ground, like Franka's Panda",
        }
    }

    /// The chain.
    pub fn parameters(self) -> ChainParameters {
        match self {
            ChainPreset::FreeSpaceArm => free_space_arm(),
            ChainPreset::SpaceManipulator => {
                let tubes = [
                    tube(X, [0.4, 0.0, 0.0], 100.0, 0.20),
                    tube(Y, [0.4, 0.0, 0.0], 100.0, 0.20),
                    tube(Z, [7.0, 0.0, 0.3], 200.0, 0.17),
                    tube(Z, [7.0, 0.0, -0.3], 200.0, 0.17),
                    tube(Z, [0.4, 0.0, 0.0], 100.0, 0.20),
                    tube(Y, [0.4, 0.0, 0.0], 100.0, 0.20),
                    tube(X, [1.0, 0.0, 0.0], 80.0, 0.20),
                ];
                let matrix = [[9000.0, 0.0, 0.0], [0.0, 14_000.0, 0.0], [0.0, 0.0, 16_000.0]];
                let base = body(4000.0, [0.0; 3], matrix);
                serial(Base::Free, Some(base), [2.0, 0.0, 1.0], &tubes, [0.0; 3])
            }
            ChainPreset::SixJointArm => {
                let tubes = [
                    tube(Z, [0.0, 0.13, 0.0], 3.8, 0.06),
                    tube(Y, [0.42, 0.0, 0.0], 8.5, 0.06),
                    tube(Y, [0.39, -0.02, 0.0], 2.4, 0.05),
                    tube(Y, [0.0, 0.1, 0.0], 1.3, 0.04),
                    tube([0.0, 0.0, -1.0], [0.0, 0.0, -0.1], 1.3, 0.04),
                    tube(Y, [0.0, 0.08, 0.0], 0.4, 0.04),
                ];
                serial(Base::Fixed, None, [0.0, 0.0, 0.09], &tubes, GROUND)
            }
            ChainPreset::SevenJointArm => {
                let back = [0.0, -1.0, 0.0];
                let tubes = [
                    tube(Z, [0.0, -0.01, 0.08], 3.0, 0.06),
                    tube(Y, [0.0, 0.01, 0.31], 3.0, 0.06),
                    tube(Z, [0.08, 0.01, 0.06], 2.8, 0.06),
                    tube(back, [-0.08, -0.01, 0.38], 2.8, 0.06),
                    tube(Z, [0.0, 0.01, -0.05], 3.2, 0.05),
                    tube(back, [0.09, -0.01, 0.0], 1.6, 0.05),
                    tube([0.0, 0.0, -1.0], [0.0, 0.0, -0.2], 1.4, 0.05),
                ];
                serial(Base::Fixed, None, [0.0, 0.0, 0.33], &tubes, GROUND)
            }
        }
    }
}

/// A link as a straight tube from its own joint to the next.
struct Tube {
    /// The axis of its joint, at joint position zero in the axes of the base.
    axis: [f64; 3],
    inertia: LinkInertia,
    /// The next joint, seen from its own, m.
    end: [f64; 3],
}

/// A thin-walled tube of this mass and radius.
fn tube(axis: [f64; 3], end: [f64; 3], mass: f64, radius: f64) -> Tube {
    let square: f64 = end.iter().map(|e| e * e).sum();
    let (along, across) = (mass * radius * radius, mass * (0.5 * radius * radius + square / 12.0));
    let mut matrix = [[0.0; 3]; 3];
    for (i, row) in matrix.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            let own = if i == j { across } else { 0.0 };
            *value = own + (along - across) * (end[i] * end[j] / square);
        }
    }
    let inertia = body(mass, end.map(|e| 0.5 * e), matrix);
    Tube { axis, inertia, end }
}

fn body(mass: f64, com: [f64; 3], matrix: [[f64; 3]; 3]) -> LinkInertia {
    LinkInertia { mass, com, matrix }
}

/// Tubes one after the other, the first at `shoulder` in the base.
fn serial(
    base: Base,
    base_inertia: Option<LinkInertia>,
    shoulder: [f64; 3],
    tubes: &[Tube],
    gravity: [f64; 3],
) -> ChainParameters {
    let links = tubes.iter().enumerate().map(|(i, tube)| ChainLink {
        name: format!("link{}", i + 1),
        joint: format!("joint{}", i + 1),
        parent: i.checked_sub(1),
        motion: JointMotion::Revolute,
        axis: tube.axis,
        rotation: [X, Y, Z],
        translation: if i == 0 { shoulder } else { tubes[i - 1].end },
        inertia: Some(tube.inertia),
        limits: [f64::NEG_INFINITY, f64::INFINITY],
    });
    ChainParameters {
        base_name: "base".to_owned(),
        base,
        base_inertia,
        links: links.collect(),
        gravity,
    }
}

/// The space arm's links, which bend in the plane of x and y, at the side of a box of 120 kg and 1.2 m.
fn free_space_arm() -> ChainParameters {
    let links = space_arm(JointKind::Nonlinear).links.map(|link| {
        let Link {
            mass,
            length,
            com,
            inertia,
        } = link;
        let matrix = [[0.02, 0.0, 0.0], [0.0, inertia, 0.0], [0.0, 0.0, inertia]];
        Tube {
            axis: Z,
            inertia: body(mass, [com, 0.0, 0.0], matrix),
            end: [length, 0.0, 0.0],
        }
    });
    let box_inertia = 120.0 * 1.2 * 1.2 / 6.0;
    let matrix = [X, Y, Z].map(|row| row.map(|e| box_inertia * e));
    serial(
        Base::Free,
        Some(body(120.0, [0.0; 3], matrix)),
        [0.6, 0.0, 0.0],
        &links,
        [0.0; 3],
    )
}
