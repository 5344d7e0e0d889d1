//! The excitation of an arm file.

use flexure::signal::{self, Chirp, Phases, Sweep};
use flexure::simulation::Sampling;
use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

/// The signals that can drive an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Independent samples, uniform or Gaussian.
    White,
    /// Harmonics in a band.
    Multisine,
    /// A sine of rising frequency.
    Chirp,
    /// A maximum-length binary sequence.
    Prbs,
    /// Random levels, held.
    Multilevel,
    /// Zero, then constant.
    Step,
    /// Nothing.
    #[default]
    Zero,
    /// The columns of a record.
    Record,
}

/// What the signals are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriveKind {
    /// Motor torques, N m.
    #[default]
    Torque,
    /// Joint deflections, rad, commanded of ideally stiff servos.
    Deflection,
}

/// The distribution of white samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Uniform; the amplitude is the largest absolute value.
    #[default]
    Uniform,
    /// Gaussian; the amplitude is the standard deviation.
    Gaussian,
}

/// The phases of a multisine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PhaseChoice {
    /// Independent and uniform.
    #[default]
    Random,
    /// Schroeder's, of low crest factor.
    Schroeder,
    /// Optimised for the lowest crest factor.
    LowCrest,
}

/// How a chirp's frequency rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SweepChoice {
    /// By the same number of Hz per second.
    #[default]
    Linear,
    /// By the same factor per second.
    Logarithmic,
}

/// One amplitude for every excited joint, or one for each of the two joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Amplitude {
    /// The same for all.
    Same(f64),
    /// For joints 1 and 2.
    Each([f64; 2]),
}

impl<'de> Deserialize<'de> for Amplitude {
    /// Written by hand, since serde's only message for an untagged value is that nothing matches.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AmplitudeVisitor)
    }
}

struct AmplitudeVisitor;

impl<'de> Visitor<'de> for AmplitudeVisitor {
    type Value = Amplitude;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number, or two numbers, one for each joint")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Amplitude, E> {
        Ok(Amplitude::Same(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Amplitude, E> {
        Ok(Amplitude::Same(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Amplitude, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element()? {
            values.push(value);
        }
        match values[..] {
            [first, second] => Ok(Amplitude::Each([first, second])),
            _ => Err(A::Error::invalid_length(values.len(), &self)),
        }
    }
}

/// The table `[excitation]`.
///
/// | key | kinds | meaning, range, default |
/// |---|---|---|
/// | `kind` | | the signal |
/// | `drive` | all | `"torque"` (N m, default) or `"deflection"` (rad) |
/// | `joints` | all | the joints that are excited; default: those not locked |
/// | `seed` | white, multisine, prbs, multilevel | default 1; every joint has its own random stream |
/// | `amplitude` | all but zero, record | a number, or one for each joint; required |
/// | `distribution` | white | `"uniform"` (default) or `"gaussian"` |
/// | `f_min`, `f_max` | multisine, chirp | Hz; `0 <= f_min < f_max <= 1 / (2 sample_time)`; required |
/// | `phases` | multisine | `"random"` (default), `"schroeder"` or `"low_crest"` |
/// | `sweep` | chirp | `"linear"` (default) or `"logarithmic"` |
/// | `hold` | prbs, multilevel | samples for which each value is held, at least 1; default 1 |
/// | `order` | prbs | register length, 2 to 24; default: the least whose period covers the run |
/// | `levels` | multilevel | number of levels, at least 2; default 5 |
/// | `start` | step | s; default 0 |
/// | `file` | record | a record with columns `tau1`, `tau2` (or `d1`, `d2`), one row per sample; required |
///
/// All signals are sampled at the run's instants and held in between. Signals without a seed are the
/// same at both joints except for their amplitude.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the table above
pub struct Excitation {
    pub kind: Kind,
    pub seed: Option<u64>,
    #[serde(default)]
    pub drive: DriveKind,
    pub joints: Option<Vec<usize>>,
    pub amplitude: Option<Amplitude>,
    pub distribution: Option<Distribution>,
    pub f_min: Option<f64>,
    pub f_max: Option<f64>,
    pub phases: Option<PhaseChoice>,
    pub sweep: Option<SweepChoice>,
    pub hold: Option<usize>,
    pub order: Option<u32>,
    pub levels: Option<usize>,
    pub start: Option<f64>,
    pub file: Option<String>,
}

impl Excitation {
    /// Checks that every key belongs to the kind and that none is missing; `Err` has key and reason.
    pub(super) fn check_keys(&self, locked: [bool; 2]) -> Result<(), (&'static str, String)> {
        use Kind::*;
        let seeded: &[Kind] = &[White, Multisine, Prbs, Multilevel];
        let sized: &[Kind] = &[White, Multisine, Chirp, Prbs, Multilevel, Step];
        let band: &[Kind] = &[Multisine, Chirp];
        // Key, whether it is given, the kinds it belongs to, whether these require it.
        let keys: [(&str, bool, &[Kind], bool); 12] = [
            ("seed", self.seed.is_some(), seeded, false),
            ("amplitude", self.amplitude.is_some(), sized, true),
            ("distribution", self.distribution.is_some(), &[White], false),
            ("f_min", self.f_min.is_some(), band, true),
            ("f_max", self.f_max.is_some(), band, true),
            ("phases", self.phases.is_some(), &[Multisine], false),
            ("sweep", self.sweep.is_some(), &[Kind::Chirp], false),
            ("hold", self.hold.is_some(), &[Prbs, Multilevel], false),
            ("order", self.order.is_some(), &[Prbs], false),
            ("levels", self.levels.is_some(), &[Multilevel], false),
            ("start", self.start.is_some(), &[Step], false),
            ("file", self.file.is_some(), &[Record], true),
        ];
        for (key, present, kinds, required) in keys {
            let belongs = kinds.contains(&self.kind);
            if present && !belongs {
                return Err((
                    key,
                    format!("does not belong to kind = \"{}\"; remove it", self.kind_name()),
                ));
            }
            if required && belongs && !present {
                return Err((key, format!("missing; kind = \"{}\" needs it", self.kind_name())));
            }
        }
        for &joint in self.joints.iter().flatten() {
            if !(1..=2).contains(&joint) {
                return Err(("joints", format!("{joint} is no joint; they are 1 and 2")));
            }
            if locked[joint - 1] {
                return Err(("joints", format!("joint {joint} is locked and cannot be excited")));
            }
        }
        if let Some(start) = self.start
            && !(start >= 0.0 && start.is_finite())
        {
            return Err(("start", format!("{start} s, but must be finite and not negative")));
        }
        Ok(())
    }

    /// The kind as it is written in the file.
    fn kind_name(&self) -> String {
        format!("{:?}", self.kind).to_lowercase()
    }

    /// Whether each joint is excited.
    pub(super) fn excited(&self, locked: [bool; 2]) -> [bool; 2] {
        match &self.joints {
            Some(joints) => [joints.contains(&1), joints.contains(&2)],
            None => locked.map(|l| !l),
        }
    }

    /// The samples for joint `index` (0 or 1); all zero for kind `record`.
    pub(super) fn samples(&self, index: usize, sampling: &Sampling) -> flexure::Result<Vec<f64>> {
        let n = sampling.rows();
        let time = sampling.sample_time();
        // Golden-ratio increments keep the joints' seeds apart for any seed of the file.
        let seed = self
            .seed
            .unwrap_or(1)
            .wrapping_add((index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let amplitude = match self.amplitude {
            Some(Amplitude::Same(a)) => a,
            Some(Amplitude::Each(a)) => a[index],
            None => 0.0,
        };
        let (f_min, f_max) = (self.f_min.unwrap_or(0.0), self.f_max.unwrap_or(0.0));
        let hold = self.hold.unwrap_or(1);
        match self.kind {
            Kind::White => match self.distribution.unwrap_or_default() {
                Distribution::Uniform => signal::white_uniform(n, amplitude, seed),
                Distribution::Gaussian => signal::white_gaussian(n, amplitude, seed),
            },
            Kind::Multisine => {
                let phases = match self.phases.unwrap_or_default() {
                    PhaseChoice::Random => Phases::Random { seed },
                    PhaseChoice::Schroeder => Phases::Schroeder,
                    PhaseChoice::LowCrest => Phases::LowCrest { seed },
                };
                signal::multisine(n, time, amplitude, f_min, f_max, phases)
            }
            Kind::Chirp => {
                let sweep = match self.sweep.unwrap_or_default() {
                    SweepChoice::Linear => Sweep::Linear,
                    SweepChoice::Logarithmic => Sweep::Logarithmic,
                };
                Chirp::new(amplitude, f_min, f_max, sampling.instant(n - 1), sweep)?.samples(n, time)
            }
            Kind::Prbs => signal::prbs(n, amplitude, hold, self.order, seed),
            Kind::Multilevel => signal::multilevel(n, amplitude, self.levels.unwrap_or(5), hold, seed),
            Kind::Step => {
                let start = (self.start.unwrap_or(0.0) / time * (1.0 - 1e-12)).ceil() as usize;
                signal::step(n, amplitude, start)
            }
            Kind::Zero | Kind::Record => Ok(signal::zero(n)),
        }
    }
}
