//! How the torque acts on a rigid axis, with what happens within the samples around reversals.
//!
//! A drive holds its torque until it computes the next one, so that a logged torque acts half a sample late on average; it may also be logged before or after that.
//! An axis that sticks hides this: while it rests, its friction follows the torque, which in the fit looks like a delay. So the ways to act are compared by the likelihood
//! of the equation of motion, each with the passages through rest that it implies ([`passages`](super::passages)), and without them: a friction that does not jump
//! at zero has none. The time of rest says nothing, so the noise is that of the time of motion. A torque counts as held only if the delay that is estimated then
//! agrees with that.

use super::acting::Acting;
use super::basis::sign;
use super::clock_offset::ClockOffset;
use super::division::RIGID_FRICTION;
use super::equations::Equations;
use super::finding::Finding;
use super::limits::{LOGGED_ELSEWHERE, PASSAGES_AGAIN, STRIBECK_VELOCITIES};
use super::passages::{Law, Near, Passage};
use super::rigid::{INERTIA, RigidJoint, Signals, without};

/// The ways to act that are compared.
const ACTINGS: [Acting; 4] = [
    Acting::AT_ONCE,
    Acting::held_after(0.0),
    Acting::held_after(-1.0),
    Acting::held_after(1.0),
];

/// A way to act with the passages that it implies.
struct Explanation {
    acting: Acting,
    passages: Vec<Passage>,
    /// The noise of the equation.
    weights: Vec<Vec<f64>>,
    /// Twice the negative logarithm of the likelihood, with a penalty for unusual ways to act.
    score: f64,
}

/// A law of the motion near rest that was fitted.
struct LawFit {
    law: Law,
    offset: f64,
    /// The factors of inertia and position-dependent terms.
    factors: Vec<f64>,
    objective: f64,
}

/// How the torque acts, as the equation of motion says.
pub(super) struct Acts {
    /// The noise of the equation.
    pub weights: Vec<Vec<f64>>,
    pub finding: Option<Finding>,
}

impl Signals {
    /// How the torque acts. The torque and the passages are then those of it.
    pub fn acts(&mut self, joint: &RigidJoint, band: f64) -> Option<Acts> {
        let mut best: Option<(Explanation, Option<Finding>)> = None;
        // The delay that is estimated if the torque acts at its samples.
        let mut at_once = None;
        for acting in ACTINGS {
            for mut explanation in self.explanations(joint, acting, band) {
                explanation.score += if acting.is_usual() { 0.0 } else { LOGGED_ELSEWHERE };
                let is_worse = best.as_ref().is_some_and(|(best, _)| best.score < explanation.score);
                if explanation.score.is_nan() || is_worse {
                    continue;
                }
                if !acting.held {
                    at_once = self.delay(joint, &explanation);
                    best = Some((explanation, None));
                    continue;
                }
                let known = acting.delay * self.step;
                let delay = self.delay(joint, &explanation);
                // Passages that are simulated with a wrong delay pull its estimate towards it, so an unusual delay must also show with those of a
                // torque that acts at its samples.
                let near = |delay: &ClockOffset| delay.is_near(known, self.step);
                let shows = acting.is_usual() || at_once.as_ref().is_some_and(near);
                let delay = delay.filter(|delay| shows && near(delay));
                if let Some(ClockOffset { value: delay, .. }) = delay {
                    best = Some((explanation, Some(Finding::TorqueDelay { delay, held: true })));
                }
            }
        }
        let (best, finding) = best?;
        self.explain(joint, best.acting, best.passages);
        Some(Acts {
            weights: best.weights,
            finding,
        })
    }

    /// A way to act, without passages and with those that it implies.
    fn explanations(&mut self, joint: &RigidJoint, acting: Acting, band: f64) -> Vec<Explanation> {
        self.explain(joint, acting, Vec::new());
        let Some(mut weights) = self.weights(band) else {
            return Vec::new();
        };
        let plain = self.explanation(acting, &weights);
        // Before the passages are known, Coulomb friction looks like a Stribeck effect.
        for stribeck in [false, true] {
            for _ in 0..PASSAGES_AGAIN {
                let Some((law, offset, factors)) = self.law(joint, &weights, stribeck) else {
                    break;
                };
                if stribeck && law.stribeck == 0.0 {
                    break;
                }
                self.explain(joint, acting, self.simulated(joint, acting, law, offset, &factors));
                let Some(next) = self.weights(band) else { break };
                weights = next;
            }
        }
        let simulated = (!self.passages.is_empty()).then(|| self.explanation(acting, &weights));
        plain.into_iter().chain(simulated.flatten()).collect()
    }

    /// Takes the torque and the passages of an explanation.
    fn explain(&mut self, joint: &RigidJoint, acting: Acting, passages: Vec<Passage>) {
        let torque = acting.lines(&self.modulation, joint.torque, self.step);
        self.torque = without(torque, self.load.as_ref());
        if !passages.is_empty() {
            let mut resting = vec![0.0; joint.torque.len()];
            passages.iter().for_each(|p| resting[p.sample] = p.resting_torque);
            let mut resting = self.modulation.of(&resting);
            self.modulation.undo_mean(&mut resting);
            self.torque.iter_mut().zip(&resting).for_each(|(t, r)| *t -= r);
        }
        self.passages = passages;
    }

    /// What is explained now.
    fn explanation(&self, acting: Acting, weights: &[Vec<f64>]) -> Option<Explanation> {
        let system = self.system();
        let splines = system.curves[0].splines(&self.modulation, RIGID_FRICTION.coarse);
        let solved = system.solve(&[splines], weights)?;
        let rest: f64 = self.passages.iter().map(|p| 1.0 - p.share()).sum();
        let moving = 1.0 - rest / self.velocity.len() as f64;
        let lines = weights[0].iter().zip(&solved.solution.residuals[0]);
        Some(Explanation {
            acting,
            passages: self.passages.clone(),
            weights: weights.to_vec(),
            score: lines.map(|(s, r)| 2.0 * ((s / moving).ln() + r.norm_sqr() / s)).sum(),
        })
    }

    /// What the equation of motion says of inertia and friction near rest, with the offset and the factors of inertia and position-dependent terms; with a Stribeck
    /// effect if that is allowed and shows (Schwarz's criterion). `None` if the velocity was measured, or if no axis can move so.
    fn law(&self, joint: &RigidJoint, weights: &[Vec<f64>], stribeck: bool) -> Option<(Law, f64, Vec<f64>)> {
        if joint.velocity.is_some() {
            return None;
        }
        let plain = self.law_with(weights, None)?;
        let observations = 2.0 * self.modulation.len() as f64;
        let velocities = self.stribeck_velocities();
        let with = velocities.filter(|_| stribeck);
        let with = with.filter_map(|velocity| self.law_with(weights, Some(velocity)));
        let best = with.min_by(|a, b| a.objective.total_cmp(&b.objective));
        let better = best.filter(|best| best.objective + 2.0 * observations.ln() < plain.objective);
        let LawFit {
            law, offset, factors, ..
        } = better.unwrap_or(plain);
        law.is_possible().then_some((law, offset, factors))
    }

    /// Stribeck velocities to try, at equal ratios from the smallest velocity that is resolved to the largest one.
    fn stribeck_velocities(&self) -> impl Iterator<Item = f64> {
        let largest = self.velocity.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (from, ratio) = (self.resolution, largest / self.resolution);
        (1..STRIBECK_VELOCITIES).map(move |i| from * ratio.powf(i as f64 / STRIBECK_VELOCITIES as f64))
    }

    /// The same with a Stribeck effect of this velocity, or without one.
    fn law_with(&self, weights: &[Vec<f64>], stribeck: Option<f64>) -> Option<LawFit> {
        let system = self.system();
        let curve = &system.curves[0];
        let effect = stribeck.map(|velocity| curve.means_of(|v| sign(v) * (-(v / velocity).powi(2)).exp()));
        let means: Vec<Vec<f64>> = effect
            .into_iter()
            .chain([curve.means_of(sign), curve.means_of(|v| v), curve.means_of(|_| 1.0)])
            .collect();
        let columns = curve.lines_of(&self.modulation, &means);
        let columns = columns.into_iter().map(|lines| vec![Some(lines)]);
        let equations = Equations {
            columns: system.factors.iter().cloned().chain(columns).collect(),
            right: system.right.clone(),
            noise: weights.iter().map(Vec::as_slice).collect(),
            noisy: system.noisy.clone(),
            given: Vec::new(),
        };
        let solution = equations.solve()?;
        let (factors, friction) = solution.x.split_at(system.factors.len());
        let &[coulomb, viscous, offset] = friction.last_chunk()?;
        Some(LawFit {
            law: Law {
                inertia: factors[INERTIA],
                coulomb,
                viscous: viscous.max(0.0),
                stribeck: stribeck.map_or(0.0, |_| friction[0]),
                stribeck_velocity: stribeck.unwrap_or(f64::INFINITY),
            },
            offset,
            factors: factors.to_vec(),
            objective: solution.objective,
        })
    }

    /// The passages of an axis that moves so.
    fn simulated(&self, joint: &RigidJoint, acting: Acting, law: Law, offset: f64, factors: &[f64]) -> Vec<Passage> {
        let last = joint.torque.len() - 1;
        let drive = |time: f64| {
            let nearest = (time.round() as usize).min(last);
            let torque = acting.at(joint.torque, time) - joint.load_at(nearest);
            let extras = self.extras.iter().zip(&factors[INERTIA + 1..]);
            let others: f64 = extras.map(|(extra, factor)| factor * extra.values[nearest]).sum();
            [torque, torque - others - offset]
        };
        let near = Near {
            position: joint.position,
            velocity: &self.velocity,
            drive,
            law,
            step: self.step,
            encoder: self.encoder_sd,
            resolution: self.resolution,
            cut_off: self.cut_off,
        };
        near.passages()
    }

    /// The time from a sample of the torque to its effect, while the axis moves.
    fn delay(&mut self, joint: &RigidJoint, explanation: &Explanation) -> Option<ClockOffset> {
        let acting = explanation.acting;
        self.explain(joint, acting, explanation.passages.clone());
        let system = self.system();
        let splines = system.curves[0].tested(&self.modulation);
        let equations = system.equations(&[&splines], &explanation.weights);
        let last = equations.columns.len();
        let rate = self.modulation.of_rate(joint.torque);
        let rate = acting.late(&self.modulation, rate, self.step);
        let solution = equations.with_column(vec![Some(rate)]).solve()?;
        let known = acting.delay * self.step;
        let error = solution.covariance.error(last);
        Some(ClockOffset::new(known + solution.x[last], error, self.step))
    }
}
