//! From the solution of an arm's equations to the result.

use super::super::flexible_outcome::AxisParts;
use super::super::free_outcome::FreeOutcome;
use super::super::joint_forms::JointPlace;
use super::super::normal::Part;
use super::super::outcome::{FlexibleAxis, JointModel};
use super::{ArmSignals, TwoLinkArm, curve, factor};

/// The torques for the inertias at every sample, for each joint.
struct InertialTorques {
    /// The torques of the motors' inertias.
    rotors: [Vec<f64>; 2],
    /// The elastic torques on the links.
    links: [Vec<f64>; 2],
}

impl ArmSignals<'_> {
    /// The result; `None` if the equations do not determine it.
    pub fn outcome(&self, level: f64) -> Option<TwoLinkArm> {
        let system = self.system();
        let free = self.free(&system)?;
        let outcome = FreeOutcome::new(&system, &free, level)?;
        let places = [0, 1].map(|joint| JointPlace {
            stiffness: curve::STIFFNESS[joint],
            friction: curve::FRICTION[joint],
            motor_friction: None,
            motor: Some(factor::MOTORS[joint]),
            link: None,
        });
        let forms = outcome.forms_of(&places);
        let model = outcome.model(&places, &forms)?;
        let models = <[JointModel; 2]>::try_from(model.joints).ok()?;
        let InertialTorques { rotors, links } = self.inertial_torques(&outcome.solved.factors());
        let part = |unknown, factor| Part { unknown, factor };
        let (shoulder, twice_coupling) = (part(factor::SHOULDER, 1.0), part(factor::COUPLING, 2.0));
        let link_inertias = [outcome.sum(&[shoulder, twice_coupling]), outcome.factor(factor::ELBOW)];
        let parts = places
            .into_iter()
            .zip(forms)
            .zip(models)
            .zip(rotors.into_iter().zip(links));
        let joints = parts
            .enumerate()
            .map(|(joint, (((place, forms), model), (rotor_torque, link_torque)))| {
                let signals = &self.joints[joint];
                let carried = outcome.factor(factor::LINKS + joint).value;
                let parts = AxisParts {
                    motion: &self.motions[joint],
                    joint: signals,
                    clocks: &self.clocks[joint],
                    explained: None,
                    place,
                    motor_inertia: signals.motor_inertia_of(outcome.factor(factor::MOTORS[joint]), carried),
                    link_inertia: link_inertias[joint],
                    forms,
                    model,
                    rotor_torque,
                    link_torque,
                };
                Some(parts.axis(&outcome)?.distrusted())
            });
        let joints: Vec<FlexibleAxis> = joints.collect::<Option<_>>()?;
        let beside_forms = |i: usize| model.factors[i];
        Some(TwoLinkArm {
            shoulder: outcome.factor(factor::SHOULDER),
            elbow: outcome.factor(factor::ELBOW),
            coupling: outcome.factor(factor::COUPLING),
            model: [factor::SHOULDER, factor::ELBOW, factor::COUPLING].map(beside_forms),
            model_motors: factor::MOTORS.map(beside_forms),
            joints: joints.try_into().ok()?,
        })
    }

    /// The torques of the equations of motion with these factors.
    fn inertial_torques(&self, factors: &[f64]) -> InertialTorques {
        let accelerations = [0, 1].map(|i| self.motions[i].accelerations(&self.q[i]));
        let [[motor_a, first], [motor_b, second]] = &accelerations;
        let [motor_1, motor_2] = factor::MOTORS.map(|i| factors[i]);
        let [shoulder, elbow, coupling] = [factor::SHOULDER, factor::ELBOW, factor::COUPLING].map(|i| factors[i]);
        let along = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..first.len()).map(f).collect() };
        let (cos, sin) = (along(&|i| self.q[1][i].cos()), along(&|i| self.q[1][i].sin()));
        let (v, w) = (&self.joints[0].v, &self.joints[1].v);
        InertialTorques {
            rotors: [
                along(&|i| motor_1 * motor_a[i]),
                along(&|i| motor_2 * (motor_b[i] + first[i])),
            ],
            links: [
                along(&|i| {
                    let swing = cos[i] * (2.0 * first[i] + second[i]) - sin[i] * w[i] * (2.0 * v[i] + w[i]);
                    shoulder * first[i] + elbow * second[i] + coupling * swing + motor_2 * motor_b[i]
                }),
                along(&|i| elbow * (first[i] + second[i]) + coupling * (cos[i] * first[i] + sin[i] * v[i] * v[i])),
            ],
        }
    }
}
