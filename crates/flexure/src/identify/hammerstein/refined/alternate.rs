//! From a start to the minimum: linear part, noise, breakpoints and all coefficients in turn.
//!
//! With the other samples' share taken out of the output and the rest matched to the impulse response,
//! $$ z_n = \varphi(u_n) + \frac{(\tilde G^* \tilde e)_n}{\sum_j \tilde k_j^2} $$
//! is the nonlinearity's value plus noise that depends on neither: what a regression that knows the linear part
//! would see (the memory-removed output of Hasiewicz & Mzyk 2009, whitened). The breakpoints are chosen on z,
//! then both blocks move together.

use super::cells::Cells;
use super::descent::descend;
use super::dynamics::{Chosen, Request, choose};
use super::loss::{Data, Dynamics, Model, Normal, filter, filter_back, product, residual};
use super::pieces::Term;
use super::select::select;
use super::stepwise::Costs;
use crate::interrupt;
use crate::linear::TransferFunction;
use crate::linear::autoregression::whitening;

/// Samples for each coefficient of the noise model.
const SAMPLES_A_COEFFICIENT: usize = 50;
/// Most passes.
const PASSES: usize = 6;
/// Gauss-Newton steps of a pass, and of the last.
const STEPS: usize = 3;
/// Steps at the end.
const LAST_STEPS: usize = 20;
/// A pass that lowers the noise's deviation by no more than this share is the last.
const SETTLED: f64 = 2e-4;
/// Most samples of the whitened impulse response, for its energy.
const LONGEST_RESPONSE: usize = 2000;

/// What a function with a searched breakpoint must gain, in noise variances: about 2 ln of the number of candidates
/// (Foster & George 1994).
const COST: f64 = 20.0;
/// Its share of the estimated risk: with the search it counts as about four parameters (Friedman 1991).
const ADAPTED: f64 = 10.0;
/// That of a function with a given breakpoint; two would be C_p.
const FIXED: f64 = 2.5;
/// By how much given breakpoints must be better.
const MARGIN: f64 = 4.0;
/// The fewest samples either side of a jump.
const FEWEST_AT_JUMP: f64 = 5.0;

/// Where the alternation begins, and what is given.
pub(super) struct Start {
    /// The nonlinearity at the samples, less its mean.
    pub w: Vec<f64>,
    pub dynamics: Dynamics,
    pub order: Option<usize>,
    pub delay: Option<usize>,
    /// Lags after which the response has settled.
    pub memory: usize,
    /// Whether the errors may be whitened.
    pub whiten: bool,
}

impl Minimum {
    /// The number of parameters of both blocks.
    pub fn parameters(&self) -> usize {
        let dynamics = &self.model.dynamics;
        self.terms.len() + dynamics.b.len() + dynamics.a.len() - 1
    }
}

/// The minimum.
pub(super) struct Minimum {
    pub model: Model,
    /// The equations there.
    pub normal: Normal,
    pub whitening: Vec<f64>,
    pub terms: Vec<Term>,
    pub chosen: Option<Chosen>,
    /// The memory-removed output's means over the cells, and the variance of a sample of it.
    pub values: Vec<f64>,
    pub variance: f64,
}

impl Minimum {
    /// The standard deviation of the whitened error.
    pub fn noise(&self) -> f64 {
        let free = self.normal.count.saturating_sub(self.normal.gradient.len()).max(1);
        (self.normal.squares / free as f64).sqrt()
    }
}

/// Alternates until nothing changes. `None` where the numbers degenerate: a nonlinearity without variation.
pub(super) fn alternate(data: &mut Data, cells: &Cells, start: Start) -> Option<Minimum> {
    let Start {
        mut w,
        mut dynamics,
        order,
        delay,
        mut memory,
        whiten,
    } = start;
    let whitened = |e: &[f64]| {
        if whiten {
            whitening(e, SAMPLES_A_COEFFICIENT)
        } else {
            vec![1.0]
        }
    };
    let mut offset = 0.0;
    let mut best: Option<Minimum> = None;
    let mut terms: Vec<Term> = Vec::new();
    let mut chosen = None;
    for _ in 0..PASSES {
        if interrupt::requested() {
            return best;
        }
        let simulated = filter(&dynamics, &data.parts, &w);
        data.complete(&simulated, offset);
        let r = whitened(&residual(data, &simulated, offset));
        let request = Request {
            order,
            delay,
            supposed_delay: dynamics.delay,
            memory,
        };
        if let Some(c) = choose(data, &w, &r, request) {
            dynamics = c.dynamics.clone();
            chosen = Some(c);
        }
        let e = residual(data, &filter(&dynamics, &data.parts, &w), offset);
        let r = whitened(&e);
        let (z, variance) = memory_removed(data, &dynamics, &r, &w, &e)?;
        let costs = Costs {
            of: [COST * variance; 3],
            power: COST * variance,
            adapted: ADAPTED * variance,
            fixed: FIXED * variance,
            margin: MARGIN * variance,
            fewest: FEWEST_AT_JUMP,
        };
        let selection = select(cells, data.u, &z, &terms, &costs);
        if selection.terms.len() < 2 {
            return best;
        }
        let model = Model {
            basis: selection.basis,
            c: selection.coefficients[1..].to_vec(),
            dynamics: dynamics.clone(),
            offset,
        };
        let (model, normal) = descend(model, data, &r, STEPS);
        w = model.signal(data.u);
        dynamics = model.dynamics.clone();
        offset = model.offset;
        let response = TransferFunction::new(dynamics.b.clone(), dynamics.a.clone()).ok()?;
        memory = response.settling(0.01).max(10);
        let noise = |m: &Minimum| (m.normal.squares / m.normal.count.max(1) as f64).sqrt();
        let now = Minimum {
            model,
            normal,
            whitening: r,
            terms: selection.terms.clone(),
            chosen: None,
            values: Vec::new(),
            variance: 0.0,
        };
        let settled = best.as_ref().is_some_and(|b| {
            let (before, after) = (noise(b), noise(&now));
            before - after <= SETTLED * before && same_places(&terms, &selection.terms)
        });
        terms = selection.terms;
        best = Some(now);
        if settled {
            break;
        }
    }
    let last = best?;
    let r = whitened(&last.model.errors(data));
    let (model, normal) = descend(last.model, data, &r, LAST_STEPS);
    let (w, e) = (model.signal(data.u), model.errors(data));
    let (z, variance) = memory_removed(data, &model.dynamics, &r, &w, &e)?;
    Some(Minimum {
        model,
        normal,
        whitening: r,
        chosen,
        values: cells.means(&z),
        variance,
        ..last
    })
}

/// Whether two choices have the same breakpoints but for small moves.
fn same_places(a: &[Term], b: &[Term]) -> bool {
    let mut order = [a.to_vec(), b.to_vec()];
    let key = |t: &Term| match t {
        Term::Power(k) => (-2.0, *k),
        Term::From { at, degree } => (*at, *degree),
    };
    for terms in &mut order {
        terms.sort_by(|p, q| key(p).0.total_cmp(&key(q).0).then(key(p).1.cmp(&key(q).1)));
    }
    a.len() == b.len()
        && order[0]
            .iter()
            .zip(&order[1])
            .all(|(p, q)| key(p).1 == key(q).1 && (key(p).0 - key(q).0).abs() < NEAR)
}

/// Breakpoints no farther apart are the same, in the unit coordinate.
const NEAR: f64 = 0.02;

/// The noisy values z of the nonlinearity, and their noise's variance.
fn memory_removed(data: &Data, g: &Dynamics, whitening: &[f64], w: &[f64], e: &[f64]) -> Option<(Vec<f64>, f64)> {
    let mut white = filter(&Dynamics::moving_average(whitening), &data.parts, e);
    let mut count = 0.0;
    for (e, counts) in white.iter_mut().zip(&data.counts) {
        if *counts {
            count += 1.0;
        } else {
            *e = 0.0;
        }
    }
    let power = white.iter().map(|e| e * e).sum::<f64>() / f64::max(count, 1.0);
    let combined = Dynamics {
        b: product(&g.b, whitening),
        a: g.a.clone(),
        delay: g.delay,
    };
    let response = TransferFunction::new(combined.b.clone(), combined.a.clone()).ok()?;
    let length = LONGEST_RESPONSE.min(data.u.len());
    let energy: f64 = response.impulse_response(length).iter().map(|k| k * k).sum();
    if !(energy > 0.0 && energy.is_finite()) {
        return None;
    }
    let back = filter_back(&combined, &data.parts, &white);
    let z = w.iter().zip(&back).map(|(w, g)| w + g / energy).collect();
    Some((z, power / energy))
}
