//! How well the structure `feedback` finds simulated loops: `cargo run --release --example feedback [SYSTEMS [SAMPLES]]`.
//!
//! Random systems of every kind are integrated between the samples (Runge and Kutta, 20 steps a sample) under a torque that is held
//! from sample to sample, and noise is added to the output. The table has medians over the systems, and the largest loss of fit: the
//! fit of the true system and of the model on the fresh quarter, percent; the error of the nonlinearity, taken as the input that holds the
//! output, relative to its size over the middle 98 % of the output's values; how many models hold; seconds; and the first letter of the
//! signal that enters the nonlinearity (output, difference, hidden).

use std::time::Instant;

use flexure::identify::FEEDBACK;
use flexure::record::Record;
use flexure::validation::FitMeasures;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// What moves.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// A mass on a cubic spring; its position is measured.
    Duffing,
    /// A pendulum; its angle is measured.
    Pendulum,
    /// A motor with a saturating amplifier that follows a reference; its position is measured.
    Saturation,
    /// A mass between two springs with free play; its position is measured.
    Deadband,
    /// A joint with friction; its velocity is measured.
    Joint,
}

/// A system of its kind, with random parameters.
struct System {
    kind: Kind,
    /// Frequency and damping, or friction and inertia.
    frequency: f64,
    damping: f64,
    size: f64,
    step: f64,
}

impl System {
    fn new(kind: Kind, rng: &mut Pcg64) -> System {
        System {
            kind,
            frequency: rng.random_range(0.8..1.2),
            damping: rng.random_range(0.1..0.3),
            size: rng.random_range(0.7..1.4),
            step: match kind {
                Kind::Joint => 0.01,
                _ => 0.3,
            },
        }
    }

    /// The static curve: the torque that holds the output.
    fn holding(&self, y: f64) -> f64 {
        let w2 = self.frequency * self.frequency;
        match self.kind {
            Kind::Duffing => w2 * (y + self.size * y.powi(3)),
            Kind::Pendulum => w2 * y.sin(),
            Kind::Saturation => y,
            Kind::Deadband => w2 * (0.2 * y + (y - 0.5 * self.size).max(0.0) + (y + 0.5 * self.size).min(0.0)),
            Kind::Joint => {
                self.size * (0.5 * ((15.0 * y).tanh() - (5.0 * y).tanh()) + 0.8 * (10.0 * y).tanh() + 0.3 * y)
            }
        }
    }

    fn derivative(&self, x: [f64; 2], u: f64) -> [f64; 2] {
        match self.kind {
            Kind::Joint => [(u - self.holding(x[0])) / (1.0 + self.damping), 0.0],
            Kind::Saturation => {
                let torque = (2.0 * (u - x[0])).clamp(-0.6 * self.size, 0.6 * self.size);
                [
                    x[1],
                    self.frequency * self.frequency * torque - 5.0 * self.damping * x[1],
                ]
            }
            _ => [
                x[1],
                u - 2.0 * self.damping * self.frequency * x[1] - self.holding(x[0]),
            ],
        }
    }

    /// The input, white and normal, and the noiseless output.
    fn simulate(&self, samples: usize, rng: &mut Pcg64) -> (Vec<f64>, Vec<f64>) {
        const BEFORE: usize = 300;
        const STEPS: usize = 20;
        let amplitude = match self.kind {
            Kind::Duffing | Kind::Deadband => 2.0,
            Kind::Pendulum => 0.5,
            Kind::Saturation => 1.5,
            Kind::Joint => 6.0,
        };
        let (mut x, mut u, mut y) = ([0.0; 2], Vec::new(), Vec::new());
        let h = self.step / STEPS as f64;
        for n in 0..BEFORE + samples {
            let white: f64 = StandardNormal.sample(rng);
            let torque = amplitude * white;
            if n >= BEFORE {
                u.push(torque);
                y.push(x[0]);
            }
            for _ in 0..STEPS {
                let at = |k: [f64; 2], s: f64| [x[0] + s * k[0], x[1] + s * k[1]];
                let k1 = self.derivative(x, torque);
                let k2 = self.derivative(at(k1, 0.5 * h), torque);
                let k3 = self.derivative(at(k2, 0.5 * h), torque);
                let k4 = self.derivative(at(k3, h), torque);
                for i in 0..2 {
                    x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
            }
        }
        (u, y)
    }
}

/// One identification.
struct Trial {
    own: f64,
    fit: f64,
    error: f64,
    seconds: f64,
    entering: String,
    holds: bool,
}

fn trial(kind: Kind, db: f64, samples: usize, seed: u64) -> flexure::Result<Trial> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let system = System::new(kind, &mut rng);
    let (u, y0) = system.simulate(samples, &mut rng);
    let level = y0.iter().sum::<f64>() / samples as f64;
    let power = y0.iter().map(|y| (y - level).powi(2)).sum::<f64>() / samples as f64;
    let noise = power.sqrt() * 10.0_f64.powf(-db / 20.0);
    let noisy = y0.iter().map(|y| {
        let e: f64 = StandardNormal.sample(&mut rng);
        y + noise * e
    });
    let y: Vec<f64> = noisy.collect();
    let started = Instant::now();
    let record = Record::new([("u", u), ("y", y.clone())])?;
    let found = FEEDBACK.identify(&record, &["u"], "y")?;
    let seconds = started.elapsed().as_secs_f64();
    let own = FitMeasures::new(&y[found.fitted..], &y0[found.fitted..])?.fit_percent;
    // Over the middle 98 % of the output's values.
    let mut sorted = y0;
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[samples / 100], sorted[samples - 1 - samples / 100]);
    let grid: Vec<f64> = (0..=200).map(|i| low + (high - low) * f64::from(i) / 200.0).collect();
    let curve = found.curve("nonlinearity");
    let squares = |of: &dyn Fn(f64) -> f64| grid.iter().map(|z| of(*z).powi(2)).sum::<f64>().sqrt();
    let error = curve.map_or(f64::NAN, |c| {
        squares(&|z| c.value(z) - system.holding(z)) / squares(&|z| system.holding(z))
    });
    Ok(Trial {
        own,
        fit: found.fit_percent(),
        error,
        seconds,
        entering: match found.detail("entering") {
            Some(flexure::identify::result::Value::Text(text)) => text.clone(),
            _ => String::new(),
        },
        holds: found.holds(),
    })
}

fn main() -> flexure::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: usize| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    let (systems, samples) = (number(10), number(5000));
    println!("kind        dB   true fit  median fit  worst loss  median f error  holds  median s  entering");
    for kind in [
        Kind::Duffing,
        Kind::Pendulum,
        Kind::Saturation,
        Kind::Deadband,
        Kind::Joint,
    ] {
        for db in [20.0, 40.0] {
            let trials = (0..systems as u64).map(|seed| trial(kind, db, samples, 1000 + seed));
            let trials: Vec<Trial> = trials.collect::<flexure::Result<_>>()?;
            let median = |of: &dyn Fn(&Trial) -> f64| {
                let mut all: Vec<f64> = trials.iter().map(of).collect();
                all.sort_by(f64::total_cmp);
                all[all.len() / 2]
            };
            let worst = trials.iter().map(|t| t.own - t.fit).fold(f64::NEG_INFINITY, f64::max);
            let named = trials
                .iter()
                .map(|t| t.entering.chars().next().unwrap_or('-'))
                .collect::<String>();
            println!(
                "{:<10} {db:>3}  {:>9.2}  {:>10.2}  {worst:>10.2}  {:>14.4}  {:>2}/{systems:<2}  {:>8.2}  {named}",
                format!("{kind:?}"),
                median(&|t| t.own),
                median(&|t| t.fit),
                median(&|t| t.error),
                trials.iter().filter(|t| t.holds).count(),
                median(&|t| t.seconds),
            );
        }
    }
    Ok(())
}
