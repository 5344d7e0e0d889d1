//! A flexible joint: motor and link inertia, stiffness and friction from both angles and the torque.
//!
//! $$ \tau = J_m \ddot q_m + \kappa(d), \qquad L = \kappa(d) - M \ddot q - f(\dot q), \qquad \kappa(d) = k(d)\, d. $$
//!
//! L is a known load on the link, zero if nothing else acts.
//!
//! The motor's equation alone determines kappa; the sum of both equations determines M and f. Both together, each line with the weight of
//! its noise, determine all of them best: the second equation has no torque, and so no torque noise.

use super::chain_load::JointLoad;
use super::checks;
use super::effects::radii;
use super::explanations::{Explained, explained};
use super::finding::Finding;
use super::flexible_outcome::AxisParts;
use super::fourier::Modulation;
use super::free_outcome::FreeOutcome;
use super::joint_forms::JointPlace;
use super::joint_signals::JointSignals;
use super::limits::{DISAGREE, STOP_RADII_OF_ANGLE};
use super::motion::{self, Motion, modulation_of};
use super::outcome::{
    ChainFit, Effect, Estimated, FlexibleAxis, IdentifiedCurve, IdentifiedJoint, JointModel, StiffJoint,
};
use super::rigid::RigidJoint;
use super::smooth::Reflected;
use super::stretches::{FormedJoint, Logged};
use crate::error::{DataError, Error, Result};

/// The log of a flexible joint, and known values.
///
/// | field | unit | range |
/// |---|---|---|
/// | `motor`, `link` | rad, both on the link's side of the gear | finite, not constant, not wrapped; at least 200 samples |
/// | `torque` | N m on the link's side | finite, not constant, as long |
/// | `sample_time` | s | positive |
/// | `motor_inertia` | kg m^2 on the link's side, if known | positive |
/// | `load` | of the other joints of a chain; `None` for a joint alone | as long |
/// | `level` | of the bands | between 0 and 1 |
#[derive(Debug, Clone, Copy)]
pub struct FlexibleJoint<'a> {
    /// The motor's angle.
    pub motor: &'a [f64],
    /// The link's angle.
    pub link: &'a [f64],
    /// The motor's torque.
    pub torque: &'a [f64],
    /// The sample time, s.
    pub sample_time: f64,
    /// The motor's inertia, if it is known.
    pub motor_inertia: Option<f64>,
    /// What gravity and the other joints of a chain add to the torque on the link.
    pub load: Option<&'a JointLoad>,
    /// The level of the bands.
    pub level: f64,
}

/// A joint by its equations of motion.
struct ByEquations {
    axis: FlexibleAxis,
    /// The motor's inertia by the simulated motion, if that was not known.
    simulated: Option<Estimated>,
    /// Whether there is friction with memory, by the simulated motion too.
    presliding: bool,
}

impl FlexibleJoint<'_> {
    fn check(&self) -> Result<()> {
        let angles = [("motor", self.motor), ("link", self.link)];
        let torque = [("torque", self.torque)];
        checks::log(self.link.len(), &angles, &torque, self.sample_time, self.level)?;
        checks::load(self.load, self.link.len())?;
        match self.motor_inertia {
            Some(value) if !(value > 0.0 && value.is_finite()) => {
                let requirement = "positive and finite, in kg m^2";
                Err(Error::parameter("the motor's inertia", value, requirement))
            }
            _ => Ok(()),
        }
    }

    /// Identifies the joint; as a rigid one, if its motor and link do not move relative to each other.
    ///
    /// # Errors
    /// As [`RigidJoint::identify`].
    pub fn identify(&self) -> Result<IdentifiedJoint> {
        self.check()?;
        let known = |value| Estimated {
            value,
            standard_error: 0.0,
        };
        let motion = Motion {
            motor_inertia: self.motor_inertia.map(known),
            load: self.load,
            ..Motion::new(self.motor, self.link, self.torque, self.sample_time)
        };
        let motions = [motion];
        let modulation = modulation_of(&motions, self.sample_time)?;
        let resolved = motion::resolved(&motions, self.sample_time);
        let [motion] = motions;
        let stiff = motion.stiff(&modulation);
        if let Some(findings) = motion.no_flexibility(&modulation) {
            return self.rigid(None, findings);
        }
        match (resolved, &stiff) {
            (Err(_), Some(_)) => return self.rigid(stiff, Vec::new()),
            (resolved, _) => resolved?,
        }
        match self.axis(motion, &modulation) {
            Some(axis) if stiff.is_none() || axis.separates_inertias() => {
                Ok(IdentifiedJoint::Flexible(Box::new(axis.distrusted())))
            }
            _ if stiff.is_some() => self.rigid(stiff, Vec::new()),
            _ => {
                let what = "inertias, stiffness and friction of the joint";
                Err(DataError::TooLittleMotion { what }.into())
            }
        }
    }

    /// The joint by its equations of motion. If its simulated motion determines the motor's inertia better than these, or disagrees with them, the
    /// equations are solved again with that inertia: it decides how the torque divides between motor and spring.
    fn axis(&self, mut motion: Motion, modulation: &Modulation) -> Option<FlexibleAxis> {
        let mut possible = Effect::ALL.to_vec();
        let mut found = self.by_equations(&motion, modulation, &possible)?;
        if !found.presliding {
            // The equations may show friction with memory that the simulated motion does not. It is then no explanation.
            possible.retain(|effect| *effect != Effect::Presliding);
            if found.axis.has_presliding() {
                found = self.by_equations(&motion, modulation, &possible)?;
            }
        }
        let ByEquations { axis, simulated, .. } = found;
        let Some(simulated) = simulated else {
            return Some(axis);
        };
        let equations = axis.motor_inertia;
        let error = equations.standard_error.hypot(simulated.standard_error);
        let is_surer = simulated.standard_error < equations.standard_error;
        if !is_surer && (simulated.value - equations.value).abs() < DISAGREE * error {
            return Some(axis);
        }
        motion.motor_inertia = Some(simulated);
        match self.by_equations(&motion, modulation, &possible) {
            Some(again) if again.axis.separates_inertias() => Some(FlexibleAxis {
                by_equations: Some(equations),
                ..again.axis
            }),
            _ => Some(axis),
        }
    }

    /// The joint by its equations of motion with some of these effects.
    fn by_equations(&self, motion: &Motion, modulation: &Modulation, possible: &[Effect]) -> Option<ByEquations> {
        let explained = explained(motion, modulation, possible)?;
        let clocks = &explained.clocks;
        let link = clocks.link(motion);
        let torque = clocks.torque(modulation, motion);
        let joint = JointSignals::new(motion, modulation, torque, &link, &explained.kinks);
        let joint = joint.with(motion, &link, &explained.effects, Some(&explained.stiffness));
        let axis = self.outcome(motion, &joint, &explained, &link)?;
        let log = Logged {
            motor: motion.motor,
            link: &link,
            velocities: [&joint.v_motor, &joint.v],
            torque: &clocks.held_torque(motion),
            load: motion::between(motion.load, motion.link.len()),
            step: motion.step,
        };
        let unknown = motion.motor_inertia.is_none();
        let presliding = axis.has_presliding() && {
            let distances = radii(&link, &STOP_RADII_OF_ANGLE, motion.link_noise.sd);
            let mut forms = axis.link.friction.by_bic().into_iter();
            let dry = forms.find(|form| form.curve.dry_and_other(0.0)[0] > 0.0);
            let joint = axis.formed().zip(dry).map(|(joint, dry)| FormedJoint {
                friction: dry.curve.clone(),
                ..joint
            });
            joint.is_some_and(|joint| joint.presliding(&log, distances))
        };
        let remembers = axis.effects.contains(&Effect::HystereticSpring);
        let formed = axis.formed().filter(|_| unknown && !remembers);
        let simulated = formed.and_then(|joint| joint.simulated_inertia(&log));
        Some(ByEquations {
            axis,
            simulated,
            presliding,
        })
    }

    /// The axis of motor and link as one body: at the motor, if the joint is stiff apart from its clocks, otherwise at the link.
    fn rigid(&self, stiff: Option<StiffJoint>, mut findings: Vec<Finding>) -> Result<IdentifiedJoint> {
        // The link's angle on the motor's clock, which is also the torque's: the motor's own angle vibrates against a stiff joint.
        let offset = findings.iter().find_map(|f| match f {
            Finding::EncoderClocks { offset, .. } => Some(*offset),
            _ => None,
        });
        let link = offset.map(|offset| Reflected::new(self.link, self.sample_time).shifted(offset));
        if let Some(stiff) = stiff {
            findings = vec![Finding::StiffJoint(stiff)];
        }
        let mut axis = RigidJoint {
            position: match stiff {
                Some(_) => self.motor,
                None => link.as_deref().unwrap_or(self.link),
            },
            torque: self.torque,
            velocity: None,
            sample_time: self.sample_time,
            extras: &[],
            load: self.load,
            level: self.level,
        }
        .identify()?;
        axis.findings.splice(0..0, findings);
        axis.stiff = stiff;
        Ok(IdentifiedJoint::Rigid(Box::new(axis)))
    }

    fn outcome(
        &self,
        motion: &Motion,
        joint: &JointSignals,
        explained: &Explained,
        link: &[f64],
    ) -> Option<FlexibleAxis> {
        let system = joint.system();
        let free = joint.free(motion)?;
        let outcome = FreeOutcome::new(&system, &free, self.level)?;
        let link_factor = joint.link_factor();
        let place = JointPlace {
            stiffness: 0,
            friction: 1,
            motor_friction: joint.motor_velocity.is_some().then_some(2),
            motor: joint.motor.is_some().then_some(0),
            link: Some(link_factor),
        };
        let link_inertia = outcome.factor(link_factor);
        let motor_inertia = match motion.motor_inertia {
            Some(known) => known,
            None => joint.motor_inertia_of(outcome.factor(0), link_inertia.value),
        };
        let forms = outcome.forms_of(&[place]);
        let [model] = <[JointModel; 1]>::try_from(outcome.model(&[place], &forms)?.joints).ok()?;
        let [forms] = forms;
        let times = |acceleration: &[f64], inertia: f64| acceleration.iter().map(|a| inertia * a).collect();
        let [of_motor, of_link] = motion.accelerations(link);
        let parts = AxisParts {
            motion,
            joint,
            clocks: &explained.clocks,
            explained: Some(explained),
            place,
            rotor_torque: times(&of_motor, motor_inertia.value),
            link_torque: times(&of_link, link_inertia.value),
            motor_inertia,
            link_inertia,
            forms,
            model,
        };
        let mut axis = parts.axis(&outcome)?;
        axis.link.chain = motion.load.map(|load| {
            // The load stands on the right of the link's equation.
            let missing = system.factor_of(&free, vec![None, Some(joint.load.iter().map(|v| -v).collect())]);
            ChainFit::new(load, link_inertia, missing)
        });
        let findings = axis
            .link
            .chain
            .iter()
            .flat_map(|chain| chain.findings(link_inertia, true))
            .collect::<Vec<_>>();
        axis.link.findings.extend(findings);
        Some(axis)
    }
}

impl FlexibleAxis {
    /// Whether the equations of motion show friction with memory, which nothing else explains.
    fn has_presliding(&self) -> bool {
        let fact = |effect| self.effects.contains(effect) && !self.competing.contains(effect);
        fact(&Effect::Presliding)
    }

    /// The joint in its best forms; `None` if it cannot be simulated, as after a torque that was clipped.
    fn formed(&self) -> Option<FormedJoint> {
        let clipped = |f: &Finding| matches!(f, Finding::ClippedTorque { .. });
        if !self.separates_inertias() || self.link.findings.iter().any(clipped) {
            return None;
        }
        let curve = |curve: &IdentifiedCurve| curve.simplest().curve.clone();
        let gravity: Vec<f64> = self.link.extras.iter().map(|extra| extra.value).collect();
        Some(FormedJoint {
            inertias: [self.motor_inertia.value, self.link.inertia.value],
            damping: self.damping.map(|damping| damping.value),
            gravity: gravity.try_into().ok(),
            stiffness: curve(&self.stiffness),
            friction: curve(&self.link.friction),
            motor_friction: self.motor_friction.as_ref().map(curve),
            turns_over: None,
        })
    }
}
