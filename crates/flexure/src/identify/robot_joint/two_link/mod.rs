//! A two-link arm as a whole: both joints excited, the links coupled.
//!
//! The motors' equations, with the rotor of the elbow riding on link 1 as (8)-(9) have it,
//!
//! $$ \tau_1 = J_{m1} \ddot q_{m1} + \kappa_1(d_1), \qquad \tau_2 = J_{m2} (\ddot q_{m2} + \ddot q_1) + \kappa_2(d_2), $$
//!
//! stand beside those of the links ([`links`]). All four are linear in the two motor inertias and the three constants of
//! the links, and free in the two stiffness and the two friction curves.

mod forms;
mod links;
mod outcome;
mod refine;

#[cfg(test)]
mod tests;

use super::alignment::{Alignment, align};
use super::checks;
use super::equations::{Column, Equations, Solution};
use super::flexible::{BANDS, HIGHEST, Motion};
use super::fourier::Modulation;
use super::noisy::{Abscissa, Noisy};
use super::outcome::{Estimated, Finding, FlexibleAxis};
use super::pair::{Pair, Splines, combine};
use super::rigid::{FEWEST_LINES, least_band};
use super::smooth::{Noise, Reflected};
use crate::error::{DataError, Error, Result};
use crate::linalg::Complex;
use links::{CONSTANTS, FreeLinks, Links};

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
/// What a motion tells of the links are the three constants of [`LinkDynamics`](crate::manipulator::LinkDynamics);
/// masses, lengths and centres of mass by themselves it does not.
#[derive(Debug, Clone, serde::Serialize)]
pub struct TwoLinkArm {
    /// `m1 lc1^2 + m2 (l1^2 + lc2^2) + I1 + I2`, beside the free curves.
    pub shoulder: Estimated,
    /// `m2 lc2^2 + I2`.
    pub elbow: Estimated,
    /// `m2 l1 lc2`.
    pub coupling: Estimated,
    /// Shoulder, elbow and coupling beside the forms that an arm can have.
    pub model: [Estimated; 3],
    /// The motors' inertias beside these forms.
    pub model_motors: [Estimated; 2],
    /// The joints. Their link inertia is the diagonal of M with the arm stretched, `q2 = 0`; the forms of friction are fitted
    /// with the other joint's friction as its free curve has it.
    pub joints: [FlexibleAxis; 2],
}

/// The names of the columns of each joint in errors.
const NAMES: [[&str; 3]; 2] = [["motor 1", "link 1", "torque 1"], ["motor 2", "link 2", "torque 2"]];

/// Everything that is solved for, in this order: motor inertias, constants of the links, stiffness and friction curves.
struct Whole<'a> {
    modulation: &'a Modulation,
    motions: [Motion<'a>; 2],
    alignments: [Alignment; 2],
    pairs: [Pair<'a>; 2],
    links: Links,
    /// The links' angles, in step with the motors'.
    q: [Vec<f64>; 2],
    stiffness: [Splines; 2],
    motor_noise: [Vec<f64>; 2],
    free: FreeLinks,
    /// The splines beside which the forms of the curves of each joint are tested.
    tested: [[Splines; 2]; 2],
    /// The next finer splines of stiffness 1 and 2, friction 1 and 2, which tell what those in use smooth away.
    finer: Vec<Splines>,
}

/// The columns of the splines of stiffness 1 and 2, friction 1 and 2 in the equations of motor 1 and 2, link 1 and 2.
fn on_equations(curve: usize, splines: &Splines) -> impl Iterator<Item = Column> + '_ {
    splines.1.iter().map(move |lines| {
        let mut column: Column = vec![None; 4];
        if curve < 2 {
            column[curve] = Some(lines.clone());
        }
        column[2 + curve % 2] = Some(lines.clone());
        column
    })
}

impl TwoLinkLog<'_> {
    fn check(&self) -> Result<()> {
        let n = self.link[0].len();
        for (joint, names) in NAMES.iter().enumerate() {
            let columns = [self.motor[joint], self.link[joint], self.torque[joint]];
            for (name, column) in names.iter().zip(columns) {
                checks::column(name, column, n)?;
            }
        }
        checks::settings(self.sample_time, self.level)?;
        for (joint, [motor, link, _]) in NAMES.iter().enumerate() {
            checks::unwrapped(motor, self.motor[joint])?;
            checks::unwrapped(link, self.link[joint])?;
        }
        Ok(())
    }

    /// Identifies the arm.
    ///
    /// # Errors
    /// As [`super::RigidJoint::identify`], and [`Error::Data`]: `RigidJointInArm` where a joint shows no deflection.
    pub fn identify(&self) -> Result<TwoLinkArm> {
        self.check()?;
        let step = self.sample_time;
        let (motor, link) = (
            self.motor.map(|q| Noise::of(q, step)),
            self.link.map(|q| Noise::of(q, step)),
        );
        let n = self.link[0].len();
        checks::resolved(&[motor[0], link[0], motor[1], link[1]], n, step)?;
        let widest = motor.iter().chain(&link).map(|noise| noise.band).fold(0.0, f64::max);
        let highest = (HIGHEST / step).min((BANDS * widest).max(least_band(n, step)));
        let modulation = Modulation::new(n, step, highest);
        if modulation.len() < FEWEST_LINES {
            return Err(Error::too_short(
                "the equations of motion at enough frequencies",
                (FEWEST_LINES as f64 / (highest * step)).ceil() as usize,
                n,
            ));
        }
        let motions = [0, 1].map(|i| Motion {
            motor: self.motor[i],
            link: self.link[i],
            torque: self.torque[i],
            step,
            motor_inertia: None,
            motor_noise: motor[i],
            link_noise: link[i],
            rides_on: (i == 1).then_some((self.link[0], link[0])),
        });
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
        let whole = Whole::new(motions, &modulation);
        whole
            .and_then(|w| w.outcome(self.level))
            .ok_or(Error::Data(DataError::TooLittleMotion {
                what: "inertias, stiffness and friction of the arm",
            }))
    }
}

impl<'a> Whole<'a> {
    fn new(motions: [Motion<'a>; 2], modulation: &'a Modulation) -> Option<Whole<'a>> {
        let alignments = [align(&motions[0], modulation)?, align(&motions[1], modulation)?];
        let q = [0, 1].map(|i| match alignments[i].skew {
            (skew, _, true) => Reflected::new(motions[i].link, motions[i].step).shifted(skew),
            _ => motions[i].link.to_vec(),
        });
        let pairs = [0, 1].map(|i| Pair::new(&motions[i], modulation, &alignments[i], &q[i]));
        let links = Links::new(
            modulation,
            [&q[0], &q[1]],
            [&pairs[0].v, &pairs[1].v],
            motions[1].motor,
            [motions[0].link_noise, motions[1].link_noise, motions[1].motor_noise],
        );
        let (first, second) = (pairs[0].stiffness()?, pairs[1].stiffness()?);
        // Unknown 0 of a motor's equation is its inertia.
        let kappa = [&first, &second].map(|(splines, solution, _)| combine(&splines.1, &solution.x[1..]));
        let band = motions.iter().map(|m| m.link_noise.band).fold(0.0, f64::max);
        let free = links.free([&pairs[0], &pairs[1]], [&kappa[0], &kappa[1]], second.1.x[0], band)?;
        let whole = Whole {
            modulation,
            alignments,
            links,
            q,
            stiffness: [first.0, second.0],
            motor_noise: [first.2, second.2],
            free,
            tested: [pairs[0].tested(), pairs[1].tested()],
            pairs,
            motions,
            finer: Vec::new(),
        };
        whole.refined()
    }

    /// The inertias' columns in the equations of motor 1 and 2, link 1 and 2, these as `0 = kappa - ...`.
    fn inertias(&self) -> Vec<Column> {
        let rotor = |i: usize| self.pairs[i].motor.clone();
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

    fn right(&self) -> Vec<Vec<Complex<f64>>> {
        let zero = vec![Complex::new(0.0, 0.0); self.modulation.len()];
        let torque = |i: usize| self.pairs[i].torque.clone();
        vec![torque(0), torque(1), zero.clone(), zero]
    }

    fn noise(&self) -> Vec<&[f64]> {
        let both = self.motor_noise.iter().chain(&self.free.noise);
        both.map(Vec::as_slice).collect()
    }

    /// The noise of the columns of the inertias.
    fn noisy(&self) -> Vec<Noisy<'_>> {
        let motors = (0..2).map(|i| Noisy {
            columns: [i, i],
            block: i,
            lines: &self.pairs[i].encoder[0],
            factor: 1.0,
        });
        motors.chain(self.links.noisy(2, 2, Some(1))).collect()
    }

    /// The deflection of a joint as an abscissa in the equations of its motor and its link.
    fn abscissa(&self, joint: usize) -> Abscissa<'_> {
        let pair = &self.pairs[joint];
        if pair.smoothed {
            return Abscissa::default();
        }
        let [motor, link] = pair.variances;
        let (inertia, carried) = (joint, 2 + joint);
        // The acceleration of link 1 is in the equation of link 1 twice, that of link 2 in its own with the elbow's constant alone.
        let coupled = (joint == 0).then(|| (4, 2, &pair.shared[..], -2.0 * self.links.cosine[0] * link));
        Abscissa {
            own: [joint, 2 + joint]
                .map(|block| (block, &pair.elastic[..], motor + link))
                .to_vec(),
            with: [
                (inertia, joint, &pair.shared[..], -motor),
                (carried, 2 + joint, &pair.shared[..], -link),
            ]
            .into_iter()
            .chain(coupled)
            .collect(),
        }
    }

    /// What the deflections' noise adds to the products of the splines of these curves of stiffness, whose columns begin there.
    fn noisy_curves<'b>(&'b self, curves: &[(usize, &Splines, usize)]) -> Vec<Noisy<'b>> {
        let of = |&(joint, splines, first): &(usize, &Splines, usize)| {
            self.pairs[joint].noisy_curve(&self.abscissa(joint), splines, first)
        };
        curves.iter().flat_map(of).collect()
    }

    /// All equations with free curves.
    fn equations(&self) -> Equations<'_> {
        let [k1, k2] = &self.stiffness;
        let [f1, f2] = &self.free.friction;
        self.equations_with([k1, k2, f1, f2])
    }

    /// All equations with these curves of stiffness 1 and 2, friction 1 and 2.
    fn equations_with(&self, curves: [&Splines; 4]) -> Equations<'_> {
        let mut columns = self.inertias();
        let mut noisy = self.noisy();
        let [k1, k2, ..] = curves;
        let first = columns.len();
        noisy.extend(self.noisy_curves(&[(0, k1, first), (1, k2, first + k1.1.len())]));
        for (i, splines) in curves.into_iter().enumerate() {
            columns.extend(on_equations(i, splines));
        }
        Equations {
            columns,
            right: self.right(),
            noise: self.noise(),
            noisy,
        }
    }

    /// Where the stiffness and the friction curve of a joint begin among the unknowns.
    fn places(&self, joint: usize) -> [usize; 2] {
        let stiff = 2 + CONSTANTS;
        let rub = stiff + self.stiffness.iter().map(|s| s.0.len()).sum::<usize>();
        match joint {
            0 => [stiff, rub],
            _ => [stiff + self.stiffness[0].0.len(), rub + self.free.friction[0].0.len()],
        }
    }

    /// The torques of the free curves of a joint at every sample.
    fn curves(&self, solution: &Solution, joint: usize) -> [Vec<f64>; 2] {
        let [stiff, rub] = self.places(joint);
        let pair = &self.pairs[joint];
        let (k, f) = (&self.stiffness[joint].0, &self.free.friction[joint].0);
        [
            pair.d.iter().map(|&d| k.value(&solution.x[stiff..], d) * d).collect(),
            pair.v.iter().map(|&v| f.value(&solution.x[rub..], v)).collect(),
        ]
    }
}
