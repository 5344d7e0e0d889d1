//! The samples of a fit at zero mean and unit variance, and their best linear approximations.

use super::approximation::{Approximation, approximate_all};
use super::delay::delay_with_edge;
use super::limits::{
    LARGEST_ORDER, MOST_SAMPLES, SETTLED_START, SETTLING_UNKNOWN, START_ORDERS, STRUCTURE_SAMPLES, WEAK_APPROXIMATION,
};
use super::monitor::Monitor;
use super::rational::Rational;
use super::signals::{Scale, Signals, delayed};

/// The samples of a fit at zero mean and unit variance, and the linear approximations from the first input.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Prepared {
    pub inputs: Vec<Scale>,
    pub output: Scale,
    pub data: Signals,
    /// The delay that was removed from the data: input sample n is paired with output sample n + delay.
    pub delay: usize,
    /// The linear approximations, in ascending order.
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
    /// Without a delay and without linear approximations.
    pub fn new(u: &[&[f64]], y: &[f64]) -> Prepared {
        let inputs: Vec<Scale> = u.iter().map(|u| Scale::new(u)).collect();
        let output = Scale::new(y);
        let first = y.len().saturating_sub(MOST_SAMPLES);
        let scaled = u.iter().zip(&inputs).map(|(u, scale)| scale.standardised(&u[first..]));
        let from = (y.len() / 10).min(SETTLING_UNKNOWN);
        Prepared {
            data: Signals::new(scaled.collect(), output.standardised(&y[first..]), from),
            inputs,
            output,
            delay: 0,
            approximations: Vec::new(),
        }
    }

    /// With this delay of the inputs removed.
    pub fn delayed_by(mut self, delay: usize) -> Prepared {
        self.data.u.iter_mut().for_each(|u| *u = delayed(u, delay, 1.0));
        self.delay = delay;
        self
    }

    /// With linear approximations. Their delay is removed, if it is at most the largest allowed one.
    pub fn approximated(self, largest_delay: usize, monitor: &mut Monitor<'_>) -> Prepared {
        let delay = delay_with_edge(&self.data).min(largest_delay);
        let mut prepared = self.delayed_by(delay);
        prepared.approximations = approximations(&prepared.data.head(STRUCTURE_SAMPLES), monitor);
        if let Some(settling) = prepared.best().map(|best| best.settling(SETTLED_START)) {
            prepared.data.count_after(settling);
        }
        prepared
    }

    /// The best approximation by Schwarz's criterion.
    pub fn best(&self) -> Option<&Rational> {
        let best = self.approximations.iter().min_by(|a, b| a.bic.total_cmp(&b.bic));
        best.map(|a| &a.system)
    }

    /// The best approximation and those of neighbouring orders.
    pub fn starting(&self) -> Vec<&Rational> {
        let Some(best) = self.best() else {
            return Vec::new();
        };
        let near = |g: &&Rational| START_ORDERS.contains(&(g.order() as isize - best.order() as isize));
        self.approximations.iter().map(|a| &a.system).filter(near).collect()
    }

    /// The share of the output's variance that a linear approximation explains.
    pub fn explained(&self) -> f64 {
        let errors = self.approximations.iter().map(|a| a.relative_error);
        1.0 - errors.fold(1.0, f64::min).powi(2)
    }

    /// Whether the linear approximations are a weak start.
    pub fn is_weak(&self) -> bool {
        !(self.explained() >= WEAK_APPROXIMATION)
    }
}

/// Linear approximations of all orders that the samples allow.
fn approximations(data: &Signals, monitor: &mut Monitor<'_>) -> Vec<Scored> {
    let score = |a: Approximation| Scored {
        bic: data.bic(a.squares, a.system.count()),
        relative_error: (a.squares / data.counted() as f64).sqrt(),
        system: a.system,
    };
    let all = approximate_all(data, 1..=LARGEST_ORDER.min(data.counted() / 20), monitor);
    all.into_iter().flatten().map(score).collect()
}
