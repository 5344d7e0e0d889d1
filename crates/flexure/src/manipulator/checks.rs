//! Whether an arm is physical.

use super::arm::Arm;
use super::chain::ChainDrive;
use super::parameters::{ArmParameters, JointKind, JointParameters, Parts};
use crate::error::{ArmError, Error, Result};

/// Checks every value that the model uses against its range.
pub(super) fn ranges(arm: &ArmParameters) -> Result<()> {
    for (i, link) in arm.links.iter().enumerate() {
        let part = Part("link", i + 1);
        part.positive("mass", link.mass, "kg")?;
        part.positive("length", link.length, "m")?;
        part.not_negative("com", link.com, "m")?;
        part.not_negative("inertia", link.inertia, "kg m^2")?;
    }
    for (i, joint) in arm.joints.iter().enumerate() {
        joint_ranges(arm.model, arm.parts, &Part("joint", i + 1), joint)?;
    }
    Ok(())
}

/// Checks the drive of joint `number` of a chain.
pub(super) fn chain_drive(number: usize, drive: &ChainDrive) -> Result<()> {
    let part = Part("joint", number);
    let parts = Parts {
        friction: true,
        rotors: drive.joint.motor_inertia != 0.0,
        ..Parts::of(drive.kind)
    };
    part.check(!drive.joint.locked, "locked", 1.0, "", "0: make the joint a fixed one")?;
    part.positive("gear_ratio", drive.gear_ratio, "")?;
    if drive.passive {
        // What is the motor's does not count.
        let joint = JointParameters {
            motor_inertia: 1.0,
            motor_friction: None,
            ..drive.joint
        };
        return joint_ranges(drive.kind, parts, &part, &joint);
    }
    joint_ranges(drive.kind, parts, &part, &drive.joint)
}

fn joint_ranges(model: JointKind, parts: Parts, part: &Part, joint: &JointParameters) -> Result<()> {
    if model != JointKind::Rigid || parts.rotors || parts.rotor_in_link_inertia {
        part.positive("motor_inertia", joint.motor_inertia, "kg m^2")?;
    }
    if model != JointKind::Rigid {
        part.not_negative("damping", joint.damping, "N m s/rad")?;
    }
    match model {
        JointKind::Rigid => {}
        JointKind::Linear => part.positive("stiffness", joint.stiffness, "N m/rad")?,
        JointKind::Nonlinear => {
            part.positive("linear", joint.linear, "N m/rad")?;
            if parts.cubic {
                part.not_negative("cubic", joint.cubic, "N m/rad^3")?;
            }
            if parts.windup {
                part.check(
                    joint.windup >= 0.0 && joint.windup < joint.linear,
                    "windup",
                    joint.windup,
                    "N m/rad",
                    "not negative and less than the linear stiffness (the stiffness at d = 0 is their difference)",
                )?;
                if joint.windup > 0.0 {
                    part.positive("windup_sharpness", joint.windup_sharpness, "1/rad^2")?;
                }
            }
        }
    }
    for (friction, names) in [(joint.friction, FRICTION), (joint.motor_friction, MOTOR_FRICTION)] {
        if let Some(friction) = friction.filter(|_| parts.friction) {
            friction_ranges(part, names, &friction.0)?;
        }
    }
    Ok(())
}

/// The names and units of the parameters of a joint's friction.
const FRICTION: [(&str, &str); 6] = [
    ("friction g1", "N m"),
    ("friction g2", "s/rad"),
    ("friction g3", "s/rad"),
    ("friction g4", "N m"),
    ("friction g5", "s/rad"),
    ("friction g6", "N m s/rad"),
];

/// The names and units of the parameters of its motor's friction.
const MOTOR_FRICTION: [(&str, &str); 6] = [
    ("motor_friction g1", "N m"),
    ("motor_friction g2", "s/rad"),
    ("motor_friction g3", "s/rad"),
    ("motor_friction g4", "N m"),
    ("motor_friction g5", "s/rad"),
    ("motor_friction g6", "N m s/rad"),
];

fn friction_ranges(part: &Part, names: [(&'static str, &'static str); 6], g: &[f64; 6]) -> Result<()> {
    for ((name, unit), value) in names.into_iter().zip(*g) {
        part.not_negative(name, value, unit)?;
    }
    part.check(
        g[1] >= g[2] || g[0] == 0.0,
        names[1].0,
        g[1],
        names[1].1,
        "at least g3 (otherwise the friction drives the joint)",
    )
}

/// "link" or "joint", and its number from 1.
struct Part(&'static str, usize);

impl Part {
    fn check(
        &self,
        ok: bool,
        quantity: &'static str,
        value: f64,
        unit: &'static str,
        requirement: &'static str,
    ) -> Result<()> {
        if ok {
            return Ok(());
        }
        Err(Error::Arm(ArmError::Unphysical {
            part: self.0,
            number: self.1,
            quantity,
            value,
            unit,
            requirement,
        }))
    }

    fn positive(&self, quantity: &'static str, value: f64, unit: &'static str) -> Result<()> {
        let ok = value > 0.0 && value.is_finite();
        self.check(ok, quantity, value, unit, "positive and finite")
    }

    fn not_negative(&self, quantity: &'static str, value: f64, unit: &'static str) -> Result<()> {
        let ok = value >= 0.0 && value.is_finite();
        self.check(ok, quantity, value, unit, "finite and not negative")
    }
}

/// Determinants below this share of the diagonal's product count as zero.
const SINGULAR: f64 = 1e-12;

/// Checks that the matrix of the equations of motion is positive definite for every `q2`.
///
/// The motors are eliminated exactly; the determinant of the remaining `M` is a concave quadratic in `cos q2`, and least at `cos q2` = 1 or
/// -1.
pub(super) fn inertia(arm: &Arm) -> Result<()> {
    positive_definite(arm, "inertia matrix", |cos| arm.coefficients.mass_terms(cos))
}

/// The same for `M + S`, which replaces `M` when deflections are commanded.
pub(super) fn deflection_inertia(arm: &Arm) -> Result<()> {
    positive_definite(arm, "inertia matrix M + S of the commanded arm", |cos| {
        arm.coefficients.deflection_mass(cos)
    })
}

fn positive_definite(arm: &Arm, matrix: &'static str, mass: impl Fn(f64) -> [[f64; 2]; 2]) -> Result<()> {
    let free = arm.free();
    for (cos, q2) in [(1.0, 0.0), (-1.0, std::f64::consts::PI)] {
        let m = mass(cos);
        let determinant = match free {
            [true, true] => m[0][0] * m[1][1] - m[0][1] * m[1][0],
            [true, false] => m[0][0],
            [false, _] => m[1][1],
        };
        let scale = match free {
            [true, true] => (m[0][0] * m[1][1]).abs(),
            _ => determinant.abs(),
        };
        let diagonal = (!free[0] || m[0][0] > 0.0) && (!free[1] || m[1][1] > 0.0);
        if !(diagonal && determinant > SINGULAR * scale) {
            return Err(Error::Arm(ArmError::SingularInertia {
                matrix,
                q2,
                determinant,
                hint: if arm.coefficients.coupling > 0.0 {
                    ", and the motor inertia of joint 2, which the coupling S takes from M11"
                } else {
                    ""
                },
            }));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::parameters::space_arm;
    use super::*;

    fn message(change: impl Fn(&mut ArmParameters)) -> String {
        let mut parameters = space_arm(JointKind::Nonlinear);
        change(&mut parameters);
        Arm::new(parameters).unwrap_err().to_string()
    }

    #[test]
    fn every_value_is_checked_by_name_with_its_unit() {
        type Change = fn(&mut ArmParameters);
        let cases: [(&str, Change); 12] = [
            ("mass of link 2 is -1 kg, but must be positive", |p| {
                p.links[1].mass = -1.0
            }),
            ("length of link 1 is 0 m", |p| p.links[0].length = 0.0),
            ("com of link 1 is NaN m", |p| p.links[0].com = f64::NAN),
            ("inertia of link 2 is -2 kg m^2", |p| p.links[1].inertia = -2.0),
            ("motor_inertia of joint 1 is 0 kg m^2", |p| {
                p.joints[0].motor_inertia = 0.0
            }),
            ("linear of joint 2 is -5 N m/rad", |p| p.joints[1].linear = -5.0),
            ("cubic of joint 1 is -1 N m/rad^3", |p| p.joints[0].cubic = -1.0),
            (
                "windup of joint 1 is 500 N m/rad, but must be not negative and less",
                |p| p.joints[0].windup = 500.0,
            ),
            ("windup_sharpness of joint 1 is 0 1/rad^2", |p| {
                p.joints[0].windup_sharpness = 0.0
            }),
            ("friction g4 of joint 2 is -1 N m", |p| {
                p.joints[1].friction.as_mut().unwrap().0[3] = -1.0
            }),
            ("friction g2 of joint 1 is 10 s/rad, but must be at least g3", |p| {
                p.joints[0].friction.as_mut().unwrap().0[1] = 10.0
            }),
            ("motor_inertia of joint 2 is inf", |p| {
                p.joints[1].motor_inertia = f64::INFINITY
            }),
        ];
        for (expected, change) in cases {
            let message = message(change);
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn a_singular_inertia_matrix_is_refused_wherever_it_occurs() {
        // Rotor 2 so heavy that M11 - Jm2 is too small in the stretched arm only.
        let text = message(|p| p.joints[1].motor_inertia = 20.0);
        assert!(text.contains("not positive definite at q2 = 0 rad"), "{text}");
        assert!(text.contains("coupling S"), "{text}");
        // A second link without extent.
        let text = message(|p| {
            p.parts = Parts::of(JointKind::Rigid);
            p.model = JointKind::Rigid;
            p.links[1].com = 0.0;
            p.links[1].inertia = 0.0;
        });
        assert!(text.contains("not positive definite"), "{text}");
    }

    #[test]
    fn what_the_model_does_not_use_is_not_checked() {
        let mut parameters = space_arm(JointKind::Linear);
        parameters.joints[0].windup = -1.0;
        parameters.joints[0].friction = Some(super::super::Friction([-1.0; 6]));
        assert!(Arm::new(parameters).is_ok());
    }
}
