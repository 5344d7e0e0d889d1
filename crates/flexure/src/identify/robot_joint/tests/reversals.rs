//! An axis with Coulomb friction that brakes, stops, sticks and starts again, under a digital controller.

use super::*;

const INERTIA: f64 = 0.35;
const COULOMB: f64 = 1.2;
const VISCOUS: f64 = 0.8;

/// Position and torque every 2 ms for 40 s. A controller follows slow sines and holds its torque; it computes `controls` torques in a sample.
fn controlled(seed: u64, controls: usize) -> [Vec<f64>; 2] {
    const STEPS: usize = 20;
    let step = 0.002;
    let h = step / STEPS as f64;
    let reference = |t: f64| -> f64 {
        let line = |(i, f): (usize, f64)| {
            0.6 / (1.0 + i as f64) * (std::f64::consts::TAU * f * t + (seed + i as u64) as f64).sin()
        };
        [0.1, 0.23, 0.41, 0.7, 1.1].into_iter().enumerate().map(line).sum()
    };
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut chance = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut q, mut v, mut torque) = (reference(0.0), 0.0_f64, 0.0);
    let [mut position, mut recorded] = [Vec::new(), Vec::new()];
    for i in 0..20_000 {
        for k in 0..STEPS {
            let t = step * i as f64 + h * k as f64;
            if k % (STEPS / controls) == 0 {
                torque = 8.0 * (20.0 * (reference(t) - q) - v);
            }
            if k == 0 {
                position.push(q + 1e-4 * chance());
                recorded.push(torque + 0.05 * chance());
            }
            let free = v + h * (torque - VISCOUS * v) / INERTIA;
            let held = COULOMB * h / INERTIA;
            let next = if free.abs() <= held {
                0.0
            } else {
                free - held.copysign(free)
            };
            q += 0.5 * h * (v + next);
            v = next;
        }
    }
    [position, recorded]
}

/// With a velocity that is only smoothed, and a delay that is estimated from all samples, no run had the half sample: inertia, Coulomb and viscous
/// friction were off by 2.0, 1.1 and -1.8 standard errors on average.
#[test]
fn an_axis_that_sticks_has_its_inertia_and_the_half_sample_of_its_torque() {
    const RUNS: u64 = 8;
    let mut mean = [0.0; 3];
    for seed in 0..RUNS {
        let axis = rigid_axis(&controlled(seed, 1), 0.002);
        let form = axis
            .friction
            .forms
            .iter()
            .find(|f| f.form == FormName::CoulombViscous)
            .unwrap();
        let off = |value: f64, error: f64, truth: f64| (value - truth) / error;
        let of = |symbol: &str, truth: f64| {
            let p = form.parameter(symbol).unwrap();
            off(p.value, p.standard_error, truth)
        };
        let inertia = off(form.inertia.value, form.inertia.standard_error, INERTIA);
        for (sum, off) in mean.iter_mut().zip([inertia, of("Fc", COULOMB), of("Fv", VISCOUS)]) {
            *sum += off / RUNS as f64;
        }
        let held = axis
            .findings
            .iter()
            .any(|f| matches!(f, Finding::TorqueDelay { held: true, .. }));
        assert!(held, "seed {seed}: {:?}", axis.findings);
        println!(
            "seed {seed}: {:?} {} {}",
            form.inertia,
            of("Fc", COULOMB),
            of("Fv", VISCOUS)
        );
    }
    println!("{mean:?}");
    for off in mean {
        assert!(off.abs() < 1.5, "{mean:?} standard errors from the truth on average");
    }
}

/// A controller that is much faster than the log leaves no half sample.
#[test]
fn a_torque_that_is_not_held_has_no_delay() {
    for seed in 0..3 {
        let axis = rigid_axis(&controlled(seed, 20), 0.002);
        let delayed = axis.findings.iter().any(|f| matches!(f, Finding::TorqueDelay { .. }));
        assert!(!delayed, "seed {seed}: {:?}", axis.findings);
    }
}
