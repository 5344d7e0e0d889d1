//! Forward dynamics by articulated bodies (Featherstone 2008, table 7.1; with a floating base, table 9.4).

use super::data::{ChainData, length};
use super::drives::RotorTerm;
use super::model::{Base, Chain};
use super::spatial::{Articulated, Spatial};
use crate::error::{ArmError, Error, Result};
use crate::number::Number;

impl Chain {
    /// The accelerations under the joint torques `tau` at the position `q` and the velocity `v`.
    ///
    /// `v`, `tau` and `acceleration` have [`Chain::velocities`] values (rad/s or m/s, N m or N, rad/s^2 or m/s^2). With a free base
    /// the first six of `tau` are the force and the moment on the base, and those of `acceleration` the derivatives of its velocity,
    /// in the base's axes.
    ///
    /// # Errors
    /// A vector of another length, a quaternion of length zero, or an articulated inertia that is not positive.
    pub fn forward_dynamics(
        &self,
        data: &mut ChainData,
        q: &[f64],
        v: &[f64],
        tau: &[f64],
        acceleration: &mut [f64],
    ) -> Result<()> {
        self.accelerations(data, q, v, tau, acceleration)
    }

    /// [`Chain::forward_dynamics`] of one state, or of several in lanes.
    #[inline(always)]
    pub(super) fn accelerations<T: Number>(
        &self,
        data: &mut ChainData<T>,
        q: &[T],
        v: &[T],
        tau: &[T],
        acceleration: &mut [T],
    ) -> Result<()> {
        let n = self.velocities();
        length("v", v, n)?;
        length("tau", tau, n)?;
        length("acceleration", acceleration, n)?;
        self.place(data, q)?;
        self.bias(data, v);
        let (base_force, joint_forces) = self.split(tau);
        self.articulate::<T, false>(data, joint_forces, &[])?;
        self.accelerate(data, base_force, acceleration)
    }

    /// Outward: velocities, velocity products, and the bodies' own inertias and bias forces. A fixed base has the velocity in `data`.
    #[inline(always)]
    pub(super) fn bias<T: Number>(&self, data: &mut ChainData<T>, v: &[T]) {
        let (base_velocity, dq) = self.split(v);
        if self.base == Base::Free {
            data.base.velocity = base_velocity;
            let inertia = self.base_inertia.like(v[0]);
            data.base.articulated = Articulated::of(&inertia);
            data.base.force = base_velocity.cross_force(inertia.times(base_velocity));
        }
        for (i, (body, &dq)) in self.bodies.iter().zip(dq).enumerate() {
            let carrier = match body.parent {
                Some(p) => data.bodies[p].velocity,
                None => data.base.velocity,
            };
            let inertia = body.inertia.like(dq);
            let state = &mut data.bodies[i];
            let motion = body.motion(dq);
            let v = state.placement.motion_from_parent(carrier) + motion;
            state.velocity = v;
            state.acceleration = v.cross_motion(motion);
            state.articulated = Articulated::of(&inertia);
            state.force = v.cross_force(inertia.times(v));
        }
    }

    /// Inward: the articulated inertias and bias forces, with the rotors' `terms` where there are `ROTORS`.
    #[inline(always)]
    pub(super) fn articulate<T: Number, const ROTORS: bool>(
        &self,
        data: &mut ChainData<T>,
        tau: &[T],
        terms: &[RotorTerm],
    ) -> Result<()> {
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let (before, rest) = data.bodies.split_at_mut(i);
            let state = &mut rest[0];
            let mut u = state.articulated.column(body.prismatic);
            let mut d = body.along(u);
            if ROTORS {
                d = d + terms[i].mass;
                u.angular.z = u.angular.z + terms[i].coupling;
            }
            if !d.is_positive() {
                return Err(self.singular(i));
            }
            state.joint_inertia = u;
            state.joint_mass = d.filled(1.0) / d;
            state.joint_force = tau[i] - body.along(state.force);
            let total = match body.parent {
                Some(p) => &mut before[p],
                None if self.base == Base::Free => &mut data.base,
                None => continue,
            };
            let mut left = state.articulated.without(u, state.joint_mass);
            let mut force = state.force + left.times(state.acceleration) + u * (state.joint_force * state.joint_mass);
            if ROTORS {
                left.angular.z.z = left.angular.z.z + terms[i].carried;
                force.angular = force.angular + terms[i].moment.like(d);
            }
            left.add_to_parent(&state.placement, &mut total.articulated);
            total.force += state.placement.force_to_parent(force);
        }
        Ok(())
    }

    /// Outward: the accelerations. A fixed base has the one in `data`.
    #[inline(always)]
    pub(super) fn accelerate<T: Number>(
        &self,
        data: &mut ChainData<T>,
        base_force: Spatial<T>,
        acceleration: &mut [T],
    ) -> Result<()> {
        let mut base = self.lifted(data) + data.base.acceleration;
        if self.base == Base::Free {
            let own = (data.base.articulated).solve(base_force - data.base.force);
            let Some(own) = own else { return Err(self.singular(0)) };
            acceleration[..6].copy_from_slice(&(own - base).to_array());
            base = own;
        }
        let joints = &mut acceleration[self.first()..];
        for (i, (body, ddq)) in self.bodies.iter().zip(joints).enumerate() {
            let carrier = match body.parent {
                Some(p) => data.bodies[p].acceleration,
                None => base,
            };
            let state = &mut data.bodies[i];
            let a = state.placement.motion_from_parent(carrier) + state.acceleration;
            *ddq = (state.joint_force - state.joint_inertia.dot(a)) * state.joint_mass;
            state.acceleration = a + body.motion(*ddq);
        }
        Ok(())
    }

    fn singular(&self, joint: usize) -> Error {
        Error::Arm(ArmError::SingularChain {
            joint: self.joints()[joint].clone(),
        })
    }
}
