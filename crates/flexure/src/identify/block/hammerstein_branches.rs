//! Hammerstein branches, one or several for each input, whose sum passes a last nonlinearity, or is the output.
//!
//! The [Hammerstein-Wiener](crate::identify::HAMMERSTEIN_WIENER) system (one branch), the
//! [one with several inputs](crate::identify::MULTIPLE_INPUTS) and the [sum of branches](crate::identify::PARALLEL) (both without a
//! last nonlinearity) start here.
//!
//! With coarse splines the sum of Hammerstein branches is linear in its (too many) parameters: a system from the B-splines of
//! all inputs to the output with one denominator, found by the Steiglitz-McBride iteration. The numerators of an input's splines are one
//! polynomial times the spline's coefficient, so the dominant singular vectors are taken (Bai 1998). A last nonlinearity acts only as a
//! gain and as noise that is uncorrelated with the sum; this is exact for a Gaussian sum (Bussgang's theorem).

use super::approximation::approximate;
use super::candidate::Candidate;
use super::delay::delays;
use super::equation_error::{EquationError, Judged};
use super::limits::{
    BRANCHES_ROUNDS, LARGEST_START_ORDER, PRODUCT_PASSES, ROUGH, SETTLED_START, START_PIECES, START_SAMPLES,
    WORSE_ORDERS,
};
use super::monitor::{Monitor, Stage};
use super::pieces::with_output;
use super::rank_one::dominant_products;
use super::rational::Rational;
use super::search::{Search, SearchResult};
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;
use super::system::{Branch, FreeParts, System};
use crate::sort;

/// The search, on signals of unit variance and zero mean; `None` if there is nothing to start from.
pub(in crate::identify) fn find(data: &Signals, last: bool, monitor: &mut Monitor<'_>) -> Option<SearchResult> {
    monitor.stage = Stage::Approximation;
    let mut search = Search::new(FreeParts::DELAYED_HAMMERSTEIN, monitor);
    let starts = starts(&data.head(START_SAMPLES), last, &mut search);
    let settling = starts.first()?.system.settling(SETTLED_START);
    let mut data = data.clone();
    data.count_after(settling);
    search.run(starts, &BRANCHES_ROUNDS, &data)
}

/// Candidates of rising orders, best first, until the best criterion (Schwarz) of an order has risen several times in a row.
pub(super) fn of_rising_orders(
    data: &Signals,
    search: &mut Search<'_, '_>,
    mut of_order: impl FnMut(usize, &mut Search<'_, '_>) -> Vec<Candidate>,
) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = Vec::new();
    let (mut least, mut worse) = (f64::INFINITY, 0);
    for order in 0..=LARGEST_START_ORDER.min(data.counted() / 30) {
        if !search.monitor.keep_on() || worse > WORSE_ORDERS {
            break;
        }
        let found = of_order(order, search);
        let Some(best) = found.iter().map(|c| c.bic(data)).min_by(f64::total_cmp) else {
            continue;
        };
        (least, worse) = if best < least { (best, 0) } else { (least, worse + 1) };
        all.extend(found);
    }
    sort::by_key(&mut all, |c| c.bic(data));
    all
}

/// Systems of rising orders after short fits, best first.
fn starts(data: &Signals, last: bool, search: &mut Search<'_, '_>) -> Vec<Candidate> {
    let delays = delays(data);
    of_rising_orders(data, search, |order, search| {
        let start = branches(data, order, &delays, 1).map(|system| Candidate::new(system, data));
        let fitted = start.map(|c| c.fitted(data, ROUGH, search.monitor));
        let mut found: Vec<Candidate> = fitted.into_iter().collect();
        if last {
            found.extend(linear(data, order, &delays, search.monitor));
            found = (found.into_iter())
                .filter_map(|c| with_output(&c.system, START_PIECES, data))
                .map(|c| c.fitted(data, ROUGH.times(2), search.monitor))
                .collect();
        }
        search.tried.extend(found.iter().map(|c| c.tried(data)));
        found
    })
}

/// A straight line, then the best linear approximation: a start for Wiener systems. Only for one input.
fn linear(data: &Signals, order: usize, delays: &[usize], monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let ([u], [delay]) = (&data.u[..], delays) else {
        return None;
    };
    let mut branch = Branch {
        delay: *delay,
        ..Branch::of(KinkedSpline::coarse(&u[data.from..], START_PIECES)?)
    };
    branch.spline.straighten();
    let delayed = branch.delayed(&data.u).into_owned();
    let approximated = Signals::of_input(delayed, data.y.clone(), data.from);
    branch.back = approximate(&approximated, order.max(1), monitor)?.system;
    Some(Candidate::new(System::with_offsets(vec![branch]), data))
}

/// The result if there is no start: a constant, with a branch without effect if there is a last nonlinearity.
pub(in crate::identify) fn without_start(last: bool) -> SearchResult {
    let branch = Branch::new(Rational::pass(), KinkedSpline::new(&[-1.0, 1.0]), Rational::pass());
    SearchResult {
        system: System::with_offsets(if last { vec![branch] } else { Vec::new() }),
        tried: Vec::new(),
    }
}

/// Branches of the given order with these delays, `each` of every input, and no last nonlinearity; `None` if none were found.
///
/// The branches stand input by input; all have the same denominator.
pub(super) fn branches(data: &Signals, order: usize, delays: &[usize], each: usize) -> Option<System> {
    let inputs = (data.u.iter().zip(delays)).map(|(u, delay)| Input::new(u, *delay, data.from));
    let inputs: Vec<Input> = inputs.collect::<Option<_>>()?;
    let signals: Vec<Vec<f64>> = inputs.iter().flat_map(|i| i.columns.clone()).collect();
    let problem = EquationError {
        signals: &signals,
        y: &data.y,
        constant: true,
        order,
        from: data.from,
    };
    let best = problem.best(PRODUCT_PASSES, |numerators, denominator| {
        let system = with_offset(assembled(&inputs, numerators, denominator, order, each)?, data);
        let score = data.squares(&system.run(&data.u));
        Some(Judged { score, of: system })
    });
    best.map(|best| best.of)
}

/// A delayed input's coarse nonlinearity and its splines.
struct Input {
    delay: usize,
    spline: KinkedSpline,
    /// All B-splines except the middle one.
    columns: Vec<Vec<f64>>,
}

impl Input {
    fn new(u: &[f64], delay: usize, from: usize) -> Option<Input> {
        let spline = KinkedSpline::coarse(&u[from..], START_PIECES)?;
        Some(Input {
            delay,
            columns: spline.others_at(&delayed(u, delay, 1.0)),
            spline,
        })
    }
}

/// The branches with the dominant parts of these numerators, `each` for every input.
fn assembled(
    inputs: &[Input],
    mut numerators: &[f64],
    denominator: &Rational,
    order: usize,
    each: usize,
) -> Option<System> {
    let mut branches = Vec::new();
    for (index, input) in inputs.iter().enumerate() {
        let (mine, others) = numerators.split_at(input.columns.len() * (order + 1));
        numerators = others;
        for product in dominant_products(mine, order + 1, each)? {
            let mut spline = input.spline.clone();
            spline.set_others(product.column);
            let back = denominator.with_numerator(product.row);
            branches.push(Branch {
                input: index,
                delay: input.delay,
                ..Branch::new(Rational::pass(), spline, back)
            });
        }
    }
    Some(System::with_offsets(branches))
}

/// The system with the offset that makes the mean error zero.
fn with_offset(mut system: System, data: &Signals) -> System {
    let output = system.run(&data.u);
    let errors = data.y.iter().zip(&output).skip(data.from).map(|(y, p)| y - p);
    if let Some(first) = system.branches.first_mut() {
        first.offset += errors.sum::<f64>() / data.counted() as f64;
    }
    system
}
