//! A two-link arm on the command line.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use flexure::identify::robot_joint::{Estimated, TwoLinkArm, TwoLinkLog};
use flexure::manipulator::{
    Arm, ArmParameters, Drive, Link, LinkDynamics, Model, Parts, SimulationOptions, State, simulate,
};
use flexure_io::arm::Excitation;
use flexure_io::{RecordFile, check_record_writable, write_atomically, write_record};
use serde_json::json;

use super::arm::{beside, joint, recorded, text};
use super::data::{ArmLog, possible, renamed};
use super::flexible::{axis_json, axis_words, stiffness};
use super::words::{findings, nearness, with_error};
use super::{Arguments, page, rigid};
use crate::output::{command_line, print};
use crate::progress::spinning;
use crate::simulate::read_arm;

/// What an arm file without a template says of its links.
const PLACEHOLDERS: &str = "\
# A log tells three constants of the links, not their masses, lengths and centres of mass: those below are one choice with these
# constants, and move in the same way. For the true ones give lengths and centres of mass by --template.

";

/// The identified arm under its recorded torques.
#[derive(serde::Serialize)]
pub struct Replay {
    /// The links' angles, rad.
    #[serde(skip)]
    pub link: [Vec<f64>; 2],
    /// The root mean square of measured less simulated, rad.
    pub rms: [f64; 2],
    /// 100 (1 - |q - qh| / |q - mean q|).
    pub fit_percent: [f64; 2],
    /// The same of the links' velocities.
    pub velocity_fit_percent: [f64; 2],
}

/// What was found of an arm, as JSON.
pub fn arm_json(arm: &TwoLinkArm) -> serde_json::Value {
    let [shoulder, elbow, coupling] = &arm.model;
    json!({
        "joint": "two_link_arm",
        "shoulder": arm.shoulder,
        "elbow": arm.elbow,
        "coupling": arm.coupling,
        "model": {
            "motor_inertia": arm.model_motors,
            "shoulder": shoulder,
            "elbow": elbow,
            "coupling": coupling,
        },
        "joints": arm.joints.iter().map(axis_json).collect::<Vec<_>>(),
    })
}

/// Runs the command for a two-link arm.
pub fn run(file: &RecordFile, columns: &[[String; 2]; 3], arguments: &Arguments) -> Result<()> {
    let curves = [&arguments.friction, &arguments.stiffness];
    for path in curves.into_iter().flatten() {
        (1..=2).try_for_each(|joint| check_record_writable(numbered(path, joint)))?;
    }
    let log = ArmLog::read(file, columns, arguments)?;
    let joints = TwoLinkLog {
        motor: slices(&log.motor),
        link: slices(&log.link),
        torque: slices(&log.torque),
        sample_time: log.sample_time,
        level: arguments.band,
    };
    let found = spinning("identifying", || joints.identify());
    let arm = found.map_err(|error| file.locate(named(error, columns)))?;
    checked(file, &arm)?;
    let replay = spinning("simulating", || replay(&arm, &log))?;
    let html = match &arguments.report {
        None => None,
        Some(path) => {
            let command = command_line(std::env::args_os().skip(1));
            let page = page::two_link(&arm, &log, replay.as_ref(), Some(command));
            Some((path, flexure_report::render_joint(&page).context("the report")?))
        }
    };
    let text = match &arguments.arm {
        None => None,
        Some(path) => {
            let template = arguments.template.as_ref().map(|path| read_arm(path)).transpose()?;
            let named = log.torque_constant == 1.0 && columns[2] == ["tau1", "tau2"];
            let excitation = match named && beside(arguments) {
                true => recorded(&log.file),
                false => Excitation::zero(),
            };
            let links = template.map(|file| file.arm.links);
            Some((path, arm_file(&arm, &log, links.as_ref(), excitation)?))
        }
    };
    let mut written = Vec::new();
    for (i, axis) in arm.joints.iter().enumerate() {
        if let Some(path) = &arguments.friction {
            written.push(numbered(path, i + 1));
            write_record(
                numbered(path, i + 1),
                &rigid::curve(&axis.friction, "velocity", "torque")?,
            )?;
        }
        if let Some(path) = &arguments.stiffness {
            written.push(numbered(path, i + 1));
            write_record(numbered(path, i + 1), &stiffness(axis)?)?;
        }
    }
    for (path, text) in [text, html].into_iter().flatten() {
        written.push(path.clone());
        write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    if arguments.json {
        let mut object = arm_json(&arm);
        object["samples"] = json!(log.link[0].len());
        object["sample_time"] = json!(log.sample_time);
        object["replay"] = json!(replay);
        object["written"] = json!(written.iter().map(|p| p.display().to_string()).collect::<Vec<_>>());
        return print(&object.to_string());
    }
    let mut lines = words(&arm, &log, replay.as_ref());
    lines.extend(written.iter().map(|path| format!("wrote {}", path.display())));
    print(&lines.join("\n"))
}

/// Refuses an arm whose inertias are impossible.
pub fn checked(file: &RecordFile, arm: &TwoLinkArm) -> Result<()> {
    let links = [("shoulder's inertia", &arm.shoulder), ("elbow's inertia", &arm.elbow)];
    let motors = arm.joints.iter().map(|axis| ("motor's inertia", &axis.motor_inertia));
    possible(file, links.into_iter().chain(motors))
}

/// The constants of the links by what they are.
pub fn constants(arm: &TwoLinkArm) -> [(&'static str, &'static str, Estimated); 3] {
    [
        ("shoulder", "m1 lc1^2 + m2 (l1^2 + lc2^2) + I1 + I2", arm.shoulder),
        ("elbow", "m2 lc2^2 + I2", arm.elbow),
        ("coupling", "m2 l1 lc2", arm.coupling),
    ]
}

fn words(arm: &TwoLinkArm, log: &ArmLog, replay: Option<&Replay>) -> Vec<String> {
    let mut lines = vec![format!(
        "Two-link arm from {} samples of {}",
        log.link[0].len(),
        log.file
    )];
    for (name, formula, value) in constants(arm) {
        let value = with_error(value.value, value.standard_error);
        lines.push(format!("  {name:<14} {value} kg m^2  ({formula})"));
    }
    for (i, axis) in arm.joints.iter().enumerate() {
        lines.push(format!("Joint {}", i + 1));
        lines.extend(axis_words(axis, "M at q2 = 0"));
        if let Some(replay) = replay {
            lines.push(format!(
                "  simulated under the recorded torques: link angle {}; link velocity fit {:.2} %",
                nearness(replay.rms[i], replay.fit_percent[i], "rad"),
                replay.velocity_fit_percent[i]
            ));
        }
        lines.extend(findings(&axis.findings));
    }
    lines
}

/// The library's names of columns as the file has them.
fn named(error: flexure::Error, columns: &[[String; 2]; 3]) -> flexure::Error {
    renamed(error, |column| {
        let parts = column.split_once(' ');
        let kind = parts.and_then(|(kind, _)| ["motor", "link", "torque"].iter().position(|k| *k == kind));
        match (kind, parts.map(|(_, joint)| joint)) {
            (Some(kind), Some("1")) => columns[kind][0].clone(),
            (Some(kind), Some("2")) => columns[kind][1].clone(),
            _ => column,
        }
    })
}

/// The path with the joint's number before its extension.
fn numbered(path: &Path, joint: usize) -> PathBuf {
    let stem = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let extension = path
        .extension()
        .map(|e| format!(".{}", e.to_string_lossy()))
        .unwrap_or_default();
    path.with_file_name(format!("{stem}-{joint}{extension}"))
}

/// Links that move with these constants: of the template's geometry, or of a first link as long as `length`.
///
/// Without a template, equal shares of shoulder and elbow inertia are in the second link's mass.
fn links(dynamics: LinkDynamics, template: Option<&[Link; 2]>) -> Result<[Link; 2]> {
    let LinkDynamics {
        shoulder,
        elbow,
        coupling,
    } = dynamics;
    let own = shoulder - elbow;
    if !(elbow > 0.0 && coupling > 0.0 && own * elbow > coupling * coupling) {
        bail!(
            "the links' constants (shoulder {shoulder}, elbow {elbow}, coupling {coupling} kg m^2) are those of no two links with \
             the centre of mass of link 2 ahead of the elbow; excite both joints more, with the elbow bent to all angles"
        );
    }
    let links = match template {
        Some([first, second]) => {
            let mass = coupling / (first.length * second.com);
            [
                Link {
                    inertia: own - mass * first.length.powi(2) - first.mass * first.com.powi(2),
                    ..*first
                },
                Link {
                    mass,
                    inertia: elbow - mass * second.com.powi(2),
                    ..*second
                },
            ]
        }
        None => {
            let share = coupling / (own * elbow).sqrt();
            let length = 1.0;
            let com = share * elbow * length / coupling;
            [
                Link {
                    mass: 1e-9,
                    length,
                    com: 0.0,
                    inertia: (1.0 - share) * own,
                },
                Link {
                    mass: coupling / (length * com),
                    length,
                    com,
                    inertia: (1.0 - share) * elbow,
                },
            ]
        }
    };
    if let Some((i, link)) = links
        .iter()
        .enumerate()
        .find(|(_, l)| !(l.inertia >= 0.0 && l.mass > 0.0))
    {
        bail!(
            "with the template's lengths and centres of mass, link {} would have a mass of {} kg and a moment of inertia of {} \
             kg m^2; check the template, or leave it out",
            i + 1,
            link.mass,
            link.inertia
        );
    }
    Ok(links)
}

fn parameters(arm: &TwoLinkArm, template: Option<&[Link; 2]>) -> Result<ArmParameters> {
    let [shoulder, elbow, coupling] = arm.model.map(|e| e.value);
    let mut joints = [joint(&arm.joints[0]), joint(&arm.joints[1])];
    for (joint, inertia) in joints.iter_mut().zip(arm.model_motors) {
        joint.motor_inertia = inertia.value;
    }
    Ok(ArmParameters {
        model: Model::Nonlinear,
        links: links(
            LinkDynamics {
                shoulder,
                elbow,
                coupling,
            },
            template,
        )?,
        joints,
        parts: Parts::of(Model::Nonlinear),
    })
}

fn initial(arm: &TwoLinkArm, log: &ArmLog) -> State {
    let dq = [0, 1].map(|i| arm.joints[i].velocity[0]);
    State {
        q: [0, 1].map(|i| log.link[i][0]),
        qm: [0, 1].map(|i| log.motor[i][0]),
        dq,
        dqm: dq,
    }
}

/// Simulates the arm under its recorded torques, held from sample to sample; `None` where that fails.
pub fn replay(found: &TwoLinkArm, log: &ArmLog) -> Result<Option<Replay>> {
    let Ok(arm) = parameters(found, None).and_then(|p| Ok(Arm::new(p)?)) else {
        return Ok(None);
    };
    let n = log.link[0].len();
    let options = SimulationOptions {
        initial: initial(found, log),
        ..SimulationOptions::new((n - 1) as f64 * log.sample_time, log.sample_time)?
    };
    // Rounding may make the last row one too many.
    let mut torque = log.torque.clone();
    torque.iter_mut().for_each(|t| t.resize(options.sampling.rows(), 0.0));
    let Ok(record) = simulate(&arm, &Drive::Held([&torque[0], &torque[1]]), &options) else {
        return Ok(None);
    };
    let columns = |names: [&str; 2]| -> Result<[Vec<f64>; 2]> {
        Ok([record.column(names[0])?.to_vec(), record.column(names[1])?.to_vec()])
    };
    let (link, velocity) = (columns(["q1", "q2"])?, columns(["dq1", "dq2"])?);
    let angles = [0, 1].map(|i| rigid::fit(&log.link[i], &link[i]));
    Ok(Some(Replay {
        rms: angles.map(|a| a.0),
        fit_percent: angles.map(|a| a.1),
        velocity_fit_percent: [0, 1].map(|i| rigid::fit(&found.joints[i].velocity, &velocity[i]).1),
        link,
    }))
}

/// The text of the arm file: the arm, with these links' geometry if given, in the run of its record.
pub fn arm_file(
    found: &TwoLinkArm,
    log: &ArmLog,
    template: Option<&[Link; 2]>,
    excitation: Excitation,
) -> Result<String> {
    let placeholders = if template.is_none() { PLACEHOLDERS } else { "" };
    let arm = parameters(found, template)?;
    let run = (log.link[0].len(), log.sample_time);
    text(arm, initial(found, log), run, excitation).map(|text| format!("{placeholders}{text}"))
}

fn slices(columns: &[Vec<f64>; 2]) -> [&[f64]; 2] {
    [&columns[0], &columns[1]]
}
