//! An identified axis in time: its simulated motion.

use super::basis::range;
use super::chain_load::JointLoad;
use super::forms::ParametricCurve;
use super::limits::{FEWEST_AT_START, REPLAY_SUBSTEPS, START_PERIODS};
use super::motion::between;
use super::outcome::{Fitted, FlexibleAxis, RigidAxis};
use super::stretches::{FormedJoint, Logged, Stretch};
use crate::linalg::least_squares;

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

/// The sum of the squared differences of two signals.
fn squared_error(simulated: &[f64], measured: &[f64]) -> f64 {
    let both = simulated.iter().zip(measured);
    both.map(|(simulated, measured)| (simulated - measured).powi(2)).sum()
}

/// The range of positions over the log's duration: a speed by which a velocity is changed to see what that does.
fn usual_speed(positions: &[f64], sample_time: f64) -> f64 {
    let [low, high] = range(positions);
    (high - low) / (positions.len() as f64 * sample_time)
}

/// Whether an error is less than another one; a motion that runs away has none.
fn is_less(error: f64, than: f64) -> bool {
    error < than || error.is_finite() && !than.is_finite()
}

/// The number of samples over which the first velocity is fitted, of this many.
fn at_start(cut_off: f64, sample_time: f64, samples: usize) -> usize {
    let periods = (START_PERIODS / (cut_off * sample_time)).ceil() as usize;
    periods.max(FEWEST_AT_START).min(samples)
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
    /// `drive` and `positions`, rad (m), have one value for each sample of a log; `smoothed` and the result are in rad/s (m/s). Smoothing knows no
    /// samples before the first one, so that it is wrong there if the log begins in the middle of an acceleration. The velocity is returned as
    /// it is if it was logged, or if the whole motion is then nearer to the positions.
    pub fn starting_velocity(&self, form: &Fitted, drive: AxisDrive, positions: &[f64], smoothed: f64) -> f64 {
        let Some(cut_off) = self.cut_off else {
            return smoothed;
        };
        let (whole, Some(&first)) = (positions, positions.first()) else {
            return smoothed;
        };
        let error = |velocity: f64| squared_error(&self.replay(form, drive, [first, velocity]), whole);
        let positions = &positions[..at_start(cut_off, self.sample_time, positions.len())];
        let at_first = drive.head(positions.len());
        let from = |velocity: f64| self.replay(form, at_first, [first, velocity]);
        let step = usual_speed(whole, self.sample_time);
        let (start, moved) = (from(smoothed), from(smoothed + step));
        let (mut above, mut below) = (0.0, 0.0);
        for (q, (start, moved)) in positions.iter().zip(start.iter().zip(&moved)) {
            let slope = (moved - start) / step;
            above += slope * (q - start);
            below += slope * slope;
        }
        let velocity = smoothed + above / below;
        match is_less(error(velocity), error(smoothed)) {
            true => velocity,
            false => smoothed,
        }
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
    /// The velocities of motor and link at the first sample, from a smoothed one of the link: those with which the simulated angles are nearest
    /// to these of motor and link at first, as for [`RigidAxis::starting_velocity`]. Angles in rad, on the link's side of a gear, and the torque
    /// in N m, one value for each sample of a log.
    pub fn starting_velocities(
        &self,
        torque: &[f64],
        load: Option<&JointLoad>,
        [motor, link]: [&[f64]; 2],
        smoothed: f64,
    ) -> [f64; 2] {
        let samples = torque.len().min(motor.len()).min(link.len());
        let Some(cut_off) = self.link.cut_off.filter(|_| samples > 0) else {
            return [smoothed; 2];
        };
        let n = at_start(cut_off, self.link.sample_time, samples);
        let (whole, torque) = (torque, &torque[..n]);
        let from = |[of_motor, of_link]: [f64; 2]| -> Vec<f64> {
            let angles = self.replay(torque, load, [motor[0], link[0], of_motor, of_link]);
            angles.into_iter().flatten().collect()
        };
        let step = usual_speed(link, self.link.sample_time);
        let start = from([smoothed; 2]);
        let moved = [from([smoothed + step, smoothed]), from([smoothed, smoothed + step])];
        let rows: Vec<f64> = (0..start.len())
            .flat_map(|i| moved.each_ref().map(|moved| (moved[i] - start[i]) / step))
            .collect();
        let measured = motor.iter().zip(link).flat_map(|(motor, link)| [*motor, *link]);
        let off: Vec<f64> = measured.zip(&start).map(|(measured, start)| measured - start).collect();
        let error = |[of_motor, of_link]: [f64; 2]| {
            let angles = self.replay(whole, load, [motor[0], link[0], of_motor, of_link]);
            squared_error(&angles.iter().map(|[_, link]| *link).collect::<Vec<_>>(), link)
        };
        let is_finite = rows.iter().chain(&off).all(|value| value.is_finite());
        let solved = is_finite.then(|| least_squares(&rows, 2, &off)).flatten();
        let fitted = match solved.as_deref() {
            Some(&[of_motor, of_link]) => [smoothed + of_motor, smoothed + of_link],
            _ => return [smoothed; 2],
        };
        match is_less(error(fitted), error([smoothed; 2])) {
            true => fitted,
            false => [smoothed; 2],
        }
    }

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
