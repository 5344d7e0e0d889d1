//! A joint in words and as JSON.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Finding, Fitted, Parameter, REFUTED};
use serde_json::{Value, json};

use flexure_workbench::text::number;

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
        match prismatic {
            true => Units {
                position: "m",
                torque: "N",
                prismatic,
            },
            false => Units {
                position: "rad",
                torque: "N m",
                prismatic,
            },
        }
    }

    /// Of inertias.
    pub fn inertia(&self) -> &'static str {
        if self.prismatic { "kg" } else { "kg m^2" }
    }

    /// Of a parameter of a curve of stiffness or friction, by the powers of torque and deflection or velocity.
    pub fn of_curve(&self, powers: [i32; 2], stiffness: bool) -> String {
        self.powers(powers, !stiffness)
    }

    fn powers(&self, [torque, x]: [i32; 2], velocity: bool) -> String {
        let power = |unit: &str, p: i32| match p {
            1 => unit.to_owned(),
            p => format!("{unit}^{p}"),
        };
        let seconds = if velocity { "s" } else { "" };
        let top = match torque {
            0 => String::new(),
            _ => self.torque.to_owned(),
        };
        match x {
            0 => top,
            1 => format!("{}{}", self.position, if velocity { "/s" } else { "" }),
            x => {
                let above = match (top.as_str(), seconds) {
                    ("", "") => "1".to_owned(),
                    ("", only) | (only, "") => only.to_owned(),
                    (torque, seconds) => format!("{torque} {seconds}"),
                };
                format!("{above}/{}", power(self.position, -x))
            }
        }
    }
}

/// A value with its standard error.
pub fn with_error(value: f64, error: f64) -> String {
    match error.is_finite() {
        true => format!("{} +- {}", number(value), number(error)),
        false => format!("{} (no standard error: see the notes)", number(value)),
    }
}

/// A parameter in words.
pub fn parameter_words(parameter: &Parameter, unit: &str) -> String {
    let name = format!("{:<6}", parameter.symbol);
    if parameter.identifiable {
        let value = with_error(parameter.value, parameter.standard_error);
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

/// A form in words, a line a parameter.
pub fn fitted_words(form: &Fitted, units: &Units, best: bool) -> Vec<String> {
    let title = form.form.title();
    let mut title = title[..1].to_uppercase() + &title[1..];
    if best {
        title.push_str("  [smallest BIC]");
    }
    let mut lines = vec![format!("  {title}")];
    if form.inertia.value.is_finite() {
        lines.push(format!(
            "    {:<6} {} {}",
            "M",
            with_error(form.inertia.value, form.inertia.standard_error),
            units.inertia()
        ));
    }
    for parameter in &form.parameters {
        let unit = units.of_curve(parameter.unit, form.form.is_stiffness());
        lines.push(format!("    {}", parameter_words(parameter, &unit)));
    }
    lines.push(format!("    {}", lack_words(form)));
    lines
}

/// The test of a form against the free curve, in words.
pub fn lack_words(form: &Fitted) -> String {
    let lack = form.lack_of_fit;
    let verdict = if lack.p_value < REFUTED {
        "refuted by"
    } else {
        "agrees with"
    };
    format!(
        "{verdict} the free curve (F = {}, p = {}), {:.2} % from it",
        number(lack.statistic),
        number(lack.p_value),
        100.0 * lack.distance
    )
}

/// A form as JSON.
pub fn fitted_json(form: &Fitted, units: &Units, stiffness: bool) -> Value {
    let parameters: serde_json::Map<String, Value> = form
        .parameters
        .iter()
        .map(|p| {
            let value = json!({
                "value": p.value,
                "standard_error": p.standard_error,
                "unit": units.of_curve(p.unit, stiffness),
                "identifiable": p.identifiable,
                "range": p.range,
                "remark": p.remark,
            });
            (p.symbol.clone(), value)
        })
        .collect();
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
pub fn range_words(what: &str, band: &Band, unit: &str) -> String {
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
pub fn nearness(rms: f64, fit_percent: f64, unit: &str) -> String {
    match fit_percent > RUN_AWAY {
        true => format!("RMS error {} {unit}, fit {fit_percent:.2} %", number(rms)),
        false => "it runs away from the measured motion: inertia and friction as they were found do not explain it"
            .to_owned(),
    }
}

/// What to know before trusting a result, a line each.
pub fn findings(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(|f| format!("  note: {f}")).collect()
}
