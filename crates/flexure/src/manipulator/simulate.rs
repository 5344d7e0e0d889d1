//! An arm in time: from its initial state and its drive to a record.

use std::ops::ControlFlow;

use super::arm::{Arm, JointKind};
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
    /// The record shows them at its instants. For a torque that jumps, use [`Drive::Held`].
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
    /// A locked joint keeps its initial deflection for any command. A rigid arm has no deflections.
    Deflection([&'a [f64]; 2]),
    /// Reference motor angles in rad for servos, one sample a row for each joint: the torque
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
    /// The state at time 0; the motors' part is not used by a rigid arm and, if deflections are commanded, only by locked joints.
    pub initial: State,
    /// The accuracy.
    pub tolerances: Tolerances,
}

impl SimulationOptions {
    /// Options for a start at rest at zero, with the default tolerances, for `duration` s in steps of `sample_time` s.
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
/// intervals); `watch` can show the progress, and stops the simulation by returning `Break`.
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
    let flexible = arm.model() != JointKind::Rigid;
    let rows = match flexible {
        true => driven(&Flexible(arm), drive, options, watch)?,
        false => driven(&Rigid(arm), drive, options, watch)?,
    };
    rows.into_record(&options.sampling, flexible)
}

/// The equations of motion of an arm, in a state vector of `N` components.
trait EquationsOfMotion<const N: usize> {
    /// The arm that moves.
    fn arm(&self) -> &Arm;

    /// The derivative of the state under the torques `tau`.
    fn derivative(&self, x: &[f64; N], tau: [f64; 2]) -> [f64; N];

    /// The components of a state.
    fn vector(state: &State) -> [f64; N];

    /// The state with these components.
    fn state(x: &[f64; N]) -> State;
}

/// An arm of flexible joints: x = `[q1, q2, qm1, qm2, q1', q2', qm1', qm2']`.
struct Flexible<'a>(&'a Arm);

impl EquationsOfMotion<8> for Flexible<'_> {
    fn arm(&self) -> &Arm {
        self.0
    }

    fn derivative(&self, x: &[f64; 8], tau: [f64; 2]) -> [f64; 8] {
        self.0.derivative(x, tau)
    }

    fn vector(state: &State) -> [f64; 8] {
        state.to_array()
    }

    fn state(x: &[f64; 8]) -> State {
        State::from_array(*x)
    }
}

/// An arm of rigid joints, whose motors move with the links: x = `[q1, q2, q1', q2']`.
struct Rigid<'a>(&'a Arm);

impl EquationsOfMotion<4> for Rigid<'_> {
    fn arm(&self) -> &Arm {
        self.0
    }

    fn derivative(&self, x: &[f64; 4], tau: [f64; 2]) -> [f64; 4] {
        self.0.rigid_derivative(x, tau)
    }

    fn vector(state: &State) -> [f64; 4] {
        [state.q[0], state.q[1], state.dq[0], state.dq[1]]
    }

    fn state(x: &[f64; 4]) -> State {
        let (q, dq) = ([x[0], x[1]], [x[2], x[3]]);
        State { q, qm: q, dq, dqm: dq }
    }
}

/// The rows of an arm that `drive` moves.
fn driven<const N: usize>(
    equations: &impl EquationsOfMotion<N>,
    drive: &Drive,
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    let rows = options.sampling.rows();
    match drive {
        Drive::Held(torque) => {
            check_samples(["tau1", "tau2"], torque, rows)?;
            held(equations, |k, _| [torque[0][k], torque[1][k]], options, watch)
        }
        Drive::Servo { reference, gains } => {
            check_samples(["r1", "r2"], reference, rows)?;
            let servo = |k: usize, at: State| {
                [0, 1].map(|i| gains[i][0] * (reference[i][k] - at.qm[i]) - gains[i][1] * at.dqm[i])
            };
            held(equations, servo, options, watch)
        }
        Drive::Torque(torque) => continuous(equations, torque, options, watch),
        Drive::Deflection(deflection) => deflected(equations.arm(), deflection, options, watch),
    }
}

/// Torques that are held over each row; `torque` gives those of a row in the state at its instant.
fn held<const N: usize, E: EquationsOfMotion<N>>(
    equations: &E,
    torque: impl Fn(usize, State) -> [f64; 2],
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    let mut rows = Rows::default();
    run_held(
        &mut Dop853::new(0.0, E::vector(&options.initial), options.tolerances)?.with_speeds_from(N / 2),
        |x, tau: &[f64; 2]| equations.derivative(x, *tau),
        |k, x| torque(k, E::state(x)),
        &options.sampling,
        &mut |_, x, tau| rows.push(*tau, E::state(x)),
        watch,
    )?;
    Ok(rows)
}

/// Torques that are a continuous function of the time.
fn continuous<const N: usize, E: EquationsOfMotion<N>>(
    equations: &E,
    torque: &(dyn Fn(f64) -> [f64; 2] + Sync),
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    let mut rows = Rows::default();
    run_continuous(
        &mut Dop853::new(0.0, E::vector(&options.initial), options.tolerances)?.with_speeds_from(N / 2),
        |t, x| equations.derivative(x, torque(t)),
        &options.sampling,
        &mut |k, x| rows.push(torque(options.sampling.instant(k)), E::state(x)),
        watch,
    )?;
    Ok(rows)
}

/// Deflections that are held over each row. The links have the state of a rigid arm, and the motors follow them.
fn deflected(
    arm: &Arm,
    deflection: &[&[f64]; 2],
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    arm.check_deflection()?;
    check_samples(["d1", "d2"], deflection, options.sampling.rows())?;
    let initial = &options.initial;
    let command = |k: usize| {
        [0, 1].map(|i| match arm.free[i] {
            true => deflection[i][k],
            false => initial.qm[i] - initial.q[i],
        })
    };
    let mut rows = Rows::default();
    run_held(
        &mut Dop853::new(0.0, Rigid::vector(initial), options.tolerances)?.with_speeds_from(2),
        |x, d: &[f64; 2]| arm.deflected_derivative(x, *d),
        |k, _| command(k),
        &options.sampling,
        &mut |_, x, d| {
            let [_, _, a1, a2] = arm.deflected_derivative(x, *d);
            let links = Rigid::state(x);
            let qm = [links.q[0] + d[0], links.q[1] + d[1]];
            rows.push(arm.holding_torque([a1, a2], links.dq, *d), State { qm, ..links });
        },
        watch,
    )?;
    Ok(rows)
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
        if self.model() == JointKind::Rigid {
            return Err(Error::Arm(ArmError::RigidDeflection));
        }
        checks::deflection_inertia(self)
    }
}

/// The columns of a simulated record.
pub fn record_columns(model: JointKind) -> Vec<&'static str> {
    let kept = |name: &&str| model != JointKind::Rigid || !name.contains("qm");
    ["t"].into_iter().chain(Rows::NAMES).filter(kept).collect()
}

/// Refuses samples that are not finite, or not one for each row.
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

/// The growing columns of the record, without the time.
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
