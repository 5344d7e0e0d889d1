//! Inverse dynamics by Newton and Euler's recursion (Featherstone 2008, tables 5.1 and 9.6), energy and momentum.

use super::data::{ChainData, length};
use super::model::{Base, Chain};
use super::spatial::{Inertia, Spatial};
use crate::error::Result;
use crate::number::Number;

/// The energy of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainEnergy {
    /// Of the motion, J.
    pub kinetic: f64,
    /// In the field of gravity, against the origin of the world, J. What a fixed base carries does not count.
    pub potential: f64,
}

/// The momentum of a chain about its centre of mass, in the axes of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentroidalMomentum {
    /// kg m/s.
    pub linear: [f64; 3],
    /// kg m^2/s.
    pub angular: [f64; 3],
    /// The centre of mass in the world, m.
    pub com: [f64; 3],
}

/// What the rotor of a joint has of angular momentum along its axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct RotorSpin {
    /// From turning against its carrier, kg m^2/s.
    pub spin: f64,
    /// The inertia that turns with the carrier, kg m^2.
    pub carried: f64,
}

impl Chain {
    /// The joint torques that accelerate the chain by `a` at the position `q` and the velocity `v`: the inverse of
    /// [`Chain::forward_dynamics`], with the same units.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn inverse_dynamics(
        &self,
        data: &mut ChainData,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        tau: &mut [f64],
    ) -> Result<()> {
        self.torques(data, q, v, a, tau)
    }

    /// [`Chain::inverse_dynamics`] of one state, or of several in lanes.
    #[inline(always)]
    pub(super) fn torques<T: Number>(
        &self,
        data: &mut ChainData<T>,
        q: &[T],
        v: &[T],
        a: &[T],
        tau: &mut [T],
    ) -> Result<()> {
        length("tau", tau, self.velocities())?;
        let (v0, a0) = self.move_outward(data, q, v, a)?;
        let base = self.base_inertia.like(v[0]);
        data.base.force = base.times(a0) + v0.cross_force(base.times(v0));
        for (body, state) in self.bodies.iter().zip(&mut data.bodies) {
            let (v, a) = (state.velocity, state.acceleration);
            let inertia = body.inertia.like(v.linear.x);
            state.force = inertia.times(a) + v.cross_force(inertia.times(v));
        }
        let first = self.first();
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let force = data.bodies[i].force;
            tau[first + i] = body.along(force);
            let force = data.bodies[i].placement.force_to_parent(force);
            match body.parent {
                Some(p) => data.bodies[p].force += force,
                None => data.base.force += force,
            }
        }
        if self.base == Base::Free {
            tau[..6].copy_from_slice(&data.base.force.to_array());
        }
        Ok(())
    }

    /// Outward: the velocities and the accelerations, against gravity, of all bodies; those of the base are returned.
    #[inline(always)]
    pub(super) fn move_outward<T: Number>(
        &self,
        data: &mut ChainData<T>,
        q: &[T],
        v: &[T],
        a: &[T],
    ) -> Result<(Spatial<T>, Spatial<T>)> {
        length("v", v, self.velocities())?;
        length("a", a, self.velocities())?;
        self.place(data, q)?;
        let ((v0, dq), (a0, ddq)) = (self.split(v), self.split(a));
        let a0 = a0 + self.lifted(data);
        for (i, (body, (&dq, &ddq))) in self.bodies.iter().zip(dq.iter().zip(ddq)).enumerate() {
            let (pv, pa) = match body.parent {
                Some(p) => (data.bodies[p].velocity, data.bodies[p].acceleration),
                None => (v0, a0),
            };
            let state = &mut data.bodies[i];
            let motion = body.motion(dq);
            let v = state.placement.motion_from_parent(pv) + motion;
            state.velocity = v;
            state.acceleration = state.placement.motion_from_parent(pa) + body.motion(ddq) + v.cross_motion(motion);
        }
        Ok((v0, a0))
    }

    /// The kinetic energy, and the potential energy in the field of gravity.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn energy(&self, data: &mut ChainData, q: &[f64], v: &[f64]) -> Result<ChainEnergy> {
        let (_, total) = self.momentum(data, q, v, &[])?;
        let moving = (self.bodies.iter().zip(&data.bodies)).map(|(b, s)| s.velocity.dot(b.inertia.times(s.velocity)));
        let base = data.base.velocity;
        let world = total.in_parent(&data.base.placement);
        Ok(ChainEnergy {
            kinetic: 0.5 * (moving.sum::<f64>() + base.dot(self.base_inertia.times(base))),
            potential: -world.first.dot(self.gravity),
        })
    }

    /// The momentum about the centre of mass (Orin, Goswami and Lee 2013), which is conserved without gravity where the base is free.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn centroidal_momentum(&self, data: &mut ChainData, q: &[f64], v: &[f64]) -> Result<CentroidalMomentum> {
        self.total_momentum(data, q, v, &[])
    }

    /// The momentum about the centre of mass, with the angular momenta that rotors of joints have beside their links, along their axes.
    pub(super) fn total_momentum(
        &self,
        data: &mut ChainData,
        q: &[f64],
        v: &[f64],
        rotors: &[RotorSpin],
    ) -> Result<CentroidalMomentum> {
        let (momentum, total) = self.momentum(data, q, v, rotors)?;
        let place = data.base.placement;
        let com = total.in_parent(&place).first * (1.0 / total.mass);
        let Spatial { linear, angular } = place.force_to_parent(momentum);
        Ok(CentroidalMomentum {
            linear: linear.to_array(),
            angular: (angular - com.cross(linear)).to_array(),
            com: com.to_array(),
        })
    }

    /// The momentum and the inertia of all that moves, about the base's origin and in its axes.
    fn momentum(&self, data: &mut ChainData, q: &[f64], v: &[f64], rotors: &[RotorSpin]) -> Result<(Spatial, Inertia)> {
        length("v", v, self.velocities())?;
        self.place(data, q)?;
        let (v0, dq) = self.split(v);
        data.base.velocity = v0;
        let own = if self.base == Base::Free {
            self.base_inertia
        } else {
            Inertia::default()
        };
        data.base.composite = own;
        data.base.force = own.times(v0);
        for (i, (body, &dq)) in self.bodies.iter().zip(dq).enumerate() {
            let carrier = body.parent.map_or(v0, |p| data.bodies[p].velocity);
            let state = &mut data.bodies[i];
            state.velocity = state.placement.motion_from_parent(carrier) + body.motion(dq);
            state.force = body.inertia.times(state.velocity);
            state.composite = body.inertia;
        }
        for ((state, rotor), &dq) in data.bodies.iter_mut().zip(rotors).zip(dq) {
            // A couple is the same about every point: that of the carrier, in the axes of the link.
            state.force.angular.z += rotor.spin + rotor.carried * (state.velocity.angular.z - dq);
        }
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let state = &data.bodies[i];
            let force = state.placement.force_to_parent(state.force);
            let composite = state.composite.in_parent(&state.placement);
            let total = match body.parent {
                Some(p) => &mut data.bodies[p],
                None => &mut data.base,
            };
            total.force += force;
            total.composite = total.composite.plus(&composite);
        }
        Ok((data.base.force, data.base.composite))
    }
}
