//! Times at which a body rests.
//!
//! While a body sticks, its friction is what the other torques make it: no function of velocity, and nothing that its motion could remember. In the
//! equations it would look like a friction that turns slowly, or like a delay of the torque. So its equation says nothing there: its velocity is zero,
//! the other effects are left out, and torque and spring get factors of their own for these times.

use super::equations::{Column, Lines};
use super::fourier::Modulation;
use super::limits::LEAST_REST;

/// Whether a body rests at each sample: its velocity cannot be told from zero for longer than the smoothing of this cut-off in Hz resolves.
pub(super) fn rests(velocity: &[f64], resolution: f64, cut_off: f64, step: f64) -> Vec<bool> {
    let long = 1.0 / (cut_off * step);
    let slow = |v: &f64| v.abs() < resolution;
    let runs = velocity.chunk_by(|a, b| slow(a) == slow(b));
    let rest = runs.flat_map(|run| std::iter::repeat_n(slow(&run[0]) && run.len() as f64 > long, run.len()));
    rest.collect()
}

/// These times, or none if they are too small a share of the record to determine the factors that torque and spring get there.
fn enough(rest: Vec<bool>) -> Vec<bool> {
    let samples = rest.iter().filter(|at| **at).count();
    match samples as f64 > LEAST_REST * rest.len() as f64 {
        true => rest,
        false => vec![false; rest.len()],
    }
}

/// Sets a signal to zero at these times.
pub(super) fn silence(signal: &mut [f64], times: &[bool]) {
    let pairs = signal.iter_mut().zip(times);
    pairs.filter(|(_, at)| **at).for_each(|(x, _)| *x = 0.0);
}

/// A signal at these times, and zero at others.
fn during(signal: &[f64], times: &[bool]) -> Vec<f64> {
    signal
        .iter()
        .zip(times)
        .map(|(&x, &at)| if at { x } else { 0.0 })
        .collect()
}

/// The times at which motor and link rest.
#[derive(Default)]
pub(super) struct Rests(pub [Vec<bool>; 2]);

impl Rests {
    /// The times at which motor and link rest, if they rest long enough.
    pub fn new(motor: Vec<bool>, link: Vec<bool>) -> Self {
        Rests([motor, link].map(enough))
    }

    /// The lines of a signal in both equations without the times at which the body rests; `lines` are those of all times.
    pub fn without(&self, modulation: &Modulation, lines: &Lines, signal: &[f64]) -> [Lines; 2] {
        [0, 1].map(|body| {
            let mut lines = lines.clone();
            if self.0[body].contains(&true) {
                let rest = modulation.of(&during(signal, &self.0[body]));
                lines.iter_mut().zip(&rest).for_each(|(all, rest)| *all -= rest);
            }
            lines
        })
    }

    /// The columns of the torques on the resting motor and link, with factors of their own: a constant, the spring with its cubic part and, at the motor,
    /// its torque.
    pub fn columns(&self, modulation: &Modulation, torque: &[f64], d: &[f64]) -> Vec<Column> {
        let largest = d.iter().fold(f64::MIN_POSITIVE, |m, d| m.max(d.abs()));
        let one = vec![1.0; d.len()];
        let spring: Vec<f64> = d.iter().map(|d| d / largest).collect();
        let cubic: Vec<f64> = spring.iter().map(|d| d.powi(3)).collect();
        let [motor, link]: [&[&[f64]]; 2] = [&[&one, &spring, &cubic, torque], &[&one, &spring, &cubic]];
        let columns = [motor, link].into_iter().enumerate().flat_map(|(body, signals)| {
            let rest = &self.0[body];
            let signals = signals.iter().filter(|_| rest.contains(&true));
            signals.map(move |signal| {
                let lines = modulation.of(&during(signal, rest));
                let mut column = vec![None, None];
                column[body] = Some(lines);
                column
            })
        });
        columns.collect()
    }
}
