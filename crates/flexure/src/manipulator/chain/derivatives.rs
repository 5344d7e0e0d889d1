//! Derivatives of the dynamics: the recursion of Newton and Euler, differentiated along every direction (Carpentier & Mansard 2018,
//! Analytical derivatives of rigid body dynamics algorithms, RSS).
//!
//! A direction is one component of a velocity: a joint's motion, or a motion of a free base in its own axes. Along that of joint j a body
//! beyond the joint changes by
//!
//! $$ \frac{\partial (X m)}{\partial q_j} = -S_j \times X m, \qquad \frac{\partial (X^{-*} f)}{\partial q_j} = X^{-*} (S_j \times^* f) $$
//!
//! for the motion m of its parent and the force f through the joint; all other bodies stay.

use super::data::{BodyData, ChainData, length};
use super::model::{Base, Chain};
use super::spatial::{Inertia, Spatial};
use crate::error::{ArmError, Error, Result};
use crate::linalg::inverse_positive_definite;

/// How accelerations change with the state and the torques: by rows, [`Chain::velocities`] squared values each.
#[derive(Debug, Clone, PartialEq)]
pub struct ForwardDerivatives {
    /// With the position; along a motion of a free base in its own axes.
    pub by_position: Vec<f64>,
    /// With the velocity.
    pub by_velocity: Vec<f64>,
    /// With the torques: the inverse of the inertia matrix.
    pub by_torque: Vec<f64>,
}

/// How a body's motion and the force on it change along a direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tangent {
    velocity: Spatial,
    acceleration: Spatial,
    force: Spatial,
}

/// What changes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Varied {
    Position,
    Velocity,
}

/// The motion of the base, gravity as an acceleration against it, and the velocities of the joints.
struct Motion<'a> {
    base: BodyData,
    lifted: Spatial,
    rates: &'a [f64],
}

impl Chain {
    /// How the torques of [`Chain::inverse_dynamics`] change with the position and with the velocity: by rows, one a torque, with
    /// [`Chain::velocities`] columns. A free base's position changes along a motion in its own axes, as in Pinocchio.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    ///
    /// ```
    /// use flexure::manipulator::chain::{Chain, ChainPreset};
    ///
    /// let arm = Chain::new(&ChainPreset::SixJointArm.parameters())?;
    /// let (mut data, rest) = (arm.data(), [0.0; 6]);
    /// let (mut by_q, mut by_v) = ([0.0; 36], [0.0; 36]);
    /// arm.inverse_dynamics_derivatives(&mut data, &[0.3; 6], &rest, &rest, &mut by_q, &mut by_v)?;
    /// // At rest, torques hold the links against gravity alone: no speed matters, and turning about the vertical changes nothing.
    /// assert!(by_v.iter().all(|value| *value == 0.0) && by_q[0].abs() < 1e-12 && by_q[7].abs() > 1.0);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn inverse_dynamics_derivatives(
        &self,
        data: &mut ChainData,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) -> Result<()> {
        let n = self.velocities();
        length("by_position", by_position, n * n)?;
        length("by_velocity", by_velocity, n * n)?;
        // The torques stand in the first columns until these are written.
        self.inverse_dynamics(data, q, v, a, &mut by_position[..n])?;
        let ((velocity, rates), (acceleration, _)) = (self.split(v), self.split(a));
        let lifted = self.lifted(data);
        let base = BodyData {
            velocity,
            acceleration: acceleration + lifted,
            ..BodyData::default()
        };
        let motion = Motion { base, lifted, rates };
        for k in 0..n {
            self.vary(data, &motion, Varied::Position, k, by_position);
            self.vary(data, &motion, Varied::Velocity, k, by_velocity);
        }
        Ok(())
    }

    /// How the accelerations of [`Chain::forward_dynamics`] change. It allocates its results.
    ///
    /// # Errors
    /// A vector of another length, a quaternion of length zero, or an inertia beyond a joint that is not positive.
    pub fn forward_dynamics_derivatives(
        &self,
        data: &mut ChainData,
        q: &[f64],
        v: &[f64],
        tau: &[f64],
    ) -> Result<ForwardDerivatives> {
        let n = self.velocities();
        let (mut a, mut mass) = (vec![0.0; n], vec![0.0; n * n]);
        let (mut by_q, mut by_v) = (mass.clone(), mass.clone());
        self.forward_dynamics(data, q, v, tau, &mut a)?;
        self.inverse_dynamics_derivatives(data, q, v, &a, &mut by_q, &mut by_v)?;
        self.mass_matrix(data, q, &mut mass)?;
        let inverse = inverse_positive_definite(&mass, n).ok_or_else(|| {
            Error::Arm(ArmError::SingularChain {
                joint: self.joints()[0].clone(),
            })
        })?;
        // M a + h = tau: what the torques would have to do, the accelerations do.
        let through = |torques: &[f64]| -> Vec<f64> {
            let entry = |i: usize, j: usize| (0..n).map(|k| inverse[i * n + k] * torques[k * n + j]).sum::<f64>();
            (0..n * n).map(|at| -entry(at / n, at % n)).collect()
        };
        Ok(ForwardDerivatives {
            by_position: through(&by_q),
            by_velocity: through(&by_v),
            by_torque: inverse,
        })
    }

    /// Column `k` of the derivatives, after [`Chain::inverse_dynamics`] has left motions and forces in `data`.
    fn vary(&self, data: &mut ChainData, motion: &Motion<'_>, varied: Varied, k: usize, matrix: &mut [f64]) {
        let (n, first) = (self.velocities(), self.first());
        let ChainData { bodies, tangents, .. } = data;
        let mut base = Tangent::default();
        if k < first {
            let mut unit = [0.0; 6];
            unit[k] = 1.0;
            let along = Spatial::from_slice(&unit);
            match varied {
                // Seen from a base that turns, gravity turns the other way.
                Varied::Position => base.acceleration = motion.lifted.cross_motion(along),
                Varied::Velocity => base.velocity = along,
            }
            base.force = changed_force(&self.base_inertia, &motion.base, &base);
        }
        // The first body that moves: the parents of others come before them.
        let start = k.saturating_sub(first);
        tangents.fill(Tangent::default());
        for i in start..bodies.len() {
            let (body, state) = (&self.bodies[i], &bodies[i]);
            let carrier = body.parent.map_or(base, |p| tangents[p]);
            let mut tangent = Tangent {
                velocity: state.placement.motion_from_parent(carrier.velocity),
                acceleration: state.placement.motion_from_parent(carrier.acceleration),
                force: Spatial::ZERO,
            };
            if first + i == k {
                let along = body.motion(1.0);
                let parent = body.parent.map_or(&motion.base, |p| &bodies[p]);
                match varied {
                    Varied::Position => {
                        let [v, a] =
                            [parent.velocity, parent.acceleration].map(|m| state.placement.motion_from_parent(m));
                        tangent.velocity += v.cross_motion(along);
                        tangent.acceleration += a.cross_motion(along);
                    }
                    Varied::Velocity => {
                        tangent.velocity += along;
                        tangent.acceleration += state.velocity.cross_motion(along);
                    }
                }
            }
            tangent.acceleration += tangent.velocity.cross_motion(body.motion(motion.rates[i]));
            tangent.force = changed_force(&body.inertia, state, &tangent);
            tangents[i] = tangent;
        }
        for i in (0..bodies.len()).rev() {
            let (body, state) = (&self.bodies[i], &bodies[i]);
            let mut force = tangents[i].force;
            matrix[(first + i) * n + k] = body.along(force);
            if first + i == k && varied == Varied::Position {
                force += body.motion(1.0).cross_force(state.force);
            }
            let force = state.placement.force_to_parent(force);
            match body.parent {
                Some(p) => tangents[p].force += force,
                None => base.force += force,
            }
        }
        if self.base == Base::Free {
            for (row, value) in base.force.to_array().into_iter().enumerate() {
                matrix[row * n + k] = value;
            }
        }
    }
}

/// How `I a + v x* I v` changes.
fn changed_force(inertia: &Inertia, state: &BodyData, tangent: &Tangent) -> Spatial {
    let v = state.velocity;
    inertia.times(tangent.acceleration)
        + tangent.velocity.cross_force(inertia.times(v))
        + v.cross_force(inertia.times(tangent.velocity))
}
