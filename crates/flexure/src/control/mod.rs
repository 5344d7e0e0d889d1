//! Control and estimation of the arm with flexible joints.
//!
//! A [`Plant`] moves, sensors read it, an [`Estimator`] computes a state from the readings, and a [`Controller`] answers with torques.
//! [`run_loop`] joins them at a sample time, with delay, quantisation, noise and limits. The result is a record.
//!
//! | item | what | source |
//! |---|---|---|
//! | [`Jet`] | a signal with its derivatives | Griewank & Walther |
//! | [`TipPath`], [`JointMoves`], [`square`] | motions to follow, smooth to six derivatives | |
//! | [`inverse_motion`] | the torque of a motion | Spong 1987; De Luca & Lucibello 1998 |
//! | [`shaping`] | ZV, ZVD and EI shapers, also along the way | Singer & Seering 1990; Singhose 1994 |
//! | [`controllers`] | feedforward with PD, feedback linearisation, LQG, adaptive, fuzzy, any linear system | see there |
//! | [`flexible_link`] | a single flexible link, and its model-reference adaptive control | Sasiadek & Srinivasan 1989 |
//! | [`estimation`] | extended, unscented and fuzzy-adaptive Kalman filters, their consistency | see there |
//! | [`riccati`] | the discrete algebraic Riccati equation | |
//! | [`recursive`] | models that learn sample by sample, and detectors of change | see there |
//! | [`run_loop`], [`Figures`] | the loop, and the figures of a run | |
//!
//! ```
//! use flexure::control::controllers::{Feedforward, Gains};
//! use flexure::control::{Figures, JointMoves, LoopOptions, run_loop, Exact, Trajectory};
//! use flexure::manipulator::{Arm, JointKind, space_arm};
//!
//! let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
//! let moves = JointMoves::new(&[[0.0, 1.0], [0.5, 1.5]], 4.0, 0.0)?;
//! let mut controller = Feedforward::new(arm, Gains::new([1000.0; 2], [50.0; 2])?);
//! let options = LoopOptions::new(5.0, 0.01)?;
//! let run = run_loop(&arm, &mut controller, &mut Exact, &moves, &options)?;
//! assert!(Figures::new(&run, &arm.parameters().links, moves.end()).tip_error_max < 1e-3);
//! # Ok::<(), flexure::Error>(())
//! ```

mod closed_loop;
#[cfg(test)]
mod closed_loop_tests;
pub mod controllers;
pub mod estimation;
mod figures;
pub mod flexible_link;
mod inversion;
mod jet;
mod linearised;
pub mod recursive;
pub mod riccati;
pub mod shaping;
mod trajectory;

pub use closed_loop::{
    Controller, Differences, Encoders, Estimator, Exact, LoopOptions, Measured, Moment, Plant, Run, run_loop,
    run_loop_watched,
};
pub use figures::Figures;
pub use inversion::{InverseMotion, inverse_motion, link_torque};
pub use jet::{COEFFICIENTS, Jet};
pub use linearised::{LinearisedArm, held_frequencies};
pub use trajectory::{JointMoves, TipPath, Trajectory, TurnCounted, square, tip};
