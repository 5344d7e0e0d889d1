//! The three block-oriented views of a joint (Krzyzak & Sasiadek, section VIII), each on a simulated record with known truth.

mod stiffness;

use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure::linear::TransferFunction;
use flexure::manipulator::{Friction, Stiffness, add_noise};
use flexure_io::arm::{Amplitude, ArmFile, DriveKind, Excitation, Kind, preset_text};
use flexure_io::{RecordFile, check_writable, read_record, write_record};
use flexure_workbench::systems::{Decoration, Identified, Truth};
use serde_json::{Value, json};

use super::{JOINT, PRESET, alignment, nonlinearity, steady_velocity};
use crate::identify::{hammerstein, write_files};
use crate::output::{command_line, print};
use crate::simulate::simulate;

/// Noise of a torque or a velocity, as a share of its root mean square.
const NOISE: f64 = 0.01;

/// How much slower than the preset's the torque of job 3 is.
const SLOWER: f64 = 3.0;

/// A view: its name, what it found beside the truth, and the words for it.
struct View {
    name: &'static str,
    values: Value,
    lines: Vec<String>,
}

/// Simulates, identifies and writes all three views into the folder.
pub fn run(out: &Path, json: bool) -> Result<()> {
    let files = |view: &str| ["csv", "html"].map(|kind| out.join(format!("{view}.{kind}")));
    let names = ["1-stiffness", "2-deflection-to-velocity", "3-torque-to-velocity"];
    for path in names.iter().flat_map(|name| files(name)) {
        check_writable(&path)?;
    }
    let command = command_line(["demo".into(), "--joint-views".into(), "--out".into(), out.into()]);
    let views = [
        stiffness::view(&files(names[0]), &command)?,
        deflection(&files(names[1]), &command)?,
        torque(&files(names[2]), &command)?,
    ];
    if json {
        let object: serde_json::Map<String, Value> = views
            .into_iter()
            .map(|view| (view.name.to_owned(), view.values))
            .collect();
        return print(&Value::Object(object).to_string());
    }
    let mut lines = Vec::new();
    for (view, name) in views.into_iter().zip(names) {
        lines.extend(view.lines);
        lines.extend(files(name).iter().map(|path| format!("  wrote {}", path.display())));
    }
    print(&lines.join("\n"))
}

/// The arm of the preset, with another run and excitation.
fn arm(duration: f64, sample_time: f64, excitation: Excitation) -> Result<ArmFile> {
    let mut arm = ArmFile::from_toml_str(preset_text(PRESET)?, &format!("preset {PRESET}"))?;
    arm.run.duration = duration;
    arm.run.sample_time = sample_time;
    arm.excitation = excitation;
    arm.noise = None;
    Ok(arm)
}

/// The true stiffness of the elbow.
fn true_stiffness(arm: &ArmFile) -> Stiffness {
    arm.arm.joints[JOINT].nonlinear_stiffness()
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt()
}

/// Root mean square of `y` less `truth`, as a share of the truth's own.
fn distance(y: &[f64], truth: &[f64]) -> f64 {
    let off: Vec<f64> = y.iter().zip(truth).map(|(a, b)| a - b).collect();
    rms(&off) / rms(truth)
}

/// Simulates a record with noise on the velocity, writes it, and identifies a Hammerstein model from `input` to it.
fn identified(arm: &ArmFile, input: &str, record: &Path) -> Result<(RecordFile, Identified)> {
    let mut log = simulate(arm, Path::new(""))?;
    if arm.noise.is_none() {
        let size = NOISE * rms(log.column("dq2")?);
        log = add_noise(&log, 1, &[("dq2", size)])?;
    }
    let both = log.column("qm2")?.iter().zip(log.column("q2")?);
    let d: Vec<f64> = both.map(|(m, q)| m - q).collect();
    log.push("d2", d)?;
    write_record(record, &log)?;
    let file = read_record(record)?;
    let identified = hammerstein(&file, input, "dq2", arm.run.sample_time)?;
    Ok((file, identified))
}

/// Job 2: deflection to link velocity with viscous friction, exactly a Hammerstein system.
fn deflection([record, report]: &[PathBuf; 2], command: &str) -> Result<View> {
    let step = 4.0;
    let mut arm = arm(
        4000.0 * step,
        step,
        Excitation {
            kind: Kind::White,
            drive: DriveKind::Deflection,
            amplitude: Some(Amplitude::Same(0.3)),
            ..Excitation::zero()
        },
    )?;
    let viscous = arm.arm.joints[JOINT].friction.unwrap_or_default().0[5];
    arm.arm.joints[JOINT].friction = Some(Friction([0.0, 0.0, 0.0, 0.0, 0.0, viscous]));
    let inertia = flexure::manipulator::LinkDynamics::new(&arm.arm.links).elbow;
    let kappa = true_stiffness(&arm);
    let (file, identified) = identified(&arm, "d2", record)?;
    let pole = (-viscous * step / inertia).exp();
    let linear = identified.result.linear("linear");
    let found = linear.and_then(TransferFunction::poles).unwrap_or_default();
    let nearest = found
        .iter()
        .map(|p| p.re)
        .min_by(|a, b| (a - pole).abs().total_cmp(&(b - pole).abs()));
    let nearest = nearest.unwrap_or(f64::NAN);
    // With a static gain of 1, the nonlinearity is the velocity at which friction takes up the elastic torque.
    let curve = nonlinearity(&identified)?;
    let truth: Vec<f64> = curve.x().iter().map(|&d| kappa.torque(d) / viscous).collect();
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
            phi: Box::new(move |d| kappa.torque(d) / viscous),
            label: "simulated stiffness torque (10)-(11) over g6, not aligned".to_owned(),
        }),
        remark: Some(format!("The pole is {nearest:.5}; exp(-g6 T / M) is {pole:.5}.")),
        arm: None,
        approximation: None,
    };
    view(
        "deflection",
        report,
        (&file, &identified),
        decoration,
        lines,
        json!({
            "error": error,
            "pole": nearest,
            "true_pole": pole,
        }),
    )
}

/// Job 3: torque, sampled slowly, to link velocity: friction as a dead zone, an approximation.
///
/// The preset holds each torque as long as viscous friction takes to stop the link (M / g6): the link is still on its way to the
/// velocity of that torque when it is sampled, and comes the farther the less it rubs. Three times as long, and it has
/// nearly arrived.
fn torque([record, report]: &[PathBuf; 2], command: &str) -> Result<View> {
    let mut arm = ArmFile::from_toml_str(preset_text(PRESET)?, &format!("preset {PRESET}"))?;
    arm.run.duration *= 0.5 * SLOWER;
    arm.run.sample_time *= SLOWER;
    let friction = arm.arm.joints[JOINT].friction.unwrap_or_default();
    let (file, identified) = identified(&arm, "tau2", record)?;
    let curve = nonlinearity(&identified)?;
    let [a, b] = alignment(curve, &friction);
    let truth: Vec<f64> = curve
        .x()
        .iter()
        .map(|&tau| a * steady_velocity(&friction, tau) + b)
        .collect();
    let error = distance(curve.y(), &truth);
    let mut lines = vec![
        "Job 3, approximation: torque, sampled slowly, to link velocity".to_owned(),
        format!(
            "  distance from the steady velocity under friction, a dead zone, {:.2} % after alignment",
            100.0 * error
        ),
    ];
    if !identified.result.verdict.holds() {
        lines.push(
            "  the model is refuted, as it should be: friction acts on the velocity, which is feedback, not a static block ahead of \
             the dynamics; near the dead zone's edges the link stops the sooner the slower it is, which no fixed pole can follow"
                .to_owned(),
        );
    }
    let values = json!({ "error": error, "holds": identified.result.verdict.holds(), "verdict": identified.result.verdict.words() });
    let decoration = Decoration {
        title: Some("Job 3: from slow torque to velocity, the dead zone of friction".to_owned()),
        command: Some(command.to_owned()),
        truth: Some(Truth {
            phi: Box::new(move |tau| a * steady_velocity(&friction, tau) + b),
            label: "steady velocity under the simulated friction (12), scaled and shifted onto the estimate".to_owned(),
        }),
        remark: (!identified.result.verdict.holds()).then(|| {
            "That is as it should be: friction acts on the velocity, which is feedback, and a static nonlinearity before a linear \
             part can only come near it."
                .to_owned()
        }),
        arm: None,
        approximation: None,
    };
    view("torque", report, (&file, &identified), decoration, lines, values)
}

fn view(
    name: &'static str,
    report: &PathBuf,
    (file, identified): (&RecordFile, &Identified),
    decoration: Decoration,
    mut lines: Vec<String>,
    mut values: Value,
) -> Result<View> {
    values["fit_percent"] = json!(identified.result.verdict.measures.fit_percent);
    lines.extend(identified.summary().lines().map(|line| format!("  {line}")));
    let page = identified.page(file, decoration)?;
    write_files(None, Some((report, page)))?;
    Ok(View { name, values, lines })
}
