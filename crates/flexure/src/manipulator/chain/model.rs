//! A chain as it is written down, and the checked model that the algorithms use.
//!
//! A model's frames differ from those written down: each is turned so that its joint's axis is z, and links that are fixed to
//! others are merged into them. Joint positions, torques and the inertia matrix are the same.

use super::problem::ChainProblem;
use super::spatial::{Inertia, Placement};
use super::vector::{Mat3, Vec3};
use crate::error::{ArmError, Error, Result};
use crate::linalg;

/// How far the sum of two principal moments may lie below the third, relative to it: files are written with few digits.
/// Convention.
const TRIANGLE_TOLERANCE: f64 = 1e-6;
/// How far a rotation matrix may be from orthonormal. Convention.
const ROTATION_TOLERANCE: f64 = 1e-9;

/// How the base of a chain moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// It stays where it is.
    #[default]
    Fixed,
    /// It floats freely.
    Free,
}

/// The largest cosine of the angle between the axes of a crosspiece: beyond it the inertia about the first is lost. Convention.
const CROSSPIECE: f64 = 0.5;

/// How a link moves against its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// It turns about the joint's axis, rad.
    Revolute,
    /// It slides along the joint's axis, m.
    Prismatic,
    /// It does not.
    Fixed,
}

/// The inertia of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg; positive.
    pub mass: f64,
    /// Centre of mass in the link's frame, m.
    pub com: [f64; 3],
    /// The inertia matrix about the centre of mass, in the axes of the link's frame, kg m^2; symmetric.
    pub matrix: [[f64; 3]; 3],
}

/// A link and the joint that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainLink {
    /// The link's name.
    pub name: String,
    /// The joint's name.
    pub joint: String,
    /// The index of the parent among the links, smaller than the link's own; `None` for the base.
    pub parent: Option<usize>,
    /// How the joint moves.
    pub motion: JointMotion,
    /// The joint's axis in the link's frame, of any length but zero.
    pub axis: [f64; 3],
    /// The rotation from the link's frame to the parent's at joint position zero, by rows.
    pub rotation: [[f64; 3]; 3],
    /// The origin of the link's frame in the parent's, m.
    pub translation: [f64; 3],
    /// The link's inertia; `None` only for a link that is fixed to another, has a massive one fixed to it, or is the
    /// crosspiece of a universal joint: it turns, and carries a massive one that turns across it.
    pub inertia: Option<LinkInertia>,
    /// The least and the largest joint position, rad or m; infinite where there is none.
    pub limits: [f64; 2],
}

/// A chain, or tree, of links as it is written down.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainParameters {
    /// The name of the base link.
    pub base_name: String,
    /// How the base moves.
    pub base: Base,
    /// The inertia of the base; needed where it is free.
    pub base_inertia: Option<LinkInertia>,
    /// The links, every one after its parent.
    pub links: Vec<ChainLink>,
    /// The acceleration of gravity in the world, m/s^2; zero in orbit.
    pub gravity: [f64; 3],
}

/// A link that moves against its parent; the axis of its joint is z of its frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    pub parent: Option<usize>,
    pub prismatic: bool,
    pub placement: Placement,
    /// The rotation from the body's frame to the link's.
    pub turn: Mat3,
    pub inertia: Inertia,
}

impl Body {
    /// The inertia in the link's frame.
    pub fn inertia_in_link(&self) -> Inertia {
        self.inertia.in_parent(&Placement::turned(self.turn))
    }
}

/// Refuses two links, or two joints, of one name.
fn check_names(parameters: &ChainParameters) -> Result<()> {
    let ChainParameters { base_name, links, .. } = parameters;
    for (i, link) in links.iter().enumerate() {
        let mut earlier = links[..i].iter();
        if link.name == *base_name || earlier.any(|l| l.name == link.name || l.joint == link.joint) {
            return Err(problem(&link.name, ChainProblem::DuplicateName));
        }
    }
    Ok(())
}

/// A checked chain: what stays the same whatever its state is.
///
/// The position q of a chain with n moving joints has n values; with a free base it begins with the base's position in the world
/// and its orientation as a quaternion, `[x, y, z, qx, qy, qz, qw]`. The velocity v begins, there, with the base's linear and
/// angular velocity in the base's own axes. These are the conventions of Pinocchio.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub(super) base: Base,
    pub(super) base_inertia: Inertia,
    pub(super) bodies: Vec<Body>,
    pub(super) gravity: Vec3,
    joints: Vec<String>,
    limits: Vec<[f64; 2]>,
}

impl Chain {
    /// Checks a chain.
    ///
    /// # Errors
    /// [`ArmError::Chain`], with the name of the link, where a name occurs twice, a link comes before its parent, a number is not
    /// finite, an axis is zero, a rotation is none, a mass is not positive, moments of inertia belong to no body, a link that moves
    /// has no mass, limits exclude each other, or nothing moves.
    pub fn new(parameters: &ChainParameters) -> Result<Self> {
        let ChainParameters { base_name, links, .. } = parameters;
        check_names(parameters)?;
        for g in parameters.gravity {
            finite("gravity, m/s^2,", g).map_err(|e| problem(base_name, e))?;
        }
        let base_inertia = inertia(parameters.base_inertia.as_ref()).map_err(|e| problem(base_name, e))?;
        let mut chain = Chain {
            base: parameters.base,
            base_inertia,
            bodies: Vec::new(),
            gravity: Vec3::from_slice(&parameters.gravity),
            joints: Vec::new(),
            limits: Vec::new(),
        };
        // The body, and the place in it, to which each link belongs.
        let mut places: Vec<(Option<usize>, Placement)> = Vec::with_capacity(links.len());
        let mut names = Vec::new();
        for (i, link) in links.iter().enumerate() {
            let wrong = |e| problem(&link.name, e);
            let own = check(i, link).map_err(wrong)?;
            let (parent, parent_place) = link.parent.map_or((None, Placement::default()), |p| places[p]);
            let place = parent_place.then(&Placement {
                rotation: Mat3::from_rows(&link.rotation),
                translation: Vec3::from_slice(&link.translation),
            });
            if link.motion == JointMotion::Fixed {
                let total = match parent {
                    Some(body) => &mut chain.bodies[body].inertia,
                    None => &mut chain.base_inertia,
                };
                *total = total.plus(&own.in_parent(&place));
                places.push((parent, place));
                continue;
            }
            let turn = Placement::turned(axis_to_z(Vec3::from_slice(&link.axis)));
            // The link's own frame in the turned one.
            let inverse = Placement::turned(turn.rotation.transpose());
            places.push((Some(chain.bodies.len()), inverse));
            names.push(&link.name);
            chain.joints.push(link.joint.clone());
            chain.limits.push(link.limits);
            chain.bodies.push(Body {
                parent,
                prismatic: link.motion == JointMotion::Prismatic,
                placement: place.then(&turn),
                turn: turn.rotation,
                inertia: own.in_parent(&inverse),
            });
        }
        chain.check_masses(base_name, &names)?;
        Ok(chain)
    }

    /// Refuses a chain in which nothing moves, or something that moves has no mass; the names are those of the links that move.
    fn check_masses(&self, base_name: &str, names: &[&String]) -> Result<()> {
        if self.bodies.is_empty() {
            return Err(problem(base_name, ChainProblem::NothingMoves));
        }
        for (i, (body, name)) in self.bodies.iter().zip(names).enumerate() {
            if !(body.inertia.mass > 0.0 || self.is_crosspiece(i)) {
                return Err(problem(name, ChainProblem::Massless));
            }
        }
        if self.base == Base::Free && !(self.base_inertia.mass > 0.0) {
            return Err(problem(base_name, ChainProblem::Massless));
        }
        Ok(())
    }

    /// Whether a body without mass turns another that turns across it and has a mass, as the crosspiece of a universal joint does.
    fn is_crosspiece(&self, i: usize) -> bool {
        let turned = |b: &Body| b.parent == Some(i) && !b.prismatic && b.inertia.mass > 0.0;
        let across = |b: &Body| b.placement.rotation.z.z.abs() < CROSSPIECE;
        !self.bodies[i].prismatic && self.bodies.iter().any(|b| turned(b) && across(b))
    }

    /// How the base moves.
    pub fn base(&self) -> Base {
        self.base
    }

    /// The names of the joints that move, in the order of q.
    pub fn joints(&self) -> &[String] {
        &self.joints
    }

    /// Whether each joint that moves is prismatic: its position is in m and its force in N.
    pub fn prismatic(&self) -> impl Iterator<Item = bool> + '_ {
        self.bodies.iter().map(|body| body.prismatic)
    }

    /// The least and the largest position of every joint that moves, rad or m.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.limits
    }

    /// The number of values of a position q.
    pub fn positions(&self) -> usize {
        self.bodies.len() + if self.base == Base::Free { 7 } else { 0 }
    }

    /// The number of values of a velocity, an acceleration or a vector of joint torques.
    pub fn velocities(&self) -> usize {
        self.bodies.len() + self.first()
    }

    /// Where the joints begin in a velocity.
    #[inline(always)]
    pub(super) fn first(&self) -> usize {
        if self.base == Base::Free { 6 } else { 0 }
    }
}

fn problem(link: &str, problem: ChainProblem) -> Error {
    let link = link.to_owned();
    Error::Arm(ArmError::Chain { link, problem })
}

fn finite(quantity: &'static str, value: f64) -> std::result::Result<(), ChainProblem> {
    let requirement = "finite";
    let number = ChainProblem::Number {
        quantity,
        value,
        requirement,
    };
    if value.is_finite() { Ok(()) } else { Err(number) }
}

/// The inertia of a link, after checking the link and its joint.
fn check(i: usize, link: &ChainLink) -> std::result::Result<Inertia, ChainProblem> {
    if let Some(parent) = link.parent.filter(|&p| p >= i) {
        return Err(ChainProblem::Parent { parent });
    }
    for value in link.translation {
        finite("a coordinate of its origin, m,", value)?;
    }
    let r = Mat3::from_rows(&link.rotation);
    let Mat3 { x, y, z } = r.transpose() * r - Mat3::IDENTITY;
    let off = [x, y, z].into_iter().flat_map(Vec3::to_array);
    if !(off.into_iter().all(|e| e.abs() < ROTATION_TOLERANCE) && r.x.cross(r.y).dot(r.z) > 0.0) {
        return Err(ChainProblem::NotARotation);
    }
    if link.motion != JointMotion::Fixed {
        let axis = Vec3::from_slice(&link.axis);
        if !(axis.dot(axis) > 0.0 && axis.dot(axis).is_finite()) {
            return Err(ChainProblem::NoAxis);
        }
        let [lower, upper] = link.limits;
        if !(lower <= upper) {
            return Err(ChainProblem::Limits { lower, upper });
        }
    }
    inertia(link.inertia.as_ref())
}

/// A checked inertia about the link's origin; zero where there is none.
fn inertia(link: Option<&LinkInertia>) -> std::result::Result<Inertia, ChainProblem> {
    let Some(LinkInertia { mass, com, matrix }) = link else {
        return Ok(Inertia::default());
    };
    if !(*mass > 0.0 && mass.is_finite()) {
        return Err(ChainProblem::Number {
            quantity: "its mass, kg,",
            value: *mass,
            requirement: "positive and finite",
        });
    }
    for &value in com {
        finite("a coordinate of its centre of mass, m,", value)?;
    }
    let elements = matrix.concat();
    for &value in &elements {
        finite("an element of its inertia matrix, kg m^2,", value)?;
    }
    if (0..3).any(|i| (0..i).any(|j| matrix[i][j] != matrix[j][i])) {
        return Err(ChainProblem::NotSymmetric);
    }
    let eigen = linalg::symmetric_eigen(&elements, 3);
    let mut principal = [f64::NAN; 3];
    if let Some(eigen) = eigen {
        principal.copy_from_slice(&eigen.values);
        principal.sort_unstable_by(f64::total_cmp);
    }
    let [a, b, c] = principal;
    let slack = TRIANGLE_TOLERANCE * c;
    if !(c >= 0.0 && a >= -slack && a + b >= c - slack) {
        return Err(ChainProblem::Inertia { principal });
    }
    Ok(Inertia::new(*mass, Vec3::from_slice(com), Mat3::from_rows(matrix)))
}

/// A rotation whose z column is the direction of the axis.
fn axis_to_z(axis: Vec3) -> Mat3 {
    let z = axis * (1.0 / axis.dot(axis).sqrt());
    if z == Vec3::Z {
        return Mat3::IDENTITY;
    }
    // The coordinate axis that is farthest from z.
    let away = match [z.x.abs(), z.y.abs(), z.z.abs()] {
        [x, y, z] if x <= y && x <= z => Vec3::new(1.0, 0.0, 0.0),
        [_, y, z] if y <= z => Vec3::new(0.0, 1.0, 0.0),
        _ => Vec3::Z,
    };
    let x = away - z * away.dot(z);
    let x = x * (1.0 / x.dot(x).sqrt());
    Mat3 { x, y: z.cross(x), z }
}
