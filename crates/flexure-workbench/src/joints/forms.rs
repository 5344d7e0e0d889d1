//! The forms of a joint on its page: those that were kept as cards, the others as a table.

use flexure::identify::robot_joint::{Fitted, FlexibleAxis, Polished};
use flexure::text::{p_value, percent};
use flexure_report::data::{ParameterTable, Table};

use super::flexible::at_motor;
use super::text::{
    Units, formula, inertia_text, is_refuted, lack_text, parameter_rows, parameters_in_a_row, titled, typeset,
};
use crate::text::{capitalised, number};

/// The forms of a joint's model; `of` begins their headings.
pub fn tables(axis: &FlexibleAxis, units: &Units, of: &str) -> impl Iterator<Item = ParameterTable> {
    let forms = [&axis.model.stiffness, &axis.model.friction].map(|form| (form, ""));
    forms
        .into_iter()
        .chain(at_motor(axis))
        .map(move |(form, place)| ParameterTable {
            heading: capitalised(&format!("{of}{}{place}", form.form.title())),
            note: format!("all forms together: {}", lack_text(&axis.model.friction)),
            ..table(form, units)
        })
}

/// The forms of a joint's curves, each in turn, with their headings, which `of` begins.
pub fn alone<'a>(axis: &'a FlexibleAxis, of: &str) -> impl Iterator<Item = (String, &'a Fitted)> {
    let curves = [(&axis.stiffness, ""), (&axis.link.friction, "")].into_iter();
    let curves = curves.chain(axis.motor_friction.iter().map(|curve| (curve, ", at the motor")));
    curves.flat_map(move |(curve, place)| {
        let heading = |form: &Fitted| capitalised(&format!("{of}{}{place}", form.form.title()));
        let forms = curve.by_bic().into_iter();
        forms.map(|form| (heading(form), form)).collect::<Vec<_>>()
    })
}

/// The title of the forms of a flexible joint's curves.
pub const ALONE: &str = "Forms of each curve in turn";

/// Forms that were tried and their headings as a table; none if there are none.
pub fn others<'a>(title: &str, forms: impl Iterator<Item = (String, &'a Fitted)>, units: &Units) -> Option<Table> {
    let row = |(heading, form): (String, &Fitted)| {
        let test = if is_refuted(form) { "refuted" } else { "not refuted" };
        vec![
            heading,
            percent(form.lack_of_fit.distance),
            format!("{test}, {}", p_value(form.lack_of_fit.p_value)),
            typeset(&parameters_in_a_row(form, units)),
        ]
    };
    let forms: Vec<_> = forms.collect();
    let inertia = match forms.iter().any(|(_, form)| form.inertia.value.is_finite()) {
        true => " M is the inertia with this form.",
        false => "",
    };
    let rows: Vec<_> = forms.into_iter().map(row).collect();
    (!rows.is_empty()).then(|| Table {
        title: format!("{title} ({})", rows.len()),
        text: format!("Smallest BIC first.{inertia}"),
        columns: ["form", "off the free curve", "test", "parameters"]
            .map(String::from)
            .to_vec(),
        rows,
        chosen: None,
        ends_in_text: true,
    })
}

/// The parameters with which the motion is simulated, where these are not those of the equations.
pub fn polished_table(polished: &Polished, units: &Units) -> Option<ParameterTable> {
    let form = &polished.form;
    let mut rows = vec![[
        units.moved().to_owned(),
        typeset(&format!("{} {}", number(form.inertia.value), units.inertia())),
    ]];
    rows.extend(form.parameters.iter().map(|p| {
        let unit = units.of_curve(p.unit, false);
        [p.symbol.clone(), typeset(&format!("{} {unit}", number(p.value)))]
    }));
    let [before, after] = polished.held_back.map(number);
    polished.is_used.then(|| ParameterTable {
        heading: "The same form, fitted to the simulated motion too".to_owned(),
        rows,
        note: format!(
            "The motion is simulated with these values. They have no standard errors. On data held back they lower its error from {before} to \
             {after} {}. To compare with other logs, take the values of the equations of motion.",
            units.position
        ),
    })
}

/// The parameters of a form.
pub fn table(form: &Fitted, units: &Units) -> ParameterTable {
    let mut rows = vec![["formula".to_owned(), typeset(&formula(form))]];
    if form.inertia.value.is_finite() {
        let of = match form.form.is_stiffness() {
            true => "motor inertia",
            false => units.moved(),
        };
        let inertia = typeset(&inertia_text(form.inertia, units));
        rows.push([of.to_owned(), format!("{inertia}, with this form")]);
    }
    rows.extend(
        parameter_rows(form, units)
            .into_iter()
            .map(|(symbols, value)| [symbols.join(", "), typeset(&value)]),
    );
    ParameterTable {
        heading: titled(form),
        rows,
        note: lack_text(form),
    }
}
