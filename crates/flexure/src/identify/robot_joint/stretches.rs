//! The motor's inertia of a flexible joint from stretches of its simulated motion.
//!
//! The record is cut into stretches of a few periods of the joint's resonance. Each one is simulated under the recorded torque, with curves in
//! forms and an initial state of its own, and the errors of both angles are minimised together (multiple shooting; Bock 1983). Unlike the
//! equations of motion, the simulation has no noise in its columns, and a body that sticks needs no friction as a function of velocity. It does need
//! forms: the free curves still come from the equations of motion.
//!
//! Errors of motor and link are weighted by the inverse of their mean products. Standard errors are those of the jackknife over stretches, so that they
//! hold for errors of any correlation within a stretch (Cameron & Miller 2015, section VI.B).

use super::forms::ParametricCurve;
use super::limits::{
    FEWEST_IN_RUN, IDLE_ROUNDS, LEAST_SUBSTEPS, MOST_SUBSTEPS, PERIODS_OF_RUN, POLISH_DIFFERENCE, POLISH_ROUNDS,
    POLISH_SETTLED, SIMULATED_SAMPLES, SLOPE_STEP, SOFTENED, START_ROUNDS, STEEPEST_STEP,
};
use super::outcome::Estimated;
use crate::linalg::Matrix;
use crate::linear::correlation::mean_square;
use crate::parallel;
use std::f64::consts::TAU;

/// A joint's log, with the link's angle on the motor's clock.
pub(super) struct Logged<'a> {
    pub motor: &'a [f64],
    pub link: &'a [f64],
    pub velocities: [&'a [f64]; 2],
    /// The torque that acts from each sample to the next.
    pub torque: &'a [f64],
    /// The known torque that the link bears besides, from each sample to the next.
    pub load: Vec<f64>,
    pub step: f64,
}

impl Logged<'_> {
    fn deflection(&self) -> Vec<f64> {
        self.motor.iter().zip(self.link).map(|(m, q)| m - q).collect()
    }
}

/// A joint with curves in forms.
#[derive(Clone)]
pub(super) struct FormedJoint {
    pub inertias: [f64; 2],
    /// The damping beside the spring, if there is any.
    pub damping: Option<f64>,
    /// The factors of cos q and sin q in the torque on the link, if gravity acts.
    pub gravity: Option<[f64; 2]>,
    pub stiffness: ParametricCurve,
    pub friction: ParametricCurve,
    pub motor_friction: Option<ParametricCurve>,
    /// The distance over which the link's dry friction turns after a reversal, if it does not turn at once.
    pub turns_over: Option<f64>,
}

/// The number of the motor's inertia among the inertias and among the parameters.
const MOTOR: usize = 0;

/// The angles and velocities of motor and link.
pub(super) type State = [f64; 4];

impl FormedJoint {
    /// The parameters: inertias, damping, gravity and the curves' factors.
    fn parameters(&mut self) -> Vec<&mut f64> {
        let motor_friction = self.motor_friction.iter_mut().flat_map(|curve| &mut curve.factors);
        let curves = self.stiffness.factors.iter_mut().chain(&mut self.friction.factors);
        let others = self.inertias.iter_mut().chain(&mut self.damping);
        let others = others.chain(self.gravity.iter_mut().flatten());
        others.chain(curves).chain(motor_friction).collect()
    }

    /// The change of each parameter that changes a torque, or an inertia, by about itself; 0 for the factors of terms that the simulation
    /// hardly shows, which stay.
    fn sizes(&self, log: &Logged) -> Vec<f64> {
        let torque = mean_square(log.torque).sqrt();
        let [motor, link] = log.velocities;
        let twist: Vec<f64> = motor.iter().zip(link).map(|(m, q)| m - q).collect();
        let mut sizes = self.inertias.to_vec();
        sizes.extend(
            self.damping
                .map(|_| torque / mean_square(&twist).sqrt().max(f64::MIN_POSITIVE)),
        );
        sizes.extend(self.gravity.iter().flatten().map(|_| torque));
        sizes.extend(self.stiffness.factor_sizes(&log.deflection(), torque));
        sizes.extend(self.friction.factor_sizes(link, torque));
        let of_motor = self.motor_friction.as_ref();
        sizes.extend(of_motor.map_or(Vec::new(), |curve| curve.factor_sizes(motor, torque)));
        sizes
    }

    /// The angles at each sample under this torque and load. Leapfrog steps; in each one dry friction takes what it can from the velocity, so that a body
    /// that sticks is at rest.
    pub fn angles(
        &self,
        stretch: &Stretch,
        drive: impl Iterator<Item = [f64; 2]>,
        step: f64,
        substeps: usize,
    ) -> Vec<[f64; 2]> {
        let h = step / substeps as f64;
        let [mut motor, mut link, mut v_motor, mut v] = stretch.start;
        let mut turned = stretch.turned;
        // Dry friction is proportional to the velocity within a small width, which is solved for.
        let after = |v: f64, force: f64, dry: f64, width: f64, inertia: f64| {
            let (free, taken) = (v + h * force / inertia, h * dry.max(0.0) / inertia);
            free - (free * taken / (taken + width).max(f64::MIN_POSITIVE)).clamp(-taken, taken)
        };
        let width = |curve: &ParametricCurve| SOFTENED * curve.width;
        let widths = [self.motor_friction.as_ref().map_or(0.0, width), width(&self.friction)];
        let mut angles = Vec::new();
        for [torque, load] in drive {
            angles.push([motor, link]);
            for _ in 0..substeps {
                (motor, link) = (motor + 0.5 * h * v_motor, link + 0.5 * h * v);
                let spring = self.stiffness.value(motor - link) + self.damping.map_or(0.0, |c| c * (v_motor - v));
                let gravity = self.gravity.map_or(0.0, |[c, s]| c * link.cos() + s * link.sin());
                let [mut dry, mut other] = self.friction.dry_and_other(v);
                if let Some(distance) = self.turns_over {
                    turned = (turned + h * v).clamp(-distance, distance);
                    other += dry * turned / distance;
                    dry = 0.0;
                }
                let at_motor = self.motor_friction.as_ref();
                let [dry_motor, other_motor] = at_motor.map_or([0.0; 2], |curve| curve.dry_and_other(v_motor));
                v_motor = after(
                    v_motor,
                    torque - spring - other_motor,
                    dry_motor,
                    widths[0],
                    self.inertias[0],
                );
                v = after(v, spring - gravity - load - other, dry, widths[1], self.inertias[1]);
                (motor, link) = (motor + 0.5 * h * v_motor, link + 0.5 * h * v);
            }
        }
        angles
    }

    /// The steps a sample that follow the steepest friction apart from dry one.
    pub fn substeps(&self, log: &Logged) -> usize {
        let rate = |curve: &ParametricCurve, v: &[f64], inertia: f64| {
            let near = SLOPE_STEP * v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let [above, below] = [near, -near].map(|v| curve.dry_and_other(v)[1]);
            (above - below) / (2.0 * near * inertia)
        };
        let [motor, link] = log.velocities;
        let of_motor = self.motor_friction.as_ref();
        let of_motor = of_motor.map_or(0.0, |curve| rate(curve, motor, self.inertias[0]));
        let steepest = rate(&self.friction, link, self.inertias[1]).max(of_motor);
        ((steepest * log.step / STEEPEST_STEP).ceil() as usize).clamp(LEAST_SUBSTEPS, MOST_SUBSTEPS)
    }

    /// The samples of a stretch, for a deflection of this root mean square.
    fn length(&self, log: &Logged, deflection: f64) -> usize {
        let stiffness = self.stiffness.value(deflection) / deflection;
        let resonance = (stiffness * (1.0 / self.inertias[0] + 1.0 / self.inertias[1])).sqrt();
        ((PERIODS_OF_RUN * TAU / resonance / log.step) as usize).max(FEWEST_IN_RUN)
    }

    /// The motor's inertia with which the simulated stretches are nearest to the log; `None` if these do not determine it.
    pub fn simulated_inertia(&self, log: &Logged) -> Option<Estimated> {
        let (search, stretches) = self.search(log);
        let nearest = search.nearest(self.clone(), stretches, POLISH_ROUNDS)?;
        Some(nearest.motor_inertia)
    }

    /// The search for the joint whose simulated stretches are nearest to the log, with these stretches.
    pub fn search<'a>(&self, log: &'a Logged<'a>) -> (Search<'a>, Vec<Stretch>) {
        let deflection = mean_square(&log.deflection()).sqrt();
        let length = self.length(log, deflection);
        let count = log.torque.len() / length;
        let every = (count * length).div_ceil(SIMULATED_SAMPLES).max(1);
        let start = |first: usize| {
            let [motor, link] = log.velocities;
            [log.motor[first], log.link[first], motor[first], link[first]]
        };
        let stretches = (0..count).step_by(every).map(|i| Stretch {
            first: i * length,
            start: start(i * length),
            turned: 0.0,
        });
        let velocity = mean_square(log.velocities[0]).sqrt();
        let search = Search {
            log,
            length,
            substeps: self.substeps(log),
            sizes: self.sizes(log),
            state_sizes: [deflection, deflection, velocity, velocity],
        };
        (search, stretches.collect())
    }
}

/// A stretch: its first sample, its initial state, and how far the friction has turned there.
#[derive(Clone, Copy)]
pub(super) struct Stretch {
    pub first: usize,
    pub start: State,
    pub turned: f64,
}

/// The joint with the smallest errors that a search found.
pub(super) struct Nearest {
    pub joint: FormedJoint,
    pub stretches: Vec<Stretch>,
    pub motor_inertia: Estimated,
    /// The size of the errors, and what makes them uncorrelated and of size one.
    pub size: f64,
    pub white: Whitening,
}

/// The equations of a Gauss-Newton step in one stretch.
struct Local {
    /// The products of the derivatives, and those with the errors, without what the initial state explains.
    products: Matrix,
    moments: Matrix,
    /// The step of the initial state, and its change with each parameter's step.
    state: Matrix,
    with_parameters: Matrix,
    /// The errors of motor and link.
    errors: Vec<[f64; 2]>,
}

/// The equations of all stretches together.
struct Total {
    products: Matrix,
    moments: Matrix,
}

impl Total {
    /// `None` without stretches.
    fn new(locals: &[Local]) -> Option<Total> {
        let n = locals.first()?.moments.len();
        let (mut products, mut moments) = (Matrix::zeros(n, n), Matrix::zeros(n, 1));
        for local in locals {
            products += &local.products;
            moments += &local.moments;
        }
        Some(Total { products, moments })
    }

    /// The step of the parameters, in their sizes.
    fn step(&self) -> Option<Matrix> {
        Some(-self.products.clone().cholesky()?.solve(&self.moments))
    }

    /// The standard error of a parameter after this step, in its size: the jackknife leaves out each stretch in turn.
    fn error(&self, locals: &[Local], step: &Matrix, parameter: usize) -> Option<f64> {
        let mut variance = 0.0;
        for local in locals {
            let without = Total {
                products: &self.products - &local.products,
                moments: &self.moments - &local.moments,
            };
            variance += (without.step()?[parameter] - step[parameter]).powi(2);
        }
        let share = 1.0 - 1.0 / locals.len() as f64;
        Some((share * variance).sqrt())
    }
}

/// The lower triangular matrix that makes the errors of motor and link uncorrelated and of size one.
pub(super) type Whitening = [[f64; 2]; 2];

pub(super) struct Search<'a> {
    log: &'a Logged<'a>,
    length: usize,
    substeps: usize,
    sizes: Vec<f64>,
    state_sizes: State,
}

impl Search<'_> {
    /// The free parameters.
    fn free(&self) -> Vec<usize> {
        (0..self.sizes.len()).filter(|&k| self.sizes[k] > 0.0).collect()
    }

    /// The whitened errors of a stretch.
    pub fn errors(&self, joint: &FormedJoint, stretch: &Stretch, white: &Whitening) -> Vec<f64> {
        let range = stretch.first..stretch.first + self.length;
        let drive = range.clone().map(|i| [self.log.torque[i], self.log.load[i]]);
        let angles = joint.angles(stretch, drive, self.log.step, self.substeps);
        let error = |(i, [motor, link]): (usize, [f64; 2])| {
            let (motor, link) = (motor - self.log.motor[i], link - self.log.link[i]);
            [white[0][0] * motor, white[1][0] * motor + white[1][1] * link]
        };
        range.zip(angles).flat_map(error).collect()
    }

    /// The equations of a stretch; `None` if the joint runs away.
    fn local(&self, joint: &FormedJoint, stretch: &Stretch, white: &Whitening) -> Option<Local> {
        let errors = self.errors(joint, stretch, white);
        let rows = errors.len();
        let quotient = |moved: Vec<f64>| {
            let rates = moved
                .iter()
                .zip(&errors)
                .map(|(there, here)| (there - here) / POLISH_DIFFERENCE);
            rates.collect::<Vec<f64>>()
        };
        let by_state = |k: usize| {
            let mut moved = *stretch;
            moved.start[k] += POLISH_DIFFERENCE * self.state_sizes[k];
            quotient(self.errors(joint, &moved, white))
        };
        let by_parameter = |k: usize| {
            let mut moved = joint.clone();
            *moved.parameters()[k] += POLISH_DIFFERENCE * self.sizes[k];
            quotient(self.errors(&moved, stretch, white))
        };
        let free = self.free();
        let a = Matrix::from_vec(rows, 4, (0..4).flat_map(by_state).collect());
        let b = Matrix::from_vec(rows, free.len(), free.iter().flat_map(|&k| by_parameter(k)).collect());
        let e = Matrix::from_vec(rows, 1, errors);
        let inverse = (a.transpose() * &a).cholesky()?;
        let state = inverse.solve(&(a.transpose() * &e));
        let with_parameters = inverse.solve(&(a.transpose() * &b));
        let b = b - &a * &with_parameters;
        let plain = |row: &[f64]| {
            let motor = row[0] / white[0][0];
            [motor, (row[1] - white[1][0] * motor) / white[1][1]]
        };
        e.iter().all(|e| e.is_finite()).then(|| Local {
            products: b.transpose() * &b,
            // The columns of b have no part of the initial state, so the errors need not lose theirs.
            moments: b.transpose() * &e,
            state,
            with_parameters,
            errors: e.as_slice().chunks_exact(2).map(plain).collect(),
        })
    }

    /// The equations of all stretches; `None` if the joint runs away in one of them.
    fn locals(&self, joint: &FormedJoint, stretches: &[Stretch], white: &Whitening) -> Option<Vec<Local>> {
        let locals = parallel::map(stretches.len(), |i| self.local(joint, &stretches[i], white));
        locals.into_iter().collect()
    }

    /// Moves the initial states by what the errors say, and for this step of the parameters.
    fn moved(&self, stretches: &[Stretch], locals: &[Local], change: &[f64]) -> Vec<Stretch> {
        let moved = |(stretch, local): (&Stretch, &Local)| {
            let mut moved = *stretch;
            for k in 0..4 {
                let with: f64 = (change.iter().enumerate())
                    .map(|(u, change)| local.with_parameters[(k, u)] * change)
                    .sum();
                moved.start[k] -= (local.state[k] + with) * self.state_sizes[k];
            }
            moved
        };
        stretches.iter().zip(locals).map(moved).collect()
    }

    /// The joint by Gauss-Newton steps from this joint and these states: that with the smallest determinant of the errors' mean products (the
    /// likelihood of errors of unknown size; Bard 1974).
    pub fn nearest(&self, mut joint: FormedJoint, mut stretches: Vec<Stretch>, rounds: usize) -> Option<Nearest> {
        let free = self.free();
        let mut white = [[1.0, 0.0], [0.0, 1.0]];
        // First the initial states alone.
        for _ in 0..START_ROUNDS {
            let locals = self.locals(&joint, &stretches, &white)?;
            white = whitening(&locals)?;
            stretches = self.moved(&stretches, &locals, &[]);
        }
        let (mut best, mut smallest, mut since) = (None, f64::INFINITY, 0);
        for _ in 0..rounds {
            // After a step that is too long, the joint may run away.
            let Some(locals) = self.locals(&joint, &stretches, &white) else {
                break;
            };
            let Some(total) = Total::new(&locals) else { break };
            let (Some(step), Some(next)) = (total.step(), whitening(&locals)) else {
                break;
            };
            white = next;
            let size = size(&locals);
            since += 1;
            if size < (1.0 - POLISH_SETTLED) * smallest {
                since = 0;
            }
            if size < smallest {
                let Some(error) = total.error(&locals, &step, MOTOR) else {
                    break;
                };
                smallest = size;
                best = Some(Nearest {
                    joint: joint.clone(),
                    stretches: stretches.clone(),
                    motor_inertia: Estimated {
                        value: joint.inertias[MOTOR],
                        standard_error: error * self.sizes[MOTOR],
                    },
                    size,
                    white,
                });
            }
            if since == IDLE_ROUNDS {
                break;
            }
            stretches = self.moved(&stretches, &locals, step.as_slice());
            let mut parameters = joint.parameters();
            for (&k, change) in free.iter().zip(&step) {
                *parameters[k] += change * self.sizes[k];
            }
        }
        best
    }
}

/// The sums of the products of the errors of motor and link: of the motor with itself, of both, of the link with itself.
fn products(locals: &[Local]) -> [f64; 3] {
    let errors = locals.iter().flat_map(|local| &local.errors);
    errors.fold([0.0; 3], |[motor, both, link], [m, l]| {
        [motor + m * m, both + m * l, link + l * l]
    })
}

/// The size of the errors: the root of the determinant of their products.
fn size(locals: &[Local]) -> f64 {
    let [motor, both, link] = products(locals);
    (motor * link - both * both).max(0.0).sqrt()
}

/// The whitening of errors.
fn whitening(locals: &[Local]) -> Option<Whitening> {
    let [motor, both, link] = products(locals);
    let rest = link - both * both / motor;
    (motor > 0.0 && rest > 0.0).then(|| {
        [
            [1.0 / motor.sqrt(), 0.0],
            [-both / motor / rest.sqrt(), 1.0 / rest.sqrt()],
        ]
    })
}
