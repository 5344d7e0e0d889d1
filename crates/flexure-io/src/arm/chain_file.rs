//! Chain files: a chain or tree of links with the drives of its joints, in TOML.
//!
//! ```toml
//! [chain]
//! base = "free"                # fixed (without this key) | free
//! gravity = [0.0, 0.0, 0.0]    # m/s^2; without this key that of the ground, z upwards
//! rotors = "none"              # none (without this key) | inertial | complete: how rotors act on the links that carry them
//! [chain.body]                 # the base, named "base"; needed where it is free
//! mass = 120.0                 # kg
//! com = [0.0, 0.0, 0.0]        # m; without this key the origin
//! inertia = [29.0, 29.0, 29.0, 0.0, 0.0, 0.0]   # kg m^2 about the centre of mass: xx, yy, zz, xy, xz, yz
//! [[chain.link]]
//! name = "upper"
//! parent = "base"              # without this key the link before
//! joint = "shoulder"
//! type = "revolute"            # revolute (without this key) | prismatic | fixed
//! axis = [0.0, 0.0, 1.0]       # in the link's frame; without this key z
//! origin = [0.6, 0.0, 0.0]     # of the link's frame in its parent's, m; without this key zero, or the tip of its parent's beam
//! rpy = [0.0, 0.0, 0.0]        # rad, about the parent's x, y and z, in this order; without this key zero
//! limits = [-3.0, 3.0]         # rad or m; without this key none
//! mass = 1.5
//! com = [2.25, 0.0, 0.0]
//! inertia = [0.01, 2.5, 2.5, 0.0, 0.0, 0.0]
//! [chain.link.drive]           # without this table a rigid joint without motor and friction
//! model = "nonlinear"          # rigid | linear | nonlinear, and the keys of a joint of an arm file
//! motor_inertia = 1.0
//! gear_ratio = 1.0             # without this key 1; counts where rotors act on their carriers
//! linear = 500.0
//! [chain.link.beam]            # without this table the link is rigid; with it its mass and inertia are those of a rigid hub at its joint
//! length = 4.5                 # m
//! stiffness = 5000.0           # EI, N m^2
//! density = 0.335              # kg/m
//! damping = 0.01               # the damping ratio of the first mode of the clamped beam; without this key none
//! along = [1.0, 0.0, 0.0]      # its direction in the link's frame; without this key x
//! model = "segments"           # segments (without this key) | elements | modes: rigid parts, cubic finite elements, clamped-free modes
//! count = 3                    # how many of them; without this key 3, 5 or 3
//! springs = "root"             # of segments: root (without this key: 2 EI/h at the root, then EI/h) | middle (EI/h amid each part)
//! axes = [[0.0, 0.0, 1.0]]     # of segments: the one or two axes about which it bends; without this key that of the joint
//! axial_stiffness = 2.8e7      # of elements and modes: EA, N; without this key the beam does not stretch
//! [load]                       # optional: what the tip carries
//! link = "lower"               # without this key the last link
//! mass = 10.0
//! com = [4.5, 0.0, 0.0]        # in that link's frame; without this key its origin, or the tip of its beam
//! inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]      # without this key a point
//! ```
//!
//! What a beam carries sits at its tip: `origin` and `com` are its place while the beam is straight. Beams of elements and modes bend in the
//! plane of x and y, in which all joints turn. Keys that do not exist are errors.

use flexure::Error;
use flexure::error::ArmError as Unusable;
use flexure::manipulator::chain::{
    Base, Chain, ChainDrive, ChainLink, ChainParameters, DrivenChain, JointMotion, LinkInertia, RotorCoupling,
    SegmentedBeam, segmented,
};
use flexure::manipulator::flexible_arm::{FlexibleArm, FlexibleBeam};
use flexure::manipulator::{JointKind, JointParameters};

use super::beam_table::BeamTable;
use super::chain_tables::{BaseName, ChainTable, File, LinkTable, Load, Motion, Rotors};
use super::error::ArmError;
use super::file::{JointTable, Source};
use super::values::plain;
use crate::urdf::rotation;

/// Gravity on the ground, z upwards, m/s^2.
const GROUND: [f64; 3] = [0.0, 0.0, -9.81];
/// The inertia of a point: the least that a body may have, compared with the links'.
const POINT: f64 = 1e-12;

/// Whether the text of a TOML file is that of a chain.
pub fn is_chain(text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("[chain]"))
}

/// What a chain file describes.
#[derive(Debug, Clone, PartialEq)]
pub enum ChainFile {
    /// A chain of rigid links; beams are segments.
    Chain(DrivenChain),
    /// An arm in a plane, whose beams are finite elements or modes.
    FlexibleArm(FlexibleArm),
}

/// Reads and checks the text of a chain file; `source_name` names it in errors.
///
/// # Errors
/// [`ArmError::Format`] and [`ArmError::Value`], with the file, the line and the key.
///
/// ```
/// use flexure_io::arm::{ChainFile, chain_file_of_toml};
///
/// let text = r#"
/// [chain]
/// [[chain.link]]
/// name = "arm"
/// joint = "shoulder"
/// [chain.link.beam]
/// length = 2.0
/// stiffness = 300.0
/// density = 0.7
/// model = "modes"
/// "#;
/// let ChainFile::FlexibleArm(arm) = chain_file_of_toml(text, "arm.toml")? else { panic!() };
/// assert_eq!(arm.coordinates(), 4);
/// # Ok::<(), flexure_io::arm::ArmError>(())
/// ```
pub fn chain_file_of_toml(text: &str, source_name: &str) -> Result<ChainFile, ArmError> {
    let source = Source {
        text,
        name: source_name,
    };
    let File { chain: table, load } = source.parse()?;
    let drives = drives(&source, &table.link)?;
    let parameters = parameters(&source, &table, load)?;
    let beams: Vec<(usize, &LinkTable, &BeamTable)> = (table.link.iter().enumerate())
        .filter_map(|(i, link)| Some((i, link, link.beam.as_ref()?)))
        .collect();
    for (i, _, beam) in &beams {
        if let Some(idle) = beam.idle() {
            let reason = "means nothing for a beam of this model; leave it out";
            return Err(source.value(key(*i, &format!("beam.{idle}")), reason));
        }
    }
    let joints: Vec<String> = table
        .link
        .iter()
        .filter(|l| l.moves())
        .map(|l| l.joint.clone())
        .collect();
    if beams.iter().any(|(_, _, beam)| beam.floats()) {
        if let Some((i, ..)) = beams.iter().find(|(_, _, beam)| !beam.floats()) {
            let reason = "all beams of an arm are segments, or none is; this one is, others are not";
            return Err(source.value(key(*i, "beam.model"), reason));
        }
        if !matches!(table.rotors, Rotors::None) {
            let reason = "rotors act on links in chains of segments alone; leave this key out";
            return Err(source.value("chain.rotors", reason));
        }
        let beams: Vec<FlexibleBeam> = beams.iter().map(|(i, _, beam)| beam.floating(*i)).collect();
        let arm = FlexibleArm::new(&parameters, &drives, &beams);
        let arm = arm.map_err(|error| locate(&source, &table, &joints, error))?;
        return Ok(ChainFile::FlexibleArm(arm));
    }
    let rotors = match table.rotors {
        Rotors::None => RotorCoupling::None,
        Rotors::Inertial => RotorCoupling::Inertial,
        Rotors::Complete => RotorCoupling::Complete,
    };
    let beams: Vec<SegmentedBeam> = (beams.iter())
        .map(|(i, link, beam)| beam.segmented(*i, link.axis()))
        .collect();
    let located = |error| locate(&source, &table, &joints, error);
    let (parameters, drives) = segmented(&parameters, &drives, &beams).map_err(located)?;
    let chain = Chain::new(&parameters).map_err(located)?;
    let joints = chain.joints().to_vec();
    let chain = DrivenChain::new(chain, &drives, rotors);
    (chain.map(ChainFile::Chain)).map_err(|error| locate(&source, &table, &joints, error))
}

/// [`chain_file_of_toml`] for files without beams of finite elements or modes.
///
/// # Errors
/// Those of [`chain_file_of_toml`], and [`ArmError::Value`] for such beams.
///
/// ```
/// let text = r#"
/// [chain]
/// [[chain.link]]
/// name = "rod"
/// joint = "pivot"
/// axis = [0.0, 1.0, 0.0]
/// mass = 2.0
/// com = [0.0, 0.0, -0.5]
/// inertia = [0.1, 0.1, 0.001, 0.0, 0.0, 0.0]
/// "#;
/// let chain = flexure_io::arm::chain_of_toml(text, "pendulum.toml")?;
/// assert_eq!(chain.chain().joints(), ["pivot"]);
/// # Ok::<(), flexure_io::arm::ArmError>(())
/// ```
pub fn chain_of_toml(text: &str, source_name: &str) -> Result<DrivenChain, ArmError> {
    match chain_file_of_toml(text, source_name)? {
        ChainFile::Chain(chain) => Ok(chain),
        ChainFile::FlexibleArm(_) => {
            let source = Source {
                text,
                name: source_name,
            };
            let reason =
                "its beams are finite elements or modes, which make a flexible arm and no chain; take segments";
            Err(source.value("chain", reason))
        }
    }
}

/// Puts a key and a line to an error of the library about a chain with these joints.
fn locate(source: &Source, table: &ChainTable, joints: &[String], error: Error) -> ArmError {
    let key = match &error {
        Error::Arm(Unusable::Chain { link, .. }) => match table.link.iter().position(|l| l.name == *link) {
            Some(i) => format!("chain.link[{}]", i + 1),
            None if link == BASE => "chain.body".to_owned(),
            None => "load".to_owned(),
        },
        Error::Arm(Unusable::Unphysical { number, quantity, .. }) => {
            let joint = joints.get(number - 1);
            let link = table.link.iter().position(|link| Some(&link.joint) == joint);
            let name = quantity.split(' ').next().unwrap_or(quantity);
            key(link.unwrap_or(0), &format!("drive.{name}"))
        }
        _ => "chain".to_owned(),
    };
    source.value(key, error.to_string())
}

/// The chain's links; the load is a link fixed to another one.
fn parameters(source: &Source, table: &ChainTable, load: Option<Load>) -> Result<ChainParameters, ArmError> {
    let mut links = Vec::with_capacity(table.link.len() + 1);
    for (i, link) in table.link.iter().enumerate() {
        let parent = parent(source, table, i)?;
        links.push(ChainLink {
            name: link.name.clone(),
            joint: link.joint.clone(),
            parent,
            motion: match link.motion {
                Motion::Revolute => JointMotion::Revolute,
                Motion::Prismatic => JointMotion::Prismatic,
                Motion::Fixed => JointMotion::Fixed,
            },
            axis: link.axis(),
            rotation: rotation(link.rpy),
            translation: (link.origin).unwrap_or_else(|| parent.map_or([0.0; 3], |p| table.link[p].end())),
            inertia: inertia(source, link, i)?,
            limits: link.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        });
    }
    if let Some(load) = load {
        links.push(load_link(source, load, &table.link)?);
    }
    Ok(ChainParameters {
        base_name: BASE.to_owned(),
        base: match table.base {
            BaseName::Fixed => Base::Fixed,
            BaseName::Free => Base::Free,
        },
        base_inertia: table.body.as_ref().map(|b| body(b.mass, b.com, b.inertia)),
        links,
        gravity: table.gravity.unwrap_or(GROUND),
    })
}

/// The key of a value of the link of this index.
fn key(i: usize, name: &str) -> String {
    format!("chain.link[{}].{name}", i + 1)
}

/// The index of the parent of link `i`, none for the base.
fn parent(source: &Source, table: &ChainTable, i: usize) -> Result<Option<usize>, ArmError> {
    match &table.link[i].parent {
        None => Ok(i.checked_sub(1)),
        Some(name) if name == BASE => Ok(None),
        Some(name) => match table.link[..i].iter().position(|other| other.name == *name) {
            Some(parent) => Ok(Some(parent)),
            None => {
                let reason = format!("there is no link '{name}' before this one; list every link after its parent");
                Err(source.value(key(i, "parent"), reason))
            }
        },
    }
}

/// The inertia of the link of this index, none for a link without a mass.
fn inertia(source: &Source, link: &LinkTable, i: usize) -> Result<Option<LinkInertia>, ArmError> {
    match (link.mass, link.inertia) {
        (Some(mass), Some(moments)) => Ok(Some(body(mass, link.com.unwrap_or_default(), moments))),
        (None, None) if link.com.is_none() => Ok(None),
        (None, _) => {
            let reason = "missing; a link with an inertia needs it, positive, in kg";
            Err(source.value(key(i, "mass"), reason))
        }
        (Some(_), None) => {
            let reason = "missing; a link with a mass needs xx, yy, zz, xy, xz, yz about its centre of mass, in kg m^2";
            Err(source.value(key(i, "inertia"), reason))
        }
    }
}

/// The load, as a link that is fixed to the link it names, else to the last.
fn load_link(source: &Source, load: Load, links: &[LinkTable]) -> Result<ChainLink, ArmError> {
    let carrier = match &load.link {
        None => links.len().checked_sub(1),
        Some(name) => match links.iter().position(|link| link.name == *name) {
            Some(i) => Some(i),
            None => return Err(source.value("load.link", format!("there is no link '{name}'"))),
        },
    };
    let end = carrier.map_or([0.0; 3], |i| links[i].end());
    let moments = load.inertia.unwrap_or([POINT, POINT, POINT, 0.0, 0.0, 0.0]);
    Ok(ChainLink {
        name: "load".to_owned(),
        joint: "load".to_owned(),
        parent: carrier,
        motion: JointMotion::Fixed,
        axis: [0.0, 0.0, 1.0],
        rotation: rotation([0.0; 3]),
        translation: [0.0; 3],
        inertia: Some(body(load.mass, load.com.unwrap_or(end), moments)),
        limits: [f64::NEG_INFINITY, f64::INFINITY],
    })
}

/// The name of the base.
const BASE: &str = "base";

fn body(mass: f64, com: [f64; 3], [xx, yy, zz, xy, xz, yz]: [f64; 6]) -> LinkInertia {
    LinkInertia {
        mass,
        com,
        matrix: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
    }
}

/// The drives of the joints that move.
fn drives(source: &Source, links: &[LinkTable]) -> Result<Vec<ChainDrive>, ArmError> {
    let mut drives = Vec::new();
    for (i, link) in links.iter().enumerate() {
        let key = key(i, "drive");
        match (&link.motion, &link.drive) {
            (Motion::Fixed, None) => {}
            (Motion::Fixed, Some(_)) => {
                return Err(source.value(key, "a fixed joint has no drive; leave this table out"));
            }
            (_, None) => drives.push(ChainDrive::default()),
            (_, Some(table)) => drives.push(driven(source, table, &key)?),
        }
    }
    Ok(drives)
}

/// A drive: the keys of an arm file's joint, and two more.
fn driven(source: &Source, table: &toml::Table, key: &str) -> Result<ChainDrive, ArmError> {
    let mut table = table.clone();
    let (model, ratio) = (table.remove("model"), table.remove("gear_ratio"));
    let wrong = |name: &str, error: &toml::de::Error| source.value(format!("{key}{name}"), plain(error.message()));
    let Some(model) = model else {
        return Err(source.value(format!("{key}.model"), "missing; it is rigid, linear or nonlinear"));
    };
    let kind: JointKind = model.try_into().map_err(|e| wrong(".model", &e))?;
    let ratio: Option<f64> = (ratio.map(toml::Value::try_into).transpose()).map_err(|e| wrong(".gear_ratio", &e))?;
    let joint: JointTable = table.try_into().map_err(|e| wrong("", &e))?;
    joint.complete(source, kind, kind != JointKind::Rigid, key)?;
    Ok(ChainDrive {
        kind,
        joint: JointParameters::from(&joint),
        gear_ratio: ratio.unwrap_or(1.0),
        passive: false,
    })
}
