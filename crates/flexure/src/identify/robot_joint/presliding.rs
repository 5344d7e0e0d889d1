//! Whether friction turns over a distance after a reversal, or at once.
//!
//! An ideal Coulomb friction also looks like one with memory in the equations of motion: the zero of a smoothed velocity is not where the friction turns,
//! and a body that sticks for a shorter time than the smoothing resolves has the friction that the other torques leave. So both are simulated, with
//! stick, in stretches of the log. Friction with memory is a fact if the stretches with it are nearer to the log, by more than chance from
//! stretch to stretch.

use super::effects::stop;
use super::limits::{POLISH_ROUNDS, PRESLIDING_ROUNDS, PRESLIDING_SURE};
use super::stretches::{FormedJoint, Logged, Nearest, Stretch};
use crate::linear::correlation::mean;

impl FormedJoint {
    /// Whether friction that turns over one of these distances simulates the stretches of a log better than friction that turns at once.
    pub fn presliding(&self, log: &Logged, distances: impl Iterator<Item = f64>) -> bool {
        let (search, stretches) = self.search(log);
        let Some(first) = search.nearest(self.clone(), stretches, POLISH_ROUNDS) else {
            return false;
        };
        // Both start there, and have the same number of rounds.
        let from_first = |turns_over: Option<f64>| {
            let turned = turns_over.map(|distance| stop(log.link, distance));
            let start = |stretch: &Stretch| Stretch {
                turned: turned.as_ref().map_or(0.0, |turned| turned[stretch.first]),
                ..*stretch
            };
            let joint = FormedJoint {
                turns_over,
                ..first.joint.clone()
            };
            search.nearest(joint, first.stretches.iter().map(start).collect(), PRESLIDING_ROUNDS)
        };
        let Some(ideal) = from_first(None) else {
            return false;
        };
        let turning = distances.filter_map(|distance| from_first(Some(distance)));
        let Some(turning) = turning.min_by(|a, b| a.size.total_cmp(&b.size)) else {
            return false;
        };
        let logarithms = |near: &Nearest| -> Vec<f64> {
            let square = |stretch: &Stretch| {
                let errors = search.errors(&near.joint, stretch, &ideal.white);
                errors.iter().map(|e| e * e).sum::<f64>().ln()
            };
            near.stretches.iter().map(square).collect()
        };
        let both = logarithms(&ideal).into_iter().zip(logarithms(&turning));
        let gains: Vec<f64> = both.map(|(ideal, turning)| ideal - turning).collect();
        let gain = mean(&gains);
        let variance = gains.iter().map(|g| (g - gain).powi(2)).sum::<f64>() / (gains.len() as f64).powi(2);
        gain > PRESLIDING_SURE * variance.sqrt()
    }
}
