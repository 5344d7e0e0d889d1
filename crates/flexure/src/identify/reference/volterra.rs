//! The Volterra series of second order, regularised.
//!
//! $$ Y_n = h_0 + \sum_i h_1(i) U_{n-s-i} + \sum_{i,j} h_2(i, j) U_{n-s-i} U_{n-s-j} + e_n $$
//! with far more coefficients than the record can determine. A Gaussian prior makes them smooth and decaying (Pillonetto & De Nicolao 2010;
//! Birpoutsoukis, Marconato, Lataire & Schoukens 2017): the tuned-correlated (TC) kernel $c\,\lambda^{\max(i, k)}$ for $h_1$, and its
//! product over both lags for $h_2$. The sizes $c$ and decays $\lambda$ of both, and the noise, maximise the marginal likelihood.
//!
//! TC is a sum of independent steps: $h_1(i) = \sum_{k \ge i} w_k$ with variances $c (\lambda^k - \lambda^{k+1})$. In running sums
//! of the input the prior is diagonal, and the marginal likelihood needs one factorisation of the normal equations.

use super::super::block::{Scale, Signals, delays};
use super::limits::{
    CONSTANT_DEVIATION, FIRST_MEMORIES, FIRST_STEPS, LARGEST_LOGARITHMS, LAST_STEP, LEAST_GAIN, LEAST_SQUARES,
    MOST_ROUNDS, SECOND_MEMORIES, VOLTERRA_SAMPLES,
};
use crate::error::Result;
use crate::identify::request::{Progress, Request, Structure};
use crate::identify::result::{BlockKind, Detail, Identification, NamedBlock, Place, StructureName, Values};
use crate::identify::run::{Run, path};
use crate::interrupt;
use crate::linalg::{self, WithDeterminant};
use crate::linear::least_squares::{NormalEquations, regression};
use crate::model::{Block, VolterraModel};
use crate::text::number;
use crate::vectors::dot;

/// Where the search starts.
const START: [DecayPrior; 2] = [
    DecayPrior { size: 1.0, decay: 0.9 },
    DecayPrior { size: 0.1, decay: 0.7 },
];

/// Size and decay of a tuned-correlated prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayPrior {
    /// c, relative to the noise's variance, for inputs and outputs of unit variance.
    pub size: f64,
    /// $\lambda$, between 0 and 1.
    pub decay: f64,
}

/// The identification of a second-order Volterra series.
///
/// ```
/// use flexure::identify::VOLTERRA;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..2000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let y: Vec<f64> = (0..2000).map(|n| if n < 2 { 0.0 } else { u[n] + 0.5 * u[n - 1] * u[n - 2] }).collect();
/// let result = VOLTERRA.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.verdict.measures.fit_percent > 99.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "volterra",
        title: "second-order Volterra",
    },
    description: "a regularised Volterra series of second order: a reference without blocks",
    inputs: 1..=1,
    options: &[],
    rank: None,
    identify,
};

fn identify(request: &Request<'_>, _: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a Volterra fit (besides the fresh part)")?;
    let prepared = samples.prepared();
    let delay = delays(&prepared.data).first().copied().unwrap_or(0);
    let best = search(&prepared.data, delay);
    let (u, y) = (prepared.inputs[0], prepared.output);
    let model = match &best {
        Some(best) => best.model(delay, u, y),
        None => VolterraModel {
            delay,
            input_level: u.mean,
            constant: y.mean,
            first: Vec::new(),
            second: Vec::new(),
            second_memory: 0,
        },
    };
    let priors = best.as_ref().map_or(START, |b| b.priors);
    let noise = y.spread * best.as_ref().map_or(1.0, |b| b.evidence.variance.sqrt());
    let details = details(&model, &priors, noise);
    let block = NamedBlock::new("volterra", "Kernels", BlockKind::Volterra(model.clone()));
    let run = Run::new(&samples, Block::Volterra(model), vec![path(request, vec![block])], None)?;
    Ok(Identification {
        method: "marginal-likelihood".into(),
        delay,
        details,
        ..run.identification(&ROW, request)?
    })
}

/// The kernels' lengths and priors, and the noise.
fn details(model: &VolterraModel, priors: &[DecayPrior; 2], noise: f64) -> Vec<Detail> {
    let values = priors.map(|p| Values::new([("size", p.size.into()), ("decay", p.decay.into())]));
    let [first, second] = priors.map(|p| format!("size {}, decay {} a sample", number(p.size), number(p.decay)));
    let why = "largest marginal likelihood of a tuned-correlated prior";
    let lags = format!("{} and {}", model.first.len(), model.second_memory);
    vec![
        Detail::sentence(Place::Fact, "Lags", lags, "of the kernels of first and second order"),
        Detail::new("noise", noise).shown(Place::Fact, "Noise", number(noise), "standard deviation"),
        Detail::sentence(Place::ChoiceAndText, "First-order prior", first, why),
        Detail::sentence(Place::ChoiceAndText, "Second-order prior", second, why),
        Detail::new("priors", values.to_vec()),
    ]
}

/// Lags of the first and of the second order.
#[derive(Debug, Clone, Copy)]
struct Memory {
    first: usize,
    second: usize,
}

impl Memory {
    /// The pairs k <= l of the second order.
    fn pairs(self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.second).flat_map(move |k| (k..self.second).map(move |l| (k, l)))
    }

    fn coefficients(self) -> usize {
        1 + self.first + self.second * (self.second + 1) / 2
    }
}

/// The most likely priors for a memory.
struct Fit {
    memory: Memory,
    priors: [DecayPrior; 2],
    evidence: Evidence,
}

/// The likelihood of priors, and the results with them.
struct Evidence {
    /// Minus twice the logarithm of the marginal likelihood, up to a constant.
    deviance: f64,
    /// The variance of the noise.
    variance: f64,
    /// The coefficients of the constant, the running sums and their products.
    coefficients: Vec<f64>,
}

/// Tries memories one after the other while the likelihood rises.
fn search(data: &Signals, delay: usize) -> Option<Fit> {
    let first = data.y.len().saturating_sub(VOLTERRA_SAMPLES);
    let (u, y) = (&data.u[0][first..], &data.y[first..]);
    let longest = FIRST_MEMORIES[FIRST_MEMORIES.len() - 1];
    let from = (delay + longest).min(u.len() / 2);
    let mut best: Option<Fit> = None;
    // Whether a memory is likelier than the best one so far; it then replaces that.
    let mut improves = |memory: Memory| {
        if delay + memory.first.max(memory.second) > from || interrupt::requested() {
            return false;
        }
        let equations = regression(y, &running_sums(memory, u, delay), from);
        let start = best.as_ref().map_or(START, |b| b.priors);
        let fit = most_likely(memory, start, &equations, (u.len() - from) as f64);
        let better = fit.filter(|fit| {
            best.as_ref()
                .is_none_or(|b| fit.evidence.deviance < b.evidence.deviance)
        });
        let found = better.is_some();
        best = better.or(best.take());
        found
    };
    let second = SECOND_MEMORIES[0];
    let improved = FIRST_MEMORIES
        .into_iter()
        .take_while(|first| improves(Memory { first: *first, second }));
    let first = improved.last()?;
    let _ = SECOND_MEMORIES[1..]
        .iter()
        .all(|second| improves(Memory { first, second: *second }));
    best
}

/// A constant, the running sums of past inputs, and their products.
fn running_sums(memory: Memory, u: &[f64], delay: usize) -> Vec<Vec<f64>> {
    let at = |n: usize, lag: usize| n.checked_sub(delay + lag).map_or(0.0, |k| u[k]);
    let mut sums: Vec<Vec<f64>> = Vec::new();
    for lag in 0..memory.first.max(memory.second) {
        let last = sums.last();
        sums.push((0..u.len()).map(|n| at(n, lag) + last.map_or(0.0, |s| s[n])).collect());
    }
    let product = |(k, l): (usize, usize)| sums[k].iter().zip(&sums[l]).map(|(a, b)| a * b).collect();
    let products: Vec<Vec<f64>> = memory.pairs().map(product).collect();
    sums.truncate(memory.first);
    std::iter::once(vec![1.0; u.len()])
        .chain(sums)
        .chain(products)
        .collect()
}

/// The prior variances of the steps w_k of a memory, for c = 1.
fn steps(decay: f64, memory: usize) -> Vec<f64> {
    let power = |k: usize| decay.powi(k as i32);
    let last = memory.saturating_sub(1);
    (0..memory)
        .map(|k| if k == last { power(k) } else { power(k) - power(k + 1) })
        .collect()
}

/// The prior standard deviations of all coefficients except the constant, whose deviation is large.
fn deviations(memory: Memory, priors: [DecayPrior; 2]) -> Vec<f64> {
    let [first, second] = priors;
    let steps_of_second = steps(second.decay, memory.second);
    let linear = steps(first.decay, memory.first)
        .into_iter()
        .map(|v| (first.size * v).sqrt());
    // w_kl and w_lk are the same step twice off the diagonal.
    let weight = |(k, l): (usize, usize)| if k == l { 1.0 } else { 2.0 };
    let quadratic = memory
        .pairs()
        .map(|p| weight(p) * (second.size * steps_of_second[p.0] * steps_of_second[p.1]).sqrt());
    std::iter::once(CONSTANT_DEVIATION)
        .chain(linear)
        .chain(quadratic)
        .collect()
}

/// The evidence for these priors; `None` if the equations have no solution.
fn evidence(memory: Memory, priors: [DecayPrior; 2], equations: &NormalEquations, samples: f64) -> Option<Evidence> {
    let d = deviations(memory, priors);
    let n = d.len();
    let mut matrix: Vec<f64> = (0..n * n).map(|k| equations.normal[k] * d[k / n] * d[k % n]).collect();
    (0..n).for_each(|i| matrix[i * n + i] += 1.0);
    let rhs: Vec<f64> = equations.descent.iter().zip(&d).map(|(b, d)| b * d).collect();
    let WithDeterminant {
        solution: x,
        log_determinant,
    } = linalg::solve_with_determinant(&matrix, &rhs)?;
    let variance = (equations.cost - dot(&x, &rhs)).max(LEAST_SQUARES * equations.cost) / samples;
    let deviance = samples * variance.ln() + log_determinant;
    deviance.is_finite().then(|| Evidence {
        deviance,
        variance,
        coefficients: x.iter().zip(&d).map(|(x, d)| x * d).collect(),
    })
}

/// The priors with the largest marginal likelihood: changes one parameter at a time, with shrinking steps.
fn most_likely(memory: Memory, start: [DecayPrior; 2], equations: &NormalEquations, samples: f64) -> Option<Fit> {
    if samples <= memory.coefficients() as f64 / 2.0 {
        return None;
    }
    let free = |p: [DecayPrior; 2]| p.map(|p| [p.size.ln(), (p.decay / (1.0 - p.decay)).ln()]);
    let priors = |q: [[f64; 2]; 2]| {
        q.map(|[size, decay]| DecayPrior {
            size: size.exp(),
            decay: 1.0 / (1.0 + (-decay).exp()),
        })
    };
    let fit = |q: [[f64; 2]; 2]| {
        Some(Fit {
            memory,
            priors: priors(q),
            evidence: evidence(memory, priors(q), equations, samples)?,
        })
    };
    let mut at = free(start);
    let mut best = fit(at)?;
    let mut share = 1.0;
    for _ in 0..MOST_ROUNDS {
        if interrupt::requested() {
            break;
        }
        let before = best.evidence.deviance;
        for parameter in 0..4 {
            let (order, kind) = (parameter / 2, parameter % 2);
            for sign in [1.0, -1.0] {
                let mut next = at;
                let moved = next[order][kind] + sign * share * FIRST_STEPS[kind];
                next[order][kind] = moved.clamp(-LARGEST_LOGARITHMS[kind], LARGEST_LOGARITHMS[kind]);
                if let Some(trial) = fit(next).filter(|t| t.evidence.deviance < best.evidence.deviance) {
                    (at, best) = (next, trial);
                    break;
                }
            }
        }
        if before - best.evidence.deviance < LEAST_GAIN {
            share *= 0.5;
            if share < LAST_STEP {
                break;
            }
        }
    }
    Some(best)
}

impl Fit {
    /// The kernels from the steps, in the record's units.
    fn model(&self, delay: usize, input: Scale, output: Scale) -> VolterraModel {
        let gains = [output.spread / input.spread, output.spread / input.spread.powi(2)];
        let coefficients = &self.evidence.coefficients;
        let Memory { first, second } = self.memory;
        let (linear, quadratic) = coefficients[1..].split_at(first);
        let mut h1 = linear.to_vec();
        for k in (1..first).rev() {
            h1[k - 1] += h1[k];
        }
        let mut h2 = vec![0.0; second * second];
        for ((k, l), w) in self.memory.pairs().zip(quadratic) {
            let half = if k == l { *w } else { 0.5 * w };
            (h2[k * second + l], h2[l * second + k]) = (half, half);
        }
        for k in (0..second).rev() {
            for l in (0..second).rev() {
                let inside = |k: usize, l: usize| k < second && l < second;
                let at = |k: usize, l: usize| if inside(k, l) { h2[k * second + l] } else { 0.0 };
                h2[k * second + l] += at(k + 1, l) + at(k, l + 1) - at(k + 1, l + 1);
            }
        }
        VolterraModel {
            delay,
            input_level: input.mean,
            constant: output.back(coefficients[0]),
            first: h1.iter().map(|h| gains[0] * h).collect(),
            second: h2.iter().map(|h| gains[1] * h).collect(),
            second_memory: second,
        }
    }
}

#[cfg(test)]
#[path = "volterra_tests.rs"]
mod tests;
