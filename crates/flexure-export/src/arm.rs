//! An arm as C or FMU: its equations of motion with an integrator inside.

use std::path::Path;

use flexure::manipulator::{Arm, JointKind};
use flexure::simulation::{SOLUTION, STAGES};
use flexure_io::ModelFile;
use flexure_io::arm::ArmFile;
use minijinja::context;

use crate::error::{Error, Result};
use crate::{Artefact, Format, Options, destination, fmu, header_name, name, text};

/// The integrator's step beside the fastest time constant of the arm: 0.3 leaves an error below 1e-9 of the motion (measured by
/// `the_exported_arm_moves_as_the_simulated_one`); 0.6 leaves 6e-9.
const SHARE: f64 = 0.3;
/// The speed of the joints up to which that holds, rad/s: convention.
const SPEED: f64 = 20.0;
/// The most steps a sample.
const MOST_STEPS: f64 = 1e5;

/// The state's components, with their units.
const OUTPUTS: [(&str, &str); 8] = [
    ("q1", "rad"),
    ("q2", "rad"),
    ("qm1", "rad"),
    ("qm2", "rad"),
    ("dq1", "rad/s"),
    ("dq2", "rad/s"),
    ("dqm1", "rad/s"),
    ("dqm2", "rad/s"),
];

/// The files of an arm: C source and header, or an FMU.
///
/// # Errors
/// As [`export`](crate::export); [`Error::Model`] for another format, and for an arm too stiff for its sample time.
pub fn export_arm(file: &ArmFile, out: &Path, options: Options<'_>) -> Result<Vec<Artefact>> {
    if !options.format.takes_arms() {
        return Err(Error::Model("an arm goes to C and FMU alone".to_owned()));
    }
    let (path, name) = destination(out, options.format.extension(), options.name)?;
    name::check(&name)?;
    let arm = Arm::new(file.arm).map_err(|error| Error::Model(error.to_string()))?;
    let (header, file_name) = match options.format {
        Format::Fmu => (path.clone(), format!("{name}.h")),
        _ => header_name(&path)?,
    };
    let steps = steps(&arm, file.run.sample_time)?;
    let about = about(file.run.sample_time, steps);
    let own = context! {
        name => &name,
        about => &about,
        header => file_name,
        ..constants(&arm, file, steps)
    };
    let source = text::rendered("arm.c", own.clone())?;
    let header_text = text::rendered("arm.h", own)?;
    if options.format == Format::Fmu {
        let named = |name: &str, unit| (name.to_owned(), Some(unit));
        let content = fmu::Content {
            source,
            header: header_text,
            inputs: ["tau1", "tau2"].map(|input| named(input, "N.m")).to_vec(),
            outputs: OUTPUTS.map(|(output, unit)| named(output, unit)).to_vec(),
            sample_time: Some(file.run.sample_time),
            is_arm: true,
        };
        let bytes = fmu::archive(content, &name, &about, options.fmi, options.compile)?;
        return Ok(vec![Artefact { path, bytes }]);
    }
    let artefact = |path, text: String| Artefact {
        path,
        bytes: text.into_bytes(),
    };
    Ok(vec![artefact(path, source), artefact(header, header_text)])
}

/// The integrator's steps in a sample.
fn steps(arm: &Arm, sample_time: f64) -> Result<u64> {
    let steps = (sample_time * fastest(arm) / SHARE).ceil();
    match steps <= MOST_STEPS {
        true => Ok(steps as u64),
        false => Err(Error::Model(format!(
            "its fastest motion needs {steps} steps of the integrator a sample of {sample_time} s; give a shorter sample time in [run]"
        ))),
    }
}

/// What the files say of themselves, a line each.
fn about(sample_time: f64, steps: u64) -> [String; 4] {
    let about = [
        format!("A two-link arm, written by Flexure {}.", ModelFile::CURRENT),
        format!("One step is one sample of {sample_time:?} s. Call it at this rate."),
        format!(
            "Inside, the method of Dormand and Prince of order 8 takes steps of one length, {steps} a sample: a step is at most {SHARE:?} of \
             the fastest time constant of the arm, its joints turning at {SPEED:?} rad per s."
        ),
        "The state agrees with flexure simulate at rtol 1e-12 to 1e-9 of its largest value on the arms that Flexure is tested with."
            .to_owned(),
    ];
    about.map(|line| name::plain(&line))
}

/// The numbers of an arm as the templates need them.
fn constants(arm: &Arm, file: &ArmFile, steps: u64) -> minijinja::Value {
    let rigid = arm.model() == JointKind::Rigid;
    let parameters = arm.parameters();
    let free = parameters.joints.map(|joint| !joint.locked);
    let motor = parameters.joints.map(|joint| joint.motor_inertia);
    let coupling = if parameters.parts.coupling { motor[1] } else { 0.0 };
    let geared = rigid && parameters.parts.rotors;
    // What is added to the links' inertia: the rotors that are geared to it, or less what the motor takes up that turns with it.
    let diagonal = match (geared, !rigid && free[1]) {
        (true, _) => motor.map(|j| format!(" + {j:?}")),
        (_, true) => [format!(" - {coupling:?}"), String::new()],
        _ => [String::new(), String::new()],
    };
    let start = file.initial;
    let start = match rigid {
        true => [start.q, start.q, start.dq, start.dq].concat(),
        false => [start.q, start.qm, start.dq, start.dqm].concat(),
    };
    let literals = |values: &[f64]| values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>();
    let links = arm.link_dynamics();
    let stiffness = [0, 1].map(|i| {
        let s = arm.stiffness()[i];
        let damping = parameters.joints[i].damping;
        literals(&[s.cubic, s.linear, s.windup, s.windup_sharpness, damping])
    });
    let friction = arm.friction().into_iter().chain(arm.motor_friction());
    let friction: Vec<_> = friction.map(|f| literals(&f.0)).collect();
    context! {
        rigid, free, geared, diagonal, stiffness, friction, steps,
        stages => STAGES.map(|row| literals(&row)),
        solution => literals(&SOLUTION),
        links => literals(&[links.shoulder, links.elbow, links.coupling]),
        motor => literals(&motor),
        coupling => format!("{coupling:?}"),
        coupled => coupling > 0.0 && free[1],
        start => literals(&start),
        h => format!("{:?}", file.run.sample_time / steps as f64),
    }
}

/// An upper bound of how fast the arm's motion can change, 1/s: the steepest friction, and the stiffest spring, on the least inertia, beside
/// the speed of its joints.
fn fastest(arm: &Arm) -> f64 {
    let joints = arm.parameters().joints;
    let links = arm.link_dynamics();
    let swing = links.coupling.abs();
    // Of two links that move, the least eigenvalue of the inertia matrix is at least its determinant by its trace.
    let trace = links.shoulder + 2.0 * swing + links.elbow;
    let determinant = links.shoulder * links.elbow - links.elbow * links.elbow - swing * swing;
    let link = match joints.map(|joint| joint.locked) {
        [false, false] => (determinant / trace).max(links.elbow * 1e-3),
        [_, true] => links.shoulder - 2.0 * swing,
        [true, false] => links.elbow,
    };
    if !(link > 0.0) {
        return f64::INFINITY;
    }
    let slope = |g: [f64; 6]| g[0] * (g[1] - g[2]).abs() + g[3] * g[4] + g[5];
    let rate = |i: usize| {
        let motor = match arm.model() {
            JointKind::Rigid => link,
            _ => joints[i].motor_inertia,
        };
        let s = arm.stiffness()[i];
        // The cubic term at a deflection of 0.3 rad, which no drive reaches.
        let spring = s.linear + 3.0 * s.cubic * 0.09;
        let rub = slope(arm.friction()[i].0) / link + slope(arm.motor_friction()[i].0) / motor;
        rub + joints[i].damping * (1.0 / link + 1.0 / motor) + (spring * (1.0 / link + 1.0 / motor)).sqrt()
    };
    let free = (0..2).filter(|&i| !joints[i].locked);
    SPEED + free.map(rate).fold(0.0, f64::max)
}
