//! An arm in time: from its initial state and its drive to a record.

use std::ops::ControlFlow;

use super::arm::Arm;
use super::coefficients::Coefficients;
use super::parameters::JointKind;
use super::{State, checks};
use crate::error::{ArmError, Error, Result};
use crate::number::Number;
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
    check(arm, drive, options)?;
    let rows = match (Equations::of(arm, drive), drive) {
        (Equations::Rigid, Drive::Torque(torque)) => continuous::<4, Rigid>(arm, torque, options, watch)?,
        (_, Drive::Torque(torque)) => continuous::<8, Flexible>(arm, torque, options, watch)?,
        (Equations::Flexible, _) => held::<8, Flexible>(arm, drive, options, watch)?,
        (Equations::Rigid, _) => held::<4, Rigid>(arm, drive, options, watch)?,
        (Equations::Deflected, _) => held::<4, Deflected>(arm, drive, options, watch)?,
    };
    rows.into_record(&options.sampling, arm.model())
}

/// The equations of motion of an arm under a drive of one kind, in a state vector of `N` components.
pub(super) trait EquationsOfMotion<const N: usize> {
    /// The derivative of the state under the torques or deflections `u`.
    fn derivative<T: Number>(of: &Coefficients<T>, x: &[T; N], u: &[T; 2]) -> [T; N];

    /// The components of a state.
    fn vector(state: &State) -> [f64; N];

    /// The state with these components.
    fn state(x: &[f64; N]) -> State;

    /// The torques and the state of a row, under the torques or deflections `u`.
    fn row(_: &Arm, x: &[f64; N], u: &[f64; 2]) -> ([f64; 2], State) {
        (*u, Self::state(x))
    }
}

/// Flexible joints under torques: x = `[q1, q2, qm1, qm2, q1', q2', qm1', qm2']`.
pub(super) struct Flexible;

impl EquationsOfMotion<8> for Flexible {
    #[inline(always)]
    fn derivative<T: Number>(of: &Coefficients<T>, x: &[T; 8], tau: &[T; 2]) -> [T; 8] {
        of.derivative(x, tau)
    }

    fn vector(state: &State) -> [f64; 8] {
        state.to_array()
    }

    fn state(x: &[f64; 8]) -> State {
        State::from_array(*x)
    }
}

/// Rigid joints, whose motors move with the links: x = `[q1, q2, q1', q2']`.
pub(super) struct Rigid;

impl EquationsOfMotion<4> for Rigid {
    #[inline(always)]
    fn derivative<T: Number>(of: &Coefficients<T>, x: &[T; 4], tau: &[T; 2]) -> [T; 4] {
        of.rigid_derivative(x, tau)
    }

    fn vector(state: &State) -> [f64; 4] {
        [state.q[0], state.q[1], state.dq[0], state.dq[1]]
    }

    fn state(x: &[f64; 4]) -> State {
        let (q, dq) = ([x[0], x[1]], [x[2], x[3]]);
        State { q, qm: q, dq, dqm: dq }
    }
}

/// Flexible joints under deflections: the links have the state of a rigid arm, and the motors follow them.
pub(super) struct Deflected;

impl EquationsOfMotion<4> for Deflected {
    #[inline(always)]
    fn derivative<T: Number>(of: &Coefficients<T>, x: &[T; 4], d: &[T; 2]) -> [T; 4] {
        of.deflected_derivative(x, d)
    }

    fn vector(state: &State) -> [f64; 4] {
        Rigid::vector(state)
    }

    fn state(x: &[f64; 4]) -> State {
        Rigid::state(x)
    }

    fn row(arm: &Arm, x: &[f64; 4], d: &[f64; 2]) -> ([f64; 2], State) {
        let [_, _, a1, a2] = arm.deflected_derivative(x, *d);
        let links = Rigid::state(x);
        let qm = [links.q[0] + d[0], links.q[1] + d[1]];
        (arm.holding_torque([a1, a2], links.dq, *d), State { qm, ..links })
    }
}

/// Which equations a drive asks of an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Equations {
    Flexible,
    Rigid,
    Deflected,
}

impl Equations {
    pub fn of(arm: &Arm, drive: &Drive) -> Self {
        match (drive, arm.model()) {
            (Drive::Deflection(_), _) => Equations::Deflected,
            (_, JointKind::Rigid) => Equations::Rigid,
            _ => Equations::Flexible,
        }
    }
}

/// What is held from row `k` on, in the state `x` at its instant.
pub(super) fn held_input<const N: usize, E: EquationsOfMotion<N>>(
    arm: &Arm,
    drive: &Drive,
    initial: &State,
    k: usize,
    x: &[f64; N],
) -> [f64; 2] {
    match drive {
        Drive::Held(torque) => [torque[0][k], torque[1][k]],
        Drive::Servo { reference, gains } => {
            let at = E::state(x);
            [0, 1].map(|i| gains[i][0] * (reference[i][k] - at.qm[i]) - gains[i][1] * at.dqm[i])
        }
        Drive::Deflection(deflection) => [0, 1].map(|i| match arm.free()[i] {
            true => deflection[i][k],
            false => initial.qm[i] - initial.q[i],
        }),
        // It is not held.
        Drive::Torque(_) => [0.0; 2],
    }
}

/// Checks the initial state of an arm, and the samples of its drive.
pub(super) fn check(arm: &Arm, drive: &Drive, options: &SimulationOptions) -> Result<()> {
    arm.check_initial(&options.initial)?;
    let rows = options.sampling.rows();
    match drive {
        Drive::Held(torque) => check_samples(["tau1", "tau2"], torque, rows),
        Drive::Servo { reference, .. } => check_samples(["r1", "r2"], reference, rows),
        Drive::Torque(_) => Ok(()),
        Drive::Deflection(deflection) => {
            arm.check_deflection()?;
            check_samples(["d1", "d2"], deflection, rows)
        }
    }
}

/// Samples that are held over each row.
fn held<const N: usize, E: EquationsOfMotion<N>>(
    arm: &Arm,
    drive: &Drive,
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    let mut rows = Rows::default();
    run_held(
        &mut Dop853::new(0.0, E::vector(&options.initial), options.tolerances)?.with_speeds_from(N / 2),
        |x, u: &[f64; 2]| E::derivative(&arm.coefficients, x, u),
        |k, x| held_input::<N, E>(arm, drive, &options.initial, k, x),
        &options.sampling,
        &mut |_, x, u| rows.push(E::row(arm, x, u)),
        watch,
    )?;
    Ok(rows)
}

/// Torques that are a continuous function of the time.
fn continuous<const N: usize, E: EquationsOfMotion<N>>(
    arm: &Arm,
    torque: &(dyn Fn(f64) -> [f64; 2] + Sync),
    options: &SimulationOptions,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rows> {
    let mut rows = Rows::default();
    run_continuous(
        &mut Dop853::new(0.0, E::vector(&options.initial), options.tolerances)?.with_speeds_from(N / 2),
        |t, x| E::derivative(&arm.coefficients, x, &torque(t)),
        &options.sampling,
        &mut |k, x| rows.push(E::row(arm, x, &torque(options.sampling.instant(k)))),
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
                if name.starts_with('d') && !self.free()[i] && value != 0.0 {
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
pub(super) struct Rows([Vec<f64>; 10]);

impl Rows {
    const NAMES: [&'static str; 10] = ["tau1", "tau2", "q1", "q2", "qm1", "qm2", "dq1", "dq2", "dqm1", "dqm2"];

    pub(super) fn push(&mut self, (tau, state): ([f64; 2], State)) {
        for (column, value) in self.0.iter_mut().zip(tau.into_iter().chain(state.to_array())) {
            column.push(value);
        }
    }

    pub(super) fn into_record(self, sampling: &Sampling, model: JointKind) -> Result<Record> {
        let flexible = model != JointKind::Rigid;
        let t = (0..sampling.rows()).map(|k| sampling.instant(k)).collect();
        let columns = Self::NAMES.into_iter().zip(self.0);
        let kept = columns.filter(|(name, _)| flexible || !name.contains("qm"));
        Record::new([("t", t)].into_iter().chain(kept))
    }
}
