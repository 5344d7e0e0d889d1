//! A rigid axis on the command line.

use std::io::Write;

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::bands::Band;
use flexure::identify::robot_joint::{AxisDrive, Extra, Finding, RigidAxis, RigidJoint};
use flexure_io::{RecordFile, write_atomically, write_record};
use serde_json::json;

use super::Arguments;
use super::arm::{Place, possible_rigid, rigid_arm_file};
use super::data::{Log, possible, renamed};
use super::page;
use super::words::{Units, findings, fitted_json, fitted_words, nearness, range_words, with_error};
use crate::output::{command_line, print};
use crate::progress::spinning;

/// The motion of the identified axis beside the measured one.
pub struct Replay {
    /// In words: what drove it.
    pub drive: &'static str,
    /// The positions.
    pub position: Vec<f64>,
    /// The root mean square of measured less simulated.
    pub rms: f64,
    /// 100 (1 - |q - qh| / |q - mean q|).
    pub fit_percent: f64,
}

/// Runs the command for a rigid axis.
pub fn run(file: &RecordFile, log: &Log, arguments: &Arguments) -> Result<()> {
    if arguments.arm.is_some() {
        possible_rigid(arguments)?;
    }
    let mut extras = Vec::new();
    extras.extend(arguments.gravity.then_some(Extra::Gravity));
    extras.extend(arguments.spring.then_some(Extra::Spring));
    let joint = RigidJoint {
        position: &log.position,
        torque: &log.torque,
        velocity: log.velocity.as_deref(),
        sample_time: log.sample_time,
        extras: &extras,
        level: arguments.band,
    };
    let found = spinning("identifying", || joint.identify());
    let axis = found.map_err(|error| file.locate(named(error, arguments)))?;
    let axis = checked(file, axis, arguments.prismatic)?;
    tell(file, log, &axis, arguments)
}

/// The axis with what there is to be known of it, if its inertia is possible.
pub fn checked(file: &RecordFile, mut axis: RigidAxis, prismatic: bool) -> Result<RigidAxis> {
    if prismatic {
        // There are no turns to be counted in metres.
        axis.findings.retain(|f| !matches!(f, Finding::ManyTurns { .. }));
    }
    possible(file, [("inertia", &axis.inertia)])?;
    Ok(axis)
}

/// Writes and prints what was found of a rigid axis.
pub fn tell(file: &RecordFile, log: &Log, axis: &RigidAxis, arguments: &Arguments) -> Result<()> {
    let units = Units::of(arguments.prismatic);
    let replays = spinning("simulating", || replays(file, log, axis, arguments))?;
    let html = match &arguments.report {
        None => None,
        Some(path) => {
            let command = command_line(std::env::args_os().skip(1));
            let page = page::rigid(axis, log, &replays, &units, Some(command));
            Some((path, flexure_report::render_joint(&page).context("the report")?))
        }
    };
    let arm = match &arguments.arm {
        None => None,
        Some(path) => Some((
            path,
            rigid_arm_file(axis, log, Place::given(log, arguments)?, arguments.prismatic)?,
        )),
    };
    if let Some((path, text)) = &arm {
        write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    if let Some(path) = &arguments.friction {
        write_record(path, &curve(&axis.friction, "velocity", "torque")?)?;
    }
    if let Some((path, html)) = html {
        write_atomically(path, |out| out.write_all(html.as_bytes()))?;
    }
    if arguments.json {
        let shown = |p: &Option<std::path::PathBuf>| p.as_ref().map(|p| p.display().to_string());
        let replays: Vec<_> = replays
            .iter()
            .map(|r| json!({ "drive": r.drive, "rms": r.rms, "fit_percent": r.fit_percent }))
            .collect();
        let mut object = axis_json(axis, &units);
        object["samples"] = json!(log.position.len());
        object["sample_time"] = json!(log.sample_time);
        object["replays"] = json!(replays);
        object["friction_file"] = json!(shown(&arguments.friction));
        object["report"] = json!(shown(&arguments.report));
        object["arm"] = json!(shown(&arguments.arm));
        return print(&object.to_string());
    }
    let mut lines = vec![
        format!("Rigid axis from {} samples of {}", log.position.len(), log.file),
        format!(
            "  {:<12} {} {}  (beside the free friction curve)",
            "inertia",
            with_error(axis.inertia.value, axis.inertia.standard_error),
            units.inertia()
        ),
    ];
    let velocity = format!("{}/s", units.position);
    lines.push(range_words("friction", &axis.friction, &velocity));
    for extra in &axis.extras {
        let value = with_error(extra.value, extra.standard_error);
        lines.push(format!(
            "  {:<12} {value} {}",
            extra.symbol,
            units.of_curve(extra.unit, true)
        ));
    }
    for (i, form) in axis.forms.iter().enumerate() {
        lines.extend(fitted_words(form, &units, i == axis.best));
    }
    for replay in &replays {
        lines.push(format!(
            "  simulated {}: {}",
            replay.drive,
            nearness(replay.rms, replay.fit_percent, units.position)
        ));
    }
    lines.extend(findings(&axis.findings));
    if let Some(path) = &arguments.stiffness {
        lines.push(format!(
            "  note: {} is not written: no stiffness was seen",
            path.display()
        ));
    }
    let written = [&arguments.friction, &arguments.arm, &arguments.report]
        .into_iter()
        .flatten();
    lines.extend(written.map(|path| format!("wrote {}", path.display())));
    print(&lines.join("\n"))
}

/// What was found of an axis, as JSON.
pub fn axis_json(axis: &RigidAxis, units: &Units) -> serde_json::Value {
    json!({
        "joint": "rigid",
        "inertia": axis.inertia,
        "inertia_unit": units.inertia(),
        "friction": curve_json(&axis.friction),
        "extras": axis.extras,
        "forms": axis.forms.iter().map(|f| fitted_json(f, units, false)).collect::<Vec<_>>(),
        "best_form": axis.forms[axis.best].form,
        "cut_off": axis.cut_off,
        "highest_frequency": axis.highest,
        "findings": axis.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// The library's names of columns as the file has them.
pub fn named(error: flexure::Error, arguments: &Arguments) -> flexure::Error {
    renamed(error, |column| match column.as_str() {
        "position" => arguments.position.clone().unwrap_or(column),
        "link" => arguments.link.clone().unwrap_or(column),
        "motor" => arguments.motor.clone().unwrap_or(column),
        "torque" => arguments.torque.clone(),
        "velocity" => arguments.velocity.clone().unwrap_or(column),
        _ => column,
    })
}

/// The simulated motions: under the recorded torque, and in the recorded loop if there is one.
fn replays(file: &RecordFile, log: &Log, axis: &RigidAxis, arguments: &Arguments) -> Result<Vec<Replay>> {
    let mut replays = vec![replay(log, axis)];
    if let (Some(reference), Some(kp), Some(kv)) = (&arguments.reference, &arguments.kp, &arguments.kv) {
        let drive = AxisDrive::Loop {
            reference: file.finite(reference)?,
            kp: kp.value(file, "kp")?,
            kv: kv.value(file, "kv")?,
            torque_constant: log.torque_constant,
        };
        replays.push(driven(log, axis, "in the position loop", drive));
    }
    Ok(replays)
}

/// The simulated motion under the recorded torque.
pub fn replay(log: &Log, axis: &RigidAxis) -> Replay {
    driven(log, axis, "under the recorded torque", AxisDrive::Torque(&log.torque))
}

fn driven(log: &Log, axis: &RigidAxis, words: &'static str, drive: AxisDrive) -> Replay {
    let start = [log.position[0], axis.velocity[0]];
    let position = axis.replay(&axis.forms[axis.best], drive, start);
    let (rms, fit_percent) = fit(&log.position, &position);
    Replay {
        drive: words,
        position,
        rms,
        fit_percent,
    }
}

/// The root mean square of measured less simulated, and the fit in percent, over the samples that both have.
pub fn fit(measured: &[f64], simulated: &[f64]) -> (f64, f64) {
    let measured = &measured[..measured.len().min(simulated.len())];
    let n = measured.len() as f64;
    let mean = measured.iter().sum::<f64>() / n;
    let both = measured.iter().zip(simulated);
    let (off, spread) = both.fold((0.0, 0.0), |(off, spread), (q, p)| {
        (off + (q - p).powi(2), spread + (q - mean).powi(2))
    });
    ((off / n).sqrt(), 100.0 * (1.0 - (off / spread).sqrt()))
}

/// A curve as the columns of its file.
pub fn curve(band: &Band, x: &str, y: &str) -> Result<Record> {
    Ok(Record::new([
        (x, band.x[0].clone()),
        (y, band.estimate.clone()),
        ("lower", band.lower.clone()),
        ("upper", band.upper.clone()),
    ])?)
}

/// A curve as JSON.
pub fn curve_json(band: &Band) -> serde_json::Value {
    json!({
        "x": band.x[0],
        "y": band.estimate,
        "lower": band.lower,
        "upper": band.upper,
        "standard_error": band.standard_error,
        "level": band.level,
    })
}
