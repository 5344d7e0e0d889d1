//! The passages of a rigid axis through rest, simulated within the samples.
//!
//! Where the velocity changes its sign, friction jumps at some time between two samples, and the axis may rest for a part of a sample. Smoothed samples of the
//! velocity show neither. A jump at a wrong time looks like another inertia, and a friction that holds the axis looks like a delay of the torque or like a Stribeck
//! effect: in simulated logs, an axis that rested for 3 % of the time had a delay that was off by half a sample. So the motion around each reversal is simulated,
//!
//! $$ M \ddot q = \tau - f(\dot q), \qquad \lvert f \rvert \le F_c \text{ at rest}, $$
//!
//! from the velocity with which it comes nearest to the logged positions. The curve of the friction is then averaged over the simulated velocities. While the axis
//! rests, the equation of motion says nothing: torque and friction are left out for that part of a sample.

use super::equations::dot;
use super::limits::{PASSAGE_ROUNDS, PASSAGE_SUBSTEPS, SLOW};

/// What happens within a sample, from half way before it to half way after it.
#[derive(Debug, Clone, Default)]
pub(super) struct Passage {
    pub sample: usize,
    /// The velocities at which the axis moves, each with its share of the sample's time.
    pub moving: Vec<[f64; 2]>,
    /// The torque at rest, times the share of the sample's time for which the axis rests.
    pub resting_torque: f64,
}

impl Passage {
    /// The share of the time for which the axis moves.
    pub fn share(&self) -> f64 {
        self.moving.iter().map(|[_, share]| share).sum()
    }

    /// The mean of a function of the velocity, which is zero at rest.
    pub fn mean_of(&self, f: impl Fn(f64) -> f64) -> f64 {
        self.moving.iter().map(|&[v, share]| share * f(v)).sum()
    }
}

/// A signal without the part of each sample for which the axis rests.
pub(super) fn while_moving(mut signal: Vec<f64>, passages: &[Passage]) -> Vec<f64> {
    passages.iter().for_each(|p| signal[p.sample] *= p.share());
    signal
}

/// The motion of an axis near rest: a friction that jumps at zero and rises evenly, with a Stribeck effect if `stribeck` is not zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Law {
    pub inertia: f64,
    pub coulomb: f64,
    pub viscous: f64,
    /// What friction is larger by at rest than the Coulomb friction.
    pub stribeck: f64,
    pub stribeck_velocity: f64,
}

/// A part of a step: how long it lasts, and the mean velocity.
type Part = [f64; 2];

impl Law {
    /// The friction at this speed without its viscous part.
    fn dry(&self, speed: f64) -> f64 {
        match self.stribeck == 0.0 {
            true => self.coulomb,
            false => self.coulomb + self.stribeck * (-(speed / self.stribeck_velocity).powi(2)).exp(),
        }
    }

    /// Whether an axis can move so.
    pub fn is_possible(&self) -> bool {
        self.inertia > 0.0 && self.coulomb > 0.0 && self.dry(0.0) > 0.0
    }

    /// Moves a velocity on for `time` s under a constant torque; calls `part` for each part between changes of the sign.
    fn moved(&self, mut v: f64, torque: f64, mut time: f64, mut part: impl FnMut(Part)) -> f64 {
        while time > 0.0 {
            if v == 0.0 && torque.abs() <= self.dry(0.0) {
                part([time, 0.0]);
                break;
            }
            let sign = if v == 0.0 { torque.signum() } else { v.signum() };
            let acceleration = |at: f64| {
                let drive = torque - sign * self.dry(at.abs()) - self.viscous * v;
                drive / (self.inertia + 0.5 * self.viscous * time)
            };
            let middle = v + 0.5 * time * acceleration(v);
            let acceleration = acceleration(if middle * sign > 0.0 { middle } else { 0.0 });
            let next = v + acceleration * time;
            if next * sign >= 0.0 {
                part([time, 0.5 * (v + next)]);
                return next;
            }
            let until_rest = (-v / acceleration).min(time);
            part([until_rest, 0.5 * v]);
            time -= until_rest;
            v = 0.0;
            if until_rest == 0.0 {
                part([time, 0.0]);
                break;
            }
        }
        v
    }
}

/// A log, and what drives it besides friction.
pub(super) struct Near<'a, D> {
    pub position: &'a [f64],
    pub velocity: &'a [f64],
    /// The logged torque and the torque less all other terms but friction's jump and slope, at a time in samples.
    pub drive: D,
    pub law: Law,
    /// s.
    pub step: f64,
    /// The standard deviation of the position's noise.
    pub encoder: f64,
    /// Velocities below this cannot be told from zero.
    pub resolution: f64,
    /// The cut-off of smoothing, Hz.
    pub cut_off: f64,
}

impl<D: Fn(f64) -> [f64; 2]> Near<'_, D> {
    /// What happens within the samples around all reversals.
    pub fn passages(&self) -> Vec<Passage> {
        self.stretches()
            .into_iter()
            .flat_map(|stretch| self.passage(stretch))
            .collect()
    }

    /// The first and the last sample of each stretch to simulate: the samples at which the velocity is near zero or changes its sign, and as many on either
    /// side as smoothing mixes, but no further than half way to the next such samples.
    fn stretches(&self) -> Vec<[usize; 2]> {
        let v = self.velocity;
        let near: Vec<bool> = (0..v.len())
            .map(|i| {
                let changes = |j: usize| v.get(j).is_some_and(|other| other * v[i] < 0.0);
                v[i].abs() < SLOW * self.resolution || changes(i + 1) || i.checked_sub(1).is_some_and(changes)
            })
            .collect();
        let around = (1.0 / (self.cut_off * self.step)).ceil() as usize + 1;
        let mut cores: Vec<[usize; 2]> = Vec::new();
        let mut first = 0;
        for run in near.chunk_by(|a, b| a == b) {
            let last = first + run.len() - 1;
            if run[0] {
                match cores.last_mut().filter(|before| first - before[1] <= around) {
                    Some(before) => before[1] = last,
                    None => cores.push([first, last]),
                }
            }
            first = last + 1;
        }
        let mut stretches = Vec::new();
        for (i, &[first, last]) in cores.iter().enumerate() {
            // The first and the last sample of a stretch are not simulated in full, so neighbours have two samples in common.
            let before = i.checked_sub(1).map_or(0, |j| (cores[j][1] + first) / 2);
            let after = cores.get(i + 1).map_or(v.len() - 1, |next| (last + next[0]) / 2 + 1);
            let stretch = [first.saturating_sub(around).max(before), (last + around).min(after)];
            if stretch[1] > stretch[0] + 2 {
                stretches.push(stretch);
            }
        }
        stretches
    }

    /// Simulates a stretch from this velocity; calls `part` with the substep of each part.
    fn positions(&self, [first, last]: [usize; 2], start: f64, mut part: impl FnMut(usize, Part)) -> Vec<f64> {
        let h = self.step / PASSAGE_SUBSTEPS as f64;
        let (mut v, mut q) = (start, 0.0);
        let mut positions = vec![0.0];
        for i in 0..(last - first) * PASSAGE_SUBSTEPS {
            let [_, drive] = (self.drive)(first as f64 + (i as f64 + 0.5) / PASSAGE_SUBSTEPS as f64);
            v = self.law.moved(v, drive, h, |[time, mean]| {
                q += time * mean;
                part(i, [time, mean]);
            });
            if (i + 1) % PASSAGE_SUBSTEPS == 0 {
                positions.push(q);
            }
        }
        positions
    }

    /// The errors of the simulated positions about their mean: the initial position is free.
    fn errors(&self, stretch: [usize; 2], start: f64) -> Vec<f64> {
        let simulated = self.positions(stretch, start, |_, _| {});
        let logged = &self.position[stretch[0]..=stretch[1]];
        let mut errors: Vec<f64> = logged.iter().zip(&simulated).map(|(q, s)| q - s).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        errors.iter_mut().for_each(|e| *e -= mean);
        errors
    }

    /// The initial velocity with which the simulated positions come nearest to the logged ones, and which is near the smoothed velocity itself.
    fn start(&self, stretch: [usize; 2]) -> f64 {
        let smoothed = self.velocity[stretch[0]];
        let errors = |v: f64| -> Vec<f64> {
            let positions = self.errors(stretch, v).into_iter().map(|e| e / self.encoder);
            positions.chain([(smoothed - v) / self.resolution]).collect()
        };
        let mut best = smoothed;
        let mut at_best = errors(best);
        for _ in 0..PASSAGE_ROUNDS {
            let moved = errors(best + self.resolution);
            let slopes: Vec<f64> = at_best
                .iter()
                .zip(&moved)
                .map(|(a, b)| (a - b) / self.resolution)
                .collect();
            let next = best + dot(&at_best, &slopes) / dot(&slopes, &slopes);
            let there = errors(next);
            if !(dot(&there, &there) < dot(&at_best, &at_best)) {
                break;
            }
            (best, at_best) = (next, there);
        }
        best
    }

    /// What happens within the samples of a stretch but its first and last one.
    fn passage(&self, stretch: [usize; 2]) -> Vec<Passage> {
        let [first, last] = stretch;
        let mut passages: Vec<Passage> = (first..=last)
            .map(|sample| Passage {
                sample,
                ..Passage::default()
            })
            .collect();
        self.positions(stretch, self.start(stretch), |i, [time, v]| {
            let passage = &mut passages[(i + PASSAGE_SUBSTEPS / 2) / PASSAGE_SUBSTEPS];
            let share = time / self.step;
            if v == 0.0 {
                let [torque, _] = (self.drive)(first as f64 + (i as f64 + 0.5) / PASSAGE_SUBSTEPS as f64);
                passage.resting_torque += share * torque;
            } else {
                passage.moving.push([v, share]);
            }
        });
        passages.pop();
        passages.remove(0);
        passages
    }
}
