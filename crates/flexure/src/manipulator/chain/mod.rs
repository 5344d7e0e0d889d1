//! Chains and trees of rigid links on a fixed or a free-floating base (Featherstone 2008).
//!
//! | to | call |
//! |---|---|
//! | describe a chain, and check it | [`ChainParameters`], [`Chain::new`] |
//! | get accelerations from torques | [`Chain::forward_dynamics`], [`Chain::forward_dynamics_batch`] |
//! | get torques from accelerations | [`Chain::inverse_dynamics`], [`Chain::inverse_dynamics_batch`] |
//! | get the inertia matrix | [`Chain::mass_matrix`], [`Chain::mass_matrix_batch`] |
//! | get the torques as linear in the links' inertias | [`Chain::regressor`], [`Chain::inertial_parameters`] |
//! | get the derivatives of torques and accelerations | [`Chain::inverse_dynamics_derivatives`], [`Chain::forward_dynamics_derivatives`] |
//! | get the vibrations about rest | [`DrivenChain::linearised`], [`LinearisedChain::modes`] |
//! | give its joints motors, springs and friction | [`DrivenChain`], [`ChainDrive`] |
//! | make links beams that bend | [`segmented`], [`Beam`] |
//! | get the motors' torques for a motion of the links | [`DrivenChain::needed_drives`] |
//! | run it in time | [`simulate_chain`] |
//! | move its base on a given path | [`ChainSimulation::base_motion`], [`BaseMotion`] |
//! | take one that is ready to use | [`ChainPreset`] |
//! | get energy and momentum | [`Chain::energy`], [`Chain::centroidal_momentum`] |
//!
//! The model stays the same; what the passes write is in a [`ChainData`], so that a call allocates nothing. SI units. The order of
//! positions and velocities is that of [`Chain`].
//!
//! Source: R. Featherstone, *Rigid Body Dynamics Algorithms*, Springer 2008.
//!
//! ```
//! use flexure::manipulator::chain::{Base, Chain, ChainLink, ChainParameters, JointMotion, LinkInertia};
//!
//! // A pendulum of 2 kg, 0.5 m below its pivot.
//! let parameters = ChainParameters {
//!     base_name: "base".to_owned(),
//!     base: Base::Fixed,
//!     base_inertia: None,
//!     links: vec![ChainLink {
//!         name: "rod".to_owned(),
//!         joint: "pivot".to_owned(),
//!         parent: None,
//!         motion: JointMotion::Revolute,
//!         axis: [0.0, 1.0, 0.0],
//!         rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
//!         translation: [0.0; 3],
//!         inertia: Some(LinkInertia { mass: 2.0, com: [0.0, 0.0, -0.5], matrix: [[0.0; 3]; 3] }),
//!         limits: [f64::NEG_INFINITY, f64::INFINITY],
//!     }],
//!     gravity: [0.0, 0.0, -9.81],
//! };
//! let chain = Chain::new(&parameters)?;
//! let mut data = chain.data();
//! let mut a = [0.0];
//! chain.forward_dynamics(&mut data, &[0.3], &[0.0], &[0.0], &mut a)?;
//! assert!((a[0] + 9.81 / 0.5 * 0.3f64.sin()).abs() < 1e-13);
//! # Ok::<(), flexure::Error>(())
//! ```

mod aba;
mod base_motion;
#[cfg(test)]
mod base_motion_tests;
mod batch;
mod beam;
mod crba;
mod data;
mod derivatives;
#[cfg(test)]
mod derivatives_tests;
mod drive;
mod drives;
#[cfg(test)]
mod drives_tests;
mod linearised;
mod model;
mod needed;
mod presets;
mod problem;
mod regressor;
mod rnea;
mod segments;
#[cfg(test)]
mod segments_tests;
mod simulate;
#[cfg(test)]
mod simulate_tests;
mod skeleton;
mod spatial;
#[cfg(test)]
mod stiff_tests;
#[cfg(test)]
mod tests;
mod vector;

pub use base_motion::{BaseMotion, BaseState};
pub use beam::Beam;
pub use data::ChainData;
pub use derivatives::ForwardDerivatives;
pub(super) use drive::Drive;
pub use drive::{ChainDrive, RotorCoupling};
pub use drives::{DrivenChain, DrivenData, DrivenState};
pub(super) use linearised::check_rest;
pub use linearised::{ChainMode, LinearisedChain, Motors};
pub use model::{Base, Chain, ChainLink, ChainParameters, JointMotion, LinkInertia};
pub use needed::{JointPath, NeededDrive};
pub use presets::ChainPreset;
pub use problem::ChainProblem;
pub use regressor::INERTIAL_PARAMETERS;
pub use rnea::{CentroidalMomentum, ChainEnergy};
pub use segments::{SegmentedBeam, SpringPlacement, segmented};
pub(super) use simulate::HeldRun;
pub use simulate::{ChainSimulation, chain_columns, simulate_chain, simulate_chain_watched};
