//! Linear-quadratic Gaussian control about the reference.
//!
//! Deviations x from the model's motion of the reference follow the arm linearised at rest at the reference's elbow angle. The gain K
//! minimises \\(\sum x^T Q x + \tau^T R \tau\\); the deviation comes from the motors' encoders alone by the steady Kalman filter of the
//! same linearisation (Anderson & Moore 1990, Optimal Control, chapter 8), or from the loop's estimator (LQG with an extended filter:
//! Green & Sasiadek). Friction is left out of the linearisation: its slope at standstill applies to no motion.

use super::super::riccati::{gain, solve};
use super::super::{Controller, LinearisedArm, Measured};
use super::feedforward::wanted;
use crate::error::Result;
use crate::linalg::{Matrix, Vector};
use crate::manipulator::{Arm, State};

/// The elbow angles at which the arm is linearised: enough that neighbours differ by 3 % in inertia.
const NODES: usize = 25;

/// The weights of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// A link's angle that counts as much as the torque below, rad.
    pub angle: f64,
    /// A link's velocity that counts as much, rad/s.
    pub velocity: f64,
    /// N m.
    pub torque: f64,
    /// The standard deviation of an encoder's noise, rad, and of the torque's, N m, for the steady filter.
    pub noise: [f64; 2],
}

impl Default for Weights {
    fn default() -> Self {
        Weights {
            angle: 0.005,
            velocity: 0.05,
            torque: 5.0,
            noise: [1e-4, 1.0],
        }
    }
}

/// Gains at an elbow angle.
#[derive(Debug, Clone)]
struct Node {
    a: Matrix,
    b: Matrix,
    control: Matrix,
    filter: Matrix,
}

/// LQG control.
#[derive(Debug, Clone)]
pub struct Lqg {
    model: Arm,
    nodes: Vec<Node>,
    own_filter: bool,
    deviation: Vector,
    /// The last torque minus the reference's.
    last: Option<[f64; 2]>,
}

impl Lqg {
    /// With the steady filter of the linearisation.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) for weights that give no gains.
    pub fn new(model: Arm, weights: Weights, sample_time: f64) -> Result<Self> {
        let nodes = (0..NODES).map(|k| node(&model, &weights, sample_time, elbow_angle(k)));
        Ok(Lqg {
            model,
            nodes: nodes.collect::<Result<_>>()?,
            own_filter: true,
            deviation: Vector::zeros(8),
            last: None,
        })
    }

    /// With the state that the loop's estimator gives.
    #[must_use]
    pub fn on_estimates(self) -> Self {
        Lqg {
            own_filter: false,
            ..self
        }
    }
}

fn elbow_angle(node: usize) -> f64 {
    std::f64::consts::PI * node as f64 / (NODES - 1) as f64
}

fn node(model: &Arm, weights: &Weights, step: f64, q2: f64) -> Result<Node> {
    let mut parameters = *model.parameters();
    parameters.parts.friction = false;
    let rest = State {
        q: [0.0, q2],
        qm: [0.0, q2],
        ..State::default()
    };
    let (a, b) = LinearisedArm::new(&Arm::new(parameters)?, &rest, [0.0; 2]).sampled(step);
    let torque = weights.torque * weights.torque;
    let (angle, velocity) = (torque / weights.angle.powi(2), torque / weights.velocity.powi(2));
    // Motors have a weight of a thousandth: enough to be observable in the cost.
    let q = Matrix::from_diagonal(&Vector::from_column_slice(&[
        angle,
        angle,
        1e-3 * angle,
        1e-3 * angle,
        velocity,
        velocity,
        1e-3 * velocity,
        1e-3 * velocity,
    ]));
    let r = Matrix::identity(2, 2);
    let control = gain(&a, &b, &q, &r)?;
    let mut c = Matrix::zeros(2, 8);
    (c[(0, 2)], c[(1, 3)]) = (1.0, 1.0);
    let [encoder, torque] = weights.noise.map(|s| s * s);
    let process = &b * b.transpose() * torque + Matrix::identity(8, 8) * (1e-9 * torque);
    let readings = Matrix::identity(2, 2) * encoder;
    let p = solve(&a.transpose(), &c.transpose(), &process, &readings)?;
    let spread = &c * &p * c.transpose() + readings;
    let filter = match spread.lu().solve(&(&c * &p)) {
        Some(gain) => gain.transpose(),
        None => Matrix::zeros(8, 2),
    };
    Ok(Node { a, b, control, filter })
}

impl Controller for Lqg {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let [now, held] = wanted(&self.model, measured);
        let bent = measured.reference[1].value().rem_euclid(std::f64::consts::TAU);
        let bent = bent.min(std::f64::consts::TAU - bent);
        let nearest = (bent / std::f64::consts::PI * (NODES - 1) as f64).round() as usize;
        let node = &self.nodes[nearest.min(NODES - 1)];
        let reference = now.state().to_array();
        if self.own_filter {
            if let Some(last) = self.last {
                self.deviation = &node.a * &self.deviation + &node.b * Vector::from_column_slice(&last);
            }
            let read = [0, 1].map(|i| measured.encoders.qm[i] - reference[2 + i] - self.deviation[2 + i]);
            self.deviation += &node.filter * Vector::from_column_slice(&read);
        } else {
            let state = measured.state.to_array();
            self.deviation = Vector::from_fn(8, |i, _| state[i] - reference[i]);
        }
        let back = &node.control * &self.deviation;
        let own = [-back[0], -back[1]];
        self.last = Some(own);
        [0, 1].map(|i| held.torque[i] + own[i])
    }

    fn reset(&mut self) {
        self.deviation = Vector::zeros(8);
        self.last = None;
    }
}
