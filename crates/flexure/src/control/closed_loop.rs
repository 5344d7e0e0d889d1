//! The loop: a plant, its encoders, an estimator, a controller, and the delays and limits between them.
//!
//! At instant k the encoders are read, with noise and rounded to their counts; the estimator computes a state from the reading and from the
//! torque that has acted since; the controller's torque, limited, is held from instant k + delay on for one sample time.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::{Jet, Trajectory, inverse_motion};
use crate::error::{Error, Result, Stopped};
use crate::interrupt;
use crate::manipulator::{Arm, State};
use crate::record::Record;
use crate::simulation::{Dop853, Sampling, Tolerances};
use crate::text::decimal;

/// What is controlled: two joints with their motors.
pub trait Plant: Sync {
    /// The derivative of `[q1, q2, qm1, qm2, q1', q2', qm1', qm2']` under these motor torques.
    fn derivative(&self, x: &[f64; 8], torque: [f64; 2]) -> [f64; 8];

    /// The state in which the plant moves as this reference does.
    fn start(&self, reference: [Jet; 2]) -> State;
}

impl Plant for Arm {
    fn derivative(&self, x: &[f64; 8], torque: [f64; 2]) -> [f64; 8] {
        Arm::derivative(self, x, torque)
    }

    fn start(&self, reference: [Jet; 2]) -> State {
        inverse_motion(self, reference).map_or_else(
            || State {
                q: reference.map(|q| q.value()),
                qm: reference.map(|q| q.value()),
                ..State::default()
            },
            |motion| motion.state(),
        )
    }
}

/// The encoders' readings, rad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Encoders {
    /// The links' readings.
    pub q: [f64; 2],
    /// The motors' readings.
    pub qm: [f64; 2],
}

/// What a controller knows at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The instant, s.
    pub t: f64,
    /// The sample time, s.
    pub sample_time: f64,
    /// The state as the estimator gives it.
    pub state: State,
    /// The encoders' readings.
    pub encoders: Encoders,
    /// The wanted link angles with their derivatives.
    pub reference: [Jet; 2],
}

/// Measured values in, torque out.
pub trait Controller: Send {
    /// The motor torques to be held over the sample time, N m.
    fn torque(&mut self, measured: &Measured) -> [f64; 2];

    /// Forgets what it has learnt, for another run.
    fn reset(&mut self);
}

/// The inputs of an estimator at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// The assumed initial state: at rest at the reference's start.
    pub start: State,
    /// The true state, for comparisons that know it.
    pub truth: State,
    /// The encoders' readings.
    pub encoders: Encoders,
    /// The torque that acted over the sample time before, N m.
    pub torque: [f64; 2],
    /// The sample time, s; none at the first instant.
    pub step: Option<f64>,
}

/// Computes a state from the encoders' readings.
pub trait Estimator: Send {
    /// The state at an instant; an instant without a sample time is the first of a run.
    fn estimate(&mut self, moment: &Moment) -> State;
}

/// The true state, as no sensor gives it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Exact;

impl Estimator for Exact {
    fn estimate(&mut self, moment: &Moment) -> State {
        moment.truth
    }
}

/// Encoders' readings, and their differences through a low-pass filter of the first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Differences {
    /// The filter's cut-off, Hz.
    cut_off: f64,
    /// Whether only the motors have encoders; the links are then assumed to move with them.
    motors_alone: bool,
    last: Encoders,
    velocity: [[f64; 2]; 2],
}

impl Differences {
    /// A filter with this cut-off in Hz.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless the cut-off is positive and finite.
    pub fn new(cut_off: f64, motors_alone: bool) -> Result<Self> {
        if !(cut_off > 0.0 && cut_off.is_finite()) {
            return Err(Error::parameter("cut_off", cut_off, "positive and finite (in Hz)"));
        }
        Ok(Differences {
            cut_off,
            motors_alone,
            last: Encoders::default(),
            velocity: [[0.0; 2]; 2],
        })
    }
}

impl Estimator for Differences {
    fn estimate(&mut self, moment: &Moment) -> State {
        let Encoders { q, qm } = moment.encoders;
        let now = Encoders {
            q: if self.motors_alone { qm } else { q },
            qm,
        };
        match moment.step {
            None => self.velocity = [moment.start.dq, moment.start.dqm],
            Some(step) => {
                let keep = (-std::f64::consts::TAU * self.cut_off * step).exp();
                let pairs = [(now.q, self.last.q), (now.qm, self.last.qm)];
                for (velocity, (now, last)) in self.velocity.iter_mut().zip(pairs) {
                    *velocity = [0, 1].map(|i| keep * velocity[i] + (1.0 - keep) * (now[i] - last[i]) / step);
                }
            }
        }
        self.last = now;
        let [dq, dqm] = self.velocity;
        State { q: now.q, qm, dq, dqm }
    }
}

/// How a loop runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopOptions {
    /// The instants; the reference is at rest after its end.
    pub sampling: Sampling,
    /// The samples from a reading until its torque acts; 0 to 100.
    pub delay: usize,
    /// The largest torque of either motor, N m; positive, infinite for none.
    pub torque_limit: [f64; 2],
    /// The encoders' counts, rad; not negative, 0 for none.
    pub quantum: f64,
    /// The standard deviation of the encoders' noise, rad; not negative.
    pub encoder_noise: f64,
    /// The standard deviation of the noise on either motor's torque, new at every instant, N m; not negative.
    pub torque_noise: f64,
    /// The seed of all noise.
    pub seed: u64,
    /// The spread of the plant's initial state around the reference's: standard deviations of angles (rad) and velocities (rad/s).
    pub initial_spread: [f64; 2],
    /// The accuracy of the plant's integration.
    pub tolerances: Tolerances,
}

impl LoopOptions {
    /// An ideal loop: no delay, no limits, no noise.
    ///
    /// # Errors
    /// Those of [`Sampling::new`].
    pub fn new(duration: f64, sample_time: f64) -> Result<Self> {
        Ok(LoopOptions {
            sampling: Sampling::new(duration, sample_time)?,
            delay: 0,
            torque_limit: [f64::INFINITY; 2],
            quantum: 0.0,
            encoder_noise: 0.0,
            torque_noise: 0.0,
            seed: 1,
            initial_spread: [0.0; 2],
            tolerances: Tolerances::default(),
        })
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value outside its range.
    pub fn check(&self) -> Result<()> {
        let sizes = [
            ("encoder_counts", self.quantum, "not negative and finite (in rad)"),
            ("encoder_noise", self.encoder_noise, "not negative and finite (in rad)"),
            ("torque_noise", self.torque_noise, "not negative and finite (in N m)"),
            (
                "initial_angle",
                self.initial_spread[0],
                "not negative and finite (in rad)",
            ),
            (
                "initial_velocity",
                self.initial_spread[1],
                "not negative and finite (in rad/s)",
            ),
        ];
        for (name, value, requirement) in sizes {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, requirement));
            }
        }
        if let Some(&limit) = self.torque_limit.iter().find(|limit| !(**limit > 0.0)) {
            return Err(Error::parameter("torque_limit", limit, "positive (in N m)"));
        }
        if self.delay > 100 {
            return Err(Error::parameter("delay", self.delay as f64, "at most 100 (in samples)"));
        }
        self.tolerances.check()
    }
}

/// What has happened at every instant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// The instants, s.
    pub t: Vec<f64>,
    /// The torque that acts from the instant on, N m, without its noise.
    pub torque: Vec<[f64; 2]>,
    /// The true state.
    pub truth: Vec<State>,
    /// The encoders' readings.
    pub readings: Vec<Encoders>,
    /// The state that the controller was given.
    pub estimate: Vec<State>,
    /// The wanted link angles, rad.
    pub reference: Vec<[f64; 2]>,
}

impl Run {
    /// The record: `t, tau1, tau2, q1, q2, qm1, qm2` as a log has them, then the reference `r1, r2`, the true `true_q1` to
    /// `true_dqm2` and the estimated `estimated_q1` to `estimated_dqm2`; in s, N m, rad and rad/s.
    ///
    /// # Errors
    /// None for a run that [`run_loop`] made.
    pub fn record(&self) -> Result<Record> {
        let pair = |name: &str, of: &dyn Fn(usize) -> [f64; 2]| {
            let all: Vec<[f64; 2]> = (0..self.t.len()).map(of).collect();
            [0, 1].map(|j| {
                (
                    format!("{name}{}", j + 1),
                    all.iter().map(|v| v[j]).collect::<Vec<f64>>(),
                )
            })
        };
        let mut columns = vec![("t".to_owned(), self.t.clone())];
        columns.extend(pair("tau", &|k| self.torque[k]));
        columns.extend(pair("q", &|k| self.readings[k].q));
        columns.extend(pair("qm", &|k| self.readings[k].qm));
        columns.extend(pair("r", &|k| self.reference[k]));
        for (prefix, states) in [("true", &self.truth), ("estimated", &self.estimate)] {
            columns.extend(pair(&format!("{prefix}_q"), &|k| states[k].q));
            columns.extend(pair(&format!("{prefix}_qm"), &|k| states[k].qm));
            columns.extend(pair(&format!("{prefix}_dq"), &|k| states[k].dq));
            columns.extend(pair(&format!("{prefix}_dqm"), &|k| states[k].dqm));
        }
        Record::new(columns)
    }
}

/// Runs a loop from the reference's start.
///
/// # Errors
/// Those of [`LoopOptions::check`] and [`Dop853::advance`]; [`Error::Parameter`] for a controller whose torque is not finite.
pub fn run_loop(
    plant: &dyn Plant,
    controller: &mut dyn Controller,
    estimator: &mut dyn Estimator,
    trajectory: &dyn Trajectory,
    options: &LoopOptions,
) -> Result<Run> {
    run_loop_watched(plant, controller, estimator, trajectory, options, &mut |_| {
        ControlFlow::Continue(())
    })
}

impl LoopOptions {
    /// What the encoders read of this state: with noise, in counts.
    fn read(&self, truth: &State, normal: &mut impl FnMut(f64) -> f64) -> Encoders {
        let mut read = |angle: f64| {
            let noisy = angle + normal(self.encoder_noise);
            match self.quantum > 0.0 {
                true => (noisy / self.quantum).round() * self.quantum,
                false => noisy,
            }
        };
        Encoders {
            q: truth.q.map(&mut read),
            qm: truth.qm.map(&mut read),
        }
    }
}

/// Like [`run_loop`]; `watch` is called with the time at every instant, and stops by `Break`.
///
/// # Errors
/// Those of [`run_loop`], and [`Error::Stopped`].
pub fn run_loop_watched(
    plant: &dyn Plant,
    controller: &mut dyn Controller,
    estimator: &mut dyn Estimator,
    trajectory: &dyn Trajectory,
    options: &LoopOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Run> {
    options.check()?;
    controller.reset();
    let start = plant.start(trajectory.at(0.0));
    let mut rng = Pcg64::seed_from_u64(options.seed);
    let mut normal = |std: f64| -> f64 {
        let draw: f64 = StandardNormal.sample(&mut rng);
        std * draw
    };
    let [angle, velocity] = options.initial_spread;
    let spread = [angle, angle, angle, angle, velocity, velocity, velocity, velocity];
    let x = start.to_array();
    let x: [f64; 8] = std::array::from_fn(|i| x[i] + normal(spread[i]));
    let step = options.sampling.sample_time();
    let mut solver = Dop853::new(0.0, x, options.tolerances)?.with_speeds_from(4);
    let mut queue: VecDeque<[f64; 2]> = std::iter::repeat_n([0.0; 2], options.delay).collect();
    let mut run = Run::default();
    let mut acting = [0.0; 2];
    for k in 0..options.sampling.rows() {
        let t = options.sampling.instant(k);
        if watch(t).is_break() || interrupt::requested() {
            return Err(Error::Stopped(Stopped::Simulating { time: t }));
        }
        let truth = State::from_array(*solver.x());
        let reading = options.read(&truth, &mut normal);
        let estimate = estimator.estimate(&Moment {
            start,
            truth,
            encoders: reading,
            torque: acting,
            step: (k > 0).then_some(step),
        });
        let reference = trajectory.at(t);
        let torque = controller.torque(&Measured {
            t,
            sample_time: step,
            state: estimate,
            encoders: reading,
            reference,
        });
        check_torque(torque, t)?;
        queue.push_back([0, 1].map(|i| torque[i].clamp(-options.torque_limit[i], options.torque_limit[i])));
        acting = queue.pop_front().unwrap_or_default();
        run.t.push(t);
        run.torque.push(acting);
        run.truth.push(truth);
        run.readings.push(reading);
        run.estimate.push(estimate);
        run.reference.push(reference.map(|r| r.value()));
        if k + 1 < options.sampling.rows() {
            let held = acting.map(|torque| torque + normal(options.torque_noise));
            solver.restart();
            let derivative = |_: f64, x: &[f64; 8]| plant.derivative(x, held);
            solver.advance(&derivative, options.sampling.instant(k + 1), watch)?;
        }
    }
    Ok(run)
}

/// Refuses a torque of the controller at time t, s, that is not finite.
fn check_torque(torque: [f64; 2], t: f64) -> Result<()> {
    let wrong = torque.into_iter().find(|torque| !torque.is_finite());
    wrong.map_or(Ok(()), |torque| {
        let name = format!("the controller's torque at t = {} s", decimal(t));
        Err(Error::parameter(name, torque, "finite"))
    })
}
