//! A checked arm, ready for its equations of motion.

use super::checks;
use super::coefficients::Coefficients;
use super::joint::{Friction, Stiffness};
use super::links::LinkDynamics;
use super::parameters::{ArmParameters, JointKind};
use crate::error::Result;

/// An arm whose parameters have been checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arm {
    parameters: ArmParameters,
    pub(super) coefficients: Coefficients<f64>,
}

impl Arm {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`Error::Arm`](crate::Error::Arm) for a value outside its range,
    /// [`Error::Arm`](crate::Error::Arm) if the inertia matrix of links and
    /// rotors together is not positive definite for every `q2`.
    pub fn new(parameters: ArmParameters) -> Result<Self> {
        checks::ranges(&parameters)?;
        let arm = Arm {
            parameters,
            coefficients: Coefficients::new(&parameters),
        };
        checks::inertia(&arm)?;
        Ok(arm)
    }

    /// The parameters the arm was made from.
    pub fn parameters(&self) -> &ArmParameters {
        &self.parameters
    }

    /// The equations of motion it follows.
    pub fn model(&self) -> JointKind {
        self.parameters.model
    }

    /// The links' constants in effect.
    pub fn link_dynamics(&self) -> LinkDynamics {
        LinkDynamics {
            shoulder: self.coefficients.shoulder,
            elbow: self.coefficients.elbow,
            coupling: self.coefficients.swing,
        }
    }

    /// The stiffness of each joint in effect: terms that are switched off are zero.
    pub fn stiffness(&self) -> [Stiffness; 2] {
        self.coefficients.springs.map(|spring| spring.stiffness())
    }

    /// The friction of each joint in effect: zero where there is none or it is switched off.
    pub fn friction(&self) -> [Friction; 2] {
        self.coefficients.friction.map(Friction)
    }

    /// The friction of each motor in effect, with the same rule.
    pub fn motor_friction(&self) -> [Friction; 2] {
        self.coefficients.motor_friction.map(Friction)
    }

    /// Whether each joint moves.
    pub(super) fn free(&self) -> [bool; 2] {
        self.coefficients.form.free
    }
}
