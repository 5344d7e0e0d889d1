//! Whether a record is the log of a robot's joint, and the command for it.

use flexure::look::{Look, Relation};
use flexure_io::RecordFile;

use super::Request;
use super::roles::{Role, is_force_constant, is_neutral, is_prismatic, is_torque, is_torque_constant, role};
use super::suggestion::Suggestion;

/// The columns of a joint.
struct Joint<'a> {
    torque: &'a str,
    position: &'a str,
    /// The motor's angle, where the joint has an encoder before its gear too.
    motor: Option<&'a str>,
}

/// `flexure joint`, where the names say that the record is of a joint, or where a position integrates a torque.
pub(super) fn suggestion(
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
) -> Option<Suggestion> {
    let joints = joints(request, look);
    let first = joints.first()?;
    let join = |columns: Vec<&str>| columns.join(",");
    // Two flexible joints are a two-link arm.
    let arm = joints.len() == 2 && joints.iter().all(|j| j.motor.is_some());
    let torque = if arm {
        join(joints.iter().map(|j| j.torque).collect())
    } else {
        first.torque.to_owned()
    };
    let position = if arm {
        join(joints.iter().map(|j| j.position).collect())
    } else {
        first.position.to_owned()
    };
    let motor = match (arm, first.motor) {
        (true, _) => Some(join(joints.iter().filter_map(|j| j.motor).collect())),
        (false, motor) => motor.map(str::to_owned),
    };
    let mut options = match &motor {
        Some(motor) => vec!["--motor", motor, "--link", &position],
        None => vec!["--position", &position],
    };
    options.extend(["--torque", &torque]);
    let constants = || file.constants.iter().map(|c| c.0.as_str());
    let constant = constants().find(|name| is_torque_constant(name));
    options.extend(constant.iter().flat_map(|name| ["--torque-constant", *name]));
    let is_line = |name: &str| file.unit(name).is_some_and(is_prismatic);
    let mut notes = Vec::new();
    if motor.is_none() {
        if is_line(first.position) || is_line(first.torque) {
            options.push("--prismatic");
        } else if constant.is_some_and(is_force_constant) {
            options.push("--prismatic");
            notes.push("The constant is called as that of an axis which moves along a line: leave --prismatic out if it turns.".to_owned());
        } else if file.unit(first.position).is_none() {
            notes.push("Add --prismatic if the axis moves along a line: positions in m, forces in N.".to_owned());
        }
        let gains = ["kp", "kv"].map(|gain| constants().find(|name| name.eq_ignore_ascii_case(gain)));
        let is_reference = |name: &&str| matches!(role(name), Some((Role::Reference, _)));
        let reference = look.columns.iter().map(|c| c.name.as_str()).find(is_reference);
        if let (Some(reference), [Some(kp), Some(kv)]) = (reference, gains) {
            options.extend(["--reference", reference, "--kp", kp, "--kv", kv]);
        }
    }
    let given = request.sample_time.map(|step| step.to_string());
    options.extend(given.iter().flat_map(|step| ["--sample-time", step.as_str()]));
    if sample_time.is_none() {
        notes.push(
            "The record has no column of instants, and a joint needs the sample time: add --sample-time S, in s."
                .to_owned(),
        );
    }
    options.extend(["--report", "report.html"]);
    let why = match integration(look, first) {
        true => format!(
            "'{}' integrates '{}', as a position integrates a force: a joint's friction and inertia explain it, a block model does not.",
            first.position, first.torque
        ),
        false => "The columns are named as those of a joint.".to_owned(),
    };
    if motor.is_none() && !integration(look, first) {
        notes.push("The data do not show that the position integrates the torque: if gravity or a spring acts, add --gravity or --spring.".to_owned());
    }
    if !arm && joints.len() > 1 {
        let others: Vec<&str> = joints[1..].iter().map(|j| j.torque).collect();
        notes.push(format!(
            "The joints of {} are identified in the same way, one at a time.",
            others.join(", ")
        ));
    }
    let mut suggestion = Suggestion::new("joint", &options, why);
    suggestion.notes = notes;
    Some(suggestion)
}

/// Whether the position of a joint was seen to integrate its torque.
fn integration(look: &Look, joint: &Joint) -> bool {
    let name = |i: usize| look.columns[i].name.as_str();
    let positions = [Some(joint.position), joint.motor];
    (look.integrations.iter()).any(|i| name(i.input) == joint.torque && positions.contains(&Some(name(i.output))))
}

/// The joints of a record: by the names of their columns, else one whose position integrates its torque.
fn joints<'a>(request: &Request<'a>, look: &'a Look) -> Vec<Joint<'a>> {
    let name = |i: usize| look.columns[i].name.as_str();
    // What is given decides.
    if !request.inputs.is_empty() || request.output.is_some() {
        let (&[torque], Some(position)) = (request.inputs, request.output) else {
            return Vec::new();
        };
        let joint = Joint {
            torque,
            position,
            motor: None,
        };
        return if integration(look, &joint) {
            vec![joint]
        } else {
            Vec::new()
        };
    }
    let is_signal = |i: &usize| Some(*i) != look.time && look.columns[*i].is_signal();
    let signals: Vec<usize> = (0..look.columns.len()).filter(is_signal).collect();
    let named = |wanted: Role, number: &str| {
        let says = |i: &usize| role(name(*i)) == Some((wanted, number));
        signals.iter().copied().find(says).map(name)
    };
    let torques = signals.iter().filter_map(|&i| match role(name(i)) {
        Some((Role::Torque, number)) => Some((name(i), number)),
        _ => None,
    });
    let named: Vec<Joint> = torques
        .filter_map(|(torque, number)| {
            let (link, motor) = (named(Role::Position, number), named(Role::MotorPosition, number));
            Some(Joint {
                torque,
                position: link.or(motor)?,
                motor: link.and(motor),
            })
        })
        // A force and a position may be of anything that has a spring.
        .filter(|joint| joint.motor.is_some() || is_torque(joint.torque) || integration(look, joint))
        .collect();
    if !named.is_empty() {
        return named;
    }
    let moved = |i: &&flexure::look::Integration| {
        let derivative = |k: &flexure::look::Kinship| {
            (k.column, k.of) == (i.input, i.output) && matches!(k.relation, Relation::Derivative { .. })
        };
        let says = |i: usize, wanted: &[Role]| {
            is_neutral(name(i)) || role(name(i)).is_some_and(|(role, _)| wanted.contains(&role))
        };
        // A level integrates a flow too, and is no joint.
        let axis = says(i.input, &[Role::Torque]) && says(i.output, &[Role::Position, Role::MotorPosition]);
        axis && !look.kinships.iter().any(derivative)
    };
    let best = |a: &&flexure::look::Integration, b: &&flexure::look::Integration| {
        a.found.explained.total_cmp(&b.found.explained)
    };
    let found = look.integrations.iter().filter(moved).max_by(best);
    found
        .map(|i| Joint {
            torque: name(i.input),
            position: name(i.output),
            motor: None,
        })
        .into_iter()
        .collect()
}
