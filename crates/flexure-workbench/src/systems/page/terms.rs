//! The terms of a polynomial model as a table.

use flexure::identify::{Identification, NarxModel, NarxTerm};
use flexure::text::number;
use flexure_report::data::Table;

/// Terms of a polynomial that are shown, those with the largest coefficients.
const TERMS: usize = 40;

/// The monomials with the largest coefficients.
pub(super) fn terms(result: &Identification, model: &NarxModel) -> Table {
    let factor = |i: &usize| match *i < model.outputs {
        true => format!("{}[n-{}]", result.output, i + 1),
        false => match i - model.outputs + model.delay {
            0 => format!("{}[n]", result.inputs[0]),
            lag => format!("{}[n-{lag}]", result.inputs[0]),
        },
    };
    let mut sorted: Vec<&NarxTerm> = model.terms.iter().collect();
    sorted.sort_by(|a, b| b.coefficient.abs().total_cmp(&a.coefficient.abs()));
    let row = |t: &&NarxTerm| {
        let product: Vec<String> = t.factors.iter().map(factor).collect();
        vec![product.join(" "), number(t.coefficient)]
    };
    Table {
        title: "Terms".to_owned(),
        text: format!(
            "The {} largest of {} coefficients, for inputs and outputs at zero mean and unit variance; the model's file has all.",
            sorted.len().min(TERMS),
            sorted.len()
        ),
        columns: vec!["term".to_owned(), "coefficient".to_owned()],
        rows: sorted.iter().take(TERMS).map(row).collect(),
        chosen: None,
        ends_in_text: false,
    }
}
