//! What else acts on a joint: which effects its log shows, and which explain it equally well.
//!
//! To first order an offset sigma of the link's clock is a viscous friction $-\sigma\kappa'$ at the motor, the opposite one at the link,
//! and a damping of the joint that has the opposite sign in the two equations. So friction at the motor, damping and late
//! samples explain each other in part, and one alone may not be taken for fact because it improves the fit. All
//! [effects](super::effects) are estimated together first, with the delay of the torque. A set of effects is *refuted* if its friction or damping
//! drives the joint, or if all effects together explain more than chance allows. With the weighted sums of squares S of the set and $S_0$ of all
//! effects, and with p unknowns fewer, this is an F test at the level [`REFUTED`]:
//!
//! $$ F = \frac{S - S_0 - C}{p\, s} . $$
//!
//! Here s is the variance of what the weights normalise, and C is what the noise of a smoothed deflection may add ([`Full::confusion`]).
//!
//! The smallest set that is not refuted is taken, and of several that with the least S. Where one of its effects can be replaced by another
//! one, both stay in the equations. The errors of the result then contain what cannot be told apart.

use super::checks;
use super::clock_offset::{ClockOffset, Clocks};
use super::clocks::Stiffness;
use super::compliance::Compliance;
use super::covariance::Robust;
use super::fourier::Modulation;
use super::joint_signals::JointSignals;
use super::kinks::Kinks;
use super::limits::{CLOCK_PASSES, CLOCKS_SETTLED, DRIVES, LONGEST_CLOCK_STEP, NOISE_ROUNDS, REFUTED, SIGNIFICANT};
use super::motion::Motion;
use super::normal::Normal;
use super::outcome::Effect;
use super::smooth::Reflected;
use super::system::{Solved, low_frequencies};
use crate::distributions::fisher_below;
use crate::linalg::Matrix;

/// What was found to act on a joint.
pub(super) struct Explained {
    pub clocks: Clocks,
    /// The effects in the equations.
    pub effects: Vec<Effect>,
    /// Those of them that other ones replace equally well.
    pub competing: Vec<Effect>,
    /// The stiffness, by which late samples enter the equations.
    pub stiffness: Stiffness,
    /// What smoothing removes from the velocities.
    pub kinks: Kinks,
}

/// A joint's log about what is known of its clocks.
struct About<'a> {
    /// The effects that may act, in the order of `Effect::ALL`.
    possible: &'a [Effect],
    motion: &'a Motion<'a>,
    modulation: &'a Modulation,
    link: &'a Reflected,
    clocks: Clocks,
    stiffness: Option<Stiffness>,
    kinks: Kinks,
}

/// The equations of all effects, solved.
struct Full {
    noise: Vec<Vec<f64>>,
    /// By how much more than the weights say sums of squares vary.
    spread: f64,
    /// The real equations less the unknowns.
    freedom: f64,
    /// What the noise of a smoothed deflection may add to a weighted sum of squares, see [`About::confusion`].
    confusion: f64,
}

/// The equations of all effects about an offset of the link's clock, as inner products.
struct Products {
    offset: f64,
    gram: Matrix,
    moments: Vec<f64>,
    square: f64,
    /// The numbers of the unknowns of each effect.
    effects: Vec<(Effect, Vec<usize>)>,
    /// The powers of friction at link and motor.
    powers: [Vec<Power>; 2],
}

/// The power of one spline of a friction curve.
struct Power {
    /// The number of its unknown.
    unknown: usize,
    /// What it takes from the motion if its coefficient is 1: force times velocity, summed over the lines.
    value: f64,
}

/// The best that a set of effects can do.
#[derive(Clone)]
struct Best {
    effects: Vec<Effect>,
    objective: f64,
    unknowns: usize,
    /// The offset of the link's clock.
    offset: ClockOffset,
    /// Whether friction or damping would drive the joint.
    drives: bool,
}

impl<'a> About<'a> {
    /// The equations with these effects; `delay`: with a further delay of the torque.
    fn joint(&self, effects: &[Effect], delay: bool) -> JointSignals<'a> {
        let (motion, modulation) = (self.motion, self.modulation);
        let link = match self.clocks.link_offset.value {
            0.0 => motion.link.to_vec(),
            offset => self.link.shifted(offset),
        };
        let torque = self.clocks.torque(modulation, motion);
        let joint = JointSignals::new(motion, modulation, torque, &link, &self.kinks);
        let joint = joint.with(motion, &link, effects, self.stiffness.as_ref());
        match delay {
            true => joint.delayed(motion),
            false => joint,
        }
    }

    /// The clocks, the stiffness and the noise with all effects, by Gauss-Newton steps.
    fn settle(&mut self) -> Option<Full> {
        let flat = vec![1.0; self.modulation.len()];
        let mut noise = vec![flat, low_frequencies(self.modulation, self.motion.link_noise.band)];
        for pass in 0.. {
            let joint = self.joint(self.possible, true);
            // A motion of few reversals takes a curved friction for a late clock.
            self.clocks.determined &= checks::motion(&joint.v, 0.0).is_none();
            let system = joint.system();
            let splines = system.tested();
            if pass == 0 {
                noise = system.reweighted(&splines, noise, NOISE_ROUNDS)?;
            }
            let solved = system.solve(&splines, &noise)?;
            let robust = solved.equations.robust(&solved.solution);
            let unknowns = solved.solution.x.len() as f64;
            let full = Full {
                confusion: self.confusion(&joint, &solved, &noise[0]),
                spread: (robust.taken / unknowns).max(1.0),
                freedom: 2.0 * solved.solution.lines() as f64 - unknowns,
                noise: system.unbiased_noise_of(&solved),
            };
            let settled = self.set_clocks(&joint, &solved, &robust)?;
            self.kinks = Kinks::new(&joint, self.motion, &solved, &splines);
            self.stiffness = Some(Stiffness {
                coefficients: solved.coefficients(0).to_vec(),
                basis: splines[0].basis.clone(),
            });
            if settled || pass == CLOCK_PASSES {
                return Some(full);
            }
            noise = full.noise;
        }
        None
    }

    /// Moves the clocks by what a solution with all effects says. The result is whether they have settled.
    fn set_clocks(&mut self, joint: &JointSignals, solved: &Solved, robust: &Robust) -> Option<bool> {
        let step = self.motion.step;
        let clocks = &mut self.clocks;
        let (held, determined) = (clocks.torque_held, clocks.determined);
        let factor = |effect: Option<Effect>| {
            let number = solved.layout.factors.get(joint.factors_of(effect).next()?)?;
            Some((solved.solution.x[*number], robust.covariance.error(*number)))
        };
        let offset_of = |value: f64, error: f64| {
            let offset = ClockOffset::new(value, error, step);
            ClockOffset {
                significant: determined && offset.significant,
                ..offset
            }
        };
        let (further, error) = factor(None)?;
        let delay = offset_of(clocks.delay(step) + further, error);
        clocks.torque_held = determined && (held || delay.is_hold(step));
        clocks.torque_delay = delay;
        let Some((change, error)) = factor(Some(Effect::EncoderSkew)) else {
            return Some(false);
        };
        let longest = LONGEST_CLOCK_STEP * step;
        let offset = clocks.link_offset.value + change.clamp(-longest, longest);
        clocks.link_offset = offset_of(offset, error);
        Some(held == clocks.torque_held && change.abs() < CLOCKS_SETTLED * error)
    }

    /// What the noise of a smoothed deflection may add to a weighted sum of squares.
    ///
    /// Because of it the motor's inertia J may be off by a share c of itself. The motor's equation is then off by c J times the rotor's acceleration a.
    /// With noise of spectrum s that adds $2 (cJ)^2 \sum |a|^2 / s$: every line is two real equations, of variance s / 2 each.
    fn confusion(&self, joint: &JointSignals, solved: &Solved, noise: &[f64]) -> f64 {
        let inertia = self
            .motion
            .motor_inertia
            .map_or_else(|| solved.factors()[0], |known| known.value);
        let off = (inertia * joint.deflection.confusion).powi(2);
        let acceleration = self.motion.rotor_acceleration(self.modulation);
        let lines = acceleration.iter().zip(noise);
        lines.map(|(a, s)| 2.0 * off * a.norm_sqr() / s).sum()
    }

    /// The equations of all effects with this noise about this offset of the link's clock.
    fn products(&self, offset: f64, noise: &[Vec<f64>]) -> Option<Products> {
        let link_offset = ClockOffset {
            value: offset,
            ..self.clocks.link_offset
        };
        let about = About {
            clocks: Clocks {
                link_offset,
                ..self.clocks
            },
            stiffness: self.stiffness.clone(),
            kinks: self.kinks.clone(),
            ..*self
        };
        let joint = about.joint(self.possible, !self.clocks.torque_held);
        let system = joint.system();
        let splines = system.tested();
        let equations = system.equations(&splines, noise);
        let layout = system.layout(&splines);
        let own = |effect: Effect| match effect {
            Effect::MotorFriction => layout.curves[2].clone().collect(),
            _ => joint
                .factors_of(Some(effect))
                .map(|factor| layout.factors[factor])
                .collect(),
        };
        // `sign` is that of the friction in its equation: what brakes takes a positive power.
        let powers = |curve: usize, block: usize, sign: f64, angle: &[f64]| {
            let velocity = self.modulation.of_rate(angle);
            let power = |unknown: usize| {
                let lines = equations.columns[unknown][block].as_ref()?.iter().zip(&velocity);
                let value = sign * lines.map(|(force, v)| (force * v.conj()).re).sum::<f64>();
                Some(Power { unknown, value })
            };
            layout.curves[curve].clone().filter_map(power).collect::<Vec<_>>()
        };
        let weights = equations.weights();
        let squares = equations.right.iter().zip(&weights);
        Some(Products {
            offset,
            gram: equations.gram(equations.columns.len())?.products,
            moments: equations.moments(),
            square: squares
                .map(|(right, w)| right.iter().zip(w).map(|(r, w)| w * r.norm_sqr()).sum::<f64>())
                .sum(),
            powers: [
                powers(1, 1, -1.0, self.motion.link),
                powers(2, 0, 1.0, self.motion.motor),
            ],
            effects: self.possible.iter().map(|&effect| (effect, own(effect))).collect(),
        })
    }
}

impl Products {
    /// The best that these effects can do, to first order.
    fn best(&self, effects: &[Effect], step: f64) -> Option<Best> {
        let out: Vec<usize> = (self.effects.iter())
            .filter(|(effect, _)| !effects.contains(effect))
            .flat_map(|(_, own)| own.iter().copied())
            .collect();
        let kept: Vec<usize> = (0..self.moments.len()).filter(|i| !out.contains(i)).collect();
        let n = kept.len();
        let gram = Matrix::from_fn(n, n, |i, j| self.gram[(kept[i], kept[j])]);
        let moments = Matrix::from_fn(n, 1, |i, _| self.moments[kept[i]]);
        let normal = Normal::new(&gram)?;
        let x = normal.solve(&moments)?;
        let covariance = normal.covariance()?;
        let along = (&gram * &x - &moments * 2.0).dot(&x);
        let place = |number: usize| kept.iter().position(|k| *k == number);
        let of = |effect: Effect| {
            let (_, own) = self.effects.iter().find(|(e, _)| *e == effect)?;
            let at = place(*own.first()?)?;
            Some((x[at], covariance.error(at)))
        };
        let power = |own: &[Power]| -> f64 {
            own.iter()
                .filter_map(|power| Some(x[place(power.unknown)?] * power.value))
                .sum()
        };
        let [link, motor] = [0, 1].map(|i| power(&self.powers[i]));
        let damping_drives = of(Effect::Damping).is_some_and(|(c, error)| c < -SIGNIFICANT * error);
        // Without this effect there is no offset.
        let (change, error) = of(Effect::EncoderSkew).unwrap_or((-self.offset, f64::INFINITY));
        Some(Best {
            effects: effects.to_vec(),
            objective: self.square + along,
            unknowns: n,
            offset: ClockOffset::new(self.offset + change, error, step),
            drives: damping_drives || link.min(motor) < -DRIVES * link.abs().max(motor.abs()),
        })
    }
}

/// Which of the possible effects act on the joint of a log; `None` if its equations do not determine it.
pub(super) fn explained(motion: &Motion, modulation: &Modulation, possible: &[Effect]) -> Option<Explained> {
    let none = ClockOffset::new(0.0, f64::INFINITY, motion.step);
    // Beside an offset the deflection of a stiff joint is too small for the first pass to find its way.
    let stiff = motion.compliance(modulation).filter(Compliance::is_stiff);
    let mut about = About {
        possible,
        motion,
        modulation,
        link: &Reflected::new(motion.link, motion.step),
        clocks: Clocks {
            link_offset: stiff.map_or(none, |found| found.link_offset),
            torque_delay: none,
            torque_held: false,
            determined: true,
        },
        stiffness: None,
        kinks: Kinks::default(),
    };
    let full = about.settle()?;
    let mut cases = Cases {
        products: vec![
            about.products(0.0, &full.noise)?,
            about.products(about.clocks.link_offset.value, &full.noise)?,
        ],
        about,
        full,
    };
    let everything = cases.best(possible)?;
    let chosen = cases.chosen(&everything);
    let competing = cases.competing(&chosen, &everything);
    let acting = |effect: &Effect| chosen.effects.contains(effect) || competing.contains(effect);
    let effects: Vec<Effect> = Effect::ALL.into_iter().filter(acting).collect();
    // Of an offset that is not needed it is reported how small it is.
    let skewed = |effect: &Effect| effects.contains(effect) || *effect == Effect::EncoderSkew;
    let skewed: Vec<Effect> = Effect::ALL.into_iter().filter(skewed).collect();
    let offset = cases.best(&skewed)?.offset;
    let significant = cases.about.clocks.determined && effects.contains(&Effect::EncoderSkew);
    let About {
        clocks,
        stiffness,
        kinks,
        ..
    } = cases.about;
    Some(Explained {
        clocks: Clocks {
            link_offset: ClockOffset {
                significant: significant && offset.significant,
                ..offset
            },
            ..clocks
        },
        effects,
        competing,
        stiffness: stiffness?,
        kinks,
    })
}

/// Sets of effects, compared with all effects together.
struct Cases<'a> {
    about: About<'a>,
    full: Full,
    /// About no offset of the clock, about that of all effects, and about further ones.
    products: Vec<Products>,
}

impl Cases<'_> {
    /// The smallest set of effects that is not refuted; all of them if every smaller one is.
    fn chosen(&mut self, everything: &Best) -> Best {
        let possible = self.about.possible;
        for size in 0..possible.len() {
            let sets = (0..1_u32 << possible.len()).filter(|set| set.count_ones() as usize == size);
            let members = |set: u32| {
                let numbered = possible.iter().enumerate();
                numbered.filter(move |(i, _)| set >> i & 1 == 1)
            };
            let found: Vec<Best> = sets
                .filter_map(|set| self.best(&members(set).map(|(_, &effect)| effect).collect::<Vec<_>>()))
                .collect();
            let held = found.into_iter().filter(|best| !self.refuted(best, everything));
            if let Some(best) = held.min_by(|a, b| a.objective.total_cmp(&b.objective)) {
                return best;
            }
        }
        everything.clone()
    }

    /// The effects of the chosen set that another effect can replace without being refuted, and those others; in the order of `Effect::ALL`.
    fn competing(&mut self, chosen: &Best, everything: &Best) -> Vec<Effect> {
        let mut competing = Vec::new();
        for &effect in &chosen.effects {
            for &other in self.about.possible.iter().filter(|e| !chosen.effects.contains(e)) {
                let swap = |&e: &Effect| if e == effect { other } else { e };
                let swapped: Vec<Effect> = chosen.effects.iter().map(swap).collect();
                let best = self.best(&swapped);
                if best.is_some_and(|best| !self.refuted(&best, everything)) {
                    competing.extend([effect, other]);
                }
            }
        }
        competing.sort_unstable_by_key(|effect| Effect::ALL.iter().position(|e| e == effect));
        competing.dedup();
        competing
    }

    /// The best that these effects can do.
    fn best(&mut self, effects: &[Effect]) -> Option<Best> {
        let step = self.about.motion.step;
        if !effects.contains(&Effect::EncoderSkew) {
            return self.products[0].best(effects, step);
        }
        let mut offset = self.about.clocks.link_offset.value;
        for pass in 0..CLOCK_PASSES {
            let distance = |products: &Products| (products.offset - offset).abs();
            let nearest = self.products[1..]
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            let found = nearest.best(effects, step)?;
            let change = found.offset.value - nearest.offset;
            if change.abs() < CLOCKS_SETTLED * found.offset.standard_error || pass + 1 == CLOCK_PASSES {
                return Some(found);
            }
            offset = nearest.offset + change.clamp(-LONGEST_CLOCK_STEP * step, LONGEST_CLOCK_STEP * step);
            let next = self.about.products(offset, &self.full.noise)?;
            self.products.push(next);
        }
        None
    }

    /// Whether all effects explain more than these, beyond chance, or these would drive the joint.
    fn refuted(&self, best: &Best, everything: &Best) -> bool {
        let spread = self.full.spread.max(everything.objective / self.full.freedom);
        let more = everything.unknowns.saturating_sub(best.unknowns).max(1) as f64;
        let explained = best.objective - everything.objective - self.full.confusion;
        let statistic = (explained / more / spread).max(0.0);
        let p = 1.0 - fisher_below(statistic, [more, self.full.freedom]);
        best.drives || p < REFUTED
    }
}
