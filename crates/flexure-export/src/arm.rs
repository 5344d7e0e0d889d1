//! An arm as C or FMU: its equations of motion with an integrator inside.

use std::path::Path;

use flexure::Record;
use flexure::manipulator::{Arm, JointKind, State};
use flexure::simulation::{SOLUTION, STAGES};
use flexure_io::ModelFile;
use flexure_io::arm::ArmFile;
use minijinja::context;

use crate::error::{Error, Result};
use crate::{Artefact, Format, Options, destination, fmu, header_name, name, text};

/// The integrator's first step as a share of the arm's fastest time constant: convention.
const SHARE: f64 = 0.3;
/// The highest speed of the joints for which that step is chosen, rad/s: convention.
const SPEED: f64 = 20.0;
/// The most steps in a sample.
const MOST_STEPS: u64 = 100_000;
/// If the exported arm differs from the simulated one by more than this share of a component's largest value, its steps are halved. The
/// error of the simulation itself, at the tolerance of [`to_be_compared`], is of this size.
const CLOSE: f64 = 1e-10;
/// How often the steps are halved: convention.
const HALVINGS: usize = 6;
/// The relative tolerance of the simulation that is compared with.
const RTOL: f64 = 1e-12;

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

/// The arm file whose simulation an export is compared with: without measurement noise, and more accurate.
pub fn to_be_compared(file: &ArmFile) -> ArmFile {
    let mut exact = file.clone();
    exact.noise = None;
    exact.run.rtol = exact.run.rtol.min(RTOL);
    exact
}

/// The files of an arm: C source and header, or an FMU. `record` is a simulation of [`to_be_compared`], driven by torques: the integrator
/// takes as many steps per sample as the exported arm needs to move in the same way.
///
/// # Errors
/// As [`export`](crate::export); [`Error::Model`] for another format, for an arm too stiff for its sample time, and for a record that
/// is no simulation of the arm.
pub fn export_arm(file: &ArmFile, record: &Record, out: &Path, options: Options<'_>) -> Result<Vec<Artefact>> {
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
    let compared = compared(&arm, file, record)?;
    let steps = compared.steps;
    let about = about(file, &compared);
    let own = context! {
        name => &name,
        about => &about,
        header => file_name,
        ..constants(&arm, file, steps)
    };
    let source = text::rendered("arm.c", own.clone())?;
    let header_text = text::rendered("arm.h", own)?;
    if options.format == Format::Fmu {
        let named = |name: &str, unit: &str| fmu::Variable {
            name: name.to_owned(),
            unit: Some(unit.to_owned()),
        };
        let content = fmu::Content {
            source,
            header: header_text,
            inputs: vec![named("tau1", "N.m"), named("tau2", "N.m")],
            outputs: OUTPUTS.iter().map(|(output, unit)| named(output, unit)).collect(),
            parameters: parameters(&arm),
            sample_time: Some(file.run.sample_time),
            nature: fmu::Nature::Arm,
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

/// The exported arm's motion, compared with the simulated one's.
struct Compared {
    /// The integrator's steps in a sample.
    steps: u64,
    /// The largest difference of a component of the state, as a share of that component's largest value.
    difference: f64,
}

/// The number of steps at which the exported arm moves like the simulated one. It starts from the number for the fastest time constant, and
/// doubles as long as that helps.
fn compared(arm: &Arm, file: &ArmFile, record: &Record) -> Result<Compared> {
    let enough = (file.run.sample_time * fastest(arm) / SHARE).ceil();
    if !(enough <= MOST_STEPS as f64) {
        return Err(Error::Model(format!(
            "its fastest motion needs {enough} steps of the integrator a sample of {} s; give a shorter sample time in [run]",
            file.run.sample_time
        )));
    }
    let column = |name: &str| record.column(name).map_err(|error| Error::Model(error.to_string()));
    let torque = [column("tau1")?, column("tau2")?];
    let at = |steps: u64| -> Result<Compared> {
        let states = stepped(arm, &file.initial, torque, steps, file.run.sample_time / steps as f64);
        let mut difference = 0.0_f64;
        // A rigid arm's record has no motors: they move with the links.
        for (i, (name, _)) in OUTPUTS
            .iter()
            .enumerate()
            .filter(|(_, (name, _))| record.column(name).is_ok())
        {
            let expected = column(name)?;
            let size = expected.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
            let apart = states
                .iter()
                .zip(expected)
                .map(|(state, e)| (state[i] - e).abs() / size);
            difference = apart.fold(difference, |m, d| if d <= m { m } else { d });
        }
        Ok(Compared { steps, difference })
    };
    let mut best = at(enough.max(1.0) as u64)?;
    for _ in 0..HALVINGS {
        if best.difference <= CLOSE || best.steps * 2 > MOST_STEPS {
            break;
        }
        let next = at(best.steps * 2)?;
        // If only rounding errors are left, more steps do not help.
        if !(next.difference < 0.5 * best.difference || best.difference.is_nan()) {
            break;
        }
        best = next;
    }
    match best.difference.is_finite() {
        true => Ok(best),
        false => Err(Error::Model(
            "its integrator does not follow its own [run]; give a shorter sample time there".to_owned(),
        )),
    }
}

/// The states at the instants of the torques, as the exported arm computes them.
fn stepped(arm: &Arm, start: &State, torque: [&[f64]; 2], steps: u64, h: f64) -> Vec<[f64; 8]> {
    let rigid = arm.model() == JointKind::Rigid;
    let derivative = |x: &[f64; 8], tau| match rigid {
        true => {
            let [v1, v2, a1, a2] = arm.rigid_derivative(&[x[0], x[1], x[4], x[5]], tau);
            [v1, v2, v1, v2, a1, a2, a1, a2]
        }
        false => arm.derivative(x, tau),
    };
    let added = |x: &[f64; 8], weights: &[f64], slopes: &[[f64; 8]]| -> [f64; 8] {
        std::array::from_fn(|i| x[i] + h * weights.iter().zip(slopes).map(|(w, slope)| w * slope[i]).sum::<f64>())
    };
    let with_motors = State {
        qm: start.q,
        dqm: start.dq,
        ..*start
    };
    let mut x = if rigid { with_motors } else { *start }.to_array();
    let rows = torque[0].iter().zip(torque[1]);
    rows.map(|(tau1, tau2)| {
        let now = x;
        for _ in 0..steps {
            let mut slopes = [[0.0; 8]; STAGES.len()];
            for stage in 0..STAGES.len() {
                let at = added(&x, &STAGES[stage][..stage.min(11)], &slopes[..stage]);
                slopes[stage] = derivative(&at, [*tau1, *tau2]);
            }
            x = added(&x, &SOLUTION, &slopes);
        }
        now
    })
    .collect()
}

/// The description in the files, line by line.
fn about(file: &ArmFile, compared: &Compared) -> [String; 4] {
    let about = [
        format!("A two-link arm, written by Flexure {}.", ModelFile::CURRENT),
        format!(
            "One step is one sample of {:?} s. Call it at this rate.",
            file.run.sample_time
        ),
        format!(
            "Inside, the method of Dormand and Prince of order 8 takes steps of one length, {} a sample.",
            compared.steps
        ),
        format!(
            "Compared with flexure simulate over the run of the arm file, {:?} s at a relative tolerance of {RTOL:e}: the state differs by {:.1e} of \
             the largest value of each component at most. Torques that move it much faster are integrated less accurately.",
            file.run.duration, compared.difference
        ),
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
    // The addition to the links' inertia: the inertia of geared rotors, or minus the coupling with a motor that turns with the link.
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

/// The numbers of an arm, by joint: inertias, springs and friction.
fn parameters(arm: &Arm) -> Vec<fmu::Parameter> {
    let links = arm.link_dynamics();
    let parameter = |name: String, value, unit, about| fmu::Parameter {
        name,
        value,
        unit: Some(unit),
        about,
    };
    let mut all = vec![
        parameter(
            "inertia_shoulder".to_owned(),
            links.shoulder,
            "kg.m2",
            "Of both links about the shoulder, less what moves with the elbow's cosine",
        ),
        parameter(
            "inertia_elbow".to_owned(),
            links.elbow,
            "kg.m2",
            "Of the second link about the elbow",
        ),
        parameter(
            "inertia_coupling".to_owned(),
            links.coupling,
            "kg.m2",
            "Times the elbow's cosine: what both links share",
        ),
    ];
    for i in 0..2 {
        let mut add =
            |name: &str, value, unit, about| all.push(parameter(format!("{name}{}", i + 1), value, unit, about));
        let joint = arm.parameters().joints[i];
        let spring = arm.stiffness()[i];
        if arm.model() != JointKind::Rigid {
            add(
                "motor_inertia",
                joint.motor_inertia,
                "kg.m2",
                "Of the motor, at the joint",
            );
            add("stiffness", spring.linear, "N.m/rad", "Of the joint, linear");
            add("cubic_stiffness", spring.cubic, "N.m/rad3", "Of the joint, cubic");
            add("windup", spring.windup, "N.m", "Torque of the wind-up");
            add("windup_sharpness", spring.windup_sharpness, "1/rad", "Of the wind-up");
            add("damping", joint.damping, "N.m.s/rad", "Of the joint");
        }
        let gammas = arm.friction()[i]
            .0
            .into_iter()
            .zip(["N.m", "s/rad", "s/rad", "N.m", "s/rad", "N.m.s/rad"]);
        for (k, (gamma, unit)) in (1..).zip(gammas) {
            add(
                &format!("friction_gamma{k}_"),
                gamma,
                unit,
                "g1 (tanh(g2 v) - tanh(g3 v)) + g4 tanh(g5 v) + g6 v",
            );
        }
    }
    all
}

/// An upper bound of how fast the arm's motion can change, 1/s: the steepest friction and the stiffest spring on the least inertia, and in
/// addition the speed of its joints.
fn fastest(arm: &Arm) -> f64 {
    let joints = arm.parameters().joints;
    let links = arm.link_dynamics();
    let swing = links.coupling.abs();
    // For two moving links, the least eigenvalue of the inertia matrix is at least its determinant divided by its trace.
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
        // The cubic term at a deflection of 0.3 rad, more than any drive reaches.
        let spring = s.linear + 3.0 * s.cubic * 0.09;
        let rub = slope(arm.friction()[i].0) / link + slope(arm.motor_friction()[i].0) / motor;
        rub + joints[i].damping * (1.0 / link + 1.0 / motor) + (spring * (1.0 / link + 1.0 / motor)).sqrt()
    };
    let free = (0..2).filter(|&i| !joints[i].locked);
    SPEED + free.map(rate).fold(0.0, f64::max)
}
