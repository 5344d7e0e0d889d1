//! Sums of two random branches from input and output alone: `cargo run --release -p flexure --example parallel`.
//!
//! Ten random sums of two Hammerstein branches, then ten of two Wiener-Hammerstein branches, 10,000 samples, white Gaussian input, white
//! output noise of 40 dB. Linear blocks have one or two poles of moduli 0.2 to 0.85; nonlinearities are drawn from six,
//! a different one for each branch, and neither branch has less than a tenth of the output's variance. Prints the fit on fresh data
//! against the output without noise, and the chosen structure.
//!
//! `parallel wiener-hammerstein` runs one kind, `parallel wiener-hammerstein 7` one system.

use std::time::Instant;

use flexure::Record;
use flexure::identify::PARALLEL;
use flexure::linear::TransferFunction;
use flexure::validation::FitMeasures;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const SAMPLES: usize = 10_000;
/// Samples for transients to decay.
const BEFORE: usize = 300;
/// 40 dB.
const NOISE: f64 = 0.01;
const SYSTEMS: u64 = 10;
/// The least share of the output's variance that a branch has.
const VISIBLE: f64 = 0.1;

const NONLINEARITIES: [fn(f64) -> f64; 6] = [
    |x| x.clamp(-0.7, 1.0),
    |x| (x - 0.5).max(0.0) + (x + 0.7).min(0.0),
    |x| x + 0.3 * x * x * x,
    |x| (2.0 * x).tanh(),
    |x| x + 0.4 * x * x,
    |x| x.abs(),
];

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

fn block(rng: &mut Pcg64) -> flexure::Result<TransferFunction> {
    let radius = rng.random_range(0.2..0.85);
    let zero = rng.random_range(-0.8..0.8);
    let a = match rng.random_bool(0.5) {
        true => vec![1.0, if rng.random_bool(0.3) { radius } else { -radius }],
        false => {
            let angle: f64 = rng.random_range(0.2..2.5);
            vec![1.0, -2.0 * radius * angle.cos(), radius * radius]
        }
    };
    TransferFunction::new(vec![1.0, zero], a)
}

/// At zero mean and unit variance.
fn standardised(v: &[f64]) -> Vec<f64> {
    let n = v.len() as f64;
    let mean = v.iter().sum::<f64>() / n;
    let spread = (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    v.iter().map(|x| (x - mean) / spread).collect()
}

/// Input and output without noise.
fn draw(wiener_hammerstein: bool, seed: u64) -> flexure::Result<(Vec<f64>, Vec<f64>)> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let u: Vec<f64> = (0..SAMPLES + BEFORE).map(|_| normal(&mut rng)).collect();
    let first = rng.random_range(0..NONLINEARITIES.len());
    let second = (first + rng.random_range(1..NONLINEARITIES.len())) % NONLINEARITIES.len();
    let mut branch = |f: fn(f64) -> f64| -> flexure::Result<Vec<f64>> {
        let w = match wiener_hammerstein {
            true => standardised(&block(&mut rng)?.simulate(&u)),
            false => u.clone(),
        };
        let z: Vec<f64> = w.into_iter().map(f).collect();
        Ok(standardised(&block(&mut rng)?.simulate(&z)))
    };
    let (p, q) = (branch(NONLINEARITIES[first])?, branch(NONLINEARITIES[second])?);
    let share: f64 = rng.random_range(VISIBLE..1.0 - VISIBLE);
    let y = p
        .iter()
        .zip(&q)
        .map(|(p, q)| share.sqrt() * p + (1.0 - share).sqrt() * q);
    Ok((u[BEFORE..].to_vec(), y.collect::<Vec<_>>()[BEFORE..].to_vec()))
}

fn main() -> flexure::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: Vec<u64> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    for (wiener_hammerstein, name) in [(false, "hammerstein"), (true, "wiener-hammerstein")] {
        if arguments.first().is_some_and(|a| a != name) {
            continue;
        }
        let mut fits = Vec::new();
        for seed in if seeds.is_empty() {
            (1..=SYSTEMS).collect()
        } else {
            seeds.clone()
        } {
            let (u, y0) = draw(wiener_hammerstein, seed)?;
            let mut rng = Pcg64::seed_from_u64(1000 + seed);
            let y: Vec<f64> = y0.iter().map(|y| y + NOISE * normal(&mut rng)).collect();
            let start = Instant::now();
            let result = PARALLEL.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
            let fresh = result.fitted..;
            let fit = FitMeasures::new(&y0[fresh.clone()], &result.predicted[fresh])?.fit_percent;
            let branches = result.paths.iter().map(|path| {
                let orders: Vec<String> = path.linear().map(|g| g.order().to_string()).collect();
                let pieces: Vec<String> = path.curves().map(|c| c.pieces().to_string()).collect();
                format!("(poles {}, pieces {})", orders.join(" + "), pieces.join(" + "))
            });
            println!(
                "{name:<12}{seed:>4}  fit {fit:>6.2} %  {:>5.1} s  {:<8}{}",
                start.elapsed().as_secs_f64(),
                if result.verdict.holds() { "holds" } else { "refuted" },
                branches.collect::<Vec<_>>().join(" + ")
            );
            fits.push(fit);
        }
        let good = fits.iter().filter(|f| **f >= 99.0).count();
        let least = fits.iter().copied().fold(f64::INFINITY, f64::min);
        println!("{name}: {good} of {} at 99 % or more, least {least:.2} %", fits.len());
    }
    Ok(())
}
