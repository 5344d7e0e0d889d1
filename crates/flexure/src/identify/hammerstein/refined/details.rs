//! What a reader is shown of the refined estimate: delay, breakpoints, noise and form, each with the reason for its choice.

use super::super::details::{given_or, of_order};
use super::super::options::RefinedHammerstein;
use super::super::realisation::ChosenOrder;
use super::alternation::Minimum;
use super::calibrated::CalibratedBlocks;
use super::form_fit::{MemoryRemoved, PhysicalFormFit};
use super::forms::PhysicalForm;
use super::limits::MOST_LISTED;
use super::piecewise::Breakpoint;
use crate::error::Result;
use crate::identify::result::{Detail, Place, Value, Values};
use crate::text::{number, p_value, with_error};

/// Where the nonlinearity breaks, for reading: "kinks at -1.000, 1.000".
pub(super) fn listed(breakpoints: &[Breakpoint]) -> String {
    let of_kind = |kind: &'static str| {
        let place = |b: &Breakpoint| b.error.map_or_else(|| number(b.at), |error| with_error(b.at, error));
        let at = breakpoints.iter().filter(|b| b.kind == kind).map(place);
        let at: Vec<String> = at.collect();
        match at.len() {
            0 => None,
            1 => Some(format!("{kind} at {}", at[0])),
            n if n <= MOST_LISTED && kind != "knot" => Some(format!("{kind}s at {}", at.join(", "))),
            n => Some(format!("{n} {kind}s")),
        }
    };
    let kinds: Vec<String> = ["jump", "kink", "knot"].into_iter().filter_map(of_kind).collect();
    match kinds.is_empty() {
        true => "no breakpoint".to_owned(),
        false => kinds.join("; "),
    }
}

impl RefinedHammerstein {
    /// What was chosen on the way to the refined estimate, and the form: the one that was asked for, or one that suffices.
    pub(super) fn details(
        &self,
        minimum: &Minimum,
        order: &ChosenOrder,
        blocks: &CalibratedBlocks,
    ) -> Result<Vec<Detail>> {
        let (breakpoints, points) = (&blocks.breakpoints, &blocks.memory_removed);
        let has_jump = breakpoints.iter().any(|b| b.kind == "jump");
        let asked = self.form.map(|form| points.fit_form(form)).transpose()?;
        let sufficient = match &asked {
            Some(fit) if fit.holds() => None,
            _ => points.sufficient_form(has_jump),
        };
        let form = match (asked, sufficient) {
            (Some(asked), other) => form_detail(&asked, true, other.map(|fit| fit.form)),
            (None, Some(fit)) => form_detail(&fit, false, None),
            (None, None) => Detail::new("form", Value::None),
        };
        let text = listed(breakpoints);
        let values: Vec<Values> = (breakpoints.iter())
            .map(|b| Values::new([("at", b.at.into()), ("kind", b.kind.into()), ("error", b.error.into())]))
            .collect();
        let why =
            "jumps, kinks and cubic knots where each lowers the error by more than chance would; a cubic between them";
        let memory_removed = Values::new([
            ("x", points.x.as_slice().into()),
            ("value", points.value.as_slice().into()),
            ("samples", points.samples.as_slice().into()),
            ("deviation", points.deviation.into()),
        ]);
        let mut details = of_order(order, self.order.is_some(), "whitened error");
        details.extend([
            self.delay_detail(minimum.blocks.linear.delay),
            Detail::new("refined", true),
            Detail::new("breakpoints", values).shown(
                Place::Choice,
                "Breakpoints of the nonlinearity",
                text.clone(),
                why,
            ),
            Detail::sentence(
                Place::PageFact,
                "Breakpoints",
                breakpoints.len().to_string(),
                &format!("of the nonlinearity: {text}"),
            ),
            Detail::new("memory_removed", memory_removed).unsaved(),
            noise_detail(minimum),
            form,
        ]);
        Ok(details)
    }

    /// The details of the plain estimate, where it was not refined: those of the order alone, as they are.
    pub(super) fn details_of_plain(&self, plain: Vec<Detail>, delay: usize) -> Result<Vec<Detail>> {
        // Without a refined estimate there is nothing to fit a form to, which is an error.
        self.form
            .map(|form| MemoryRemoved::default().fit_form(form))
            .transpose()?;
        let of_order = |d: &Detail| matches!(d.key, "order_scores" | "hankel_singular_values");
        let mut details: Vec<Detail> = plain.into_iter().filter(of_order).collect();
        let none = |key| Detail::new(key, Value::None);
        details.extend([
            self.delay_detail(delay),
            Detail::new("refined", false),
            Detail::new("breakpoints", Value::List(Vec::new())),
            none("memory_removed"),
            none("noise"),
            none("form"),
        ]);
        Ok(details)
    }

    fn delay_detail(&self, delay: usize) -> Detail {
        let why = "the first lag at which the impulse response is clearly not zero";
        let why = given_or(self.delay.is_some(), why);
        Detail::sentence(Place::Choice, "Delay", delay.to_string(), why)
    }
}

fn noise_detail(minimum: &Minimum) -> Detail {
    let (model, deviation) = (&minimum.whitening, minimum.noise());
    let value = Values::new([("model", model.as_slice().into()), ("deviation", deviation.into())]);
    let why = match model.len() {
        0 | 1 => "taken as white".to_owned(),
        n => format!(
            "whitened by an autoregression of order {}, which has the smallest Schwarz criterion",
            n - 1
        ),
    };
    let text = format!("standard deviation {} in the output's unit", number(deviation));
    Detail::new("noise", value).shown(Place::ChoiceAndText, "Noise", text, &why)
}

/// A standard error, if it is one: neither the 0 of what has none nor the infinity of what the data do not determine.
fn standard_error(error: f64) -> Option<f64> {
    (error > 0.0 && error.is_finite()).then_some(error)
}

/// A dead zone is seen if it is wider than this many standard errors. Convention.
const CLEARLY_WIDE: f64 = 3.0;

/// The form that was fitted to the nonlinearity, and its test: the one that was `asked` for, or one that suffices. If the data refute it,
/// there may be an `other` one that suffices.
fn form_detail(fit: &PhysicalFormFit, asked: bool, other: Option<PhysicalForm>) -> Detail {
    let parameters: Vec<Values> = (fit.parameters.iter())
        .map(|p| {
            Values::new([
                ("name", p.name.clone().into()),
                ("value", p.value.into()),
                ("error", standard_error(p.error).into()),
            ])
        })
        .collect();
    let value = Values::new([
        ("name", fit.form.to_string().into()),
        ("parameters", parameters.into()),
        ("statistic", fit.statistic.into()),
        ("degrees_of_freedom", fit.degrees.into()),
        ("limit", fit.limit.into()),
        ("p_value", fit.p_value.into()),
        ("holds", fit.holds().into()),
        ("asked", asked.into()),
    ]);
    let mut text: Vec<String> = (fit.parameters.iter())
        .map(|p| match standard_error(p.error) {
            Some(error) => format!("{} = {}", p.name, with_error(p.value, error)),
            None if p.error == 0.0 => format!("{} = {}", p.name, number(p.value)),
            None => format!("{} not determined", p.name),
        })
        .collect();
    if let Some(ends) = fit.form.flat_beyond() {
        let p: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
        let seen = ends.into_iter().zip(["below", "above"]);
        let seen = seen.filter(|(i, _)| fit.parameters[*i].error.is_finite());
        let flat = seen.map(|(i, side)| {
            let value = number(fit.form.value(&p, p[i]));
            format!("at {value} {side} {}", fit.parameters[i].name)
        });
        let flat: Vec<String> = flat.collect();
        if !flat.is_empty() {
            text.push(format!("flat {}, where the input has no effect", flat.join(" and ")));
        }
    }
    let mut why = format!(
        "{}; the values after ± are standard errors, with the linear part held at its estimate",
        form_verdict(fit)
    );
    if let Some([low, high]) = fit.form.dead_zone().map(|places| places.map(|i| &fit.parameters[i])) {
        let (width, error) = (high.value - low.value, low.error.hypot(high.error));
        if error.is_finite() && width <= CLEARLY_WIDE * error {
            let [low, high] = [&low.name, &high.name];
            why += &format!("; the data do not show that the dead zone from {low} to {high} has a width");
        }
    }
    if let Some(other) = other {
        why += &format!("; they do not refute the form {other}");
    }
    let title = format!("Form {}", fit.form);
    Detail::new("form", value).shown(Place::ChoiceAndText, &title, text.join(", "), &why)
}

/// The test of a form for reading.
fn form_verdict(fit: &PhysicalFormFit) -> String {
    let verdict = match fit.holds() {
        true => "the data do not refute this form",
        false => "the data refute this form at 1 %",
    };
    let p = p_value(fit.p_value);
    format!(
        "{verdict} (lack of fit {:.1}, limit {:.1}, {} degrees of freedom, {p})",
        fit.statistic, fit.limit, fit.degrees
    )
}
