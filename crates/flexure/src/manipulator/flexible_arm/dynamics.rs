//! The equations of motion: what every link adds in its own axes, carried to the coordinates.

use super::body::{Local, Rigid, times};
use super::{FlexibleArm, Link};
use crate::error::{ArmError, Error, Result};
use crate::linalg::{Matrix, Vector};
use crate::manipulator::chain::{ChainEnergy, DrivenState};
use crate::vectors::dot;

/// A frame in the plane and how it moves with the coordinates.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub origin: [f64; 2],
    pub angle: f64,
    /// The origin's velocity and the turning by the coordinates' velocities.
    origin_by: [Vec<f64>; 2],
    angle_by: Vec<f64>,
    /// The origin's acceleration at steady velocities of the coordinates; the frame turns steadily then.
    curved: [f64; 2],
}

/// The momentum of a planar arm about the origin of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarMomentum {
    /// kg m/s.
    pub linear: [f64; 2],
    /// kg m^2/s.
    pub angular: f64,
}

/// The inertia matrix, by rows, and the forces that steady velocities and gravity need.
pub(super) struct Assembled {
    pub mass: Vec<f64>,
    pub bias: Vec<f64>,
}

/// A vector turned by an angle.
pub(super) fn turned(angle: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// The acceleration of a point of a frame that turns at this rate, at steady velocities, beyond that of the frame's origin.
fn steady(local: &Local, rates: &[f64], turning: f64) -> [f64; 2] {
    let [vx, vy] = [dot(&local.by[0], rates), dot(&local.by[1], rates)];
    let ([x, y], square) = (local.at, turning * turning);
    [
        local.curved[0] - square * x - 2.0 * turning * vy,
        local.curved[1] - square * y + 2.0 * turning * vx,
    ]
}

impl Frame {
    /// The frame of the base.
    fn base(arm: &FlexibleArm, q: &[f64]) -> Self {
        let unit = |k: usize| {
            let mut row = vec![0.0; q.len()];
            if arm.base.is_some() {
                row[k] = 1.0;
            }
            row
        };
        let free = arm.base.is_some();
        Frame {
            origin: if free { [q[0], q[1]] } else { [0.0; 2] },
            angle: if free { q[2] } else { 0.0 },
            origin_by: [unit(0), unit(1)],
            angle_by: unit(2),
            curved: [0.0; 2],
        }
    }

    /// The frame that this one carries at a point, whose own elastic coordinates begin at `first`, before it is turned.
    fn carrying(&self, local: &Local, first: usize, v: &[f64]) -> Frame {
        let mut frame = self.clone();
        let count = local.by[0].len();
        let at = turned(self.angle, local.at);
        let beyond = turned(
            self.angle,
            steady(local, &v[first..first + count], dot(&self.angle_by, v)),
        );
        for k in 0..2 {
            frame.origin[k] += at[k];
            frame.curved[k] += beyond[k];
            let arm = [-at[1], at[0]][k];
            frame.origin_by[k]
                .iter_mut()
                .zip(&self.angle_by)
                .for_each(|(o, a)| *o += arm * a);
        }
        for i in 0..count {
            let by = turned(self.angle, [local.by[0][i], local.by[1][i]]);
            frame.origin_by[0][first + i] += by[0];
            frame.origin_by[1][first + i] += by[1];
        }
        frame
    }
}

impl FlexibleArm {
    /// The frames of the base and of all links.
    pub(super) fn frames(&self, q: &[f64], v: &[f64]) -> Vec<Frame> {
        let mut frames = vec![Frame::base(self, q)];
        for link in &self.links {
            let carrier = link.carrier.map(|i| &self.links[i]);
            let (e, rates, first) = carrier.map_or((&q[..0], &v[..0], 0), |c| (c.part(q), c.part(v), c.first));
            let local = match carrier.and_then(|c| c.beam.as_ref()) {
                Some(beam) => beam.carried(link.offset, e, rates),
                None => Local::fixed(link.offset, 0),
            };
            let mut frame = frames[link.carrier.map_or(0, |i| i + 1)].carrying(&local, first, v);
            if let Some(beam) = carrier.and_then(|c| c.beam.as_ref()) {
                let turn = beam.turn();
                frame.angle += dot(&turn, e);
                (frame.angle_by[first..].iter_mut().zip(&turn)).for_each(|(by, turn)| *by += turn);
            }
            frame.angle += link.angle;
            if let Some(joint) = link.joint {
                frame.angle += q[joint];
                frame.angle_by[joint] += 1.0;
            }
            frames.push(frame);
        }
        frames
    }

    /// The inertia matrix and the bias, with the gravity given.
    pub(super) fn assemble(&self, q: &[f64], v: &[f64], gravity: [f64; 2]) -> Assembled {
        let n = q.len();
        let mut total = Assembled {
            mass: vec![0.0; n * n],
            bias: vec![0.0; n],
        };
        let frames = self.frames(q, v);
        if let Some(base) = &self.base {
            let own = Share::of(None, Some(base), &[], &[], dot(&frames[0].angle_by, v));
            own.add(&frames[0], 0, gravity, &mut total);
        }
        for (link, frame) in self.links.iter().zip(&frames[1..]) {
            let turning = dot(&frame.angle_by, v);
            let own = Share::of(Some(link), link.hub.as_ref(), link.part(q), link.part(v), turning);
            own.add(frame, link.first, gravity, &mut total);
        }
        for (joint, drive) in self.joints.iter().zip(&self.drives) {
            if !drive.flexible {
                total.mass[joint.at * n + joint.at] += drive.motor;
            }
        }
        total
    }

    /// The accelerations of the coordinates and of the motors of flexible joints under the torques of the joints.
    ///
    /// # Errors
    /// Vectors of another length; an inertia matrix that is not positive definite.
    pub fn accelerations(&self, state: &DrivenState<'_>, torques: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        self.check_state(state)?;
        if torques.len() != self.joints.len() {
            return Err(Error::length("torques", torques.len(), self.joints.len()));
        }
        let (q, v) = (state.q, state.v);
        let Assembled { mass, bias } = self.assemble(q, v, self.gravity);
        let mut forces: Vec<f64> = bias.iter().map(|b| -b).collect();
        for link in &self.links {
            if let Some(beam) = &link.beam {
                let strained: Vec<f64> = (link.part(q).iter().zip(link.part(v)))
                    .map(|(e, rate)| e + beam.damping_time * rate)
                    .collect();
                let elastic = times(&beam.stiffness, &strained);
                forces[link.first..].iter_mut().zip(elastic).for_each(|(f, e)| *f -= e);
            }
        }
        let mut motors = Vec::with_capacity(state.motor_q.len());
        for ((joint, drive), torque) in self.joints.iter().zip(&self.drives).zip(torques) {
            let at = joint.at;
            let motor = drive
                .flexible
                .then(|| (state.motor_q[motors.len()], state.motor_v[motors.len()]));
            let (on_link, on_motor) = drive.torques(q[at], v[at], motor, *torque);
            forces[at] += on_link;
            if drive.flexible {
                motors.push(on_motor / drive.motor);
            }
        }
        let n = q.len();
        let factors = Matrix::from_row_slice(n, n, &mass).cholesky();
        let solved = factors.map(|f| f.solve(&Vector::from_vec(forces)));
        let singular = || {
            let joint = self.joints.first().map(|joint| joint.name.clone());
            Error::Arm(ArmError::SingularChain {
                joint: joint.unwrap_or_default(),
            })
        };
        Ok((solved.ok_or_else(singular)?.as_slice().to_vec(), motors))
    }

    /// The inertia matrix at the position q, by rows.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn mass_matrix(&self, q: &[f64]) -> Result<Vec<f64>> {
        self.check_position(q)?;
        Ok(self.assemble(q, &vec![0.0; q.len()], [0.0; 2]).mass)
    }

    /// The energy of links, rotors, beams and springs.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn energy(&self, state: &DrivenState<'_>) -> Result<ChainEnergy> {
        self.check_state(state)?;
        let (q, v) = (state.q, state.v);
        let mass = self.assemble(q, v, [0.0; 2]).mass;
        let mut energy = ChainEnergy {
            kinetic: 0.5 * dot(v, &times(&mass, v)),
            potential: 0.0,
        };
        for (link, frame) in self.links.iter().zip(&self.frames(q, v)[1..]) {
            let e = link.part(q);
            let mut moments = |mass: f64, at: [f64; 2]| {
                let at = turned(frame.angle, at);
                energy.potential -= mass * (0..2).map(|k| self.gravity[k] * (frame.origin[k] + at[k])).sum::<f64>();
            };
            if let Some(hub) = &link.hub {
                moments(hub.mass, hub.com);
            }
            if let Some(beam) = &link.beam {
                let still = vec![0.0; e.len()];
                (beam.points.iter()).for_each(|place| moments(place.mass, beam.local(place, e, &still).at));
                energy.potential += 0.5 * dot(e, &times(&beam.stiffness, e));
            }
        }
        if let Some(base) = &self.base {
            let at = turned(q[2], base.com);
            energy.potential -= base.mass * (self.gravity[0] * (q[0] + at[0]) + self.gravity[1] * (q[1] + at[1]));
        }
        let mut motor = 0;
        for (joint, drive) in self.joints.iter().zip(&self.drives) {
            if drive.flexible {
                energy.kinetic += 0.5 * drive.motor * state.motor_v[motor].powi(2);
                energy.potential += drive.stiffness.potential(state.motor_q[motor] - q[joint.at]);
                motor += 1;
            } else if drive.passive {
                energy.potential += drive.stiffness.potential(-q[joint.at]);
            }
        }
        Ok(energy)
    }

    /// The momentum of an arm on a free base, which is conserved without gravity.
    ///
    /// # Errors
    /// A vector of another length; a fixed base.
    pub fn momentum(&self, state: &DrivenState<'_>) -> Result<PlanarMomentum> {
        self.check_state(state)?;
        if self.base.is_none() {
            return Err(Error::parameter(
                "the base's degrees of freedom",
                0.0,
                "3: a fixed base takes momentum up",
            ));
        }
        let (q, v) = (state.q, state.v);
        let momentum = times(&self.assemble(q, v, [0.0; 2]).mass, v);
        Ok(PlanarMomentum {
            linear: [momentum[0], momentum[1]],
            angular: momentum[2] + q[0] * momentum[1] - q[1] * momentum[0],
        })
    }
}

/// What a body or link adds, by the velocity of its origin in its own axes, its turning and its elastic rates.
struct Share {
    mass: Vec<f64>,
    bias: Vec<f64>,
}

impl Share {
    fn of(link: Option<&Link>, hub: Option<&Rigid>, e: &[f64], rates: &[f64], turning: f64) -> Self {
        let all = 3 + e.len();
        let mut share = Share {
            mass: vec![0.0; all * all],
            bias: vec![0.0; all],
        };
        if let Some(hub) = hub {
            share.point(hub.mass, &Local::fixed(hub.com, e.len()), rates, turning);
            share.mass[2 * all + 2] += hub.inertia;
        }
        if let Some(beam) = link.and_then(|link| link.beam.as_ref()) {
            for place in &beam.points {
                share.point(place.mass, &beam.local(place, e, rates), rates, turning);
            }
        }
        share
    }

    /// Adds a mass at a point.
    fn point(&mut self, mass: f64, local: &Local, rates: &[f64], turning: f64) {
        let acceleration = steady(local, rates, turning);
        let rigid = [[1.0, 0.0, -local.at[1]], [0.0, 1.0, local.at[0]]];
        for k in 0..2 {
            let row: Vec<f64> = rigid[k].iter().chain(&local.by[k]).copied().collect();
            for (i, (own, bias)) in row.iter().zip(&mut self.bias).enumerate() {
                if *own == 0.0 {
                    continue;
                }
                let own = mass * own;
                *bias += own * acceleration[k];
                let entries = &mut self.mass[i * row.len()..(i + 1) * row.len()];
                entries
                    .iter_mut()
                    .zip(&row)
                    .for_each(|(entry, other)| *entry += own * other);
            }
        }
    }

    /// Carries the share to the coordinates.
    fn add(mut self, frame: &Frame, first: usize, gravity: [f64; 2], total: &mut Assembled) {
        let (all, n) = (self.bias.len(), total.bias.len());
        // Gravity is an acceleration of the frame against it.
        let lifted = turned(-frame.angle, [0, 1].map(|k| frame.curved[k] - gravity[k]));
        for (row, bias) in self.mass.chunks(all).zip(&mut self.bias) {
            *bias += row[0] * lifted[0] + row[1] * lifted[1];
        }
        let (sin, cos) = frame.angle.sin_cos();
        let [x, y] = &frame.origin_by;
        let mut rows = vec![
            x.iter().zip(y).map(|(x, y)| cos * x + sin * y).collect(),
            x.iter().zip(y).map(|(x, y)| cos * y - sin * x).collect(),
            frame.angle_by.clone(),
        ];
        rows.extend((3..all).map(|k| {
            let mut row = vec![0.0; n];
            row[first + k - 3] = 1.0;
            row
        }));
        for (i, row) in rows.iter().enumerate() {
            let mut moved = vec![0.0; n];
            for (other, mass) in rows.iter().zip(&self.mass[i * all..(i + 1) * all]) {
                moved.iter_mut().zip(other).for_each(|(m, o)| *m += mass * o);
            }
            for (k, by) in row.iter().enumerate().filter(|(_, by)| **by != 0.0) {
                total.bias[k] += by * self.bias[i];
                let entries = &mut total.mass[k * n..(k + 1) * n];
                entries.iter_mut().zip(&moved).for_each(|(entry, m)| *entry += by * m);
            }
        }
    }
}

impl FlexibleArm {
    /// The sum of all masses times their accelerations at steady velocities: in gravity's direction it is the second derivative of
    /// gravity's energy along a motion.
    pub(super) fn curved_mass(&self, q: &[f64], v: &[f64]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (link, frame) in self.links.iter().zip(&self.frames(q, v)[1..]) {
            let turning = dot(&frame.angle_by, v);
            let own = Share::of(Some(link), link.hub.as_ref(), link.part(q), link.part(v), turning);
            let beyond = turned(frame.angle, [own.bias[0], own.bias[1]]);
            (0..2).for_each(|k| sum[k] += own.mass[0] * frame.curved[k] + beyond[k]);
        }
        sum
    }
}
