//! Training: starts, Levenberg-Marquardt, the decay by the evidence, and the scores at the optimum.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::super::blocks::{Row, add_products, rows, sum_over};
use super::Decay;
use super::layer::Layer;
use super::sample::{Sample, SampleBlock};
use crate::linalg;
use crate::linear::least_squares::NormalEquations;
use crate::linear::levenberg_marquardt::{Minimum, minimise_squares};
use crate::selection::{ScoredParameter, UNDETERMINED};

/// The starts compete on at most this many points.
const START_POINTS: usize = 2000;
/// Steps of the competition.
const START_STEPS: usize = 40;
/// Steps between two estimates of the decay.
const EPOCH: usize = 10;
/// The least and the most steps on all points. If possible, all steps together use at most a million points.
const STEPS: (usize, usize) = (20, 400);
const PASSED: usize = 1_000_000;
/// The decay before it is estimated by the evidence.
const FIRST_DECAY: f64 = 0.01;
/// The range of the decay by the evidence.
const DECAYS: (f64, f64) = (1e-8, 1e8);
/// A relative change of the decay that ends its estimation.
const SETTLED: f64 = 1e-3;
/// The evidence takes at least this share of the points as degrees of freedom of the residuals.
const FREE: f64 = 1e-3;

/// A trained network.
#[derive(Debug, Clone)]
pub(super) struct Trained {
    pub layer: Layer,
    pub theta: Vec<f64>,
    pub decay: f64,
    /// The inverse of J'J + decay D, row-major, where there is one.
    inverse: Option<Vec<f64>>,
}

/// The derivatives and residuals of a block, and their products' working space.
struct Scratch {
    rows: Vec<Row>,
    weighted: Vec<Row>,
}

impl Scratch {
    fn new(layer: Layer) -> Scratch {
        Scratch {
            rows: rows(layer.parameters() + 1),
            weighted: Vec::new(),
        }
    }
}

/// The penalised sum of squares about `theta`: sum of w (u - value)^2, plus `decay` times the squares of all
/// parameters but the first.
pub(super) fn equations(sample: &Sample, layer: Layer, theta: &[f64], decay: f64) -> NormalEquations {
    let p = layer.parameters();
    let size = (p + 1) * (p + 2) / 2;
    let sums = sum_over(
        sample.len(),
        size,
        || Scratch::new(layer),
        |scratch, range, total| {
            let SampleBlock { z, u, w } = sample.block(&range);
            layer.linearise(theta, &z, &u, &mut scratch.rows);
            add_products(&scratch.rows, &w, &mut scratch.weighted, total);
        },
    );
    let row = |i: usize| i * (i + 1) / 2;
    let mut normal = vec![0.0; p * p];
    for i in 0..p {
        for j in 0..=i {
            normal[i * p + j] = sums[row(i) + j];
            normal[j * p + i] = sums[row(i) + j];
        }
    }
    let (mut descent, mut cost) = (sums[row(p)..row(p) + p].to_vec(), sums[row(p) + p]);
    for i in 1..p {
        normal[i * p + i] += decay;
        descent[i] -= decay * theta[i];
        cost += decay * theta[i] * theta[i];
    }
    NormalEquations { cost, descent, normal }
}

/// The minimum that the method reaches from `theta`. `None` if its sum of squares is not finite, or if the work is asked to stop.
pub(super) fn descend(sample: &Sample, layer: Layer, theta: Vec<f64>, decay: f64, steps: usize) -> Option<Minimum> {
    minimise_squares(theta, steps, |theta| {
        if sample.interrupt.is_requested() {
            return None;
        }
        let e = equations(sample, layer, theta, decay);
        e.cost.is_finite().then_some(e)
    })
}

/// Units with slopes as in Nguyen and Widrow, each with its middle at a point of the sample, and the best output layer for them.
pub(super) fn start(sample: &Sample, layer: Layer, decay: f64, mut rng: Pcg64) -> Vec<f64> {
    let mut theta = vec![0.0; layer.parameters()];
    let slope = 0.7 * (layer.units as f64).powf(1.0 / layer.inputs as f64);
    for (k, unit) in theta[1..].chunks_exact_mut(layer.inputs + 2).enumerate() {
        // One point from each part: there is one part for each unit, all of equal weight.
        let share = (k as f64 + rng.random_range(0.0..1.0)) / layer.units as f64;
        let z = sample.point(at_share(sample, share));
        let direction: Vec<f64> = if layer.inputs == 1 {
            vec![1.0]
        } else {
            (0..layer.inputs).map(|_| StandardNormal.sample(&mut rng)).collect()
        };
        let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let length = slope * rng.random_range(0.5..1.5) / norm.max(f64::MIN_POSITIVE);
        for j in 0..layer.inputs {
            unit[2 + j] = length * direction[j];
            unit[1] -= unit[2 + j] * z[j];
        }
    }
    // The output layer is linear. With c = 0 so far, one undamped step of this layer finds the optimum.
    let mut e = equations(sample, layer, &theta, decay);
    for p in (0..theta.len()).filter(|&p| !layer.is_output(p)) {
        e.descent[p] = 0.0;
    }
    if let Some(step) = linalg::solve_positive_definite(&e.normal, &e.descent) {
        for (theta, step) in theta.iter_mut().zip(step) {
            *theta += step;
        }
    }
    theta
}

/// The point at which this share of the weight is reached.
fn at_share(sample: &Sample, share: f64) -> usize {
    let mut sum = 0.0;
    let reached = sample.w.iter().position(|w| {
        sum += w;
        sum >= share * sample.total
    });
    reached.unwrap_or(sample.len() - 1)
}

/// Trains from `starts` starts. `None` if the sum of squares is finite for no start.
pub(super) fn train(sample: &Sample, layer: Layer, decay: Decay, starts: usize, seed: u64) -> Option<Trained> {
    let few = sample.thinned(START_POINTS);
    // The same share of the sum of squares.
    let first = match decay {
        Decay::Evidence => FIRST_DECAY,
        Decay::Fixed(decay) => decay * few.total / sample.total,
    };
    let mut best: Option<Minimum> = None;
    for i in 0..starts {
        let stream = (layer.units as u128) << 64 | i as u128;
        let theta = start(&few, layer, first, Pcg64::new(u128::from(seed), stream));
        if let Some(end) = descend(&few, layer, theta, first, START_STEPS)
            && best.as_ref().is_none_or(|b| end.equations.cost < b.equations.cost)
        {
            best = Some(end);
        }
    }
    let theta = best?.parameters;
    let start = |decay| Decayed { theta, decay };
    let Decayed { theta, decay } = match decay {
        Decay::Fixed(decay) => start(decay),
        Decay::Evidence if few.len() < sample.len() => {
            let of_few = by_evidence(&few, layer, start(first))?;
            by_evidence(sample, layer, of_few)?
        }
        Decay::Evidence => by_evidence(sample, layer, start(first))?,
    };
    let end = descend(sample, layer, theta, decay, steps(sample) / 2)?;
    Some(Trained {
        layer,
        inverse: linalg::inverse_positive_definite(&end.equations.normal, layer.parameters()),
        theta: end.parameters,
        decay,
    })
}

/// The number of steps that the size of the sample allows. Half are for the decay, half for the last descent.
fn steps(sample: &Sample) -> usize {
    (PASSED / sample.len()).clamp(STEPS.0, STEPS.1)
}

/// The parameters and their decay.
struct Decayed {
    theta: Vec<f64>,
    decay: f64,
}

/// The parameters and the decay to which MacKay's (1992) re-estimation converges.
///
/// The decay is (gamma / W) / ((n - gamma - 1) / S). S is the residual sum of squares, W the sum of squares of the decayed parameters, and
/// gamma their effective number.
fn by_evidence(sample: &Sample, layer: Layer, start: Decayed) -> Option<Decayed> {
    let Decayed { mut theta, mut decay } = start;
    let p = layer.parameters();
    for _ in 0..(steps(sample) / 2).div_ceil(EPOCH) {
        let end = descend(sample, layer, theta, decay, EPOCH)?;
        theta = end.parameters;
        let Some(inverse) = linalg::inverse_positive_definite(&end.equations.normal, p) else {
            break;
        };
        let size: f64 = theta[1..].iter().map(|t| t * t).sum();
        let residual = end.equations.cost - decay * size;
        let effective = (1..p).map(|i| 1.0 - decay * inverse[i * p + i]).sum::<f64>().max(0.0);
        let free = (sample.total - effective - 1.0).max(FREE * sample.total);
        let next = (effective / size * residual / free).clamp(DECAYS.0, DECAYS.1);
        if !next.is_finite() {
            break;
        }
        let settled = (next - decay).abs() <= SETTLED * decay;
        decay = next;
        if settled {
            break;
        }
    }
    Some(Decayed { theta, decay })
}

impl Trained {
    /// The trace of the hat matrix of the linearised network.
    pub fn degrees_of_freedom(&self) -> f64 {
        let p = self.layer.parameters();
        match &self.inverse {
            Some(inverse) => p as f64 - (1..p).map(|i| self.decay * inverse[i * p + i]).sum::<f64>(),
            None => p as f64,
        }
    }

    /// Both scores, exact for the network linearised at the optimum. They are in the squared unit of y, whose scale is `unit`.
    pub fn score(&self, sample: &Sample, unit: f64) -> ScoredParameter<usize> {
        let (layer, p) = (self.layer, self.layer.parameters());
        let Some(inverse) = &self.inverse else {
            let never = f64::INFINITY;
            return ScoredParameter::new(layer.units, p as f64, never, never, sample.total, sample.len());
        };
        let sums = sum_over(
            sample.len(),
            2,
            || Scratch::new(layer),
            |scratch, range, total| {
                let SampleBlock { z, u, w } = sample.block(&range);
                layer.linearise(&self.theta, &z, &u, &mut scratch.rows);
                let (derivatives, residual) = scratch.rows.split_at(p);
                for i in 0..range.len() {
                    let leverage: f64 = (0..p)
                        .map(|a| {
                            let row = &inverse[a * p..(a + 1) * p];
                            let dot: f64 = row.iter().zip(derivatives).map(|(s, d)| s * d[i]).sum();
                            dot * derivatives[a][i]
                        })
                        .sum();
                    let (w, r, rest) = (w[i], residual[0][i], 1.0 - w[i] * leverage);
                    total[0] += w * r * r;
                    total[1] += if rest > UNDETERMINED {
                        w * (r / rest).powi(2)
                    } else {
                        f64::INFINITY
                    };
                }
            },
        );
        let square = unit * unit;
        ScoredParameter::new(
            layer.units,
            self.degrees_of_freedom(),
            sums[1] * square,
            sums[0] * square,
            sample.total,
            sample.len(),
        )
    }
}
