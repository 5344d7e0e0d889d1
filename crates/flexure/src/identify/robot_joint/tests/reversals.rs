//! An axis with Coulomb friction that brakes, stops, sticks and starts again, under a digital controller.

use super::*;

const INERTIA: f64 = 0.35;
const COULOMB: f64 = 1.2;
const VISCOUS: f64 = 0.8;

/// Position and torque every 2 ms for 40 s. A controller follows slow sines and holds its torque; it computes `controls` torques in a sample.
fn controlled(seed: u64, controls: usize) -> [Vec<f64>; 2] {
    logged(seed, controls, 0.002, 1.0)
}

/// The same at this sample time, of 20,000 samples, with sines of these many times the frequencies.
fn logged(seed: u64, controls: usize, step: f64, faster: f64) -> [Vec<f64>; 2] {
    const STEPS: usize = 20;
    let h = step / STEPS as f64;
    let reference = |t: f64| -> f64 {
        let line = |(i, f): (usize, f64)| {
            0.6 / (1.0 + i as f64) * (std::f64::consts::TAU * f * faster * t + (seed + i as u64) as f64).sin()
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

/// The delay of the torque that an axis says.
fn delay(axis: &RigidAxis) -> f64 {
    let delay = axis.findings.iter().find_map(|finding| match finding {
        Finding::TorqueDelay { delay, held: true } => Some(*delay),
        _ => None,
    });
    delay.unwrap_or(0.0)
}

/// A torque held for 4 ms and logged as often. With samples of a smoothed velocity, these logs had a Stribeck effect, or a delay that was off by a tenth of a sample and more.
#[test]
fn a_torque_held_for_long_samples_makes_no_stribeck_effect() {
    for (seed, faster) in [(0, 0.5), (1, 0.5), (2, 3.0), (3, 3.0)] {
        let axis = rigid_axis(&logged(seed, 1, 0.004, faster), 0.004);
        let form = axis.friction.best();
        assert_eq!(form.form, FormName::CoulombViscous, "seed {seed}");
        assert!(
            form.lack_of_fit.p_value > REFUTED,
            "seed {seed}: {:?}",
            form.lack_of_fit
        );
        assert!((delay(&axis) - 0.002).abs() < 1e-4, "seed {seed}: {:?}", axis.findings);
        let parameters = [("Fc", COULOMB), ("Fv", VISCOUS)].map(|(symbol, truth)| {
            let p = form.parameter(symbol).unwrap();
            (p.value, truth)
        });
        for (value, truth) in parameters.into_iter().chain([(form.inertia.value, INERTIA)]) {
            assert!(
                (value / truth - 1.0).abs() < 0.01,
                "seed {seed}: {value}, but it is {truth}"
            );
        }
    }
}

/// A drive that logs the torque of the sample before.
#[test]
fn a_torque_logged_after_it_acted_is_moved_back() {
    let [position, torque] = logged(4, 1, 0.002, 1.0);
    let last = position.len() - 1;
    let axis = rigid_axis(&[position[1..].to_vec(), torque[..last].to_vec()], 0.002);
    assert!((delay(&axis) + 0.001).abs() < 1e-4, "{:?}", axis.findings);
    let form = axis.friction.best();
    assert!((form.inertia.value / INERTIA - 1.0).abs() < 0.01, "{:?}", form.inertia);
    let viscous = form.parameter("Fv").unwrap();
    assert!((viscous.value / VISCOUS - 1.0).abs() < 0.02, "{viscous:?}");
}

#[test]
fn a_noisy_torque_that_acts_at_its_sample_is_not_moved() {
    // The torque that a smooth motion needs, which jumps with the friction.
    for seed in 0..4 {
        let mut random = Pcg64::seed_from_u64(seed);
        let lines = [(0.17, 0.5), (0.55, 0.2), (1.29, 0.08)].map(|(f, size)| {
            let w: f64 = std::f64::consts::TAU * f * random.random_range(0.9..1.1);
            [w, size, random.random_range(0.0..std::f64::consts::TAU)]
        });
        let [position, torque] = [false, true].map(|is_torque| -> Vec<f64> {
            let at = |k: usize| {
                let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
                    lines
                        .iter()
                        .map(|&[w, size, phase]| of(w, size, w * 0.002 * k as f64 + phase))
                        .sum()
                };
                let (v, a) = (
                    sum(&|w, size, x| size * w * x.cos()),
                    sum(&|w, size, x| -size * w * w * x.sin()),
                );
                match is_torque {
                    true => 0.5 * a + 4.0 * v + 3.0 * v.signum(),
                    false => sum(&|_, size, x| size * x.sin()),
                }
            };
            (0..10_000).map(at).collect()
        });
        let axis = rigid_axis(&[noisy(&position, 2e-5, seed), noisy(&torque, 0.3, seed + 50)], 0.002);
        let moved = axis.findings.iter().any(|f| matches!(f, Finding::TorqueDelay { .. }));
        assert!(!moved, "{seed}: {:?}", axis.findings);
        assert!(
            (axis.inertia.value / 0.5 - 1.0).abs() < 0.007,
            "{seed}: {:?}",
            axis.inertia
        );
    }
}
