//! What the passes write while they compute, made once and used again: no call allocates.

use super::derivatives::Tangent;
use super::model::{Base, Body, Chain};
use super::spatial::{Articulated, Inertia, Placement, Spatial};
use super::vector::{Mat3, Vec3};
use crate::error::{Error, Result};

/// The work space of a chain's algorithms; of one chain, and of one thread at a time.
#[derive(Debug, Clone)]
pub struct ChainData {
    pub(super) base: BodyData,
    pub(super) bodies: Vec<BodyData>,
    pub(super) tangents: Vec<Tangent>,
}

/// What the passes know of a body, in its own frame.
#[derive(Debug, Clone, Default)]
pub(super) struct BodyData {
    /// Where it lies in its parent, or the base in the world.
    pub placement: Placement,
    pub velocity: Spatial,
    /// The velocity product `v x S q'`, then the acceleration.
    pub acceleration: Spatial,
    /// The force through its joint, or the articulated bias force.
    pub force: Spatial,
    pub articulated: Articulated,
    pub composite: Inertia,
    /// `U = I S`, `D = S^T U` and `u = tau - S^T p` of the joint.
    pub joint_inertia: Spatial,
    pub joint_mass: f64,
    pub joint_force: f64,
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

    /// The position in which every joint is at zero and a free base at the origin of the world.
    pub fn neutral(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.positions()];
        if self.base == Base::Free {
            q[6] = 1.0;
        }
        q
    }

    /// Checks a position and sets every body's placement.
    pub(super) fn place(&self, data: &mut ChainData, q: &[f64]) -> Result<()> {
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
    pub(super) fn lifted(&self, data: &ChainData) -> Spatial {
        Spatial {
            linear: data.base.placement.rotation.transposed_times(-self.gravity),
            angular: Vec3::ZERO,
        }
    }

    /// The base's velocity and those of all joints.
    #[inline(always)]
    pub(super) fn split<'a>(&self, v: &'a [f64]) -> (Spatial, &'a [f64]) {
        match self.base {
            Base::Fixed => (Spatial::ZERO, v),
            Base::Free => (Spatial::from_slice(v), &v[6..]),
        }
    }
}

impl Body {
    /// Where the body lies in its parent at joint position q.
    #[inline(always)]
    fn placed(&self, q: f64) -> Placement {
        let Placement { rotation, translation } = self.placement;
        if self.prismatic {
            return Placement {
                rotation,
                translation: translation + rotation.z * q,
            };
        }
        let (sin, cos) = q.sin_cos();
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
    pub fn motion(&self, s: f64) -> Spatial {
        let along = Vec3::new(0.0, 0.0, s);
        if self.prismatic {
            Spatial {
                linear: along,
                angular: Vec3::ZERO,
            }
        } else {
            Spatial {
                linear: Vec3::ZERO,
                angular: along,
            }
        }
    }

    /// `S^T f`: the part of a force that acts on the joint.
    #[inline(always)]
    pub fn along(&self, f: Spatial) -> f64 {
        if self.prismatic { f.linear.z } else { f.angular.z }
    }
}

/// Where a free base lies in the world. A quaternion of any length but zero is an orientation.
fn free_placement(q: &[f64]) -> Result<Placement> {
    let (x, y, z, w) = (q[3], q[4], q[5], q[6]);
    let square = x * x + y * y + z * z + w * w;
    if !(square > 0.0 && square.is_finite()) {
        let name = "the squared length of the quaternion q[3..7]";
        return Err(Error::parameter(name, square, "positive and finite"));
    }
    let s = 2.0 / square;
    let rotation = Mat3::from_rows(&[
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]);
    let translation = Vec3::from_slice(q);
    Ok(Placement { rotation, translation })
}

/// Checks the length of a vector.
pub(super) fn length(name: &str, values: &[f64], expected: usize) -> Result<()> {
    if values.len() == expected {
        return Ok(());
    }
    Err(Error::length(name, values.len(), expected))
}
