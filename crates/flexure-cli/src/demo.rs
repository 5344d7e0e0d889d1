//! `flexure demo`: simulate the space arm, identify its elbow, show it.

mod views;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure::manipulator::{Arm, Drive, Friction, SimulationOptions};
use flexure::nonlinearity::Curve;
use flexure_io::arm::{ArmFile, preset_text};
use flexure_io::{RecordFile, check_writable, read_record, write_record};
use flexure_report::data::ArmMotion;
use flexure_workbench::systems::{Decoration, Identified, Truth, arm_motion};
use serde_json::json;

use crate::files::{write_text, wrote};
use crate::identify::{hammerstein, write_files};
use crate::output::{command_line, print};
use crate::simulate::simulate;

/// The preset that is simulated.
const PRESET: &str = "elbow-test";
/// The elbow.
const JOINT: usize = 1;
/// Samples of the record that the page shows the arm moving through.
const SHOWN_SAMPLES: usize = 10;
/// Time between two pictures of the moving arm, s.
const FRAME: f64 = 0.05;

/// Simulate the space arm, identify its elbow joint, and show it on one page.
///
/// The shoulder is locked and a white torque, held for 20 s a sample, drives the elbow; the friction in the joint then shows as
/// the dead zone of a Hammerstein model from torque to link velocity. DIR gets arm.toml, record.csv, model.json and report.html.
///
/// With --joint-views, the three ways of seeing the joint as a block-oriented system instead, a record and a page each: the static
/// regression of joint torque on deflection; commanded deflection to link velocity, exactly a Hammerstein system with the
/// stiffness as its nonlinearity; slow torque to velocity, where friction makes it an approximation.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  flexure demo --out flexure-demo\n  flexure demo --joint-views --out joint-views")]
pub struct Arguments {
    /// The folder for the results.
    #[arg(long, value_name = "DIR", default_value = "flexure-demo")]
    out: PathBuf,
    /// Show the joint's stiffness and friction in the three block-oriented views.
    #[arg(long)]
    joint_views: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    if out.exists() && !out.is_dir() {
        bail!("{}: is a file; --out takes a folder", out.display());
    }
    std::fs::create_dir_all(out).with_context(|| format!("{}: the folder cannot be made", out.display()))?;
    if arguments.joint_views {
        return views::run(out, arguments.json);
    }
    let text = preset_text(PRESET)?;
    let arm = ArmFile::from_toml_str(text, &format!("preset {PRESET}"))?;
    let paths: Vec<PathBuf> = ["arm.toml", "record.csv", "model.json", "report.html"]
        .iter()
        .map(|name| out.join(name))
        .collect();
    for path in &paths {
        check_writable(path)?;
    }
    write_text(&paths[0], text)?;
    write_record(&paths[1], &simulate(&arm, Path::new(""))?)?;

    // From here on, what `flexure identify` does with anybody's record.
    let record = read_record(&paths[1])?;
    let identified = hammerstein(&record, "tau2", "dq2", arm.run.sample_time)?;
    let decoration = decoration(&arm, &record, &identified, out)?;
    let page = identified.page(&record, decoration)?;
    write_files(Some((&paths[2], identified.model())), Some((&paths[3], page)))?;
    if arguments.json {
        let mut object = identified.json();
        object["files"] = json!(paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>());
        return print(&object.to_string());
    }
    let mut lines = vec![identified.summary()];
    lines.extend(wrote(&paths));
    lines.push(format!("open {} in a browser", paths[3].display()));
    print(&lines.join("\n"))
}

fn decoration(arm: &ArmFile, record: &RecordFile, identified: &Identified, out: &Path) -> Result<Decoration> {
    let friction = arm.arm.joints[JOINT].friction.unwrap_or_default();
    let [a, b] = alignment(nonlinearity(identified)?, &friction);
    Ok(Decoration {
        title: Some("The elbow of a space arm: from torque to velocity".to_owned()),
        command: Some(command_line(["demo".into(), "--out".into(), out.into()])),
        truth: Some(Truth {
            phi: Box::new(move |tau| a * steady_velocity(&friction, tau) + b),
            label: "steady velocity under the simulated friction (12), scaled and shifted onto the estimate".to_owned(),
        }),
        remark: Some(
            "That is as it should be: friction acts on the velocity, which is feedback, and a static nonlinearity before a \
             linear part can only come near it."
                .to_owned(),
        )
        .filter(|_| !identified.result.verdict.holds()),
        arm: motion(arm, &record.record)?,
        approximation: None,
    })
}

/// The beginning of the motion, simulated again with close samples, as the eye cannot follow an arm every 20 s.
fn motion(arm: &ArmFile, record: &Record) -> Result<Option<ArmMotion>> {
    let steps = (arm.run.sample_time / FRAME).round() as usize;
    let held = |column: &str| -> flexure::Result<Vec<f64>> {
        let torque = &record.finite(column)?[..SHOWN_SAMPLES];
        Ok(torque
            .iter()
            .flat_map(|&tau| std::iter::repeat_n(tau, steps))
            .chain([0.0])
            .collect())
    };
    let (tau1, tau2) = (held("tau1")?, held("tau2")?);
    let mut options = SimulationOptions::new(SHOWN_SAMPLES as f64 * arm.run.sample_time, FRAME)?;
    options.initial = arm.initial;
    let shown = flexure::manipulator::simulate(&Arm::new(arm.arm)?, &Drive::Held([&tau1, &tau2]), &options)?;
    let caption = format!(
        "The first {} s of the record, simulated again every {FRAME} s, seen from above the plane of motion.",
        options.sampling.instant(options.sampling.rows() - 1)
    );
    Ok(arm_motion(
        &shown,
        arm.arm.links.map(|link| link.length),
        Some(FRAME),
        caption,
    ))
}

/// The static nonlinearity of a Hammerstein model.
fn nonlinearity(identified: &Identified) -> Result<&Curve> {
    let curve = identified.result.curve("nonlinearity");
    curve.context("the model has no static nonlinearity")
}

/// The scale and offset, which the data cannot tell, that lay the truth best onto the estimate.
fn alignment(curve: &Curve, friction: &Friction) -> [f64; 2] {
    let (x, y) = (curve.x(), curve.y());
    let truth: Vec<f64> = x.iter().map(|&tau| steady_velocity(friction, tau)).collect();
    let n = x.len() as f64;
    let (mt, my) = (truth.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let spread: f64 = truth.iter().map(|t| (t - mt).powi(2)).sum();
    let joint: f64 = truth.iter().zip(y).map(|(t, y)| (t - mt) * (y - my)).sum();
    let a = if spread > 0.0 { joint / spread } else { 0.0 };
    [a, my - a * mt]
}

/// The velocity v at which friction (12) takes up the whole torque: f(v) = tau, by bisection.
fn steady_velocity(friction: &Friction, tau: f64) -> f64 {
    let viscous = friction.0[5];
    let (mut low, mut high) = (0.0, tau.abs() / viscous.max(f64::MIN_POSITIVE));
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if friction.torque(middle) < tau.abs() {
            low = middle;
        } else {
            high = middle;
        }
    }
    tau.signum() * low
}
