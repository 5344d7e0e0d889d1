//! The page of a model without blocks.

use anyhow::Result;
use flexure::identify::{NarxIdentification, VolterraIdentification};
use flexure::linear::TransferFunction;
use flexure_io::RecordFile;
use flexure_report::data::{LinearPart, Page, Scatter, Surface, Table, TitledSurface};

use super::{
    Decoration, Judged, Parts, assembled, choice, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::systems::outcome::Signals;
use crate::systems::references::Reference;
use crate::text::number;

/// Terms that are shown, those with the largest coefficients.
const TERMS: usize = 40;

/// Fills in the page.
pub fn page(file: &RecordFile, signals: &Signals, reference: &Reference, decoration: Decoration) -> Result<Page> {
    let (parts, model, fitted, predicted, warnings) = match reference {
        Reference::Narx(r) => (
            narx(signals, r),
            "A polynomial NARX model (a reference without blocks)",
            r.fitted,
            &r.predicted,
            &r.warnings,
        ),
        Reference::Volterra(r) => (
            volterra(signals, r)?,
            "A regularised second-order Volterra series (a reference without blocks)",
            r.fitted,
            &r.predicted,
            &r.warnings,
        ),
    };
    let judged = Judged {
        signals: *signals,
        model: model.to_owned(),
        fitted,
        predicted,
        verdict: reference.verdict(),
        warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn narx(signals: &Signals, result: &NarxIdentification) -> Parts {
    let model = &result.model;
    let free = match result.bounded {
        true => "stays within bounds by itself",
        false => "runs away on this record and is held at its bounds",
    };
    let lags = format!("{} + {}", model.outputs, model.inputs);
    let mut facts = fit_facts(&result.verdict, signals.output).to_vec();
    facts.extend([
        fact("Lags", lags, "past outputs and inputs"),
        fact("Delay", samples(model.delay), "of the latest input"),
        fact("Degree", result.degree.to_string(), "of the polynomial"),
        fact("Terms", model.terms.len().to_string(), "monomials"),
        samples_fact(result.predicted.len(), result.fitted, ""),
    ]);
    let why =
        "smallest free-run error on the last quarter of the fit's samples, among models that stay within bounds there";
    Parts {
        facts,
        choices: vec![
            choice(
                "Lags and degree",
                format!("{} structures tried", result.tried.len()),
                why,
            ),
            choice(
                "Free run",
                free.to_owned(),
                "what is fed back is held within an output's span beyond what the fit saw",
            ),
        ],
        candidates: vec![terms(signals, result)],
        ..Parts::default()
    }
}

/// The monomials with the largest coefficients.
fn terms(signals: &Signals, result: &NarxIdentification) -> Table {
    let model = &result.model;
    let factor = |i: &usize| match *i < model.outputs {
        true => format!("{}[n-{}]", signals.output, i + 1),
        false => match i - model.outputs + model.delay {
            0 => format!("{}[n]", signals.input),
            lag => format!("{}[n-{lag}]", signals.input),
        },
    };
    let mut sorted: Vec<_> = model.terms.iter().collect();
    sorted.sort_by(|a, b| b.coefficient.abs().total_cmp(&a.coefficient.abs()));
    let row = |t: &&flexure::identify::NarxTerm| {
        let product: Vec<String> = t.factors.iter().map(factor).collect();
        vec![product.join(" "), number(t.coefficient)]
    };
    Table {
        title: "Terms".to_owned(),
        words: format!(
            "The {} largest of {} coefficients, for inputs and outputs at zero mean and unit variance; the model's file has all.",
            sorted.len().min(TERMS),
            sorted.len()
        ),
        columns: vec!["term".to_owned(), "coefficient".to_owned()],
        rows: sorted.iter().take(TERMS).map(row).collect(),
        chosen: None,
        ends_in_words: false,
    }
}

fn volterra(signals: &Signals, result: &VolterraIdentification) -> Result<Parts> {
    let model = &result.model;
    let mut facts = fit_facts(&result.verdict, signals.output).to_vec();
    facts.extend([
        fact("Delay", samples(model.delay), "of both kernels"),
        fact(
            "Lags",
            format!("{} and {}", model.first.len(), model.second_memory),
            "of the kernels of first and second order",
        ),
        fact("Noise", number(result.noise), "standard deviation"),
        samples_fact(result.predicted.len(), result.fitted, ""),
    ]);
    let linear = match model.first.is_empty() {
        true => Vec::new(),
        false => {
            let delayed = std::iter::repeat_n(0.0, model.delay).chain(model.first.iter().copied());
            let system = TransferFunction::new(delayed.collect(), vec![1.0])?;
            let shown = linear_part("First-order kernel", &system, None, signals.sample_time);
            vec![LinearPart {
                words: "The response to small deviations of the input from its mean.".to_owned(),
                // As many coefficients as lags are no formula to read.
                b: Vec::new(),
                zeros: Vec::new(),
                ..shown
            }]
        }
    };
    let decay = |i: usize| {
        let prior = result.priors[i];
        format!("size {}, decay {} a sample", number(prior.size), number(prior.decay))
    };
    let why = "largest marginal likelihood of a tuned-correlated prior";
    Ok(Parts {
        facts,
        surface: second_kernel(signals, result),
        linear,
        choices: vec![
            choice("First-order prior", decay(0), why),
            choice("Second-order prior", decay(1), why),
        ],
        ..Parts::default()
    })
}

/// The second-order kernel over both lags.
fn second_kernel(signals: &Signals, result: &VolterraIdentification) -> Option<TitledSurface> {
    let model = &result.model;
    let lags: Vec<f64> = (0..model.second_memory).map(|i| (model.delay + i) as f64).collect();
    (lags.len() > 1).then(|| TitledSurface {
        title: "Second-order kernel".to_owned(),
        words: "What the product of the input's deviations at two lags adds to the output; symmetric. A Hammerstein system has all of it \
                on the diagonal, a Wiener system has it in proportion to the product of its impulse response at both lags."
            .to_owned(),
        surface: Surface {
            x_label: "first lag (samples)".to_owned(),
            y_label: "second lag (samples)".to_owned(),
            z_label: format!("second-order kernel of {}", labelled(signals.output)),
            x: lags.clone(),
            y: lags,
            z: model.second.clone(),
            points: Scatter::default(),
        },
    })
}
