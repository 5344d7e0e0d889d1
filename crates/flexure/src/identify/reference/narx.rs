//! Polynomial NARX: the output from past outputs and inputs.
//!
//! $$ Y_n = c_0 + \sum_k c_k\, m_k(Y_{n-1}, \dots, Y_{n-n_a}, U_{n-s}, \dots, U_{n-s-n_b+1}) + e_n $$
//! with all monomials up to a degree (Leontaritis & Billings 1985). The coefficients are found by ridge regression, with a penalty of at
//! least that of generalised cross-validation. Lags, degree and penalty are those with the least free-run error on the last quarter of the
//! fit's samples, among models whose free run stays within bounds there. The fitted one-step equation treats all noise as process noise, so
//! output noise biases it; a block model fitted by its simulation error has no such bias.
//!
//! Values that are fed back are limited to the range in the fit, extended by its span on either side.

use super::super::block::{Prepared, delays};
use super::limits::{
    CHOICE_SHARE, LARGER_PENALTIES, LARGEST_DEGREE, MORE_PAST_INPUTS, MOST_PAST_OUTPUTS, MOST_TERMS, NARX_SAMPLES,
};
use super::ridge::{Affine, Ridge};
use crate::error::Result;
use crate::identify::request::{Progress, Request, Structure};
use crate::identify::result::{BlockKind, Detail, Identification, NamedBlock, Place, StructureName, Values};
use crate::identify::run::{Run, path};
use crate::interrupt;
use crate::model::{Block, NarxModel, NarxTerm};
use crate::parallel;

/// A structure that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NarxCandidate {
    /// Past outputs.
    outputs: usize,
    /// Past inputs.
    inputs: usize,
    /// The monomials' largest degree.
    degree: usize,
    /// The best of the penalties that were tried, for columns of unit variance and one sample.
    penalty: f64,
    /// RMS of the free-run error on the samples of the choice, relative to the output's standard deviation.
    relative_error: f64,
    /// Whether the free run stayed within bounds.
    bounded: bool,
}

/// The identification of a polynomial NARX model.
///
/// ```
/// use flexure::identify::NARX;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..2000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let mut y = vec![0.0; 2000];
/// for n in 1..2000 {
///     y[n] = 0.5 * y[n - 1] - 0.1 * y[n - 1] * y[n - 1] + u[n - 1] + 0.3 * u[n - 1] * y[n - 1];
/// }
/// let result = NARX.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.verdict.measures.fit_percent > 99.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "narx",
        title: "polynomial NARX",
    },
    description: "a polynomial of past outputs and inputs: a reference without blocks",
    inputs: 1..=1,
    options: &[],
    rank: None,
    identify,
};

fn identify(request: &Request<'_>, _: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a NARX fit (besides the fresh part)")?;
    let Searched { model, degree, tried } = searched(&samples.prepared())?;
    let (order, delay) = (model.outputs, model.delay);
    let (u_mean, u_spread) = model.scales[0];
    let all: Vec<f64> = samples.input().iter().map(|u| (u - u_mean) / u_spread).collect();
    let details = details(&model, degree, model.run(&all).bounded, tried.len());
    let block = NamedBlock::new("narx", "Terms", BlockKind::Narx(model.clone()));
    let run = Run::new(&samples, Block::Narx(model), vec![path(request, vec![block])], None)?;
    Ok(Identification {
        method: "ridge".into(),
        order,
        delay,
        tried: tried.iter().map(Values::from).collect(),
        details,
        ..run.identification(&ROW, request)?
    })
}

/// The details of the polynomial.
fn details(model: &NarxModel, degree: usize, bounded: bool, tried: usize) -> Vec<Detail> {
    let lags = format!("{} + {}", model.outputs, model.inputs);
    let free = match bounded {
        true => "stays within bounds by itself",
        false => "runs away on this record and is held at its bounds",
    };
    let why =
        "smallest free-run error on the last quarter of the fit's samples, among models that stay within bounds there";
    let held = "what is fed back is held within an output's span beyond what the fit saw";
    let tried = format!("{tried} structures tried");
    vec![
        Detail::sentence(Place::Fact, "Lags", lags, "past outputs and inputs"),
        Detail::new("degree", degree).shown(Place::Fact, "Degree", degree.to_string(), "of the polynomial"),
        Detail::sentence(Place::Fact, "Terms", model.terms.len().to_string(), "monomials"),
        Detail::sentence(Place::Choice, "Lags and degree", tried, why),
        Detail::new("bounded", bounded).shown(Place::ChoiceAndText, "Free run", free, held),
    ]
}

impl From<&NarxCandidate> for Values {
    fn from(t: &NarxCandidate) -> Self {
        Values::new([
            ("past_outputs", t.outputs.into()),
            ("past_inputs", t.inputs.into()),
            ("degree", t.degree.into()),
            ("penalty", t.penalty.into()),
            ("relative_error", t.relative_error.into()),
            ("bounded", t.bounded.into()),
        ])
    }
}

/// The best of all structures, fitted to all samples.
struct Searched {
    model: NarxModel,
    degree: usize,
    tried: Vec<NarxCandidate>,
}

fn searched(prepared: &Prepared) -> Result<Searched> {
    let data = &prepared.data;
    let delay = delays(data).first().copied().unwrap_or(0);
    let first = data.y.len().saturating_sub(NARX_SAMPLES);
    let (u, y) = (&data.u[0][first..], &data.y[first..]);
    let (low, high) = y.iter().fold((0.0_f64, 0.0_f64), |(l, h), y| (l.min(*y), h.max(*y)));
    let span = high - low;
    let blank = |outputs, inputs, degree| NarxModel {
        outputs,
        inputs,
        delay,
        constant: 0.0,
        terms: monomials(outputs + inputs, degree),
        scales: [prepared.inputs[0], prepared.output].map(|s| (s.mean, s.spread)),
        held: (low - span, high + span),
    };
    let mut structures = Vec::new();
    for outputs in 0..=MOST_PAST_OUTPUTS {
        for inputs in (0..=MORE_PAST_INPUTS).map(|more| outputs.max(1) + more) {
            let all = (1..=LARGEST_DEGREE).map(|degree| (degree, blank(outputs, inputs, degree)));
            structures.extend(all.filter(|(_, model)| model.terms.len() <= MOST_TERMS));
        }
    }
    let estimated = u.len() - (CHOICE_SHARE * u.len() as f64) as usize;
    let interrupt = interrupt::current();
    let fits = parallel::batch(&structures, |(degree, blank)| {
        let fit = || fit(blank, *degree, u, y, estimated);
        (!interrupt.is_requested()).then(fit).flatten()
    });
    let fits: Vec<Fit> = fits.into_iter().flatten().collect();
    interrupt::check()?;
    let best = fits.iter().min_by(|a, b| {
        let runs_away = a.tried.bounded.cmp(&b.tried.bounded).reverse();
        runs_away.then(a.tried.relative_error.total_cmp(&b.tried.relative_error))
    });
    let (model, degree) = match best {
        Some(Fit { tried, model }) => {
            let again = refit(model, tried, u, y);
            let kept = again.filter(|m| m.run(u).bounded || !model.run(u).bounded);
            (kept.unwrap_or_else(|| model.clone()), tried.degree)
        }
        None => (blank(0, 1, 0), 0),
    };
    Ok(Searched {
        model,
        degree,
        tried: fits.into_iter().map(|f| f.tried).collect(),
    })
}

/// All products of up to `degree` of `variables` variables, with coefficient zero.
fn monomials(variables: usize, degree: usize) -> Vec<NarxTerm> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    let mut last: Vec<Vec<usize>> = vec![Vec::new()];
    for _ in 0..degree {
        let longer = |m: &Vec<usize>| {
            let m = m.clone();
            (m.last().copied().unwrap_or(0)..variables).map(move |i| [&m[..], &[i]].concat())
        };
        last = last.iter().flat_map(longer).collect();
        all.extend(last.iter().cloned());
    }
    let term = |factors| NarxTerm {
        factors,
        coefficient: 0.0,
    };
    all.into_iter().map(term).collect()
}

/// A model's monomials of measured outputs and inputs.
fn columns_of(model: &NarxModel, u: &[f64], y: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::with_capacity(y.len()); model.terms.len()];
    let mut lagged = vec![0.0; model.outputs + model.inputs];
    for n in 0..y.len() {
        model.fill(&mut lagged, y, u, n);
        for (column, term) in columns.iter_mut().zip(&model.terms) {
            column.push(term.value(&lagged));
        }
    }
    columns
}

/// The first sample for which all lags of a model exist.
fn first_sample(model: &NarxModel) -> usize {
    model.outputs.max(model.inputs + model.delay)
}

/// The model with the coefficients of this penalty.
fn with_penalty(blank: &NarxModel, ridge: &Ridge, penalty: f64) -> NarxModel {
    let Affine { constant, coefficients } = ridge.solve(penalty);
    let mut model = NarxModel {
        constant,
        ..blank.clone()
    };
    let terms = model.terms.iter_mut().zip(coefficients);
    terms.for_each(|(term, c)| term.coefficient = c);
    model
}

/// A fitted model, and its error.
struct Fit {
    tried: NarxCandidate,
    model: NarxModel,
}

/// The best model of a structure, estimated on the first samples and chosen on the others.
fn fit(blank: &NarxModel, degree: usize, u: &[f64], y: &[f64], estimated: usize) -> Option<Fit> {
    let from = first_sample(blank);
    if estimated < from + 2 * blank.terms.len() {
        return None;
    }
    let columns = columns_of(blank, &u[..estimated], &y[..estimated]);
    let ridge = Ridge::new(&columns, &y[..estimated], from)?;
    let of = |penalty: f64| {
        let model = with_penalty(blank, &ridge, penalty);
        let run = model.run(u);
        let errors = run.output.iter().zip(y).skip(estimated).map(|(p, y)| (p - y).powi(2));
        let tried = NarxCandidate {
            outputs: blank.outputs,
            inputs: blank.inputs,
            degree,
            penalty: penalty / (estimated - from) as f64,
            relative_error: (errors.sum::<f64>() / (y.len() - estimated) as f64).sqrt(),
            bounded: run.bounded,
        };
        Fit { tried, model }
    };
    let all = ridge.chosen().into_iter().take(LARGER_PENALTIES).map(of);
    all.min_by(|a, b| a.tried.relative_error.total_cmp(&b.tried.relative_error))
}

/// The same structure and penalty on all samples.
fn refit(model: &NarxModel, tried: &NarxCandidate, u: &[f64], y: &[f64]) -> Option<NarxModel> {
    let from = first_sample(model);
    let ridge = Ridge::new(&columns_of(model, u, y), y, from)?;
    Some(with_penalty(model, &ridge, tried.penalty * (y.len() - from) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_all_products_once() {
        let all = monomials(3, 3);
        // (3 + 3 choose 3) minus the constant.
        assert_eq!(all.len(), 19);
        let mut sorted: Vec<&[usize]> = all.iter().map(|t| &t.factors[..]).collect();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), 19);
        assert!(sorted.iter().all(|m| m.windows(2).all(|w| w[0] <= w[1])));
    }
}
