//! What was identified as an arm: to be simulated, and as an arm file.

use anyhow::{Result, bail};
use flexure::identify::robot_joint::{Fitted, FlexibleAxis, FormName, RigidAxis, TwoLinkArm};
use flexure::manipulator::{ArmParameters, Friction, JointParameters, Link, LinkDynamics, Model, Parts, State};
use flexure_io::arm::{ArmFile, DriveKind, Excitation, Kind, Run};

use super::Log;
use super::text::with_error;

/// What the file of an arm without a template says of the links of a flexible joint.
const FLEXIBLE: &str = "\
# A joint's log tells the inertia about its axis, no mass, length or centre of mass: those below are placeholders, the inertia is in the
# moment of inertia of the moving link. The motion of this joint is right; for links that move together give the true ones, and
# write this file with --template.

";

/// What the file of a two-link arm without a template says of the links.
const TWO_LINK: &str = "\
# A log tells three constants of the links, not their masses, lengths and centres of mass: those below are one choice with these
# constants, and move in the same way. For the true ones give lengths and centres of mass by --template.

";

/// What the file of a rigid axis says of the links.
const RIGID: &str = "\
# A rigid axis: a log tells the inertia about it, no mass, length or centre of mass; those below are placeholders, the inertia is in the
# moment of inertia of the moving link.
";

/// The mass of a link that is not there, kg.
const NOTHING: f64 = 1e-9;

/// A link of this moment of inertia about its joint, as good as without mass.
fn placeholder(inertia: f64) -> Link {
    Link {
        mass: NOTHING,
        length: 1.0,
        com: 0.0,
        inertia,
    }
}

/// What an arm file says that no log shows.
pub struct Place {
    /// Which joint of the arm a single joint is: 0, the shoulder, or 1, the elbow.
    pub joint: usize,
    /// The arm whose links it has.
    pub template: Option<ArmParameters>,
    /// What drives it.
    pub excitation: Excitation,
}

/// The torques of a record beside the arm file.
pub fn recorded(file: &str) -> Excitation {
    Excitation {
        kind: Kind::Record,
        drive: DriveKind::Torque,
        file: Some(file.to_owned()),
        ..Excitation::zero()
    }
}

/// The identified joint.
fn joint(axis: &FlexibleAxis) -> JointParameters {
    let (stiffness, friction) = (&axis.model.stiffness, &axis.model.friction);
    let of = |name: &str| stiffness.parameter(name).map_or(0.0, |p| p.value);
    let g = |name: &str| friction.parameter(name).map_or(0.0, |p| p.value).max(0.0);
    let linear = of("a2");
    JointParameters {
        motor_inertia: axis.motor_inertia.value,
        stiffness: linear,
        cubic: of("a1").max(0.0),
        linear,
        windup: of("ksw").clamp(0.0, 0.999 * linear.max(0.0)),
        windup_sharpness: of("asw"),
        friction: Some(Friction([g("g1"), g("g2"), g("g3"), g("g4"), g("g5"), g("g6")])),
        locked: false,
    }
}

/// The arm with the identified joint: that of the template, or a single link of the identified inertia.
fn arm(axis: &FlexibleAxis, moving: usize, template: Option<ArmParameters>) -> Result<ArmParameters> {
    let inertia = axis.model.friction.inertia.value;
    let mut arm = match template {
        Some(arm) => arm,
        None => {
            let other = JointParameters {
                locked: true,
                ..joint(axis)
            };
            let mut links = [placeholder(0.0); 2];
            links[moving] = placeholder(inertia);
            ArmParameters {
                model: Model::Nonlinear,
                links,
                joints: [other; 2],
                parts: Parts::of(Model::Nonlinear),
            }
        }
    };
    arm.model = Model::Nonlinear;
    arm.joints[moving] = joint(axis);
    arm.joints[1 - moving].locked = true;
    // The other joint is locked at zero: what the geometry leaves is the link's own inertia.
    let geometry = LinkDynamics::new(&arm.links);
    let mass = geometry.inertia(0.0)[moving][moving];
    let own = arm.links[moving].inertia + inertia - mass;
    if !(own >= 0.0) {
        bail!(
            "the template's links have an inertia of {mass} kg m^2 about joint {} without the moment of inertia of link {}, more than \
             the {inertia} kg m^2 that were identified; check the template, or leave it out",
            moving + 1,
            moving + 1
        );
    }
    arm.links[moving].inertia = own;
    Ok(arm)
}

/// The joint alone, as joint 1 of an arm whose other joint is locked, and the state in which its log starts.
pub fn alone(axis: &FlexibleAxis, log: &Log) -> (ArmParameters, State) {
    let own = joint(axis);
    let arm = ArmParameters {
        model: Model::Nonlinear,
        links: [
            placeholder(axis.model.friction.inertia.value - NOTHING),
            placeholder(0.0),
        ],
        joints: [own, JointParameters { locked: true, ..own }],
        parts: Parts::of(Model::Nonlinear),
    };
    (arm, started(0, log, axis.velocity[0]))
}

/// The text of the file of a flexible joint in the run of its log.
pub fn flexible(axis: &FlexibleAxis, log: &Log, place: Place) -> Result<String> {
    let header = if place.template.is_none() { FLEXIBLE } else { "" };
    let initial = started(place.joint, log, axis.velocity[0]);
    let arm = arm(axis, place.joint, place.template)?;
    text(arm, initial, log, place.excitation).map(|text| format!("{header}{text}"))
}

/// The text of the file of a rigid axis: one link of its inertia, with the smooth form of its friction.
pub fn rigid(axis: &RigidAxis, prismatic: bool, log: &Log, place: Place) -> Result<String> {
    let smooth = |f: &&Fitted| {
        let known = [FormName::SmoothDry, FormName::SmoothCoulomb, FormName::SmoothStribeck].contains(&f.form);
        let value = |g: &str| f.parameter(g).map_or(0.0, |p| p.value);
        let [g1, g2, g3, g4, g6] = ["g1", "g2", "g3", "g4", "g6"].map(value);
        known && f.inertia.value > 0.0 && g1 >= 0.0 && g2 >= g3 && g4 >= 0.0 && g6 >= 0.0
    };
    let possible = axis.forms.iter().filter(smooth);
    let Some(form) = possible.min_by(|a, b| a.bic.total_cmp(&b.bic)) else {
        bail!("an arm file has friction (12) only, of which no form with positive factors fits this axis");
    };
    let g = ["g1", "g2", "g3", "g4", "g5", "g6"].map(|g| form.parameter(g).map_or(0.0, |p| p.value));
    let moving = place.joint;
    let joint = JointParameters {
        friction: Some(Friction(g)),
        ..JointParameters::default()
    };
    let mut joints = [joint; 2];
    joints[1 - moving].locked = true;
    let mut links = [placeholder(0.0); 2];
    // What the placeholders have about the shoulder is taken off.
    links[moving] = placeholder(form.inertia.value - if moving == 0 { NOTHING } else { 0.0 });
    let arm = ArmParameters {
        model: Model::Rigid,
        links,
        joints,
        parts: Parts {
            friction: true,
            ..Parts::of(Model::Rigid)
        },
    };
    let initial = started(moving, log, axis.velocity[0]);
    let text = text(arm, initial, log, place.excitation)?;
    let mut header = RIGID.to_owned();
    if prismatic {
        header.push_str("# The axis is prismatic: read m for rad, kg for kg m^2 and N for N m.\n");
    }
    if let Some(offset) = form.parameter("F0") {
        header.push_str(&format!(
            "# Its log has a constant {} of {} beside these, which an arm file cannot hold: take it off the ones that you play.\n",
            if prismatic { "force" } else { "torque" },
            with_error(offset.value, offset.standard_error)
        ));
    }
    Ok(format!("{header}\n{text}"))
}

/// The state in which a joint starts: its angle, and its motor's with the velocity of both.
fn started(joint: usize, log: &Log, velocity: f64) -> State {
    let axis = &log.axes[0];
    let mut state = State::default();
    state.q[joint] = axis.position[0];
    state.qm[joint] = axis.motor.as_ref().unwrap_or(&axis.position)[0];
    state.dq[joint] = velocity;
    state.dqm[joint] = velocity;
    state
}

/// The text of the file of a two-link arm, with the links' geometry of the template if there is one, in the run of its log.
pub fn two_link(arm: &TwoLinkArm, log: &Log, place: Place) -> Result<String> {
    let header = if place.template.is_none() { TWO_LINK } else { "" };
    let parameters = two_link_parameters(arm, place.template.map(|arm| arm.links).as_ref())?;
    let text = text(parameters, two_link_state(arm, log), log, place.excitation)?;
    Ok(format!("{header}{text}"))
}

/// The arm with these links' geometry, if given.
pub fn two_link_parameters(arm: &TwoLinkArm, template: Option<&[Link; 2]>) -> Result<ArmParameters> {
    let [shoulder, elbow, coupling] = arm.model.map(|e| e.value);
    let mut joints = [joint(&arm.joints[0]), joint(&arm.joints[1])];
    for (joint, inertia) in joints.iter_mut().zip(arm.model_motors) {
        joint.motor_inertia = inertia.value;
    }
    let dynamics = LinkDynamics {
        shoulder,
        elbow,
        coupling,
    };
    Ok(ArmParameters {
        model: Model::Nonlinear,
        links: links(dynamics, template)?,
        joints,
        parts: Parts::of(Model::Nonlinear),
    })
}

/// The state in which the log of an arm starts.
pub fn two_link_state(arm: &TwoLinkArm, log: &Log) -> State {
    let dq = [0, 1].map(|i| arm.joints[i].velocity[0]);
    let axes = &log.axes;
    State {
        q: [0, 1].map(|i| axes[i].position[0]),
        qm: [0, 1].map(|i| axes[i].motor.as_ref().unwrap_or(&axes[i].position)[0]),
        dq,
        dqm: dq,
    }
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

/// The text of the file of an arm in the run of a log.
fn text(arm: ArmParameters, initial: State, log: &Log, excitation: Excitation) -> Result<String> {
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
    // What is written must read back.
    ArmFile::from_toml_str(&text, "the identified arm")?;
    Ok(text)
}
