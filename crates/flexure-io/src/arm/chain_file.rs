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
//! origin = [0.6, 0.0, 0.0]     # of the link's frame in its parent's, m; without this key zero
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
//! [load]                       # optional: what the tip carries
//! link = "lower"               # without this key the last link
//! mass = 10.0
//! com = [4.5, 0.0, 0.0]        # in that link's frame
//! inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]      # without this key a point
//! ```
//!
//! Keys that do not exist are errors.

use flexure::Error;
use flexure::error::ArmError as Unusable;
use flexure::manipulator::chain::{
    Base, Chain, ChainDrive, ChainLink, ChainParameters, DrivenChain, JointMotion, LinkInertia, RotorCoupling,
};
use flexure::manipulator::{JointKind, JointParameters};
use serde::Deserialize;

use super::error::ArmError;
use super::file::{JointTable, Source};
use super::values::{list, plain};
use crate::urdf::rotation;

/// Gravity on the ground, z upwards, m/s^2.
const GROUND: [f64; 3] = [0.0, 0.0, -9.81];
/// The inertia of a point: the least that a body may have, compared with the links'.
const POINT: f64 = 1e-12;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    chain: ChainTable,
    load: Option<Load>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChainTable {
    #[serde(default)]
    base: BaseName,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    gravity: Option<[f64; 3]>,
    #[serde(default)]
    rotors: Rotors,
    body: Option<Body>,
    link: Vec<LinkTable>,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum BaseName {
    #[default]
    Fixed,
    Free,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Rotors {
    #[default]
    None,
    Inertial,
    Complete,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Motion {
    #[default]
    Revolute,
    Prismatic,
    Fixed,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    mass: f64,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    com: [f64; 3],
    #[serde(deserialize_with = "list::<_, _, 6>")]
    inertia: [f64; 6],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Load {
    link: Option<String>,
    mass: f64,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    com: [f64; 3],
    #[serde(default, deserialize_with = "list::<_, _, 6>")]
    inertia: Option<[f64; 6]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkTable {
    name: String,
    parent: Option<String>,
    joint: String,
    #[serde(rename = "type", default)]
    motion: Motion,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    axis: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    origin: [f64; 3],
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    rpy: [f64; 3],
    #[serde(default, deserialize_with = "list::<_, _, 2>")]
    limits: Option<[f64; 2]>,
    mass: Option<f64>,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    com: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 6>")]
    inertia: Option<[f64; 6]>,
    drive: Option<toml::Table>,
}

/// Whether the text of a TOML file is that of a chain.
pub fn is_chain(text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("[chain]"))
}

/// Reads and checks the text of a chain file; `source_name` names it in errors.
///
/// # Errors
/// [`ArmError::Format`] and [`ArmError::Value`], with the file, the line and the key.
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
    let source = Source {
        text,
        name: source_name,
    };
    let File { chain: table, load } = source.parse()?;
    let rotors = match table.rotors {
        Rotors::None => RotorCoupling::None,
        Rotors::Inertial => RotorCoupling::Inertial,
        Rotors::Complete => RotorCoupling::Complete,
    };
    let drives: Vec<(usize, ChainDrive)> = drives(&source, &table.link)?;
    let parameters = parameters(&source, &table, load)?;
    let located = |error: Error| match &error {
        Error::Arm(Unusable::Chain { link, .. }) => {
            let number = table.link.iter().position(|l| l.name == *link);
            let key = match number {
                Some(i) => format!("chain.link[{}]", i + 1),
                None if *link == parameters.base_name => "chain.body".to_owned(),
                None => "load".to_owned(),
            };
            source.value(key, error.to_string())
        }
        Error::Arm(Unusable::Unphysical { number, quantity, .. }) => {
            let link = drives.get(number - 1).map_or(0, |(link, _)| *link);
            let key = quantity.split(' ').next().unwrap_or(quantity);
            source.value(format!("chain.link[{}].drive.{key}", link + 1), error.to_string())
        }
        _ => source.value("chain", error.to_string()),
    };
    let chain = Chain::new(&parameters).map_err(located)?;
    let each: Vec<ChainDrive> = drives.iter().map(|(_, drive)| *drive).collect();
    DrivenChain::new(chain, &each, rotors).map_err(located)
}

/// The chain's links; the load is a link fixed to another one.
fn parameters(source: &Source, table: &ChainTable, load: Option<Load>) -> Result<ChainParameters, ArmError> {
    let mut links = Vec::with_capacity(table.link.len() + 1);
    for (i, link) in table.link.iter().enumerate() {
        links.push(ChainLink {
            name: link.name.clone(),
            joint: link.joint.clone(),
            parent: parent(source, table, i)?,
            motion: match link.motion {
                Motion::Revolute => JointMotion::Revolute,
                Motion::Prismatic => JointMotion::Prismatic,
                Motion::Fixed => JointMotion::Fixed,
            },
            axis: link.axis.unwrap_or([0.0, 0.0, 1.0]),
            rotation: rotation(link.rpy),
            translation: link.origin,
            inertia: inertia(source, link, i)?,
            limits: link.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        });
    }
    if let Some(load) = load {
        links.push(load_link(source, load, &links)?);
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

/// The load, as a link that is fixed to the link it names, or to the last one.
fn load_link(source: &Source, load: Load, links: &[ChainLink]) -> Result<ChainLink, ArmError> {
    let carrier = match &load.link {
        None => links.len().checked_sub(1),
        Some(name) => match links.iter().position(|link| link.name == *name) {
            Some(i) => Some(i),
            None => return Err(source.value("load.link", format!("there is no link '{name}'"))),
        },
    };
    let moments = load.inertia.unwrap_or([POINT, POINT, POINT, 0.0, 0.0, 0.0]);
    Ok(ChainLink {
        name: "load".to_owned(),
        joint: "load".to_owned(),
        parent: carrier,
        motion: JointMotion::Fixed,
        axis: [0.0, 0.0, 1.0],
        rotation: rotation([0.0; 3]),
        translation: [0.0; 3],
        inertia: Some(body(load.mass, load.com, moments)),
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

/// The drives of the joints that move, each with the number of its link.
fn drives(source: &Source, links: &[LinkTable]) -> Result<Vec<(usize, ChainDrive)>, ArmError> {
    let mut drives = Vec::new();
    for (i, link) in links.iter().enumerate() {
        let key = |name: &str| key(i, &format!("drive{name}"));
        let fixed = matches!(link.motion, Motion::Fixed);
        if fixed {
            if link.drive.is_some() {
                return Err(source.value(key(""), "a fixed joint has no drive; leave this table out"));
            }
            continue;
        }
        let drive = match &link.drive {
            None => ChainDrive::default(),
            Some(table) => driven(source, table, &key(""))?,
        };
        drives.push((i, drive));
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
    })
}
