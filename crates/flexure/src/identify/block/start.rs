//! Where a search for static branches with linear dynamics behind them starts: least squares over B-splines of the inputs, each with a
//! numerator of its own.
//!
//! With coarse splines the sum of Hammerstein branches is linear in its (too many) parameters: a system from the splines of
//! all inputs to the output with one denominator, found by the Steiglitz-McBride iteration; the numerators of an input's splines
//! are then one polynomial times the spline's coefficient, of which the dominant singular vectors are taken (Bai 1998). A last
//! nonlinearity only turns up as a gain and as noise that is uncorrelated with the sum, exactly so where the sum is Gaussian
//! (Bussgang's theorem).

use super::approximation::{EquationError, least_lag};
use super::limits::START_PIECES;
use super::rank::dominant_products;
use super::rational::Rational;
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;
use super::system::{Branch, Level, System};

/// Passes of the Steiglitz-McBride iteration.
const PASSES: usize = 8;
/// Pieces, samples and order of the search for delays, and what of them is left to the numerators.
const DELAY_PIECES: usize = 3;
const DELAY_SAMPLES: usize = 4_000;
const DELAY_ORDER: usize = 2;
const DELAY_SLACK: usize = 1;

/// The B-splines of a signal but for the middle one, whose place a constant takes.
pub(super) struct Splines {
    pub columns: Vec<Vec<f64>>,
    /// The index of the middle one.
    pub middle: usize,
}

impl Splines {
    pub fn new(signal: &[f64], spline: &KinkedSpline) -> Splines {
        let local: Vec<_> = signal.iter().map(|u| spline.local(*u)).collect();
        let middle = spline.c.len() / 2;
        let others = (0..spline.c.len()).filter(|j| *j != middle);
        Splines {
            columns: others.map(|j| spline.by_parameter(j, signal, &local)).collect(),
            middle,
        }
    }
}

/// The delay of every input: the lag at which an equation error of low order with its splines is least, less some slack.
pub(in crate::identify) fn delays(data: &Signals) -> Vec<usize> {
    let data = data.head(DELAY_SAMPLES);
    let past = (1..=DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0));
    let always: Vec<Vec<f64>> = past.chain([vec![1.0; data.y.len()]]).collect();
    let of = |u: &Vec<f64>| {
        let Some(spline) = KinkedSpline::coarse(&u[data.from..], DELAY_PIECES) else {
            return 0;
        };
        let basis = Splines::new(u, &spline).columns;
        let least = least_lag(&data, |lag| {
            let lags = (lag..=lag + DELAY_ORDER).flat_map(|lag| basis.iter().map(move |c| delayed(c, lag, 1.0)));
            lags.chain(always.iter().cloned()).collect()
        });
        least.saturating_sub(DELAY_SLACK)
    };
    data.u.iter().map(of).collect()
}

/// Branches of the given order with these delays, `each` of every input, and no last nonlinearity; `None` if none were found.
///
/// The branches stand input by input; all have the same denominator.
pub(super) fn branches(data: &Signals, order: usize, delays: &[usize], each: usize) -> Option<System> {
    let inputs = (data.u.iter().zip(delays)).map(|(u, delay)| Input::new(u, *delay, data.from));
    let inputs: Vec<Input> = inputs.collect::<Option<_>>()?;
    let signals: Vec<Vec<f64>> = inputs.iter().flat_map(|i| i.splines.columns.clone()).collect();
    let problem = EquationError {
        signals: &signals,
        y: &data.y,
        constant: true,
        order,
        from: data.from,
    };
    let mut best: Option<(System, f64)> = None;
    problem.iterate(PASSES, |numerators, denominator| {
        let system = with_offset(assembled(&inputs, numerators, denominator, order, each)?, data);
        let squares = data.squares(&system.run(&data.u));
        if squares.is_finite() && best.as_ref().is_none_or(|b| squares < b.1) {
            best = Some((system, squares));
        }
        Some(())
    });
    best.map(|b| b.0)
}

/// A delayed input's coarse nonlinearity and its splines.
struct Input {
    delay: usize,
    spline: KinkedSpline,
    splines: Splines,
}

impl Input {
    fn new(u: &[f64], delay: usize, from: usize) -> Option<Input> {
        let spline = KinkedSpline::coarse(&u[from..], START_PIECES)?;
        Some(Input {
            delay,
            splines: Splines::new(&delayed(u, delay, 1.0), &spline),
            spline,
        })
    }
}

/// The branches whose numerators are the dominant parts of these, `each` of every input.
fn assembled(
    inputs: &[Input],
    numerators: &[f64],
    denominator: &Rational,
    order: usize,
    each: usize,
) -> Option<System> {
    let mut rest = numerators;
    let mut branches = Vec::new();
    for (index, input) in inputs.iter().enumerate() {
        let (mine, others) = rest.split_at(input.splines.columns.len() * (order + 1));
        rest = others;
        for product in dominant_products(mine, order + 1, each)? {
            let mut spline = input.spline.clone();
            spline.c = product.column;
            spline.c.insert(input.splines.middle, 0.0);
            let back = Rational {
                b: product.row,
                ..denominator.clone()
            };
            branches.push(Branch {
                input: index,
                delay: input.delay,
                ..Branch::new(Rational::pass(), spline, back)
            });
        }
    }
    Some(System {
        branches,
        output: None,
        level: Level::Offset,
    })
}

/// The system with the offset that leaves no mean error.
fn with_offset(mut system: System, data: &Signals) -> System {
    let output = system.run(&data.u);
    let errors = data.y.iter().zip(&output).skip(data.from).map(|(y, p)| y - p);
    if let Some(first) = system.branches.first_mut() {
        first.offset += errors.sum::<f64>() / data.counted() as f64;
    }
    system
}
