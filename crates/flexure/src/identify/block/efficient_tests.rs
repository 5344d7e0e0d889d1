use std::ops::ControlFlow;

use super::super::limits::StopRule;
use super::super::loss::Loss;
use super::super::rational::Rational;
use super::super::signals::{Signals, convolved, delayed};
use super::super::spline::KinkedSpline;
use super::super::system::{Branch, System};
use super::*;
use crate::linalg;
use crate::signal::gaussian;

fn filtered(b: &[f64], a: &[f64], v: &[f64]) -> Vec<f64> {
    TransferFunction::new(b.to_vec(), a.to_vec()).unwrap().simulate(v)
}

fn slow(seed: u64, n: usize) -> Vec<f64> {
    filtered(&[0.6], &[1.0, -0.8], &gaussian(n + 100, seed)).split_off(100)
}

fn noise(seed: u64, n: usize) -> Vec<f64> {
    let e: Vec<f64> = gaussian(n + 100, seed).iter().map(|e| 0.2 * e).collect();
    filtered(&[1.0, 0.5], &[1.0, -1.1, 0.4], &e).split_off(100)
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn efficient_of(problem: &impl Residuals, at: &[f64]) -> Option<Minimum> {
    efficient(problem, at, &mut Monitor::new(&mut |_: &str| ControlFlow::Continue(())))
}

/// $y_n = \sum_k p_k u_{n-k} + e_n$ with the first `lags` lags known to matter.
struct MovingAverage {
    columns: Vec<Vec<f64>>,
    y: Vec<f64>,
}

impl MovingAverage {
    const FROM: usize = 20;
    const TRUE: [f64; 3] = [0.5, 0.8, -0.3];

    fn new(u: &[f64], e: &[f64], lags: usize) -> MovingAverage {
        let columns: Vec<Vec<f64>> = (0..3).map(|k| delayed(u, k, 1.0)).collect();
        let y = (0..u.len()).map(|n| e[n] + (0..3).map(|k| Self::TRUE[k] * columns[k][n]).sum::<f64>());
        MovingAverage {
            y: y.collect(),
            columns: columns[..lags].to_vec(),
        }
    }

    /// Least squares of the signals through an autoregression.
    fn least_squares(&self, filter: &[f64]) -> Vec<f64> {
        let from = Self::FROM.max(filter.len() - 1);
        let columns: Vec<Vec<f64>> = self.columns.iter().map(|c| convolved(filter, c)).collect();
        let rows: Vec<f64> = (from..self.y.len())
            .flat_map(|n| columns.iter().map(move |c| c[n]))
            .collect();
        linalg::least_squares(&rows, columns.len(), &convolved(filter, &self.y)[from..]).unwrap()
    }

    fn error(p: &[f64]) -> f64 {
        p.iter().zip(Self::TRUE).map(|(p, t)| (p - t).powi(2)).sum()
    }
}

impl Residuals for MovingAverage {
    fn from(&self) -> usize {
        Self::FROM
    }
    fn residuals(&self, p: &[f64]) -> Option<Vec<f64>> {
        Some(self.linearise(p).residuals)
    }
    fn linearise(&self, p: &[f64]) -> Linearisation {
        let output = (0..self.y.len()).map(|n| self.columns.iter().zip(p).map(|(c, p)| p * c[n]).sum::<f64>());
        Linearisation {
            residuals: output.zip(&self.y).map(|(p, y)| p - y).collect(),
            jacobian: self.columns.clone(),
        }
    }
}

#[test]
fn a_linear_problem_is_solved_by_generalised_least_squares() {
    let [mut before, mut after] = [0.0; 2];
    for seed in 0..20 {
        let problem = MovingAverage::new(&slow(2 * seed, 1500), &noise(2 * seed + 1, 1500), 3);
        let least = problem.least_squares(&[1.0]);
        let residuals = problem.residuals(&least).unwrap();
        let filter = whitening(&residuals[MovingAverage::FROM..], SAMPLES_PER_COEFFICIENT);
        let want = problem.least_squares(&filter);
        let Some(Minimum {
            parameters: got,
            squares,
        }) = efficient_of(&problem, &least)
        else {
            continue;
        };
        for (got, want) in got.iter().zip(&want) {
            assert!((got - want).abs() < 1e-6, "{got} {want}");
        }
        let direct: f64 = problem.residuals(&got).unwrap()[MovingAverage::FROM..]
            .iter()
            .map(|e| e * e)
            .sum();
        assert!((squares - direct).abs() < 1e-12 * direct);
        before += MovingAverage::error(&least);
        after += MovingAverage::error(&got);
    }
    assert!(after < 0.5 * before && after > 0.0, "{after} {before}");
}

#[test]
fn a_true_model_with_coloured_noise_is_hardly_ever_left_as_it_is() {
    let runs = 400;
    let stay = (0..runs).filter(|&seed| {
        let problem = MovingAverage::new(&slow(2 * seed, 1000), &noise(2 * seed + 1, 1000), 3);
        efficient_of(&problem, &problem.least_squares(&[1.0])).is_none()
    });
    // Stated is one in 10,000.
    let stay = stay.count();
    assert!(stay <= 1, "{stay} of {runs}");
}

#[test]
fn white_errors_leave_the_estimate_as_it_is() {
    let runs = 50;
    let stay = (0..runs).filter(|&seed| {
        let problem = MovingAverage::new(&slow(2 * seed, 1500), &gaussian(1500, 2 * seed + 1), 3);
        efficient_of(&problem, &problem.least_squares(&[1.0])).is_none()
    });
    // Schwarz's criterion asks for an autoregression of white noise now and then.
    assert!(stay.count() >= 45);
}

#[test]
fn an_error_that_the_structure_misses_leaves_the_estimate_as_it_is() {
    for seed in 0..10 {
        // One of three lags; what is missing has a colour of its own and hardly any noise is on it.
        let small: Vec<f64> = noise(2 * seed + 1, 4000).iter().map(|e| 0.05 * e).collect();
        let problem = MovingAverage::new(&slow(2 * seed, 4000), &small, 1);
        let least = problem.least_squares(&[1.0]);
        let residuals = problem.residuals(&least).unwrap();
        assert!(whitening(&residuals[MovingAverage::FROM..], SAMPLES_PER_COEFFICIENT).len() > 1);
        assert_eq!(efficient_of(&problem, &least), None);
    }
}

/// The squared distance of two signals.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

#[test]
fn a_cascade_becomes_more_exact() {
    let rational = |b: &[f64], a: &[f64]| Rational::from_polynomials(b.to_vec(), a).unwrap();
    let mut spline = KinkedSpline::new(&[-3.0, 0.0, 3.0]);
    let coefficients: Vec<f64> = (0..spline.c.len())
        .map(|j| (f64::from(j as u32) - 2.0).tanh())
        .collect();
    spline.c.copy_from_slice(&coefficients);
    let branch = Branch::new(
        rational(&[0.6, 0.2], &[1.0, -0.5]),
        spline,
        rational(&[1.0, 0.3], &[1.0, -0.4]),
    );
    let system = System::sum(vec![branch]);
    let fresh = vec![gaussian(3000, 100)];
    let truth = system.run(&fresh);
    let [mut before, mut after] = [0.0; 2];
    for seed in 0..8 {
        let u = slow(2 * seed, 1500);
        let y = sum(&system.run(std::slice::from_ref(&u)), &noise(2 * seed + 1, 1500));
        let data = Signals::of_input(u, y, 50);
        let loss = Loss::new(system.clone(), &data);
        let go = &mut |_: &str| ControlFlow::Continue(());
        let rule = StopRule::new(60, 1e-9);
        let least = descend(&loss, loss.start(), rule, &mut Monitor::new(go))
            .unwrap()
            .parameters;
        let better = efficient_of(&loss, &least).map_or_else(|| least.clone(), |b| b.parameters);
        before += distance(&loss.system(&least).run(&fresh), &truth);
        after += distance(&loss.system(&better).run(&fresh), &truth);
    }
    assert!(after < 0.75 * before, "{after} {before}");
}
