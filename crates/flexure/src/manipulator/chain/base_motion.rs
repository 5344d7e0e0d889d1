//! The motion of a base that is moved: by a ship, a vehicle, a shaker.
//!
//! Poses are given at the instants of a run. Of each coordinate, velocity and acceleration at an instant are those of the polynomial through
//! the seven nearest instants. From one instant to the next it is the polynomial of degree five that agrees with both ends, so accelerations
//! are continuous. The orientation is the quaternion of these polynomials, brought to length one. With \\(p\\) before that, in the axes of the
//! base
//!
//! \\[\omega = \frac{2 \operatorname{Im} \bar p p'}{|p|^2}, \qquad
//!    \omega' = \frac{2 \operatorname{Im} \bar p p'' - 2 (p \cdot p')\, \omega}{|p|^2}.\\]

use super::data::{ChainData, free_placement};
use super::spatial::Spatial;
use super::vector::Vec3;
use crate::error::{Error, Result};
use crate::record::check_values;

/// The instants whose polynomial gives the derivatives: exact to the degree six.
const SPAN: usize = 7;

/// The least cosine of half the turn between two instants, that of 90 degrees: the way between poses farther apart is a guess. Convention.
const HALF_TURN: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The names of a pose's values.
const NAMES: [&str; 7] = ["base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw"];

/// The motion of a base through poses at the instants of a run, with continuous accelerations.
///
/// Errors of the poses grow in the accelerations: by some 4 over the squared sample time, and ten times as much at both ends. So smooth
/// measured poses first.
///
/// ```
/// use flexure::manipulator::chain::BaseMotion;
///
/// // A lift that starts with 0.5 m/s^2.
/// let poses: Vec<[f64; 7]> = (0..=20).map(|k| [0.0, 0.0, 0.25 * (0.1 * k as f64).powi(2), 0.0, 0.0, 0.0, 1.0]).collect();
/// let lift = BaseMotion::new(&poses, 0.1)?;
/// let state = lift.at(1.23);
/// assert!((state.velocity[2] - 0.5 * 1.23).abs() < 1e-12 && (state.acceleration[2] - 0.5).abs() < 1e-11);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BaseMotion {
    /// At every instant each coordinate, its rate and its second rate, where one sample time is the unit of time.
    knots: Vec<[[f64; 3]; 7]>,
    sample_time: f64,
}

/// Where a base is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseState {
    /// Its position in the world, m, and its orientation: `[x, y, z, qx, qy, qz, qw]`, the quaternion of length one.
    pub pose: [f64; 7],
    /// Its linear and its angular velocity in its own axes, m/s and rad/s.
    pub velocity: [f64; 6],
    /// The derivatives of these velocities, m/s^2 and rad/s^2.
    pub acceleration: [f64; 6],
}

impl BaseMotion {
    /// Through `poses`, `sample_time` s apart: each the position in the world, m, and the orientation `[x, y, z, qx, qy, qz, qw]`. The
    /// quaternion's length does not matter, nor does its sign.
    ///
    /// # Errors
    /// [`Error::Data`] for a value that is not finite. [`Error::Parameter`] for a sample time that is not positive and finite, fewer than two
    /// poses, a quaternion of length zero, and a turn by more than 90 degrees from one instant to the next.
    pub fn new(poses: &[[f64; 7]], sample_time: f64) -> Result<Self> {
        if !(sample_time > 0.0 && sample_time.is_finite()) {
            let requirement = "positive and finite (in s)";
            return Err(Error::parameter("sample_time", sample_time, requirement));
        }
        if poses.len() < 2 {
            return Err(Error::parameter("the number of poses", poses.len() as f64, "2 or more"));
        }
        for (i, name) in NAMES.iter().enumerate() {
            check_values(name, &poses.iter().map(|pose| pose[i]).collect::<Vec<_>>())?;
        }
        let poses = unit_quaternions(poses)?;
        let span = SPAN.min(poses.len());
        let weights: Vec<Vec<[f64; 2]>> = (0..span).map(|at| weights(span, at)).collect();
        let knot = |k: usize| {
            let first = k.saturating_sub(SPAN / 2).min(poses.len() - span);
            let mut knot = poses[k].map(|value| [value, 0.0, 0.0]);
            for (pose, [once, twice]) in poses[first..].iter().zip(&weights[k - first]) {
                for (i, [value, rate, bend]) in knot.iter_mut().enumerate() {
                    let change = pose[i] - *value;
                    (*rate, *bend) = (*rate + once * change, *bend + twice * change);
                }
            }
            knot
        };
        Ok(BaseMotion {
            knots: (0..poses.len()).map(knot).collect(),
            sample_time,
        })
    }

    /// The number of poses.
    pub fn poses(&self) -> usize {
        self.knots.len()
    }

    /// The time between two poses, s.
    pub fn sample_time(&self) -> f64 {
        self.sample_time
    }

    /// Where the base is, and how it moves, at the time `t`, s; before the first pose and after the last, as there.
    pub fn at(&self, t: f64) -> BaseState {
        let time = (t / self.sample_time).clamp(0.0, (self.knots.len() - 1) as f64);
        let piece = (time as usize).min(self.knots.len() - 2);
        let s = time - piece as f64;
        let (from, to) = (&self.knots[piece], &self.knots[piece + 1]);
        let mut of = [[0.0; 7]; 3];
        for i in 0..7 {
            let [value, rate, bend] = between(&from[i], &to[i], s);
            of[0][i] = value;
            of[1][i] = rate / self.sample_time;
            of[2][i] = bend / (self.sample_time * self.sample_time);
        }
        state(&of)
    }

    /// Pose and velocity at every instant, by values.
    pub(super) fn columns(&self) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::new(); 13];
        for k in 0..self.knots.len() {
            let state = self.at(k as f64 * self.sample_time);
            let values = state.pose.into_iter().chain(state.velocity);
            columns
                .iter_mut()
                .zip(values)
                .for_each(|(column, value)| column.push(value));
        }
        columns
    }
}

impl BaseState {
    /// Lets the fixed base of a chain be there, and move so.
    pub(super) fn carry(&self, data: &mut ChainData) -> Result<()> {
        data.base.placement = free_placement(&self.pose)?;
        data.base.velocity = Spatial::from_slice(&self.velocity);
        data.base.acceleration = Spatial::from_slice(&self.acceleration);
        Ok(())
    }
}

/// The same poses with quaternions of length one, each with the sign that brings it near the one before.
fn unit_quaternions(poses: &[[f64; 7]]) -> Result<Vec<[f64; 7]>> {
    let mut near = Vec::with_capacity(poses.len());
    let mut before: Option<[f64; 4]> = None;
    for (k, &[x, y, z, a, b, c, d]) in poses.iter().enumerate() {
        let largest = [a, b, c, d]
            .into_iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        if largest == 0.0 {
            let name = format!("the length of the quaternion in row {}", k + 1);
            return Err(Error::parameter(name, 0.0, "more than zero"));
        }
        let scaled = [a, b, c, d].map(|value| value / largest);
        let length = scaled.iter().map(|value| value * value).sum::<f64>().sqrt();
        let mut unit = scaled.map(|value| value / length);
        if let Some(before) = before {
            let cosine: f64 = unit.iter().zip(before).map(|(a, b)| a * b).sum();
            if cosine.abs() < HALF_TURN {
                let name = format!("the turn of the base in degrees from row {k} to row {}", k + 1);
                let turn = 2.0 * cosine.abs().acos().to_degrees();
                return Err(Error::parameter(name, turn, "at most 90; shorten the sample time"));
            }
            unit = unit.map(|value| value * cosine.signum());
        }
        before = Some(unit);
        let [a, b, c, d] = unit;
        near.push([x, y, z, a, b, c, d]);
    }
    Ok(near)
}

/// The weights of `count` values, a unit of time apart, in the first and the second derivative of their polynomial at number `at`.
fn weights(count: usize, at: usize) -> Vec<[f64; 2]> {
    let offset = |k: usize| k as f64 - at as f64;
    let weight = |own: usize| {
        // The polynomial that is one there and zero at the others, to the square.
        let others = (0..count).filter(|&other| other != own);
        let [_, once, square] = others.fold([1.0, 0.0, 0.0], |[a, b, c], other| {
            let (root, gap) = (offset(other), offset(own) - offset(other));
            [-root * a / gap, (a - root * b) / gap, (b - root * c) / gap]
        });
        [once, 2.0 * square]
    };
    (0..count).map(weight).collect()
}

/// The polynomial of degree five between two knots with its two derivatives, at `s` from 0 to 1.
fn between([p, v, a]: &[f64; 3], [end, end_v, end_a]: &[f64; 3], s: f64) -> [f64; 3] {
    let (d, e, f) = (end - p - v - 0.5 * a, end_v - v - a, end_a - a);
    let [c3, c4, c5] = [
        10.0 * d - 4.0 * e + 0.5 * f,
        -15.0 * d + 7.0 * e - f,
        6.0 * d - 3.0 * e + 0.5 * f,
    ];
    [
        p + s * (v + s * (0.5 * a + s * (c3 + s * (c4 + s * c5)))),
        v + s * (a + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))),
        a + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
    ]
}

/// The state where coordinates, rates and second rates are these, of the quaternion before it is brought to length one.
fn state([pose, rate, bend]: &[[f64; 7]; 3]) -> BaseState {
    let (imaginary, real) = (Vec3::from_slice(&pose[3..]), pose[6]);
    let turned = |of: &[f64; 7]| {
        let part = Vec3::from_slice(&of[3..]);
        (part * real - imaginary * of[6] - imaginary.cross(part)) * 2.0
    };
    let dot = |of: &[f64; 7]| pose[3..].iter().zip(&of[3..]).map(|(a, b)| a * b).sum::<f64>();
    let square = dot(pose);
    let angular = turned(rate) * (1.0 / square);
    let angular_rate = (turned(bend) - angular * (2.0 * dot(rate))) * (1.0 / square);
    // Into the base's axes: v + 2 w (v x u) + 2 (v x u) x u, with the unit quaternion (u, w).
    let length = square.sqrt();
    let (u, w) = (imaginary * (1.0 / length), real / length);
    let own = |v: Vec3| {
        let across = v.cross(u) * 2.0;
        v + across * w + across.cross(u)
    };
    let linear = own(Vec3::from_slice(rate));
    let linear_rate = own(Vec3::from_slice(bend)) - angular.cross(linear);
    let spatial = |linear, angular| Spatial { linear, angular }.to_array();
    let mut pose = *pose;
    pose[3..].iter_mut().for_each(|value| *value /= length);
    BaseState {
        pose,
        velocity: spatial(linear, angular),
        acceleration: spatial(linear_rate, angular_rate),
    }
}
