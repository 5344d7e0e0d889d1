//! The columns of a record that are those of a robot's joints.

use flexure::look::{Look, Relation};
use flexure_io::RecordFile;

use super::Request;
use super::roles::{Role, are_of_a_joint, is_neutral, is_torque, role, role_with_unit};

/// The columns of a joint.
#[derive(Clone, Copy)]
pub(super) struct Joint<'a> {
    pub torque: &'a str,
    pub position: &'a str,
    /// The motor's angle, if the joint also has an encoder before its gear.
    pub motor: Option<&'a str>,
}

/// Whether the names of its columns say that it is a joint.
pub(super) fn is_named(joint: &Joint) -> bool {
    let is = |name: &str, wanted: &[Role]| role(name).is_some_and(|(role, _)| wanted.contains(&role));
    is(joint.torque, &[Role::Torque]) && is(joint.position, &[Role::Position, Role::MotorPosition])
}

/// Whether the position of a joint was seen to integrate its torque.
pub(super) fn integration(look: &Look, joint: &Joint) -> bool {
    let name = |i: usize| look.columns[i].name.as_str();
    let positions = [Some(joint.position), joint.motor];
    (look.integrations.iter()).any(|i| name(i.input) == joint.torque && positions.contains(&Some(name(i.output))))
}

/// The joints of a record: from the user's choice, then from names and units of the columns, then from a position that integrates a torque.
pub(super) fn joints<'a>(file: &RecordFile, request: &Request<'a>, look: &'a Look) -> Vec<Joint<'a>> {
    let named = named_joints(file, look);
    if !request.inputs.is_empty() || request.output.is_some() {
        return given_joint(request, look, &named).into_iter().collect();
    }
    match named.is_empty() {
        true => integrating_joint(look).into_iter().collect(),
        false => named,
    }
}

/// The joint that the user names: one of these, or one whose position integrates its torque.
fn given_joint<'a>(request: &Request<'a>, look: &'a Look, named: &[Joint<'a>]) -> Option<Joint<'a>> {
    let (&[torque], Some(position)) = (request.inputs, request.output) else {
        return None;
    };
    let is_meant =
        |joint: &&Joint| joint.torque == torque && [Some(joint.position), joint.motor].contains(&Some(position));
    let joint = Joint {
        torque,
        position,
        motor: None,
    };
    named
        .iter()
        .find(is_meant)
        .copied()
        .or_else(|| integration(look, &joint).then_some(joint))
}

/// The joints that the names and the units of the columns tell.
fn named_joints<'a>(file: &RecordFile, look: &'a Look) -> Vec<Joint<'a>> {
    let name = |i: usize| look.columns[i].name.as_str();
    let by_unit = |i: usize| role_with_unit(name(i), file.unit(name(i)));
    let is_signal = |i: &usize| Some(*i) != look.time && look.columns[*i].is_signal();
    let signals: Vec<usize> = (0..look.columns.len()).filter(is_signal).collect();
    let named = |wanted: Role, number: &str| {
        let says = |i: &&usize| role(name(**i)) == Some((wanted, number));
        let may_say = |i: &&usize| by_unit(**i) == Some((wanted, number));
        let found = signals.iter().find(says).or_else(|| signals.iter().find(may_say));
        found.map(|i| name(*i))
    };
    let torques = |role: &dyn Fn(usize) -> Option<(Role, &'a str)>| -> Vec<(&'a str, &'a str)> {
        let of = |i: &usize| match role(*i) {
            Some((Role::Torque, number)) => Some((name(*i), number)),
            _ => None,
        };
        signals.iter().filter_map(of).collect()
    };
    let mut driving = torques(&|i| role(name(i)));
    if driving.is_empty() {
        driving = torques(&by_unit);
    }
    driving
        .into_iter()
        .filter_map(|(torque, number)| {
            let (link, motor) = (named(Role::Position, number), named(Role::MotorPosition, number));
            Some(Joint {
                torque,
                position: link.or(motor)?,
                motor: link.and(motor),
            })
        })
        // A force and a position may belong to any mechanism with a spring.
        .filter(|joint| {
            let have_units = are_of_a_joint(file.unit(joint.position), file.unit(joint.torque));
            joint.motor.is_some() || is_torque(joint.torque) || have_units || integration(look, joint)
        })
        .collect()
}

/// The joint whose position integrates its torque best.
fn integrating_joint(look: &Look) -> Option<Joint<'_>> {
    let name = |i: usize| look.columns[i].name.as_str();
    let moved = |i: &&flexure::look::Integration| {
        let derivative = |k: &flexure::look::ColumnRelation| {
            (k.column, k.of) == (i.input, i.output) && matches!(k.relation, Relation::Derivative { .. })
        };
        let says = |i: usize, wanted: &[Role]| {
            is_neutral(name(i)) || role(name(i)).is_some_and(|(role, _)| wanted.contains(&role))
        };
        // A fluid level integrates a flow too, but is no joint.
        let axis = says(i.input, &[Role::Torque]) && says(i.output, &[Role::Position, Role::MotorPosition]);
        axis && !look.relations.iter().any(derivative)
    };
    let best = |a: &&flexure::look::Integration, b: &&flexure::look::Integration| {
        a.found.explained.total_cmp(&b.found.explained)
    };
    let found = look.integrations.iter().filter(moved).max_by(best)?;
    Some(Joint {
        torque: name(found.input),
        position: name(found.output),
        motor: None,
    })
}
