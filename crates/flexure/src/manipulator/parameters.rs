//! The parameters of an arm.

use serde::{Deserialize, Serialize};

use super::joint::{Friction, Stiffness};
use super::links::Link;

/// The kind of an arm's joints, which decides its equations of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    /// Rigid joints, (4)-(6).
    Rigid,
    /// Linear flexible joints (Spong).
    Linear,
    /// Nonlinear flexible joints with friction, (7)-(12).
    Nonlinear,
}

/// The parts of the equations that can be switched on and off.
///
/// The defaults, [`Parts::of`], give each model as stated in the paper:
///
/// | part | rigid | linear | nonlinear |
/// |---|---|---|---|
/// | `friction` (12), of links and motors | off | off | on |
/// | `cubic` term of (10) | - | - | on |
/// | `windup` (11) | - | - | on |
/// | `coupling` S (9) | off | off | on |
/// | `rotor_in_link_inertia`: `Jm2` added to `M11` | off | off | off |
/// | `rotors`: `Jm` (and S) geared rigidly to the links | off | - | - |
///
/// Link 1 carries rotor 2: with `S` and without `rotor_in_link_inertia`, the kinetic energy is not that of real bodies, but this is the
/// paper's form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts {
    /// Friction (12), if a joint or its motor has any.
    pub friction: bool,
    /// The cubic stiffness `a1`.
    pub cubic: bool,
    /// The soft wind-up (11).
    pub windup: bool,
    /// The inertial coupling `S` (9) of rotor 2 and link 1.
    pub coupling: bool,
    /// The inertia of rotor 2 in `M11`.
    pub rotor_in_link_inertia: bool,
    /// The rotors' inertia in a rigid arm.
    pub rotors: bool,
}

impl Parts {
    /// The parts of a model as stated in the paper.
    pub fn of(model: JointKind) -> Self {
        let nonlinear = model == JointKind::Nonlinear;
        Parts {
            friction: nonlinear,
            cubic: nonlinear,
            windup: nonlinear,
            coupling: nonlinear,
            rotor_in_link_inertia: false,
            rotors: false,
        }
    }
}

/// The parameters of a joint; values that the model does not use are neither read nor checked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointParameters {
    /// Inertia `Jm` of the motor's rotor, seen from the link side, kg m^2; positive.
    pub motor_inertia: f64,
    /// Stiffness `k` of the linear model, N m/rad; positive.
    pub stiffness: f64,
    /// `a1` of the nonlinear model, N m/rad^3; not negative.
    pub cubic: f64,
    /// `a2` of the nonlinear model, N m/rad; positive.
    pub linear: f64,
    /// `ksw` of the nonlinear model, N m/rad; from 0 to below `a2`, so that the stiffness is
    /// positive everywhere (its least value, at `d = 0`, is `a2 - ksw`).
    pub windup: f64,
    /// `asw` of the nonlinear model, 1/rad^2; positive if `ksw` is not zero.
    pub windup_sharpness: f64,
    /// Damping `c` of a flexible joint, parallel to its spring: a torque `c (qm' - q')`, N m s/rad; not negative. The paper has none.
    pub damping: f64,
    /// Friction at the link, a torque against `q'`, if any: `g1 .. g6` not negative, `g2 >= g3`.
    pub friction: Option<Friction>,
    /// Friction at the motor, a torque against `qm'` seen from the link side, if any, with the same ranges. The paper has none.
    pub motor_friction: Option<Friction>,
    /// Holds `q` and `qm` of this joint at their initial values.
    pub locked: bool,
}

impl JointParameters {
    /// The stiffness (10) with the soft wind-up (11): that of the nonlinear model with all its parts.
    pub fn nonlinear_stiffness(&self) -> Stiffness {
        Stiffness {
            cubic: self.cubic,
            linear: self.linear,
            windup: self.windup,
            windup_sharpness: self.windup_sharpness,
        }
    }
}

/// The parameters of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmParameters {
    /// The equations of motion.
    pub model: JointKind,
    /// Link 1 (from the shoulder to the elbow) and link 2.
    pub links: [Link; 2],
    /// The shoulder and the elbow.
    pub joints: [JointParameters; 2],
    /// The parts that are switched on.
    pub parts: Parts,
}

/// The two-link space manipulator with values commonly quoted for Ulrich & Sasiadek's arm.
///
/// They could not be checked against the original papers.
pub fn space_arm(model: JointKind) -> ArmParameters {
    let link = Link {
        mass: 1.5075,
        length: 4.5,
        com: 2.25,
        inertia: 2.544,
    };
    let joint = JointParameters {
        motor_inertia: 1.0,
        stiffness: 500.0,
        cubic: 500.0,
        linear: 500.0,
        windup: 10.0,
        windup_sharpness: 3000.0,
        damping: 0.0,
        friction: Some(Friction([0.5, 150.0, 50.0, 2.0, 100.0, 0.5])),
        motor_friction: None,
        locked: false,
    };
    ArmParameters {
        model,
        links: [link; 2],
        joints: [joint; 2],
        parts: Parts::of(model),
    }
}
