//! A flexible joint on the command line.

use std::io::Write;

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::identify::robot_joint::{Fitted, FlexibleAxis, FlexibleJoint, JointFound};
use flexure_io::{RecordFile, write_atomically, write_record};
use serde_json::json;

use super::Arguments;
use super::arm::{Place, Simulated, arm_file, simulated};
use super::data::{Log, possible};
use super::page;
use super::rigid;
use super::words::{
    Units, findings, fitted_json, fitted_words, lack_words, nearness, parameter_words, range_words, with_error,
};
use crate::output::{command_line, print};
use crate::progress::spinning;
use flexure_workbench::text::number;

/// Runs the command for motor and link.
pub fn run(file: &RecordFile, log: &Log, arguments: &Arguments) -> Result<()> {
    let joint = FlexibleJoint {
        motor: &log.motor,
        link: &log.position,
        torque: &log.torque,
        sample_time: log.sample_time,
        motor_inertia: arguments.motor_inertia,
        level: arguments.band,
    };
    let found = spinning("identifying", || joint.identify());
    let axis = match found.map_err(|error| file.locate(rigid::named(error, arguments)))? {
        JointFound::Rigid(axis) => return rigid::tell(file, log, &axis, arguments),
        JointFound::Flexible(axis) => axis,
    };
    checked(file, &axis)?;
    let replay = spinning("simulating", || simulated(&axis, log))?;
    let html = match &arguments.report {
        None => None,
        Some(path) => {
            let command = command_line(std::env::args_os().skip(1));
            let page = page::flexible(&axis, log, replay.as_ref(), Some(command));
            Some((path, flexure_report::render_joint(&page).context("the report")?))
        }
    };
    let arm = match &arguments.arm {
        None => None,
        Some(path) => Some((path, arm_file(&axis, log, Place::given(log, arguments)?)?)),
    };
    if let Some(path) = &arguments.friction {
        write_record(path, &rigid::curve(&axis.friction, "velocity", "torque")?)?;
    }
    if let Some(path) = &arguments.stiffness {
        write_record(path, &stiffness(&axis)?)?;
    }
    if let Some((path, text)) = arm {
        write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    if let Some((path, html)) = html {
        write_atomically(path, |out| out.write_all(html.as_bytes()))?;
    }
    if arguments.json {
        return print(&json_of(&axis, log, replay.as_ref(), arguments).to_string());
    }
    let mut lines = words(&axis, log, replay.as_ref());
    let written = [
        &arguments.friction,
        &arguments.stiffness,
        &arguments.arm,
        &arguments.report,
    ];
    lines.extend(
        written
            .into_iter()
            .flatten()
            .map(|path| format!("wrote {}", path.display())),
    );
    print(&lines.join("\n"))
}

/// Refuses a joint whose inertias are impossible.
pub fn checked(file: &RecordFile, axis: &FlexibleAxis) -> Result<()> {
    let link = ("link's inertia", &axis.link_inertia);
    possible(file, [("motor's inertia", &axis.motor_inertia), link])
}

/// The stiffness curve as the columns of its file.
pub fn stiffness(axis: &FlexibleAxis) -> Result<Record> {
    let mut record = rigid::curve(&axis.stiffness, "deflection", "torque")?;
    let band = &axis.secant;
    record.push("stiffness", band.estimate.clone())?;
    record.push("stiffness_lower", band.lower.clone())?;
    record.push("stiffness_upper", band.upper.clone())?;
    Ok(record)
}

fn json_of(axis: &FlexibleAxis, log: &Log, replay: Option<&Simulated>, arguments: &Arguments) -> serde_json::Value {
    let mut object = axis_json(axis);
    object["joint"] = json!("flexible");
    object["samples"] = json!(log.position.len());
    object["sample_time"] = json!(log.sample_time);
    object["replay"] = json!(replay);
    for (name, path) in [
        ("friction_file", &arguments.friction),
        ("stiffness_file", &arguments.stiffness),
        ("arm", &arguments.arm),
        ("report", &arguments.report),
    ] {
        object[name] = json!(path.as_ref().map(|p| p.display().to_string()));
    }
    object
}

/// What was found of a joint, as JSON.
pub fn axis_json(axis: &FlexibleAxis) -> serde_json::Value {
    let units = Units::of(false);
    let list = |forms: &[Fitted], stiffness: bool| -> Vec<_> {
        forms.iter().map(|f| fitted_json(f, &units, stiffness)).collect()
    };
    json!({
        "motor_inertia": axis.motor_inertia,
        "link_inertia": axis.link_inertia,
        "stiffness": rigid::curve_json(&axis.stiffness),
        "secant_stiffness": rigid::curve_json(&axis.secant),
        "friction": rigid::curve_json(&axis.friction),
        "stiffness_forms": list(&axis.stiffness_forms, true),
        "best_stiffness_form": axis.stiffness_forms[axis.best_stiffness].form,
        "friction_forms": list(&axis.friction_forms, false),
        "best_friction_form": axis.friction_forms[axis.best_friction].form,
        "model": {
            "stiffness": fitted_json(&axis.model.stiffness, &units, true),
            "friction": fitted_json(&axis.model.friction, &units, false),
        },
        "encoder_skew": axis.skew,
        "cut_off": axis.cut_off,
        "highest_frequency": axis.highest,
        "findings": axis.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

fn words(axis: &FlexibleAxis, log: &Log, replay: Option<&Simulated>) -> Vec<String> {
    let mut lines = vec![format!(
        "Flexible joint from {} samples of {}",
        log.position.len(),
        log.file
    )];
    lines.extend(axis_words(axis, "link inertia"));
    if let Some(replay) = replay {
        lines.push(format!(
            "  simulated under the recorded torque: link angle {}; link velocity fit {:.2} %",
            nearness(replay.rms, replay.fit_percent, "rad"),
            replay.velocity_fit_percent
        ));
    }
    lines.extend(findings(&axis.findings));
    lines
}

/// What was found of a joint, in words; `link` names its link's inertia.
pub fn axis_words(axis: &FlexibleAxis, link: &str) -> Vec<String> {
    let units = Units::of(false);
    let inertia = |name: &str, e: flexure::identify::robot_joint::Estimated| match e.standard_error != 0.0 {
        true => format!("  {name:<14} {} kg m^2", with_error(e.value, e.standard_error)),
        false => format!("  {name:<14} {} kg m^2  (as given)", number(e.value)),
    };
    let mut lines = vec![
        inertia("motor inertia", axis.motor_inertia),
        inertia(link, axis.link_inertia),
        range_words("stiffness", &axis.stiffness, "rad"),
        range_words("friction", &axis.friction, "rad/s"),
    ];
    for form in [&axis.model.stiffness, &axis.model.friction] {
        let title = form.form.title();
        lines.push(format!("  {}{}", title[..1].to_uppercase(), &title[1..]));
        for p in &form.parameters {
            let unit = units.of_curve(p.unit, form.form.is_stiffness());
            lines.push(format!("    {}", parameter_words(p, &unit)));
        }
    }
    lines.push(format!("    together {}", lack_words(&axis.model.friction)));
    for (what, forms, best) in [
        ("stiffness", &axis.stiffness_forms, axis.best_stiffness),
        ("friction", &axis.friction_forms, axis.best_friction),
    ] {
        lines.push(format!("  Forms of the {what}, each by itself"));
        for (i, form) in forms.iter().enumerate() {
            lines.extend(
                fitted_words(form, &units, i == best)
                    .into_iter()
                    .map(|l| format!("  {l}")),
            );
        }
    }
    lines
}
