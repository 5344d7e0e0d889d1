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

/// Names of torques, in lower case.
const TORQUES: [&str; 9] = [
    "tau",
    "torque",
    "trq",
    "torq",
    "motortorque",
    "motortau",
    "taumotor",
    "motortrq",
    "drehmoment",
];

/// Names of forces, and of signals that drive a torque.
const DRIVING: [&str; 6] = ["force", "effort", "voltage", "vir", "motorvoltage", "kraft"];

/// Names of currents, which drive a torque too.
const CURRENTS: [&str; 10] = [
    "current",
    "motorcurrent",
    "currentmotor",
    "strom",
    "motorstrom",
    "amps",
    "iq",
    "i",
    "im",
    "imotor",
];

/// Names by their meaning, in lower case, without numbers at their ends.
const NAMES: [(Role, &[&str]); 10] = [
    (Role::Input, &["u", "in", "input", "excitation"]),
    (Role::Output, &["y", "out", "output", "response"]),
    (Role::Torque, &TORQUES),
    (Role::Torque, &DRIVING),
    (Role::Torque, &CURRENTS),
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
            "linkpos",
            "poslink",
            "anglelink",
            "thetalink",
            "thetal",
            "winkel",
            "lage",
            "enc",
            "encoder",
            "enccounts",
            "encodercounts",
        ],
    ),
    (
        Role::MotorPosition,
        &[
            "qm",
            "motorangle",
            "motorposition",
            "motorpos",
            "motorcount",
            "motorcounts",
            "motorenc",
            "motorencoder",
            "encmotor",
            "encodermotor",
            "qmotor",
            "posmotor",
            "anglemotor",
            "thetamotor",
            "thetam",
        ],
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
            "linkspeed",
            "motorspeed",
            "drehzahl",
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

/// What a name may say besides: where the quantity is, that it was measured, or commanded. In lower case.
const PLACES: [&str; 4] = ["axis", "joint", "drive", "servo"];
const MEASURED: [&str; 7] = ["act", "actual", "meas", "measured", "fb", "feedback", "ist"];
const COMMANDED: [&str; 8] = ["ref", "cmd", "command", "set", "soll", "des", "desired", "target"];

/// Words for what a controller aims at, in lower case. A command may be a plant's input.
const SETPOINTS: [&str; 8] = ["sp", "set", "soll", "sollwert", "ref", "reference", "target", "desired"];

/// The meaning of a name, and the number in it: the number of the joint.
pub fn role(name: &str) -> Option<(Role, &str)> {
    let Quantity {
        name,
        number,
        is_commanded,
    } = Quantity::of(without_unit(name));
    let (role, _) = NAMES.iter().find(|(_, names)| names.contains(&name.as_str()))?;
    let is_target = is_commanded && matches!(role, Role::Position | Role::MotorPosition | Role::Velocity);
    Some((if is_target { Role::Reference } else { *role }, number))
}

/// Units of angles and of what drives a joint.
const ANGLES: [&str; 4] = ["rad", "mrad", "deg", "°"];
const DRIVES: [&str; 4] = ["N m", "Nm", "mNm", "A"];

/// The meaning of a name; if it says nothing, what the unit and the words around the quantity say: `motor_rad` is a motor's angle,
/// `Istwert_Grad` in deg a position, `Sollwert` in deg its target, `Strom_A` drives it.
pub fn role_with_unit<'a>(name: &'a str, unit: Option<&str>) -> Option<(Role, &'a str)> {
    let by_unit = || {
        let words: Vec<String> = words_of(without_unit(name))
            .into_iter()
            .map(str::to_lowercase)
            .collect();
        let has = |of: &[&str]| words.iter().any(|word| of.contains(&word.as_str()));
        let role = match unit? {
            unit if DRIVES.contains(&unit) => Role::Torque,
            unit if !ANGLES.contains(&unit) => return None,
            _ if has(&COMMANDED) || is_setpoint(name) => Role::Reference,
            _ if has(&["motor"]) => Role::MotorPosition,
            _ => Role::Position,
        };
        Some((role, Quantity::of(without_unit(name)).number))
    };
    role(name).or_else(by_unit)
}

/// Whether the units are those of an angle and of what drives a joint.
pub fn are_of_a_joint(position: Option<&str>, torque: Option<&str>) -> bool {
    position.is_some_and(|unit| ANGLES.contains(&unit)) && torque.is_some_and(|unit| DRIVES.contains(&unit))
}

/// A name without a unit at its end.
fn without_unit(name: &str) -> &str {
    unit_at_end(name).map_or(name, |(base, _)| base)
}

/// What a name says: `ActTorque2` or `Axis 2 torque (measured)` is a torque of joint 2.
struct Quantity<'a> {
    /// Its words in lower case, joined, without those of [`PLACES`], [`MEASURED`] and [`COMMANDED`].
    name: String,
    /// The number in it; empty if there is none.
    number: &'a str,
    is_commanded: bool,
}

impl<'a> Quantity<'a> {
    fn of(name: &'a str) -> Self {
        let (mut words, mut number) = (Vec::new(), "");
        for word in words_of(name) {
            match word.starts_with(|c: char| c.is_ascii_digit()) {
                true => number = word,
                false => words.push(word.to_lowercase()),
            }
        }
        let whole = words.concat();
        let is_known = NAMES.iter().any(|(_, names)| names.contains(&whole.as_str()));
        let beside = |word: &String| {
            [&PLACES[..], &MEASURED, &COMMANDED]
                .iter()
                .any(|w| w.contains(&word.as_str()))
        };
        Quantity {
            is_commanded: !is_known && words.iter().any(|word| COMMANDED.contains(&word.as_str())),
            name: match is_known {
                true => whole,
                false => words.iter().filter(|word| !beside(word)).map(String::as_str).collect(),
            },
            number,
        }
    }
}

/// The words and numbers of a name: `ActPos2` has `Act`, `Pos` and `2`.
fn words_of(name: &str) -> Vec<&str> {
    let mut words = Vec::new();
    for part in name.split(|c: char| !c.is_alphanumeric()) {
        let (mut start, mut last) = (0, None);
        for (i, c) in part.char_indices() {
            let begins =
                |last: char| last.is_lowercase() && c.is_uppercase() || last.is_ascii_digit() != c.is_ascii_digit();
            if last.is_some_and(begins) {
                words.push(&part[start..i]);
                start = i;
            }
            last = Some(c);
        }
        words.extend((start < part.len()).then(|| &part[start..]));
    }
    words
}

/// Whether a name says nothing of the quantity: `c0`, `ch1`, `u`.
pub fn is_neutral(name: &str) -> bool {
    match role(name) {
        Some((role, _)) => matches!(role, Role::Input | Role::Output),
        None => NEUTRAL.contains(&split(without_unit(name)).0.as_str()),
    }
}

/// Whether a name says that the column is a torque, and not only a signal that may drive one.
pub fn is_torque(name: &str) -> bool {
    TORQUES.contains(&Quantity::of(without_unit(name)).name.as_str())
}

/// Whether a column is a current: by its unit, or without one by its name.
pub fn is_current(name: &str, unit: Option<&str>) -> bool {
    match unit {
        Some(unit) => ["A", "mA"].contains(&unit),
        None => CURRENTS.contains(&Quantity::of(name).name.as_str()),
    }
}

/// Whether a name says that a controller aims at the column: `LIC_SP`, `Sollwert`.
pub fn is_setpoint(name: &str) -> bool {
    let words: Vec<String> = words_of(without_unit(name))
        .into_iter()
        .map(str::to_lowercase)
        .collect();
    words.iter().any(|word| SETPOINTS.contains(&word.as_str())) || words.concat().contains("setpoint")
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
            ("motor_counts", Some((Role::MotorPosition, ""))),
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
            ("ActTorque", Some((Role::Torque, ""))),
            ("SetPos", Some((Role::Reference, ""))),
            ("Axis 2 ActPos", Some((Role::Position, "2"))),
            ("motor1_angle", Some((Role::MotorPosition, "1"))),
            ("motor_pos", Some((Role::MotorPosition, ""))),
            ("q_link", Some((Role::Position, ""))),
            ("set_point", Some((Role::Reference, ""))),
            ("q_des", Some((Role::Reference, ""))),
            ("act", None),
            ("fuel_pos_flag", None),
            ("flow_cmd", None),
            ("temperature", None),
            ("c0", None),
        ] {
            assert_eq!(role(name), expected, "{name}");
        }
        assert!(is_neutral("x_mm") && role("Iq_A") == Some((Role::Torque, "")));
        assert!(is_neutral("c0") && is_neutral("u") && !is_neutral("fuel") && !is_neutral("tau"));
        assert!(
            is_setpoint("LIC_SP")
                && is_setpoint("TempSetPoint [°C]")
                && !is_setpoint("spindle")
                && !is_setpoint("flow_cmd")
        );
        assert!(is_torque("tau_Nm") && is_torque("motor_trq") && !is_torque("force_N"));
        for (name, unit, expected) in [
            ("motor_rad", Some("rad"), Some((Role::MotorPosition, ""))),
            ("load_rad", Some("rad"), Some((Role::Position, ""))),
            ("Istwert_Grad", Some("deg"), Some((Role::Position, ""))),
            ("Sollwert_Grad", Some("deg"), Some((Role::Reference, ""))),
            ("tau_Nm", Some("rad"), Some((Role::Torque, ""))),
            ("Strom_A", Some("A"), Some((Role::Torque, ""))),
            ("load_kg", Some("kg"), None),
            ("load", None, None),
        ] {
            assert_eq!(role_with_unit(name, unit), expected, "{name}");
        }
        for (name, unit, expected) in [
            ("I_q", None, true),
            ("Motor Current 2", None, true),
            ("i_act", None, true),
            ("Antrieb", Some("mA"), true),
            ("iq", Some("Nm"), false),
            ("effort", None, false),
        ] {
            assert_eq!(is_current(name, unit), expected, "{name}");
        }
        assert!(is_torque_constant("gtau") && is_torque_constant("Torque_constant") && !is_torque_constant("kp"));
    }
}
