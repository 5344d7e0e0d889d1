//! A flexible arm in time: from its state at the start and the torques of its joints to a record.

use std::ops::ControlFlow;

use super::FlexibleArm;
use crate::error::{Error, Result};
use crate::manipulator::chain::{ChainSimulation, HeldRun};
use crate::record::Record;

/// The columns of a free base: its place and angle, then their rates.
const BASE: [&str; 6] = ["base_x", "base_y", "base_angle", "base_vx", "base_vy", "base_w"];

/// The columns of a flexible arm's simulated record, in their order; for a joint `a` that is flexible and carries a beam `b` of one mode
/// `t, tau_a, q_a, e1_b, qm_a, dq_a, de1_b, dqm_a, tip_b`. A free base stands before the positions (`base_x`, `base_y`, `base_angle`) and
/// before the velocities (`base_vx`, `base_vy`, `base_w`), `e1` and so on are the elastic coordinates, and `tip` is the tip's deflection
/// across the straight beam, m; passive joints have no `tau`.
pub fn flexible_arm_columns(arm: &FlexibleArm) -> Vec<String> {
    let driven = arm.driven().into_iter().map(|joint| format!("tau_{joint}"));
    let columns = std::iter::once("t".to_owned()).chain(driven);
    let state = arm.state_columns("q", "qm", "e", &BASE[..3]);
    let rates = arm.state_columns("dq", "dqm", "de", &BASE[3..]);
    let beams = arm.links.iter().filter(|link| link.beam.is_some());
    let tips = beams.map(|link| format!("tip_{}", link.name));
    columns.chain(state).chain(rates).chain(tips).collect()
}

impl FlexibleArm {
    /// The names of the joints on which a torque acts: those that are not passive.
    pub fn driven(&self) -> Vec<&String> {
        let joints = self.joints.iter().zip(&self.drives);
        joints
            .filter_map(|(joint, drive)| (!drive.passive).then_some(&joint.name))
            .collect()
    }

    fn state_columns(&self, joint: &str, motor: &str, elastic: &str, base: &[&str]) -> Vec<String> {
        let base = base.iter().filter(|_| self.free_base()).map(|name| (*name).to_owned());
        let joints = self.joints.iter().map(|own| format!("{joint}_{}", own.name));
        let elastic = (self.links.iter().filter_map(|link| Some((link, link.beam.as_ref()?))))
            .flat_map(|(link, beam)| (1..=beam.coordinates()).map(move |k| format!("{elastic}{k}_{}", link.name)));
        let flexible = self.joints.iter().zip(&self.drives).filter(|(_, drive)| drive.flexible);
        let motors = flexible.map(|(own, _)| format!("{motor}_{}", own.name));
        base.chain(joints).chain(elastic).chain(motors).collect()
    }

    /// The time derivative of the state `x` under the torques of the joints that are driven.
    ///
    /// # Errors
    /// Those of [`FlexibleArm::accelerations`].
    pub fn derivative(&self, x: &[f64], torques: &[f64], derivative: &mut [f64]) -> Result<()> {
        let state = self.state(x)?;
        super::length("derivative", derivative, x.len())?;
        super::length("torques", torques, self.driven().len())?;
        let mut given = torques.iter();
        let each = self.drives.iter().map(|drive| match drive.passive {
            true => 0.0,
            false => given.next().copied().unwrap_or_default(),
        });
        let (accelerations, motors) = self.accelerations(&state, &each.collect::<Vec<_>>())?;
        let rates = [state.v, state.motor_v, &accelerations, &motors].concat();
        derivative.copy_from_slice(&rates);
        Ok(())
    }
}

/// Simulates a flexible arm under the torques of its joints: one signal a joint that moves and is not passive, one sample a row, held until
/// the next row; no signals at all are zero torques. Nothing acts on a free base.
///
/// The record has the columns of [`flexible_arm_columns`], one row an instant from 0 on, in s, N m, rad and m, rad/s and m/s.
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch` or `NonFinite` for torques or an initial state that do not fit,
/// [`Error::Parameter`] for a wrong tolerance and for a motion of the base, and [`Error::Simulation`].
pub fn simulate_flexible_arm(arm: &FlexibleArm, torques: &[&[f64]], options: &ChainSimulation) -> Result<Record> {
    simulate_flexible_arm_watched(arm, torques, options, &mut |_| ControlFlow::Continue(()))
}

/// Like [`simulate_flexible_arm`], calling `watch` with the simulated time at every instant (and within long intervals); it shows progress,
/// and stops the simulation by returning `Break`.
///
/// # Errors
/// Those of [`simulate_flexible_arm`], and [`Error::Stopped`].
pub fn simulate_flexible_arm_watched(
    arm: &FlexibleArm,
    torques: &[&[f64]],
    options: &ChainSimulation,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Record> {
    arm.state(&options.initial)?;
    if options.base_motion.is_some() {
        return Err(Error::parameter(
            "the number of motions of the base",
            1.0,
            "0: only the base of a chain of rigid links or segments can be moved",
        ));
    }
    let (names, driven) = (flexible_arm_columns(arm), arm.driven());
    let (coordinates, motors) = (arm.coordinates, arm.motors());
    let held = HeldRun {
        driven: &driven,
        torques,
        options,
        positions: coordinates + motors,
    };
    let derivative = |_, x: &[f64], tau: &[f64], rates: &mut [f64]| arm.derivative(x, tau, rates);
    let beams = arm.links.iter().filter(|link| link.beam.is_some()).count();
    let mut columns = held.columns(derivative, names.len() - beams, watch)?;
    let rows = columns[0].len();
    let mut tips = vec![Vec::with_capacity(rows); beams];
    let before = 1 + driven.len();
    for k in 0..rows {
        let q: Vec<f64> = columns[before..before + coordinates]
            .iter()
            .map(|column| column[k])
            .collect();
        let found = arm.deflections(&q)?;
        tips.iter_mut()
            .zip(found)
            .for_each(|(tip, (_, [across, _]))| tip.push(across));
    }
    columns.extend(tips);
    Record::new(names.into_iter().zip(columns))
}
