//! A rigid axis: inertia and friction from position and torque.
//!
//! $$ \tau = M \ddot q + f(\dot q) + g_c \cos q + g_s \sin q + k q + L(t) $$
//!
//! where gravity and a spring are optional, f contains any offset, and L is a known load, such as that of the other joints of a chain.

use super::chain_load::JointLoad;
use super::checks;
use super::column_noise::Noisy;
use super::division::{RIGID_FRICTION, lowest};
use super::equations::Lines;
use super::finding::Finding;
use super::fourier::Modulation;
use super::free_outcome::FreeOutcome;
use super::joint_forms::FreeCurve;
use super::joint_signals::of_inertia;
use super::limits::{HIGHEST_RIGID, NOISE_ROUNDS, OTHER_INERTIA, RESOLVED, SAMPLES_A_CONSTANT};
use super::motion::modulation;
use super::outcome::{ChainFit, Estimated, Parameter, RigidAxis};
use super::passages::{Passage, while_moving};
use super::smooth::{Noise, Reflected};
use super::system::{Curve, CurveKind, FreeCurves, System, low_frequencies};
use crate::error::{DataError, Result};
use crate::quantiles::NORMAL_95;

/// A position-dependent term of a rigid axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extra {
    /// Gravity: cos q and sin q.
    Gravity,
    /// A spring: q.
    Spring,
}

/// The log of a rigid axis, and known values.
///
/// | field | unit | range |
/// |---|---|---|
/// | `position` | rad (or m) | finite, not constant, not wrapped; at least 200 samples |
/// | `torque` | N m (or N), on the side of the position | finite, not constant, as long |
/// | `velocity` | rad/s; derived by zero-phase smoothing if `None` | as long |
/// | `sample_time` | s | positive |
/// | `extras` | terms beyond inertia and friction | |
/// | `load` | of the other joints of a chain; `None` for an axis alone | as long |
/// | `level` | of the bands | between 0 and 1 |
#[derive(Debug, Clone, Copy)]
pub struct RigidJoint<'a> {
    /// The position.
    pub position: &'a [f64],
    /// The torque or force.
    pub torque: &'a [f64],
    /// The velocity, if it was measured.
    pub velocity: Option<&'a [f64]>,
    /// The sample time, s.
    pub sample_time: f64,
    /// Position-dependent terms.
    pub extras: &'a [Extra],
    /// What gravity and the other joints of a chain add.
    pub load: Option<&'a JointLoad>,
    /// The level of the bands.
    pub level: f64,
}

/// A position-dependent term.
pub(super) struct ExtraTerm {
    symbol: &'static str,
    unit: [i32; 2],
    pub values: Vec<f64>,
}

/// The transformed log of a rigid axis.
pub(super) struct Signals {
    pub modulation: Modulation,
    pub velocity: Vec<f64>,
    /// The smallest velocity that the data resolve.
    pub resolution: f64,
    /// The sample time, s.
    pub step: f64,
    /// The cut-off of smoothing, Hz.
    pub cut_off: f64,
    pub torque: Lines,
    /// The load.
    pub load: Option<Lines>,
    acceleration: Lines,
    /// The standard deviation of the encoder's noise.
    pub encoder_sd: f64,
    /// The spectrum of the encoder's noise in the acceleration.
    encoder: Vec<f64>,
    pub extras: Vec<ExtraTerm>,
    /// What is known of the motion within samples.
    pub passages: Vec<Passage>,
}

/// The number of the inertia among the factors; those of the position-dependent terms follow.
pub(super) const INERTIA: usize = 0;

impl RigidJoint<'_> {
    fn check(&self) -> Result<()> {
        let velocity = self.velocity.map(|v| ("velocity", v));
        let others: Vec<_> = [("torque", self.torque)].into_iter().chain(velocity).collect();
        let angles = [("position", self.position)];
        checks::log(self.position.len(), &angles, &others, self.sample_time, self.level)?;
        checks::load(self.load, self.position.len())
    }

    /// Identifies the axis.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data): `TooShort`, `NonFinite`, `Constant`, `LengthMismatch`, `Unit` and `WrappedAngle` for samples that cannot be used,
    /// `SampledTooSlowly`, and `TooLittleMotion` if the motion has too few frequencies, or does not separate inertia from friction;
    /// [`Error::Parameter`](crate::Error::Parameter) for a parameter outside its range.
    pub fn identify(&self) -> Result<RigidAxis> {
        self.check()?;
        let noise = Noise::of(self.position, self.sample_time);
        checks::resolved(&[noise], self.position.len(), self.sample_time)?;
        let signals = self.signals(&noise)?;
        let axis = self.axis(signals, &noise).ok_or(DataError::TooLittleMotion {
            what: "inertia and friction of the axis",
        });
        let mut axis = axis?;
        axis.findings
            .retain(|finding| !checks::is_limit(finding, self.torque, &axis.reconstructed));
        let mut axis = axis.distrusted();
        axis.polished = axis.polish(&self.free_torque(), self.position);
        let simulation = axis
            .polished
            .as_ref()
            .filter(|p| p.is_used)
            .map(|p| p.form.inertia.value);
        let equations = axis.friction.best().inertia.value;
        let other = simulation.filter(|simulation| (simulation / equations - 1.0).abs() > OTHER_INERTIA);
        let finding = |simulation| Finding::OtherInertia { equations, simulation };
        axis.findings.extend(other.map(finding));
        Ok(axis)
    }

    /// The load at a sample; 0 without one.
    pub(super) fn load_at(&self, sample: usize) -> f64 {
        self.load.map_or(0.0, |load| load.torque[sample])
    }

    /// The torque without the load.
    fn free_torque(&self) -> Vec<f64> {
        self.torque
            .iter()
            .enumerate()
            .map(|(i, torque)| torque - self.load_at(i))
            .collect()
    }

    fn signals(&self, noise: &Noise) -> Result<Signals> {
        let (q, step) = (self.position, self.sample_time);
        let modulation = modulation(q.len(), step, HIGHEST_RIGID, noise.band)?;
        let velocity = match self.velocity {
            Some(v) => v.to_vec(),
            None => Reflected::new(q, step).velocity(noise.cut_off()),
        };
        let term = |symbol, unit, value: fn(f64) -> f64| ExtraTerm {
            symbol,
            unit,
            values: q.iter().map(|&q| value(q)).collect(),
        };
        let extras = self.extras.iter().flat_map(|extra| match extra {
            Extra::Gravity => vec![
                term("gravity cos", [1, 0], f64::cos),
                term("gravity sin", [1, 0], f64::sin),
            ],
            Extra::Spring => vec![term("spring", [1, -1], |q| q)],
        });
        let load = self.load.map(|load| modulation.of(&load.torque));
        Ok(Signals {
            torque: without(modulation.of(self.torque), load.as_ref()),
            load,
            acceleration: modulation.of_acceleration(q),
            encoder: modulation.omega.iter().map(|w| (noise.sd * w * w).powi(2)).collect(),
            resolution: RESOLVED * noise.velocity_sd(step),
            encoder_sd: noise.sd,
            extras: extras.collect(),
            passages: Vec::new(),
            velocity,
            step,
            cut_off: noise.cut_off(),
            modulation,
        })
    }

    /// The axis; `None` if the equations do not determine it.
    fn axis(&self, mut signals: Signals, noise: &Noise) -> Option<RigidAxis> {
        let weights = signals.weights(noise.band)?;
        let sharpened = signals.sharpened(&self.free_torque(), &weights);
        if let Some(velocity) = sharpened.filter(|_| self.velocity.is_none()) {
            signals.velocity = velocity;
        }
        let acts = signals.acts(self, noise.band)?;
        let mut axis = self.solved(&signals, acts.weights, noise)?;
        axis.findings.extend(acts.finding);
        Some(axis)
    }

    /// The axis with these signals and this noise of the equation.
    fn solved(&self, signals: &Signals, weights: Vec<Vec<f64>>, noise: &Noise) -> Option<RigidAxis> {
        let system = signals.system();
        let free = signals.free_curve(&system, weights)?;
        let outcome = FreeOutcome::new(&system, &free, self.level)?;
        let mut axis = self.outcome(signals, &outcome, noise)?;
        axis.chain = self.load.map(|load| {
            let torque = while_moving(load.torque.clone(), &signals.passages);
            let missing = system.factor_of(&free, vec![Some(signals.modulation.of(&torque))]);
            ChainFit::new(load, axis.inertia, missing)
        });
        let findings = axis
            .chain
            .iter()
            .flat_map(|chain| chain.findings(axis.inertia, false))
            .collect::<Vec<_>>();
        axis.findings.extend(findings);
        Some(axis)
    }

    /// The result; `None` if not even the simplest form can be fitted.
    fn outcome(&self, signals: &Signals, outcome: &FreeOutcome, noise: &Noise) -> Option<RigidAxis> {
        let friction = FreeCurve {
            curve: 0,
            offset: true,
            inertia: Some(INERTIA),
        };
        let forms = outcome.forms(&[friction]).pop()?;
        let viscous = forms
            .first()?
            .parameter("Fv")
            .filter(|p| p.identifiable)
            .map(|p| p.value);
        let curve = &outcome.values[0];
        let factors = outcome.solved.factors();
        let acceleration = Reflected::new(&signals.velocity, self.sample_time).velocity(noise.cut_off());
        let others = |i: usize| {
            let extras = signals.extras.iter().zip(&factors[1..]);
            let position_dependent: f64 = extras.map(|(extra, c)| c * extra.values[i]).sum();
            factors[INERTIA] * acceleration[i] + position_dependent + self.load_at(i)
        };
        let partial = (0..curve.len()).map(|i| self.torque[i] - others(i)).collect();
        Some(RigidAxis {
            inertia: outcome.factor(INERTIA),
            friction: outcome.identified(0, outcome.band(0), forms, partial)?,
            extras: extra_parameters(
                &signals
                    .extras
                    .iter()
                    .map(|extra| (extra.symbol, extra.unit))
                    .collect::<Vec<_>>(),
                (0..signals.extras.len()).map(|i| outcome.factor(INERTIA + 1 + i)),
            ),
            cut_off: self.velocity.is_none().then(|| noise.cut_off()),
            highest: outcome.highest(),
            sample_time: self.sample_time,
            reconstructed: (0..curve.len()).map(|i| curve[i] + others(i)).collect(),
            stiff: None,
            polished: None,
            chain: None,
            findings: self.findings(signals, noise, viscous.map(|v| factors[INERTIA] / v)),
        })
    }

    /// The findings about the motion, for an axis of this mechanical time constant.
    fn findings(&self, signals: &Signals, noise: &Noise, time_constant: Option<f64>) -> Vec<Finding> {
        let step = self.sample_time;
        let mut findings = Vec::new();
        findings.extend(checks::clipped(self.torque));
        findings.extend(checks::motion(&signals.velocity, signals.resolution));
        if noise.unresolved {
            findings.push(Finding::SampledTooSlowly { step, band: noise.band });
        }
        let fast = time_constant.filter(|time| *time > 0.0 && *time < SAMPLES_A_CONSTANT * step);
        findings.extend(fast.map(|time_constant| Finding::FastTimeConstant { time_constant, step }));
        findings.extend(checks::many_turns(&[self.position]));
        findings
    }
}

impl Signals {
    /// The equation of the axis.
    pub fn system(&self) -> System<'_> {
        let values = |extra: &ExtraTerm| while_moving(extra.values.clone(), &self.passages);
        let extras = self.extras.iter().map(|extra| self.modulation.of(&values(extra)));
        let factors = std::iter::once(self.acceleration.clone()).chain(extras);
        System {
            modulation: &self.modulation,
            factors: factors.map(|column| vec![Some(column)]).collect(),
            right: vec![self.torque.clone()],
            noisy: vec![Noisy::square(INERTIA, 0, &self.encoder)],
            given: Vec::new(),
            encoder_noise: Box::new(|x| vec![of_inertia(&self.encoder, x[INERTIA])]),
            curves: vec![Curve {
                kind: CurveKind::Friction,
                x: &self.velocity,
                signs: vec![1.0],
                noise: Vec::new(),
                resolution: self.resolution,
                division: &RIGID_FRICTION,
                after: 1 + self.extras.len(),
                passages: &self.passages,
            }],
        }
    }

    /// The noise of the equation.
    pub fn weights(&self, band: f64) -> Option<Vec<Vec<f64>>> {
        let system = self.system();
        let splines = system.curves[0].splines(&self.modulation, RIGID_FRICTION.coarse);
        system.reweighted(&[splines], vec![low_frequencies(&self.modulation, band)], NOISE_ROUNDS)
    }

    /// The free curve with the smallest criterion of Schwarz, and the next finer one, which shows the details that the first one smooths
    /// away.
    fn free_curve(&self, system: &System, noise: Vec<Vec<f64>>) -> Option<FreeCurves> {
        let curve = &system.curves[0];
        let splines = |pieces: usize| curve.splines(&self.modulation, pieces);
        let observations = 2.0 * self.modulation.len() as f64;
        let scores = RIGID_FRICTION.candidates.iter().map(|&pieces| {
            let solution = system.equations(&[&splines(pieces)], &noise).solve()?;
            let schwarz = solution.x.len() as f64 * observations.ln();
            Some(observations * (solution.squares / observations).ln() + schwarz)
        });
        let best = lowest(scores)?;
        Some(FreeCurves {
            splines: vec![splines(RIGID_FRICTION.candidates[best])],
            finer: vec![splines(RIGID_FRICTION.finer(best))],
            tested: system.tested(),
            noise,
        })
    }
}

/// A transformed torque without the load.
pub(super) fn without(mut torque: Lines, load: Option<&Lines>) -> Lines {
    let loads = load.into_iter().flatten();
    torque.iter_mut().zip(loads).for_each(|(torque, load)| *torque -= load);
    torque
}

/// Position-dependent terms of these symbols and units as parameters.
pub(super) fn extra_parameters(
    terms: &[(&'static str, [i32; 2])],
    estimates: impl Iterator<Item = Estimated>,
) -> Vec<Parameter> {
    let parameter = |(&(symbol, unit), estimated): (&(&str, [i32; 2]), Estimated)| {
        let near = NORMAL_95 * estimated.standard_error;
        Parameter {
            symbol: symbol.to_owned(),
            unit,
            value: estimated.value,
            standard_error: estimated.standard_error,
            identifiable: true,
            range: [estimated.value - near, estimated.value + near],
            remark: String::new(),
        }
    };
    terms.iter().zip(estimates).map(parameter).collect()
}
