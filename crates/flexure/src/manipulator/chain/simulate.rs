//! A chain in time: from its state at the start and the torques of its joints to a record.

use std::cell::RefCell;
use std::ops::ControlFlow;

use super::drives::DrivenChain;
use super::model::Base;
use crate::error::{Error, Result};
use crate::record::{Record, check_values};
use crate::simulation::{Dop853, Sampling, Tolerances, run_held};

/// The components of a state.
type StateOfChain = Box<[f64]>;

/// How a chain is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainSimulation {
    /// The instants of the record.
    pub sampling: Sampling,
    /// The state at time 0, as [`DrivenChain::state`] takes it: `[q, qm, v, vm]`.
    pub initial: Vec<f64>,
    /// The accuracy.
    pub tolerances: Tolerances,
}

impl ChainSimulation {
    /// From rest at the neutral position, with the default tolerances, for `duration` s in steps of `sample_time` s.
    ///
    /// # Errors
    /// Those of [`Sampling::new`].
    pub fn new(chain: &DrivenChain, duration: f64, sample_time: f64) -> Result<Self> {
        let mut initial = vec![0.0; chain.dimension()];
        let neutral = chain.chain().neutral();
        initial[..neutral.len()].copy_from_slice(&neutral);
        Ok(ChainSimulation {
            sampling: Sampling::new(duration, sample_time)?,
            initial,
            tolerances: Tolerances::default(),
        })
    }
}

/// The columns of a free base, its position and orientation, then its velocities.
const BASE: [&str; 13] = [
    "base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw", "base_vx", "base_vy", "base_vz",
    "base_wx", "base_wy", "base_wz",
];

/// The columns of a chain's simulated record, in their order; for joints `a` and `b`, of which `b` is flexible,
/// `t, tau_a, tau_b, q_a, q_b, qm_b, dq_a, dq_b, dqm_b`. A free base stands before the positions (`base_x` to `base_qw`) and before the
/// velocities (`base_vx` to `base_wz`).
pub fn chain_columns(chain: &DrivenChain) -> Vec<String> {
    let joints = chain.chain().joints();
    let flexible: Vec<&String> = (joints.iter().zip(chain.flexible()))
        .filter_map(|(name, flexible)| flexible.then_some(name))
        .collect();
    let free = chain.chain().base() == Base::Free;
    let base = |names: &[&str]| {
        names
            .iter()
            .filter(|_| free)
            .map(|name| (*name).to_owned())
            .collect::<Vec<_>>()
    };
    let named =
        |prefix: &str, names: &[&String]| names.iter().map(|name| format!("{prefix}_{name}")).collect::<Vec<_>>();
    let all: Vec<&String> = joints.iter().collect();
    [
        vec!["t".to_owned()],
        named("tau", &all),
        base(&BASE[..7]),
        named("q", &all),
        named("qm", &flexible),
        base(&BASE[7..]),
        named("dq", &all),
        named("dqm", &flexible),
    ]
    .concat()
}

/// Simulates a chain under the torques of its joints: one signal a joint that moves, one sample a row, held until the next row; no signals
/// at all are zero torques. Nothing acts on a free base.
///
/// The record has the columns of [`chain_columns`], one row an instant from 0 on, in s, N m (N), rad (m) and rad/s (m/s). Limits of
/// joints are not kept: what a stop does, it does not say.
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch` or `NonFinite` for torques or an initial state that do not fit, [`Error::Parameter`] for a wrong
/// tolerance, and [`Error::Simulation`].
///
/// ```
/// use flexure::manipulator::chain::{Chain, ChainPreset, ChainSimulation, DrivenChain, RotorCoupling, simulate_chain};
///
/// let arm = Chain::new(&ChainPreset::SixJointArm.parameters())?;
/// let arm = DrivenChain::new(arm, &[], RotorCoupling::None)?;
/// let falling = simulate_chain(&arm, &[], &ChainSimulation::new(&arm, 0.5, 0.01)?)?;
/// assert_eq!(falling.len(), 51);
/// assert!(falling.column("q_joint2")?[50] > 0.1);
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn simulate_chain(chain: &DrivenChain, torques: &[&[f64]], options: &ChainSimulation) -> Result<Record> {
    simulate_chain_watched(chain, torques, options, &mut |_| ControlFlow::Continue(()))
}

/// Like [`simulate_chain`], calling `watch` with the simulated time at every instant (and within long intervals); it shows progress, and
/// stops the simulation by returning `Break`.
///
/// # Errors
/// Those of [`simulate_chain`], and [`Error::Stopped`].
pub fn simulate_chain_watched(
    chain: &DrivenChain,
    torques: &[&[f64]],
    options: &ChainSimulation,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Record> {
    let (sampling, joints) = (&options.sampling, chain.chain().joints());
    check(chain, torques, options)?;
    let base = if chain.chain().base() == Base::Free { 6 } else { 0 };
    let torque = |k: usize| {
        let mut tau = vec![0.0; base + joints.len()];
        tau[base..]
            .iter_mut()
            .zip(torques)
            .for_each(|(tau, torque)| *tau = torque[k]);
        tau
    };
    let data = RefCell::new(chain.data());
    let failed = RefCell::new(None);
    let plant = |x: &StateOfChain, tau: &Vec<f64>| {
        let mut derivative = vec![0.0; x.len()].into_boxed_slice();
        if let Err(error) = chain.derivative(&mut data.borrow_mut(), x, tau, &mut derivative) {
            // The integrator stops where nothing is finite; the reason is kept.
            derivative.fill(f64::NAN);
            failed.borrow_mut().get_or_insert(error);
        }
        derivative
    };
    let names = chain_columns(chain);
    let mut columns = vec![Vec::with_capacity(sampling.rows()); names.len()];
    let state = chain.state(&options.initial)?;
    let positions = state.q.len() + state.motor_q.len();
    let initial = options.initial.clone().into_boxed_slice();
    let ran = run_held(
        &mut Dop853::new(0.0, initial, options.tolerances)?.with_speeds_from(positions),
        plant,
        |k, _| torque(k),
        sampling,
        &mut |k, x, tau| {
            let values = std::iter::once(sampling.instant(k)).chain(tau[base..].iter().copied());
            let values = values.chain(x.iter().copied());
            columns
                .iter_mut()
                .zip(values)
                .for_each(|(column, value)| column.push(value));
        },
        watch,
    );
    match (ran, failed.into_inner()) {
        (Err(Error::Simulation(_)), Some(error)) => return Err(error),
        (ran, _) => ran?,
    }
    if base > 0 {
        unit_quaternions(&mut columns, &names);
    }
    Record::new(names.into_iter().zip(columns))
}

/// Refuses what does not fit the chain.
fn check(chain: &DrivenChain, torques: &[&[f64]], options: &ChainSimulation) -> Result<()> {
    chain.state(&options.initial)?;
    check_values("the initial state", &options.initial)?;
    let joints = chain.chain().joints();
    if !torques.is_empty() && torques.len() != joints.len() {
        return Err(Error::length("the torques", torques.len(), joints.len()));
    }
    for (joint, torque) in joints.iter().zip(torques) {
        let name = format!("tau_{joint}");
        if torque.len() != options.sampling.rows() {
            return Err(Error::length(name, torque.len(), options.sampling.rows()));
        }
        check_values(&name, torque)?;
    }
    Ok(())
}

/// Brings the quaternions to length one, from which rounding takes them.
fn unit_quaternions(columns: &mut [Vec<f64>], names: &[String]) {
    let Some(first) = names.iter().position(|name| name == BASE[3]) else {
        return;
    };
    for k in 0..columns[first].len() {
        let length = (0..4).map(|i| columns[first + i][k].powi(2)).sum::<f64>().sqrt();
        (0..4).for_each(|i| columns[first + i][k] /= length);
    }
}
