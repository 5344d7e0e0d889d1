//! The three block-oriented views of a joint (Krzyzak & Sasiadek, section VIII), each on a simulated record with known truth.

use anyhow::Result;
use flexure::Record;
use flexure::linear::TransferFunction;
use flexure::manipulator::{Friction, LinkDynamics, Stiffness, add_noise};
use flexure_io::RecordFile;
use flexure_io::arm::{Amplitude, ArmFile, DriveKind, Excitation, Kind};
use serde_json::{Value, json};

use super::{JOINT, aligned_velocity, beside_friction, friction, nonlinearity, slow_arm, stiffness};
use crate::lines::WIDTH;
use crate::systems::{Decoration, Identified, Truth};

/// Noise of a torque or a velocity, as a share of its root mean square.
pub(super) const NOISE: f64 = 0.01;
/// How much slower than the preset's the torque of job 3 is.
const SLOWER: f64 = 3.0;

/// The names of the views' files, without an extension.
pub const VIEW_FILES: [&str; 3] = ["1-stiffness", "2-deflection-to-velocity", "3-torque-to-velocity"];

/// A view: a record, and the model identified from it, compared with the truth.
pub struct View {
    /// Its name in JSON.
    pub name: &'static str,
    /// The simulated record.
    pub record: Record,
    /// How near the estimate is to the truth.
    pub json: Value,
    /// The same for a terminal.
    pub lines: Vec<String>,
    /// The page.
    pub html: String,
}

/// The long steps, which the caller makes under a progress display.
pub struct Steps {
    /// Simulates an arm.
    pub simulate: fn(&ArmFile) -> Result<Record>,
    /// Identifies a Hammerstein model from an input to an output of a record of this sample time.
    pub identify: fn(file: &RecordFile, input: &str, output: &str, sample_time: f64) -> Result<Identified>,
}

/// All three views.
pub fn views(steps: &Steps, command: &str) -> Result<[View; 3]> {
    Ok([
        stiffness::view(steps, command)?,
        deflection(steps, command)?,
        torque(steps, command)?,
    ])
}

/// The arm of the preset, with another run and excitation.
pub(super) fn arm_with(duration: f64, sample_time: f64, excitation: Excitation) -> Result<ArmFile> {
    let mut arm = slow_arm()?;
    arm.run.duration = duration;
    arm.run.sample_time = sample_time;
    arm.excitation = excitation;
    arm.noise = None;
    Ok(arm)
}

/// The true stiffness of the elbow.
pub(super) fn true_stiffness(arm: &ArmFile) -> Stiffness {
    arm.arm.joints[JOINT].nonlinear_stiffness()
}

pub(super) fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt()
}

/// Root mean square of `y` less `truth`, as a share of the truth's own.
pub(super) fn distance(y: &[f64], truth: &[f64]) -> f64 {
    let off: Vec<f64> = y.iter().zip(truth).map(|(a, b)| a - b).collect();
    rms(&off) / rms(truth)
}

/// A record and what was identified from it.
struct IdentifiedRecord {
    file: RecordFile,
    identified: Identified,
}

/// A Hammerstein model from `input` to the velocity, of a simulated record with noise on the velocity.
fn identified(steps: &Steps, arm: &ArmFile, input: &str, name: &str) -> Result<IdentifiedRecord> {
    let mut log = (steps.simulate)(arm)?;
    if arm.noise.is_none() {
        let size = NOISE * rms(log.column("dq2")?);
        log = add_noise(&log, 1, &[("dq2", size)])?;
    }
    let both = log.column("qm2")?.iter().zip(log.column("q2")?);
    let d: Vec<f64> = both.map(|(m, q)| m - q).collect();
    log.push("d2", d)?;
    let file = RecordFile::in_memory(log, &format!("{name}.csv"));
    Ok(IdentifiedRecord {
        identified: (steps.identify)(&file, input, "dq2", arm.run.sample_time)?,
        file,
    })
}

/// Job 2: deflection to link velocity with viscous friction, exactly a Hammerstein system.
fn deflection(steps: &Steps, command: &str) -> Result<View> {
    let step = 4.0;
    let excitation = Excitation {
        kind: Kind::White,
        drive: DriveKind::Deflection,
        amplitude: Some(Amplitude::Same(0.3)),
        ..Excitation::default()
    };
    let mut arm = arm_with(4000.0 * step, step, excitation)?;
    let viscous = friction(&arm).0[5];
    arm.arm.joints[JOINT].friction = Some(Friction([0.0, 0.0, 0.0, 0.0, 0.0, viscous]));
    let inertia = LinkDynamics::new(&arm.arm.links).elbow;
    let kappa = true_stiffness(&arm);
    let of_record = identified(steps, &arm, "d2", VIEW_FILES[1])?;
    let identified = &of_record.identified;
    let pole = (-viscous * step / inertia).exp();
    let poles = identified.result.linear("linear").and_then(TransferFunction::poles);
    let poles = poles.iter().flatten().map(|p| p.re);
    let nearest = poles.min_by(|a, b| (a - pole).abs().total_cmp(&(b - pole).abs()));
    let nearest = nearest.unwrap_or(f64::NAN);
    // With a static gain of 1, the nonlinearity is the velocity at which friction takes up the elastic torque.
    let phi = move |d| kappa.torque(d) / viscous;
    let curve = nonlinearity(identified)?;
    let truth: Vec<f64> = curve.x().iter().map(|&d| phi(d)).collect();
    let error = distance(curve.y(), &truth);
    let lines = vec![
        "Job 2, Hammerstein: commanded deflection to link velocity, viscous friction".to_owned(),
        format!(
            "  distance from the true curve k(d) d / g6 {:.2} %, nothing aligned",
            100.0 * error
        ),
        format!(
            "  pole {nearest:.5}, exp(-g6 T / M) = {pole:.5}: {:.2} % off",
            100.0 * (nearest / pole - 1.0).abs()
        ),
    ];
    let decoration = Decoration {
        title: Some("Job 2: from deflection to velocity, exactly a Hammerstein system".to_owned()),
        command: Some(command.to_owned()),
        truth: Some(Truth {
            phi: Box::new(phi),
            label: "simulated stiffness torque over g6, not aligned".to_owned(),
        }),
        remark: Some(format!("The pole is {nearest:.5}; exp(-g6 T / M) is {pole:.5}.")),
        ..Decoration::default()
    };
    let json = json!({ "error": error, "pole": nearest, "true_pole": pole });
    View::new("deflection", of_record, decoration, json, lines)
}

/// Job 3: torque, sampled slowly, to link velocity: friction as a dead zone, an approximation.
///
/// The preset holds each torque as long as viscous friction takes to stop the link (M / g6): when the link is sampled, it has not yet
/// reached the velocity of that torque, and it comes closer with less friction. Here each torque is held three times as long, so the
/// velocity is nearly reached.
fn torque(steps: &Steps, command: &str) -> Result<View> {
    let mut arm = slow_arm()?;
    arm.run.duration *= 0.5 * SLOWER;
    arm.run.sample_time *= SLOWER;
    let of_record = identified(steps, &arm, "tau2", VIEW_FILES[2])?;
    let identified = &of_record.identified;
    let curve = nonlinearity(identified)?;
    let phi = aligned_velocity(curve, friction(&arm));
    let truth: Vec<f64> = curve.x().iter().map(|&tau| phi(tau)).collect();
    let error = distance(curve.y(), &truth);
    let verdict = &identified.result.verdict;
    let mut lines = vec![
        "Job 3, approximation: torque, sampled slowly, to link velocity".to_owned(),
        format!(
            "  distance from the steady velocity under friction, a dead zone, {:.2} % after alignment",
            100.0 * error
        ),
    ];
    if !verdict.holds() {
        lines.push(
            "  the model is refuted, as it should be: friction acts on the velocity, which is feedback, not a static block ahead of \
             the dynamics; near the dead zone's edges the link stops the sooner the slower it is, which no fixed pole can follow"
                .to_owned(),
        );
    }
    let decoration = Decoration {
        title: Some("Job 3: from slow torque to velocity, the dead zone of friction".to_owned()),
        command: Some(command.to_owned()),
        ..beside_friction(&friction(&arm), identified)?
    };
    let json = json!({ "error": error, "holds": verdict.holds(), "verdict": verdict.text() });
    View::new("torque", of_record, decoration, json, lines)
}

impl View {
    /// A view of a model and the truth, with the model's fit.
    fn new(
        name: &'static str,
        of_record: IdentifiedRecord,
        decoration: Decoration,
        mut json: Value,
        mut lines: Vec<String>,
    ) -> Result<Self> {
        let IdentifiedRecord { file, identified } = of_record;
        json["fit_percent"] = json!(identified.result.verdict.measures.fit_percent);
        let summary = identified.summary().wrapped(WIDTH - 2);
        lines.extend(summary.lines().map(|line| format!("  {line}")));
        Ok(View {
            name,
            html: identified.html(&file, decoration)?,
            record: file.record,
            json,
            lines,
        })
    }
}
