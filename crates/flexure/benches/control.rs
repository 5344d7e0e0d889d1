//! The time of a filter's step and of a recursive model's sample, on one core: `cargo bench -p flexure --bench control`.

use std::hint::black_box;
use std::time::Instant;

use flexure::control::estimation::{KalmanFilter, NoiseModel};
use flexure::control::recursive::{Memory, RecursiveArx, RecursiveHammerstein};
use flexure::manipulator::{Arm, JointKind, State, space_arm};

/// The least time of a call over several runs, microseconds.
fn microseconds(mut call: impl FnMut(usize)) -> f64 {
    const CALLS: usize = 20_000;
    let run = |_| {
        let start = Instant::now();
        (0..CALLS).for_each(&mut call);
        start.elapsed().as_secs_f64() / CALLS as f64 * 1e6
    };
    (0..15).map(run).fold(f64::INFINITY, f64::min)
}

fn main() -> flexure::Result<()> {
    let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
    let noise = NoiseModel {
        encoder: 1e-4,
        torque: 0.2,
        drift: 0.0,
        start: [1e-3, 1e-2],
    };
    let filters = [
        ("extended Kalman filter, a step", KalmanFilter::extended(arm, noise)?),
        ("unscented Kalman filter, a step", KalmanFilter::unscented(arm, noise)?),
        (
            "fuzzy-adaptive extended filter, a step",
            KalmanFilter::extended(arm, noise)?.adaptive(),
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
