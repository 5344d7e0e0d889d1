//! Positions that integrate forces, and outputs that do not.

use super::{lag, sum, times};
use crate::look::integrated_output;
use crate::signal::gaussian;

/// A mass with viscous and dry friction, whose position a controller moves back and forth, as an industrial axis does: force and position.
fn axis(samples: usize, seed: u64, encoder: f64) -> [Vec<f64>; 2] {
    let (dt, mass, viscous, dry) = (1e-3, 95.0, 200.0, 20.0);
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let mut target = 0.0_f64;
    let [steps, errors] = [seed, seed + 1000].map(|s| gaussian(samples, s));
    let (mut force, mut position) = (Vec::new(), Vec::new());
    for n in 0..samples {
        if n % 1500 == 0 {
            target = 0.1 * steps[n].clamp(-2.0, 2.0);
        }
        let measured = q + encoder * errors[n];
        let u = (2000.0 * (4.0 * (target - measured).clamp(-0.05, 0.05) - v)).clamp(-300.0, 300.0);
        let friction = viscous * v + dry * (v / 1e-3).tanh();
        v += dt * (u - friction) / mass;
        q += dt * v;
        force.push(u);
        position.push(measured);
    }
    [force, position]
}

#[test]
fn an_axis_under_position_control() {
    for seed in 0..10 {
        let [force, position] = axis(24_000, seed, 1e-6);
        assert!(integrated_output(&force, &position).is_some(), "seed {seed}");
        let velocity: Vec<f64> = position.windows(2).map(|w| 1e3 * (w[1] - w[0])).collect();
        assert!(
            integrated_output(&force[1..], &velocity).is_none(),
            "velocity, seed {seed}"
        );
        assert!(
            integrated_output(&position, &force).is_none(),
            "turned round, seed {seed}"
        );
    }
}

#[test]
fn a_mass_without_friction_integrates_twice() {
    for seed in 0..10 {
        let force = lag(0.95, &gaussian(4000, seed));
        let position = lag(1.0, &lag(1.0, &force));
        assert!(integrated_output(&force, &position).is_some(), "seed {seed}");
    }
}

/// What settles, slowly as well, does not integrate: here within a tenth of the record and faster.
#[test]
fn outputs_that_settle() {
    for seed in 0..40 {
        for pole in [0.0, 0.9, 0.99, 0.9975] {
            let u = lag(0.5, &gaussian(4000, seed));
            let y = lag(pole, &u);
            assert!(integrated_output(&u, &y).is_none(), "pole {pole}, seed {seed}");
            let measured = sum(&y, &times(0.1, &gaussian(4000, seed + 100)));
            assert!(
                integrated_output(&u, &measured).is_none(),
                "pole {pole}, noise, seed {seed}"
            );
        }
    }
}

/// An output that drifts does not integrate its input.
#[test]
fn outputs_that_drift() {
    for seed in 0..100 {
        let u = lag(0.5, &gaussian(4000, seed));
        let drift = lag(1.0, &gaussian(4000, seed + 200));
        assert!(integrated_output(&u, &drift).is_none(), "unrelated, seed {seed}");
        let driven = sum(&lag(0.9, &u), &times(0.1, &drift));
        assert!(
            integrated_output(&u, &driven).is_none(),
            "beside a response, seed {seed}"
        );
        let walks = lag(1.0, &u);
        assert!(integrated_output(&walks, &drift).is_none(), "two walks, seed {seed}");
    }
}

#[test]
fn what_shows_nothing() {
    let u = gaussian(1000, 1);
    assert_eq!(integrated_output(&u, &u[1..]), None);
    assert_eq!(integrated_output(&u, &[1.0; 1000]), None);
    assert_eq!(integrated_output(&u[..50], &lag(1.0, &u[..50])), None);
    let mut broken = lag(1.0, &u);
    broken[3] = f64::NAN;
    assert_eq!(integrated_output(&u, &broken), None);
}
