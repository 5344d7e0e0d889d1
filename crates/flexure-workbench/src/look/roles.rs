//! The quantities of columns, from their names.

use flexure_io::unit_at_end;

/// What a column's name says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The input of a system: `u`, `input`.
    Input,
    /// Its output: `y`, `output`.
    Output,
    /// A torque or force, or a signal that drives one: `tau`, `force`, `effort`, `current`, `voltage`.
    Torque,
    /// A position: `q`, `angle`, `position`.
    Position,
    /// A motor's position before a flexible joint or a gear: `qm`, `motor_angle`.
    MotorPosition,
    /// A velocity: `dq`, `speed`.
    Velocity,
    /// An acceleration: `ddq`, `acc`.
    Acceleration,
    /// The target of a position controller: `ref`, `setpoint`.
    Reference,
}

/// Names by their meaning, in lower case, without numbers at their ends.
const NAMES: [(Role, &[&str]); 8] = [
    (Role::Input, &["u", "in", "input", "excitation"]),
    (Role::Output, &["y", "out", "output", "response"]),
    (
        Role::Torque,
        &[
            "tau",
            "torque",
            "force",
            "effort",
            "current",
            "voltage",
            "vir",
            "motortorque",
            "motorcurrent",
            "motorvoltage",
            "iq",
            "i",
            "im",
        ],
    ),
    (
        Role::Position,
        &[
            "q",
            "pos",
            "position",
            "angle",
            "theta",
            "phi",
            "linkangle",
            "linkposition",
            "qlink",
            "ql",
            "jointangle",
        ],
    ),
    (
        Role::MotorPosition,
        &["qm", "motorangle", "motorposition", "qmotor", "thetam", "theta_m"],
    ),
    (
        Role::Velocity,
        &[
            "dq",
            "dqm",
            "qd",
            "qp",
            "vel",
            "velocity",
            "speed",
            "omega",
            "linkvelocity",
            "motorvelocity",
        ],
    ),
    (
        Role::Acceleration,
        &["ddq", "ddqm", "qdd", "qpp", "acc", "accel", "acceleration"],
    ),
    (
        Role::Reference,
        &[
            "qg",
            "qref",
            "ref",
            "reference",
            "setpoint",
            "target",
            "desired",
            "command",
        ],
    ),
];

/// Names of a torque for each unit of a torque column among a file's constants.
const TORQUE_CONSTANTS: [&str; 6] = ["gtau", "kt", "ktau", "km", "torqueconstant", "motorconstant"];

/// Names of columns without a meaning.
const NEUTRAL: [&str; 8] = ["", "c", "x", "ch", "col", "column", "channel", "signal"];

/// Units of length and force, of an axis that moves along a line.
const PRISMATIC: [&str; 5] = ["m", "mm", "µm", "N", "kN"];

/// The name in lower case without separators, and the number at its end.
fn split(name: &str) -> (String, &str) {
    let base = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = &name[base.len()..];
    (base.to_lowercase().replace(['_', ' ', '-', '.'], ""), number)
}

/// What a name may say besides, before or after the quantity: that it was measured, or commanded. In lower case.
const MEASURED: [&str; 7] = ["act", "actual", "meas", "measured", "fb", "feedback", "ist"];
const COMMANDED: [&str; 8] = ["ref", "cmd", "command", "set", "soll", "des", "desired", "target"];

/// The meaning of a name, and the number at its end: the number of the joint.
pub fn role(name: &str) -> Option<(Role, &str)> {
    let name = without_unit(name);
    plain_role(name).or_else(|| {
        let (quantity, is_commanded) = unqualified(name)?;
        let (role, number) = plain_role(quantity)?;
        Some(match role {
            Role::Position | Role::MotorPosition | Role::Velocity if is_commanded => (Role::Reference, number),
            _ => (role, number),
        })
    })
}

/// A name without a unit at its end.
fn without_unit(name: &str) -> &str {
    unit_at_end(name).map_or(name, |(base, _)| base)
}

/// The meaning of a name without words for measured and commanded values.
fn plain_role(name: &str) -> Option<(Role, &str)> {
    let (base, number) = split(name);
    let found = NAMES.iter().find(|(_, names)| names.contains(&base.as_str()));
    found.map(|(role, _)| (*role, number))
}

/// The part of a name such as `q_act` that says the quantity, and whether the other part says that it was commanded.
fn unqualified(name: &str) -> Option<(&str, bool)> {
    let separators = ['_', ' ', '-', '.'];
    let (first, rest) = name.split_once(separators)?;
    let (start, last) = name.rsplit_once(separators)?;
    let with = |words: &[&str]| {
        let says = |word: &str| words.contains(&word.to_lowercase().as_str());
        says(last).then_some(start).or(says(first).then_some(rest))
    };
    let measured = with(&MEASURED).map(|quantity| (quantity, false));
    measured.or_else(|| with(&COMMANDED).map(|quantity| (quantity, true)))
}

/// Whether a name says nothing of the quantity: `c0`, `ch1`, `u`.
pub fn is_neutral(name: &str) -> bool {
    match role(name) {
        Some((role, _)) => matches!(role, Role::Input | Role::Output),
        None => NEUTRAL.contains(&split(name).0.as_str()),
    }
}

/// Whether a name says that the column is a torque, and not only a signal that may drive one.
pub fn is_torque(name: &str) -> bool {
    let name = without_unit(name);
    let quantity = unqualified(name).map_or(name, |(quantity, _)| quantity);
    ["tau", "torque", "motortorque"].contains(&split(quantity).0.as_str())
}

/// Whether a constant's name says that it is the torque for each unit of a torque column.
pub fn is_torque_constant(name: &str) -> bool {
    TORQUE_CONSTANTS.contains(&split(name).0.as_str())
}

/// Whether a constant's name is that of a force, in N: the published record of a prismatic axis (EMPS; Janot, Gautier & Brunot 2019) uses
/// this name.
pub fn is_force_constant(name: &str) -> bool {
    split(name).0 == "gtau"
}

/// Whether a unit is one of a length or a force.
pub fn is_prismatic(unit: &str) -> bool {
    PRISMATIC.contains(&unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_they_are() {
        for (name, expected) in [
            ("u", Some((Role::Input, ""))),
            ("tau2", Some((Role::Torque, "2"))),
            ("Motor Angle", Some((Role::MotorPosition, ""))),
            ("qm1", Some((Role::MotorPosition, "1"))),
            ("dq_2", Some((Role::Velocity, "2"))),
            ("y0", Some((Role::Output, "0"))),
            ("q_act", Some((Role::Position, ""))),
            ("q2_ref", Some((Role::Reference, "2"))),
            ("tau_cmd", Some((Role::Torque, ""))),
            ("Actual Position", Some((Role::Position, ""))),
            ("q1_deg", Some((Role::Position, "1"))),
            ("q_ref_deg", Some((Role::Reference, ""))),
            ("tau_Nm", Some((Role::Torque, ""))),
            ("speed_rpm", Some((Role::Velocity, ""))),
            ("act", None),
            ("flow_cmd", None),
            ("temperature", None),
            ("c0", None),
        ] {
            assert_eq!(role(name), expected, "{name}");
        }
        assert!(is_neutral("c0") && is_neutral("u") && !is_neutral("fuel") && !is_neutral("tau"));
        assert!(is_torque("tau_Nm") && !is_torque("force_N"));
        assert!(is_torque_constant("gtau") && is_torque_constant("Torque_constant") && !is_torque_constant("kp"));
    }
}
