//! An arm file as values, its reading, checking, writing and running.

use std::collections::BTreeMap;

use flexure::Error;
use flexure::error::{self, ParameterError};
use flexure::manipulator::{
    Arm, ArmParameters, Friction, JointKind, JointParameters, Link, Parts, SimulationOptions, State,
};
use flexure::simulation::{Sampling, Tolerances};
use serde::{Deserialize, Serialize};

use super::error::{ArmError, find_line, line_of};
use super::excitation::{DriveKind, Excitation, Kind};
use super::values::{friction, list, plain};

/// A checked arm file.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFile {
    /// The arm.
    pub arm: ArmParameters,
    /// The state at time 0.
    pub initial: State,
    /// Duration, sample time and accuracy.
    pub run: Run,
    /// What drives it.
    pub excitation: Excitation,
    /// Measurement noise, if any.
    pub noise: Option<Noise>,
}

/// The table `[run]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Duration, s; positive.
    pub duration: f64,
    /// Sample time, s; positive, at most the duration.
    pub sample_time: f64,
    /// Relative tolerance of an integration step, 1e-14 to 0.1; default 1e-9.
    #[serde(default = "default_rtol")]
    pub rtol: f64,
    /// Absolute tolerance of an integration step, positive; default 1e-12.
    #[serde(default = "default_atol")]
    pub atol: f64,
    /// The number of integration steps after which the run gives up; default 10 million.
    #[serde(default = "default_steps")]
    pub max_steps: u64,
}

fn default_rtol() -> f64 {
    Tolerances::default().rtol
}

fn default_atol() -> f64 {
    Tolerances::default().atol
}

fn default_steps() -> u64 {
    Tolerances::default().max_steps
}

/// The table `[noise]`: Gaussian measurement noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// The seed; every column has its own random stream. Default 1.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// Standard deviations by column, in the column's unit.
    pub std: BTreeMap<String, f64>,
}

fn default_seed() -> u64 {
    1
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileTable {
    arm: ArmTable,
    #[serde(default)]
    initial: InitialTable,
    run: Run,
    excitation: Excitation,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<Noise>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmTable {
    model: JointKind,
    friction: Option<bool>,
    cubic: Option<bool>,
    windup: Option<bool>,
    coupling: Option<bool>,
    rotor_in_link_inertia: Option<bool>,
    rotors: Option<bool>,
    link: Vec<Link>,
    joint: Vec<JointTable>,
}

/// A joint as a table.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointTable {
    motor_inertia: Option<f64>,
    stiffness: Option<f64>,
    cubic: Option<f64>,
    linear: Option<f64>,
    windup: Option<f64>,
    windup_sharpness: Option<f64>,
    damping: Option<f64>,
    #[serde(default, deserialize_with = "friction")]
    friction: Option<Friction>,
    #[serde(default, deserialize_with = "friction")]
    motor_friction: Option<Friction>,
    #[serde(default)]
    locked: bool,
}

#[derive(Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct InitialTable {
    #[serde(deserialize_with = "list::<_, _, 2>")]
    q: [f64; 2],
    #[serde(deserialize_with = "list::<_, _, 2>")]
    qm: [f64; 2],
    #[serde(deserialize_with = "list::<_, _, 2>")]
    dq: [f64; 2],
    #[serde(deserialize_with = "list::<_, _, 2>")]
    dqm: [f64; 2],
}

/// Names a text and its keys in errors.
pub(super) struct Source<'a> {
    pub text: &'a str,
    pub name: &'a str,
}

impl Source<'_> {
    /// The text as tables.
    pub fn parse<T: serde::de::DeserializeOwned>(&self) -> Result<T, ArmError> {
        toml::from_str(self.text).map_err(|e: toml::de::Error| ArmError::Format {
            file: self.name.to_owned(),
            line: e.span().map(|span| line_of(self.text, span.start)),
            message: plain(e.message()),
        })
    }

    pub fn value(&self, key: impl Into<String>, reason: impl Into<String>) -> ArmError {
        let key = key.into();
        ArmError::Value {
            file: self.name.to_owned(),
            line: find_line(self.text, &key),
            key,
            reason: reason.into(),
        }
    }

    /// Puts a key and a line to an error of the library.
    fn locate(&self, table: &str, error: Error) -> ArmError {
        match &error {
            Error::Arm(error::ArmError::Unphysical {
                part, number, quantity, ..
            }) => {
                let key = quantity.split(' ').next().unwrap_or(quantity);
                self.value(format!("arm.{part}[{number}].{key}"), error.to_string())
            }
            Error::Arm(_) => self.value(table, error.to_string()),
            Error::Parameter(ParameterError::OutOfRange { name, .. }) => {
                let key = name
                    .strip_prefix("the initial ")
                    .map_or(name.as_str(), |n| n.trim_end_matches(['1', '2']));
                self.value(format!("{table}.{key}"), error.to_string())
            }
            _ => ArmError::Simulation(error),
        }
    }
}

impl ArmFile {
    /// Reads and checks the text of an arm file; `source_name` names it in errors.
    ///
    /// # Errors
    /// [`ArmError::Format`] and [`ArmError::Value`], with the file, the line, the key and, for a
    /// value, its unit and range.
    pub fn from_toml_str(text: &str, source_name: &str) -> Result<Self, ArmError> {
        let source = Source {
            text,
            name: source_name,
        };
        let table: FileTable = source.parse()?;
        let arm = arm_parameters(&source, table.arm)?;
        let InitialTable { q, qm, dq, dqm } = table.initial;
        let file = ArmFile {
            arm,
            initial: State { q, qm, dq, dqm },
            run: table.run,
            excitation: table.excitation,
            noise: table.noise,
        };
        file.check(&source)?;
        Ok(file)
    }

    /// The text of an arm file that reads back as this one.
    ///
    /// # Errors
    /// [`ArmError::Format`] if a value cannot be written as TOML (a seed beyond 2^63).
    pub fn to_toml(&self) -> Result<String, ArmError> {
        let defaults = Parts::of(self.arm.model);
        let parts = self.arm.parts;
        let changed = |value: bool, default: bool| (value != default).then_some(value);
        let State { q, qm, dq, dqm } = self.initial;
        let given = |value: f64| (value != 0.0).then_some(value);
        let table = FileTable {
            arm: ArmTable {
                model: self.arm.model,
                friction: changed(parts.friction, defaults.friction),
                cubic: changed(parts.cubic, defaults.cubic),
                windup: changed(parts.windup, defaults.windup),
                coupling: changed(parts.coupling, defaults.coupling),
                rotor_in_link_inertia: changed(parts.rotor_in_link_inertia, defaults.rotor_in_link_inertia),
                rotors: changed(parts.rotors, defaults.rotors),
                link: self.arm.links.to_vec(),
                joint: self
                    .arm
                    .joints
                    .iter()
                    .map(|j| JointTable {
                        motor_inertia: given(j.motor_inertia),
                        stiffness: given(j.stiffness),
                        cubic: given(j.cubic),
                        linear: given(j.linear),
                        windup: given(j.windup),
                        windup_sharpness: given(j.windup_sharpness),
                        damping: given(j.damping),
                        friction: j.friction,
                        motor_friction: j.motor_friction,
                        locked: j.locked,
                    })
                    .collect(),
            },
            initial: InitialTable { q, qm, dq, dqm },
            run: self.run,
            excitation: self.excitation.clone(),
            noise: self.noise.clone(),
        };
        toml::to_string(&table).map_err(|e| ArmError::Format {
            file: "arm".to_owned(),
            line: None,
            message: e.to_string(),
        })
    }

    /// The library's form of `[initial]` and `[run]`.
    pub(super) fn options(&self) -> flexure::Result<SimulationOptions> {
        Ok(SimulationOptions {
            sampling: Sampling::new(self.run.duration, self.run.sample_time)?,
            initial: self.initial,
            tolerances: Tolerances {
                rtol: self.run.rtol,
                atol: self.run.atol,
                max_steps: self.run.max_steps,
            },
        })
    }

    pub(super) fn locked(&self) -> [bool; 2] {
        self.arm.joints.map(|j| j.locked)
    }

    /// Checks everything that can be checked without simulating.
    fn check(&self, source: &Source) -> Result<(), ArmError> {
        let arm = Arm::new(self.arm).map_err(|e| source.locate("arm", e))?;
        let options = self.options().map_err(|e| source.locate("run", e))?;
        options.tolerances.check().map_err(|e| source.locate("run", e))?;
        arm.check_initial(&self.initial)
            .map_err(|e| source.locate("initial", e))?;
        self.excitation
            .check_keys(self.locked())
            .map_err(|(key, reason)| source.value(format!("excitation.{key}"), reason))?;
        if self.excitation.drive == DriveKind::Deflection {
            arm.check_deflection()
                .map_err(|e| source.locate("excitation.drive", e))?;
        }
        for joint in 0..2 {
            // A few samples are enough to show whether the parameters are valid.
            let duration = self.run.sample_time * 8.0;
            let few = Sampling::new(duration.min(self.run.duration), self.run.sample_time);
            let sampling = if self.excitation.kind == Kind::Multisine {
                options.sampling
            } else {
                few.map_err(|e| source.locate("run", e))?
            };
            self.excitation
                .samples(joint, &sampling)
                .map_err(|e| source.locate("excitation", e))?;
        }
        for (column, &std) in self.noise.iter().flat_map(|n| &n.std) {
            let flexible = self.arm.model != JointKind::Rigid;
            let known = flexure::manipulator::record_columns(self.arm.model);
            if column == "t" || !known.contains(&column.as_str()) {
                let what = if flexible { "the arm's" } else { "a rigid arm's" };
                return Err(source.value(
                    format!("noise.std.{column}"),
                    format!("no noise on this column; {what} columns are: {}", known[1..].join(", ")),
                ));
            }
            if !(std >= 0.0 && std.is_finite()) {
                return Err(source.value(
                    format!("noise.std.{column}"),
                    format!("{std}, but a standard deviation must be finite and not negative"),
                ));
            }
        }
        Ok(())
    }
}

impl JointTable {
    /// Refuses a joint at `key` that lacks a value which this model needs.
    pub fn complete(&self, source: &Source, model: JointKind, rotor: bool, key: &str) -> Result<(), ArmError> {
        for (name, needed, value, unit) in [
            ("motor_inertia", rotor, self.motor_inertia, "kg m^2"),
            ("stiffness", model == JointKind::Linear, self.stiffness, "N m/rad"),
            ("linear", model == JointKind::Nonlinear, self.linear, "N m/rad"),
        ] {
            if needed && value.is_none() {
                let reason = format!("missing; this model needs it, positive, in {unit}");
                return Err(source.value(format!("{key}.{name}"), reason));
            }
        }
        Ok(())
    }
}

impl From<&JointTable> for JointParameters {
    fn from(j: &JointTable) -> Self {
        JointParameters {
            motor_inertia: j.motor_inertia.unwrap_or(0.0),
            stiffness: j.stiffness.unwrap_or(0.0),
            cubic: j.cubic.unwrap_or(0.0),
            linear: j.linear.unwrap_or(0.0),
            windup: j.windup.unwrap_or(0.0),
            windup_sharpness: j.windup_sharpness.unwrap_or(0.0),
            damping: j.damping.unwrap_or(0.0),
            friction: j.friction,
            motor_friction: j.motor_friction,
            locked: j.locked,
        }
    }
}

/// Checks which keys are there, and fills in what may be left out.
fn arm_parameters(source: &Source, table: ArmTable) -> Result<ArmParameters, ArmError> {
    let model = table.model;
    let count = |key: &str, n: usize| source.value(key, format!("there are {n}, but an arm has two of [[{key}]]"));
    let links: [Link; 2] = table
        .link
        .try_into()
        .map_err(|v: Vec<Link>| count("arm.link", v.len()))?;
    let joints: [JointTable; 2] = table
        .joint
        .try_into()
        .map_err(|v: Vec<JointTable>| count("arm.joint", v.len()))?;
    let defaults = Parts::of(model);
    let parts = Parts {
        friction: table.friction.unwrap_or(defaults.friction),
        cubic: table.cubic.unwrap_or(defaults.cubic),
        windup: table.windup.unwrap_or(defaults.windup),
        coupling: table.coupling.unwrap_or(defaults.coupling),
        rotor_in_link_inertia: table.rotor_in_link_inertia.unwrap_or(defaults.rotor_in_link_inertia),
        rotors: table.rotors.unwrap_or(defaults.rotors),
    };
    let flexible = model != JointKind::Rigid;
    for (i, joint) in joints.iter().enumerate() {
        let rotors = flexible || parts.rotors || parts.rotor_in_link_inertia;
        joint.complete(source, model, rotors, &format!("arm.joint[{}]", i + 1))?;
    }
    Ok(ArmParameters {
        model,
        links,
        joints: joints.map(|joint| JointParameters::from(&joint)),
        parts,
    })
}
