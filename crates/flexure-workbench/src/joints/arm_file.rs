//! Identified joints as an arm, for simulation and as an arm file.

use anyhow::{Result, anyhow, bail};
use flexure::identify::robot_joint::{Fitted, FlexibleAxis, FormName, IdentifiedCurve, RigidAxis, TwoLinkArm};
use flexure::manipulator::{
    Arm, ArmParameters, Drive, Friction, JointKind, JointParameters, Link, LinkDynamics, Parts, SimulationOptions,
    State, simulate,
};
use flexure_io::arm::{ArmError, ArmFile, DriveKind, Excitation, Kind, Run};

use super::Log;
use super::text::{estimate, with_error};

/// The comment on the links in the file of a flexible joint without a template.
const FLEXIBLE: &str = "\
# A joint's log tells the inertia about its axis, no mass, length or centre of mass: those below are placeholders, the inertia is in the
# moment of inertia of the moving link. The motion of this joint is right; for links that move together give the true ones, and
# write this file with --template.

";

/// The comment on the links in the file of a two-link arm without a template.
const TWO_LINK: &str = "\
# A log tells three constants of the links, not their masses, lengths and centres of mass: those below are one choice with these
# constants, and move in the same way. For the true ones give lengths and centres of mass by --template.

";

/// The comment on the links in the file of a rigid axis.
const RIGID: &str = "\
# A rigid axis: a log tells the inertia about it, no mass, length or centre of mass; those below are placeholders, the inertia is in the
# moment of inertia of the moving link.
";

/// The mass of a placeholder link, kg.
const NOTHING: f64 = 1e-9;
/// The steepest slope of a friction in a simulation, in units of one over the largest velocity.
const STEEPEST: f64 = 1e4;

/// A link with this moment of inertia about its joint, and nearly without mass.
fn placeholder(inertia: f64) -> Link {
    Link {
        mass: NOTHING,
        length: 1.0,
        com: 0.0,
        inertia,
    }
}

/// The parts of an arm file that no log shows.
pub struct Place {
    /// Which joint of the arm a single joint is: 0, the shoulder, or 1, the elbow.
    pub joint: usize,
    /// The arm whose links it has.
    pub template: Option<ArmParameters>,
    /// What drives it.
    pub excitation: Excitation,
}

/// The torques of a record in the arm file's folder.
pub fn recorded(file: &str) -> Excitation {
    Excitation {
        kind: Kind::Record,
        drive: DriveKind::Torque,
        file: Some(file.to_owned()),
        ..Excitation::default()
    }
}

/// The friction (12) of a form of this curve. Of a jump the data say only that it is steep: any slope above a limit will do, and the steepest ones
/// would need endlessly short steps.
fn friction(form: &Fitted, curve: &IdentifiedCurve) -> Friction {
    let fastest = curve.x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let g = |name: &str| form.parameter(name).map_or(0.0, |p| p.value).max(0.0);
    let slope = |name: &str| g(name).min(STEEPEST / fastest);
    Friction([g("g1"), slope("g2"), slope("g3"), g("g4"), slope("g5"), g("g6")])
}

/// The identified joint.
fn joint(axis: &FlexibleAxis) -> JointParameters {
    let stiffness = &axis.model.stiffness;
    let of = |name: &str| stiffness.parameter(name).map_or(0.0, |p| p.value);
    let linear = of("a2");
    JointParameters {
        motor_inertia: axis.motor_inertia.value,
        stiffness: linear,
        cubic: of("a1").max(0.0),
        linear,
        windup: of("ksw").clamp(0.0, 0.999 * linear.max(0.0)),
        windup_sharpness: of("asw"),
        damping: axis.damping.map_or(0.0, |c| c.value.max(0.0)),
        friction: Some(friction(&axis.model.friction, &axis.link.friction)),
        motor_friction: {
            let curves = axis.model.motor_friction.as_ref().zip(axis.motor_friction.as_ref());
            curves.map(|(form, curve)| friction(form, curve))
        },
        locked: false,
    }
}

/// An arm with one moving joint and a link of this inertia about it; the other joint is locked at zero.
fn single(moving: usize, inertia: f64, joint: JointParameters, model: JointKind) -> ArmParameters {
    let mut links = [placeholder(0.0); 2];
    // The placeholders' inertia about the shoulder is subtracted.
    links[moving] = placeholder(inertia - if moving == 0 { NOTHING } else { 0.0 });
    let mut joints = [joint; 2];
    joints[1 - moving].locked = true;
    ArmParameters {
        model,
        links,
        joints,
        parts: Parts {
            friction: true,
            ..Parts::of(model)
        },
    }
}

/// The arm of the template with the identified joint, whose link gets the moment of inertia that its geometry leaves open.
fn with_joint(mut arm: ArmParameters, moving: usize, axis: &FlexibleAxis) -> Result<ArmParameters> {
    let inertia = axis.model.friction.inertia.value;
    arm.model = JointKind::Nonlinear;
    arm.joints[moving] = joint(axis);
    arm.joints[1 - moving].locked = true;
    let mass = LinkDynamics::new(&arm.links).inertia(0.0)[moving][moving];
    let own = arm.links[moving].inertia + inertia - mass;
    if !(own >= 0.0) {
        let number = moving + 1;
        bail!(
            "the template's links have an inertia of {mass} kg m^2 about joint {number} without the moment of inertia of link {number}, more \
             than the {inertia} kg m^2 that were identified; check the template, or leave it out"
        );
    }
    arm.links[moving].inertia = own;
    Ok(arm)
}

/// An arm, and the state in which a log starts.
pub struct StartedArm {
    pub arm: ArmParameters,
    pub initial: State,
}

/// The joint alone, as joint 1 of an arm whose other joint is locked, in the state in which a log with these velocities starts.
pub fn alone(axis: &FlexibleAxis, log: &Log, velocities: &[&[f64]]) -> StartedArm {
    StartedArm {
        arm: single(0, axis.model.friction.inertia.value, joint(axis), JointKind::Nonlinear),
        initial: started(log, 0, velocities),
    }
}

/// The text of the file of a flexible joint in the run of its log.
pub fn flexible(axis: &FlexibleAxis, log: &Log, place: Place) -> Result<String> {
    let inertia = axis.model.friction.inertia.value;
    let (header, arm) = match place.template {
        Some(template) => ("", with_joint(template, place.joint, axis)?),
        None => (
            FLEXIBLE,
            single(place.joint, inertia, joint(axis), JointKind::Nonlinear),
        ),
    };
    text(
        header,
        arm,
        started(log, place.joint, &[&axis.link.friction.x]),
        log,
        place.excitation,
    )
}

/// The text of the file of a rigid axis: one link of its inertia, with the smooth form of its friction.
pub fn rigid(axis: &RigidAxis, prismatic: bool, log: &Log, place: Place) -> Result<String> {
    let smooth = |f: &&Fitted| {
        let known = [FormName::SmoothDry, FormName::SmoothCoulomb, FormName::SmoothStribeck].contains(&f.form);
        let value = |g: &str| f.parameter(g).map_or(0.0, |p| p.value);
        let [g1, g2, g3, g4, g6] = ["g1", "g2", "g3", "g4", "g6"].map(value);
        known && f.inertia.value > 0.0 && g1 >= 0.0 && g2 >= g3 && g4 >= 0.0 && g6 >= 0.0
    };
    let possible = axis.friction.forms.iter().filter(smooth);
    let Some(form) = possible.min_by(|a, b| a.bic.total_cmp(&b.bic)) else {
        bail!("an arm file can hold only smooth friction, and no smooth form with positive factors fits this axis");
    };
    let joint = JointParameters {
        friction: Some(friction(form, &axis.friction)),
        ..JointParameters::default()
    };
    let arm = single(place.joint, form.inertia.value, joint, JointKind::Rigid);
    let initial = state(log, place.joint, &[axis.friction.x[0]]);
    let mut header = RIGID.to_owned();
    if prismatic {
        header.push_str("# The axis is prismatic: read m for rad, kg for kg m^2 and N for N m.\n");
    }
    if let Some(offset) = form.parameter("F0") {
        header.push_str(&format!(
            "# Its log also has a constant {} of {}. An arm file cannot hold it: subtract it from the values that you play.\n",
            if prismatic { "force" } else { "torque" },
            with_error(estimate(offset))
        ));
    }
    header.push('\n');
    text(&header, arm, initial, log, place.excitation)
}

/// The state in which a log starts: the angle of every axis, and its motor's, with the velocity of both; the first axis is `joint`.
fn state(log: &Log, joint: usize, velocities: &[f64]) -> State {
    let mut state = State::default();
    for (i, (axis, &velocity)) in log.axes.iter().zip(velocities).enumerate() {
        state.q[joint + i] = axis.position[0];
        state.qm[joint + i] = axis.motor.as_ref().unwrap_or(&axis.position)[0];
        state.dq[joint + i] = velocity;
        state.dqm[joint + i] = velocity;
    }
    state
}

/// The state in which the log of joints with these velocities starts; `joint` is the first of them.
fn started(log: &Log, joint: usize, velocities: &[&[f64]]) -> State {
    let first: Vec<f64> = velocities.iter().map(|velocity| velocity[0]).collect();
    state(log, joint, &first)
}

/// The text of the file of a two-link arm, with the links' geometry of the template if there is one, in the run of its log.
pub fn two_link(arm: &TwoLinkArm, log: &Log, place: Place) -> Result<String> {
    let header = if place.template.is_none() { TWO_LINK } else { "" };
    let velocities = own_velocities(arm);
    let StartedArm { arm, initial } = two_link_arm(arm, log, place.template.map(|arm| arm.links), &velocities)?;
    text(header, arm, initial, log, place.excitation)
}

/// The velocities of an arm's links in its own log.
pub fn own_velocities(arm: &TwoLinkArm) -> Vec<&[f64]> {
    arm.joints.iter().map(|axis| &axis.link.friction.x[..]).collect()
}

/// The arm with these links' geometry, if given, in the state in which a log with these velocities starts.
pub fn two_link_arm(
    arm: &TwoLinkArm,
    log: &Log,
    template: Option<[Link; 2]>,
    velocities: &[&[f64]],
) -> Result<StartedArm> {
    let [shoulder, elbow, coupling] = arm.model.map(|e| e.value);
    let [first, second] = &arm.joints;
    let mut joints = [joint(first), joint(second)];
    for (joint, inertia) in joints.iter_mut().zip(arm.model_motors) {
        joint.motor_inertia = inertia.value;
    }
    let dynamics = LinkDynamics {
        shoulder,
        elbow,
        coupling,
    };
    Ok(StartedArm {
        arm: ArmParameters {
            model: JointKind::Nonlinear,
            links: links(dynamics, template)?,
            joints,
            parts: Parts::of(JointKind::Nonlinear),
        },
        initial: started(log, 0, velocities),
    })
}

/// Links that move with these constants: with the template's geometry, or with a first link of 1 m.
///
/// Without a template, the second link's mass contributes equal shares of the shoulder's and the elbow's inertia.
fn links(dynamics: LinkDynamics, template: Option<[Link; 2]>) -> Result<[Link; 2]> {
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
            let inertia = own - mass * first.length.powi(2) - first.mass * first.com.powi(2);
            let first = Link { inertia, ..first };
            let inertia = elbow - mass * second.com.powi(2);
            [
                first,
                Link {
                    mass,
                    inertia,
                    ..second
                },
            ]
        }
        None => {
            let share = coupling / (own * elbow).sqrt();
            let com = share * elbow / coupling;
            let mass = coupling / com;
            let [first, second] = [own, elbow].map(|inertia| placeholder((1.0 - share) * inertia));
            [first, Link { mass, com, ..second }]
        }
    };
    let impossible = |l: &Link| !(l.inertia >= 0.0 && l.mass > 0.0);
    if let Some(i) = links.iter().position(impossible) {
        bail!(
            "with the template's lengths and centres of mass, link {} would have a mass of {} kg and a moment of inertia of {} \
             kg m^2; check the template, or leave it out",
            i + 1,
            links[i].mass,
            links[i].inertia
        );
    }
    Ok(links)
}

/// The text of the file of an arm in the run of a log, after a header.
fn text(header: &str, arm: ArmParameters, initial: State, log: &Log, excitation: Excitation) -> Result<String> {
    let file = ArmFile {
        arm,
        initial,
        run: Run {
            duration: (log.samples() - 1) as f64 * log.sample_time,
            sample_time: log.sample_time,
            rtol: 1e-9,
            atol: 1e-12,
            max_steps: 10_000_000,
        },
        excitation,
        noise: None,
    };
    let text = file.to_toml()?;
    // The text must be readable again, and the arm must run.
    let read = ArmFile::from_toml_str(&text, "");
    read.map_err(|error| unusable(&without_place(&error)))?;
    try_out(&file, log).map_err(|error| unusable(&error.to_string()))?;
    Ok(format!("{header}{text}"))
}

/// Runs an arm under the torques of its log.
fn try_out(file: &ArmFile, log: &Log) -> flexure::Result<()> {
    let options = SimulationOptions {
        initial: file.initial,
        ..SimulationOptions::new(file.run.duration, file.run.sample_time)?
    };
    let torque = log.torques(options.sampling.rows(), file.arm.joints.map(|joint| joint.locked));
    let drive = Drive::Held([&torque[0], &torque[1]]);
    simulate(&Arm::new(file.arm)?, &drive, &options)?;
    Ok(())
}

fn unusable(why: &str) -> anyhow::Error {
    anyhow!(
        "the identified arm cannot be simulated: {why}; no arm file was written: leave --arm out, or record motions that determine \
         the joint better"
    )
}

/// What is wrong with an arm, without a line number: the user does not have this text.
fn without_place(error: &ArmError) -> String {
    match error {
        ArmError::Format { message, .. } => message.clone(),
        ArmError::Value { key, reason, .. } => format!("{key}: {reason}"),
        other => other.to_string(),
    }
}
