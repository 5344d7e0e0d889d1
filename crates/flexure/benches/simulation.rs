//! The speed and accuracy of the arm's simulation: `cargo bench -p flexure --bench simulation`.
//!
//! Prints the time of one right-hand side, of 10 s of the full nonlinear space arm under a chirp
//! at rtol 1e-9, atol 1e-12, its error against a run at 1e-13, and a batch's throughput, one arm after the other and several in lanes.

use std::hint::black_box;
use std::time::Instant;

use flexure::manipulator::{Arm, ArmRun, Drive, JointKind, SimulationOptions, simulate, simulate_batch, space_arm};
use flexure::simulation::{Dop853, Tolerances, batch};

/// The least time of several runs, s.
fn least_time(runs: usize, mut run: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn chirp(t: f64) -> [f64; 2] {
    let phase = std::f64::consts::TAU * (0.1 * t + 0.095 * t * t);
    [20.0 * phase.sin(), 5.0 * (0.7 * phase).cos()]
}

fn integrate(arm: &Arm, rtol: f64, atol: f64) -> flexure::Result<Dop853<[f64; 8]>> {
    let tolerances = Tolerances {
        rtol,
        atol,
        ..Tolerances::default()
    };
    let mut solver = Dop853::new(0.0, [0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0], tolerances)?;
    solver.advance(&|t, x: &[f64; 8]| arm.derivative(x, chirp(t)), 10.0, &mut |_| {
        std::ops::ControlFlow::Continue(())
    })?;
    Ok(solver)
}

fn main() -> flexure::Result<()> {
    let arm = Arm::new(space_arm(JointKind::Nonlinear))?;

    let calls = 1_000_000;
    let seconds = least_time(5, || {
        let mut x = [0.1, 0.5, 0.12, 0.52, 0.3, -0.2, 0.31, -0.25];
        for _ in 0..calls {
            let slope = arm.derivative(black_box(&x), [1.0, 2.0]);
            x[4] = 0.3 + 1e-9 * slope[4];
        }
        black_box(x);
    });
    println!("right-hand side: {:.1} ns", seconds / calls as f64 * 1e9);

    let solver = integrate(&arm, 1e-9, 1e-12)?;
    let exact = integrate(&arm, 1e-13, 1e-15)?;
    let error = solver
        .x()
        .iter()
        .zip(exact.x())
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    let seconds = least_time(20, || {
        black_box(integrate(&arm, 1e-9, 1e-12).is_ok());
    });
    let cost = solver.statistics();
    println!(
        "10 s of chirp torque: {:.2} ms ({} steps, {} rejected, {} evaluations of {:.1} ns with their step), end error {error:.1e}",
        seconds * 1e3,
        cost.accepted,
        cost.rejected,
        cost.evaluations,
        seconds / cost.evaluations as f64 * 1e9,
    );

    let options = SimulationOptions::new(10.0, 0.01)?;
    let torque = [
        flexure::signal::white_uniform(options.sampling.rows(), 20.0, 1)?,
        flexure::signal::white_uniform(options.sampling.rows(), 5.0, 2)?,
    ];
    let held = Drive::Held([&torque[0], &torque[1]]);
    let seconds = least_time(5, || {
        black_box(simulate(&arm, &held, &options).is_ok());
    });
    println!("10 s of white torque, held for 10 ms: {:.2} ms", seconds * 1e3);

    let white = |seed| flexure::signal::white_uniform(options.sampling.rows(), 20.0, seed);
    let slow = |seed: u64| -> Vec<f64> {
        let angle = |k| options.sampling.instant(k) * (0.5 + 0.05 * seed as f64);
        (0..options.sampling.rows()).map(|k| 5.0 * angle(k).sin()).collect()
    };
    let whites: Vec<Vec<f64>> = (0..64).map(white).collect::<flexure::Result<_>>()?;
    let sines: Vec<Vec<f64>> = (0..64).map(slow).collect();
    for (name, first) in [("white", &whites), ("slow", &sines)] {
        let run = |u| ArmRun {
            arm: &arm,
            drive: Drive::Held([u, &torque[1]]),
            options,
        };
        let runs: Vec<ArmRun> = first.iter().map(|u| run(u.as_slice())).collect();
        let alone = least_time(5, || {
            black_box(batch(&runs, |run| simulate(run.arm, &run.drive, &run.options).is_ok()));
        });
        let together = least_time(5, || {
            black_box(simulate_batch(&runs, &|_| std::ops::ControlFlow::Continue(())));
        });
        let count = runs.len() as f64;
        println!(
            "batch of {count} arms, {name} torque: {:.0} arms a second one after the other, {:.0} in lanes: {:.2} times",
            count / alone,
            count / together,
            alone / together
        );
    }
    Ok(())
}
