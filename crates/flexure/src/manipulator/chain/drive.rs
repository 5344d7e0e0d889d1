//! The motor of one joint, and the torques of spring, damper and friction.

use crate::error::{Error, Result};
use crate::manipulator::parameters::{JointKind, JointParameters};
use crate::manipulator::{Friction, Stiffness, elementary};

/// The motor of a joint and what lies between it and the link. All values are seen from the link side; of a joint that slides they
/// are forces, masses and metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainDrive {
    /// Whether the joint is rigid, a linear spring or a nonlinear one.
    pub kind: JointKind,
    /// The motor's inertia, the spring and the friction; a rigid joint's motor may have no inertia. Friction counts in every kind.
    pub joint: JointParameters,
    /// Turns of the rotor for one of the joint; positive. It matters for [`RotorCoupling`] alone.
    pub gear_ratio: f64,
    /// Whether the joint has no motor: its spring, damper and friction act between the link and its carrier, relaxed at position zero. What
    /// is the motor's does not count then.
    pub passive: bool,
}

impl Default for ChainDrive {
    /// A rigid joint without friction and with a motor without inertia.
    fn default() -> Self {
        ChainDrive {
            kind: JointKind::Rigid,
            joint: JointParameters::default(),
            gear_ratio: 1.0,
            passive: false,
        }
    }
}

/// How the rotors' turning acts on the links that carry them. Rotors of joints that slide never do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RotorCoupling {
    /// Not at all (Spong 1987).
    #[default]
    None,
    /// Through S alone, as in the paper.
    Inertial,
    /// Through S, and with the rotors' inertia about their axes in that of the carriers, which is the energy of real bodies.
    Complete,
}

/// A drive as the equations use it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::manipulator) struct Drive {
    /// Whether there is a motor behind a spring.
    pub flexible: bool,
    pub passive: bool,
    pub stiffness: Stiffness,
    pub damping: f64,
    friction: Option<Friction>,
    motor_friction: Option<Friction>,
    /// `Jm`.
    pub motor: f64,
    /// `Jm / r`, or zero without coupling.
    pub spin: f64,
    /// `Jm / r^2` where the carrier has the rotor's inertia, or zero.
    pub carried: f64,
    /// `Jm / r^2` of the coupling, or zero.
    pub eliminated: f64,
}

impl Drive {
    /// A checked drive.
    pub fn of(drive: &ChainDrive, coupling: RotorCoupling) -> Self {
        let joint = &drive.joint;
        let ratio = match coupling {
            RotorCoupling::None => f64::INFINITY,
            _ => drive.gear_ratio,
        };
        let used = |f: Option<Friction>| f.filter(|f| f.0 != [0.0; 6]);
        let motor = if drive.passive { 0.0 } else { joint.motor_inertia };
        let (spin, inertia) = (motor / ratio, motor / ratio / ratio);
        Drive {
            flexible: drive.kind != JointKind::Rigid && !drive.passive,
            passive: drive.passive,
            stiffness: match drive.kind {
                JointKind::Rigid => Stiffness::default(),
                JointKind::Linear => Stiffness {
                    linear: joint.stiffness,
                    ..Stiffness::default()
                },
                JointKind::Nonlinear => joint.nonlinear_stiffness(),
            },
            damping: joint.damping,
            friction: used(joint.friction),
            motor_friction: used(joint.motor_friction).filter(|_| !drive.passive),
            motor,
            spin,
            carried: if coupling == RotorCoupling::Complete {
                inertia
            } else {
                0.0
            },
            eliminated: inertia,
        }
    }

    /// Whether it is a rigid joint without friction, whose motor has no inertia.
    pub fn is_ideal(&self) -> bool {
        !self.flexible && !self.passive && self.motor == 0.0 && self.friction.is_none() && self.motor_friction.is_none()
    }

    /// The torque on the link at this joint position and velocity, and what is left of `tau` to turn the motor behind a spring, which is at
    /// `motor`.
    #[inline(always)]
    pub fn torques(&self, q: f64, v: f64, motor: Option<(f64, f64)>, tau: f64) -> (f64, f64) {
        let friction = friction_torque(self.friction.as_ref(), v);
        let elastic = |d: f64, rate: f64| elastic_torque(&self.stiffness, d) + self.damping * rate;
        match motor {
            Some((qm, vm)) => {
                let elastic = elastic(qm - q, vm - v);
                let left = tau - elastic - friction_torque(self.motor_friction.as_ref(), vm);
                (elastic - friction, left)
            }
            None if self.passive => (tau + elastic(-q, -v) - friction, 0.0),
            None => {
                let rubbing = friction + friction_torque(self.motor_friction.as_ref(), v);
                (tau - rubbing, 0.0)
            }
        }
    }
}

impl Drive {
    /// The spring's tangent at a deflection, and the damper beside it.
    pub fn tangent(&self, deflection: f64) -> (f64, f64) {
        (self.stiffness.tangent(deflection), self.damping)
    }

    /// The spring's tangent where it holds gravity's torque, and the damper beside it.
    ///
    /// # Errors
    /// A torque that a spring, as it softens, cannot hold; with the joint's name.
    pub fn loaded(&self, torque: f64, joint: &str) -> Result<(f64, f64)> {
        let deflection = self.stiffness.deflection(torque).ok_or_else(|| {
            let name = format!("the torque of gravity on the spring of joint '{joint}'");
            Error::parameter(name, torque, "one that the spring can hold")
        })?;
        Ok(self.tangent(deflection))
    }
}

/// The friction torque (12); `joint.rs` has the plain formula.
#[inline(always)]
fn friction_torque(friction: Option<&Friction>, v: f64) -> f64 {
    let Some(Friction(g)) = friction else { return 0.0 };
    let t = elementary::tanh([g[1] * v, g[2] * v, g[4] * v, 0.0]);
    g[0] * (t[0] - t[1]) + g[3] * t[2] + g[5] * v
}

/// The elastic torque (10), (11); `joint.rs` has the plain formula.
#[inline(always)]
fn elastic_torque(stiffness: &Stiffness, d: f64) -> f64 {
    let mut slope = stiffness.cubic * d * d + stiffness.linear;
    if stiffness.windup != 0.0 {
        slope -= stiffness.windup * elementary::exp_nonpositive([-stiffness.windup_sharpness * d * d])[0];
    }
    slope * d
}
