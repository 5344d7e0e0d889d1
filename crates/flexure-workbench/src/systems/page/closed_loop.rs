//! A loop as the page draws it: the dynamics of the whole loop, and a table of its linear part.

use flexure::identify::result::{Detail, FeedbackBlock, LoopPart, Value};
use flexure::text::{capitalised, number};
use flexure_report::data::{LinearPart, Table};

use super::blocks::linear;
use crate::systems::poles::{poles_text, roots_text};
use crate::systems::summary::{linear_text, way};
use crate::systems::task::Identified;

/// The whole loop from input to output, once for small and once for large amplitudes.
pub(super) fn whole(own: &FeedbackBlock, sample_time: Option<f64>) -> impl Iterator<Item = LinearPart> {
    own.whole().into_iter().map(move |part| LinearPart {
        text: format!(
            "{}. It describes the loop from input to output with {}.",
            capitalised(&linear_text(&part.block, sample_time)),
            part.meaning
        ),
        ..linear(part.title, &part.block, sample_time)
    })
}

/// The axes of the nonlinearity: what enters it and its output, as far as the identification says what they are.
pub(super) fn labels(identified: &Identified) -> [String; 2] {
    let (result, labels) = (&identified.result, &identified.labels);
    let output = &result.output;
    let has = |key, value: &str| {
        let same = |detail: &&Detail| detail.key == key && detail.value == Value::from(value);
        result.details.iter().find(same).is_some()
    };
    let in_unit = |name: &str, column: &str| match labels.unit(column) {
        "" => format!("{name}, in the unit of {column}"),
        unit => format!("{name} ({unit})"),
    };
    let entering = match () {
        () if has("entering", "output") => labels.of(output),
        () if has("entering", "difference") => in_unit(&format!("change of {output} in a sample"), output),
        () if has("entering", "hidden") => "hidden signal, scaled to unit variance".to_owned(),
        () => "what enters the nonlinearity".to_owned(),
    };
    let leaving = match &result.inputs[..] {
        [input] if has("convention", "holding-input") => in_unit("output of the nonlinearity", input),
        _ if has("convention", "no-tangent") => in_unit("output of the nonlinearity", output),
        _ => "output of the nonlinearity".to_owned(),
    };
    [entering, leaving]
}

/// The linear part alone: one denominator, and a numerator for each way through it.
pub(super) fn alone(own: &FeedbackBlock, sample_time: Option<f64>) -> Option<Table> {
    let parts = own.linear_parts();
    let block = &parts.first()?.block;
    let text = format!(
        "Two signals enter the linear part: the input and what leaves the nonlinearity. Two signals leave it: the output and what enters the \
         nonlinearity. All four ways have the same poles: {}. Without the nonlinearity around it, the linear part may be unstable or integrate. \
         Coefficients are by rising delay; the denominator is {}.",
        poles_text(block, sample_time).replace('\u{a0}', " "),
        coefficients(block.system.a())
    );
    let row = |part: &LoopPart| {
        vec![
            format!("{}: {}", way(part), part.meaning),
            coefficients(part.block.system.b()),
            roots_text(part.block.system.zeros()).replace('\u{a0}', " "),
        ]
    };
    Some(Table {
        title: "Linear part without the nonlinearity".to_owned(),
        text,
        columns: ["way", "numerator", "zeros"].map(String::from).to_vec(),
        rows: parts.iter().map(row).collect(),
        chosen: None,
        ends_in_text: true,
    })
}

fn coefficients(values: &[f64]) -> String {
    let each: Vec<String> = values.iter().map(|v| number(*v)).collect();
    each.join(", ")
}
