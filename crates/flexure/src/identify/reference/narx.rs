//! Polynomial NARX: the output from past outputs and inputs.
//!
//! $$ Y_n = c_0 + \sum_k c_k\, m_k(Y_{n-1}, \dots, Y_{n-n_a}, U_{n-s}, \dots, U_{n-s-n_b+1}) + e_n $$
//! with all monomials up to a degree (Leontaritis & Billings 1985). The coefficients are ridge regression, its penalty at
//! least that of generalised cross-validation; lags, degree and penalty those with the least free-run error on the last
//! quarter of the fit's samples, among models whose free run stays within bounds there. The one-step equation that is
//! fitted takes all noise for process noise: output noise biases it, which a model of blocks fitted by its simulation error is
//! free of.
//!
//! A polynomial that is fed back can run away. Values that are fed back are held within an output's span beyond what the fit
//! saw on either side, so that every free run is bounded.

use serde::{Deserialize, Serialize};

use super::super::block::{Columns, delays};
use super::ridge::Ridge;
use crate::error::Result;
use crate::identify::request::{Progress, Request, Structure};
use crate::identify::result::{BlockKind, Detail, Identification, NamedBlock, Place, StructureName, Values};
use crate::identify::run::{Run, path};
use crate::interrupt;
use crate::model::Block;
use crate::parallel;

/// Largest number of past outputs, extra past inputs, and degrees that are tried.
const MOST_LAGS: usize = 5;
const MORE_INPUTS: usize = 2;
const LARGEST_DEGREE: usize = 3;
/// Structures with more monomials are not tried.
const MOST_TERMS: usize = 230;
/// At most this many samples, the last ones, are fitted.
const MOST_SAMPLES: usize = 20_000;
/// The largest lag of a model that can be simulated.
pub(super) const LARGEST_LAG: usize = 1_000_000;
/// A free run settles within this many samples, or counts as not settling.
const LONGEST_SETTLING: usize = 1000;
/// The share of the fit's samples that lags, degree and penalty are chosen on.
const CHOICE_SHARE: f64 = 0.25;
/// Penalties above the one of generalised cross-validation that are tried.
const PENALTIES: usize = 4;

/// A monomial and its coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NarxTerm {
    /// The factors, with repetitions: i below the number of past outputs is the output i + 1 samples ago; those from there on
    /// are the input, first that of `delay` samples ago.
    pub factors: Vec<usize>,
    /// The coefficient, for inputs and outputs at zero mean and unit variance.
    pub coefficient: f64,
}

/// A polynomial of past outputs and inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NarxModel {
    /// The number of past outputs.
    pub outputs: usize,
    /// The number of past inputs.
    pub inputs: usize,
    /// The age of the latest input, samples.
    pub delay: usize,
    /// The constant, in the unit of the coefficients.
    pub constant: f64,
    /// The monomials.
    pub terms: Vec<NarxTerm>,
    /// Mean and standard deviation of the input, and of the output.
    pub scales: [(f64, f64); 2],
    /// Outputs that are fed back are held between these, at zero mean and unit variance.
    pub held: (f64, f64),
}

impl NarxModel {
    /// The free-run response to `input`, one value a sample, from rest at the means.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        let [(u_mean, u_spread), (y_mean, y_spread)] = self.scales;
        let u: Vec<f64> = input.iter().map(|u| (u - u_mean) / u_spread).collect();
        self.run(&u).0.iter().map(|y| y_mean + y_spread * y).collect()
    }

    /// Why the model cannot be simulated.
    pub fn problem(&self) -> Option<String> {
        let lags = [self.outputs, self.inputs, self.delay];
        if let Some(lag) = lags.iter().find(|l| **l > LARGEST_LAG) {
            return Some(format!("a lag is {lag}, but must be at most {LARGEST_LAG}"));
        }
        let variables = self.outputs + self.inputs;
        let factor = self.terms.iter().flat_map(|t| &t.factors).find(|i| **i >= variables);
        if let Some(i) = factor {
            return Some(format!(
                "a term has factor {i}, but there are only {variables} variables"
            ));
        }
        let (low, high) = self.held;
        if !(low <= high) {
            return Some(format!(
                "the output is held between {low} and {high}, which are not in order"
            ));
        }
        let spreads = [("input", self.scales[0].1), ("output", self.scales[1].1)];
        let wrong = spreads.iter().find(|s| !(s.1 > 0.0 && s.1.is_finite()));
        wrong.map(|(which, spread)| format!("the {which}'s spread is {spread}, but must be positive and finite"))
    }

    /// The samples, at most 1000, after which free runs that start from both ends of the output that was fitted have come together to
    /// `share` of their distance, under the mean input.
    pub(crate) fn settling(&self, share: f64) -> usize {
        let run = |start: f64| {
            let before = self.outputs.max(1);
            let mut y = vec![start; before];
            let u = vec![0.0; before + LONGEST_SETTLING];
            let mut lagged = vec![0.0; self.outputs + self.inputs];
            for n in before..u.len() {
                self.fill(&mut lagged, &y, &u, n);
                y.push(self.within(self.value(&lagged)));
            }
            y.split_off(before)
        };
        // What is fed back is held within an output's span beyond the fit's on either side.
        let span = (self.held.1 - self.held.0) / 3.0;
        let (low, high) = (run(self.held.0 + span), run(self.held.1 - span));
        let apart = low
            .iter()
            .zip(&high)
            .rposition(|(l, h)| !((h - l).abs() <= share * span));
        self.delay + self.inputs + apart.map_or(0, |n| n + 1)
    }

    /// A fed back value within its bounds.
    fn within(&self, value: f64) -> f64 {
        match value.is_nan() {
            true => 0.0_f64.clamp(self.held.0, self.held.1),
            false => value.clamp(self.held.0, self.held.1),
        }
    }

    /// The free run on scaled signals, and how many samples were held.
    fn run(&self, u: &[f64]) -> (Vec<f64>, usize) {
        let mut y: Vec<f64> = Vec::with_capacity(u.len());
        let (mut lagged, mut held) = (vec![0.0; self.outputs + self.inputs], 0);
        for n in 0..u.len() {
            self.fill(&mut lagged, &y, u, n);
            let value = self.value(&lagged);
            let within = self.within(value);
            held += usize::from(within != value);
            y.push(within);
        }
        (y, held)
    }

    /// The variables of sample `n`; zero before the record.
    fn fill(&self, lagged: &mut [f64], y: &[f64], u: &[f64], n: usize) {
        let (outputs, inputs) = lagged.split_at_mut(self.outputs);
        for (i, v) in outputs.iter_mut().enumerate() {
            *v = n.checked_sub(i + 1).map_or(0.0, |k| y[k]);
        }
        for (i, v) in inputs.iter_mut().enumerate() {
            *v = n.checked_sub(i + self.delay).map_or(0.0, |k| u[k]);
        }
    }

    fn value(&self, lagged: &[f64]) -> f64 {
        let terms = self.terms.iter().map(|t| t.coefficient * product(&t.factors, lagged));
        self.constant + terms.sum::<f64>()
    }
}

fn product(factors: &[usize], lagged: &[f64]) -> f64 {
    factors.iter().map(|i| lagged[*i]).product()
}

/// A structure that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TriedNarx {
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
    complexity: None,
    identify,
};

fn identify(request: &Request<'_>, _: &mut Progress<'_>) -> Result<Identification> {
    let what = "a NARX fit (besides the fresh part)";
    let share = request.options.fresh_share;
    let columns = Columns::new(request.record()?, &[request.input()?], request.output, share, what)?;
    let Searched { model, degree, tried } = searched(&columns)?;
    let predicted = model.simulate(columns.u[0]);
    let (u_mean, u_spread) = model.scales[0];
    let all: Vec<f64> = columns.u[0].iter().map(|u| (u - u_mean) / u_spread).collect();
    let bounded = model.run(&all).1 == 0;
    let (verdict, warnings) = columns.samples().verdict(&predicted, None)?;
    let details = details(&model, degree, bounded, tried.len());
    let (order, delay) = (model.outputs, model.delay);
    let block = NamedBlock::new("narx", "Terms", BlockKind::Narx(model.clone()));
    let run = Run {
        model: Block::Narx(model),
        paths: vec![path(request, vec![block])],
        output_offset: 0.0,
        fitted: columns.fitted,
        predicted,
        verdicts: vec![verdict],
        warnings,
    };
    Ok(Identification {
        method: "ridge",
        order,
        delay,
        tried: tried.iter().map(Values::from).collect(),
        details,
        ..run.identification(&ROW, request)?
    })
}

/// What a reader is told of the polynomial.
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

impl From<&TriedNarx> for Values {
    fn from(t: &TriedNarx) -> Self {
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
    tried: Vec<TriedNarx>,
}

fn searched(columns: &Columns<'_>) -> Result<Searched> {
    let data = columns.signals();
    let delay = delays(&data).first().copied().unwrap_or(0);
    let first = data.y.len().saturating_sub(MOST_SAMPLES);
    let (u, y) = (&data.u[0][first..], &data.y[first..]);
    let (low, high) = y.iter().fold((0.0_f64, 0.0_f64), |(l, h), y| (l.min(*y), h.max(*y)));
    let span = high - low;
    let blank = |outputs, inputs| NarxModel {
        outputs,
        inputs,
        delay,
        constant: 0.0,
        terms: Vec::new(),
        scales: [columns.inputs[0], columns.output].map(|s| (s.mean, s.spread)),
        held: (low - span, high + span),
    };
    let mut structures = Vec::new();
    for (outputs, more, degree) in
        (0..=MOST_LAGS).flat_map(|a| (0..=MORE_INPUTS).flat_map(move |m| (1..=LARGEST_DEGREE).map(move |d| (a, m, d))))
    {
        let inputs = outputs.max(1) + more;
        if monomials(outputs + inputs, degree).len() <= MOST_TERMS {
            structures.push((outputs, inputs, degree));
        }
    }
    let estimated = u.len() - (CHOICE_SHARE * u.len() as f64) as usize;
    let interrupt = interrupt::current();
    let fits = parallel::batch(&structures, |&(outputs, inputs, degree)| {
        if interrupt.is_requested() {
            return None;
        }
        fit(blank(outputs, inputs), degree, u, y, estimated)
    });
    let fits: Vec<(TriedNarx, NarxModel)> = fits.into_iter().flatten().collect();
    interrupt::check()?;
    let score = |t: &TriedNarx| (!t.bounded, t.relative_error);
    let best = fits.iter().min_by(|a, b| {
        let (a, b) = (score(&a.0), score(&b.0));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let (model, degree) = match best {
        Some((tried, model)) => {
            let again = refit(model, tried, u, y);
            let bounded = |m: &NarxModel| m.run(u).1 == 0;
            let kept = again.filter(|m| bounded(m) || !bounded(model));
            (kept.unwrap_or_else(|| model.clone()), tried.degree)
        }
        None => (blank(0, 1), 0),
    };
    Ok(Searched {
        model,
        degree,
        tried: fits.into_iter().map(|f| f.0).collect(),
    })
}

/// All products of up to `degree` of `variables` variables.
fn monomials(variables: usize, degree: usize) -> Vec<Vec<usize>> {
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
    all
}

/// The monomials of measured outputs and inputs.
fn columns_of(model: &NarxModel, factors: &[Vec<usize>], u: &[f64], y: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::with_capacity(y.len()); factors.len()];
    let mut lagged = vec![0.0; model.outputs + model.inputs];
    for n in 0..y.len() {
        model.fill(&mut lagged, y, u, n);
        for (column, factors) in columns.iter_mut().zip(factors) {
            column.push(product(factors, &lagged));
        }
    }
    columns
}

/// The model with these terms.
fn with_terms(blank: &NarxModel, factors: &[Vec<usize>], (constant, c): (f64, Vec<f64>)) -> NarxModel {
    let terms = factors.iter().zip(c).map(|(factors, coefficient)| NarxTerm {
        factors: factors.clone(),
        coefficient,
    });
    NarxModel {
        constant,
        terms: terms.collect(),
        ..blank.clone()
    }
}

/// The best model of a structure, estimated on the first samples and chosen on the others.
fn fit(blank: NarxModel, degree: usize, u: &[f64], y: &[f64], estimated: usize) -> Option<(TriedNarx, NarxModel)> {
    let factors = monomials(blank.outputs + blank.inputs, degree);
    let from = blank.outputs.max(blank.inputs + blank.delay);
    if estimated < from + 2 * factors.len() {
        return None;
    }
    let columns = columns_of(&blank, &factors, &u[..estimated], &y[..estimated]);
    let ridge = Ridge::new(&columns, &y[..estimated], from)?;
    let of = |penalty: f64| {
        let model = with_terms(&blank, &factors, ridge.solve(penalty));
        let (output, held) = model.run(u);
        let errors = output.iter().zip(y).skip(estimated).map(|(p, y)| (p - y).powi(2));
        let tried = TriedNarx {
            outputs: blank.outputs,
            inputs: blank.inputs,
            degree,
            penalty: penalty / (estimated - from) as f64,
            relative_error: (errors.sum::<f64>() / (y.len() - estimated) as f64).sqrt(),
            bounded: held == 0,
        };
        (tried, model)
    };
    let all = ridge.chosen().into_iter().take(PENALTIES).map(of);
    all.min_by(|a, b| a.0.relative_error.total_cmp(&b.0.relative_error))
}

/// The same structure and penalty on all samples.
fn refit(model: &NarxModel, tried: &TriedNarx, u: &[f64], y: &[f64]) -> Option<NarxModel> {
    let factors: Vec<Vec<usize>> = model.terms.iter().map(|t| t.factors.clone()).collect();
    let from = model.outputs.max(model.inputs + model.delay);
    let ridge = Ridge::new(&columns_of(model, &factors, u, y), y, from)?;
    let samples = (y.len() - from) as f64;
    Some(with_terms(model, &factors, ridge.solve(tried.penalty * samples)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_all_products_once() {
        let all = monomials(3, 3);
        // (3 + 3 choose 3) less the constant.
        assert_eq!(all.len(), 19);
        let mut sorted = all.clone();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), 19);
        assert!(all.iter().all(|m| m.windows(2).all(|w| w[0] <= w[1])));
    }
}
