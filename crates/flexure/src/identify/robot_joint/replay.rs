//! An identified axis in time: its simulated motion.

use super::chain_load::JointLoad;
use super::forms::ParametricCurve;
use super::limits::{FEWEST_AT_START, REPLAY_SUBSTEPS, START_PERIODS};
use super::motion::between;
use super::outcome::{Fitted, FlexibleAxis, RigidAxis};
use super::stretches::{FormedJoint, Logged, Stretch};

/// What moves the axis.
#[derive(Debug, Clone, Copy)]
pub enum AxisDrive<'a> {
    /// The torque, held from sample to sample.
    Torque(&'a [f64]),
    /// A position controller with a velocity loop inside:
    /// `torque = torque_constant kv (kp (reference - q) - q')`, held from sample to sample.
    Loop {
        /// The reference of the position.
        reference: &'a [f64],
        /// The position's gain, 1/s.
        kp: f64,
        /// The velocity's gain, in units of the command per velocity.
        kv: f64,
        /// Torque per unit of command.
        torque_constant: f64,
    },
}

impl<'a> AxisDrive<'a> {
    /// The same at the first samples.
    fn head(self, samples: usize) -> AxisDrive<'a> {
        match self {
            AxisDrive::Torque(torque) => AxisDrive::Torque(&torque[..samples.min(torque.len())]),
            AxisDrive::Loop {
                reference,
                kp,
                kv,
                torque_constant,
            } => AxisDrive::Loop {
                reference: &reference[..samples.min(reference.len())],
                kp,
                kv,
                torque_constant,
            },
        }
    }
}

/// An axis that can be moved.
pub(super) struct Movable<'a> {
    pub inertia: f64,
    pub friction: &'a ParametricCurve,
    /// The factors of cos q, sin q and q.
    pub extras: [f64; 3],
    /// s.
    pub sample_time: f64,
    /// Integration steps a sample.
    pub substeps: usize,
}

impl RigidAxis {
    /// The positions of the axis with the friction of one of its forms, starting from a position and a velocity.
    ///
    /// Runge-Kutta's method of order 4, eight steps a sample; one position a sample of the drive.
    pub fn replay(&self, form: &Fitted, drive: AxisDrive, start: [f64; 2]) -> Vec<f64> {
        let axis = Movable {
            inertia: form.inertia.value,
            friction: &form.curve,
            extras: self.position_dependent(),
            sample_time: self.sample_time,
            substeps: REPLAY_SUBSTEPS,
        };
        axis.positions(drive, start)
    }

    /// The velocity at the first sample, from a smoothed one: that with which the simulated motion is nearest to these positions at first.
    ///
    /// Smoothing knows no samples before the first one, so that it is wrong there if the log begins in the middle of an acceleration. The
    /// velocity is returned as it is if it was logged.
    pub fn starting_velocity(&self, form: &Fitted, drive: AxisDrive, positions: &[f64], smoothed: f64) -> f64 {
        let Some(cut_off) = self.cut_off else {
            return smoothed;
        };
        let samples = (START_PERIODS / (cut_off * self.sample_time)).ceil() as usize;
        let first = positions[0];
        let positions = &positions[..samples.max(FEWEST_AT_START).min(positions.len())];
        let drive = drive.head(positions.len());
        let from = |velocity: f64| self.replay(form, drive, [first, velocity]);
        let range = positions.iter().fold(0.0_f64, |m, q| m.max((q - first).abs()));
        let step = range / (positions.len() as f64 * self.sample_time);
        let (start, moved) = (from(smoothed), from(smoothed + step));
        let (mut above, mut below) = (0.0, 0.0);
        for (q, (start, moved)) in positions.iter().zip(start.iter().zip(&moved)) {
            let slope = (moved - start) / step;
            above += slope * (q - start);
            below += slope * slope;
        }
        let velocity = smoothed + above / below;
        if velocity.is_finite() { velocity } else { smoothed }
    }

    /// The factors of cos q, sin q and q; 0 for missing terms.
    pub(super) fn position_dependent(&self) -> [f64; 3] {
        ["gravity cos", "gravity sin", "spring"].map(|symbol| {
            let found = self.extras.iter().find(|e| e.symbol == symbol);
            found.map_or(0.0, |e| e.value)
        })
    }
}

impl FlexibleAxis {
    /// The angles of motor and link with the forms of the model, one pair a sample of the torque, which is held from sample to sample. They start
    /// from these angles of motor and link, and these velocities of both.
    ///
    /// Leapfrog steps, eight a sample or more; dry friction takes what it can from the velocity, so that a body that sticks is at rest.
    pub fn replay(&self, torque: &[f64], load: Option<&JointLoad>, start: [f64; 4]) -> Vec<[f64; 2]> {
        let model = &self.model;
        let extras: Vec<f64> = self.link.extras.iter().map(|extra| extra.value).collect();
        let joint = FormedJoint {
            inertias: [self.motor_inertia.value, model.friction.inertia.value],
            damping: self.damping.map(|damping| damping.value),
            gravity: extras.try_into().ok(),
            stiffness: model.stiffness.curve.clone(),
            friction: model.friction.curve.clone(),
            motor_friction: model.motor_friction.as_ref().map(|form| form.curve.clone()),
            turns_over: None,
        };
        let velocity = &self.link.friction.x;
        let log = Logged {
            motor: &[],
            link: &[],
            velocities: [velocity, velocity],
            torque,
            load: between(load, torque.len()),
            step: self.link.sample_time,
        };
        let stretch = Stretch {
            first: 0,
            start,
            turned: 0.0,
        };
        let drive = torque.iter().zip(&log.load).map(|(torque, load)| [*torque, *load]);
        joint.angles(&stretch, drive, log.step, joint.substeps(&log))
    }
}

impl Movable<'_> {
    /// Its positions from an initial position and velocity, one for each sample of the drive.
    pub fn positions(&self, drive: AxisDrive, start: [f64; 2]) -> Vec<f64> {
        let samples = match drive {
            AxisDrive::Torque(torque) => torque.len(),
            AxisDrive::Loop { reference, .. } => reference.len(),
        };
        let [cosine, sine, spring] = self.extras;
        let acceleration = |torque: f64, [q, v]: [f64; 2]| {
            let position = match self.extras {
                [0.0, 0.0, 0.0] => 0.0,
                _ => cosine * q.cos() + sine * q.sin() + spring * q,
            };
            (torque - self.friction.value(v) - position) / self.inertia
        };
        let h = self.sample_time / self.substeps as f64;
        let mut state = start;
        let mut motion = Vec::with_capacity(samples);
        for i in 0..samples {
            motion.push(state[0]);
            let torque = match drive {
                AxisDrive::Torque(torque) => torque[i],
                AxisDrive::Loop {
                    reference,
                    kp,
                    kv,
                    torque_constant,
                } => torque_constant * kv * (kp * (reference[i] - state[0]) - state[1]),
            };
            for _ in 0..self.substeps {
                let slope = |s: [f64; 2]| [s[1], acceleration(torque, s)];
                let ahead = |k: [f64; 2], h: f64| [state[0] + h * k[0], state[1] + h * k[1]];
                let k1 = slope(state);
                let k2 = slope(ahead(k1, 0.5 * h));
                let k3 = slope(ahead(k2, 0.5 * h));
                let k4 = slope(ahead(k3, h));
                state = std::array::from_fn(|j| state[j] + h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]));
            }
        }
        motion
    }
}
