//! A simulated space arm, identified: what `flexure demo` shows.

mod arm;
mod elbow;
mod stiffness;
mod views;

use anyhow::{Context as _, Result};
use flexure::manipulator::Friction;
use flexure::nonlinearity::Curve;
use flexure_io::arm::{ArmFile, preset};

use crate::systems::{Decoration, Identified, Truth};

pub use arm::{BothJoints, FreshRun, LOG_PRESET, logged_arm, under_fresh_torques};
pub use elbow::{ELBOW_COLUMNS, elbow_alone, elbow_decoration, elbow_summary};
pub use views::{Steps, VIEW_FILES, View, views};

/// The preset of the elbow's slow test; two of the three views use it.
const SLOW_PRESET: &str = "elbow-test";
/// The elbow.
const JOINT: usize = 1;

/// The arm whose elbow is tested slowly.
fn slow_arm() -> Result<ArmFile> {
    Ok(preset(SLOW_PRESET)?)
}

/// The true friction of the elbow.
fn friction(arm: &ArmFile) -> Friction {
    arm.arm.joints[JOINT].friction.unwrap_or_default()
}

/// The steady velocity under friction, for comparison with the nonlinearity of a model from torque to velocity.
fn beside_friction(friction: &Friction, identified: &Identified) -> Result<Decoration> {
    let remark = "That is as it should be: friction acts on the velocity, which is feedback, and a static nonlinearity before a \
                  linear part can only come near it.";
    Ok(Decoration {
        truth: Some(Truth {
            phi: Box::new(aligned_velocity(nonlinearity(identified)?, *friction)),
            label: "steady velocity under the simulated friction, scaled and shifted onto the estimate".to_owned(),
        }),
        remark: (!identified.result.verdict.holds()).then(|| remark.to_owned()),
        ..Decoration::default()
    })
}

/// The static nonlinearity of a Hammerstein model.
fn nonlinearity(identified: &Identified) -> Result<&Curve> {
    let curve = identified.result.curve("nonlinearity");
    curve.context("the model has no static nonlinearity")
}

/// The steady velocity under friction. Its scale and offset, which the data do not determine, are fitted to the estimate.
fn aligned_velocity(curve: &Curve, friction: Friction) -> impl Fn(f64) -> f64 + Send + use<> {
    let (x, y) = (curve.x(), curve.y());
    let truth: Vec<f64> = x.iter().map(|&tau| steady_velocity(&friction, tau)).collect();
    let n = x.len() as f64;
    let (mt, my) = (truth.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let spread: f64 = truth.iter().map(|t| (t - mt).powi(2)).sum();
    let joint: f64 = truth.iter().zip(y).map(|(t, y)| (t - mt) * (y - my)).sum();
    let scale = if spread > 0.0 { joint / spread } else { 0.0 };
    let offset = my - scale * mt;
    move |tau| scale * steady_velocity(&friction, tau) + offset
}

/// The velocity v at which friction (12) takes up the whole torque: f(v) = tau, by bisection.
fn steady_velocity(friction: &Friction, tau: f64) -> f64 {
    let viscous = friction.0[5];
    let (mut low, mut high) = (0.0, tau.abs() / viscous.max(f64::MIN_POSITIVE));
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        match friction.torque(middle) < tau.abs() {
            true => low = middle,
            false => high = middle,
        }
    }
    tau.signum() * low
}
