//! The result of a flexible joint, from the solution of its equations.

use super::checks;
use super::clock_offset::Clocks;
use super::explanations::Explained;
use super::finding::Finding;
use super::free_outcome::{FreeOutcome, torque_band};
use super::joint_forms::{JointForms, JointPlace};
use super::joint_signals::JointSignals;
use super::motion::Motion;
use super::outcome::{Effect, Estimated, FlexibleAxis, JointModel, RigidAxis};
use super::rigid::extra_parameters;
use crate::linear::correlation::mean_square;

/// The parts of a flexible joint's result in addition to the free curves.
pub(super) struct AxisParts<'a> {
    pub motion: &'a Motion<'a>,
    pub joint: &'a JointSignals<'a>,
    pub clocks: &'a Clocks,
    /// The other effects, for a single joint.
    pub explained: Option<&'a Explained>,
    pub place: JointPlace,
    pub motor_inertia: Estimated,
    pub link_inertia: Estimated,
    pub forms: JointForms,
    pub model: JointModel,
    /// The torque for the motor's inertia at every sample.
    pub rotor_torque: Vec<f64>,
    /// The torque for the links' inertias.
    pub link_torque: Vec<f64>,
}

/// The torques of a joint at every sample, from the log and the solution of its equations.
struct Torques {
    /// Of the spring, with what acts beside it.
    elastic: Vec<f64>,
    /// What is left for each curve when all others are subtracted.
    of_stiffness: Vec<f64>,
    of_friction: Vec<f64>,
    of_motor: Vec<f64>,
    /// The motor's torque as the solution has it.
    reconstructed: Vec<f64>,
}

impl AxisParts<'_> {
    /// The result; `None` if not even the simplest forms can be fitted.
    pub fn axis(self, outcome: &FreeOutcome) -> Option<FlexibleAxis> {
        let motion = self.motion;
        let JointPlace {
            stiffness,
            friction,
            motor_friction,
            ..
        } = self.place;
        let torques = self.torques(outcome);
        let findings = self.findings(self.memories(outcome, &torques.elastic), &torques.reconstructed);
        let secant = outcome.band(stiffness);
        let at_motor = match motor_friction {
            Some(curve) => {
                let band = outcome.band(curve);
                Some(outcome.identified(curve, band, self.forms.motor_friction, torques.of_motor)?)
            }
            None => None,
        };
        let factor_of = |effect: Effect| self.joint.factors_of(Some(effect)).map(|i| outcome.factor(i));
        let of_friction = torques.of_friction;
        Some(FlexibleAxis {
            motor_inertia: self.motor_inertia,
            by_equations: None,
            stiffness: outcome.identified(
                stiffness,
                torque_band(&secant),
                self.forms.stiffness,
                torques.of_stiffness,
            )?,
            secant,
            link: RigidAxis {
                stiff: None,
                polished: None,
                chain: None,
                inertia: self.link_inertia,
                friction: outcome.identified(friction, outcome.band(friction), self.forms.friction, of_friction)?,
                extras: extra_parameters(
                    &[("gravity cos", [1, 0]), ("gravity sin", [1, 0])],
                    factor_of(Effect::Gravity),
                ),
                cut_off: Some(motion.link_noise.cut_off()),
                highest: outcome.highest(),
                sample_time: motion.step,
                reconstructed: torques.reconstructed,
                findings,
            },
            damping: factor_of(Effect::Damping).next(),
            motor_friction: at_motor,
            effects: self.explained.map_or_else(Vec::new, |e| e.effects.clone()),
            competing: self.explained.map_or_else(Vec::new, |e| e.competing.clone()),
            model: self.model,
            clock_offset: Estimated {
                value: self.clocks.link_offset.value,
                standard_error: self.clocks.link_offset.standard_error,
            },
        })
    }

    /// The torque of two effects at every sample.
    fn torque_of(&self, outcome: &FreeOutcome, effects: [Effect; 2]) -> Vec<f64> {
        let n = outcome.values[self.place.stiffness].len();
        self.joint.torque_of(&outcome.solved.factors(), effects, n)
    }

    fn torques(&self, outcome: &FreeOutcome) -> Torques {
        let kappa = &outcome.values[self.place.stiffness];
        let beside_spring = self.torque_of(outcome, [Effect::Damping, Effect::HystereticSpring]);
        let on_link = self.torque_of(outcome, [Effect::Gravity, Effect::Presliding]);
        let sum = |parts: &[(&[f64], f64)]| -> Vec<f64> {
            let at = |i: usize| parts.iter().map(|(torque, sign)| sign * torque[i]).sum();
            (0..kappa.len()).map(at).collect()
        };
        let none = vec![0.0; kappa.len()];
        let load = self.motion.load.map_or(&none, |load| &load.torque);
        let at_motor = self.place.motor_friction.map_or(&none, |curve| &outcome.values[curve]);
        let (torque, rotor) = (self.motion.torque, &self.rotor_torque);
        let elastic = sum(&[(kappa, 1.0), (&beside_spring, 1.0)]);
        Torques {
            of_stiffness: sum(&[(torque, 1.0), (rotor, -1.0), (at_motor, -1.0), (&beside_spring, -1.0)]),
            of_friction: sum(&[
                (&elastic, 1.0),
                (&self.link_torque, -1.0),
                (&on_link, -1.0),
                (load, -1.0),
            ]),
            of_motor: sum(&[(torque, 1.0), (rotor, -1.0), (&elastic, -1.0)]),
            reconstructed: sum(&[(&elastic, 1.0), (rotor, 1.0), (at_motor, 1.0)]),
            elastic,
        }
    }

    /// The effects with a memory, and the size of each one's torque as a share of the spring's.
    fn memories(&self, outcome: &FreeOutcome, elastic: &[f64]) -> Vec<(Effect, f64)> {
        let memories = [Effect::HystereticSpring, Effect::Presliding].into_iter();
        let acting = memories.filter(|effect| self.explained.is_some_and(|e| e.effects.contains(effect)));
        let share = |effect| {
            let missed = self.torque_of(outcome, [effect; 2]);
            (effect, mean_square(&missed).sqrt() / mean_square(elastic).sqrt())
        };
        acting.map(share).collect()
    }

    /// The findings about the log; `needed` is the torque that the motion needs.
    fn findings(&self, memories: Vec<(Effect, f64)>, needed: &[f64]) -> Vec<Finding> {
        let motion = self.motion;
        let competing = self.explained.map_or(&[][..], |explained| &explained.competing);
        let mut findings = Vec::new();
        let ratio = checks::different_angles(motion.motor, motion.link);
        findings.extend(ratio.map(|ratio| Finding::DifferentAngles { ratio }));
        let clipped = checks::clipped(motion.torque);
        findings.extend(clipped.filter(|clipped| !checks::is_limit(clipped, motion.torque, needed)));
        findings.extend(checks::motion(&self.joint.v, motion.velocity_resolution()));
        let unresolved = [motion.motor_noise, motion.link_noise]
            .into_iter()
            .find(|noise| noise.unresolved);
        findings.extend(unresolved.map(|noise| Finding::SampledTooSlowly {
            step: motion.step,
            band: noise.band,
        }));
        findings.extend(self.clocks.findings().filter(|finding| {
            let skewed = matches!(finding, Finding::EncoderClocks { .. });
            !(skewed && competing.contains(&Effect::EncoderSkew))
        }));
        if !competing.is_empty() {
            findings.push(Finding::Competing {
                effects: competing.to_vec(),
            });
        }
        findings.extend(
            memories
                .into_iter()
                .filter(|(effect, _)| !competing.contains(effect))
                .map(|(effect, share)| Finding::Memory { effect, share }),
        );
        findings.extend(checks::many_turns(&[motion.motor, motion.link]));
        findings
    }
}
