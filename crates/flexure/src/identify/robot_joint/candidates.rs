//! The candidate forms of stiffness and friction: where their searches start, and which of them an arm can have.

use super::form_fit::LARGEST_STRIBECK;
use super::forms::FormName;
use super::outcome::Fitted;
use super::parameters::NORMAL;
use super::system::{Curve, CurveKind};

/// Slopes of tanh that minima are looked for at, in units of one over the largest velocity.
const SLOPES: [f64; 4] = [5.0, 20.0, 60.0, 180.0];
/// Widths of a wind-up that minima are looked for at, as shares of the largest deflection.
const WINDUP_WIDTHS: [f64; 4] = [0.02, 0.06, 0.2, 0.5];
/// Stribeck velocities that minima are looked for at, as shares of the largest velocity.
const STRIBECK_VELOCITIES: [f64; 3] = [0.005, 0.03, 0.2];

/// A form with the logarithms of the shape parameters at which its searches start.
pub(super) struct Candidate {
    pub form: FormName,
    pub starts: Vec<Vec<f64>>,
}

/// The forms of a curve.
pub(super) fn candidates(curve: &Curve) -> Vec<Candidate> {
    match curve.kind {
        CurveKind::Stiffness => stiffness(curve.largest()),
        CurveKind::Friction => friction(curve.largest()),
    }
}

/// The forms of stiffness, for deflections up to the largest one.
fn stiffness(largest: f64) -> Vec<Candidate> {
    let none = vec![vec![]];
    let windup = WINDUP_WIDTHS.map(|share| vec![-2.0 * (share * largest).ln()]).to_vec();
    [
        (FormName::LinearStiffness, none.clone()),
        (FormName::CubicStiffness, none),
        (FormName::LinearWindup, windup.clone()),
        (FormName::Windup, windup),
    ]
    .map(|(form, starts)| Candidate { form, starts })
    .into()
}

/// The forms of friction, for velocities up to the largest one.
fn friction(fastest: f64) -> Vec<Candidate> {
    let slope = |share: f64| (share / fastest).ln();
    let slopes = || SLOPES.iter().copied();
    // Minima of (12) lie far from each other: g2 > g3, beside every g5.
    let pairs = slopes().flat_map(|g2| slopes().filter(move |g3| *g3 < g2).map(move |g3| [g2, g3]));
    let triples = pairs.flat_map(|[g2, g3]| slopes().map(move |g5| [g2, g3, 1.4 * g5]));
    let one: Vec<Vec<f64>> = slopes().map(|s| vec![slope(s)]).collect();
    let velocities = STRIBECK_VELOCITIES.map(|share| vec![(share * fastest).ln()]);
    [
        (FormName::CoulombViscous, vec![vec![]]),
        (FormName::Stribeck, velocities.to_vec()),
        (FormName::SmoothDry, one.clone()),
        (FormName::SmoothCoulomb, one),
        (
            FormName::SmoothStribeck,
            triples.map(|t| t.map(slope).to_vec()).collect(),
        ),
    ]
    .map(|(form, starts)| Candidate { form, starts })
    .into()
}

/// A form is refuted where its lack of fit is less probable than this: less than is usual, as errors that come in bursts, where friction is
/// steep, still make small probabilities too frequent on short logs (on ten simulated logs of 20 s three of the 20 tests gave the true
/// friction less than 0.01, none less than 1e-4).
pub const REFUTED: f64 = 1e-4;

/// The form of stiffness that an arm can have, one that the free curve does not refute if there is one.
pub(super) fn stiffness_of_an_arm(forms: &[Fitted]) -> Option<&Fitted> {
    let possible = |f: &Fitted| {
        let factor = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
        factor("a2") > 0.0 && factor("a1") >= 0.0 && (0.0..factor("a2")).contains(&factor("ksw"))
    };
    let chosen = best(forms, |f| possible(f) && f.lack_of_fit.p_value > REFUTED)
        .or_else(|| best(forms, possible))
        .or_else(|| forms.first())?;
    // A cubic term that the data do not determine is no reason to be more certain of a wind-up.
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    full.filter(|f| chosen.form == FormName::LinearWindup && possible(f))
        .or(Some(chosen))
}

/// Where the cubic term had to be left out, the wind-up is no more certain than beside it.
pub(super) fn no_more_certain(fitted: &mut Fitted, forms: &[Fitted]) {
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    let Some(full) = full.filter(|_| fitted.form == FormName::LinearWindup) else {
        return;
    };
    for parameter in &mut fitted.parameters {
        if let Some(beside) = full.parameter(&parameter.symbol) {
            parameter.standard_error = parameter.standard_error.max(beside.standard_error);
            parameter.range = [
                parameter.range[0].min(parameter.value - NORMAL * parameter.standard_error),
                parameter.range[1].max(parameter.value + NORMAL * parameter.standard_error),
            ];
        }
    }
}

/// Whether an arm can have this friction: (12) or a part of it, with a Stribeck part that is not the difference of two
/// large and nearly equal terms.
pub(super) fn possible_friction(f: &Fitted) -> bool {
    let value = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
    f.form.is_smooth()
        && ["g1", "g4", "g6"].iter().all(|g| value(g) >= 0.0)
        && value("g1") <= LARGEST_STRIBECK * value("g4")
        && value("g2") >= value("g3")
}

/// The form of friction that an arm can have, a `simple` one without a Stribeck part.
pub(super) fn friction_of_an_arm(forms: &[Fitted], simple: bool) -> Option<&Fitted> {
    best(forms, |f| {
        possible_friction(f) && !(simple && f.form == FormName::SmoothStribeck)
    })
    .or_else(|| forms.iter().find(|f| f.form == FormName::SmoothDry))
}

fn best(forms: &[Fitted], allowed: impl Fn(&Fitted) -> bool) -> Option<&Fitted> {
    let allowed = forms.iter().filter(|f| allowed(f));
    allowed.min_by(|a, b| a.bic.total_cmp(&b.bic))
}
