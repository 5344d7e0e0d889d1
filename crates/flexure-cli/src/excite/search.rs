//! The largest signals under which the simulated arm keeps within its limits.

use std::ops::ControlFlow;

use anyhow::{Result, anyhow};
use flexure::manipulator::{Arm, Drive, SimulationOptions, simulate_watched};
use flexure::{Interrupt, Record};

use super::{Arguments, Extremes, SignalKind, signals};

/// Rounds of simulating and changing the size.
const ROUNDS: usize = 20;
/// A signal that comes to this share of a limit is large enough.
const NEAR: f64 = 0.97;
/// The torques themselves may reach their limit exactly.
const ROUNDING: f64 = 1e-9;
/// The next signal is to reach this share of its limit.
const AIM: f64 = 0.99;

/// The gains of a servo with torque = kp (reference - motor angle) - kd motor velocity.
#[derive(Debug, Clone, Copy)]
pub struct Gains {
    /// N m/rad.
    pub kp: f64,
    /// N m s/rad.
    pub kd: f64,
}

/// What is simulated in every trial.
pub struct Setup<'a> {
    pub arm: &'a Arm,
    pub options: &'a SimulationOptions,
    /// Which joints are not locked.
    pub free: [bool; 2],
    pub limits: [Extremes; 2],
    pub gains: [Gains; 2],
}

/// Signals of some size, and what the arm does under them.
pub struct Trial {
    /// The signals as they are written, torques or references.
    pub signals: [Vec<f64>; 2],
    /// The arm's motion, without noise.
    pub motion: Record,
    pub reached: [Extremes; 2],
}

impl Trial {
    /// Simulates the arm under signals of this scale.
    ///
    /// `progress` is called with the simulated time.
    fn new(
        setup: &Setup,
        reference: bool,
        unit: &[Vec<f64>; 2],
        scale: [f64; 2],
        progress: impl Fn(f64),
    ) -> flexure::Result<Self> {
        let initial = &setup.options.initial;
        let signals = [0, 1].map(|i| -> Vec<f64> {
            let about = if reference { initial.qm[i] } else { 0.0 };
            unit[i].iter().map(|v| about + scale[i] * v).collect()
        });
        let columns = [signals[0].as_slice(), signals[1].as_slice()];
        let drive = match reference {
            false => Drive::Held(columns),
            true => Drive::Servo {
                reference: columns,
                gains: setup.gains.map(|g| [g.kp, g.kd]),
            },
        };
        let motion = simulate_watched(setup.arm, &drive, setup.options, &mut |time| {
            progress(time);
            ControlFlow::Continue(())
        })?;
        let largest = |name: &str, about: f64| -> flexure::Result<f64> {
            let column = motion.column(name)?.iter();
            Ok(column.fold(0.0_f64, |m, v| m.max((v - about).abs())))
        };
        let reached = |i: usize| -> flexure::Result<Extremes> {
            let joint = i + 1;
            Ok(Extremes {
                torque: largest(&format!("tau{joint}"), 0.0)?,
                position: largest(&format!("q{joint}"), initial.q[i])?,
                velocity: largest(&format!("dq{joint}"), 0.0)?,
            })
        };
        Ok(Trial {
            signals,
            reached: [reached(0)?, reached(1)?],
            motion,
        })
    }

    /// Each joint's largest share of a limit; 0 for one that is not free.
    fn shares(&self, setup: &Setup) -> [f64; 2] {
        [0, 1].map(|i| match setup.free[i] {
            true => self.reached[i].share(&setup.limits[i]),
            false => 0.0,
        })
    }
}

/// The trial that uses most of the limits without exceeding one.
pub fn largest(setup: &Setup, arguments: &Arguments) -> Result<Trial> {
    let (free, limits) = (setup.free, setup.limits);
    let unit = signals::unit(setup.options.sampling.rows(), free, arguments)?;
    let mut scale = match arguments.reference {
        false => limits.map(|limits| limits.torque),
        true => limits.map(|limits| limits.position.min(1.0)),
    };
    // The largest scale that was allowed.
    let mut least = [0.0, 0.0];
    // The best trial, with its score: the sum of both joints' shares of their nearest limits.
    let mut best: Option<(f64, Trial)> = None;
    for round in 0..ROUNDS {
        // In thousandths of a round.
        let progress = |time: f64| {
            let share = (1e3 * time / arguments.duration) as u64;
            Interrupt::report(1000 * round as u64 + share, 1000 * ROUNDS as u64);
        };
        let trial = Trial::new(setup, arguments.reference, &unit, scale, progress)?;
        let shares = trial.shares(setup);
        let allowed = shares.iter().all(|share| *share <= 1.0 + ROUNDING);
        if allowed {
            least = scale;
            let sum = shares[0] + shares[1];
            if best.as_ref().is_none_or(|b| sum > b.0) {
                best = Some((sum, trial));
            }
            if [0, 1].iter().all(|&i| !free[i] || shares[i] >= NEAR) {
                break;
            }
        }
        if best.is_none() {
            // The links move each other: both signals shrink until the limits are kept.
            let shrink = (AIM / shares[0].max(shares[1])).clamp(0.3, 0.9);
            scale.iter_mut().for_each(|s| *s *= shrink);
            continue;
        }
        for i in 0..2 {
            scale[i] = next_scale(scale[i], least[i], shares[i], allowed);
        }
    }
    best.map(|b| b.1).ok_or_else(|| none_allowed(arguments.kind))
}

/// The next scale of a signal after one that came to this share of its limit; `least` was allowed before.
///
/// The response is not proportional to the signal, so the scale is halved on the way down.
fn next_scale(scale: f64, least: f64, share: f64, allowed: bool) -> f64 {
    if share > 1.0 + ROUNDING {
        let aimed = scale * (AIM / share).max(0.3);
        return match least > 0.0 {
            true => aimed.max(0.5 * (least + scale)),
            false => aimed,
        };
    }
    match allowed && share > 0.0 {
        true => scale * (AIM / share).min(2.0),
        false => scale,
    }
}

fn none_allowed(kind: SignalKind) -> anyhow::Error {
    let remedy = match kind {
        SignalKind::Multilevel => "shorten --hold, as torques that are held long",
        SignalKind::Multisine | SignalKind::Chirp => "raise --f-min, as slow torques",
    };
    anyhow!(
        "no amplitude was found for which the simulated arm keeps within its limits; raise --max-position or --max-velocity, or \
         {remedy} let an arm without gravity drift far"
    )
}
