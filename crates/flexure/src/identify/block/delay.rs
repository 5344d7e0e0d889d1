//! Delays: the lags with zero coefficients in a difference equation; before nonlinearities, the lag with the least equation error of a low
//! order (Ljung 1999, section 14.5).

use super::limits::{
    DELAY_EDGE, DELAY_LAGS, DELAY_LEVEL, DELAY_PAST, DELAY_RIDGE, LINEAR_DELAY_ORDER, LINEAR_DELAY_SLACK,
    LONGEST_DELAY, SPLINE_DELAY_ORDER, SPLINE_DELAY_PIECES, SPLINE_DELAY_SAMPLES, SPLINE_DELAY_SLACK, START_SAMPLES,
};
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;
use crate::distributions::chi_squared_quantile;
use crate::linalg;
use crate::linear::least_squares::{UnitDiagonal, least_squares, regression};
use crate::vectors::dot;

/// The delay of every input of a linear system: the largest number of leading coefficients that a test finds to be zero together.
pub(in crate::identify) fn linear_delays(data: &Signals) -> Vec<usize> {
    delays_with_edge(data, 0.0)
}

/// The delay of the first input. Its edge distinguishes it from a response that begins slowly: the first coefficient after it is large.
pub(in crate::identify) fn delay_with_edge(data: &Signals) -> usize {
    delays_with_edge(data, DELAY_EDGE).first().map_or(0, |delay| *delay)
}

/// Delays after which the first coefficient is at least `edge` standard errors.
fn delays_with_edge(data: &Signals, edge: f64) -> Vec<usize> {
    let first = long_delays(data);
    let leading = leading_zeros(data, &first, edge).unwrap_or_else(|| vec![0; first.len()]);
    first.iter().zip(leading).map(|(far, near)| far + near).collect()
}

/// Delays too long for a numerator of a few coefficients, less some slack; zero where there is none.
fn long_delays(data: &Signals) -> Vec<usize> {
    let data = data.head(START_SAMPLES);
    let past: Vec<Vec<f64>> = (1..=LINEAR_DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0)).collect();
    let lags = least_lags(&data, &past, |input, lag| {
        let lags = (0..=LINEAR_DELAY_ORDER).map(|i| delayed(&data.u[input], lag + i, 1.0));
        lags.collect()
    });
    let slack = |lag: &usize| lag.saturating_sub(LINEAR_DELAY_SLACK);
    lags.iter().map(slack).collect()
}

/// The numbers of zero coefficients after the lags `first`, in a difference equation that leaves nearly white errors.
fn leading_zeros(data: &Signals, first: &[usize], edge: f64) -> Option<Vec<usize>> {
    let each = data.u.iter().zip(first);
    let lags = each.flat_map(|(u, first)| (0..DELAY_LAGS).map(move |k| delayed(u, first + k, 1.0)));
    let past = (1..=DELAY_PAST).map(|k| delayed(&data.y, k, -1.0));
    let columns: Vec<Vec<f64>> = lags.chain(past).chain([vec![1.0; data.y.len()]]).collect();
    let size = columns.len();
    let from = first.iter().map(|first| first + DELAY_LAGS - 1).max()?.max(DELAY_PAST);
    let degrees = data.y.len().checked_sub(from + size).filter(|d| *d > 0)?;
    let equations = regression(&data.y, &columns, from);
    let diagonal = UnitDiagonal::new(&equations);
    let coefficients = diagonal.solve(&equations.descent, |d| d * (1.0 + DELAY_RIDGE))?;
    let explained = dot(&coefficients, &equations.descent);
    let variance = (equations.cost - explained).max(0.0) / degrees as f64;
    let inverse = diagonal.inverse()?;
    let zero = |start: usize, count: usize| {
        let b = &coefficients[start..start + count];
        let block: Vec<f64> = (0..count * count)
            .map(|k| variance * inverse[(start + k / count) * size + start + k % count])
            .collect();
        let Some(weighted) = linalg::solve_positive_definite(&block, b) else {
            return false;
        };
        dot(&weighted, b) < chi_squared_quantile(1.0 - DELAY_LEVEL, count as f64)
    };
    let of = |i: usize| {
        let start = i * DELAY_LAGS;
        let zeros = (1..=DELAY_LAGS).take_while(|count| zero(start, *count)).count();
        // All coefficients are zero: this input has no visible effect.
        if zeros == DELAY_LAGS {
            return 0;
        }
        let at = start + zeros;
        let error = (variance * inverse[at * size + at]).sqrt();
        if coefficients[at].abs() < edge * error {
            0
        } else {
            zeros
        }
    };
    Some((0..first.len()).map(of).collect())
}

/// The lag, up to 100 samples and a tenth of the record, at which the least squares of the output over these columns have the smallest
/// error.
pub(in crate::identify) fn least_lag(data: &Signals, columns: impl Fn(usize) -> Vec<Vec<f64>>) -> usize {
    lag_and_squares(data, columns).0
}

/// That lag, and its sum of squares.
fn lag_and_squares(data: &Signals, columns: impl Fn(usize) -> Vec<Vec<f64>>) -> (usize, f64) {
    let mut least = (0, f64::INFINITY);
    for lag in 0..=LONGEST_DELAY.min(data.counted() / 10) {
        let squares = least_squares(&data.y, &columns(lag), data.from).map_or(f64::INFINITY, |l| l.squares);
        if squares < least.1 {
            least = (lag, squares);
        }
    }
    least
}

/// The lag of every input at which its columns beside those of the other inputs, and those that are `always` there, have the smallest error.
///
/// The other inputs count at their own lags, as the error of what they do would hide a weak input. The input that explains most comes first;
/// in the end each is tried once more beside all others.
fn least_lags(data: &Signals, always: &[Vec<f64>], columns: impl Fn(usize, usize) -> Vec<Vec<f64>>) -> Vec<usize> {
    let inputs = data.u.len();
    let mut known: Vec<Option<usize>> = vec![None; inputs];
    let beside = |input: usize, known: &[Option<usize>]| {
        let others = (0..inputs).filter(|other| *other != input);
        let others: Vec<Vec<f64>> = others
            .filter_map(|other| Some(columns(other, known[other]?)))
            .flatten()
            .collect();
        lag_and_squares(data, |lag| {
            let own = columns(input, lag).into_iter();
            own.chain(others.iter().cloned())
                .chain(always.iter().cloned())
                .collect()
        })
    };
    while known.contains(&None) {
        let open = (0..inputs).filter(|input| known[*input].is_none());
        let found = open.map(|input| (input, beside(input, &known)));
        let Some((input, (lag, _))) = found.min_by(|a, b| a.1.1.total_cmp(&b.1.1)) else {
            break;
        };
        known[input] = Some(lag);
    }
    if inputs > 1 {
        for input in 0..inputs {
            known[input] = Some(beside(input, &known).0);
        }
    }
    known.into_iter().map(|lag| lag.unwrap_or(0)).collect()
}

/// The delay of every input: the lag with the least equation error of a low order with the inputs' splines, less some slack.
pub(in crate::identify) fn delays(data: &Signals) -> Vec<usize> {
    let data = data.head(SPLINE_DELAY_SAMPLES);
    let past = (1..=SPLINE_DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0));
    let always: Vec<Vec<f64>> = past.chain([vec![1.0; data.y.len()]]).collect();
    let basis = |u: &Vec<f64>| {
        let spline = KinkedSpline::coarse(&u[data.from..], SPLINE_DELAY_PIECES);
        spline.map_or_else(Vec::new, |spline| spline.others_at(u))
    };
    let bases: Vec<Vec<Vec<f64>>> = data.u.iter().map(basis).collect();
    let lags = least_lags(&data, &always, |input, lag| {
        let lags = lag..=lag + SPLINE_DELAY_ORDER;
        lags.flat_map(|lag| bases[input].iter().map(move |c| delayed(c, lag, 1.0)))
            .collect()
    });
    let slack = |lag: &usize| lag.saturating_sub(SPLINE_DELAY_SLACK);
    lags.iter().map(slack).collect()
}
