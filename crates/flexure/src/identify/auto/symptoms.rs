//! Symptoms: what a model's error looks like if no structure holds.
//!
//! Each symptom has a few functions that follow such an error. Its size is the share of the error's variance that they predict on blocks of
//! the fresh samples that they were not fitted to. Symptoms overlap: a hysteresis is also a loop.

use super::limits::{DRIFT_BLOCKS, OUTLIERS_FROM, PLAYS, SEEN};
use super::remainder::{moderate, predicted_share};
use crate::identify::outcome::Verdict;
use crate::quantiles::NORMAL_MAD;
use crate::validation::TestKind;

/// A kind of effect that an error looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symptom {
    /// It follows from the output's own past.
    Loop,
    /// The gain or the level changes with time.
    Drift,
    /// It depends on where the output turned round: play, friction, magnetisation.
    Hysteresis,
    /// A few samples make most of it.
    Outliers,
}

impl Symptom {
    /// A name for programs.
    pub fn key(self) -> &'static str {
        match self {
            Symptom::Loop => "loop",
            Symptom::Drift => "drift",
            Symptom::Hysteresis => "hysteresis",
            Symptom::Outliers => "outliers",
        }
    }

    /// What it is, for reading.
    pub(super) fn phrase(self) -> &'static str {
        match self {
            Symptom::Loop => "something in a loop that these structures lack (it follows from the output's past)",
            Symptom::Drift => "a drift in time (the gain or the level changes)",
            Symptom::Hysteresis => {
                "hysteresis (it follows from where the output turned round), or rows in which another signal acted (swapped columns, a switch)"
            }
            Symptom::Outliers => "outliers (a few samples far from all others)",
        }
    }
}

/// The symptoms that are seen in an error, with their shares of its square, largest first.
pub(super) fn symptoms(verdict: &Verdict, error: &[f64], inputs: &[&[f64]], predicted: &[f64]) -> Vec<(Symptom, f64)> {
    let tests = verdict.residuals.iter().flat_map(|r| &r.tests);
    let loops = tests.filter(|t| t.kind == TestKind::OutputFunctionIndependence && !t.passed());
    let drift = inputs.iter().map(|u| drift(error, u, predicted));
    let mut all = vec![
        (Symptom::Loop, loops.map(|t| t.dependent_share()).fold(0.0, f64::max)),
        (Symptom::Drift, drift.fold(0.0, f64::max)),
        (Symptom::Hysteresis, hysteresis(error, predicted)),
        (Symptom::Outliers, outliers(error)),
    ];
    all.retain(|(_, share)| *share >= SEEN);
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}

/// The share that the input and the prediction explain by gains that are quadratic in time.
fn drift(error: &[f64], u: &[f64], predicted: &[f64]) -> f64 {
    let n = error.len();
    let (u, p) = (moderate(u), moderate(predicted));
    let time = |k: usize| 2.0 * k as f64 / n as f64 - 1.0;
    let ones = vec![1.0; n];
    let columns: Vec<Vec<f64>> = [&ones, &u, &p]
        .into_iter()
        .flat_map(|s| [1, 2].map(|power| (0..n).map(|k| time(k).powi(power) * s[k]).collect()))
        .collect();
    predicted_share(error, &columns, |k| (k * DRIFT_BLOCKS / n).is_multiple_of(2))
}

/// The share that plays of several widths on the prediction explain, beyond the share of the prediction itself.
fn hysteresis(error: &[f64], predicted: &[f64]) -> f64 {
    let n = error.len();
    let p = moderate(predicted);
    let blocks = |k: usize| (k * DRIFT_BLOCKS / n).is_multiple_of(2);
    let own = [p.clone(), p.iter().map(|p| p.powi(3)).collect()];
    let behind: Vec<Vec<f64>> = own.iter().cloned().chain(PLAYS.map(|width| play(&p, width))).collect();
    (predicted_share(error, &behind, blocks) - predicted_share(error, &own, blocks)).max(0.0)
}

/// The output of a play: it stays constant while the signal moves by less than twice the half width.
fn play(signal: &[f64], half_width: f64) -> Vec<f64> {
    let mut at = 0.0;
    let follow = |x: &f64| {
        at = f64::clamp(at, x - half_width, x + half_width);
        at
    };
    signal.iter().map(follow).collect()
}

/// The share of the squared error in samples far from all others.
fn outliers(error: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = error.iter().map(|e| e.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let limit = OUTLIERS_FROM * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0) / NORMAL_MAD;
    let squares = |from: f64| sizes.iter().filter(|e| **e > from).map(|e| e * e).sum::<f64>();
    let all = squares(-1.0);
    if all > 0.0 { squares(limit) / all } else { 0.0 }
}
