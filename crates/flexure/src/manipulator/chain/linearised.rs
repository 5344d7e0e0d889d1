//! A driven chain near rest: small motions \\(\mathcal M \delta'' + \mathcal D \delta' + \mathcal K \delta = B \tau\\), and their modes.
//!
//! \\(\delta\\) has the chain's velocities' directions and the motors of flexible joints. M is the matrix of the kinetic energy with the
//! rotors', K has gravity's derivative and the springs' tangents where the springs carry the links, D the dampers beside the springs.
//! Friction is left out: Coulomb friction at rest has no slope that matters for a small motion.

use super::drives::{DrivenChain, DrivenData, DrivenState};
use super::model::Base;
use crate::error::{ArmError, Error, Result};
use crate::linalg::{Matrix, symmetric_eigen};

/// A squared frequency below this share of the largest is zero but for rounding.
const ROUNDING: f64 = 1e-12;

/// Whether brakes hold the motors of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Motors {
    /// They turn under their torques, and rigid joints move.
    #[default]
    Free,
    /// They stand still, and so do rigid joints that are not passive.
    Held,
}

/// A driven chain near rest.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedChain {
    /// The number of coordinates: those of [`Chain::velocities`](super::Chain::velocities), then the motors of flexible joints.
    pub dimension: usize,
    /// M by rows, kg m^2, kg m or kg.
    pub mass: Vec<f64>,
    /// D by rows, N m s/rad.
    pub damping: Vec<f64>,
    /// K by rows, N m/rad; symmetric.
    pub stiffness: Vec<f64>,
    /// The coordinate on which each torque acts.
    pub driven: Vec<usize>,
    /// The coordinates that stand still when brakes hold the motors.
    held: Vec<bool>,
    /// The first joint's name, for errors.
    joint: String,
}

/// A mode of the small motions without damping.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainMode {
    /// The square of the circular frequency, rad^2/s^2: zero for motion without a spring, negative where rest is not stable.
    pub square: f64,
    /// The share of critical damping, \\(\phi^T D \phi / (2 \omega)\\) of the mode \\(\phi\\) with \\(\phi^T M \phi = 1\\); it is exact
    /// where D does not couple the modes. Zero without a frequency.
    pub damping_ratio: f64,
    /// The coordinates' amplitudes; the largest is 1. Those that are held are zero.
    pub shape: Vec<f64>,
}

impl ChainMode {
    /// The frequency in Hz; none without a spring or a stable rest.
    pub fn frequency(&self) -> Option<f64> {
        (self.square > 0.0).then(|| self.square.sqrt() / std::f64::consts::TAU)
    }
}

/// Refuses a free base under gravity.
pub(in crate::manipulator) fn check_rest(free: bool, gravity: &[f64]) -> Result<()> {
    let strongest = gravity.iter().fold(0.0, |most: f64, g| most.max(g.abs()));
    if free && strongest > 0.0 {
        return Err(Error::parameter(
            "gravity on a free base, m/s^2,",
            strongest,
            "zero: the base falls and is never at rest",
        ));
    }
    Ok(())
}

impl DrivenChain {
    /// The chain near rest at the position `q`, held there by its springs and its motors. The springs of passive joints have the stiffness
    /// that they have at `q`, whether or not they hold gravity there.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero; [`Error::Parameter`] for a free base under gravity, which falls, and
    /// where gravity's torque is more than a spring, as it softens, can hold.
    ///
    /// ```
    /// use flexure::manipulator::JointKind;
    /// use flexure::manipulator::chain::{Chain, ChainDrive, ChainPreset, DrivenChain, Motors, RotorCoupling};
    ///
    /// let mut drive = ChainDrive { kind: JointKind::Linear, ..ChainDrive::default() };
    /// (drive.joint.motor_inertia, drive.joint.stiffness) = (0.5, 2e4);
    /// let chain = Chain::new(&ChainPreset::SixJointArm.parameters())?;
    /// let arm = DrivenChain::new(chain, &[drive; 6], RotorCoupling::None)?;
    /// let modes = arm.linearised(&mut arm.data(), &[0.0, -1.0, 1.0, 0.0, 0.5, 0.0])?.modes(Motors::Held)?;
    /// let lowest = modes[0].frequency().unwrap();
    /// assert!(modes.len() == 6 && lowest > 1.0 && lowest < 50.0);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn linearised(&self, data: &mut DrivenData, q: &[f64]) -> Result<LinearisedChain> {
        let chain = self.chain();
        check_rest(chain.base() == Base::Free, &chain.gravity.to_array())?;
        let (n, first) = (chain.velocities(), chain.first());
        let motors: Vec<usize> = (self.flexible().iter().enumerate())
            .filter_map(|(i, flexible)| flexible.then_some(i))
            .collect();
        let all = n + motors.len();
        let rest = vec![0.0; n];
        let (mut by_q, mut by_v, mut gravity) = (vec![0.0; n * n], vec![0.0; n * n], rest.clone());
        chain.inverse_dynamics_derivatives(&mut data.chain, q, &rest, &rest, &mut by_q, &mut by_v)?;
        chain.inverse_dynamics(&mut data.chain, q, &rest, &rest, &mut gravity)?;

        let mut linearised = LinearisedChain::of(self.inertia(data, q)?, n, first, &chain.joints()[0]);
        for (row, values) in by_q.chunks(n).enumerate() {
            linearised.stiffness[row * all..row * all + n].copy_from_slice(values);
        }
        for (joint, _) in self.passive().iter().enumerate().filter(|(_, passive)| **passive) {
            let place = q[q.len() - chain.joints().len() + joint];
            linearised.add_spring(first + joint, None, self.drive(joint).tangent(-place));
        }
        for (k, &joint) in motors.iter().enumerate() {
            let spring = self
                .drive(joint)
                .loaded(gravity[first + joint], &chain.joints()[joint])?;
            linearised.add_spring(first + joint, Some(n + k), spring);
        }
        Ok(linearised)
    }

    /// The matrix of the kinetic energy in the velocities of the links and of the motors, by rows: the energy of pairs of unit velocities.
    fn inertia(&self, data: &mut DrivenData, q: &[f64]) -> Result<Vec<f64>> {
        let n = self.chain().velocities();
        let all = n + self.motors();
        let motor_q: Vec<f64> = vec![0.0; self.motors()];
        let mut energy = |i: usize, j: usize| {
            let mut rates = vec![0.0; all];
            rates[i] += 1.0;
            rates[j] += 1.0;
            let (v, motor_v) = rates.split_at(n);
            let state = DrivenState {
                q,
                v,
                motor_q: &motor_q,
                motor_v,
            };
            self.energy(data, &state).map(|energy| energy.kinetic)
        };
        let mut single = Vec::with_capacity(all);
        for i in 0..all {
            // A quarter of the energy at twice the velocity.
            single.push(0.25 * energy(i, i)?);
        }
        let mut mass = vec![0.0; all * all];
        for i in 0..all {
            mass[i * all + i] = 2.0 * single[i];
            for j in 0..i {
                let value = energy(i, j)? - single[i] - single[j];
                mass[i * all + j] = value;
                mass[j * all + i] = value;
            }
        }
        Ok(mass)
    }
}

impl LinearisedChain {
    /// Without springs: `links` coordinates, of which those from `first` on stand still when brakes hold the motors, then the motors.
    pub(in crate::manipulator) fn of(mass: Vec<f64>, links: usize, first: usize, joint: &str) -> Self {
        let all = (mass.len() as f64).sqrt() as usize;
        LinearisedChain {
            dimension: all,
            mass,
            damping: vec![0.0; all * all],
            stiffness: vec![0.0; all * all],
            driven: (0..links).collect(),
            held: (0..all).map(|k| k >= first).collect(),
            joint: joint.to_owned(),
        }
    }

    /// Adds a spring and the damper beside it between a link and its motor, or what carries it.
    pub(in crate::manipulator) fn add_spring(&mut self, link: usize, motor: Option<usize>, spring: (f64, f64)) {
        let all = self.dimension;
        for (matrix, value) in [(&mut self.stiffness, spring.0), (&mut self.damping, spring.1)] {
            matrix[link * all + link] += value;
            if let Some(motor) = motor {
                matrix[motor * all + motor] += value;
                matrix[link * all + motor] -= value;
                matrix[motor * all + link] -= value;
            }
        }
        if let Some(motor) = motor {
            self.driven[link] = motor;
        }
        self.release(link);
    }

    /// Lets a coordinate move when brakes hold the motors.
    pub(in crate::manipulator) fn release(&mut self, coordinate: usize) {
        self.held[coordinate] = false;
    }

    /// The modes without damping, the lowest first.
    ///
    /// # Errors
    /// [`ArmError::SingularChain`] where the inertia matrix is not positive definite.
    pub fn modes(&self, motors: Motors) -> Result<Vec<ChainMode>> {
        let moves = |k: &usize| motors == Motors::Free || !self.held[*k];
        let kept: Vec<usize> = (0..self.dimension).filter(moves).collect();
        let part =
            |rows: &[f64]| Matrix::from_fn(kept.len(), kept.len(), |i, j| rows[kept[i] * self.dimension + kept[j]]);
        let [mass, damping, stiffness] = [&self.mass, &self.damping, &self.stiffness].map(|rows| part(rows));
        let singular = || {
            Error::Arm(ArmError::SingularChain {
                joint: self.joint.clone(),
            })
        };
        // M = L L^T; the modes are those of L^-1 K L^-T.
        let factor = mass.cholesky().ok_or_else(singular)?.l();
        let half = factor.solve_lower_triangular(&stiffness).ok_or_else(singular)?;
        let whole = factor.solve_lower_triangular(&half.transpose()).ok_or_else(singular)?;
        let symmetric = (&whole + whole.transpose()) * 0.5;
        let eigen = symmetric_eigen(symmetric.as_slice(), kept.len()).ok_or_else(singular)?;
        let largest = eigen.values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let mut modes = Vec::with_capacity(kept.len());
        for (k, &value) in eigen.values.iter().enumerate() {
            let direction = Matrix::from_column_slice(kept.len(), 1, &eigen.vectors[k * kept.len()..][..kept.len()]);
            let shape = factor.tr_solve_lower_triangular(&direction).ok_or_else(singular)?;
            // Rounding leaves no motion without a spring exactly at zero.
            let square = if value.abs() <= ROUNDING * largest { 0.0 } else { value };
            let damped = (shape.transpose() * &damping * &shape)[(0, 0)];
            let scale = shape
                .iter()
                .fold(0.0, |most: f64, v| if v.abs() > most.abs() { *v } else { most });
            let mut amplitudes = vec![0.0; self.dimension];
            for (&at, value) in kept.iter().zip(shape.iter()) {
                amplitudes[at] = value / scale;
            }
            modes.push(ChainMode {
                square,
                damping_ratio: if square > 0.0 {
                    0.5 * damped / square.sqrt()
                } else {
                    0.0
                },
                shape: amplitudes,
            });
        }
        modes.sort_by(|a, b| a.square.total_cmp(&b.square));
        Ok(modes)
    }
}
