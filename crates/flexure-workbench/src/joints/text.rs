//! Parts of a joint as text and as JSON.

use flexure::Record;
use flexure::identify::robot_joint::{Estimated, Finding, Fitted, Parameter, REFUTED, TwoLinkArm};
use flexure::text::{digits, joined, p_value, percent};
use serde_json::{Value, json};

use super::simulation::Fit;
use crate::lines::{Lines, unbroken};
use crate::text::{capitalised, number};

/// The units of a joint's quantities.
pub struct Units {
    /// The unit of positions: rad or m.
    pub position: &'static str,
    /// The unit of torques: N m or N.
    pub torque: &'static str,
    /// What acts on the joint: a torque or a force.
    pub effort: &'static str,
    prismatic: bool,
}

impl Units {
    /// The units of a prismatic or a revolute joint.
    pub fn of(prismatic: bool) -> Units {
        let [position, torque, effort] = match prismatic {
            true => ["m", "N", "force"],
            false => ["rad", "N m", "torque"],
        };
        Units {
            position,
            torque,
            effort,
            prismatic,
        }
    }

    /// What the joint moves: an inertia or a mass.
    pub fn moved(&self) -> &'static str {
        if self.prismatic { "mass" } else { "inertia" }
    }

    /// The unit of inertias.
    pub fn inertia(&self) -> &'static str {
        if self.prismatic { "kg" } else { "kg m^2" }
    }

    /// The units of the columns of a curve's record, by their quantities.
    pub fn of_columns(&self, record: &Record) -> Vec<Option<String>> {
        let unit = |name: &String| match name.as_str() {
            "velocity" => format!("{}/s", self.position),
            "deflection" => self.position.to_owned(),
            "stiffness" | "stiffness_lower" | "stiffness_upper" => format!("{}/{}", self.torque, self.position),
            _ => self.torque.to_owned(),
        };
        record.names().iter().map(|name| Some(unit(name))).collect()
    }

    /// The unit of a parameter of stiffness or friction, from the powers of torque and of deflection or velocity.
    pub fn of_curve(&self, [torque, x]: [i32; 2], stiffness: bool) -> String {
        let (per_second, second) = if stiffness { ("", "") } else { ("/s", "s") };
        let torque = if torque == 0 { "" } else { self.torque };
        let above = match (torque, second) {
            ("", "") => "1".to_owned(),
            ("", only) | (only, "") => only.to_owned(),
            (torque, second) => format!("{torque} {second}"),
        };
        match x {
            0 => torque.to_owned(),
            1 => format!("{}{per_second}", self.position),
            -1 => format!("{above}/{}", self.position),
            x => format!("{above}/{}^{}", self.position, -x),
        }
    }
}

/// A value with its standard error, to the same decimal place.
pub fn with_error(estimated: Estimated) -> String {
    let Estimated { value, standard_error } = estimated;
    match standard_error.is_finite() {
        true => flexure::text::with_error(value, standard_error),
        false => format!("{} (no standard error: see the notes)", number(value)),
    }
}

/// An inertia for reading: no number is given if it is not clearly positive.
pub fn inertia_text(inertia: Estimated, units: &Units) -> String {
    let unit = units.inertia();
    if inertia.is_positive() || !inertia.standard_error.is_finite() {
        return format!("{} {unit}", with_error(inertia));
    }
    match inertia.positive_range() {
        Some([_, high]) => format!("not identifiable: the data support 0 to {} {unit}", number(high)),
        None => "not identifiable: the best fit is negative".to_owned(),
    }
}

/// An inertia as JSON: at least zero, with the range that the data support if they do not distinguish it from zero.
pub fn inertia_json(inertia: Estimated) -> Value {
    json!({
        "value": if inertia.value < 0.0 { 0.0 } else { inertia.value },
        "standard_error": inertia.standard_error,
        "identifiable": inertia.is_positive(),
        "range": inertia.positive_range(),
    })
}

/// The estimate of a parameter.
pub fn estimate(parameter: &Parameter) -> Estimated {
    Estimated {
        value: parameter.value,
        standard_error: parameter.standard_error,
    }
}

/// A parameter for reading, its symbol first.
pub fn parameter_text(parameter: &Parameter, unit: &str) -> String {
    format!("{} {}", parameter.symbol, parameter_value(parameter, unit))
}

/// The value of a parameter for reading, or what is known about it.
fn parameter_value(parameter: &Parameter, unit: &str) -> String {
    match parameter.identifiable {
        true => format!("{} {unit}", with_error(estimate(parameter))),
        false => not_identifiable(parameter) + &possible_values(parameter, unit),
    }
}

fn not_identifiable(parameter: &Parameter) -> String {
    format!("not identifiable: {}", parameter.remark)
}

/// The values that a parameter may have, as a further part of a sentence; empty if it may have any.
fn possible_values(parameter: &Parameter, unit: &str) -> String {
    let [low, high] = parameter.range;
    let symbol = &parameter.symbol;
    let rough = |v: f64| match v == 0.0 || (1e-3..1e5).contains(&v.abs()) {
        true => digits(v, 3),
        false => format!("{v:.1e}"),
    };
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("; {symbol} may be {} to {} {unit}", rough(low), rough(high)),
        (true, false) => format!("; {symbol} may be any value above {} {unit}", number(low)),
        (false, true) => format!("; {symbol} may be any value below {} {unit}", number(high)),
        (false, false) if parameter.standard_error.is_finite() => String::new(),
        (false, false) => format!("; the best fit has {symbol} = {} {unit}", number(parameter.value)),
    }
}

/// The title of a form, with a capital letter at the start.
pub fn titled(form: &Fitted) -> String {
    capitalised(form.form.title())
}

/// The formula of a form, with the offset that a smooth form of friction may have.
pub fn formula(form: &Fitted) -> String {
    let (formula, offset) = (form.form.formula(), "F0");
    match form.parameters.iter().any(|p| p.symbol == offset) && !formula.contains(offset) {
        true => format!("{formula} + {offset}"),
        false => formula.to_owned(),
    }
}

/// The best form for reading: its distance from the free curve, then its formula and an item for each parameter.
pub fn write_form(form: &Fitted, units: &Units, lines: &mut Lines) {
    lines.sentence(format!("{}, smallest BIC: {}", titled(form), lack_text(form)));
    lines.deeper(|lines| {
        lines.item("formula", formula(form));
        if form.inertia.value.is_finite() {
            lines.item("M", inertia_text(form.inertia, units));
        }
        write_parameters(form, units, lines);
    });
}

/// The parameters of a form, one item each.
pub fn write_parameters(form: &Fitted, units: &Units, lines: &mut Lines) {
    for (symbols, text) in parameter_rows(form, units) {
        lines.item(&symbols.join(", "), text);
    }
}

/// What a parameter is called; empty for those that only shape a curve.
fn meaning(symbol: &str) -> &'static str {
    match symbol {
        "Fc" | "g4" => "Coulomb",
        "Fv" | "g6" => "viscous",
        "Fs" => "at the smallest velocities",
        "vs" => "Stribeck velocity",
        "Fd" => "half the difference of the viscous friction between the directions",
        "F0" => "offset",
        "a2" => "linear",
        "a1" => "cubic",
        _ => "",
    }
}

/// What is known about the parameters of a form: first those that the data determine. The others share a row where the reason is the same.
pub fn parameter_rows<'a>(form: &'a Fitted, units: &Units) -> Vec<(Vec<&'a str>, String)> {
    let unit = |p: &Parameter| units.of_curve(p.unit, form.form.is_stiffness());
    let (known, unknown): (Vec<_>, Vec<_>) = form.parameters.iter().partition(|p| p.identifiable);
    let known = known.into_iter().map(|p| match meaning(&p.symbol) {
        "" => (vec![&*p.symbol], parameter_value(p, &unit(p))),
        meaning => (vec![&*p.symbol], format!("{}, {meaning}", parameter_value(p, &unit(p)))),
    });
    let mut rows: Vec<(Vec<&str>, String)> = known.collect();
    for p in unknown {
        let (reason, values) = (not_identifiable(p), possible_values(p, &unit(p)));
        match rows.iter_mut().find(|(_, text)| text.starts_with(&reason)) {
            Some((symbols, text)) => {
                symbols.push(&p.symbol);
                text.push_str(&values);
            }
            None => rows.push((vec![&p.symbol], reason + &values)),
        }
    }
    rows
}

/// A refuted form farther from the free curve than this many times the nearest of the list is named without its parameters. Convention.
const FAR_OFF: f64 = 2.0;

/// Forms that were tried, under a heading: the distance of each from the free curve, and the parameters in one row, but of those far off.
pub fn write_others(heading: &str, forms: &[&Fitted], units: &Units, lines: &mut Lines) {
    let distance = |form: &Fitted| form.lack_of_fit.distance;
    let nearest = forms.iter().map(|form| distance(form)).fold(f64::INFINITY, f64::min);
    let is_far_off = |form: &Fitted| is_refuted(form) && distance(form) > FAR_OFF * nearest;
    let elsewhere = match forms.iter().any(|form| is_far_off(form)) {
        true => ". For forms far from the curve, see the page or --json.",
        false => "",
    };
    lines.sentence(format!(
        "{heading}, smallest BIC first; tested at the level {REFUTED:e}{elsewhere}"
    ));
    lines.deeper(|lines| {
        for form in forms {
            lines.sentence(format!("{}: {}", titled(form), lack_text(form)));
            if !is_far_off(form) {
                lines.deeper(|lines| lines.sentence(parameters_in_a_row(form, units)));
            }
        }
    });
}

/// The inertia of a form where it has its own, and its parameters.
pub fn parameters_in_a_row(form: &Fitted, units: &Units) -> String {
    let inertia = form.inertia;
    let mass = inertia.value.is_finite();
    let mass = mass.then(|| match inertia.is_positive() {
        true => format!("M = {} {}", with_error(inertia), units.inertia()),
        false => "M not identifiable".to_owned(),
    });
    let (known, unknown): (Vec<_>, Vec<_>) = form.parameters.iter().partition(|p| p.identifiable);
    let known = known.into_iter().map(|p| {
        let unit = units.of_curve(p.unit, form.form.is_stiffness());
        format!("{} = {} {unit}", p.symbol, with_error(estimate(p)))
    });
    let unknown: Vec<&str> = unknown.iter().map(|p| &*p.symbol).collect();
    let unknown = (!unknown.is_empty()).then(|| format!("{} not identifiable", joined(&unknown)));
    let each = mass.into_iter().chain(known).chain(unknown);
    let each: Vec<String> = each.map(|text| unbroken(&text)).collect();
    each.join(", ")
}

/// The distance of a form from the free curve, then its test.
pub fn lack_text(form: &Fitted) -> String {
    let lack = form.lack_of_fit;
    let distance = percent(lack.distance);
    let p = unbroken(&p_value(lack.p_value));
    match is_refuted(form) {
        true => format!("{distance} from the free curve, refuted ({p})"),
        false => format!("{distance} from the free curve, not refuted ({p})"),
    }
}

/// Whether the free curve refutes a form.
pub fn is_refuted(form: &Fitted) -> bool {
    form.lack_of_fit.p_value < REFUTED
}

/// A form as JSON.
pub fn fitted_json(form: &Fitted, units: &Units) -> Value {
    let parameter = |p: &Parameter| {
        let value = json!({
            "value": p.value,
            "standard_error": p.standard_error,
            "unit": units.of_curve(p.unit, form.form.is_stiffness()),
            "identifiable": p.identifiable,
            "range": p.range,
            "remark": p.remark,
        });
        (p.symbol.clone(), value)
    };
    let parameters: serde_json::Map<String, Value> = form.parameters.iter().map(parameter).collect();
    json!({
        "form": form.form,
        "title": form.form.title(),
        "inertia": inertia_json(form.inertia),
        "parameters": parameters,
        "lack_of_fit": form.lack_of_fit,
        "bic": form.bic,
    })
}

/// A fit below this, in percent, means that the simulated motion has run away.
pub const RUN_AWAY: f64 = -1000.0;
/// A fit below this, in percent, is poor: the error is a fifth of the measured motion's spread. Convention.
pub const POOR: f64 = 80.0;

/// How near a simulated motion is to the measured one.
pub fn nearness(fit: Fit, unit: &str) -> String {
    match fit.percent > RUN_AWAY {
        true => format!("RMS error {} {unit}, fit {:.2} %", number(fit.rms), fit.percent),
        false => "it runs away from the measured motion: inertia and friction as they were found do not explain it"
            .to_owned(),
    }
}

/// What to know before trusting a result, one item each.
pub fn write_findings(findings: &[Finding], lines: &mut Lines) {
    for finding in findings {
        lines.note(finding);
    }
}

/// A constant of the links of an arm.
pub struct Constant {
    /// Its name.
    pub name: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// kg m^2.
    pub value: Estimated,
}

/// The constants of the links.
pub fn constants(arm: &TwoLinkArm) -> [Constant; 3] {
    let constant = |name, formula, value| Constant { name, formula, value };
    [
        constant("shoulder", "m1 lc1^2 + m2 (l1^2 + lc2^2) + I1 + I2", arm.shoulder),
        constant("elbow", "m2 lc2^2 + I2", arm.elbow),
        constant("coupling", "m2 l1 lc2", arm.coupling),
    ]
}

/// Text of the terminal with the signs of a page.
pub fn typeset(text: &str) -> String {
    text.replace("^2", "²").replace("^3", "³")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_have_few_digits() {
        let parameter = |range| Parameter {
            symbol: "asw".to_owned(),
            unit: [0, -2],
            value: 1.0,
            standard_error: f64::NAN,
            identifiable: false,
            range,
            remark: String::new(),
        };
        for (range, expected) in [
            ([-3_402_074.3, 7_978_760.1], "; asw may be -3.4e6 to 8.0e6 1/rad^2"),
            ([-223.4, 0.0], "; asw may be -223 to 0 1/rad^2"),
        ] {
            assert_eq!(possible_values(&parameter(range), "1/rad^2"), expected);
        }
    }
}
