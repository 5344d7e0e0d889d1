//! The candidate forms of stiffness and friction: the starts of their searches, and which of them an arm can have.

use super::forms::{FormName, is_possible_friction};
use super::limits::{START_SLOPES, START_STRIBECK_VELOCITIES, START_WINDUP_WIDTHS};
use super::outcome::Fitted;
use super::system::{Curve, CurveKind};
use crate::quantiles::NORMAL_95;

/// A form with the logarithms of the shape parameters at which its searches start.
pub(super) struct FormStart {
    pub form: FormName,
    pub starts: Vec<Vec<f64>>,
}

/// The forms of a curve.
pub(super) fn candidates(curve: &Curve) -> Vec<FormStart> {
    match curve.kind {
        CurveKind::Stiffness => stiffness(curve.largest()),
        CurveKind::Friction => friction(curve.largest()),
    }
}

/// The forms of stiffness, for deflections up to the largest one.
fn stiffness(largest: f64) -> Vec<FormStart> {
    let none = vec![vec![]];
    let windup = START_WINDUP_WIDTHS
        .map(|share| vec![-2.0 * (share * largest).ln()])
        .to_vec();
    [
        (FormName::LinearStiffness, none.clone()),
        (FormName::CubicStiffness, none),
        (FormName::LinearWindup, windup.clone()),
        (FormName::Windup, windup),
    ]
    .map(|(form, starts)| FormStart { form, starts })
    .into()
}

/// The forms of friction, for velocities up to the largest one.
fn friction(fastest: f64) -> Vec<FormStart> {
    let slope = |share: f64| (share / fastest).ln();
    let slopes = || START_SLOPES.iter().copied();
    // Minima of (12) lie far from each other: all pairs g2 > g3, with every g5.
    let pairs = slopes().flat_map(|g2| slopes().filter(move |g3| *g3 < g2).map(move |g3| [g2, g3]));
    let triples = pairs.flat_map(|[g2, g3]| slopes().map(move |g5| [g2, g3, 1.4 * g5]));
    let one: Vec<Vec<f64>> = slopes().map(|s| vec![slope(s)]).collect();
    let velocities = START_STRIBECK_VELOCITIES.map(|share| vec![(share * fastest).ln()]);
    [
        (FormName::CoulombViscous, vec![vec![]]),
        (FormName::Stribeck, velocities.to_vec()),
        (FormName::DirectedViscous, vec![vec![]]),
        (FormName::DirectedStribeck, velocities.to_vec()),
        (FormName::SmoothDry, one.clone()),
        (FormName::SmoothCoulomb, one),
        (
            FormName::SmoothStribeck,
            triples.map(|t| t.map(slope).to_vec()).collect(),
        ),
    ]
    .map(|(form, starts)| FormStart { form, starts })
    .into()
}

/// The form of stiffness for an arm: one that the free curve does not refute, if there is one.
pub(super) fn stiffness_of_an_arm(forms: &[Fitted]) -> Option<&Fitted> {
    let possible = |f: &Fitted| {
        let factor = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
        factor("a2") > 0.0 && factor("a1") >= 0.0 && (0.0..factor("a2")).contains(&factor("ksw"))
    };
    let chosen = best(forms, |f| possible(f) && f.stands())
        .or_else(|| best(forms, possible))
        .or_else(|| forms.first())?;
    // An undetermined cubic term must not make the wind-up look more certain.
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    full.filter(|f| chosen.form == FormName::LinearWindup && possible(f))
        .or(Some(chosen))
}

/// If the form has no cubic term, its wind-up is made no more certain than in the form with that term.
pub(super) fn no_more_certain(fitted: &mut Fitted, forms: &[Fitted]) {
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    let Some(full) = full.filter(|_| fitted.form == FormName::LinearWindup) else {
        return;
    };
    for parameter in &mut fitted.parameters {
        if let Some(beside) = full.parameter(&parameter.symbol) {
            parameter.standard_error = parameter.standard_error.max(beside.standard_error);
            parameter.range = [
                parameter.range[0].min(parameter.value - NORMAL_95 * parameter.standard_error),
                parameter.range[1].max(parameter.value + NORMAL_95 * parameter.standard_error),
            ];
        }
    }
}

/// Whether an arm can have this friction: (12) or a part of it.
pub(super) fn possible_friction(f: &Fitted) -> bool {
    let value = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
    f.form.is_smooth() && is_possible_friction(["g1", "g4", "g6"].map(value), ["g2", "g3"].map(value))
}

/// The form of friction for an arm; a `simple` one has no Stribeck part.
pub(super) fn friction_of_an_arm(forms: &[Fitted], simple: bool) -> Option<&Fitted> {
    best(forms, |f| {
        possible_friction(f) && !(simple && f.form == FormName::SmoothStribeck)
    })
    .or_else(|| forms.iter().find(|f| f.form == FormName::SmoothDry))
}

/// Leaves out a form whose rise of the friction at slow motion (Stribeck) the data do not show, neither its height nor its width, where the
/// form without it stands: it would only fit noise.
pub(super) fn without_unseen_rise(mut forms: Vec<Fitted>) -> Vec<Fitted> {
    let stands = |form: FormName| forms.iter().any(|f| f.form == form && f.stands());
    let [plain, directed] = [FormName::CoulombViscous, FormName::DirectedViscous].map(stands);
    let is_unseen = |f: &Fitted| {
        ["Fs", "vs"]
            .iter()
            .all(|s| f.parameter(s).is_some_and(|p| !p.identifiable))
    };
    forms.retain(|f| match f.form {
        FormName::Stribeck => !(plain && is_unseen(f)),
        FormName::DirectedStribeck => !((plain || directed) && is_unseen(f)),
        _ => true,
    });
    forms
}

fn best(forms: &[Fitted], allowed: impl Fn(&Fitted) -> bool) -> Option<&Fitted> {
    let allowed = forms.iter().filter(|f| allowed(f));
    allowed.min_by(|a, b| a.bic.total_cmp(&b.bic))
}
