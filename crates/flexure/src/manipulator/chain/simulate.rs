//! A chain in time: from its state at the start and the torques of its joints to a record.

use std::cell::RefCell;
use std::ops::ControlFlow;

use super::base_motion::BaseMotion;
use super::drives::DrivenChain;
use super::model::Base;
use crate::error::{ArmError, Error, Result};
use crate::record::{Record, check_values};
use crate::simulation::{Integration, Integrator, Sampling, Tolerances, run_held_in_time};

/// The components of a state.
type StateOfChain = Box<[f64]>;

/// How a chain is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainSimulation {
    /// The instants of the record.
    pub sampling: Sampling,
    /// The state at time 0, as [`DrivenChain::state`] or [`FlexibleArm::state`](crate::manipulator::flexible_arm::FlexibleArm::state) takes
    /// it: `[q, qm, v, vm]`.
    pub initial: Vec<f64>,
    /// The accuracy.
    pub tolerances: Tolerances,
    /// The method; by default the one that suits the motion.
    pub integrator: Integrator,
    /// How a fixed base is moved, one pose an instant; without it, it stays at the origin of the world.
    pub base_motion: Option<BaseMotion>,
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
        ChainSimulation::from_state(initial, duration, sample_time)
    }

    /// From a state, with the default tolerances, for `duration` s in steps of `sample_time` s.
    ///
    /// # Errors
    /// Those of [`Sampling::new`].
    pub fn from_state(initial: Vec<f64>, duration: f64, sample_time: f64) -> Result<Self> {
        Ok(ChainSimulation {
            sampling: Sampling::new(duration, sample_time)?,
            initial,
            tolerances: Tolerances::default(),
            integrator: Integrator::default(),
            base_motion: None,
        })
    }

    /// Refuses a motion of the base that is not one of this run.
    fn check_motion(&self, chain: &DrivenChain) -> Result<()> {
        let Some(motion) = &self.base_motion else {
            return Ok(());
        };
        if chain.chain().base() == Base::Free {
            return Err(Error::Arm(ArmError::Unsuited {
                part: "a floating base".to_owned(),
                why: "it moves by itself; make it fixed, or give no motion of the base",
            }));
        }
        let (rows, step) = (self.sampling.rows(), self.sampling.sample_time());
        if motion.poses() != rows {
            return Err(Error::length("the motion of the base", motion.poses(), rows));
        }
        if motion.sample_time() != step {
            let name = "the sample time of the base's motion";
            return Err(Error::parameter(name, motion.sample_time(), "that of the run"));
        }
        Ok(())
    }
}

/// The columns of a base that floats or is moved, its position and orientation, then its velocities.
const BASE: [&str; 13] = [
    "base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw", "base_vx", "base_vy", "base_vz",
    "base_wx", "base_wy", "base_wz",
];

/// The columns of a chain's simulated record, in their order; for joints `a` and `b`, of which `b` is flexible,
/// `t, tau_a, tau_b, q_a, q_b, qm_b, dq_a, dq_b, dqm_b`. A base that floats or is moved stands before the positions (`base_x` to `base_qw`) and before the
/// velocities (`base_vx` to `base_wz`). Passive joints have no `tau`.
pub fn chain_columns(chain: &DrivenChain) -> Vec<String> {
    columns(chain, chain.chain().base() == Base::Free)
}

/// The columns of [`chain_columns`], with those of the base or without.
fn columns(chain: &DrivenChain, with_base: bool) -> Vec<String> {
    let joints = chain.chain().joints();
    let flexible: Vec<&String> = (joints.iter().zip(chain.flexible()))
        .filter_map(|(name, flexible)| flexible.then_some(name))
        .collect();
    let base = |names: &[&str]| {
        names
            .iter()
            .filter(|_| with_base)
            .map(|name| (*name).to_owned())
            .collect::<Vec<_>>()
    };
    let named =
        |prefix: &str, names: &[&String]| names.iter().map(|name| format!("{prefix}_{name}")).collect::<Vec<_>>();
    let all: Vec<&String> = joints.iter().collect();
    [
        vec!["t".to_owned()],
        named("tau", &chain.driven()),
        base(&BASE[..7]),
        named("q", &all),
        named("qm", &flexible),
        base(&BASE[7..]),
        named("dq", &all),
        named("dqm", &flexible),
    ]
    .concat()
}

/// Simulates a chain under the torques of its joints: one signal a joint that moves and is not passive, one sample a row, held until the
/// next row; no signals at all are zero torques. Nothing acts on a free base. A fixed base moves as `base_motion` says.
///
/// The record has the columns of [`chain_columns`], one row an instant from 0 on, in s, N m (N), rad (m) and rad/s (m/s). Limits of
/// joints are not kept: what a stop does, it does not say. [`batch`](crate::simulation::batch) runs many simulations over all cores.
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch` or `NonFinite` for torques or an initial state that do not fit, [`Error::Parameter`] for a wrong
/// tolerance or a motion of the base that does not fit, [`Error::Arm`] for the motion of a floating base, and [`Error::Simulation`].
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
    chain.state(&options.initial)?;
    options.check_motion(chain)?;
    let base = if chain.chain().base() == Base::Free { 6 } else { 0 };
    let passive = chain.passive();
    let driven: Vec<usize> = (0..passive.len()).filter(|&i| !passive[i]).map(|i| base + i).collect();
    let names = columns(chain, base > 0 || options.base_motion.is_some());
    let held = HeldRun {
        driven: &chain.driven(),
        torques,
        options,
        positions: chain.chain().positions() + chain.motors(),
    };
    let mut data = chain.data();
    let mut tau = vec![0.0; base + passive.len()];
    let derivative = |t: f64, x: &[f64], torques: &[f64], rates: &mut [f64]| {
        if let Some(motion) = &options.base_motion {
            motion.at(t).carry(&mut data.chain)?;
        }
        driven.iter().zip(torques).for_each(|(&at, torque)| tau[at] = *torque);
        chain.derivative(&mut data, x, &tau, rates)
    };
    let mut columns = held.columns(derivative, chain_columns(chain).len(), watch)?;
    if let Some(motion) = &options.base_motion {
        let mut of_base = motion.columns();
        let velocities = of_base.split_off(7);
        let first = 1 + driven.len();
        let second = first + held.positions;
        columns.splice(second..second, velocities);
        columns.splice(first..first, of_base);
    }
    if base > 0 {
        unit_quaternions(&mut columns, &names);
    }
    Record::new(names.into_iter().zip(columns))
}

/// A simulation under torques that are held from sample to sample.
pub(in crate::manipulator) struct HeldRun<'a> {
    /// The names of the joints on which torques act.
    pub driven: &'a [&'a String],
    /// Their torques; none are zero.
    pub torques: &'a [&'a [f64]],
    pub options: &'a ChainSimulation,
    /// The number of values of a state that are no velocities.
    pub positions: usize,
}

impl HeldRun<'_> {
    /// The instants, torques and states, as so many columns. The derivative takes the time, the state and the torques.
    pub fn columns(
        &self,
        derivative: impl FnMut(f64, &[f64], &[f64], &mut [f64]) -> Result<()>,
        columns: usize,
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Vec<Vec<f64>>> {
        self.check()?;
        let (sampling, options) = (&self.options.sampling, self.options);
        let torques = |k: usize| -> Vec<f64> {
            let each = (0..self.driven.len()).map(|i| self.torques.get(i).map_or(0.0, |torque| torque[k]));
            each.collect()
        };
        let derivative = RefCell::new(derivative);
        let failed = RefCell::new(None);
        let plant = |t: f64, x: &StateOfChain, tau: &Vec<f64>| {
            let mut rates = vec![0.0; x.len()].into_boxed_slice();
            if let Err(error) = (derivative.borrow_mut())(t, x, tau, &mut rates) {
                // The integrator stops where nothing is finite; the reason is kept.
                rates.fill(f64::NAN);
                failed.borrow_mut().get_or_insert(error);
            }
            rates
        };
        let mut columns = vec![Vec::with_capacity(sampling.rows()); columns];
        let initial = options.initial.clone().into_boxed_slice();
        let ran = run_held_in_time(
            &mut Integration::new(0.0, initial, options.tolerances, options.integrator)?
                .with_speeds_from(self.positions),
            plant,
            |k, _| torques(k),
            sampling,
            &mut |k, x, tau| {
                let values = std::iter::once(sampling.instant(k)).chain(tau.iter().copied());
                let values = values.chain(x.iter().copied());
                columns
                    .iter_mut()
                    .zip(values)
                    .for_each(|(column, value)| column.push(value));
            },
            watch,
        );
        match (ran, failed.into_inner()) {
            (Err(Error::Simulation(_)), Some(error)) => Err(error),
            (ran, _) => ran.map(|_| columns),
        }
    }

    /// Refuses torques and states that do not fit.
    fn check(&self) -> Result<()> {
        check_values("the initial state", &self.options.initial)?;
        if !self.torques.is_empty() && self.torques.len() != self.driven.len() {
            return Err(Error::length("the torques", self.torques.len(), self.driven.len()));
        }
        for (joint, torque) in self.driven.iter().zip(self.torques) {
            let (name, rows) = (format!("tau_{joint}"), self.options.sampling.rows());
            if torque.len() != rows {
                return Err(Error::length(name, torque.len(), rows));
            }
            check_values(&name, torque)?;
        }
        Ok(())
    }
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
