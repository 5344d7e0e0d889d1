//! The load of a joint in a chain of links: what gravity and the other joints add to its equation of motion.
//!
//! Row i of the equations of a chain, $M(q)\,\ddot q + h(q, \dot q)$, is divided into the inertia of joint i alone, at its mean over the log, and
//! the rest:
//!
//! $$ \tau_i = (I_i + \bar M_{ii})\,\ddot q_i + f_i(\dot q_i) + L_i(t), \qquad
//!    L_i = \textstyle\sum_j M_{ij}\,\ddot q_j + h_i - \bar M_{ii}\,\ddot q_i. $$
//!
//! $L_i$ is known from the chain's inertias and the logged motion of all its joints. The drive's inertia $I_i$ and the friction $f_i$ are not in
//! the chain; they are identified as those of a single joint are. The mean inertia stays in the equation, where its column is corrected for the
//! encoder's noise. The load is computed from the smoothed motion, and has only the noise of that.

use super::checks;
use super::finding::Finding;
use super::limits::{CHAIN_ERRORS, LINKS_OFF, LOAD_OFF};
use super::outcome::{ChainFit, Estimated};
use super::rates::Rates;
use super::smooth::Reflected;
use crate::error::{ArmError, Error, Result};
use crate::manipulator::chain::{Base, Chain};

impl ChainFit {
    /// For the inertia that was found, and the part of the load that is missing in the equations.
    pub(super) fn new(load: &JointLoad, inertia: Estimated, missing: Option<Estimated>) -> Self {
        ChainFit {
            links: load.inertia,
            beside_links: Estimated {
                value: inertia.value - load.inertia,
                ..inertia
            },
            factor: missing.map(|missing| Estimated {
                value: 1.0 + missing.value,
                ..missing
            }),
        }
    }

    /// What contradicts the chain, for the inertia that was found. The drive's inertia is not in that of a flexible joint's link.
    pub(super) fn findings(&self, found: Estimated, flexible: bool) -> impl Iterator<Item = Finding> {
        let clearly = |difference: Estimated, share: f64| {
            difference.value.abs() > (CHAIN_ERRORS * difference.standard_error).max(share)
        };
        let off = |factor: &Estimated| {
            let difference = Estimated {
                value: factor.value - 1.0,
                ..*factor
            };
            clearly(difference, LOAD_OFF)
        };
        let other = clearly(self.beside_links, LINKS_OFF * self.links) && (flexible || self.beside_links.value < 0.0);
        let links = self.links;
        let factor = self.factor.filter(off).map(|factor| Finding::LoadFactor { factor });
        factor
            .into_iter()
            .chain(other.then_some(Finding::OtherLinks { found, links }))
    }
}

/// The load of one joint of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct JointLoad {
    /// The torque on the joint beside its mean inertia and its friction, N m (N), at every sample.
    pub torque: Vec<f64>,
    /// The mean inertia of the links about the joint, over the log, kg m^2 (kg).
    pub inertia: f64,
}

impl JointLoad {
    /// The loads of all joints of a chain on a base that does not move, in its order. `positions` are those of all joints, rad (m), one value
    /// a sample.
    ///
    /// # Errors
    /// [`Error::Data`] for positions that cannot be used, or are not those of all joints; [`Error::Parameter`] for a sample time that is not
    /// positive; [`Error::Arm`] for a base that floats.
    ///
    /// ```
    /// use flexure::identify::robot_joint::JointLoad;
    /// use flexure::manipulator::chain::{Chain, ChainPreset};
    ///
    /// let chain = Chain::new(&ChainPreset::SixJointArm.parameters())?;
    /// let swing = |joint: usize| -> Vec<f64> { (0..400).map(|i| 0.2 * (0.02 * (joint + 1) as f64 * i as f64).sin()).collect() };
    /// let motion: Vec<Vec<f64>> = (0..6).map(swing).collect();
    /// let positions: Vec<&[f64]> = motion.iter().map(Vec::as_slice).collect();
    /// let loads = JointLoad::of_chain(&chain, &positions, 0.01)?;
    /// // The shoulder carries the arm; the last joint turns about an axis through its centre of mass.
    /// assert!(loads[1].torque[200].abs() > 10.0 && loads[5].torque[200].abs() < 0.1);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn of_chain(chain: &Chain, positions: &[&[f64]], sample_time: f64) -> Result<Vec<JointLoad>> {
        if chain.base() == Base::Free {
            return Err(Error::Arm(ArmError::Unsuited {
                part: "a floating base".to_owned(),
                why: "the log of its joints does not have the base's motion; give a chain on a fixed base",
            }));
        }
        let joints = chain.joints();
        if positions.len() != joints.len() {
            return Err(Error::length(
                "the positions of the joints",
                positions.len(),
                joints.len(),
            ));
        }
        let samples = positions.first().map_or(0, |q| q.len());
        for (name, q) in joints.iter().zip(positions) {
            checks::position_in_chain(name, q, samples, sample_time)?;
        }
        let motions: Vec<SmoothMotion> = positions.iter().map(|q| SmoothMotion::new(q, sample_time)).collect();
        let n = joints.len();
        let mut data = chain.data();
        let (mut state, mut tau, mut matrix) = (
            [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            vec![0.0; n],
            vec![0.0; n * n],
        );
        let mut torques = vec![Vec::with_capacity(samples); n];
        let mut inertias = vec![0.0; n];
        for sample in 0..samples {
            for (i, motion) in motions.iter().enumerate() {
                (state[0][i], state[1][i], state[2][i]) = motion.at(sample);
            }
            let [q, v, a] = &state;
            chain.inverse_dynamics(&mut data, q, v, a, &mut tau)?;
            chain.mass_matrix(&mut data, q, &mut matrix)?;
            for (i, (torque, inertia)) in torques.iter_mut().zip(&mut inertias).enumerate() {
                torque.push(tau[i]);
                *inertia += matrix[i * n + i] / samples as f64;
            }
        }
        let each = torques.into_iter().zip(inertias).zip(&motions);
        Ok(each
            .map(|((torque, inertia), motion)| motion.load(torque, inertia))
            .collect())
    }
}

/// The smoothed motion of a joint.
struct SmoothMotion {
    position: Vec<f64>,
    rates: Rates,
}

impl SmoothMotion {
    /// Of these positions; a joint that stays where it is has no velocity.
    fn new(q: &[f64], step: f64) -> Self {
        if q.iter().all(|position| *position == q[0]) {
            return SmoothMotion {
                position: q.to_vec(),
                rates: Rates::at_rest(q.len()),
            };
        }
        let rates = Rates::new(q, None, step);
        SmoothMotion {
            position: Reflected::new(q, step).smoothed(rates.cut_off),
            rates,
        }
    }

    fn at(&self, sample: usize) -> (f64, f64, f64) {
        (
            self.position[sample],
            self.rates.velocity[sample],
            self.rates.acceleration[sample],
        )
    }

    /// The load, for the torque of the whole chain and the mean inertia.
    fn load(&self, mut torque: Vec<f64>, inertia: f64) -> JointLoad {
        let own = torque.iter_mut().zip(&self.rates.acceleration);
        own.for_each(|(torque, acceleration)| *torque -= inertia * acceleration);
        JointLoad { torque, inertia }
    }
}
