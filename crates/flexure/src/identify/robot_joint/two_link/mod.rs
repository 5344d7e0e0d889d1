//! A two-link arm as a whole: both joints excited, the links coupled.
//!
//! The motors' equations, with the elbow's rotor carried by link 1 as in (8)-(9),
//!
//! $$ \tau_1 = J_{m1} \ddot q_{m1} + \kappa_1(d_1), \qquad \tau_2 = J_{m2} (\ddot q_{m2} + \ddot q_1) + \kappa_2(d_2), $$
//!
//! are solved together with those of the links ([`links`]). All four are linear in the two motor inertias and the three constants of the
//! links; the two stiffness and the two friction curves are free.

mod links;
mod outcome;

#[cfg(test)]
mod tests;

use super::checks;
use super::clock_offset::Clocks;
use super::clocks;
use super::column_noise::{AbscissaNoise, Noisy};
use super::equations::Column;
use super::finding::Finding;
use super::fourier::Modulation;
use super::joint_signals::{JointSignals, of_inertia};
use super::kinks::Kinks;
use super::motion::{self, Carrier, Motion, modulation_of};
use super::outcome::{Estimated, FlexibleAxis};
use super::system::{FreeCurves, System};
use crate::error::{DataError, Error, Result};
use crate::linalg::Complex;
use links::Links;

/// The log of a two-link arm with flexible joints; index 0 is the shoulder, 1 the elbow.
///
/// | field | unit | range |
/// |---|---|---|
/// | `motor`, `link` | rad, all on the links' side of the gears | finite, not constant, not wrapped; at least 200 samples |
/// | `torque` | N m on the links' side | finite, not constant, as long |
/// | `sample_time` | s | positive |
/// | `level` | of the bands | between 0 and 1 |
#[derive(Debug, Clone, Copy)]
pub struct TwoLinkLog<'a> {
    /// The motors' angles.
    pub motor: [&'a [f64]; 2],
    /// The links' angles; the second is relative to link 1.
    pub link: [&'a [f64]; 2],
    /// The motors' torques.
    pub torque: [&'a [f64]; 2],
    /// The sample time, s.
    pub sample_time: f64,
    /// The level of the bands.
    pub level: f64,
}

/// A two-link arm: `M(q) q'' + S qm'' + C(q, q') q' + f(q') = kappa(d)`, `S^T q'' + Jm qm'' + kappa(d) = tau`.
///
/// A motion determines the three constants of [`LinkDynamics`](crate::manipulator::LinkDynamics);
/// masses, lengths and centres of mass cannot be determined separately.
#[derive(Debug, Clone)]
pub struct TwoLinkArm {
    /// `m1 lc1^2 + m2 (l1^2 + lc2^2) + I1 + I2`, from the fit with the free curves.
    pub shoulder: Estimated,
    /// `m2 lc2^2 + I2`.
    pub elbow: Estimated,
    /// `m2 l1 lc2`.
    pub coupling: Estimated,
    /// Shoulder, elbow and coupling from the fit with the forms that an arm can have.
    pub model: [Estimated; 3],
    /// The motors' inertias from the fit with these forms.
    pub model_motors: [Estimated; 2],
    /// The joints. Their link inertia is the diagonal of M with the arm stretched, `q2 = 0`; the forms of friction are fitted while the
    /// other joint's friction is a free curve.
    pub joints: [FlexibleAxis; 2],
}

/// The unknown factors in the equations of an arm.
mod factor {
    /// The inertias of the two motors.
    pub const MOTORS: [usize; 2] = [0, 1];
    /// The constants of the links.
    pub const SHOULDER: usize = 2;
    pub const ELBOW: usize = 3;
    pub const COUPLING: usize = 4;
    /// The first constant of the links.
    pub const LINKS: usize = SHOULDER;
    /// All of them.
    pub const COUNT: usize = 5;
}

/// The blocks of equations of an arm.
mod block {
    pub const MOTORS: [usize; 2] = [0, 1];
    pub const LINKS: [usize; 2] = [2, 3];
    pub const COUNT: usize = 4;
}

/// The curves of an arm.
mod curve {
    pub const STIFFNESS: [usize; 2] = [0, 1];
    pub const FRICTION: [usize; 2] = [2, 3];
}

/// The transformed log of an arm.
struct ArmSignals<'a> {
    modulation: &'a Modulation,
    motions: &'a [Motion<'a>; 2],
    clocks: [Clocks; 2],
    joints: [JointSignals<'a>; 2],
    links: Links,
    /// The links' angles, on the motors' clocks.
    q: [Vec<f64>; 2],
}

impl TwoLinkLog<'_> {
    fn check(&self) -> Result<()> {
        let [motor, link, torque] = [self.motor, self.link, self.torque];
        let angles = [
            ("motor 1", motor[0]),
            ("link 1", link[0]),
            ("motor 2", motor[1]),
            ("link 2", link[1]),
        ];
        let torques = [("torque 1", torque[0]), ("torque 2", torque[1])];
        checks::log(link[0].len(), &angles, &torques, self.sample_time, self.level)
    }

    /// Identifies the arm.
    ///
    /// # Errors
    /// As [`super::RigidJoint::identify`], and [`Error::Data`]: `RigidJointInArm` if a joint shows no deflection.
    pub fn identify(&self) -> Result<TwoLinkArm> {
        self.check()?;
        let motion = |i: usize| Motion::new(self.motor[i], self.link[i], self.torque[i], self.sample_time);
        let [first, mut second] = [0, 1].map(motion);
        second.carrier = Some(Carrier {
            angle: self.link[0],
            noise: first.link_noise,
        });
        let motions = [first, second];
        motion::resolved(&motions, self.sample_time)?;
        let modulation = modulation_of(&motions, self.sample_time)?;
        for (joint, motion) in motions.iter().enumerate() {
            let findings = motion.no_flexibility(&modulation).unwrap_or_default();
            for finding in findings {
                if let Finding::NoFlexibility { deflection, noise, .. } = finding {
                    return Err(Error::Data(DataError::RigidJointInArm {
                        joint: joint + 1,
                        deflection,
                        noise,
                    }));
                }
            }
        }
        let signals = ArmSignals::new(&motions, &modulation);
        let arm = signals.and_then(|signals| signals.outcome(self.level));
        Ok(arm.ok_or(DataError::TooLittleMotion {
            what: "inertias, stiffness and friction of the arm",
        })?)
    }
}

impl<'a> ArmSignals<'a> {
    fn new(motions: &'a [Motion<'a>; 2], modulation: &'a Modulation) -> Option<Self> {
        let clocks = [
            clocks::of_motor(&motions[0], modulation)?,
            clocks::of_motor(&motions[1], modulation)?,
        ];
        let q = [0, 1].map(|i| clocks[i].link(&motions[i]));
        let joints = [0, 1].map(|i| {
            JointSignals::new(
                &motions[i],
                modulation,
                clocks[i].torque(modulation, &motions[i]),
                &q[i],
                &Kinks::default(),
            )
        });
        let links = Links::new(
            modulation,
            [&q[0], &q[1]],
            [&joints[0].v, &joints[1].v],
            motions[1].motor,
            [motions[0].link_noise, motions[1].link_noise, motions[1].motor_noise],
        );
        Some(ArmSignals {
            modulation,
            motions,
            clocks,
            joints,
            links,
            q,
        })
    }

    /// The columns of the factors in the equations of motor 1 and 2, link 1 and 2, these as `0 = kappa - ...`.
    fn factors(&self) -> Vec<Column> {
        let rotor = |i: usize| self.joints[i].motor.clone();
        let motors = [
            vec![rotor(0), None, None, None],
            vec![None, rotor(1), Some(self.links.rotor.clone()), None],
        ];
        let constants = self
            .links
            .constants
            .iter()
            .map(|column| [None, None].into_iter().chain(column.iter().cloned()).collect());
        motors.into_iter().chain(constants).collect()
    }

    /// The noise of the factors' columns.
    fn noisy(&self) -> Vec<Noisy<'_>> {
        let motors = (0..2).map(|i| Noisy::square(factor::MOTORS[i], block::MOTORS[i], &self.joints[i].encoder[0]));
        let links = self
            .links
            .noisy(factor::LINKS, block::LINKS[0], Some(factor::MOTORS[1]));
        motors.chain(links).collect()
    }

    /// The noise of a joint's deflection in the equations of its motor and its link.
    fn deflection_noise(&self, joint: usize) -> Vec<AbscissaNoise<'_>> {
        let signals = &self.joints[joint];
        let (on_motor, on_link) = (block::MOTORS[joint], block::LINKS[joint]);
        let [motor, link] = signals.variances;
        let rotor = signals.shared_noise(factor::MOTORS[joint], on_motor, -motor);
        let carried = signals.shared_noise(factor::LINKS + joint, on_link, -link);
        // The equation of link 1 has the acceleration of link 1 twice; the equation of link 2 has that of link 2 with the elbow's constant
        // alone.
        let coupled = (joint == 0).then(|| {
            let covariance = -2.0 * self.links.cosine[0] * link;
            signals.shared_noise(factor::COUPLING, on_link, covariance)
        });
        signals.deflection_noise(&[on_motor, on_link], [rotor, carried].into_iter().chain(coupled))
    }

    /// All equations.
    fn system(&self) -> System<'_> {
        let signs = |entries: &[(usize, f64)]| {
            let mut signs = vec![0.0; block::COUNT];
            entries.iter().for_each(|&(block, sign)| signs[block] = sign);
            signs
        };
        let stiffness = (0..2).map(|i| {
            let signs = signs(&[(block::MOTORS[i], 1.0), (block::LINKS[i], 1.0)]);
            self.joints[i].stiffness(signs, self.deflection_noise(i), factor::COUNT)
        });
        let friction = (0..2).map(|i| self.joints[i].friction(signs(&[(block::LINKS[i], -1.0)]), factor::COUNT));
        let zero = vec![Complex::new(0.0, 0.0); self.modulation.len()];
        let torque = |i: usize| self.joints[i].torque.clone();
        System {
            modulation: self.modulation,
            factors: self.factors(),
            right: vec![torque(0), torque(1), zero.clone(), zero],
            noisy: self.noisy(),
            given: Vec::new(),
            encoder_noise: Box::new(|x| {
                let motor = |i: usize| of_inertia(&self.joints[i].encoder[0], x[factor::MOTORS[i]]);
                let [first, second] = self.links.known(&x[factor::LINKS..], x[factor::MOTORS[1]]);
                vec![motor(0), motor(1), first, second]
            }),
            curves: stiffness.chain(friction).collect(),
        }
    }

    /// The free curves, and the noise of all equations.
    fn free(&self, system: &System) -> Option<FreeCurves> {
        let (first, second) = (self.joints[0].motor_start()?, self.joints[1].motor_start()?);
        let band = self.motions.iter().map(|m| m.link_noise.band).fold(0.0, f64::max);
        let links = self
            .links
            .system(&self.joints, [&first.kappa, &second.kappa], second.inertia);
        let friction = links::start(&links, band)?;
        let splines = [first.splines, second.splines].into_iter().chain(friction.splines);
        let noise = [first.noise, second.noise].into_iter().chain(friction.noise);
        system.refined(splines.collect(), noise.collect())
    }
}
