//! The controllers of a scenario: the tables `[[controller]]`.

use flexure::control::shaping::Shaper;
use flexure::text::exact;
use serde::Deserialize;

use super::super::error::ArmError;
use super::super::file::Source;
use super::super::values::of_joints;
use super::Body;

/// The most characters of a name: rows of a table begin with it.
const LONGEST_NAME: usize = 60;

/// The kinds of controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerKind {
    /// PD at the motors.
    Pd,
    /// PD with the feedforward of the model.
    PdFeedforward,
    /// Feedback linearisation.
    InverseDynamics,
    /// Linear-quadratic.
    Lqg,
    /// Simple adaptive control.
    DirectAdaptive,
    /// Slotine and Li's composite law.
    CompositeAdaptive,
    /// Fuzzy, Mamdani.
    Mamdani,
    /// Fuzzy, Takagi-Sugeno.
    TakagiSugeno,
    /// Model-reference adaptive, of a flexible link.
    ModelReference,
}

impl ControllerKind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            ControllerKind::Pd => "pd",
            ControllerKind::PdFeedforward => "pd-feedforward",
            ControllerKind::InverseDynamics => "inverse-dynamics",
            ControllerKind::Lqg => "lqg",
            ControllerKind::DirectAdaptive => "direct-adaptive",
            ControllerKind::CompositeAdaptive => "composite-adaptive",
            ControllerKind::Mamdani => "mamdani",
            ControllerKind::TakagiSugeno => "takagi-sugeno",
            ControllerKind::ModelReference => "model-reference",
        }
    }

    /// Whether it can control this body.
    fn controls(self, body: &Body) -> bool {
        match body {
            Body::Arm { .. } => self != ControllerKind::ModelReference,
            Body::Link { .. } => matches!(self, ControllerKind::Pd | ControllerKind::ModelReference),
        }
    }

    /// Whether it is a servo with gains `kp` and `kd`.
    pub fn is_servo(self) -> bool {
        matches!(self, ControllerKind::Pd | ControllerKind::PdFeedforward)
    }
}

/// The estimators of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorKind {
    /// The true state.
    #[default]
    Exact,
    /// Filtered differences of all encoders.
    Differences,
    /// Filtered differences of the motors' encoders alone.
    MotorDifferences,
    /// The extended Kalman filter, from the motors' encoders.
    Ekf,
    /// The unscented one.
    Ukf,
    /// The extended one with fuzzy adaptation of its noise.
    FuzzyEkf,
}

impl EstimatorKind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            EstimatorKind::Exact => "exact",
            EstimatorKind::Differences => "differences",
            EstimatorKind::MotorDifferences => "motor-differences",
            EstimatorKind::Ekf => "ekf",
            EstimatorKind::Ukf => "ukf",
            EstimatorKind::FuzzyEkf => "fuzzy-ekf",
        }
    }

    /// Whether it is a filter with the model of an arm.
    fn is_filter(self) -> bool {
        matches!(self, EstimatorKind::Ekf | EstimatorKind::Ukf | EstimatorKind::FuzzyEkf)
    }

    /// Whether it is a filter of differences, with a cut-off.
    pub fn is_difference(self) -> bool {
        matches!(self, EstimatorKind::Differences | EstimatorKind::MotorDifferences)
    }
}

/// The table `[[controller]]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerTable {
    /// The kind.
    pub kind: ControllerKind,
    /// Its name in results; left out: kind, shaper and estimator.
    #[serde(default)]
    pub name: String,
    /// `kp` of a servo, N m/rad.
    #[serde(default, deserialize_with = "of_joints")]
    pub kp: Option<[f64; 2]>,
    /// `kd` of a servo, N m s/rad.
    #[serde(default, deserialize_with = "of_joints")]
    pub kd: Option<[f64; 2]>,
    /// The rate of inverse dynamics, 1/s; default 8.
    pub rate: Option<f64>,
    /// Whether a model-reference law adapts; default true.
    pub adaptation: Option<bool>,
    /// The input shaper.
    #[serde(default, deserialize_with = "shaper")]
    pub shaper: Option<Shaper>,
    /// The estimator of the state.
    #[serde(default)]
    pub estimator: EstimatorKind,
    /// The cut-off of differences, Hz; default 10.
    pub cut_off: Option<f64>,
    /// The standard deviation of the torques' noise that a filter assumes, N m; default that of the loop.
    pub torque_noise: Option<f64>,
}

fn shaper<'de, D: serde::Deserializer<'de>>(text: D) -> Result<Option<Shaper>, D::Error> {
    let name = String::deserialize(text)?;
    let found = Shaper::ALL.into_iter().find(|shaper| shaper.name() == name);
    let names = Shaper::ALL.map(Shaper::name).join(", ");
    found
        .map(Some)
        .ok_or_else(|| serde::de::Error::custom(format!("no shaper '{name}'; the shapers are: {names}")))
}

/// Checks the keys of a controller, and gives it a unique name.
pub(super) fn complete(
    source: &Source,
    body: &Body,
    controllers: &mut [ControllerTable],
    i: usize,
) -> Result<(), ArmError> {
    let (before, rest) = controllers.split_at_mut(i);
    let Some(table) = rest.first_mut() else {
        return Ok(());
    };
    if table.name.is_empty() {
        table.name = table.usual_name();
    }
    let others = before.iter().map(|other| other.name.as_str());
    let problem = table
        .problem_with_body(body)
        .or_else(|| table.problem_with_gains())
        .or_else(|| table.problem_with_numbers())
        .or_else(|| unusable_name(&table.name, others).map(|reason| ("name", reason)));
    match problem {
        Some((key, reason)) => Err(source.value(format!("controller[{}].{key}", i + 1), reason)),
        None => Ok(()),
    }
}

/// A wrong key, and why it is wrong.
type Problem = (&'static str, String);

impl ControllerTable {
    /// Kind, shaper and estimator.
    fn usual_name(&self) -> String {
        let shaper = self.shaper.map(Shaper::name);
        let estimator = (self.estimator != EstimatorKind::Exact).then(|| self.estimator.name());
        let parts = [Some(self.kind.name()), shaper, estimator];
        parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
    }

    /// The error for a key that the kind does not have.
    fn no_such_key(&self) -> String {
        format!("the kind \"{}\" has no such key; leave it out", self.kind.name())
    }

    /// The problem of a controller or an estimator that cannot work on this body.
    fn problem_with_body(&self, body: &Body) -> Option<Problem> {
        let (these, own) = match body {
            Body::Arm { .. } => ("two-link arms", "all kinds but \"model-reference\""),
            Body::Link { .. } => ("flexible links", "\"pd\" and \"model-reference\""),
        };
        if !self.kind.controls(body) {
            let reason = format!("\"{}\" does not control {these}; {own} do", self.kind.name());
            return Some(("kind", reason));
        }
        let is_link = matches!(body, Body::Link { .. });
        if is_link && self.estimator.is_filter() {
            let reason = "the filters have the model of an arm; a flexible link has \"exact\", \"differences\" and \"motor-differences\"";
            return Some(("estimator", reason.to_owned()));
        }
        if is_link && self.shaper.is_some() {
            return Some(("shaper", "shapers have the modes of an arm; leave it out".to_owned()));
        }
        if self.shaper.is_some() && !self.kind.is_servo() {
            let reason = "shapers are for servos, whose modes are known: pd and pd-feedforward";
            return Some(("shaper", reason.to_owned()));
        }
        let adapts = self.kind == ControllerKind::ModelReference;
        (self.adaptation.is_some() && !adapts).then(|| ("adaptation", self.no_such_key()))
    }

    /// Gains that are missing, needless or negative.
    fn problem_with_gains(&self) -> Option<Problem> {
        [("kp", "N m/rad", self.kp), ("kd", "N m s/rad", self.kd)]
            .into_iter()
            .find_map(|(key, unit, gains)| match gains {
                Some(_) if !self.kind.is_servo() => Some((key, self.no_such_key())),
                None if self.kind.is_servo() => {
                    Some((key, format!("missing; a servo needs it for both joints, in {unit}")))
                }
                Some(gains) if !gains.iter().all(|g| *g >= 0.0 && g.is_finite()) => {
                    let gains = gains.map(exact).join(", ");
                    Some((
                        key,
                        format!("[{gains}], but must be not negative and finite (in {unit})"),
                    ))
                }
                _ => None,
            })
    }

    /// Numbers of the kind and of the estimator that are needless or not positive.
    fn problem_with_numbers(&self) -> Option<Problem> {
        let of_estimator = || {
            format!(
                "the estimator \"{}\" has no such key; leave it out",
                self.estimator.name()
            )
        };
        let has_rate = self.kind == ControllerKind::InverseDynamics;
        [
            ("rate", "1/s", self.rate, has_rate),
            ("cut_off", "Hz", self.cut_off, self.estimator.is_difference()),
            ("torque_noise", "N m", self.torque_noise, self.estimator.is_filter()),
        ]
        .into_iter()
        .find_map(|(key, unit, value, is_known)| match value {
            Some(_) if !is_known => Some((
                key,
                if key == "rate" {
                    self.no_such_key()
                } else {
                    of_estimator()
                },
            )),
            Some(value) if !(value > 0.0 && value.is_finite()) => Some((
                key,
                format!("{}, but must be positive and finite (in {unit})", exact(value)),
            )),
            _ => None,
        })
    }
}

/// Why a controller cannot have this name in addition to the others; `None` if it can.
pub fn unusable_name<'a>(name: &str, mut others: impl Iterator<Item = &'a str>) -> Option<String> {
    if name.chars().count() > LONGEST_NAME || name.chars().any(char::is_control) {
        return Some(format!("a name has at most {LONGEST_NAME} characters, all in one line"));
    }
    others
        .any(|other| other == name)
        .then(|| format!("'{name}' is the name of another controller; give each its own"))
}
