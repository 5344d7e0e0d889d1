//! Gains of the adaptive laws, by the same search for both. From the same feedback, one gain after the other is made larger or smaller as
//! long as that helps, then by smaller factors, until a given number of sets has been tried.
//!
//! A set is judged by the largest error of the tip on the square of 12.6 m, with half of the stiffness and with all of it, friction unknown
//! in both: `cargo run --release -p flexure --example control_gains -- 1000`. The seed differs from those of the figures in the
//! documentation.

use flexure::control::controllers::{AdaptiveGains, Composite, CompositeGains, DirectAdaptive};
use flexure::control::{Controller, Differences, Figures, LoopOptions, TipPath, TurnCounted, run_loop, square};
use flexure::manipulator::{Arm, JointKind, space_arm};
use flexure::simulation::batch;

/// The time for the square, s.
const DURATION: f64 = 80.0;
/// The seed of the noise.
const SEED: u64 = 1001;
/// The first factor on a gain, and the smallest.
const FACTORS: [f64; 2] = [1.6, 1.03];
/// The error that counts for a run that loses the path, m.
const LOST: f64 = 1.0;

type Law = fn(&[f64]) -> flexure::Result<Box<dyn Controller>>;

/// The gains of a law: names, and where the search begins.
type Start = [(&'static str, f64)];

const DIRECT: [(&str, f64); 13] = [
    ("proportional 1", 900.0),
    ("proportional 2", 200.0),
    ("derivative 1", 350.0),
    ("derivative 2", 60.0),
    ("error rate, proportional", 1e4),
    ("error rate, integrated", 1e4),
    ("reference rate 1", 100.0),
    ("reference rate 2", 50.0),
    ("reference, proportional", 0.2),
    ("surface", 3.0),
    ("leakage", 1e-3),
    ("damping", 40.0),
    ("lead", 0.08),
];
const COMPOSITE: [(&str, f64); 9] = [
    ("feedback 1", 350.0),
    ("feedback 2", 60.0),
    ("surface", 3.0),
    ("tracking, inertias", 100.0),
    ("tracking, friction 1", 100.0),
    ("tracking, friction 2", 50.0),
    ("prediction", 0.1),
    ("cut-off", 2.0),
    ("damping", 40.0),
];

fn believed() -> flexure::Result<Arm> {
    let mut parameters = space_arm(JointKind::Nonlinear);
    parameters.parts.friction = false;
    Arm::new(parameters)
}

fn plant(factor: f64) -> flexure::Result<Arm> {
    let mut parameters = space_arm(JointKind::Nonlinear);
    for joint in &mut parameters.joints {
        for value in [&mut joint.linear, &mut joint.cubic, &mut joint.windup] {
            *value *= factor;
        }
    }
    Arm::new(parameters)
}

fn direct(g: &[f64]) -> flexure::Result<Box<dyn Controller>> {
    let gains = AdaptiveGains {
        start: [[g[0], g[2]], [g[1], g[3]]],
        error_rates: [g[4], g[5]],
        reference_rates: [g[6], g[7]],
        proportional: g[8],
        surface: g[9],
        leakage: g[10],
        damping: g[11],
        lead: g[12],
    };
    Ok(Box::new(DirectAdaptive::new(&believed()?, gains)?))
}

fn composite(g: &[f64]) -> flexure::Result<Box<dyn Controller>> {
    let gains = CompositeGains {
        feedback: [g[0], g[1]],
        surface: g[2],
        tracking: [g[3], g[4], g[5]],
        prediction: g[6],
        cut_off: g[7],
        damping: g[8],
    };
    Ok(Box::new(Composite::new(&believed()?, gains)?))
}

/// The mean over both plants of the largest error, m.
fn error(law: Law, gains: &[f64]) -> f64 {
    let one = |factor: f64| -> flexure::Result<f64> {
        let plant = plant(factor)?;
        let links = plant.parameters().links;
        let path = TurnCounted::new(TipPath::new(&links, &square(12.6), DURATION, 5.0, false)?);
        let options = LoopOptions {
            torque_limit: [60.0; 2],
            encoder_noise: 1e-5,
            torque_noise: 0.005,
            seed: SEED,
            ..LoopOptions::new(DURATION + 4.0, 0.01)?
        };
        let mut estimator = Differences::new(10.0, false)?;
        let run = run_loop(&plant, law(gains)?.as_mut(), &mut estimator, &path, &options)?;
        Ok(Figures::new(&run, &links, DURATION).tip_error_max)
    };
    let errors = [0.5, 1.0].map(|factor| one(factor).unwrap_or(LOST).min(LOST));
    0.5 * (errors[0] + errors[1])
}

/// The best gains of `most` sets.
fn searched(law: Law, start: &Start, most: usize) -> (Vec<f64>, f64) {
    let mut gains: Vec<f64> = start.iter().map(|(_, gain)| *gain).collect();
    let mut best = error(law, &gains);
    let [mut factor, smallest] = FACTORS;
    let mut tried = 1;
    while factor > smallest && tried + 2 * gains.len() <= most {
        let moved = |k: usize| {
            let mut moved = gains.clone();
            moved[k / 2] *= if k.is_multiple_of(2) { factor } else { 1.0 / factor };
            moved
        };
        let all: Vec<Vec<f64>> = (0..2 * gains.len()).map(moved).collect();
        tried += all.len();
        let errors = batch(&all, |gains| error(law, gains));
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        match errors.iter().position(|e| *e == least && least < best) {
            Some(k) => (gains, best) = (all[k].clone(), least),
            None => factor = factor.sqrt(),
        }
    }
    (gains, best)
}

fn main() {
    let most = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1000);
    let laws: [(&str, Law, &Start); 2] = [
        ("direct adaptive", direct, &DIRECT),
        ("composite adaptive", composite, &COMPOSITE),
    ];
    for (name, law, start) in laws {
        let (gains, error) = searched(law, start, most);
        println!("{name}: {:.2} mm", 1e3 * error);
        for ((name, _), gain) in start.iter().zip(gains) {
            println!("  {name}: {gain:.4}");
        }
    }
}
