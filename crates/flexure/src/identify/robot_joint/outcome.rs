//! What is found out about a joint.

use serde::Serialize;

use super::finding::Finding;
use super::forms::{FormName, ParametricCurve, Term};
use crate::bands::Band;

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its standard error, whatever the noise's spectrum; 0 for a value that was given.
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
    /// The values that the data support: an interval of 95 %, one-sided (NaN where there is no limit) beyond the data's resolution.
    pub range: [f64; 2],
    /// Why it is not identifiable; empty if it is.
    pub remark: String,
}

/// How far a form is from the curve that the data show without any: the test of splines of a fixed division beside the form, and the
/// distance from the free curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LackOfFit {
    /// The F statistic of what the splines explain beside the form.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub freedom: [f64; 2],
    /// The probability of a larger one if the form were right; below [`REFUTED`](super::REFUTED) the form is refuted.
    pub p_value: f64,
    /// The root mean square of form less curve over the data, as a share of the curve's own.
    pub distance: f64,
}

/// A physical form fitted to a curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    #[serde(skip)]
    pub(super) curve: ParametricCurve,
}

impl Fitted {
    /// The torque of the form at a velocity or deflection.
    pub fn torque(&self, x: f64) -> f64 {
        self.curve.value(x)
    }

    /// The parameter of this symbol.
    pub fn parameter(&self, symbol: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.symbol == symbol)
    }

    /// The constant that the form adds to the torque.
    pub fn offset(&self) -> f64 {
        let terms = self.curve.terms.iter().zip(&self.curve.factors);
        terms.filter(|(t, _)| **t == Term::Constant).map(|(_, c)| c).sum()
    }
}

/// What was wrong where a torque was clipped.
const CLIPPED: &str = "the torque is clipped, and what really acted is not in the record";
/// What was wrong where a joint moved in one direction.
const ONE_WAY: &str = "the joint moves in one direction only, in which Coulomb friction and an offset are alike";

/// The parameters that need both directions.
const DRY_FRICTION: [&str; 9] = ["Fc", "Fs", "vs", "F0", "g1", "g2", "g3", "g4", "g5"];

impl Estimated {
    /// With an error that is not chance's beside the one that is.
    pub(super) fn or_off_by(self, error: f64) -> Self {
        Estimated {
            standard_error: self.standard_error.hypot(error),
            ..self
        }
    }

    /// Without a standard error: chance is not what is wrong with it.
    fn unsure(&mut self) {
        self.standard_error = f64::NAN;
    }
}

impl Parameter {
    /// The parameter is not identifiable after all.
    pub(super) fn withdraw(&mut self, remark: &str) {
        self.identifiable = false;
        self.range = [f64::NAN; 2];
        self.remark = remark.to_owned();
    }

    /// Nor has it a standard error.
    fn distrust(&mut self, remark: &str) {
        self.withdraw(remark);
        self.standard_error = f64::NAN;
    }
}

/// Removes the standard errors of everything that the findings make untrustworthy: these are about chance alone.
fn distrusted<'a>(
    findings: &[Finding],
    inertias: impl IntoIterator<Item = &'a mut Estimated>,
    extras: &mut [Parameter],
    forms: impl IntoIterator<Item = &'a mut Fitted>,
) {
    let clipped = findings.iter().any(|f| matches!(f, Finding::ClippedTorque { .. }));
    let one_way = findings.iter().any(|f| matches!(f, Finding::NeverReverses { .. }));
    if clipped {
        inertias.into_iter().for_each(Estimated::unsure);
        extras.iter_mut().for_each(|extra| extra.distrust(CLIPPED));
    }
    for form in forms {
        if clipped {
            form.parameters.iter_mut().for_each(|p| p.distrust(CLIPPED));
            form.inertia.unsure();
        } else if one_way {
            let dry = form
                .parameters
                .iter_mut()
                .filter(|p| DRY_FRICTION.contains(&p.symbol.as_str()));
            dry.for_each(|p| p.distrust(ONE_WAY));
        }
    }
}

/// A rigid axis: `tau = M q'' + f(q') + ...`.
#[derive(Debug, Clone, Serialize)]
pub struct RigidAxis {
    /// The inertia (or mass) M beside the free friction curve.
    pub inertia: Estimated,
    /// The free friction curve f over the velocities visited, with its band; it contains any offset.
    pub friction: Band,
    /// Position-dependent terms, where they were asked for.
    pub extras: Vec<Parameter>,
    /// The physical forms, as they were fitted.
    pub forms: Vec<Fitted>,
    /// The one with the smallest BIC.
    pub best: usize,
    /// The cut-off of the smoothing of velocities, Hz; `None` if these were given.
    pub cut_off: Option<f64>,
    /// The highest frequency of the equations, Hz.
    pub highest: f64,
    /// The sample time, s.
    pub sample_time: f64,
    /// The velocity at every sample.
    #[serde(skip)]
    pub velocity: Vec<f64>,
    /// The torque less inertia and position-dependent terms at every sample: the data of the friction curve.
    #[serde(skip)]
    pub partial: Vec<f64>,
    /// The torque that the free curve, inertia and motion make.
    #[serde(skip)]
    pub reconstructed: Vec<f64>,
    /// What to know before trusting it.
    pub findings: Vec<Finding>,
}

/// A flexible joint: `tau = Jm qm'' + kappa(d)`, `kappa(d) = M q'' + f(q')`.
#[derive(Debug, Clone, Serialize)]
pub struct FlexibleAxis {
    /// The motor's inertia Jm, on the link's side; with a standard error of 0 if it was given.
    pub motor_inertia: Estimated,
    /// The link's inertia M.
    pub link_inertia: Estimated,
    /// The free stiffness curve as the torque kappa over the deflection, with its band.
    pub stiffness: Band,
    /// The same as k(d) = kappa(d) / d, which shows a soft wind-up as a dip at zero.
    pub secant: Band,
    /// The free friction curve over the link's velocities, with its band.
    pub friction: Band,
    /// The physical forms of the stiffness, each fitted by itself to the motor's equation.
    pub stiffness_forms: Vec<Fitted>,
    /// The one of them with the smallest BIC.
    pub best_stiffness: usize,
    /// The physical forms of the friction, each fitted by itself to the link's equation.
    pub friction_forms: Vec<Fitted>,
    /// The one of them with the smallest BIC.
    pub best_friction: usize,
    /// The forms that an arm can have, fitted together to both equations.
    pub model: JointModel,
    /// The time by which the link's samples are late, s; corrected where the findings say so.
    pub skew: Estimated,
    /// The cut-off of the smoothing of the link's velocity, Hz.
    pub cut_off: f64,
    /// The highest frequency of the equations, Hz.
    pub highest: f64,
    /// The sample time, s.
    pub sample_time: f64,
    /// The deflection at every sample.
    #[serde(skip)]
    pub deflection: Vec<f64>,
    /// The link's velocity at every sample.
    #[serde(skip)]
    pub velocity: Vec<f64>,
    /// The torque less the motor's inertial one at every sample: the data of the stiffness curve.
    #[serde(skip)]
    pub partial_stiffness: Vec<f64>,
    /// The elastic torque less the link's inertial one at every sample: the data of the friction curve.
    #[serde(skip)]
    pub partial_friction: Vec<f64>,
    /// The torque that the free stiffness curve, the motor's inertia and the motion make.
    #[serde(skip)]
    pub reconstructed: Vec<f64>,
    /// What to know before trusting it.
    pub findings: Vec<Finding>,
}

/// A flexible joint in the forms that an arm can have.
#[derive(Debug, Clone, Serialize)]
pub struct JointModel {
    /// The stiffness, (10)-(11) or simpler; `inertia` is the motor's (NaN if it was given).
    pub stiffness: Fitted,
    /// The friction, (12) or without its Stribeck part; `inertia` is the link's.
    pub friction: Fitted,
}

impl RigidAxis {
    /// With the standard errors that its findings leave it.
    pub(super) fn distrusted(mut self) -> Self {
        distrusted(&self.findings, [&mut self.inertia], &mut self.extras, &mut self.forms);
        self
    }
}

impl FlexibleAxis {
    /// With the standard errors that its findings leave it.
    pub(super) fn distrusted(mut self) -> Self {
        let forms = self.stiffness_forms.iter_mut().chain(&mut self.friction_forms);
        let forms = forms.chain([&mut self.model.stiffness, &mut self.model.friction]);
        distrusted(
            &self.findings,
            [&mut self.motor_inertia, &mut self.link_inertia],
            &mut [],
            forms,
        );
        self
    }
}

/// What a log of motor, link and torque turned out to be.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "joint", rename_all = "snake_case")]
pub enum JointFound {
    /// Motor and link do not move against each other: the link's axis, with the finding that says so.
    Rigid(Box<RigidAxis>),
    /// A flexible joint.
    Flexible(Box<FlexibleAxis>),
}
