//! The equations of the two links.
//!
//! With `c = cos q2`, the equations (4)-(7) of the links under the elastic torques are
//!
//! $$ \kappa_1 = s\,\ddot q_1 + e\,\ddot q_2 + p\,\tfrac{d}{dt}[c\,(2\dot q_1 + \dot q_2)] + J_{m2}\ddot q_{m2} + f_1, $$
//!
//! $$ \kappa_2 = e\,(\ddot q_1 + \ddot q_2) + p\,\{\tfrac{d}{dt}[c\,\dot q_1] + \sin q_2\, \dot q_1 (\dot q_1 + \dot q_2)\} + f_2, $$
//!
//! linear in the arm's constants s (shoulder), e (elbow) and p (coupling) of
//! [`LinkDynamics`](crate::manipulator::LinkDynamics).

use super::super::column_noise::Noisy;
use super::super::division::FRICTION;
use super::super::equations::{Column, Lines};
use super::super::fourier::Modulation;
use super::super::joint_signals::JointSignals;
use super::super::limits::NOISE_ROUNDS;
use super::super::smooth::{Noise, gain};
use super::super::system::{Splines, System, low_frequencies};
use crate::linalg::Complex;

/// The number of the links' constants.
pub(super) const CONSTANTS: usize = 3;

/// The two links' motion in their equations.
pub(super) struct Links {
    /// Minus the terms of the shoulder's, the elbow's and the coupling constant in the equations of link 1 and link 2.
    pub constants: [Column; CONSTANTS],
    /// Minus the acceleration of motor 2 in its bearing, which acts on link 1.
    pub rotor: Lines,
    /// The encoders' noise in the accelerations of link 1 and 2 and of motor 2.
    encoder: [Vec<f64>; 3],
    /// The noise of link 1 and 2 in the product of an acceleration and the rate of a smoothed velocity, and in the square of this rate.
    smoothed: [Vec<f64>; 2],
    smoother: [Vec<f64>; 2],
    /// The means of cos q2 and of its square.
    pub cosine: [f64; 2],
}

impl Links {
    /// From the angles of the links and of motor 2, their noise, and the links' velocities, smoothed with the angles' cut-offs.
    pub fn new(modulation: &Modulation, q: [&[f64]; 2], v: [&[f64]; 2], motor: &[f64], noise: [Noise; 3]) -> Links {
        let n = q[0].len();
        let cut_off = [0, 1].map(|i| noise[i].cut_off());
        let negative = |lines: Lines| -> Lines { lines.into_iter().map(|v| -v).collect() };
        let along = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..n).map(f).collect() };
        let [first, second] = q.map(|q| negative(modulation.of_acceleration(q)));
        let both: Lines = first.iter().zip(&second).map(|(a, b)| a + b).collect();
        let swing = along(&|i| q[1][i].cos() * (2.0 * v[0][i] + v[1][i]));
        let carried = along(&|i| q[1][i].cos() * v[0][i]);
        let centrifugal = along(&|i| q[1][i].sin() * v[0][i] * (v[0][i] + v[1][i]));
        let on_second = modulation
            .of_rate(&carried)
            .into_iter()
            .zip(modulation.of(&centrifugal));
        let spectrum = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { modulation.omega.iter().map(|w| f(*w)).collect() };
        let smooth =
            |times: i32| [0, 1].map(|i| spectrum(&|w| (noise[i].sd * w * w).powi(2) * gain(w, cut_off[i]).powi(times)));
        let mean = |power: i32| q[1].iter().map(|q| q.cos().powi(power)).sum::<f64>() / n as f64;
        Links {
            constants: [
                vec![Some(first), None],
                vec![Some(second), Some(both)],
                vec![
                    Some(negative(modulation.of_rate(&swing))),
                    Some(on_second.map(|(a, b)| -a - b).collect()),
                ],
            ],
            rotor: negative(modulation.of_acceleration(motor)),
            encoder: noise.map(|noise| spectrum(&|w| (noise.sd * w * w).powi(2))),
            smoothed: smooth(1),
            smoother: smooth(2),
            cosine: [mean(1), mean(2)],
        }
    }

    /// The contribution of the encoders' noise to each line of each equation.
    pub fn known(&self, constants: &[f64], rotor: f64) -> [Vec<f64>; 2] {
        let [shoulder, elbow, coupling] = [0, 1, 2].map(|i| constants[i]);
        // The mean square of a + b cos q2.
        let square = |a: f64, b: f64| a * a + 2.0 * a * b * self.cosine[0] + b * b * self.cosine[1];
        let shares = [
            [square(shoulder, 2.0 * coupling), square(elbow, coupling), rotor * rotor],
            [square(elbow, coupling), elbow * elbow, 0.0],
        ];
        shares.map(|shares| {
            let sum = |k: usize| (0..3).map(|j| shares[j] * self.encoder[j][k]).sum();
            (0..self.rotor.len()).map(sum).collect()
        })
    }

    /// The noise of the columns of the constants, from `from` on, and of rotor 2 if that is an unknown. The links' equations are the blocks
    /// `first` and the next one.
    pub fn noisy(&self, from: usize, first: usize, rotor: Option<usize>) -> Vec<Noisy<'_>> {
        let [link_1, link_2, motor_2] = &self.encoder;
        // The coupling's column has smoothed velocities.
        let [smooth_1, smooth_2] = &self.smoothed;
        let [smoother_1, smoother_2] = &self.smoother;
        let [cosine, square] = self.cosine;
        let (shoulder, elbow, coupling) = (from, from + 1, from + 2);
        let entry = |a: usize, b: usize, block: usize, spectrum, factor: f64| Noisy {
            columns: [a, b],
            block: first + block,
            spectrum,
            factor,
        };
        let carried = rotor.map(|rotor| entry(rotor, rotor, 0, &motor_2[..], 1.0));
        let links = [
            entry(shoulder, shoulder, 0, &link_1[..], 1.0),
            entry(elbow, elbow, 0, link_2, 1.0),
            entry(elbow, elbow, 1, link_1, 1.0),
            entry(elbow, elbow, 1, link_2, 1.0),
            entry(coupling, coupling, 0, smoother_1, 4.0 * square),
            entry(coupling, coupling, 0, smoother_2, square),
            entry(coupling, coupling, 1, smoother_1, square),
            entry(shoulder, coupling, 0, smooth_1, 2.0 * cosine),
            entry(elbow, coupling, 0, smooth_2, cosine),
            entry(elbow, coupling, 1, smooth_1, cosine),
        ];
        links.into_iter().chain(carried).collect()
    }

    /// The links' equations alone, with known elastic torques and a known inertia of motor 2.
    pub fn system<'a>(&'a self, joints: &'a [JointSignals; 2], kappa: [&[Complex<f64>]; 2], rotor: f64) -> System<'a> {
        let on_first = kappa[0].iter().zip(&self.rotor).map(|(k, a)| -(k + a * rotor));
        System {
            modulation: joints[0].modulation,
            factors: self.constants.to_vec(),
            right: vec![on_first.collect(), kappa[1].iter().map(|k| -k).collect()],
            noisy: self.noisy(0, 0, None),
            given: Vec::new(),
            encoder_noise: Box::new(move |x| self.known(x, rotor).into()),
            curves: vec![
                joints[0].friction(vec![-1.0, 0.0], CONSTANTS),
                joints[1].friction(vec![0.0, -1.0], CONSTANTS),
            ],
        }
    }
}

/// The free friction curves, and the noise of the links' equations.
pub(super) struct FreeLinks {
    pub splines: [Splines; 2],
    pub noise: Vec<Vec<f64>>,
}

/// The free friction curves of the links' equations alone, one after the other.
pub(super) fn start(system: &System, band: f64) -> Option<FreeLinks> {
    let splines = |joint: usize, pieces: usize| system.curves[joint].splines(system.modulation, pieces);
    let coarse = [0, 1].map(|joint| splines(joint, FRICTION.coarse));
    let start = vec![low_frequencies(system.modulation, band); 2];
    let mut noise = system.reweighted(&coarse, start, NOISE_ROUNDS)?;
    let chosen = |joint: usize| {
        FRICTION.undersmoothed(|pieces| {
            let own = splines(joint, pieces);
            let mut both = [&coarse[0], &coarse[1]];
            both[joint] = &own;
            Some(system.solve(&both, &noise)?.akaike())
        })
    };
    let splines = [splines(0, chosen(0)?), splines(1, chosen(1)?)];
    noise = system.noise_of(&system.solve(&splines, &noise)?);
    Some(FreeLinks { splines, noise })
}
