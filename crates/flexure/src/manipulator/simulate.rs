//! An arm in time: from its state at the start and what drives it to a record.

use std::ops::ControlFlow;

use super::arm::{Arm, Model};
use super::{State, checks};
use crate::error::{ArmError, Error, Result};
use crate::record::Record;
use crate::simulation::{Dop853, Sampling, Tolerances, run_continuous, run_held};

/// What moves an arm.
#[derive(Clone, Copy)]
pub enum Drive<'a> {
    /// Motor torques in N m, one sample a row for each joint, held until the next row.
    Held([&'a [f64]; 2]),
    /// Motor torques in N m as a continuous function of the time in s.
    ///
    /// The record shows them at its instants. Where a torque jumps, use [`Drive::Held`].
    Torque(&'a (dyn Fn(f64) -> [f64; 2] + Sync)),
    /// Deflections `d = qm - q` in rad, one sample a row for each joint, held until the next row by
    /// ideally stiff servos of the motors.
    ///
    /// The links then follow `M q'' + S q'' + C q' + f(q') = kappa(d)`; the motors move with them,
    /// `qm = q + d`. The recorded torque is what the motors deliver within the hold, just after the
    /// jump of `d`: `tau = S^T q'' + Jm q'' + kappa(d)`, without the impulse of the jump itself.
    /// With one joint locked and viscous friction alone this is exactly a Hammerstein system with
    /// the nonlinearity `kappa` and the pole `exp(-g6 T / M)`.
    ///
    /// A locked joint keeps its initial deflection, whatever is commanded. A rigid arm has none.
    Deflection([&'a [f64]; 2]),
    /// Motor angles in rad that servos follow, one sample a row for each joint: the torque
    /// `kp (reference - qm) - kd qm'` of every row is held until the next.
    ///
    /// A rigid arm's motor angles are those of its links.
    Servo {
        /// The references.
        reference: [&'a [f64]; 2],
        /// The gains `[kp, kd]` of each joint, N m/rad and N m s/rad.
        gains: [[f64; 2]; 2],
    },
}

/// How an arm is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulationOptions {
    /// The instants of the record.
    pub sampling: Sampling,
    /// The state at time 0; the motors' part is not used by a rigid arm, nor, where deflections are
    /// commanded, by joints that are not locked.
    pub initial: State,
    /// The accuracy.
    pub tolerances: Tolerances,
}

impl SimulationOptions {
    /// From rest at zero, with the default tolerances, for `duration` s in steps of `sample_time` s.
    ///
    /// # Errors
    /// Those of [`Sampling::new`].
    pub fn new(duration: f64, sample_time: f64) -> Result<Self> {
        Ok(SimulationOptions {
            sampling: Sampling::new(duration, sample_time)?,
            initial: State::default(),
            tolerances: Tolerances::default(),
        })
    }
}

/// Simulates an arm.
///
/// The record has the columns `t, tau1, tau2, q1, q2, qm1, qm2, dq1, dq2, dqm1, dqm2` (a rigid arm's
/// has no `qm`, `dqm`), one row an instant from 0 on, in s, N m, rad and rad/s; the torque of a row
/// is held until the next (except for [`Drive::Torque`]).
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch` or `NonFinite` for samples that do not fit the instants,
/// [`Error::Parameter`] for a wrong tolerance or initial state, [`Error::Arm`] if
/// `M + S` is singular where deflections are commanded, and [`Error::Simulation`].
pub fn simulate(arm: &Arm, drive: &Drive, options: &SimulationOptions) -> Result<Record> {
    simulate_watched(arm, drive, options, &mut |_| ControlFlow::Continue(()))
}

/// Like [`simulate()`], calling `watch` with the simulated time at every instant (and within long
/// intervals); it shows progress, and stops the simulation by returning `Break`.
///
/// # Errors
/// Those of [`simulate()`], and [`Error::Stopped`].
pub fn simulate_watched(
    arm: &Arm,
    drive: &Drive,
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Record> {
    arm.check_initial(&options.initial)?;
    let SimulationOptions {
        sampling,
        initial,
        tolerances,
    } = options;
    let mut rows = Rows::default();
    let flexible = arm.model() != Model::Rigid;
    let links = [initial.q[0], initial.q[1], initial.dq[0], initial.dq[1]];
    match drive {
        Drive::Held(torque) => {
            check_samples(["tau1", "tau2"], torque, sampling.rows())?;
            let input = |k: usize| [torque[0][k], torque[1][k]];
            if flexible {
                run_held(
                    &mut Dop853::new(0.0, initial.to_array(), *tolerances)?,
                    |x, tau: &[f64; 2]| arm.derivative(x, *tau),
                    |k, _| input(k),
                    sampling,
                    &mut |_, x, tau| rows.push(*tau, State::from_array(*x)),
                    watch,
                )?;
            } else {
                run_held(
                    &mut Dop853::new(0.0, links, *tolerances)?,
                    |x, tau: &[f64; 2]| arm.rigid_derivative(x, *tau),
                    |k, _| input(k),
                    sampling,
                    &mut |_, x, tau| rows.push(*tau, link_state(x)),
                    watch,
                )?;
            }
        }
        Drive::Servo { reference, gains } => {
            check_samples(["r1", "r2"], reference, sampling.rows())?;
            let servo = |k: usize, q: [f64; 2], dq: [f64; 2]| {
                [0, 1].map(|i| gains[i][0] * (reference[i][k] - q[i]) - gains[i][1] * dq[i])
            };
            if flexible {
                run_held(
                    &mut Dop853::new(0.0, initial.to_array(), *tolerances)?,
                    |x, tau: &[f64; 2]| arm.derivative(x, *tau),
                    |k, x| servo(k, [x[2], x[3]], [x[6], x[7]]),
                    sampling,
                    &mut |_, x, tau| rows.push(*tau, State::from_array(*x)),
                    watch,
                )?;
            } else {
                run_held(
                    &mut Dop853::new(0.0, links, *tolerances)?,
                    |x, tau: &[f64; 2]| arm.rigid_derivative(x, *tau),
                    |k, x| servo(k, [x[0], x[1]], [x[2], x[3]]),
                    sampling,
                    &mut |_, x, tau| rows.push(*tau, link_state(x)),
                    watch,
                )?;
            }
        }
        Drive::Torque(torque) => {
            if flexible {
                run_continuous(
                    &mut Dop853::new(0.0, initial.to_array(), *tolerances)?,
                    |t, x| arm.derivative(x, torque(t)),
                    sampling,
                    &mut |k, x| rows.push(torque(sampling.instant(k)), State::from_array(*x)),
                    watch,
                )?;
            } else {
                run_continuous(
                    &mut Dop853::new(0.0, links, *tolerances)?,
                    |t, x| arm.rigid_derivative(x, torque(t)),
                    sampling,
                    &mut |k, x| rows.push(torque(sampling.instant(k)), link_state(x)),
                    watch,
                )?;
            }
        }
        Drive::Deflection(deflection) => {
            arm.check_deflection()?;
            check_samples(["d1", "d2"], deflection, sampling.rows())?;
            let command = |k: usize| {
                [0, 1].map(|i| {
                    if arm.free[i] {
                        deflection[i][k]
                    } else {
                        initial.qm[i] - initial.q[i]
                    }
                })
            };
            run_held(
                &mut Dop853::new(0.0, links, *tolerances)?,
                |x, d: &[f64; 2]| arm.deflected_derivative(x, *d),
                |k, _| command(k),
                sampling,
                &mut |_, x, d| {
                    let [_, _, a1, a2] = arm.deflected_derivative(x, *d);
                    let mut state = link_state(x);
                    state.qm = [state.q[0] + d[0], state.q[1] + d[1]];
                    state.dqm = state.dq;
                    rows.push(arm.holding_torque([a1, a2], *d), state);
                },
                watch,
            )?;
        }
    }
    rows.into_record(sampling, flexible)
}

/// The links' part of a state, from `[q1, q2, q1', q2']`.
fn link_state(x: &[f64; 4]) -> State {
    State {
        q: [x[0], x[1]],
        dq: [x[2], x[3]],
        ..State::default()
    }
}

impl Arm {
    /// Checks that an arm can start from a state.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the state is not finite or a locked joint moves in it.
    pub fn check_initial(&self, initial: &State) -> Result<()> {
        let State { q, qm, dq, dqm } = initial;
        for (name, values) in [("q", q), ("qm", qm), ("dq", dq), ("dqm", dqm)] {
            for (i, &value) in values.iter().enumerate() {
                let invalid =
                    |requirement| Error::parameter(format!("the initial {name}{}", i + 1), value, requirement);
                if !value.is_finite() {
                    return Err(invalid("finite"));
                }
                if name.starts_with('d') && !self.free[i] && value != 0.0 {
                    return Err(invalid("0, because the joint is locked"));
                }
            }
        }
        Ok(())
    }

    /// Checks that deflections can be commanded of an arm.
    ///
    /// # Errors
    /// [`Error::Arm`] for a rigid arm, [`Error::Arm`] if `M + S` is not
    /// positive for every `q2`.
    pub fn check_deflection(&self) -> Result<()> {
        if self.model() == Model::Rigid {
            return Err(Error::Arm(ArmError::RigidDeflection));
        }
        checks::deflection_inertia(self)
    }
}

/// The columns of a simulated record.
pub fn record_columns(model: Model) -> Vec<&'static str> {
    let kept = |name: &&str| model != Model::Rigid || !name.contains("qm");
    ["t"].into_iter().chain(Rows::NAMES).filter(kept).collect()
}

/// Refuses samples that are not finite or not one a row.
fn check_samples(names: [&str; 2], samples: &[&[f64]; 2], rows: usize) -> Result<()> {
    for (name, samples) in names.into_iter().zip(samples) {
        if samples.len() != rows {
            return Err(Error::length(name, samples.len(), rows));
        }
        if let Some(sample) = samples.iter().position(|v| !v.is_finite()) {
            return Err(Error::not_finite(name, sample, samples[sample]));
        }
    }
    Ok(())
}

/// The record's columns but the time, as they grow.
#[derive(Default)]
struct Rows([Vec<f64>; 10]);

impl Rows {
    const NAMES: [&'static str; 10] = ["tau1", "tau2", "q1", "q2", "qm1", "qm2", "dq1", "dq2", "dqm1", "dqm2"];

    fn push(&mut self, tau: [f64; 2], state: State) {
        for (column, value) in self.0.iter_mut().zip(tau.into_iter().chain(state.to_array())) {
            column.push(value);
        }
    }

    fn into_record(self, sampling: &Sampling, flexible: bool) -> Result<Record> {
        let t = (0..sampling.rows()).map(|k| sampling.instant(k)).collect();
        let columns = Self::NAMES.into_iter().zip(self.0);
        let kept = columns.filter(|(name, _)| flexible || !name.contains("qm"));
        Record::new([("t", t)].into_iter().chain(kept))
    }
}
