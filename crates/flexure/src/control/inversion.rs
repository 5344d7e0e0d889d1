//! The motor torque for a given motion: the inverse dynamics of the arm with flexible joints.
//!
//! The link angles q determine everything else, from the elbow to the shoulder because rotor 2 rides on link 1:
//!
//! $$ \kappa_2(d_2) = (M q'' + C q' + f(q'))_2, \qquad \kappa_1(d_1) = (M q'' + C q' + f(q'))_1 + S_{12} q_{m2}'', \qquad
//!    q_m = q + d, \qquad \tau = S^T q'' + J_m q_m'' + \kappa(d) + f_m(q_m') $$
//!
//! Without coupling the torque needs the fourth derivative of q (Spong 1987, Modeling and control of elastic joint robots, ASME J.
//! Dyn. Sys. 109); with it, the shoulder's torque needs the sixth (De Luca & Lucibello 1998, A general algorithm for dynamic
//! feedback linearization of robots with elastic joints, IEEE ICRA). Damping parallel to the spring is left out: deflections would then be
//! the solution of a differential equation.
//!
//! When friction reverses, motor 2 jumps within hundredths of a second. Through the coupling, the shoulder's torque depends on the fourth
//! derivative of this: hundreds of N m for milliseconds, which no sampled loop can deliver. Only for this effect, friction is assumed to
//! reverse within `SLOWEST_REVERSAL`.

use super::jet::{Jet, deflection, friction};
use crate::manipulator::{Arm, Friction, JointKind, State};

/// The time in s in which friction reverses, for its effect on the shoulder through the coupling. Measured on the square of 12.6 m at 100
/// Hz: the shortest of 0.02, 0.04, 0.08, 0.15 and 0.3 s whose torque stays below twice that without friction (18 N m; 0.02 s: 249 N m).
const SLOWEST_REVERSAL: f64 = 0.04;

/// A motion with the torque that makes it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InverseMotion {
    /// Link angles.
    pub q: [Jet; 2],
    /// Motor angles; those of the links if the joints are rigid.
    pub qm: [Jet; 2],
    /// The motors' torque, N m.
    pub torque: [f64; 2],
}

impl InverseMotion {
    /// The state of the arm in this motion.
    pub fn state(&self) -> State {
        let of = |angles: &[Jet; 2], order| [angles[0].derivative(order), angles[1].derivative(order)];
        State {
            q: of(&self.q, 0),
            qm: of(&self.qm, 0),
            dq: of(&self.q, 1),
            dqm: of(&self.qm, 1),
        }
    }
}

/// The torques that the links need from their joints, `M q'' + C q' + f(q')`, N m.
pub fn link_torque(arm: &Arm, q: &[Jet; 2]) -> [Jet; 2] {
    let inertial = inertial_torque(arm, q);
    let joint_friction = arm.friction();
    [0, 1].map(|i| inertial[i] + friction(&joint_friction[i], q[i].rate()))
}

/// Friction that reverses no faster than `SLOWEST_REVERSAL` in this motion.
fn slowed(law: &Friction, q: Jet) -> Friction {
    let steepest = 1.0 / (SLOWEST_REVERSAL * q.derivative(2).abs());
    let [g1, g2, g3, g4, g5, g6] = law.0;
    Friction([g1, g2.min(steepest), g3.min(steepest), g4, g5.min(steepest), g6])
}

/// `M q'' + C q'`, N m.
fn inertial_torque(arm: &Arm, q: &[Jet; 2]) -> [Jet; 2] {
    let links = arm.link_dynamics();
    let [sin, cos] = q[1].sin_cos();
    let swing = cos * links.coupling;
    let m11 = swing * 2.0 + Jet::constant(links.shoulder);
    let m12 = swing + Jet::constant(links.elbow);
    let [v, a] = [q.map(|q| q.rate()), q.map(|q| q.acceleration())];
    let h = sin * links.coupling;
    [
        m11 * a[0] + m12 * a[1] - h * (v[0] * 2.0 + v[1]) * v[1],
        m12 * a[0] + a[1] * links.elbow + h * v[0] * v[0],
    ]
}

/// The motion of the arm whose links move in this way; `None` if a spring has no inverse.
///
/// ```
/// use flexure::control::{Jet, inverse_motion};
/// use flexure::manipulator::{Arm, JointKind, space_arm};
///
/// let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
/// let rest = inverse_motion(&arm, [Jet::constant(0.3), Jet::constant(1.0)]).unwrap();
/// assert_eq!(rest.torque, [0.0, 0.0]);
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn inverse_motion(arm: &Arm, q: [Jet; 2]) -> Option<InverseMotion> {
    let [shoulder, elbow] = link_torque(arm, &q);
    let rotor = arm.parameters().joints.map(|j| j.motor_inertia);
    let rigid = arm.model() == JointKind::Rigid;
    let coupling = if arm.parameters().parts.coupling { rotor[1] } else { 0.0 };
    let mut qm = q;
    if rigid {
        let geared = arm.parameters().parts.rotors;
        let [j1, j2] = if geared { rotor } else { [0.0; 2] };
        let s = if geared { coupling } else { 0.0 };
        let a = q.map(|q| q.acceleration());
        let motor_friction = arm.motor_friction();
        let torque = [
            shoulder + a[0] * j1 + a[1] * s + friction(&motor_friction[0], q[0].rate()),
            elbow + a[1] * j2 + a[0] * s + friction(&motor_friction[1], q[1].rate()),
        ];
        return Some(InverseMotion {
            q,
            qm,
            torque: torque.map(|t| t.value()),
        });
    }
    let [first, second] = arm.stiffness();
    qm[1] = q[1] + deflection(&second, elbow)?;
    let mut carried = shoulder;
    if coupling != 0.0 {
        let joint_friction = friction(&slowed(&arm.friction()[1], q[1]), q[1].rate());
        let slow = q[1] + deflection(&second, inertial_torque(arm, &q)[1] + joint_friction)?;
        carried = carried + slow.acceleration() * coupling;
    }
    qm[0] = q[0] + deflection(&first, carried)?;
    let motor_friction = arm.motor_friction();
    let motor =
        |i: usize, load: Jet| qm[i].acceleration() * rotor[i] + load + friction(&motor_friction[i], qm[i].rate());
    let torque = [motor(0, carried), motor(1, elbow + q[0].acceleration() * coupling)];
    Some(InverseMotion {
        q,
        qm,
        torque: torque.map(|t| t.value()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::space_arm;

    /// In the state of the motion and under its torque, the equations of motion give its accelerations.
    #[test]
    fn the_torque_makes_the_motion() {
        for (model, geared) in [
            (JointKind::Nonlinear, false),
            (JointKind::Linear, false),
            (JointKind::Rigid, false),
            (JointKind::Rigid, true),
        ] {
            let mut parameters = space_arm(model);
            parameters.parts.rotors = geared;
            parameters.parts.coupling |= geared;
            // Friction that reverses slowly enough to be inverted exactly.
            for joint in &mut parameters.joints {
                joint.friction = Some(Friction([0.5, 8.0, 4.0, 2.0, 9.0, 0.5]));
                joint.motor_friction = joint.friction;
            }
            let arm = Arm::new(parameters).unwrap();
            for k in 0..40 {
                let t = 0.1 * k as f64;
                let wave = |size: f64, w: f64| {
                    let phase = w * t;
                    let derivatives: [f64; 7] = std::array::from_fn(|i| {
                        size * w.powi(i as i32) * (phase + 0.5 * i as f64 * std::f64::consts::PI).sin()
                    });
                    Jet::of_derivatives(&derivatives)
                };
                let motion = inverse_motion(&arm, [wave(0.8, 1.1), wave(1.4, 0.7)]).unwrap();
                let rate = arm.derivative(&motion.state().to_array(), motion.torque);
                let expected = [
                    motion.q[0].derivative(2),
                    motion.q[1].derivative(2),
                    motion.qm[0].derivative(2),
                    motion.qm[1].derivative(2),
                ];
                for (got, expected) in rate[4..].iter().zip(expected) {
                    assert!(
                        (got - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                        "{model:?} {t}: {got} {expected}"
                    );
                }
            }
        }
    }
}
