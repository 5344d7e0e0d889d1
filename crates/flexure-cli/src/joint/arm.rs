//! The identified joint as an arm: simulated against its own record, and as an arm file.

use std::path::Path;

use anyhow::{Result, bail};
use flexure::identify::robot_joint::{Fitted, FlexibleAxis, FormName, RigidAxis};
use flexure::manipulator::{
    Arm, ArmParameters, Drive, Friction, JointParameters, Link, LinkDynamics, Model, Parts, SimulationOptions, State,
    simulate,
};
use flexure_io::arm::{ArmFile, DriveKind, Excitation, Kind, Run};

use super::Arguments;
use super::data::Log;
use super::words::with_error;
use crate::arguments::Usage;
use crate::simulate::read_arm;

/// What an arm file without a template says of its links.
const PLACEHOLDERS: &str = "\
# A joint's log tells the inertia about its axis, no mass, length or centre of mass: those below are placeholders, the inertia is in the
# moment of inertia of the moving link. The motion of this joint is right; for links that move together give the true ones, and
# write this file with --template.

";

/// What an arm file of a rigid axis says of its links.
const RIGID: &str = "\
# A rigid axis: a log tells the inertia about it, no mass, length or centre of mass; those below are placeholders, the inertia is in the
# moment of inertia of the moving link.
";

/// The mass of a link that is not there, kg; its length, m.
const NOTHING: f64 = 1e-9;

/// The identified joint under the recorded torque.
#[derive(serde::Serialize)]
pub struct Simulated {
    /// The link's angle, rad.
    #[serde(skip)]
    pub link: Vec<f64>,
    /// The root mean square of measured less simulated, rad.
    pub rms: f64,
    /// 100 (1 - |q - qh| / |q - mean q|).
    pub fit_percent: f64,
    /// The same of the link's velocity.
    pub velocity_fit_percent: f64,
}

/// The identified joint.
pub fn joint(axis: &FlexibleAxis) -> JointParameters {
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

/// What an arm file says that no log tells.
pub struct Place {
    /// Which joint it is: 0, the shoulder, or 1, the elbow.
    pub joint: usize,
    /// The arm whose links it has.
    pub template: Option<ArmParameters>,
    /// What drives it.
    pub excitation: Excitation,
}

impl Place {
    /// What the options say; driven by the record where an arm file can name it.
    pub fn given(log: &Log, arguments: &Arguments) -> Result<Place> {
        let joint = usize::from(arguments.joint) - 1;
        let named = arguments.torque == format!("tau{}", joint + 1) && log.torque_constant == 1.0;
        let template = arguments.template.as_ref().map(|path| read_arm(path)).transpose()?;
        Ok(Place {
            joint,
            template: template.map(|file| file.arm),
            excitation: match named && log.has_both_torques && beside(arguments) {
                true => recorded(&log.file),
                false => Excitation::zero(),
            },
        })
    }
}

/// Whether the arm file is written into the folder of the record.
pub fn beside(arguments: &Arguments) -> bool {
    let folder = |path: &Path| path.parent().map(Path::to_owned).unwrap_or_default();
    let arm = arguments.arm.as_ref();
    arm.is_some_and(|arm| folder(arm) == folder(&arguments.record))
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

/// The arm with the identified joint: that of the template, or a single link of the identified inertia.
fn arm(axis: &FlexibleAxis, moving: usize, template: Option<ArmParameters>) -> Result<ArmParameters> {
    let inertia = axis.model.friction.inertia.value;
    let mut arm = match template {
        Some(arm) => arm,
        None => {
            let link = |inertia| Link {
                mass: NOTHING,
                length: 1.0,
                com: 0.0,
                inertia,
            };
            let other = JointParameters {
                locked: true,
                ..joint(axis)
            };
            let mut links = [link(0.0); 2];
            links[moving] = link(inertia);
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

/// Simulates the joint under its recorded torque, held from sample to sample; `None` where that fails.
pub fn simulated(axis: &FlexibleAxis, log: &Log) -> Result<Option<Simulated>> {
    let n = log.position.len();
    let link = Link {
        mass: NOTHING,
        length: 1.0,
        com: 0.0,
        inertia: axis.model.friction.inertia.value - NOTHING,
    };
    let own = joint(axis);
    let parameters = ArmParameters {
        model: Model::Nonlinear,
        links: [link, Link { inertia: 0.0, ..link }],
        joints: [own, JointParameters { locked: true, ..own }],
        parts: Parts::of(Model::Nonlinear),
    };
    let Ok(arm) = Arm::new(parameters) else {
        return Ok(None);
    };
    let options = SimulationOptions {
        initial: State {
            q: [log.position[0], 0.0],
            qm: [log.motor[0], 0.0],
            dq: [axis.velocity[0], 0.0],
            dqm: [axis.velocity[0], 0.0],
        },
        ..SimulationOptions::new((n - 1) as f64 * log.sample_time, log.sample_time)?
    };
    let rows = options.sampling.rows();
    // Rounding may make the last row one too many.
    let mut torque = log.torque.clone();
    torque.resize(rows, 0.0);
    let Ok(record) = simulate(&arm, &Drive::Held([&torque, &vec![0.0; rows]]), &options) else {
        return Ok(None);
    };
    let (link, velocity) = (record.column("q1")?.to_vec(), record.column("dq1")?);
    let (rms, fit_percent) = super::rigid::fit(&log.position, &link);
    let (_, velocity_fit_percent) = super::rigid::fit(&axis.velocity, velocity);
    Ok(Some(Simulated {
        link,
        rms,
        fit_percent,
        velocity_fit_percent,
    }))
}

/// The text of the arm file: the joint with the run of its record.
pub fn arm_file(axis: &FlexibleAxis, log: &Log, place: Place) -> Result<String> {
    let moving = place.joint;
    let initial = started(moving, log.position[0], [log.motor[0], axis.velocity[0]]);
    let placeholders = if place.template.is_none() { PLACEHOLDERS } else { "" };
    let arm = arm(axis, moving, place.template)?;
    text(arm, initial, (log.position.len(), log.sample_time), place.excitation)
        .map(|text| format!("{placeholders}{text}"))
}

/// Whether an arm file can have a rigid axis with what the command line says of it.
pub fn possible_rigid(arguments: &Arguments) -> Result<()> {
    let term = match (arguments.gravity, arguments.spring) {
        (true, _) => "gravity",
        (_, true) => "spring",
        _ => return Ok(()),
    };
    let message = format!(
        "--arm: an arm file has no {term}, and without it the arm would not move as the axis does; leave --arm out: the motion with the \
         {term} is simulated under the recorded torque, and --report shows it"
    );
    Err(Usage(message).into())
}

/// The text of the arm file of a rigid axis: one link of its inertia, with the smooth form of its friction.
pub fn rigid_arm_file(axis: &RigidAxis, log: &Log, place: Place, prismatic: bool) -> Result<String> {
    let smooth = |f: &&Fitted| {
        let known = [FormName::SmoothDry, FormName::SmoothCoulomb, FormName::SmoothStribeck].contains(&f.form);
        let value = |g: &str| f.parameter(g).map_or(0.0, |p| p.value);
        let [g1, g2, g3, g4, g6] = ["g1", "g2", "g3", "g4", "g6"].map(value);
        known && f.inertia.value > 0.0 && g1 >= 0.0 && g2 >= g3 && g4 >= 0.0 && g6 >= 0.0
    };
    let possible = axis.forms.iter().filter(smooth);
    let Some(form) = possible.min_by(|a, b| a.bic.total_cmp(&b.bic)) else {
        bail!(
            "an arm file has friction (12) only, of which no form with positive factors fits this axis; leave --arm out"
        );
    };
    let g = ["g1", "g2", "g3", "g4", "g5", "g6"].map(|g| form.parameter(g).map_or(0.0, |p| p.value));
    let moving = place.joint;
    let joint = JointParameters {
        friction: Some(Friction(g)),
        ..JointParameters::default()
    };
    let mut joints = [joint; 2];
    joints[1 - moving].locked = true;
    let link = |inertia| Link {
        mass: NOTHING,
        length: 1.0,
        com: 0.0,
        inertia,
    };
    let mut links = [link(0.0); 2];
    // What the placeholders have about the shoulder is taken off.
    links[moving] = link(form.inertia.value - if moving == 0 { NOTHING } else { 0.0 });
    let arm = ArmParameters {
        model: Model::Rigid,
        links,
        joints,
        parts: Parts {
            friction: true,
            ..Parts::of(Model::Rigid)
        },
    };
    let initial = started(moving, log.position[0], [log.position[0], axis.velocity[0]]);
    let text = text(arm, initial, (log.position.len(), log.sample_time), place.excitation)?;
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
fn started(joint: usize, angle: f64, [motor, velocity]: [f64; 2]) -> State {
    let mut state = State::default();
    state.q[joint] = angle;
    state.qm[joint] = motor;
    state.dq[joint] = velocity;
    state.dqm[joint] = velocity;
    state
}

/// The text of the file of an arm in the run of a record of so many samples and this sample time.
pub fn text(
    arm: ArmParameters,
    initial: State,
    (samples, sample_time): (usize, f64),
    excitation: Excitation,
) -> Result<String> {
    let file = ArmFile {
        arm,
        initial,
        run: Run {
            duration: (samples - 1) as f64 * sample_time,
            sample_time,
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
