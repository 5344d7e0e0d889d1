//! What the passes write while they compute, made once and used again: no call allocates.

use super::derivatives::Tangent;
use super::model::{Base, Body, Chain};
use super::spatial::{Articulated, Inertia, Placement, Spatial};
use super::vector::{Mat3, Vec3};
use crate::error::{Error, Result};
use crate::manipulator::elementary;
use crate::number::Number;

/// The work space of a chain's algorithms; of one chain, and of one thread at a time.
#[derive(Debug, Clone)]
pub struct ChainData<T = f64> {
    pub(super) base: BodyData<T>,
    pub(super) bodies: Vec<BodyData<T>>,
    pub(super) tangents: Vec<Tangent>,
}

/// What the passes know of a body, in its own frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyData<T = f64> {
    /// Where it lies in its parent, or the base in the world.
    pub placement: Placement<T>,
    pub velocity: Spatial<T>,
    /// The velocity product `v x S q'`, then the acceleration.
    pub acceleration: Spatial<T>,
    /// The force through its joint, or the articulated bias force.
    pub force: Spatial<T>,
    pub articulated: Articulated<T>,
    pub composite: Inertia<T>,
    /// `U = I S`, `D = S^T U` and `u = tau - S^T p` of the joint.
    pub joint_inertia: Spatial<T>,
    pub joint_mass: T,
    pub joint_force: T,
}

impl Default for BodyData {
    fn default() -> Self {
        BodyData {
            placement: Placement::default(),
            velocity: Spatial::ZERO,
            acceleration: Spatial::ZERO,
            force: Spatial::ZERO,
            articulated: Articulated::default(),
            composite: Inertia::default(),
            joint_inertia: Spatial::ZERO,
            joint_mass: 0.0,
            joint_force: 0.0,
        }
    }
}

impl BodyData {
    /// The same in every lane of a number.
    #[inline(always)]
    fn like<T: Number>(&self, number: T) -> BodyData<T> {
        let inertia = self.composite.like(number);
        let force = self.force.like(number);
        BodyData {
            placement: self.placement.like(number),
            velocity: force,
            acceleration: force,
            force,
            articulated: Articulated::of(&inertia),
            composite: inertia,
            joint_inertia: force,
            joint_mass: number,
            joint_force: number,
        }
    }
}

impl Chain {
    /// A work space for this chain.
    pub fn data(&self) -> ChainData {
        ChainData {
            base: BodyData::default(),
            bodies: vec![BodyData::default(); self.bodies.len()],
            tangents: vec![Tangent::default(); self.bodies.len()],
        }
    }

    /// A work space for numbers like this one: for states in lanes.
    #[inline(always)]
    pub(super) fn data_like<T: Number>(&self, number: T) -> ChainData<T> {
        let body = BodyData::default().like(number);
        ChainData {
            base: body,
            bodies: vec![body; self.bodies.len()],
            tangents: Vec::new(),
        }
    }

    /// The position in which every joint is at zero and a free base at the origin of the world.
    pub fn neutral(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.positions()];
        if self.base == Base::Free {
            q[6] = 1.0;
        }
        q
    }

    /// Checks a position and sets every body's placement.
    #[inline(always)]
    pub(super) fn place<T: Number>(&self, data: &mut ChainData<T>, q: &[T]) -> Result<()> {
        length("q", q, self.positions())?;
        if data.bodies.len() != self.bodies.len() {
            return Err(Error::length("data", data.bodies.len(), self.bodies.len()));
        }
        let joints = if self.base == Base::Free {
            data.base.placement = free_placement(q)?;
            &q[7..]
        } else {
            q
        };
        for ((body, state), &q) in self.bodies.iter().zip(&mut data.bodies).zip(joints) {
            state.placement = body.placed(q);
        }
        Ok(())
    }

    /// Gravity as an acceleration of the base against it, in the base's axes.
    #[inline(always)]
    pub(super) fn lifted<T: Number>(&self, data: &ChainData<T>) -> Spatial<T> {
        let rotation = &data.base.placement.rotation;
        Spatial {
            linear: rotation.transposed_times((-self.gravity).like(rotation.x.x)),
            angular: Vec3::ZERO.like(rotation.x.x),
        }
    }

    /// The base's velocity and those of all joints.
    #[inline(always)]
    pub(super) fn split<'a, T: Number>(&self, v: &'a [T]) -> (Spatial<T>, &'a [T]) {
        match self.base {
            Base::Fixed => (Spatial::ZERO.like(v[0]), v),
            Base::Free => (Spatial::from_slice(v), &v[6..]),
        }
    }
}

impl Body {
    /// Where the body lies in its parent at joint position q.
    #[inline(always)]
    fn placed<T: Number>(&self, q: T) -> Placement<T> {
        let Placement { rotation, translation } = self.placement.like(q);
        if self.prismatic {
            return Placement {
                rotation,
                translation: translation + rotation.z * q,
            };
        }
        let (sin, cos) = elementary::sin_cos(q);
        let Mat3 { x, y, z } = rotation;
        Placement {
            rotation: Mat3 {
                x: x * cos + y * sin,
                y: y * cos - x * sin,
                z,
            },
            translation,
        }
    }

    /// `S s`: the motion of the joint at the speed s.
    #[inline(always)]
    pub fn motion<T: Number>(&self, s: T) -> Spatial<T> {
        let none = Vec3::ZERO.like(s);
        let along = Vec3 { z: s, ..none };
        if self.prismatic {
            Spatial {
                linear: along,
                angular: none,
            }
        } else {
            Spatial {
                linear: none,
                angular: along,
            }
        }
    }

    /// `S^T f`: the part of a force that acts on the joint.
    #[inline(always)]
    pub fn along<T: Number>(&self, f: Spatial<T>) -> T {
        if self.prismatic { f.linear.z } else { f.angular.z }
    }
}

/// Where a free base lies in the world. A quaternion of any length but zero is an orientation.
#[inline(always)]
pub(super) fn free_placement<T: Number>(q: &[T]) -> Result<Placement<T>> {
    let (x, y, z, w) = (q[3], q[4], q[5], q[6]);
    let square = x * x + y * y + z * z + w * w;
    // One by infinity is zero.
    if !(square.is_positive() && (square.filled(1.0) / square).is_positive()) {
        let name = "the squared length of the quaternion q[3..7]";
        return Err(Error::parameter(name, square.first(), "positive and finite"));
    }
    let one = square.filled(1.0);
    let s = square.filled(2.0) / square;
    let rotation = Mat3::from_columns([
        [one - s * (y * y + z * z), s * (x * y + z * w), s * (x * z - y * w)],
        [s * (x * y - z * w), one - s * (x * x + z * z), s * (y * z + x * w)],
        [s * (x * z + y * w), s * (y * z - x * w), one - s * (x * x + y * y)],
    ]);
    let translation = Vec3::from_slice(q);
    Ok(Placement { rotation, translation })
}

/// Checks the length of a vector.
pub(super) fn length<T>(name: &str, values: &[T], expected: usize) -> Result<()> {
    if values.len() == expected {
        return Ok(());
    }
    Err(Error::length(name, values.len(), expected))
}
