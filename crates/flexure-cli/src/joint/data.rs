//! The columns of a joint's log, seen from the link.

use flexure::error::DataError;
use std::str::FromStr;

use anyhow::{Result, bail};
use flexure::identify::robot_joint::Estimated;
use flexure_io::RecordFile;

use super::Arguments;
use super::words::with_error;
use crate::arguments::{TIME, Usage, sample_time};

/// Standard errors by which a negative inertia is no chance.
const CLEARLY: f64 = 3.0;

/// A number, or the name of one in the record.
#[derive(Debug, Clone, PartialEq)]
pub enum Number {
    /// A number.
    Given(f64),
    /// A constant of a MAT file.
    Named(String),
}

/// A number, or the name of a constant.
pub fn number(text: &str) -> Result<Number, String> {
    match f64::from_str(text) {
        Ok(value) if value.is_finite() && value != 0.0 => Ok(Number::Given(value)),
        Ok(_) => Err("expected a finite number other than zero, or the name of a constant of the record".to_owned()),
        Err(_) => Ok(Number::Named(text.to_owned())),
    }
}

impl Number {
    /// Its value, looked up in the record.
    pub fn value(&self, file: &RecordFile, option: &str) -> Result<f64> {
        let name = match self {
            Number::Given(value) => return Ok(*value),
            Number::Named(name) => name,
        };
        match file.constants.iter().find(|(n, _)| n == name) {
            Some((_, value)) if value.is_finite() && *value != 0.0 => Ok(*value),
            Some((_, value)) => bail!(
                "{}: --{option} {name}: the constant is {value}, but a finite number other than zero is needed",
                file.path.display()
            ),
            None => {
                let names: Vec<&str> = file.constants.iter().map(|(n, _)| n.as_str()).collect();
                let there = match names.is_empty() {
                    true => "the record has no constants".to_owned(),
                    false => format!("the constants are: {}", names.join(", ")),
                };
                bail!(
                    "{}: --{option} {name} is neither a number nor a constant of the record; {there}",
                    file.path.display()
                )
            }
        }
    }
}

/// A joint's log.
pub struct Log {
    /// The file's name without its folder.
    pub file: String,
    /// The torque on the link's side, N m.
    pub torque: Vec<f64>,
    /// The position of a rigid axis or the angle of the link.
    pub position: Vec<f64>,
    /// The angle of the motor, on the link's side of the gear; empty for a rigid axis.
    pub motor: Vec<f64>,
    /// Its velocity, if logged.
    pub velocity: Option<Vec<f64>>,
    /// s.
    pub sample_time: f64,
    /// Torque on the link's side a unit of the torque column.
    pub torque_constant: f64,
    /// Whether the record has the torques of both joints of an arm by the names that Flexure gives them.
    pub has_both_torques: bool,
}

impl Log {
    /// The columns that the options name; they must be finite.
    pub fn read(file: &RecordFile, arguments: &Arguments) -> Result<Log> {
        let position = arguments.position.as_ref().or(arguments.link.as_ref());
        let position = position.map_or("", String::as_str);
        let mut used = vec![position, arguments.torque.as_str()];
        used.extend(arguments.velocity.as_deref());
        used.extend(arguments.motor.as_deref());
        let sample_time = needed_sample_time(file, arguments, &used)?;
        let constant = arguments.torque_constant.value(file, "torque-constant")? * arguments.gear_ratio;
        let scaled =
            |name: &str, by: f64| -> Result<Vec<f64>> { Ok(file.finite(name)?.iter().map(|v| v * by).collect()) };
        Ok(Log {
            file: file_name(file),
            torque: scaled(&arguments.torque, constant)?,
            position: scaled(position, 1.0)?,
            motor: match &arguments.motor {
                Some(name) => scaled(name, 1.0 / arguments.gear_ratio)?,
                None => Vec::new(),
            },
            velocity: arguments.velocity.as_deref().map(|v| scaled(v, 1.0)).transpose()?,
            sample_time,
            torque_constant: constant,
            has_both_torques: ["tau1", "tau2"]
                .iter()
                .all(|name| file.record.names().iter().any(|n| n == name)),
        })
    }
}

/// The log of a two-link arm.
pub struct ArmLog {
    /// The file's name without its folder.
    pub file: String,
    /// The torques on the links' side, N m.
    pub torque: [Vec<f64>; 2],
    /// The angles of the links.
    pub link: [Vec<f64>; 2],
    /// The angles of the motors, on the links' side of the gears.
    pub motor: [Vec<f64>; 2],
    /// s.
    pub sample_time: f64,
    /// Torque on the links' side a unit of the torque columns.
    pub torque_constant: f64,
}

impl ArmLog {
    /// The columns that the options name, of motors, links and torques; they must be finite.
    pub fn read(file: &RecordFile, columns: &[[String; 2]; 3], arguments: &Arguments) -> Result<ArmLog> {
        let used: Vec<&str> = columns.iter().flatten().map(String::as_str).collect();
        let sample_time = needed_sample_time(file, arguments, &used)?;
        let constant = arguments.torque_constant.value(file, "torque-constant")? * arguments.gear_ratio;
        let scaled = |names: &[String; 2], by: f64| -> Result<[Vec<f64>; 2]> {
            let column = |name: &str| -> Result<Vec<f64>> { Ok(file.finite(name)?.iter().map(|v| v * by).collect()) };
            Ok([column(&names[0])?, column(&names[1])?])
        };
        Ok(ArmLog {
            file: file_name(file),
            motor: scaled(&columns[0], 1.0 / arguments.gear_ratio)?,
            link: scaled(&columns[1], 1.0)?,
            torque: scaled(&columns[2], constant)?,
            sample_time,
            torque_constant: constant,
        })
    }
}

/// The columns of motors, links and torques of an arm where the options name two of each, separated by a comma.
///
/// A name that is a column's as a whole is that column's.
pub fn pairs(file: &RecordFile, arguments: &Arguments) -> Result<Option<[[String; 2]; 3]>> {
    let names = [
        ("motor", arguments.motor.as_deref().unwrap_or_default()),
        ("link", arguments.link.as_deref().unwrap_or_default()),
        ("torque", arguments.torque.as_str()),
    ];
    let split = names.map(|(_, text)| {
        let whole = file.record.names().iter().any(|n| n == text);
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        match parts[..] {
            [first, second] if !whole && !first.is_empty() && !second.is_empty() => {
                Some([first.to_owned(), second.to_owned()])
            }
            _ => None,
        }
    });
    match split {
        [Some(motor), Some(link), Some(torque)] => Ok(Some([motor, link, torque])),
        [None, None, None] => Ok(None),
        split => {
            let at = |i: usize| split[i].is_none();
            let (name, text) = names[(0..3).find(|&i| at(i)).unwrap_or(0)];
            Err(Usage(format!(
                "--{name} {text}: a two-link arm needs two columns of each kind, as in --motor qm1,qm2 --link q1,q2 --torque tau1,tau2"
            ))
            .into())
        }
    }
}

/// The error with the library's name of a column replaced by what `name` makes of it: the file's.
pub fn renamed(error: flexure::Error, name: impl Fn(String) -> String) -> flexure::Error {
    use flexure::Error;
    match error {
        Error::Data(DataError::Constant { column, value }) => Error::constant(name(column), value),
        Error::Data(DataError::Unit { column, largest }) => Error::Data(DataError::Unit {
            column: name(column),
            largest,
        }),
        Error::Data(DataError::WrappedAngle { column, sample, jump }) => Error::Data(DataError::WrappedAngle {
            column: name(column),
            sample,
            jump,
        }),
        other => other,
    }
}

fn file_name(file: &RecordFile) -> String {
    let name = file.path.file_name();
    name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn needed_sample_time(file: &RecordFile, arguments: &Arguments, used: &[&str]) -> Result<f64> {
    match sample_time(file, arguments.sample_time, used)? {
        Some(step) => Ok(step),
        None => bail!(
            "{}: no column '{TIME}' tells the sample time; give it by --sample-time",
            file.path.display()
        ),
    }
}

/// Refuses inertias that are clearly negative.
pub fn possible<'a>(
    file: &RecordFile,
    inertias: impl IntoIterator<Item = (&'static str, &'a Estimated)>,
) -> Result<()> {
    for (name, inertia) in inertias {
        let (value, error) = (inertia.value, inertia.standard_error);
        if value + CLEARLY * error < 0.0 {
            bail!(
                "{}: the {name} comes out negative ({}), which cannot be: check the torque's sign (--torque-constant -1 turns \
                 it), which columns are the motor's and which the link's, and the gear ratio",
                file.path.display(),
                with_error(value, error)
            );
        }
    }
    Ok(())
}
