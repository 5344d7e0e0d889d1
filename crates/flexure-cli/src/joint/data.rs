//! The columns of a joint's log, seen from the link.

use std::str::FromStr;

use anyhow::{Result, bail};
use flexure_io::RecordFile;

use super::Arguments;
use crate::arguments::{TIME, sample_time};

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
        let Some(sample_time) = sample_time(file, arguments.sample_time, &used)? else {
            bail!(
                "{}: no column '{TIME}' tells the sample time; give it by --sample-time",
                file.path.display()
            );
        };
        let constant = arguments.torque_constant.value(file, "torque-constant")? * arguments.gear_ratio;
        let scaled =
            |name: &str, by: f64| -> Result<Vec<f64>> { Ok(file.finite(name)?.iter().map(|v| v * by).collect()) };
        Ok(Log {
            file: file
                .path
                .file_name()
                .map(|n| n.to_string_lossy().into_owned())
                .unwrap_or_default(),
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
