//! Parts of a joint as text and as JSON.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, Finding, Fitted, Parameter, REFUTED, TwoLinkArm};
use serde_json::{Value, json};

use super::simulation::Fit;
use crate::text::{capitalised, number};

/// The units of a joint's quantities.
pub struct Units {
    /// Of positions: rad or m.
    pub position: &'static str,
    /// Of torques: N m or N.
    pub torque: &'static str,
    prismatic: bool,
}

impl Units {
    /// Those of a prismatic or a revolute joint.
    pub fn of(prismatic: bool) -> Units {
        let [position, torque] = if prismatic { ["m", "N"] } else { ["rad", "N m"] };
        Units {
            position,
            torque,
            prismatic,
        }
    }

    /// Of inertias.
    pub fn inertia(&self) -> &'static str {
        if self.prismatic { "kg" } else { "kg m^2" }
    }

    /// Of a parameter of a curve of stiffness or friction, by the powers of torque and deflection or velocity.
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

/// A value with its standard error.
pub fn with_error(estimated: Estimated) -> String {
    let Estimated { value, standard_error } = estimated;
    match standard_error.is_finite() {
        true => format!("{} +- {}", number(value), number(standard_error)),
        false => format!("{} (no standard error: see the notes)", number(value)),
    }
}

/// The estimate of a parameter.
pub fn estimate(parameter: &Parameter) -> Estimated {
    Estimated {
        value: parameter.value,
        standard_error: parameter.standard_error,
    }
}

/// A parameter for reading.
pub fn parameter_text(parameter: &Parameter, unit: &str) -> String {
    let name = format!("{:<6}", parameter.symbol);
    if parameter.identifiable {
        let value = with_error(estimate(parameter));
        return format!("{name} {value} {unit}");
    }
    let [low, high] = parameter.range;
    let range = match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("the data support {} to {} {unit}", number(low), number(high)),
        (true, false) => format!("the data support any value above {} {unit}", number(low)),
        (false, true) => format!("the data support any value below {} {unit}", number(high)),
        (false, false) if parameter.standard_error.is_finite() => "the data support any value".to_owned(),
        (false, false) => format!("the best fit has {} {unit}", number(parameter.value)),
    };
    format!("{name} not identifiable: {}; {range}", parameter.remark)
}

/// The title of a form, with a capital letter at the start.
pub fn titled(form: &Fitted) -> String {
    capitalised(form.form.title())
}

/// A form for reading, a line a parameter.
pub fn fitted_lines(form: &Fitted, units: &Units, best: bool) -> Vec<String> {
    let mut title = titled(form);
    if best {
        title.push_str("  [smallest BIC]");
    }
    let mut lines = vec![format!("  {title}")];
    if form.inertia.value.is_finite() {
        let inertia = with_error(form.inertia);
        lines.push(format!("    {:<6} {inertia} {}", "M", units.inertia()));
    }
    lines.extend(parameter_lines(form, units));
    lines.push(format!("    {}", lack_text(form)));
    lines
}

/// The parameters of a form for reading, a line each.
pub fn parameter_lines(form: &Fitted, units: &Units) -> Vec<String> {
    let unit = |p: &Parameter| units.of_curve(p.unit, form.form.is_stiffness());
    let lines = form
        .parameters
        .iter()
        .map(|p| format!("    {}", parameter_text(p, &unit(p))));
    lines.collect()
}

/// The test of a form against the free curve, for reading.
pub fn lack_text(form: &Fitted) -> String {
    let lack = form.lack_of_fit;
    let verdict = match lack.p_value < REFUTED {
        true => "refuted by",
        false => "agrees with",
    };
    format!(
        "{verdict} the free curve (F = {}, p = {}), {:.2} % from it",
        number(lack.statistic),
        number(lack.p_value),
        100.0 * lack.distance
    )
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
        "inertia": form.inertia,
        "parameters": parameters,
        "lack_of_fit": form.lack_of_fit,
        "bic": form.bic,
    })
}

/// Over what a free curve was seen.
pub fn range_line(what: &str, band: &Band, unit: &str) -> String {
    let x = &band.x[0];
    format!(
        "  {what:<14} seen from {} to {} {unit}; beyond, these data say nothing",
        number(x[0]),
        number(x[x.len() - 1])
    )
}

/// A fit below this, in percent, is that of a motion that has run away.
const RUN_AWAY: f64 = -1000.0;

/// How near a simulated motion is to the measured one.
pub fn nearness(fit: Fit, unit: &str) -> String {
    match fit.percent > RUN_AWAY {
        true => format!("RMS error {} {unit}, fit {:.2} %", number(fit.rms), fit.percent),
        false => "it runs away from the measured motion: inertia and friction as they were found do not explain it"
            .to_owned(),
    }
}

/// What to know before trusting a result, a line each.
pub fn findings(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(|f| format!("  note: {f}")).collect()
}

/// A constant of the links of an arm.
pub struct Constant {
    /// What it is called.
    pub name: &'static str,
    /// What it is made of.
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
