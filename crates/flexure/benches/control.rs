//! The time of a filter's step and of a recursive model's sample, on one core: `cargo bench -p flexure --bench control`.
//!
//! With `-- pushes N` it measures the effect of N samples on recursive models instead: the difference to the batch estimate from the same
//! samples, and the false alarms of the detector of changes.

use std::hint::black_box;
use std::time::Instant;

use flexure::control::estimation::{KalmanFilter, NoiseModel};
use flexure::control::recursive::{Cusum, Memory, RecursiveArx, RecursiveHammerstein};
use flexure::manipulator::{Arm, JointKind, State, space_arm};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// The least time of a call over many short runs, so that some are not interrupted; microseconds.
fn microseconds(mut call: impl FnMut(usize)) -> f64 {
    const CALLS: usize = 1000;
    let run = |_| {
        let start = Instant::now();
        (0..CALLS).for_each(&mut call);
        start.elapsed().as_secs_f64() / CALLS as f64 * 1e6
    };
    (0..500).map(run).fold(f64::INFINITY, f64::min)
}

/// White noise of the standard deviation 1, from a seed.
fn noise(seed: u64) -> impl Iterator<Item = f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    std::iter::from_fn(move || Some(StandardNormal.sample(&mut rng)))
}

/// A period of input and output of a Hammerstein system of the second order, in its steady state.
fn period() -> Vec<(f64, f64)> {
    const LENGTH: usize = 4096;
    let both: Vec<(f64, f64)> = noise(1).zip(noise(2)).take(LENGTH).collect();
    let (mut w, mut y) = ([0.0; 2], [0.0; 2]);
    let all: Vec<(f64, f64)> = (both.iter().cycle())
        .take(3 * LENGTH)
        .map(|&(u, e)| {
            let next = 1.2 * y[0] - 0.5 * y[1] + 0.4 * w[0] + 0.3 * w[1] + 0.1 * e;
            w = [u + 0.3 * u * u, w[0]];
            y = [next, y[0]];
            (u, next)
        })
        .collect();
    all[2 * LENGTH..].to_vec()
}

/// The largest relative difference of two estimates.
fn apart(a: &RecursiveHammerstein, b: &RecursiveHammerstein) -> f64 {
    let both = a
        .coefficients()
        .unwrap_or_default()
        .into_iter()
        .zip(b.coefficients().unwrap_or_default());
    both.map(|(a, b)| (a - b).abs() / (1.0 + b.abs())).fold(0.0, f64::max)
}

/// The estimate of a periodic record is that of one of its periods: so the second model, with few samples, gives the value that the first
/// should reach.
fn pushes(samples: u64) -> flexure::Result<()> {
    let period = period();
    let learnt = |memory, samples: u64| -> flexure::Result<RecursiveHammerstein> {
        let mut model = RecursiveHammerstein::new(2, 0, 2, memory)?;
        (period.iter().cycle().zip(0..samples)).for_each(|(&(u, y), _)| model.push(u, y));
        Ok(model)
    };
    // The first two samples have no rows: the period closes with the third.
    let once = period.len() as u64 + 2;
    let rest = (samples - once) % period.len() as u64;
    let start = Instant::now();
    let all = learnt(Memory::All, samples - rest)?;
    println!(
        "{} samples in {:.0} s; difference from the estimate of one period: {:.1e}",
        samples - rest,
        start.elapsed().as_secs_f64(),
        apart(&all, &learnt(Memory::All, once)?)
    );
    let forgetting = Memory::Forgetting(0.999);
    println!(
        "with forgetting; difference from the estimate of the last 20 periods: {:.1e}",
        apart(
            &learnt(forgetting, samples - rest)?,
            &learnt(forgetting, 20 * (once - 2) + 2)?
        )
    );
    let mut detector = Cusum::new(1.0, 1.0, 1e6)?;
    let alarms = noise(3)
        .zip(0..samples)
        .filter(|&(x, _)| detector.push(x).is_some())
        .count();
    println!(
        "false alarms in 1e6 samples, one expected: {:.3}",
        alarms as f64 / samples as f64 * 1e6
    );
    Ok(())
}

fn main() -> flexure::Result<()> {
    let given: Vec<String> = std::env::args().skip_while(|a| a != "pushes").collect();
    if let Some(samples) = given
        .get(1)
        .and_then(|n| n.parse::<u64>().ok())
        .filter(|n| *n >= 100_000)
    {
        return pushes(samples);
    }
    let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
    let reckoned = NoiseModel {
        encoder: 1e-4,
        torque: 0.2,
        drift: 0.0,
        start: [1e-3, 1e-2],
    };
    let filters = [
        ("extended Kalman filter, a step", KalmanFilter::extended(arm, reckoned)?),
        (
            "unscented Kalman filter, a step",
            KalmanFilter::unscented(arm, reckoned)?,
        ),
        (
            "fuzzy-adaptive extended filter, a step",
            KalmanFilter::extended(arm, reckoned)?.adaptive(),
        ),
    ];
    for (name, mut filter) in filters {
        filter.start(&State {
            q: [0.0, 0.5],
            qm: [0.0, 0.5],
            ..State::default()
        });
        let time = microseconds(|k| {
            filter.predict(black_box([(0.01 * k as f64).sin(), 0.5]), 0.01);
            let state = filter.state();
            black_box(filter.correct(state.qm));
        });
        println!("{name}: {time:.2} us");
    }
    let signal: Vec<f64> = (0..4096)
        .map(|k| (0.37 * f64::from(k)).sin() + (0.011 * f64::from(k * k)).sin())
        .collect();
    let mut linear = RecursiveArx::new(2, 0, Memory::Forgetting(0.999))?;
    let time = microseconds(|k| linear.push(signal[k % 4096], signal[(k + 7) % 4096]));
    println!("linear system of order 2, a sample: {time:.3} us");
    for degree in [2, 3] {
        let mut model = RecursiveHammerstein::new(2, 0, degree, Memory::Forgetting(0.999))?;
        let time = microseconds(|k| model.push(signal[k % 4096], signal[(k + 7) % 4096]));
        println!("Hammerstein system of order 2 and degree {degree}, a sample: {time:.3} us");
    }
    Ok(())
}
