//! What is found out about a joint.

use serde::Serialize;

use super::forms::{FormName, Shaped, Term};
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
    /// Whether these data tell it.
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
    pub(super) shaped: Shaped,
}

impl Fitted {
    /// The torque of the form at a velocity or deflection.
    pub fn torque(&self, x: f64) -> f64 {
        self.shaped.value(x)
    }

    /// The parameter of this symbol.
    pub fn parameter(&self, symbol: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.symbol == symbol)
    }

    /// The constant that the form adds to the torque.
    pub fn offset(&self) -> f64 {
        let terms = self.shaped.terms.iter().zip(&self.shaped.factors);
        terms.filter(|(t, _)| **t == Term::Constant).map(|(_, c)| c).sum()
    }
}

/// Something to know before trusting the result, in words with a remedy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Finding {
    /// The torque stays at its largest or smallest value.
    ClippedTorque {
        /// Samples at that value.
        samples: usize,
        /// The value.
        value: f64,
    },
    /// The joint moves in one direction only.
    NeverReverses {
        /// The share of the time in the rarer direction.
        share: f64,
    },
    /// The joint reverses only a few times.
    FewReversals {
        /// How often.
        reversals: usize,
    },
    /// The motion reaches up to the frequencies where only noise should be.
    SampledTooSlowly {
        /// The sample time, s.
        step: f64,
        /// The highest frequency of the motion that was found, Hz.
        band: f64,
    },
    /// The joint's mechanical time constant is hardly longer than a sample.
    FastTimeConstant {
        /// The time constant, s.
        time_constant: f64,
        /// The sample time, s.
        step: f64,
    },
    /// Motor and link do not move against each other.
    NoFlexibility {
        /// The root mean square of the deflection that the torque explains; 0 where there is none but by chance.
        deflection: f64,
        /// That of the encoders' noise in a sample of the deflection.
        noise: f64,
        /// The stiffness that a spring with this deflection would have; NaN where there is none.
        stiffness: f64,
    },
    /// The encoders' samples are not of the same instants.
    EncoderSkew {
        /// The time by which the link's samples are late, s.
        skew: f64,
        /// Its standard error, s.
        standard_error: f64,
    },
    /// The motor goes much farther than the link, or less far, or the other way.
    DifferentAngles {
        /// How many times as far.
        ratio: f64,
    },
    /// An angle goes through several turns.
    ManyTurns {
        /// From its smallest to its largest value.
        span: f64,
    },
    /// The torque's samples are late.
    TorqueDelay {
        /// The time from a torque's sample to its effect, s.
        delay: f64,
        /// Whether that is the half sample of a torque held from sample to sample.
        held: bool,
    },
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Finding::ClippedTorque { samples, value } => write!(
                f,
                "the torque stays at its extreme {value} for {samples} samples: it is clipped there, and what really \
                 acted is not in the record; excite less, or widen the torque's range"
            ),
            Finding::NeverReverses { share } => write!(
                f,
                "the joint moves in one direction for {:.1} % of the time: Coulomb friction cannot be told from an \
                 offset; record motions in both directions",
                100.0 * (1.0 - share)
            ),
            Finding::FewReversals { reversals } => write!(
                f,
                "the joint reverses only {reversals} times: the record is too short to tell friction well; record more \
                 motions in both directions"
            ),
            Finding::SampledTooSlowly { step, band } => write!(
                f,
                "the motion still stands out of the noise at {band:.4} Hz, near the limit of {:.4} Hz of a sample time \
                 of {step} s: what happens between the samples is lost; sample faster, or excite more slowly",
                0.5 / step
            ),
            Finding::FastTimeConstant { time_constant, step } => write!(
                f,
                "friction stops the joint within {time_constant:.3} s, less than five samples of {step} s: inertia and \
                 friction cannot be told apart; sample faster"
            ),
            Finding::NoFlexibility {
                deflection,
                noise,
                stiffness,
            } => {
                write!(
                    f,
                    "no flexibility is seen: of the difference between motor and link the torque explains {deflection:.2e} (root mean \
                     square), less than three times the encoders' noise of {noise:.2e}, which tells no stiffness curve"
                )?;
                if stiffness.is_finite() {
                    write!(f, " (a spring would have about {stiffness:.1e} N m/rad)")?;
                }
                write!(f, "; the joint is taken as rigid. Load it more, or measure finer")
            }
            Finding::EncoderSkew { skew, standard_error } => write!(
                f,
                "the link's samples are {:.3} ms (standard error {:.3} ms) {} than the motor's; they have been shifted \
                 accordingly",
                1e3 * skew.abs(),
                1e3 * standard_error,
                if *skew > 0.0 { "later" } else { "earlier" }
            ),
            Finding::DifferentAngles { ratio } => write!(
                f,
                "the motor goes {ratio:.4} times as far as the link: both angles must be in rad, with the same sign, and on the same \
                 side of the gear; divide the motor's by the gear ratio"
            ),
            Finding::ManyTurns { span } => write!(
                f,
                "an angle goes through {span:.1} rad, {:.1} turns: if it is logged in degrees, multiply it by pi / 180 = 0.017453, or all \
                 inertias and stiffnesses come out too small by that",
                span / std::f64::consts::TAU
            ),
            Finding::TorqueDelay { delay, held: true } => write!(
                f,
                "the torque acts {:.3} ms after its sample, as one held from sample to sample does; it has been shifted \
                 accordingly",
                1e3 * delay
            ),
            Finding::TorqueDelay { delay, held: false } => write!(
                f,
                "the torque acts {:.3} ms {} its sample; it has been shifted accordingly",
                1e3 * delay.abs(),
                if *delay > 0.0 { "after" } else { "before" }
            ),
        }
    }
}

/// What was wrong where a torque was clipped.
const CLIPPED: &str = "the torque is clipped, and what really acted is not in the record";
/// What was wrong where a joint moved in one direction.
const ONE_WAY: &str = "the joint moves in one direction only, in which Coulomb friction and an offset are alike";

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

impl Fitted {
    fn distrust(&mut self, symbols: Option<&[&str]>, remark: &str) {
        let named = |p: &&mut Parameter| symbols.is_none_or(|s| s.contains(&p.symbol.as_str()));
        for parameter in self.parameters.iter_mut().filter(named) {
            parameter.identifiable = false;
            parameter.range = [f64::NAN; 2];
            parameter.standard_error = f64::NAN;
            parameter.remark = remark.to_owned();
        }
        if symbols.is_none() {
            self.inertia.unsure();
        }
    }
}

/// Takes the standard errors off what the findings say cannot be trusted: these tell of chance alone.
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
        for extra in extras {
            (extra.identifiable, extra.standard_error) = (false, f64::NAN);
            (extra.range, extra.remark) = ([f64::NAN; 2], CLIPPED.to_owned());
        }
    }
    for form in forms {
        match (clipped, one_way) {
            (true, _) => form.distrust(None, CLIPPED),
            (false, true) => form.distrust(Some(&["Fc", "Fs", "vs", "F0", "g1", "g2", "g3", "g4", "g5"]), ONE_WAY),
            (false, false) => {}
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

/// The torque k(d) d with its band, from k(d).
pub(super) fn torque_band(secant: &Band) -> Band {
    let times = |values: &[f64]| -> Vec<f64> { values.iter().zip(&secant.x[0]).map(|(v, d)| v * d).collect() };
    let (lower, upper) = (times(&secant.lower), times(&secant.upper));
    let pick = |choose: fn(f64, f64) -> f64| lower.iter().zip(&upper).map(|(a, b)| choose(*a, *b)).collect();
    Band {
        estimate: times(&secant.estimate),
        centre: times(&secant.centre),
        standard_error: times(&secant.standard_error).iter().map(|e| e.abs()).collect(),
        lower: pick(f64::min),
        upper: pick(f64::max),
        ..secant.clone()
    }
}
