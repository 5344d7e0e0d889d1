//! The samples of a fit with one input, and their best linear approximations.

use super::approximation::{Approximation, approximate, pure_delay};
use super::limits::{MOST_SAMPLES, SETTLING_UNKNOWN, STRUCTURE_SAMPLES};
use super::monitor::Monitor;
use super::rational::Rational;
use super::signals::{Signals, delayed};
use super::units::{ApproximationScore, Scales};

/// Largest order of the linear approximation.
pub(in crate::identify) const LARGEST_ORDER: usize = 10;
/// Orders of the approximation from which starts are made: the best by Schwarz's criterion and its neighbours.
const START_ORDERS: std::ops::RangeInclusive<isize> = -1..=2;
/// A linear approximation that explains less than this share of the output's variance is a weak start.
pub(in crate::identify) const WEAK: f64 = 0.1;

/// The samples of a fit at zero mean and unit variance, without the pure delay, and their linear approximations.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Prepared {
    pub scales: Scales,
    pub data: Signals,
    /// Taken out of the data: input sample n stands beside output sample n + delay.
    pub delay: usize,
    /// In ascending order.
    pub approximations: Vec<Scored>,
}

/// A linear approximation and how good it is.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Scored {
    pub system: Rational,
    /// The RMS of its simulation error relative to the output's standard deviation.
    pub relative_error: f64,
    bic: f64,
}

impl Prepared {
    /// The delay is the linear approximation's.
    pub fn new(u: &[f64], y: &[f64], monitor: &mut Monitor<'_>) -> Prepared {
        Prepared::with_delay_at_most(u, y, usize::MAX, monitor)
    }

    /// The delay is the linear approximation's, or the largest.
    pub fn with_delay_at_most(u: &[f64], y: &[f64], largest: usize, monitor: &mut Monitor<'_>) -> Prepared {
        let mut prepared = Prepared::with_delay(u, y, 0);
        let delay = pure_delay(&prepared.data);
        prepared.shift(delay.min(largest));
        prepared.approximations = approximations(&prepared.data.head(STRUCTURE_SAMPLES), monitor);
        let n = prepared.data.y.len();
        if let Some(best) = prepared.best() {
            prepared.data.from = prepared.approximations[best]
                .system
                .settling(1e-4)
                .clamp(n / 100, n / 10);
        }
        prepared
    }

    /// The delay is given, and no linear approximations are made.
    pub fn with_delay(u: &[f64], y: &[f64], delay: usize) -> Prepared {
        let scales = Scales::new(u, y);
        let first = u.len().saturating_sub(MOST_SAMPLES);
        let (u, y) = (
            scales.input.standardised(&u[first..]),
            scales.output.standardised(&y[first..]),
        );
        let from = (u.len() / 10).min(SETTLING_UNKNOWN);
        let mut prepared = Prepared {
            scales,
            data: Signals::of_input(u, y, from),
            delay: 0,
            approximations: Vec::new(),
        };
        prepared.shift(delay);
        prepared
    }

    fn shift(&mut self, delay: usize) {
        self.data.u = vec![delayed(self.data.input(), delay, 1.0)];
        self.delay = delay;
    }

    /// The best approximation by Schwarz's criterion.
    pub fn best(&self) -> Option<usize> {
        (0..self.approximations.len())
            .min_by(|i, j| self.approximations[*i].bic.total_cmp(&self.approximations[*j].bic))
    }

    /// The best approximation and those of nearly its order.
    pub fn starting(&self) -> Vec<&Rational> {
        let Some(best) = self.best() else {
            return Vec::new();
        };
        let order = self.approximations[best].system.order() as isize;
        let near = |a: &&Scored| START_ORDERS.contains(&(a.system.order() as isize - order));
        self.approximations.iter().filter(near).map(|a| &a.system).collect()
    }

    /// The share of the output's variance that a linear approximation explains.
    pub fn explained(&self) -> f64 {
        let errors = self.approximations.iter().map(|a| a.relative_error);
        1.0 - errors.fold(1.0, f64::min).powi(2)
    }

    /// The scores of all approximations.
    pub fn scores(&self) -> Vec<ApproximationScore> {
        let score = |a: &Scored| ApproximationScore {
            order: a.system.order(),
            relative_error: a.relative_error,
        };
        self.approximations.iter().map(score).collect()
    }
}

/// Linear approximations of all orders that the samples allow.
fn approximations(data: &Signals, monitor: &mut Monitor<'_>) -> Vec<Scored> {
    let score = |a: Approximation| Scored {
        bic: data.bic(a.squares, a.system.count()),
        relative_error: (a.squares / data.counted() as f64).sqrt(),
        system: a.system,
    };
    (1..=LARGEST_ORDER.min(data.counted() / 20))
        .filter_map(|order| approximate(data, order, monitor).map(score))
        .collect()
}
