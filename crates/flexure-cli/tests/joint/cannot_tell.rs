//! Logs that cannot tell: each is refused, or the first line of its result says why it is not reliable.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::common::Folder;

/// The log of an axis of 2 kg m^2 with viscous friction 1 N m s/rad and Coulomb friction 0.5 N m.
pub struct Axis {
    /// s.
    sample_time: f64,
    samples: usize,
    /// The encoder's noise, rad.
    noise: f64,
}

pub const PLAIN: Axis = Axis {
    sample_time: 0.002,
    samples: 10_000,
    noise: 1e-6,
};

/// Integration steps are of 0.1 ms.
const STEP: f64 = 1e-4;

impl Axis {
    /// Position and torque as columns, which `recorded` may change; the torque by time and velocity.
    pub fn log(&self, torque: impl Fn(f64, f64) -> f64, recorded: impl Fn([f64; 2]) -> [f64; 2]) -> String {
        let mut rng = Pcg64::seed_from_u64(7);
        let (mut q, mut v, mut text) = (0.0_f64, 0.0_f64, "t,q,tau\n".to_owned());
        let every = (self.sample_time / STEP).round() as usize;
        for i in 0..self.samples {
            let t = self.sample_time * i as f64;
            let tau = torque(t, v);
            let noise = self.noise * (rng.random_range(-1.0..1.0_f64) + rng.random_range(-1.0..1.0_f64));
            let [angle, effort] = recorded([q + noise, tau]);
            text += &format!("{t},{angle},{effort}\n");
            for _ in 0..every {
                v += STEP * 0.5 * (tau - v - 0.5 * (200.0 * v).tanh());
                q += STEP * v;
            }
        }
        text
    }
}

/// A torque of several frequencies.
pub fn multisine(t: f64) -> f64 {
    [0.2, 0.5, 0.9, 1.7, 2.9]
        .iter()
        .map(|f| 3.0 * (TAU * f * t + 20.0 * f).sin())
        .sum()
}

pub fn as_it_is(recorded: [f64; 2]) -> [f64; 2] {
    recorded
}

/// Names of logs, and a part of what the first line or the refusal says.
fn logs() -> Vec<(&'static str, String, &'static str)> {
    let driven = |t: f64, _: f64| multisine(t);
    let slow = Axis {
        sample_time: 2.0,
        samples: 1000,
        ..PLAIN
    };
    vec![
        ("sampled too slowly", slow.log(driven, as_it_is), "sample"),
        (
            "one direction",
            PLAIN.log(|t, _| 8.0 + multisine(t) / 15.0, as_it_is),
            "one direction",
        ),
        (
            "few reversals",
            PLAIN.log(
                |t, _| 3.0 * (TAU * 0.06 * t).sin() + 0.2 * (TAU * 0.9 * t).sin(),
                as_it_is,
            ),
            "reverses too seldom",
        ),
        (
            "clipped",
            PLAIN.log(driven, |[q, tau]| [q, tau.clamp(-4.0, 4.0)]),
            "clipped",
        ),
        (
            "at rest",
            PLAIN.log(|_, _| 0.0, |[q, _]| [q, 0.1 * (1e7 * q).sin()]),
            "not",
        ),
        (
            "in degrees",
            PLAIN.log(driven, |[q, tau]| [q.to_degrees(), tau]),
            "degrees",
        ),
        (
            "another torque",
            PLAIN.log(driven, |[q, tau]| [q, (37.0 * tau).sin()]),
            "doubtful because",
        ),
        (
            "too short",
            Axis { samples: 150, ..PLAIN }.log(driven, as_it_is),
            "at least 200 samples",
        ),
        (
            "hardly any motion",
            Axis { noise: 1e-2, ..PLAIN }.log(|t, _| multisine(t) / 12.0, as_it_is),
            "not reliable because",
        ),
    ]
}

#[test]
fn a_log_that_cannot_tell_is_refused_or_doubted_in_the_first_line() {
    let folder = Folder::new();
    for (name, log, why) in logs() {
        folder.write("r.csv", log);
        let outcome = folder.run("joint r.csv --position q --torque tau");
        let first = match outcome.code {
            Some(0) => outcome.stdout.split("\n  log ").next().unwrap_or_default(),
            Some(1) => outcome.stderr.as_str(),
            _ => panic!("{name}: {outcome:?}"),
        };
        let first: String = first.split_whitespace().collect::<Vec<_>>().join(" ");
        println!("{name}: {first}");
        assert!(first.contains(why), "{name}: {first}");
    }
}
