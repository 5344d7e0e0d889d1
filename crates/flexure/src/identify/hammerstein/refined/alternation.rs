//! From a start to the minimum: linear part, noise, breakpoints and all coefficients in turn.
//!
//! The breakpoints are chosen on the memory-removed output z (Hasiewicz & Mzyk 2009, whitened), then both blocks move together:
//! $$ z_n = \varphi(u_n) + \frac{(\tilde G^* \tilde e)_n}{D \sum_j \tilde k_j^2}, \quad
//!    D = 1 + 2 \sum_{j > 0} c_j r_j. $$
//! Here e is the output error of the present model, R(z) the autoregression that whitens it, and $\tilde e = R e$. The linear part seen
//! through the whitening is $\tilde G = R B / A$ with the impulse response $\tilde k$; $\tilde G^*$ is its adjoint, the same filter in
//! reversed time. The sample u_n reaches the whitened output at n, n + 1, ... with the weights $\tilde k_0, \tilde k_1, ...$ So the
//! fraction is the least-squares estimate, from all these samples, of the difference between phi(u_n) and the model. z is thus the data of
//! a regression with known linear part: the value of phi plus noise that does not depend on the input.
//!
//! D is 1 for a white input. If the input is coloured, or held for several samples, the samples around u_n have nearly its value, and an
//! error of phi there acts through all of them: c are the autocorrelations of the input, r those of $\tilde k$. With D = 1, the values of a
//! dead zone under an input held for 7 samples would be so wrong that 20 jumps are found instead of two kinks.

use super::super::options::RefinedHammerstein;
use super::super::realisation::ChosenOrder;
use super::basis::select;
use super::blocks::{Blocks, Observed};
use super::cells::Cells;
use super::descent::{Descended, descend};
use super::filtered::select_filtered;
use super::limits::{
    CHANGES, DEPENDENT_NOISE, LAST_STEPS, LONGEST_RESPONSE, PASSES, SEEN_CORRELATION, SETTLED_RESPONSE,
    SHORTEST_MEMORY, STEPS, UNCHANGED_NOISE, UNCHANGED_PLACE,
};
use super::linear_part::LinearPart;
use super::loss::Equations;
use super::piecewise::Term;
use super::stepwise::Costs;
use crate::interrupt;
use crate::linear::TransferFunction;
use crate::linear::autoregression::{SAMPLES_PER_COEFFICIENT, whitening};
use crate::linear::correlation::cross_covariance;
use crate::sort;
use crate::vectors::dot;

/// The lags after which the response has settled.
pub(super) fn memory(linear: &TransferFunction) -> usize {
    linear.settling(SETTLED_RESPONSE).max(SHORTEST_MEMORY)
}

/// The minimum of the prediction error.
#[derive(Clone)]
pub(super) struct Minimum {
    pub blocks: Blocks,
    /// The equations there.
    pub equations: Equations,
    pub whitening: Vec<f64>,
    pub terms: Vec<Term>,
    /// `None` if it could not be chosen in any pass.
    pub order: Option<ChosenOrder>,
    /// The memory-removed output's means over the cells, and the variance of a sample of it.
    pub values: Vec<f64>,
    pub variance: f64,
    /// D.
    pub dependence: f64,
    /// The memory that decided which samples counted. With a longer one fewer would count, and the information of early samples would be
    /// lost.
    pub memory: usize,
}

/// Noisy values of the nonlinearity at the samples.
struct NoisyValues {
    values: Vec<f64>,
    /// The variance of their noise, as if it were independent between samples.
    variance: f64,
    /// D.
    dependence: f64,
}

/// The autocorrelations of the input from lag 1 on; zero if chance explains them.
pub(super) fn input_correlations(u: &[f64]) -> Vec<f64> {
    let covariance = cross_covariance(u, u, LONGEST_RESPONSE.min(u.len() / 5));
    let limit = SEEN_CORRELATION / (u.len() as f64).sqrt();
    let seen = |c: &f64| {
        if (c / covariance[0]).abs() > limit {
            c / covariance[0]
        } else {
            0.0
        }
    };
    covariance[1..].iter().map(seen).collect()
}

/// D, at least 1.
fn dependence(input: &[f64], response: &[f64], energy: f64) -> f64 {
    let correlation = |lag: usize| -> f64 {
        let later = response.get(lag..).unwrap_or_default();
        dot(later, response) / energy
    };
    let seen = input.iter().enumerate().filter(|(_, c)| **c != 0.0);
    let sum: f64 = seen.map(|(i, c)| c * correlation(i + 1)).sum();
    (1.0 + 2.0 * sum).max(1.0)
}

impl Minimum {
    /// The number of parameters of both blocks.
    pub fn parameters(&self) -> usize {
        let linear = &self.blocks.linear;
        self.terms.len() + linear.b().len() + linear.a().len()
    }

    /// Schwarz's criterion of the whitened error. The places of breakpoints and the whitening also count as parameters.
    pub fn criterion(&self) -> f64 {
        let places = self.terms.iter().filter(|term| term.is_breakpoint()).count();
        let parameters = self.equations.parameters() + places + self.whitening.len();
        self.equations.schwarz(parameters)
    }

    /// The standard deviation of the whitened error.
    pub fn noise(&self) -> f64 {
        self.equations.noise()
    }
}

/// The state of the alternation.
pub(super) struct Alternation<'a> {
    pub cells: &'a Cells,
    pub method: &'a RefinedHammerstein,
    /// The autocorrelations from [`input_correlations`].
    pub input: &'a [f64],
    /// The nonlinearity at the samples minus its mean.
    pub w: Vec<f64>,
    pub linear: LinearPart,
    /// Whether the linear part's order and delay are kept.
    pub keeps_orders: bool,
    /// Whether [`select_filtered`] chooses the basis if the noise of the memory-removed output is correlated.
    pub filtered: bool,
    /// The lags after which the response has settled.
    pub memory: usize,
    pub offset: f64,
    pub terms: Vec<Term>,
    pub order: Option<ChosenOrder>,
}

impl<'a> Alternation<'a> {
    /// The alternation from a linear part and a signal between the blocks, whose mean is subtracted.
    pub fn new(
        cells: &'a Cells,
        method: &'a RefinedHammerstein,
        input: &'a [f64],
        w: Vec<f64>,
        linear: LinearPart,
    ) -> Alternation<'a> {
        Alternation {
            memory: memory(&linear.transfer),
            cells,
            method,
            input,
            w,
            linear,
            keeps_orders: false,
            filtered: false,
            offset: 0.0,
            terms: Vec::new(),
            order: None,
        }
    }

    /// Runs passes until nothing changes, and again after each change of the linear part. `None` if the result is degenerate: a
    /// nonlinearity without variation.
    pub fn minimum(mut self, observed: &mut Observed) -> Option<Minimum> {
        let mut blocks = self.passes(observed)?;
        for _ in interrupt::rounds(CHANGES) {
            let whitening = self.whitening(&blocks.errors(observed));
            let Some(linear) = self.changed(&blocks, observed, &whitening) else {
                break;
            };
            (self.linear, self.keeps_orders) = (linear, true);
            let Some(next) = self.passes(observed) else { break };
            blocks = next;
        }
        let whitening = self.whitening(&blocks.errors(observed));
        let Descended { blocks, equations } = descend(blocks, observed, &whitening, LAST_STEPS);
        (self.w, self.linear) = (blocks.signal(observed.u), blocks.linear.clone());
        let NoisyValues {
            values,
            variance,
            dependence,
        } = self.memory_removed(observed, &whitening, &blocks.errors(observed))?;
        Some(Minimum {
            order: self.order.map(|order| ChosenOrder {
                order: blocks.linear.a().len(),
                ..order
            }),
            blocks,
            equations,
            whitening,
            terms: self.terms,
            values: self.cells.means(&values),
            variance,
            dependence,
            memory: observed.memory,
        })
    }

    /// Runs passes until nothing changes.
    fn passes(&mut self, observed: &mut Observed) -> Option<Blocks> {
        let mut best: Option<Descended> = None;
        for _ in interrupt::rounds(PASSES) {
            let terms = self.terms.clone();
            let Some(now) = self.pass(observed) else {
                break;
            };
            let noise = |e: &Equations| (e.normal.cost / e.count.max(1) as f64).sqrt();
            let settled = best.as_ref().is_some_and(|best| {
                let (before, after) = (noise(&best.equations), noise(&now.equations));
                before - after <= UNCHANGED_NOISE * before && same_places(&terms, &self.terms)
            });
            best = Some(now);
            if settled {
                break;
            }
        }
        best.map(|best| best.blocks)
    }

    /// Linear part, noise, breakpoints, then a few steps of all parameters together; `None` if the data show no nonlinearity or no linear
    /// part.
    pub fn pass(&mut self, observed: &mut Observed) -> Option<Descended> {
        let simulated = self.linear.filter(&observed.experiments, &self.w);
        observed.complete(&simulated, self.offset);
        let whitening = self.whitening(&observed.errors(&simulated, self.offset));
        let chosen = match self.keeps_orders {
            true => None,
            false => (self.method).choose_linear_part(observed, &self.w, &whitening, self.linear.delay, self.memory),
        };
        if let Some(chosen) = &chosen {
            self.linear = chosen.linear.clone();
        }
        let errors = observed.errors(&self.linear.filter(&observed.experiments, &self.w), self.offset);
        let whitening = self.whitening(&errors);
        let noisy = self.memory_removed(observed, &whitening, &errors)?;
        let filtered = (self.filtered && noisy.dependence > DEPENDENT_NOISE).then(|| {
            let combined = self.linear.then(&whitening);
            select_filtered(self.cells, observed, &combined, &whitening)
        });
        let searched = || {
            select(
                self.cells,
                observed.u,
                &noisy.values,
                &self.terms,
                &Costs {
                    // Among dependent samples, a single one can look like a jump: so a breakpoint is penalised as with independent samples.
                    variance: noisy.dependence * noisy.variance,
                    smooth: false,
                },
            )
        };
        let selection = filtered.flatten().unwrap_or_else(searched);
        if selection.terms.len() < 2 {
            return None;
        }
        let blocks = selection.blocks(&self.linear, self.offset);
        let descended = descend(blocks, observed, &whitening, STEPS);
        let blocks = &descended.blocks;
        self.w = blocks.signal(observed.u);
        self.linear = blocks.linear.clone();
        self.memory = memory(&self.linear.transfer);
        self.offset = blocks.offset;
        self.terms = selection.terms;
        self.order = chosen.map(|chosen| chosen.order).or(self.order.take());
        Some(descended)
    }

    /// The minimum with the memory-removed output of its own blocks, which were changed after the alternation.
    pub fn renewed(self, minimum: Minimum, observed: &Observed) -> Minimum {
        let of_minimum = Alternation {
            w: minimum.blocks.signal(observed.u),
            linear: minimum.blocks.linear.clone(),
            ..self
        };
        let errors = minimum.blocks.errors(observed);
        match of_minimum.memory_removed(observed, &minimum.whitening, &errors) {
            None => minimum,
            Some(noisy) => Minimum {
                values: of_minimum.cells.means(&noisy.values),
                variance: noisy.variance,
                dependence: noisy.dependence,
                ..minimum
            },
        }
    }

    /// The polynomial that whitens the errors; 1 if they are not to be whitened. The error of a missing sample counts as zero.
    fn whitening(&self, errors: &[f64]) -> Vec<f64> {
        match self.method.noise_model {
            true => whitening(errors, SAMPLES_PER_COEFFICIENT),
            false => vec![1.0],
        }
    }

    /// The noisy values z of the nonlinearity.
    fn memory_removed(&self, observed: &Observed, whitening: &[f64], errors: &[f64]) -> Option<NoisyValues> {
        let mut white = LinearPart::moving_average(whitening).filter(&observed.experiments, errors);
        let mut count = 0.0;
        for (e, counts) in white.iter_mut().zip(&observed.counts) {
            if *counts {
                count += 1.0;
            } else {
                *e = 0.0;
            }
        }
        let power = white.iter().map(|e| e * e).sum::<f64>() / f64::max(count, 1.0);
        let combined = self.linear.then(whitening);
        let length = LONGEST_RESPONSE.min(observed.u.len());
        let response = combined.transfer.impulse_response(length);
        let energy: f64 = response.iter().map(|k| k * k).sum();
        if !(energy > 0.0 && energy.is_finite()) {
            return None;
        }
        let back = combined.filter_back(&observed.experiments, &white);
        let dependence = dependence(self.input, &response, energy);
        let weight = 1.0 / (dependence * energy);
        Some(NoisyValues {
            values: self.w.iter().zip(&back).map(|(w, g)| w + weight * g).collect(),
            variance: weight * power,
            dependence,
        })
    }
}

/// Whether two choices have the same breakpoints except for small moves.
fn same_places(a: &[Term], b: &[Term]) -> bool {
    let sorted = |terms: &[Term]| {
        let key = |t: &Term| match *t {
            Term::Power(k) => (-2.0, k),
            Term::TruncatedPower { at, degree } => (at, degree),
        };
        let mut keys: Vec<(f64, u8)> = terms.iter().map(key).collect();
        sort::by_key(&mut keys, |k| f64::from(k.1));
        sort::by_key(&mut keys, |k| k.0);
        keys
    };
    let near = |(p, q): (&(f64, u8), &(f64, u8))| p.1 == q.1 && (p.0 - q.0).abs() < UNCHANGED_PLACE;
    a.len() == b.len() && sorted(a).iter().zip(&sorted(b)).all(near)
}
