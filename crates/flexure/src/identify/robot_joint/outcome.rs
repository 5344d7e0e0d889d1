//! The results: an identified axis, a flexible joint, and their parts.

use serde::Serialize;

use super::finding::Finding;
use super::forms::{FormName, ParametricCurve};
use super::limits::{LARGEST_ERROR, REFUTED};
use crate::bands::Band;
use crate::quantiles::NORMAL_95;

/// Effects of a joint in addition to inertias, a spring without memory and friction at the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// The link's samples are late.
    EncoderSkew,
    /// A damping parallel to the spring.
    Damping,
    /// Friction at the motor.
    MotorFriction,
    /// Gravity, cosine and sine of the link's angle.
    Gravity,
    /// A spring with memory.
    HystereticSpring,
    /// Friction with memory at the link: presliding, as in the models of Dahl and LuGre.
    Presliding,
}

impl Effect {
    /// All of them, the simplest explanation first.
    pub const ALL: [Effect; 6] = [
        Effect::EncoderSkew,
        Effect::Damping,
        Effect::MotorFriction,
        Effect::Gravity,
        Effect::HystereticSpring,
        Effect::Presliding,
    ];

    /// Its name for reading.
    pub fn title(self) -> &'static str {
        match self {
            Effect::EncoderSkew => "an offset of the encoders' clocks",
            Effect::Damping => "damping of the joint",
            Effect::MotorFriction => "friction at the motor",
            Effect::Gravity => "gravity",
            Effect::HystereticSpring => "hysteresis of the spring",
            Effect::Presliding => "friction with memory (presliding)",
        }
    }
}

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its standard error, for any spectrum of the noise; 0 for a given value.
    pub standard_error: f64,
}

/// A named number with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// The symbol, for example "Fc" or "g6".
    pub symbol: String,
    /// The powers of torque and of the abscissa (velocity or deflection) in its unit: `[1, -1]` is N m s/rad for
    /// friction and N m/rad for stiffness.
    pub unit: [i32; 2],
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Whether these data determine it.
    pub identifiable: bool,
    /// The values that the data support: an interval of 95 %; one-sided (NaN for a missing limit) if the value is beyond the data's
    /// resolution.
    pub range: [f64; 2],
    /// Why it is not identifiable; empty if it is.
    pub remark: String,
}

/// How far a form is from the curve that the data show without a form: the test with added splines of a fixed division, and the distance
/// from the free curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LackOfFit {
    /// The F statistic of the part that the splines explain in addition to the form.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub freedom: [f64; 2],
    /// The probability of a larger one if the form were right; below [`REFUTED`](super::REFUTED) the form is refuted.
    pub p_value: f64,
    /// The root mean square of form less curve over the data, as a share of the curve's own.
    pub distance: f64,
}

/// A physical form fitted to a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Which form.
    pub form: FormName,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// The inertia (rigid axis, or link) that goes with them.
    pub inertia: Estimated,
    /// The test against the free curve.
    pub lack_of_fit: LackOfFit,
    /// Schwarz's criterion; the smallest is best.
    pub bic: f64,
    pub(super) curve: ParametricCurve,
}

impl Fitted {
    /// The torque of the form at a velocity or deflection.
    pub fn torque(&self, x: f64) -> f64 {
        self.curve.value(x)
    }

    /// Whether the test does not refute the form.
    pub fn stands(&self) -> bool {
        self.lack_of_fit.p_value >= REFUTED
    }

    /// The parameter of this symbol.
    pub fn parameter(&self, symbol: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.symbol == symbol)
    }
}

/// The doubt if a torque was clipped.
const CLIPPED: &str = "the torque is clipped, and what really acted is not in the record";
/// The doubt if a joint moved in one direction only.
const ONE_WAY: &str = "the joint moves in one direction only, in which Coulomb friction and an offset are alike";

/// The parameters that need both directions.
const DRY_FRICTION: [&str; 9] = ["Fc", "Fs", "vs", "F0", "g1", "g2", "g3", "g4", "g5"];

impl Estimated {
    /// Whether the value is more than chance: positive by two standard errors, as for a parameter that counts as identifiable. Without a
    /// standard error, whether it is positive.
    pub fn is_positive(&self) -> bool {
        let chance = self.standard_error / LARGEST_ERROR;
        self.value > if chance.is_finite() { chance } else { 0.0 }
    }

    /// The part of the 95 % interval that is not negative; `None` if it is empty.
    pub fn positive_range(&self) -> Option<[f64; 2]> {
        let [low, high] = [-1.0, 1.0].map(|side| self.value + side * NORMAL_95 * self.standard_error);
        (high > 0.0).then(|| [low.max(0.0), high])
    }

    /// Adds a systematic error to the standard error, as the root of the sum of squares.
    pub(super) fn or_off_by(self, error: f64) -> Self {
        Estimated {
            standard_error: self.standard_error.hypot(error),
            ..self
        }
    }

    /// Removes the standard error: it does not measure the systematic error here.
    fn unsure(&mut self) {
        self.standard_error = f64::NAN;
    }
}

impl Parameter {
    /// Marks the parameter as not identifiable after all.
    pub(super) fn withdraw(&mut self, remark: &str) {
        self.identifiable = false;
        self.range = [f64::NAN; 2];
        self.remark = remark.to_owned();
    }

    /// Marks the parameter as not identifiable and removes its standard error.
    fn remove_error(&mut self, remark: &str) {
        self.withdraw(remark);
        self.standard_error = f64::NAN;
    }
}

/// The values that the findings make untrustworthy: standard errors cover only chance.
struct Doubt {
    clipped: bool,
    one_way: bool,
}

impl Doubt {
    fn new(findings: &[Finding]) -> Self {
        Doubt {
            clipped: findings.iter().any(|f| matches!(f, Finding::ClippedTorque { .. })),
            one_way: findings.iter().any(|f| matches!(f, Finding::NeverReverses { .. })),
        }
    }

    fn of_inertia(&self, inertia: &mut Estimated) {
        if self.clipped {
            inertia.unsure();
        }
    }

    fn of_form(&self, form: &mut Fitted) {
        self.of_inertia(&mut form.inertia);
        for parameter in &mut form.parameters {
            if self.clipped {
                parameter.remove_error(CLIPPED);
            } else if self.one_way && DRY_FRICTION.contains(&parameter.symbol.as_str()) {
                parameter.remove_error(ONE_WAY);
            }
        }
    }
}

/// A free curve with the physical forms that were fitted to it.
#[derive(Debug, Clone)]
pub struct IdentifiedCurve {
    /// The curve as a torque over the velocities or deflections visited, with its band.
    pub band: Band,
    /// The physical forms, each fitted while all other curves are free; of a stiffness beside frictions in forms, where free frictions leave a
    /// wind-up or refute all its forms, and Schwarz's criterion prefers that.
    pub forms: Vec<Fitted>,
    /// The one with the smallest BIC.
    pub best: usize,
    /// The velocity or deflection at every sample.
    pub x: Vec<f64>,
    /// The torque that all other terms leave at every sample: the data of the curve.
    pub partial: Vec<f64>,
}

impl IdentifiedCurve {
    /// The form with the smallest BIC.
    pub fn best(&self) -> &Fitted {
        &self.forms[self.best]
    }

    /// The form with the fewest parameters of those that are not refuted, then with the smallest BIC; that with the smallest BIC if all are refuted.
    pub(super) fn simplest(&self) -> &Fitted {
        let order = |a: &&Fitted, b: &&Fitted| {
            let by_parameters = a.parameters.len().cmp(&b.parameters.len());
            by_parameters.then(a.bic.total_cmp(&b.bic))
        };
        (self.forms.iter().filter(|form| form.stands()))
            .min_by(order)
            .unwrap_or(self.best())
    }

    /// The forms, smallest BIC first.
    pub fn by_bic(&self) -> Vec<&Fitted> {
        let mut forms: Vec<&Fitted> = self.forms.iter().collect();
        forms.sort_by(|a, b| a.bic.total_cmp(&b.bic));
        forms
    }
}

/// The best form of a rigid axis, refined by the error of its free run under the recorded torque.
#[derive(Debug, Clone)]
pub struct Polished {
    /// The form with refined parameters, which have no standard errors.
    pub form: Fitted,
    /// The root mean square of the free run's error over the whole record: with the equations' parameters, and with these.
    pub error: [f64; 2],
    /// The same over held-back halves; each is simulated with the parameters polished on the other half.
    pub held_back: [f64; 2],
    /// Whether the held-back halves are simulated better by more than chance: the motion is then simulated with these parameters.
    pub is_used: bool,
    /// The symbols of parameters that are farther from the equations' than three of their standard errors; M is the inertia.
    pub differs: Vec<String>,
}

/// A rigid axis: `tau = M q'' + f(q') + ...`.
#[derive(Debug, Clone)]
pub struct RigidAxis {
    /// The inertia (or mass) M from the fit with the free curves.
    pub inertia: Estimated,
    /// The friction f; it contains any offset.
    pub friction: IdentifiedCurve,
    /// Position-dependent terms, if requested.
    pub extras: Vec<Parameter>,
    /// The cut-off of the smoothing of velocities, Hz; `None` if these were given.
    pub cut_off: Option<f64>,
    /// The highest frequency of the equations, Hz.
    pub highest: f64,
    /// The sample time, s.
    pub sample_time: f64,
    /// The torque computed from the free curves, the inertias and the motion.
    pub reconstructed: Vec<f64>,
    /// The parts of the difference between motor and link, if both were logged and an offset of the clocks explains nearly all of it.
    pub stiff: Option<StiffJoint>,
    /// The best form refined by the error of its free run, if the axis can be simulated under its recorded torque.
    pub polished: Option<Polished>,
    /// How the load of a chain fits the log, if the axis is one of its joints.
    pub chain: Option<ChainFit>,
    /// The findings about the log.
    pub findings: Vec<Finding>,
}

/// How the load of a chain fits the log of one of its joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChainFit {
    /// The mean inertia of the chain's links about the joint, kg m^2 (kg).
    pub links: f64,
    /// The inertia that was found beside that of the links: of a rigid axis, its drive's.
    pub beside_links: Estimated,
    /// How many times the load counts if its factor is estimated too: 1 if the chain is right. `None` if the log does not tell.
    pub factor: Option<Estimated>,
}

/// The difference between motor and link of a joint that is stiff: an offset of the clocks times velocity, and a small compliance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StiffJoint {
    /// The time by which the link's samples are late, s.
    pub clock_offset: Estimated,
    /// The deflection by the motor's torque, rad/(N m): the spring's compliance, or less if the motor's inertia takes a part of its torque.
    pub compliance: Estimated,
    /// The share of the difference's mean square, about its mean, that the clocks explain.
    pub share_of_clocks: f64,
}

/// A flexible joint: `tau = Jm qm'' + kappa(d)`, `kappa(d) = M q'' + f(q')`, with further effects ([`Effect`]).
#[derive(Debug, Clone)]
pub struct FlexibleAxis {
    /// The motor's inertia Jm, on the link's side; with a standard error of 0 if it was given.
    pub motor_inertia: Estimated,
    /// The same by the equations of motion alone, if that of the simulated motion of stretches is surer.
    pub by_equations: Option<Estimated>,
    /// The stiffness, as the torque kappa over the deflection.
    pub stiffness: IdentifiedCurve,
    /// The same as k(d) = kappa(d) / d, which shows a soft wind-up as a dip at zero.
    pub secant: Band,
    /// The link as an axis under the elastic torque; `reconstructed` is the motor's torque, and the findings are those of the joint.
    pub link: RigidAxis,
    /// The friction at the motor over its velocity; `None` if the log shows only friction at the link.
    pub motor_friction: Option<IdentifiedCurve>,
    /// The damping of the joint, parallel to its spring, N m s/rad; `None` if the log shows none.
    pub damping: Option<Estimated>,
    /// The effects in addition to inertias, the spring and friction at the link.
    pub effects: Vec<Effect>,
    /// Those effects that explain the log as well as other ones: none of these is a fact.
    pub competing: Vec<Effect>,
    /// The forms that an arm can have, fitted together to both equations.
    pub model: JointModel,
    /// The time by which the link's samples are late, s; it was corrected if the findings say so.
    pub clock_offset: Estimated,
}

/// A flexible joint in the forms that an arm can have.
#[derive(Debug, Clone)]
pub struct JointModel {
    /// The stiffness, (10)-(11) or simpler; `inertia` is the motor's (NaN if it was given).
    pub stiffness: Fitted,
    /// The friction, (12) or without its Stribeck part; `inertia` is the link's.
    pub friction: Fitted,
    /// The friction at the motor, if the log shows any; `inertia` is NaN.
    pub motor_friction: Option<Fitted>,
}

impl RigidAxis {
    /// The result without the standard errors that its findings make untrustworthy.
    pub(super) fn distrusted(mut self) -> Self {
        let doubt = Doubt::new(&self.findings);
        doubt.of_inertia(&mut self.inertia);
        if doubt.clipped {
            self.extras.iter_mut().for_each(|extra| extra.remove_error(CLIPPED));
        }
        self.friction.forms.iter_mut().for_each(|form| doubt.of_form(form));
        self
    }
}

impl FlexibleAxis {
    /// Whether the log shows that both motor and link have an inertia.
    pub(super) fn separates_inertias(&self) -> bool {
        [self.motor_inertia, self.link.inertia]
            .iter()
            .all(Estimated::is_positive)
    }

    /// The result without the standard errors that its findings make untrustworthy.
    pub(super) fn distrusted(mut self) -> Self {
        let doubt = Doubt::new(&self.link.findings);
        doubt.of_inertia(&mut self.motor_inertia);
        let curves = [&mut self.stiffness].into_iter().chain(&mut self.motor_friction);
        let forms = curves.flat_map(|curve| &mut curve.forms);
        let forms = forms.chain([&mut self.model.stiffness, &mut self.model.friction]);
        let forms = forms.chain(&mut self.model.motor_friction);
        forms.for_each(|form| doubt.of_form(form));
        self.link = self.link.distrusted();
        self
    }
}

/// An identified joint of a log of motor, link and torque.
#[derive(Debug, Clone)]
pub enum IdentifiedJoint {
    /// Motor and link do not move relative to each other: the link's axis, with the finding that says so.
    Rigid(Box<RigidAxis>),
    /// A flexible joint.
    Flexible(Box<FlexibleAxis>),
}
