//! Delays: the lag at which the equation error of a low order is least (Ljung 1999, section 14.5).

use super::least_squares::least_squares;
use super::limits::{
    LINEAR_DELAY_ORDER, LINEAR_DELAY_SLACK, LONGEST_DELAY, SPLINE_DELAY_ORDER, SPLINE_DELAY_PIECES,
    SPLINE_DELAY_SAMPLES, SPLINE_DELAY_SLACK, START_SAMPLES,
};
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;

/// A delay too long for numerators to imitate, less some slack; zero if there is none.
pub(in crate::identify) fn pure_delay(data: &Signals) -> usize {
    let data = data.head(START_SAMPLES);
    let past: Vec<Vec<f64>> = (1..=LINEAR_DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0)).collect();
    let least = least_lag(&data, |delay| {
        let lags = (0..=LINEAR_DELAY_ORDER).map(|i| delayed(data.input(), delay + i, 1.0));
        lags.chain(past.iter().cloned()).collect()
    });
    least.saturating_sub(LINEAR_DELAY_SLACK)
}

/// The lag, up to 100 samples and a tenth of the record, at which least squares of the output over these columns leave least.
pub(in crate::identify) fn least_lag(data: &Signals, columns: impl Fn(usize) -> Vec<Vec<f64>>) -> usize {
    let mut least = (0, f64::INFINITY);
    for lag in 0..=LONGEST_DELAY.min(data.counted() / 10) {
        let squares = least_squares(&data.y, &columns(lag), data.from).map_or(f64::INFINITY, |l| l.squares);
        if squares < least.1 {
            least = (lag, squares);
        }
    }
    least.0
}

/// The delay of every input: the lag at which an equation error of low order with its splines is least, less some slack.
pub(in crate::identify) fn delays(data: &Signals) -> Vec<usize> {
    let data = data.head(SPLINE_DELAY_SAMPLES);
    let past = (1..=SPLINE_DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0));
    let always: Vec<Vec<f64>> = past.chain([vec![1.0; data.y.len()]]).collect();
    let of = |u: &Vec<f64>| {
        let Some(spline) = KinkedSpline::coarse(&u[data.from..], SPLINE_DELAY_PIECES) else {
            return 0;
        };
        let basis = spline.others_at(u);
        let least = least_lag(&data, |lag| {
            let lags = (lag..=lag + SPLINE_DELAY_ORDER).flat_map(|lag| basis.iter().map(move |c| delayed(c, lag, 1.0)));
            lags.chain(always.iter().cloned()).collect()
        });
        least.saturating_sub(SPLINE_DELAY_SLACK)
    };
    data.u.iter().map(of).collect()
}
