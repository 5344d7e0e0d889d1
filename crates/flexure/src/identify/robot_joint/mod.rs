//! Friction, stiffness and inertia of a joint from its logs (Krzyzak & Sasiadek, section VIII).
//!
//! The structure of the equations of motion is known, the curves in them are not: with d = qm - q,
//!
//! $$ \tau = J_m \ddot q_m + \kappa(d), \qquad \kappa(d) = M \ddot q + f(\dot q), $$
//!
//! or for a rigid axis $\tau = M \ddot q + f(\dot q)$. This is linear in the inertias, with free curves kappa and f: a partially linear
//! model with additive curves (Robinson 1988; by series, Donald & Newey 1994). Noisy angles are not differentiated twice: the equations are
//! multiplied by a window and Fourier transformed, which moves the derivatives to the window. Each equation is weighted by its noise at
//! each frequency: the torque's noise, which is white, and the encoders', which grows with the square of the frequency in an acceleration.
//!
//! The physical forms, friction (12) and stiffness (10)-(11) as well as textbook ones, are fitted to the same equations with the same
//! weights. They are tested against added splines of a fixed division; a form whose lack of fit has p < [`REFUTED`] is refuted.
//!
//! Each form is fitted while all other curves are free, from many starts, in equations condensed to inner products; a parameter is reported
//! as not identifiable if, by the likelihood's profile, values far away fit as well. Where free frictions leave the spring a wind-up or refute
//! all its forms, its forms are fitted beside frictions in forms, if Schwarz's criterion prefers that. The test for lack of fit and all
//! standard errors allow for noise with another spectrum than the weights; the standard errors also allow for noise in bursts.
//!
//! A joint is flexible if the torque explains a deflection of three times the encoders' noise, beyond the effect of an offset of their
//! clocks. A torque that stands still at its extremes, with noise or without, is clipped: the estimates then have no standard error.
//!
//! Friction at the motor, damping of the joint, late samples of the link, gravity and memory explain each other in part. All of them are
//! estimated together. A single joint gets the smallest set that is not refuted against all of them; an effect is no fact if another one
//! can replace it equally well.
//!
//! The division of a free curve follows from all equations together (Akaike's criterion, then the next finer division). Its band allows for
//! the change by the division after that, and the residuals' noise for the part that the curves absorbed. How often 95 % bands then cover
//! the truth, and how often true forms are refuted, is measured by `cargo run --release -p flexure --example joint_bands`.
//!
//! The forms are fitted to the equations of motion. The best form of a rigid axis is also polished by the simulated motion: least squares of
//! its free run's error. On the electro-mechanical positioning system (EMPS; Janot, Gautier & Brunot 2019) that gives a mass and a viscous
//! friction that differ by 2 and 4 % from the published ones, so the equations' result is reported too. The free run's error is mostly an
//! offset that changes with time, which no constant can follow, and a viscous friction that differs by direction.
//!
//! How the torque of a flexible joint divides between motor and spring depends on a small difference of two angles. Noise of the encoders, or a body
//! that sticks, can shift the inertias from one side to the other by many standard errors. So stretches of a few periods are simulated too. Where
//! this determines the motor's inertia better than the equations, or contradicts them, the equations are solved again with it. The test
//! `stretches` measures both on simulated joints.
//!
//! | item | what |
//! |---|---|
//! | [`RigidJoint`] | position and torque: a rigid axis |
//! | [`FlexibleJoint`] | motor and link position and torque: a flexible joint |
//! | [`TwoLinkLog`] | both motor and link angles and torques: a two-link arm with its coupling |
//! | [`JointLoad`] | what gravity and the other joints of a chain add, for both |
//! | [`RigidAxis`], [`FlexibleAxis`], [`TwoLinkArm`] | the results |
//! | [`Effect`] | further effects of a joint: friction at the motor, damping, late samples, gravity, memory |
//! | [`Finding`] | what to know before trusting them |
//!
//! The files, in the order of the method:
//!
//! | file | what it is for |
//! |---|---|
//! | `rigid.rs`, `flexible.rs`, `two_link/` | the three kinds of log: their equations put together, and the result |
//! | `joint_signals.rs`, `two_link/links.rs` | the equations of one flexible joint, and of two links: (4)-(7) under the motors' (8)-(9) |
//! | `limits.rs` | every threshold |
//! | `checks.rs` | refusals and warnings about a log |
//! | `smooth.rs` | the noise of an encoder from its spectrum; zero-phase smoothing; shifts by a part of a sample |
//! | `rates.rs` | velocity and acceleration from positions |
//! | `fourier.rs` | modulated Fourier integrals: derivatives without differentiating |
//! | `motion.rs` | a log with the noise of its encoders, and the frequencies of the equations |
//! | `chain_load.rs` | the load that gravity and the other joints of a chain are for a joint |
//! | `compliance.rs` | whether the joint is flexible |
//! | `stiff.rs` | the difference between motor and link if it is nearly all an offset of the clocks |
//! | `clock_offset.rs`, `clocks.rs` | offsets of the clocks of torque and encoders, and how they are estimated |
//! | `effects.rs`, `explanations.rs` | further effects on a joint; which of them a log shows, and what explains it equally well |
//! | `basis.rs` | the splines of a free curve |
//! | `system.rs`, `layout.rs` | equations of motion with unknown factors and curves, and the order of the unknowns |
//! | `equations.rs`, `normal.rs` | weighted least squares over complex equations; scaled normal equations |
//! | `column_noise.rs` | the contribution of the encoders' noise to the inner products of noisy columns |
//! | `covariance.rs`, `bursts.rs` | standard errors for noise of any spectrum, and for noise in bursts |
//! | `division.rs` | the choice of the free curves' intervals |
//! | `free_outcome.rs` | the solution with free curves: factors with standard errors, curves with bands |
//! | `forms.rs`, `candidates.rs` | the physical forms: stiffness (10)-(11), friction (12), textbook forms; the starts of their searches |
//! | `condensed.rs`, `form_fit.rs` | the search in equations condensed to inner products, and the fit in the equations themselves |
//! | `lack_of_fit.rs`, `profile.rs` | the test of a form; intervals by the likelihood's profile |
//! | `parameters.rs`, `joint_forms.rs` | which parameters the data determine; the forms of all curves together |
//! | `flexible_outcome.rs` | the result of a flexible joint from the solution |
//! | `outcome.rs`, `finding.rs` | the results, with the names of the effects, and what to know before trusting them |
//! | `replay.rs`, `polish.rs` | the simulated motion of an identified axis; the parameters refined by its error |
//! | `stretches.rs` | the motor's inertia of a flexible joint from stretches of its simulated motion |
//! | `presliding.rs` | whether friction turns over a distance, or at once: both are simulated |
//! | `kinks.rs`, `reversals.rs` | velocities with their kinks where friction jumps |
//! | `passages.rs` | the motion of a rigid axis near rest, simulated within samples |
//! | `acting.rs`, `held_torque.rs` | how the samples of a torque act: at once or held; which of these a rigid axis shows |
//! | `rests.rs` | times at which a body sticks, which say nothing about its friction |
//! | `prediction.rs` | the torque that another motion of the joint needs |

mod acting;
mod basis;
mod bursts;
mod candidates;
mod chain_load;
mod checks;
mod clock_offset;
mod clocks;
mod column_noise;
mod compliance;
mod condensed;
mod covariance;
mod division;
mod effects;
mod equations;
mod explanations;
mod finding;
mod flexible;
mod flexible_outcome;
mod form_fit;
mod forms;
mod fourier;
mod free_outcome;
mod held_torque;
mod joint_forms;
mod joint_signals;
mod kinks;
mod lack_of_fit;
mod layout;
mod limits;
mod motion;
mod normal;
mod outcome;
mod parameters;
mod passages;
mod polish;
mod prediction;
mod presliding;
mod profile;
mod rates;
mod replay;
mod rests;
mod reversals;
mod rigid;
mod smooth;
mod stiff;
mod stretches;
mod system;
mod two_link;

#[cfg(test)]
mod tests;

pub use chain_load::JointLoad;
pub use checks::gear_ratio;
pub use finding::Finding;
pub use flexible::FlexibleJoint;
pub use forms::FormName;
pub use limits::REFUTED;
pub use outcome::{
    ChainFit, Effect, Estimated, Fitted, FlexibleAxis, IdentifiedCurve, IdentifiedJoint, JointModel, LackOfFit,
    Parameter, Polished, RigidAxis, StiffJoint,
};
pub use prediction::{JointMotion, NeededTorque};
pub use replay::AxisDrive;
pub use rigid::{Extra, RigidJoint};
pub use two_link::{TwoLinkArm, TwoLinkLog};
