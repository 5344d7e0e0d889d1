//! Arms of flexible links in a plane: floating frames, with cubic finite elements or assumed modes.
//!
//! The links turn about z and bend in the plane of x and y, on a fixed or a free-floating base. A beam has its own frame, clamped to its
//! root. A place x on its axis lies there at
//!
//! $$ \left(x + s(x, t) - \tfrac12 \int_0^x w'^2,\ w(x, t)\right), \qquad w = \sum_i \phi_i(x) a_i(t), \quad
//!    s = \tfrac{x}{L} b_1 + \left(\tfrac{x}{L}\right)^3 b_2 $$
//!
//! with the stretch s along the bent axis, which is left out where the beam has no axial stiffness. The strain energy is
//! \\(\tfrac12 \int EI w''^2 + \tfrac12 \int EA s'^2\\). The shortening by the slopes, which counts in positions and velocities, makes a turning
//! beam stiffer, as it must (Kane, Ryan and Banerjee 1987, Dynamics of a cantilever beam attached to a moving base, J. Guidance 10).
//! Slopes are small, to second order; beams that bend far are [segments](super::chain::segmented).
//!
//! Masses are those of Gauss points, and the equations are exact for these: energy and momentum are conserved whatever the number of
//! shape functions. Rotors do not act on the links that carry them (Spong 1987).
//!
//! | to | call |
//! |---|---|
//! | make an arm of a chain's links, its drives and beams | [`FlexibleArm::new`] |
//! | get accelerations from torques | [`FlexibleArm::accelerations`] |
//! | get the vibrations about rest | [`FlexibleArm::linearised`] |
//! | run it in time | [`simulate_flexible_arm`] |
//! | get energy and momentum | [`FlexibleArm::energy`], [`FlexibleArm::momentum`] |
//! | draw it | [`FlexibleArm::outline`] |
//!
//! ```
//! use flexure::manipulator::chain::{Beam, ChainPreset, Motors};
//! use flexure::manipulator::flexible_arm::{FlexibleArm, FlexibleBeam, ShapeFunctions};
//!
//! // The two-link space arm on its free base, of two beams.
//! let mut arm = ChainPreset::FreeSpaceArm.parameters();
//! arm.links.iter_mut().for_each(|link| link.inertia = None);
//! let beams = [0, 1].map(|link| FlexibleBeam {
//!     link,
//!     beam: Beam { length: 4.5, stiffness: 5000.0, density: 0.335, damping: 0.01 },
//!     along: [1.0, 0.0, 0.0],
//!     axial_stiffness: None,
//!     functions: ShapeFunctions::default(),
//! });
//! let arm = FlexibleArm::new(&arm, &[], &beams)?;
//! let modes = arm.linearised(&vec![0.0; arm.coordinates()])?.modes(Motors::Held)?;
//! let first = modes.iter().find_map(|mode| mode.frequency()).unwrap();
//! assert!(first > 0.5 && first < 5.0);
//! # Ok::<(), flexure::Error>(())
//! ```

mod body;
mod dynamics;
#[cfg(test)]
mod exudyn_tests;
mod linearised;
#[cfg(test)]
mod modes_tests;
mod shapes;
mod simulate;
#[cfg(test)]
mod spin_tests;
#[cfg(test)]
mod tests;

pub use dynamics::PlanarMomentum;
pub use shapes::ShapeFunctions;
pub use simulate::{flexible_arm_columns, simulate_flexible_arm, simulate_flexible_arm_watched};

use body::{BeamShape, Rigid};
use dynamics::turned;

use super::chain::{
    Base, Beam, Chain, ChainDrive, ChainLink, ChainParameters, ChainProblem, Drive, DrivenState, JointMotion,
    LinkInertia, RotorCoupling, SegmentedBeam, SpringPlacement, segmented,
};
use super::checks;
use crate::error::{ArmError, Error, Result};

/// How far directions may be from the plane, as shares of their length. Convention.
const IN_PLANE: f64 = 1e-9;

/// A link that is a beam, in its floating frame. The link's own inertia, where it has one, is a rigid hub at its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlexibleBeam {
    /// The index of the link.
    pub link: usize,
    /// The beam.
    pub beam: Beam,
    /// Its direction from the origin of the link's frame, across z, of any length but zero.
    pub along: [f64; 3],
    /// EA, N; positive. Without it the beam does not stretch, which spares fast vibrations.
    pub axial_stiffness: Option<f64>,
    /// How its deflection is written.
    pub functions: ShapeFunctions,
}

/// A link in the plane. The frame of a beam is turned so that the beam is along x.
#[derive(Debug, Clone, PartialEq)]
struct Link {
    name: String,
    /// The index of the link that carries it; none for the base.
    carrier: Option<usize>,
    /// Its origin and direction in the frame of the carrier, or of the tip of the carrier's beam.
    offset: [f64; 2],
    angle: f64,
    /// The coordinate of its joint; none for a fixed one.
    joint: Option<usize>,
    hub: Option<Rigid>,
    beam: Option<BeamShape>,
    /// Where its elastic coordinates begin.
    first: usize,
}

impl Link {
    /// The elastic coordinates, or their velocities.
    fn part<'a>(&self, values: &'a [f64]) -> &'a [f64] {
        let count = self.beam.as_ref().map_or(0, BeamShape::coordinates);
        &values[self.first..self.first + count]
    }
}

/// A joint that moves.
#[derive(Debug, Clone, PartialEq)]
struct Joint {
    name: String,
    /// Its coordinate.
    at: usize,
}

/// An arm, or tree, of rigid and flexible links in a plane.
///
/// Its coordinates q are, with a free base, the base's position in the world, m, and its angle, rad; then the angles of the joints that move;
/// then the elastic coordinates of the beams, m: the two of the stretch where there is an axial stiffness, and those of the shape
/// functions, which are for every element the deflection of its end and the slope there times the beam's length, or for every mode its
/// deflection at the tip. Velocities v are their rates. A state in one vector is `[q, qm, v, vm]`, as that of a
/// [`DrivenChain`](super::chain::DrivenChain).
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibleArm {
    base: Option<Rigid>,
    links: Vec<Link>,
    joints: Vec<Joint>,
    drives: Vec<Drive>,
    gravity: [f64; 2],
    coordinates: usize,
}

impl FlexibleArm {
    /// An arm of the links of a chain, of which some are beams. The drives are one a joint that moves; without any, all joints are rigid.
    ///
    /// What the links have beyond the plane does not count: gravity along z, moments of inertia about x and y, places along z.
    ///
    /// # Errors
    /// [`ArmError::Chain`], with the link, for what [`Chain::new`] and [`segmented`] refuse, for what does not move in the plane, and for too
    /// many shape functions; [`ArmError::Unphysical`] for a drive.
    pub fn new(parameters: &ChainParameters, drives: &[ChainDrive], beams: &[FlexibleBeam]) -> Result<Self> {
        check(parameters, drives, beams)?;
        let free = parameters.base == Base::Free;
        let moving: Vec<&ChainLink> = (parameters.links.iter())
            .filter(|l| l.motion != JointMotion::Fixed)
            .collect();
        let begin = if free { 3 } else { 0 };
        let joints = moving.iter().enumerate().map(|(i, link)| Joint {
            name: link.joint.clone(),
            at: begin + i,
        });
        let given = (0..moving.len()).map(|i| drives.get(i).copied().unwrap_or_default());
        let mut arm = FlexibleArm {
            base: parameters
                .base_inertia
                .as_ref()
                .filter(|_| free)
                .map(|base| rigid(base, 0.0)),
            links: Vec::with_capacity(parameters.links.len()),
            joints: joints.collect(),
            drives: given.map(|drive| Drive::of(&drive, RotorCoupling::None)).collect(),
            gravity: [parameters.gravity[0], parameters.gravity[1]],
            coordinates: begin + moving.len(),
        };
        // How far the frame of every link is turned from the one that is written down.
        let mut turns: Vec<f64> = Vec::with_capacity(parameters.links.len());
        for (i, link) in parameters.links.iter().enumerate() {
            let beam = beams.iter().find(|beam| beam.link == i);
            let turn = beam.map_or(0.0, |beam| beam.along[1].atan2(beam.along[0]));
            let before = link.parent.map_or(0.0, |p| turns[p]);
            let mut offset = turned(-before, [link.translation[0], link.translation[1]]);
            if let Some(carrying) = link.parent.and_then(|p| arm.links[p].beam.as_ref()) {
                offset[0] -= carrying.length;
            }
            let shape = beam.map(|b| BeamShape::new(&b.beam, b.functions, b.axial_stiffness));
            let first = arm.coordinates;
            arm.coordinates += shape.as_ref().map_or(0, BeamShape::coordinates);
            arm.links.push(Link {
                name: link.name.clone(),
                carrier: link.parent,
                offset,
                angle: link.rotation[1][0].atan2(link.rotation[0][0]) + turn - before,
                joint: arm
                    .joints
                    .iter()
                    .find(|joint| joint.name == link.joint)
                    .map(|joint| joint.at),
                hub: link.inertia.as_ref().map(|inertia| rigid(inertia, turn)),
                beam: shape,
                first,
            });
            turns.push(turn);
        }
        Ok(arm)
    }

    /// The number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// The number of values of a state.
    pub fn dimension(&self) -> usize {
        2 * (self.coordinates + self.motors())
    }

    /// The number of flexible joints.
    pub fn motors(&self) -> usize {
        self.drives.iter().filter(|drive| drive.flexible).count()
    }

    /// Whether the base floats freely.
    pub fn free_base(&self) -> bool {
        self.base.is_some()
    }

    /// The names of the joints that move, in the order of their coordinates, and whether each is flexible.
    pub fn joints(&self) -> Vec<(&str, bool)> {
        let drives = self.drives.iter().map(|drive| drive.flexible);
        self.joints
            .iter()
            .map(|joint| joint.name.as_str())
            .zip(drives)
            .collect()
    }

    /// Where the coordinates of the joints begin: 3 with a free base, else 0.
    pub fn first(&self) -> usize {
        if self.base.is_some() { 3 } else { 0 }
    }

    /// The parts of a state in one vector.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn state<'a>(&self, x: &'a [f64]) -> Result<DrivenState<'a>> {
        length("state", x, self.dimension())?;
        let (positions, velocities) = x.split_at(x.len() / 2);
        let (q, motor_q) = positions.split_at(self.coordinates);
        let (v, motor_v) = velocities.split_at(self.coordinates);
        Ok(DrivenState { q, v, motor_q, motor_v })
    }

    /// The axis of a link at the position q: `count` places from its root to its tip, evenly spaced along the straight beam, m in the world;
    /// of a rigid link its origin alone.
    ///
    /// # Errors
    /// A vector of another length; a link that does not exist.
    pub fn outline(&self, q: &[f64], link: usize, count: usize) -> Result<Vec<[f64; 2]>> {
        self.check_position(q)?;
        let Some(own) = self.links.get(link) else {
            return Err(Error::length("the links", self.links.len(), link + 1));
        };
        let frame = &self.frames(q, &vec![0.0; q.len()])[link + 1];
        let Some(beam) = &own.beam else {
            return Ok(vec![frame.origin]);
        };
        let places = (0..count).map(|k| {
            let at = turned(
                frame.angle,
                beam.point(k as f64 / (count.max(2) - 1) as f64, own.part(q)),
            );
            [frame.origin[0] + at[0], frame.origin[1] + at[1]]
        });
        Ok(places.collect())
    }

    /// What the tip of every beam deflects across its straight axis, m, at the position q, and along it, m; with the link's name.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn deflections(&self, q: &[f64]) -> Result<Vec<(&str, [f64; 2])>> {
        self.check_position(q)?;
        let beams = self.links.iter().filter_map(|link| Some((link, link.beam.as_ref()?)));
        let found = beams.map(|(link, beam)| {
            let e = link.part(q);
            let [x, y] = beam.local(&beam.tip, e, &vec![0.0; e.len()]).at;
            (link.name.as_str(), [y, x - beam.length])
        });
        Ok(found.collect())
    }

    fn check_position(&self, q: &[f64]) -> Result<()> {
        length("q", q, self.coordinates)
    }

    fn check_state(&self, state: &DrivenState<'_>) -> Result<()> {
        length("q", state.q, self.coordinates)?;
        length("v", state.v, self.coordinates)?;
        length("motor_q", state.motor_q, self.motors())?;
        length("motor_v", state.motor_v, self.motors())
    }
}

fn length(name: &str, values: &[f64], expected: usize) -> Result<()> {
    if values.len() == expected {
        return Ok(());
    }
    Err(Error::length(name, values.len(), expected))
}

/// An inertia in the plane, in axes that are turned by an angle.
fn rigid(inertia: &LinkInertia, turn: f64) -> Rigid {
    Rigid {
        mass: inertia.mass,
        com: turned(-turn, [inertia.com[0], inertia.com[1]]),
        inertia: inertia.matrix[2][2],
    }
}

/// Refuses what is no chain, and what does not move in the plane.
fn check(parameters: &ChainParameters, drives: &[ChainDrive], beams: &[FlexibleBeam]) -> Result<()> {
    // As segments the beams have all the checks of chains.
    let segments = beams.iter().map(|beam| SegmentedBeam {
        link: beam.link,
        beam: beam.beam,
        along: beam.along,
        axes: vec![[0.0, 0.0, 1.0]],
        segments: 1,
        springs: SpringPlacement::Middle,
    });
    let (rigid, _) = segmented(parameters, drives, &segments.collect::<Vec<_>>())?;
    Chain::new(&rigid)?;
    for (i, drive) in drives.iter().enumerate() {
        checks::chain_drive(i + 1, drive)?;
    }
    let wrong = |link: &ChainLink, problem| {
        let link = link.name.clone();
        Error::Arm(ArmError::Chain { link, problem })
    };
    for link in &parameters.links {
        if let Some(what) = out_of_plane(link) {
            return Err(wrong(link, ChainProblem::OutOfPlane { what }));
        }
    }
    for beam in beams {
        let (count, most) = (beam.functions.count(), beam.functions.most());
        let number = |quantity, value, requirement| ChainProblem::Number {
            quantity,
            value,
            requirement,
        };
        let link = &parameters.links[beam.link];
        if !(1..=most).contains(&count) {
            let range = if most == 20 { "1 to 20" } else { "1 to 10" };
            let problem = number("the number of its beam's elements or modes", count as f64, range);
            return Err(wrong(link, problem));
        }
        if let Some(axial) = beam.axial_stiffness.filter(|a| !(*a > 0.0 && a.is_finite())) {
            let problem = number("the axial stiffness of its beam, N,", axial, "positive and finite");
            return Err(wrong(link, problem));
        }
    }
    Ok(())
}

/// What of a link does not move in the plane.
fn out_of_plane(link: &ChainLink) -> Option<&'static str> {
    let [x, y, z] = link.axis;
    match link.motion {
        JointMotion::Prismatic => return Some("its joint slides"),
        JointMotion::Revolute if !(z > 0.0 && x.hypot(y) <= IN_PLANE * z) => {
            return Some("the axis of its joint is not that of z");
        }
        _ => {}
    }
    (link.rotation[2][2] < 1.0 - IN_PLANE).then_some("its frame is turned out of that plane")
}
