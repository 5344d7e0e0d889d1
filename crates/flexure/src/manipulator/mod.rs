//! The planar two-link arm (Krzyzak & Sasiadek, section III), without gravity.
//!
//! Joint 1 is the shoulder, joint 2 the elbow; `q` are the link angles (`q2` relative to link 1),
//! `qm` the motor angles, `d = qm - q` the joints' deflections, `tau` the motor torques. SI units.
//!
//! | item | what | equations |
//! |---|---|---|
//! | [`Link`], [`LinkDynamics`] | geometry, `M(q)`, `C(q, q')` | (4)-(6) |
//! | [`Stiffness`], [`Friction`] | the joint's torque laws | (10)-(12) |
//! | [`ArmParameters`], [`Parts`] | the parameters of an arm; every part can be switched off | |
//! | [`Arm`] | a checked arm: accelerations, energy, modal frequencies | (4), (7)-(9) |
//! | [`chain`] | any chain or tree of rigid links, on a fixed or a free base | |
//! | [`flexible_arm`] | arms of flexible links in a plane: finite elements or assumed modes | |
//! | [`simulate()`], [`Drive`] | an arm in time, under torque or with commanded deflections | |
//! | [`simulate_batch`] | many arms in time, over all cores | |
//!
//! All equations of the paper, with their files, are listed in `identify/hammerstein/mod.rs`.
//!
//! ```
//! use flexure::manipulator::{Arm, Drive, JointKind, SimulationOptions, simulate, space_arm};
//!
//! let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
//! let options = SimulationOptions::new(1.0, 0.01)?;
//! let torque = |t: f64| [5.0 * (2.0 * t).sin(), 0.0];
//! let record = simulate(&arm, &Drive::Torque(&torque), &options)?;
//! assert_eq!(record.column("q1")?.len(), 101);
//! # Ok::<(), flexure::Error>(())
//! ```

mod arm;
mod batch;
pub mod chain;
mod checks;
mod coefficients;
mod dynamics;
mod elementary;
pub mod flexible_arm;
mod joint;
mod links;
mod modal;
mod noise;
mod parameters;
mod simulate;

pub use arm::Arm;
pub use batch::{ArmRun, simulate_batch};
pub use joint::{Friction, Stiffness};
pub use links::{Link, LinkDynamics};
pub use noise::add_noise;
pub use parameters::{ArmParameters, JointKind, JointParameters, Parts, space_arm};
pub use simulate::{Drive, SimulationOptions, record_columns, simulate, simulate_watched};

/// The state of an arm; all angles in rad, velocities in rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Link angles; `q[1]` is relative to link 1.
    pub q: [f64; 2],
    /// Motor angles (unused by a rigid arm).
    pub qm: [f64; 2],
    /// Link velocities.
    pub dq: [f64; 2],
    /// Motor velocities (unused by a rigid arm).
    pub dqm: [f64; 2],
}

impl State {
    /// The state as `[q1, q2, qm1, qm2, q1', q2', qm1', qm2']`.
    pub fn to_array(self) -> [f64; 8] {
        let State { q, qm, dq, dqm } = self;
        [q[0], q[1], qm[0], qm[1], dq[0], dq[1], dqm[0], dqm[1]]
    }

    /// The inverse of [`State::to_array`].
    pub fn from_array(x: [f64; 8]) -> Self {
        State {
            q: [x[0], x[1]],
            qm: [x[2], x[3]],
            dq: [x[4], x[5]],
            dqm: [x[6], x[7]],
        }
    }
}
