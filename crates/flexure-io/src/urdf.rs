//! Chains of links from URDF, the robot description of ROS.
//!
//! The reader takes links with their inertias, and joints that turn, slide or are fixed. Shapes, materials, transmissions and other
//! elements do not change the motion and are ignored; so are `<dynamics>`, `effort` and `velocity`.

use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

use flexure::error::ArmError;
use flexure::manipulator::chain::{Base, Chain, ChainLink, ChainParameters, JointMotion, LinkInertia};
use roxmltree::{Document, Node};

use crate::error::{Error, Result};
use crate::text::read_text;

/// Options for what a URDF does not contain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrdfOptions {
    /// Whether the root link is fixed to the world or floats.
    pub base: Base,
    /// The acceleration of gravity in the world, m/s^2.
    pub gravity: [f64; 3],
}

impl Default for UrdfOptions {
    /// A fixed base on the ground, z upwards.
    fn default() -> Self {
        UrdfOptions {
            base: Base::Fixed,
            gravity: [0.0, 0.0, -9.81],
        }
    }
}

/// Reads a chain from a URDF file.
///
/// The joints come depth first, and those of one link in the order of their names, as in Pinocchio. A `continuous` joint has one
/// position, its angle. A joint without `<limit>` has no limits.
///
/// # Errors
/// [`Error::Urdf`] with the line and the name: text that is no XML, no `<robot>`, names that are missing or used twice, invalid numbers,
/// joints of other types or that mimic others, loops, several roots, moving links without mass, moments of inertia that no body can have;
/// [`Error::Read`] where the file cannot be read.
pub fn read_urdf(path: &Path, options: &UrdfOptions) -> Result<Chain> {
    let text = read_text(path)?;
    parse_urdf(&text, path, options)
}

/// Reads a chain from the text of a URDF; `path` names it in messages.
///
/// # Errors
/// As [`read_urdf`].
///
/// ```
/// use std::path::Path;
/// use flexure_io::urdf::{UrdfOptions, parse_urdf};
///
/// let text = r#"<robot name="pendulum">
///   <link name="world"/>
///   <link name="rod"><inertial>
///     <origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/>
///   </inertial></link>
///   <joint name="pivot" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// </robot>"#;
/// let chain = parse_urdf(text, Path::new("pendulum.urdf"), &UrdfOptions::default())?;
/// assert_eq!(chain.joints(), ["pivot"]);
/// # Ok::<(), flexure_io::Error>(())
/// ```
pub fn parse_urdf(text: &str, path: &Path, options: &UrdfOptions) -> Result<Chain> {
    let fail = |Problem { line, what }| Error::Urdf {
        path: path.to_owned(),
        line,
        problem: what,
    };
    let document = Document::parse(text).map_err(|error| {
        // The error's text has the position too.
        let (line, what) = (error.pos().row, format!("this is no XML: {error}"));
        fail(Problem { line, what })
    })?;
    chain(&document, options).map_err(fail)
}

/// What is wrong, and where.
struct Problem {
    line: u32,
    what: String,
}

type Parsed<T> = std::result::Result<T, Problem>;

/// A problem of an element.
fn at(node: Node, what: impl Into<String>) -> Problem {
    let line = node.document().text_pos_at(node.range().start).row;
    Problem {
        line,
        what: what.into(),
    }
}

/// A joint as it is written.
struct Joint<'a> {
    node: Node<'a, 'a>,
    name: &'a str,
    motion: JointMotion,
    parent: &'a str,
    child: &'a str,
}

fn chain(document: &Document, options: &UrdfOptions) -> Parsed<Chain> {
    let robot = document.root_element();
    if !robot.has_tag_name("robot") {
        let what = format!(
            "the first element is <{}>; a URDF begins with <robot>",
            robot.tag_name().name()
        );
        return Err(at(robot, what));
    }
    let of_xacro = |n: &Node| n.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
    if let Some(macros) = robot.descendants().find(of_xacro) {
        let what = "this is a xacro file; expand it first: xacro robot.xacro > robot.urdf";
        return Err(at(macros, what));
    }
    let links = links(robot)?;
    let joints = joints(robot, &links)?;
    let root = root(robot, &links, &joints)?;
    let of_link = |name: &str| inertial(links[name]);

    // The children of a link, by the names of their joints: the last one on the stack comes first.
    let mut children: BTreeMap<&str, Vec<&Joint>> = BTreeMap::new();
    for joint in joints.values().rev() {
        children.entry(joint.parent).or_default().push(joint);
    }
    let mut stack: Vec<(Option<usize>, &Joint)> = Vec::new();
    let mut open = |link: &str, index: Option<usize>, stack: &mut Vec<_>| {
        let own = children.remove(link).unwrap_or_default();
        stack.extend(own.into_iter().map(|joint| (index, joint)));
    };
    open(root, None, &mut stack);
    let mut parameters = ChainParameters {
        base_name: root.to_owned(),
        base: options.base,
        base_inertia: of_link(root)?,
        links: Vec::with_capacity(joints.len()),
        gravity: options.gravity,
    };
    while let Some((parent, joint)) = stack.pop() {
        open(joint.child, Some(parameters.links.len()), &mut stack);
        parameters.links.push(link(joint, parent, of_link(joint.child)?)?);
    }
    // Every link has at most one parent, so links that the root does not reach form a loop.
    if let Some(joint) = children.into_values().flatten().next() {
        let what = format!(
            "joint '{}' belongs to a closed loop of joints; a chain has none, so cut the loop at one joint",
            joint.name
        );
        return Err(at(joint.node, what));
    }
    Chain::new(&parameters).map_err(|error| match &error {
        flexure::Error::Arm(ArmError::Chain { link, .. }) => at(links[link.as_str()], error.to_string()),
        _ => at(robot, error.to_string()),
    })
}

/// The links by name.
fn links<'a>(robot: Node<'a, 'a>) -> Parsed<BTreeMap<&'a str, Node<'a, 'a>>> {
    let mut links = BTreeMap::new();
    for node in elements(robot, "link") {
        let name = attribute(node, "name")?;
        if links.insert(name, node).is_some() {
            return Err(at(
                node,
                format!("the name of link '{name}' is used twice; names must differ"),
            ));
        }
    }
    if links.is_empty() {
        return Err(at(robot, "the robot has no <link>"));
    }
    Ok(links)
}

/// The joints by name.
fn joints<'a>(robot: Node<'a, 'a>, links: &BTreeMap<&str, Node>) -> Parsed<BTreeMap<&'a str, Joint<'a>>> {
    let mut joints: BTreeMap<&str, Joint> = BTreeMap::new();
    for node in elements(robot, "joint") {
        let name = attribute(node, "name")?;
        let motion = match attribute(node, "type")? {
            "revolute" | "continuous" => JointMotion::Revolute,
            "prismatic" => JointMotion::Prismatic,
            "fixed" => JointMotion::Fixed,
            other => {
                let what = format!(
                    "joint '{name}' has the type '{other}'; known are revolute, continuous, prismatic and fixed (a base that floats \
                     is asked for beside the file, by base = free)"
                );
                return Err(at(node, what));
            }
        };
        if let Some(mimic) = child(node, "mimic") {
            let what = format!(
                "joint '{name}' mimics another joint; a chain has no coupled joints, so fix it or leave <mimic> out"
            );
            return Err(at(mimic, what));
        }
        let end = |role: &str| -> Parsed<&'a str> {
            let element = child(node, role).ok_or_else(|| at(node, format!("joint '{name}' has no <{role}>")))?;
            let link = attribute(element, "link")?;
            if links.contains_key(link) {
                return Ok(link);
            }
            Err(at(
                element,
                format!("the {role} of joint '{name}' is link '{link}', which the file does not have"),
            ))
        };
        let joint = Joint {
            node,
            name,
            motion,
            parent: end("parent")?,
            child: end("child")?,
        };
        if let Some(other) = joints.values().find(|other| other.child == joint.child) {
            let what = format!(
                "link '{}' hangs on two joints, '{}' and '{name}'; a chain has no closed loops, so cut the loop at one of them",
                joint.child, other.name
            );
            return Err(at(node, what));
        }
        if joints.insert(name, joint).is_some() {
            return Err(at(
                node,
                format!("the name of joint '{name}' is used twice; names must differ"),
            ));
        }
    }
    Ok(joints)
}

/// The root: the only link that is no joint's child.
fn root<'a>(robot: Node, links: &BTreeMap<&'a str, Node>, joints: &BTreeMap<&str, Joint>) -> Parsed<&'a str> {
    let hangs = |link: &str| joints.values().any(|joint| joint.child == link);
    let roots: Vec<&str> = links.keys().copied().filter(|link| !hangs(link)).collect();
    match roots[..] {
        [root] => Ok(root),
        [] => Err(at(
            robot,
            "every link is the child of a joint: the joints form a closed loop, and no link is the base",
        )),
        [first, second, ..] => {
            let what = format!(
                "{} links are no joint's child, among them '{first}' and '{second}'; only one of them can be the base, so fix the others \
                 to it by joints",
                roots.len()
            );
            Err(at(links[second], what))
        }
    }
}

/// A link and the joint that carries it.
fn link(joint: &Joint, parent: Option<usize>, inertia: Option<LinkInertia>) -> Parsed<ChainLink> {
    let Pose { translation, rotation } = origin(joint.node)?;
    let axis = match child(joint.node, "axis") {
        Some(axis) => numbers(axis, "xyz")?,
        None => [1.0, 0.0, 0.0],
    };
    let continuous = joint.node.attribute("type") == Some("continuous");
    let limit = child(joint.node, "limit").filter(|_| !continuous);
    let limits = match limit {
        // The standard's defaults.
        Some(limit) => [optional(limit, "lower", 0.0)?, optional(limit, "upper", 0.0)?],
        None => [f64::NEG_INFINITY, f64::INFINITY],
    };
    Ok(ChainLink {
        name: joint.child.to_owned(),
        joint: joint.name.to_owned(),
        parent,
        motion: joint.motion,
        axis,
        rotation,
        translation,
        inertia,
        limits,
    })
}

/// The inertia of a link; `None` without one, or if all its numbers are zero, which means the same.
fn inertial(link: Node) -> Parsed<Option<LinkInertia>> {
    let Some(node) = child(link, "inertial") else {
        return Ok(None);
    };
    let part = |name: &str| child(node, name).ok_or_else(|| at(node, format!("<inertial> has no <{name}>")));
    let mass = number(part("mass")?, "value")?;
    let moments = part("inertia")?;
    let of = |name: &str| number(moments, name);
    let [xx, xy, xz, yy, yz, zz] = [of("ixx")?, of("ixy")?, of("ixz")?, of("iyy")?, of("iyz")?, of("izz")?];
    if [mass, xx, xy, xz, yy, yz, zz].iter().all(|value| *value == 0.0) {
        return Ok(None);
    }
    let Pose {
        translation: com,
        rotation,
    } = origin(node)?;
    let own = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut matrix = own;
    if rotation != IDENTITY {
        for i in 0..3 {
            for j in 0..=i {
                let terms = (0..9).map(|k| rotation[i][k / 3] * own[k / 3][k % 3] * rotation[j][k % 3]);
                let value = terms.sum();
                matrix[i][j] = value;
                matrix[j][i] = value;
            }
        }
    }
    Ok(Some(LinkInertia { mass, com, matrix }))
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Where an element is, and how it is turned.
struct Pose {
    translation: [f64; 3],
    /// By rows.
    rotation: [[f64; 3]; 3],
}

/// The pose of an element: `rpy` turns about the fixed axes x, y and z, in this order.
fn origin(node: Node) -> Parsed<Pose> {
    let Some(origin) = child(node, "origin") else {
        return Ok(Pose {
            translation: [0.0; 3],
            rotation: IDENTITY,
        });
    };
    let triple = |name| match origin.has_attribute(name) {
        true => numbers(origin, name),
        false => Ok([0.0; 3]),
    };
    Ok(Pose {
        translation: triple("xyz")?,
        rotation: rotation(triple("rpy")?),
    })
}

/// The rotation, by rows, that turns about the fixed axes x, y and z by these angles, in this order.
pub(crate) fn rotation(angles: [f64; 3]) -> [[f64; 3]; 3] {
    if angles == [0.0; 3] {
        return IDENTITY;
    }
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(f64::sin_cos);
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

fn elements<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn attribute<'a>(node: Node<'a, 'a>, name: &str) -> Parsed<&'a str> {
    let value = node.attribute(name);
    value.ok_or_else(|| at(node, format!("<{}> has no {name}", node.tag_name().name())))
}

fn number(node: Node, name: &str) -> Parsed<f64> {
    let text = attribute(node, name)?;
    parsed(text).ok_or_else(|| {
        let what = format!(
            "{name} of <{}> is '{text}', which is no finite number",
            node.tag_name().name()
        );
        at(node, what)
    })
}

fn optional(node: Node, name: &str, default: f64) -> Parsed<f64> {
    match node.has_attribute(name) {
        true => number(node, name),
        false => Ok(default),
    }
}

fn numbers(node: Node, name: &str) -> Parsed<[f64; 3]> {
    let text = attribute(node, name)?;
    let values: Option<Vec<f64>> = text.split_whitespace().map(parsed).collect();
    values.and_then(|values| values.try_into().ok()).ok_or_else(|| {
        let what = format!(
            "{name} of <{}> is '{text}', which is not three finite numbers",
            node.tag_name().name()
        );
        at(node, what)
    })
}

fn parsed(text: &str) -> Option<f64> {
    f64::from_str(text.trim()).ok().filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests;
