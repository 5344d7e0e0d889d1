//! Chains with motors and flexible joints: the paper's (7)-(12) for any chain.
//!
//! The motor of joint i turns by \\(q_{m,i}\\), seen from the link side. Its rotor has the inertia \\(J_m\\), seen from there too: the gear
//! ratio squared times its own. Spring, damper and friction are those of the two-link arm:
//!
//! \\[\begin{aligned} M(q) q'' + S(q) q_m'' + \ldots &= \kappa(q_m - q) + c (q_m' - q') - f(q') \\\\
//!    S^T q'' + J_m q_m'' &= \tau - \kappa(q_m - q) - c (q_m' - q') - f_m(q_m') \end{aligned}\\]
//!
//! A rotor sits on the link that carries its joint, with its axis along the joint's. Beyond its own turning it has the energy
//! \\(\tfrac{J_m}{r} q_m' \omega\\), with \\(\omega\\) the carrier's angular velocity about the axis and r the gear ratio: this is S, and with
//! it the rotor's gyroscopic moment (Tomei 1991; De Luca and Book, Springer Handbook of Robotics, chapter 11). On two links in a plane
//! and r = 1 it is the paper's (9). Motors are eliminated inside the passes of articulated bodies: a rotor of a flexible joint takes
//! \\(J_m / r^2\\) from its carrier's inertia about the axis, and so the cost stays linear in the number of joints.
//!
//! A passive joint has no motor: \\(M(q) q'' + \ldots = \tau - \kappa(q) - c q' - f(q')\\).

use super::data::{ChainData, length};
use super::drive::{ChainDrive, Drive, RotorCoupling};
use super::model::{Base, Chain};
use super::rnea::{CentroidalMomentum, ChainEnergy, RotorSpin};
use super::vector::Vec3;
use crate::error::Result;
use crate::manipulator::checks;

/// A chain, and what moves its joints.
///
/// A state has the chain's position q and velocity v, and for every flexible joint, in the order of the joints, the motor's position and
/// velocity. In one vector it is `[q, qm, v, vm]`.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenChain {
    chain: Chain,
    pub(super) drives: Vec<Drive>,
    coupling: RotorCoupling,
    flexible: usize,
}

/// What a rotor adds to the passes at its joint.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RotorTerm {
    /// To the joint's own inertia.
    pub mass: f64,
    /// To the carrier's acceleration in the equation of the joint.
    pub coupling: f64,
    /// To the carrier's inertia about the joint's axis.
    pub carried: f64,
    /// To the moment that the carrier's motion needs, in the axes of the link.
    pub moment: Vec3,
}

/// The work space of a [`DrivenChain`]; of one thread at a time.
#[derive(Debug, Clone)]
pub struct DrivenData {
    pub(super) chain: ChainData,
    forces: Vec<f64>,
    terms: Vec<RotorTerm>,
    drive: Vec<f64>,
}

/// A state of a driven chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrivenState<'a> {
    /// The chain's position.
    pub q: &'a [f64],
    /// The chain's velocity.
    pub v: &'a [f64],
    /// The positions of the motors of flexible joints, rad or m.
    pub motor_q: &'a [f64],
    /// Their velocities.
    pub motor_v: &'a [f64],
}

impl DrivenChain {
    /// Checks the drives, one a joint that moves; without any, all joints are rigid.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data) where there is not one a joint; [`Error::Arm`](crate::Error::Arm) with the joint's number, from
    /// 1, for a value out of its range.
    pub fn new(chain: Chain, drives: &[ChainDrive], coupling: RotorCoupling) -> Result<Self> {
        let none = vec![ChainDrive::default(); chain.bodies.len()];
        let drives = if drives.is_empty() { &none } else { drives };
        if drives.len() != chain.bodies.len() {
            return Err(crate::Error::length("drives", drives.len(), chain.bodies.len()));
        }
        let checked = chain.bodies.iter().zip(drives).enumerate();
        let drives = checked.map(|(i, (body, drive))| {
            checks::chain_drive(i + 1, drive)?;
            let coupling = if body.prismatic { RotorCoupling::None } else { coupling };
            Ok(Drive::of(drive, coupling))
        });
        let drives: Vec<Drive> = drives.collect::<Result<_>>()?;
        let flexible = drives.iter().filter(|d| d.flexible).count();
        Ok(DrivenChain {
            chain,
            drives,
            coupling,
            flexible,
        })
    }

    /// The chain of links.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Whether any joint has friction, a spring, or a motor with an inertia.
    pub fn has_drives(&self) -> bool {
        self.drives.iter().any(|drive| !drive.is_ideal())
    }

    /// How the rotors act on their carriers.
    pub fn coupling(&self) -> RotorCoupling {
        self.coupling
    }

    /// Whether each joint has a motor behind a spring.
    pub fn flexible(&self) -> Vec<bool> {
        self.drives.iter().map(|d| d.flexible).collect()
    }

    /// Whether each joint has no motor.
    pub fn passive(&self) -> Vec<bool> {
        self.drives.iter().map(|d| d.passive).collect()
    }

    /// The names of the joints on which a torque acts: those that are not passive.
    pub fn driven(&self) -> Vec<&String> {
        let joints = self.chain.joints().iter().zip(&self.drives);
        joints
            .filter_map(|(name, drive)| (!drive.passive).then_some(name))
            .collect()
    }

    /// The number of flexible joints.
    pub fn motors(&self) -> usize {
        self.flexible
    }

    /// The number of values of a state.
    pub fn dimension(&self) -> usize {
        self.chain.positions() + self.chain.velocities() + 2 * self.flexible
    }

    /// The drive of a joint.
    pub(super) fn drive(&self, joint: usize) -> &Drive {
        &self.drives[joint]
    }

    /// A work space for this chain.
    pub fn data(&self) -> DrivenData {
        let n = self.drives.len();
        DrivenData {
            chain: self.chain.data(),
            forces: vec![0.0; n],
            terms: vec![RotorTerm::default(); n],
            drive: vec![0.0; n],
        }
    }

    /// The parts of a state in one vector.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn state<'a>(&self, x: &'a [f64]) -> Result<DrivenState<'a>> {
        length("state", x, self.dimension())?;
        let (positions, velocities) = x.split_at(self.chain.positions() + self.flexible);
        let (q, motor_q) = positions.split_at(self.chain.positions());
        let (v, motor_v) = velocities.split_at(self.chain.velocities());
        Ok(DrivenState { q, v, motor_q, motor_v })
    }

    /// The accelerations of the chain and of the motors of flexible joints under the torques `tau`: [`Chain::velocities`] values, with a
    /// free base the force and the moment on it first, then the motors' torques, seen from the link side.
    ///
    /// # Errors
    /// A vector of another length, a quaternion of length zero, or an inertia beyond a joint that is not positive.
    pub fn accelerations(
        &self,
        data: &mut DrivenData,
        state: &DrivenState<'_>,
        tau: &[f64],
        acceleration: &mut [f64],
        motor_acceleration: &mut [f64],
    ) -> Result<()> {
        let (chain, n) = (&self.chain, self.chain.velocities());
        length("v", state.v, n)?;
        length("tau", tau, n)?;
        length("acceleration", acceleration, n)?;
        for (name, values) in [("motor_q", state.motor_q), ("motor_v", state.motor_v)] {
            length(name, values, self.flexible)?;
        }
        length("motor_acceleration", motor_acceleration, self.flexible)?;
        chain.place(&mut data.chain, state.q)?;
        chain.bias(&mut data.chain, state.v);
        let (base_force, torques) = chain.split(tau);
        self.act(data, state, torques);
        chain.articulate::<f64, true>(&mut data.chain, &data.forces, &data.terms)?;
        chain.accelerate(&mut data.chain, base_force, acceleration)?;

        let joints = self.drives.iter().enumerate().filter(|(_, d)| d.flexible);
        for ((i, drive), am) in joints.zip(motor_acceleration) {
            let carrier = data.chain.bodies[i].acceleration.angular.z - acceleration[chain.first() + i];
            *am = (data.drive[i] - drive.spin * carrier) / drive.motor;
        }
        Ok(())
    }

    /// The torques on the joints, and what the rotors add.
    fn act(&self, data: &mut DrivenData, state: &DrivenState<'_>, torques: &[f64]) {
        let first = self.chain.first();
        let (q, v) = (
            &state.q[self.chain.positions() - self.drives.len()..],
            &state.v[first..],
        );
        let mut motor = 0;
        for (i, drive) in self.drives.iter().enumerate() {
            let turning = data.chain.bodies[i].velocity.angular;
            // The gyroscopic moment of a rotor whose spin against the carrier is h.
            let gyroscopic = |h: f64| Vec3::new(turning.y * h, -turning.x * h, 0.0);
            if !drive.flexible {
                (data.forces[i], _) = drive.torques(q[i], v[i], None, torques[i]);
                data.terms[i] = RotorTerm {
                    mass: drive.motor,
                    coupling: drive.spin,
                    carried: drive.carried,
                    moment: gyroscopic(drive.spin * v[i] + drive.carried * (turning.z - v[i])),
                };
                continue;
            }
            let (qm, vm) = (state.motor_q[motor], state.motor_v[motor]);
            motor += 1;
            let (on_link, left) = drive.torques(q[i], v[i], Some((qm, vm)), torques[i]);
            (data.forces[i], data.drive[i]) = (on_link, left);
            if drive.spin == 0.0 {
                data.terms[i] = RotorTerm::default();
                continue;
            }
            let mut moment = gyroscopic(drive.spin * vm + drive.carried * (turning.z - v[i]));
            moment.z = left * drive.spin / drive.motor;
            data.terms[i] = RotorTerm {
                mass: 0.0,
                coupling: 0.0,
                carried: drive.carried - drive.eliminated,
                moment,
            };
        }
    }

    /// The time derivative of the state `x` under the torques `tau`, as those of [`DrivenChain::accelerations`]. That of a quaternion
    /// keeps its length.
    ///
    /// # Errors
    /// Those of [`DrivenChain::accelerations`].
    pub fn derivative(&self, data: &mut DrivenData, x: &[f64], tau: &[f64], derivative: &mut [f64]) -> Result<()> {
        let state = self.state(x)?;
        length("derivative", derivative, x.len())?;
        let (rates, accelerations) = derivative.split_at_mut(state.q.len() + self.flexible);
        let (acceleration, motor_acceleration) = accelerations.split_at_mut(state.v.len());
        self.accelerations(data, &state, tau, acceleration, motor_acceleration)?;
        let (rate, motor_rate) = rates.split_at_mut(state.q.len());
        motor_rate.copy_from_slice(state.motor_v);
        let first = self.chain.first();
        if self.chain.base == Base::Free {
            let [x, y, z, w] = [state.q[3], state.q[4], state.q[5], state.q[6]];
            let [a, b, c] = [0.5 * state.v[3], 0.5 * state.v[4], 0.5 * state.v[5]];
            let velocity = data.chain.base.placement.rotation * Vec3::from_slice(state.v);
            rate[..3].copy_from_slice(&velocity.to_array());
            rate[3..7].copy_from_slice(&[
                w * a + y * c - z * b,
                w * b + z * a - x * c,
                w * c + x * b - y * a,
                -x * a - y * b - z * c,
            ]);
            rate[7..].copy_from_slice(&state.v[first..]);
        } else {
            rate.copy_from_slice(state.v);
        }
        Ok(())
    }

    /// The energy of links, rotors and springs; friction and damping never let it grow.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn energy(&self, data: &mut DrivenData, state: &DrivenState<'_>) -> Result<ChainEnergy> {
        let mut energy = self.chain.energy(&mut data.chain, state.q, state.v)?;
        length("motor_q", state.motor_q, self.flexible)?;
        let (spins, first) = (self.spins(state)?, self.chain.first());
        let mut motor = 0;
        for (i, (drive, vm)) in self.drives.iter().zip(spins).enumerate() {
            let carrier = data.chain.bodies[i].velocity.angular.z - state.v[first + i];
            energy.kinetic += 0.5 * drive.motor * vm * vm + drive.spin * vm * carrier;
            energy.kinetic += 0.5 * drive.carried * carrier * carrier;
            let q = state.q[state.q.len() - self.drives.len() + i];
            if drive.flexible {
                energy.potential += drive.stiffness.potential(state.motor_q[motor] - q);
                motor += 1;
            } else if drive.passive {
                energy.potential += drive.stiffness.potential(-q);
            }
        }
        Ok(energy)
    }

    /// The momentum about the centre of mass, with the rotors' spin where they are coupled to their carriers; conserved without gravity
    /// where the base is free.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn centroidal_momentum(&self, data: &mut DrivenData, state: &DrivenState<'_>) -> Result<CentroidalMomentum> {
        let rotors = self.drives.iter().zip(self.spins(state)?).map(|(drive, vm)| RotorSpin {
            spin: drive.spin * vm,
            carried: drive.carried,
        });
        let rotors: Vec<RotorSpin> = rotors.collect();
        (self.chain).total_momentum(&mut data.chain, state.q, state.v, &rotors)
    }

    /// The velocities of all motors.
    fn spins(&self, state: &DrivenState<'_>) -> Result<Vec<f64>> {
        length("motor_v", state.motor_v, self.flexible)?;
        length("v", state.v, self.chain.velocities())?;
        let (mut motors, links) = (state.motor_v.iter(), &state.v[self.chain.first()..]);
        let spins = self
            .drives
            .iter()
            .zip(links)
            .map(move |(drive, &v)| match drive.flexible {
                true => motors.next().copied().unwrap_or_default(),
                false => v,
            });
        Ok(spins.collect())
    }
}
