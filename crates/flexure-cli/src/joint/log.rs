//! The columns of a joint's log, seen from the link.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::str::FromStr;

use anyhow::{Result, bail};
use flexure::text::{exact, shown_path};
use flexure_io::RecordFile;
use flexure_workbench::joints::{AxisLog, LaterLog, Log, in_unit};
use flexure_workbench::look::is_current;
use flexure_workbench::preparation::{Conversion, conversion};

use super::Arguments;
use super::axes::AXIS;
use super::counts::note_of_counts;
use crate::applied::with_missing;
use crate::arguments::Usage;
use crate::output::{print_note, quoted, this_command};
use crate::reading::with_resampling;

/// A number, or the name of one in the record.
#[derive(Debug, Clone, PartialEq)]
pub enum Number {
    /// A number.
    Given(f64),
    /// A constant of a MAT file.
    Named(String),
}

/// Allowed sizes of conversion factors.
const FACTORS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// A number, or the name of a constant.
pub fn number(text: &str) -> Result<Number, String> {
    match f64::from_str(text) {
        Ok(value) if FACTORS.contains(&value.abs()) => Ok(Number::Given(value)),
        Ok(_) => {
            Err("expected a number from 1e-30 to 1e30 in size, or the name of a constant of the record".to_owned())
        }
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
            Some((_, value)) if FACTORS.contains(&value.abs()) => Ok(*value),
            Some((_, value)) => bail!(
                "{}: --{option} {name}: the constant is {value:e}, but a number from 1e-30 to 1e30 in size is needed",
                shown_path(&file.path)
            ),
            None => {
                let names: Vec<&str> = file.constants.iter().map(|(n, _)| n.as_str()).collect();
                let there = match names.is_empty() {
                    true => "the record has no constants".to_owned(),
                    false => format!("the constants are: {}", names.join(", ")),
                };
                bail!(
                    "{}: --{option} {name} is neither a number nor a constant of the record; {there}",
                    shown_path(&file.path)
                )
            }
        }
    }
}

/// What a column of a joint's log is.
#[derive(Debug, Clone, Copy)]
pub enum Quantity {
    /// An angle or a position.
    Angle,
    /// A velocity.
    Rate,
    /// A torque or a force.
    Effort,
}

impl Quantity {
    /// The unit in which the library wants it.
    pub fn unit(self, prismatic: bool) -> &'static str {
        match (self, prismatic) {
            (Quantity::Angle, false) => "rad",
            (Quantity::Angle, true) => "m",
            (Quantity::Rate, false) => "rad/s",
            (Quantity::Rate, true) => "m/s",
            (Quantity::Effort, false) => "Nm",
            (Quantity::Effort, true) => "N",
        }
    }
}

/// The names of columns that the options give.
#[derive(Debug, Clone)]
pub struct Names {
    pub torque: String,
    pub position: Option<String>,
    pub motor: Option<String>,
    pub link: Option<String>,
    pub velocity: Option<String>,
    pub reference: Option<String>,
    /// Whether the position is the motor's, before the gear.
    pub at_motor: bool,
    /// Whether the axis moves along a line.
    pub prismatic: bool,
}

/// The columns of a joint, or of both joints of an arm, each kind in the order of the joints.
pub struct Columns {
    torque: Vec<String>,
    /// The positions of a rigid axis, or the angles of links.
    position: Vec<String>,
    motor: Vec<String>,
    velocity: Option<String>,
    at_motor: bool,
    prismatic: bool,
}

impl Columns {
    /// The columns that the options name. If they name two of each kind, separated by a comma, the columns are those of an arm.
    ///
    /// If the whole text is the name of a column, it means that column.
    ///
    /// # Errors
    /// Wrong usage for two columns of one kind and one of another.
    pub fn new(file: &RecordFile, given: &Names) -> Result<Columns, Usage> {
        let link = given.position.as_deref().or(given.link.as_deref());
        let names = [
            ("motor", given.motor.as_deref().unwrap_or_default()),
            ("link", link.unwrap_or_default()),
            ("torque", &given.torque),
        ];
        let split = names.map(|(_, text)| pair(file, text));
        let paired = |i: usize| split[i].is_some() && !(names[i].0 == "link" && given.position.is_some());
        let [motor, position, torque] = match [0, 1, 2].map(paired) {
            [true, true, true] => split.map(Option::unwrap_or_default),
            [false, false, false] => names.map(|(_, text)| vec![text.to_owned()]),
            paired => {
                let (name, text) = match given.at_motor {
                    // The position is the motor's: the links are what is not there.
                    true => ("motor", link.unwrap_or_default()),
                    false => names[paired.iter().position(|p| !p).unwrap_or(0)],
                };
                return Err(Usage(format!(
                    "--{name} {text}: a two-link arm needs two columns of each kind, as in --motor qm1,qm2 --link q1,q2 --torque tau1,tau2"
                )));
            }
        };
        let columns = Columns {
            torque,
            position,
            motor: if given.motor.is_some() { motor } else { Vec::new() },
            velocity: given.velocity.clone(),
            at_motor: given.at_motor,
            prismatic: given.prismatic,
        };
        columns.check_distinct(given.reference.as_ref())?;
        Ok(columns)
    }

    /// Refuses a column that is named twice; the reference's column counts too.
    fn check_distinct(&self, reference: Option<&String>) -> Result<(), Usage> {
        let equal = self
            .motor
            .iter()
            .zip(&self.position)
            .find(|(motor, link)| motor == link);
        if let Some((name, _)) = equal {
            return Err(Usage(format!(
                "--motor and --link are both '{name}': there is no deflection to see; use --position {name} for a rigid axis"
            )));
        }
        let all = self
            .torque
            .iter()
            .chain(&self.position)
            .chain(&self.motor)
            .chain(&self.velocity)
            .chain(reference);
        let mut named = HashSet::new();
        match all.into_iter().find(|name| !named.insert(name.as_str())) {
            Some(name) => Err(Usage(format!("column '{name}' is named twice; name every column once"))),
            None => Ok(()),
        }
    }

    /// The number of joints.
    pub fn joints(&self) -> usize {
        self.torque.len()
    }

    /// Whether the record has the torques of both joints of an arm by the names that Flexure gives them, and these columns are those of the
    /// joint, 0 or 1, or of both.
    pub fn are_torques_of(&self, file: &RecordFile, joint: usize) -> bool {
        let both = ["tau1", "tau2"];
        let has = |name: &&str| file.record.names().iter().any(|n| n == name);
        both.iter().all(has)
            && match self.torque.as_slice() {
                [one] => one == both[joint],
                torques => torques == both,
            }
    }

    /// The columns, which must be finite, on the link's side of the gear.
    ///
    /// # Errors
    /// Names the file and the column; for a sample time that is not known.
    pub fn log(&self, file: &RecordFile, arguments: &Arguments) -> Result<Log> {
        let used = self.torque.iter().chain(&self.position).chain(&self.motor);
        let used: Vec<&str> = used.chain(&self.velocity).map(String::as_str).collect();
        let sample_time = arguments.sample_time_of(file, &used)?;
        let constant = arguments.torque_on_link(file)?;
        // The gains of a position loop are those of the units in the file.
        let converts = arguments.reference.is_none();
        let scaled = |name: &String, unit: &str, by: f64| -> Result<Vec<f64>> {
            let read = match converts {
                true => in_unit(file, name, unit),
                false => file.finite(name).map(|samples| (samples.to_vec(), None)),
            };
            let (samples, own) = read.map_err(|error| with_missing(error.into(), "", false))?;
            if let Some(own) = own {
                print_note(&format!(
                    "note: {}: '{name}' is converted from {own} to {unit}",
                    file.name()
                ));
            }
            Ok(samples.iter().map(|v| v * by).collect())
        };
        self.check_units(file)?;
        self.note_of_units(file, arguments)?;
        self.note_of_gear(file, arguments);
        note_of_counts(file, self.position.iter().chain(&self.motor), sample_time);
        let [angle, rate, effort] =
            [Quantity::Angle, Quantity::Rate, Quantity::Effort].map(|quantity| quantity.unit(self.prismatic));
        let before_gear = 1.0 / arguments.gear_ratio;
        let position_by = if self.at_motor { before_gear } else { 1.0 };
        let mut axes = Vec::new();
        for i in 0..self.joints() {
            let motor = self.motor.get(i);
            axes.push(AxisLog {
                torque: scaled(&self.torque[i], effort, constant)?,
                position: scaled(&self.position[i], angle, position_by)?,
                motor: motor.map(|name| scaled(name, angle, before_gear)).transpose()?,
                velocity: (self.velocity.as_ref())
                    .map(|name| scaled(name, rate, position_by))
                    .transpose()?,
                load: None,
            });
        }
        Ok(Log {
            name: file.name(),
            sample_time,
            axes,
            columns: self.names(),
        })
    }

    /// Says of a rigid axis with a gear that its position is taken as the one behind the gear.
    fn note_of_gear(&self, file: &RecordFile, arguments: &Arguments) {
        let is_later = arguments.validate.as_ref() == Some(&file.path);
        if arguments.gear_ratio == 1.0 || self.at_motor || !self.motor.is_empty() || is_later {
            return;
        }
        let remedy = match arguments.reference {
            Some(_) => "",
            None => "; if it is the motor's, write --motor in place of --position",
        };
        for position in &self.position {
            print_note(&format!(
                "note: {}: '{position}' is taken as the angle behind the gear and is not divided by {}{remedy}",
                file.name(),
                exact(arguments.gear_ratio)
            ));
        }
    }

    /// Refuses a length as an angle, and an angle as a position along a line.
    fn check_units(&self, file: &RecordFile) -> Result<()> {
        // The motor of an axis that moves along a line may turn.
        let positions = self.position.iter().filter(|_| !(self.at_motor && self.prismatic));
        for position in positions.chain(self.motor.iter().filter(|_| !self.prismatic)) {
            let Some(unit) = file.unit(file.meant(position)) else {
                continue;
            };
            let is_in = |wanted: &str| conversion(unit, wanted).is_ok();
            let remedy = match self.prismatic {
                false if is_in("m") => "a length: add --prismatic if the axis moves along a line",
                true if is_in("rad") => "an angle: leave out --prismatic if the axis turns",
                _ => continue,
            };
            let right = Quantity::Angle.unit(self.prismatic);
            let option = quoted(&format!("{position}={right}:{right}"));
            bail!(
                "{}: '{position}' is in {unit}, {remedy}; if the unit is wrong, give the right one, as in --convert {option}",
                shown_path(&file.path)
            );
        }
        Ok(())
    }

    /// Says of currents and voltages that they are taken as torques.
    fn note_of_units(&self, file: &RecordFile, arguments: &Arguments) -> Result<()> {
        if arguments.torque_constant.value(file, "torque-constant")? != 1.0 {
            return Ok(());
        }
        let effort = if self.prismatic { "N" } else { "N m" };
        for torque in &self.torque {
            let unit = file.unit(file.meant(torque));
            let (seen, unit) = match unit {
                Some(unit @ ("A" | "mA" | "V")) => (format!("in {unit}"), unit),
                None if is_current(file.meant(torque), None) => ("a current by its name".to_owned(), "A"),
                _ => continue,
            };
            print_note(&format!(
                "note: {}: '{torque}' is {seen}, and 1 {unit} is taken as 1 {effort}: --torque-constant gives the {effort} for each {unit}; \
                 without it, multiply inertia, friction and stiffness by that number",
                file.name()
            ));
        }
        Ok(())
    }

    /// The names of the columns in the file by those of the library.
    fn names(&self) -> BTreeMap<String, String> {
        let position = if self.motor.is_empty() { "position" } else { "link" };
        let kinds = [
            ("torque", &self.torque),
            (position, &self.position),
            ("motor", &self.motor),
        ];
        let numbered = |kind: &str, i: usize| match self.joints() {
            1 => kind.to_owned(),
            _ => format!("{kind} {}", i + 1),
        };
        let each = kinds.into_iter().flat_map(|(kind, columns)| {
            let columns = columns.iter().enumerate();
            columns.map(move |(i, column)| (numbered(kind, i), column.clone()))
        });
        let velocity = self
            .velocity
            .iter()
            .map(|column| ("velocity".to_owned(), column.clone()));
        each.chain(velocity).collect()
    }
}

impl Arguments {
    /// The columns of these names as another log of the joint.
    pub(super) fn later<'a>(&self, file: Option<&'a RecordFile>, names: &Names) -> Result<Option<LaterLog<'a>>> {
        let Some(file) = file else { return Ok(None) };
        Ok(Some(LaterLog {
            log: Columns::new(file, names)?.log(file, self)?,
            file,
            position_loop: self.position_loop(file, names)?,
        }))
    }

    /// The file of another log of the joint.
    pub(super) fn later_file(&self) -> Result<Option<RecordFile>> {
        self.validate.as_deref().map(|path| self.read(path)).transpose()
    }

    /// The log at `path`, with the steps done to the columns in use.
    pub(super) fn read(&self, path: &Path) -> Result<RecordFile> {
        let file = self.source.reading.read(path)?;
        if !self.source.prepares() && self.convert.is_empty() {
            return Ok(file);
        }
        let given = [self.position(), self.motor.as_deref(), self.link.as_deref()];
        let others = [self.velocity.as_deref(), self.reference.as_deref()];
        let given: Vec<&str> = given
            .into_iter()
            .chain(others)
            .flatten()
            .chain([self.torque()])
            .collect();
        let names = file.record.names().to_vec();
        let used = |name: &&str| given.iter().any(|given| means(given, &file, name));
        let columns: Vec<&str> = names.iter().map(String::as_str).filter(used).collect();
        let units = self.convert.iter().map(|convert| Conversion {
            column: file.meant(&convert.column).to_owned(),
            ..convert.clone()
        });
        let units: Vec<Conversion> = units.collect();
        self.source.converted(file, &columns, &units)
    }

    /// The sample time of these columns of a file, s.
    pub(super) fn sample_time_of(&self, file: &RecordFile, columns: &[&str]) -> Result<f64> {
        let path = shown_path(&file.path);
        let resampled = |step: &str| format!("{} --resample {step}", this_command());
        let sample_time = self.source.reading.sample_time(file, self.sample_time, columns);
        match sample_time.map_err(|error| with_resampling(error, resampled))? {
            Some(sample_time) => Ok(sample_time),
            None => bail!(
                "{path}: no column of sample instants, such as 't', says the sample time; give it by --sample-time, or name the column by --time{}",
                file.sample_time_hint()
            ),
        }
    }
}

/// Whether a text that names one column, two, or those of several axes means this column of a file.
fn means(given: &str, file: &RecordFile, name: &str) -> bool {
    let is_of_axis = |(before, after): (&str, &str)| {
        let long_enough = name.len() > before.len() + after.len();
        long_enough && name.starts_with(before) && name.ends_with(after)
    };
    file.meant(given) == name
        || given.split_once(AXIS).is_some_and(is_of_axis)
        || pair(file, given).is_some_and(|both| both.iter().any(|one| file.meant(one) == name))
}

/// The two columns that a text names.
fn pair(file: &RecordFile, text: &str) -> Option<Vec<String>> {
    let whole = file.record.names().iter().any(|n| n == text);
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    match parts[..] {
        [first, second] if !whole && !first.is_empty() && !second.is_empty() => {
            Some(vec![first.to_owned(), second.to_owned()])
        }
        _ => None,
    }
}
