//! The integrator against problems with known solutions.

use super::*;
use crate::error::{Error, IntegrationFailure, SimulationError};

fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A smooth nonlinear pair that depends on time explicitly.
fn pair(t: f64, x: &[f64; 2]) -> [f64; 2] {
    [
        x[1] + (3.0 * t).cos(),
        -x[0] * (1.0 + 0.5 * (2.0 * t).sin()) - x[1].sin(),
    ]
}

/// The end of `n` equal steps over 2 s.
fn fixed_steps(n: usize) -> [f64; 2] {
    let h = 2.0 / n as f64;
    let mut x = [1.0, 0.3];
    for k in 0..n {
        let t = k as f64 * h;
        x = step(pair, t, &x, &pair(t, &x), h).x;
    }
    x
}

#[test]
fn the_error_falls_with_the_eighth_power_of_the_step() {
    let exact = fixed_steps(4000);
    let points: Vec<(f64, f64)> = [8, 11, 16, 22, 32]
        .map(|n| {
            let x = fixed_steps(n);
            let error = (x[0] - exact[0]).hypot(x[1] - exact[1]);
            ((2.0 / n as f64).ln(), error.ln())
        })
        .to_vec();
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    println!("measured order {slope:.2}");
    assert!((7.5..9.0).contains(&slope), "{slope}");
}

#[test]
fn weights_and_nodes_are_consistent() {
    // A step on x' = p(t) is exact for polynomials up to degree 7, for any stage weights.
    for degree in 0..=7 {
        let f = |t: f64, _: &[f64; 1]| [t.powi(degree)];
        let x = step(f, 0.0, &[0.0], &f(0.0, &[0.0]), 1.0).x[0];
        assert!((x - 1.0 / f64::from(degree + 1)).abs() < 1e-14, "degree {degree}: {x}");
    }
    // x' = x + t tells wrong nodes from wrong weights: row sums are the nodes.
    let f = |t: f64, x: &[f64; 1]| [x[0] + t];
    let x = step(f, 0.0, &[1.0], &f(0.0, &[1.0]), 0.1).x[0];
    assert!((x - (2.0 * 0.1_f64.exp() - 1.1)).abs() < 1e-15);
}

#[test]
fn tolerances_are_kept_and_the_end_is_hit_exactly() {
    for rtol in [1e-4, 1e-8, 1e-12] {
        let tolerances = Tolerances {
            rtol,
            atol: rtol,
            ..Tolerances::default()
        };
        let mut solver = Dop853::new(0.0, [1.0, 0.0], tolerances).unwrap();
        let oscillator = |_: f64, x: &[f64; 2]| [x[1], -x[0]];
        for k in 1..=100 {
            solver.advance(&oscillator, 0.2 * f64::from(k), &mut go_on).unwrap();
            assert_eq!(solver.t(), 0.2 * f64::from(k));
        }
        let error = (solver.x()[0] - 20.0_f64.cos()).abs();
        assert!(error < 20.0 * rtol, "{rtol}: {error}");
    }
}

#[test]
fn the_step_size_survives_samples_and_restarts() {
    let run = |samples: u32, jump: bool| {
        let mut solver = Dop853::new(0.0, [1.0, 0.0], Tolerances::default()).unwrap();
        for k in 1..=samples {
            let end = 20.0 * f64::from(k) / f64::from(samples);
            solver
                .advance(&|_, x: &[f64; 2]| [x[1], -x[0]], end, &mut go_on)
                .unwrap();
            if jump {
                solver.restart();
            }
        }
        solver.statistics()
    };
    // With intervals much shorter than a step, each interval takes one step, and none is rejected.
    let cost = run(1000, true);
    assert!(cost.accepted < 1020 && cost.rejected == 0, "{cost:?}");
    assert!(run(20, false).accepted < 2 * run(1, false).accepted + 20);
}

#[test]
fn a_solution_that_escapes_in_finite_time_is_an_error_near_that_time() {
    let mut solver = Dop853::new(0.0, [1.0], Tolerances::default()).unwrap();
    match solver.advance(&|_, x: &[f64; 1]| [x[0] * x[0]], 2.0, &mut go_on) {
        Err(Error::Simulation(SimulationError { time, reason })) => {
            assert!((time - 1.0).abs() < 1e-3, "{time} {reason}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_motion_that_runs_away_ends() {
    let mut solver = Dop853::new(0.0, [0.0, 0.0], Tolerances::default())
        .unwrap()
        .with_speeds_from(1);
    // A wheel with friction under a torque that no motor has.
    let wheel = |_: f64, x: &[f64; 2]| [x[1], 1e16 - (1e4 * x[1]).tanh()];
    match solver.advance(&wheel, 1.0, &mut go_on) {
        Err(Error::Simulation(SimulationError { time, reason })) => {
            // A constant acceleration is integrated exactly, by steps of any length.
            assert!(time < 1e-3, "{time}");
            assert!(matches!(reason, IntegrationFailure::TooFast { .. }), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    assert!(solver.statistics().accepted < 100, "{:?}", solver.statistics());
}
