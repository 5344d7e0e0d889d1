//! The elbow of a simulated space arm, identified: what `flexure demo` shows.

mod stiffness;
mod views;

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::manipulator::{Arm, Drive, Friction, SimulationOptions};
use flexure::nonlinearity::Curve;
use flexure_io::arm::{ArmFile, preset};
use flexure_report::data::ArmMotion;

use crate::systems::{Decoration, Identified, Truth, arm_motion};

pub use views::{Steps, VIEW_FILES, View, views};

/// The preset that is simulated.
pub const PRESET: &str = "elbow-test";
/// The elbow.
const JOINT: usize = 1;
/// Samples of the record that the page shows the arm moving through.
const SHOWN_SAMPLES: usize = 10;
/// Time between two pictures of the moving arm, s.
const FRAME: f64 = 0.05;

/// The arm of the preset.
pub fn arm() -> Result<ArmFile> {
    Ok(preset(PRESET)?)
}

/// The page's parts that only simulated data have: the true nonlinearity and the moving arm.
///
/// # Errors
/// For a model without a static nonlinearity.
pub fn decoration(arm: &ArmFile, record: &Record, identified: &Identified, command: String) -> Result<Decoration> {
    Ok(Decoration {
        title: Some("The elbow of a space arm: from torque to velocity".to_owned()),
        command: Some(command),
        arm: motion(arm, record)?,
        ..beside_friction(&friction(arm), identified)?
    })
}

/// The true friction of the elbow.
fn friction(arm: &ArmFile) -> Friction {
    arm.arm.joints[JOINT].friction.unwrap_or_default()
}

/// The steady velocity under friction beside the nonlinearity of a model from torque to velocity.
fn beside_friction(friction: &Friction, identified: &Identified) -> Result<Decoration> {
    let remark = "That is as it should be: friction acts on the velocity, which is feedback, and a static nonlinearity before a \
                  linear part can only come near it.";
    Ok(Decoration {
        truth: Some(Truth {
            phi: Box::new(aligned_velocity(nonlinearity(identified)?, *friction)),
            label: "steady velocity under the simulated friction (12), scaled and shifted onto the estimate".to_owned(),
        }),
        remark: (!identified.result.verdict.holds()).then(|| remark.to_owned()),
        ..Decoration::default()
    })
}

/// The beginning of the motion, simulated again with close samples, as the eye cannot follow an arm every 20 s.
fn motion(arm: &ArmFile, record: &Record) -> Result<Option<ArmMotion>> {
    let steps = (arm.run.sample_time / FRAME).round() as usize;
    let held = |column: &str| -> flexure::Result<Vec<f64>> {
        let torque = record.finite(column)?[..SHOWN_SAMPLES].iter();
        let frames = torque.flat_map(|&tau| std::iter::repeat_n(tau, steps));
        Ok(frames.chain([0.0]).collect())
    };
    let (tau1, tau2) = (held("tau1")?, held("tau2")?);
    let mut options = SimulationOptions::new(SHOWN_SAMPLES as f64 * arm.run.sample_time, FRAME)?;
    options.initial = arm.initial;
    let shown = flexure::manipulator::simulate(&Arm::new(arm.arm)?, &Drive::Held([&tau1, &tau2]), &options)?;
    let caption = format!(
        "The first {} s of the record, simulated again every {FRAME} s, seen from above the plane of motion.",
        options.sampling.instant(options.sampling.rows() - 1)
    );
    let lengths = arm.arm.links.map(|link| link.length);
    Ok(arm_motion(&shown, lengths, Some(FRAME), caption))
}

/// The static nonlinearity of a Hammerstein model.
fn nonlinearity(identified: &Identified) -> Result<&Curve> {
    let curve = identified.result.curve("nonlinearity");
    curve.context("the model has no static nonlinearity")
}

/// The steady velocity under friction, with the scale and offset, which the data do not determine, that lay it best onto the
/// estimate.
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
