//! Noise whose effect on the products is known, and is taken off.

use super::super::basis::Basis;
use super::super::equations::Equations;
use super::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const SAMPLES: usize = 8000;
const STEP: f64 = 0.01;

/// A sum of sines, and its second derivative.
fn sines(lines: &[[f64; 3]]) -> [Vec<f64>; 2] {
    let at = |f: &dyn Fn(f64, &[f64; 3]) -> f64| -> Vec<f64> {
        let sum = |i: usize| lines.iter().map(|line| f(i as f64 * STEP, line)).sum();
        (0..SAMPLES).map(sum).collect()
    };
    [
        at(&|t, [size, w, phase]| size * (w * t + phase).sin()),
        at(&|t, [size, w, phase]| -size * w * w * (w * t + phase).sin()),
    ]
}

/// A motor on a spring that hardly moves against it: what the encoders' noise does to inertia and stiffness is known and taken off.
#[test]
fn noise_that_two_columns_share_is_taken_off() {
    const NOISE: f64 = 2e-3;
    const RUNS: usize = 60;
    let (inertia, stiffness) = (1.0, 40.0);
    let [motor, acceleration] = sines(&[[0.3, 1.1, 0.0], [0.1, 3.7, 1.0], [0.04, 7.9, 2.0]]);
    let [d, _] = sines(&[[0.03, 1.1, 0.1], [0.02, 3.7, 1.2], [0.02, 7.9, 2.1]]);
    let modulation = Modulation::new(SAMPLES, STEP, 3.0);
    let tau: Vec<f64> = acceleration
        .iter()
        .zip(&d)
        .map(|(a, d)| inertia * a + stiffness * d)
        .collect();
    let noise = vec![1.0; modulation.len()];
    let spectrum = |power: i32| -> Vec<f64> { modulation.omega.iter().map(|w| w.powi(power)).collect() };
    let (flat, shared, own) = (spectrum(0), spectrum(2), spectrum(4));
    let variance = NOISE * NOISE;
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    let mut noisy = |x: &[f64]| -> Vec<f64> {
        let mut error = || -> f64 { StandardNormal.sample(&mut rng) };
        x.iter().map(|x| x + NOISE * error()).collect()
    };
    let link: Vec<f64> = motor.iter().zip(&d).map(|(m, d)| m - d).collect();
    let mut found = [Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..RUNS {
        let (motor, link) = (noisy(&motor), noisy(&link));
        let d: Vec<f64> = motor.iter().zip(&link).map(|(m, q)| m - q).collect();
        let slopes = Slopes::of_all(&modulation, &[vec![1.0; SAMPLES]]);
        let abscissa = |factor, spectrum, covariance| AbscissaNoise {
            factor,
            block: 0,
            spectrum,
            covariance,
        };
        let (of_own, with_motor) = (
            abscissa(None, &flat[..], 2.0 * variance),
            abscissa(Some(0), &shared[..], -variance),
        );
        let square = Noisy {
            columns: [0, 0],
            block: 0,
            spectrum: &own,
            factor: variance,
        };
        let of_abscissa = [of_own, with_motor]
            .into_iter()
            .flat_map(|noise| noise.noisy(&slopes, |k| 1 + k));
        let all: Vec<Noisy> = of_abscissa.chain([square]).collect();
        for (found, noisy) in found.iter_mut().zip([Vec::new(), vec![square], all]) {
            let equations = Equations {
                columns: vec![
                    vec![Some(modulation.of_acceleration(&motor))],
                    vec![Some(modulation.of(&d))],
                ],
                right: vec![modulation.of(&tau)],
                noise: vec![&noise],
                noisy,
                given: Vec::new(),
            };
            found.push(equations.solve().unwrap().x[0] - inertia);
        }
    }
    let means = found.map(|errors| {
        let mean = errors.iter().sum::<f64>() / RUNS as f64;
        let spread = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
        (mean, mean / (spread / RUNS as f64).sqrt())
    });
    println!(
        "off, and in standard errors: nothing taken off {:?}, squares {:?}, all {:?}",
        means[0], means[1], means[2]
    );
    assert!(means[0].1.abs() > 5.0 && means[1].1.abs() > 5.0, "{means:?}");
    assert!(means[2].1.abs() < 3.0, "{means:?}");
}

/// Slopes of functions, and of splines, whose sum is d itself if all coefficients are equal.
#[test]
fn slopes_are_those_of_the_functions() {
    let [d, _] = sines(&[[0.3, 1.1, 0.0], [0.1, 3.7, 1.0]]);
    let modulation = Modulation::new(SAMPLES, STEP, 3.0);
    let basis = Basis::stiffness(&d, 5);
    let slopes = basis.slopes(&modulation, &d);
    assert!(
        (slopes.mean.iter().sum::<f64>() - 1.0).abs() < 1e-6,
        "{:?}",
        slopes.mean
    );
    let twice = |p: &SlopeProduct| {
        if p.functions[0] == p.functions[1] {
            p.mean
        } else {
            2.0 * p.mean
        }
    };
    let all: f64 = slopes.products.iter().map(twice).sum();
    assert!((all - 1.0).abs() < 1e-6, "{all}");
    let functions = Slopes::of_all(&modulation, &[vec![2.0; SAMPLES], d.clone()]);
    let mean: f64 = modulation.shares().zip(&d).map(|(w, d)| w * d).sum();
    assert!((functions.mean[0] - 2.0).abs() < 1e-12 && (functions.mean[1] - mean).abs() < 1e-15);
    assert_eq!(functions.products.len(), 3);
    assert!(
        (functions.products[1].mean - 2.0 * mean).abs() < 1e-12,
        "{:?}",
        functions.products
    );
}

/// Columns that are mostly noise keep half of their square.
#[test]
fn no_more_than_half_is_taken_off() {
    let lines = [1.0];
    let entry = |columns, factor| Noisy {
        columns,
        block: 0,
        spectrum: &lines,
        factor,
    };
    let normal = Matrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 1.0]);
    let mut noise = excess(&[entry([0, 0], 8.0), entry([0, 1], 0.5)], &[vec![1.0]]);
    // 2 ([4, 1; 1, 1] - share [8, 0.5; 0.5, 0]) is positive definite with a share of an eighth.
    let share = share_of(&normal, &noise);
    assert_eq!(share, 0.125);
    noise.iter_mut().for_each(|entry| entry.sum *= share);
    assert_eq!(
        less(normal.clone(), &noise),
        Matrix::from_row_slice(2, 2, &[3.0, 0.9375, 0.9375, 1.0])
    );
    assert_eq!(square(&noise, &[1.0, 2.0]), 1.0 + 2.0 * 0.0625 * 2.0);
    // What has noise within bounds loses all of it.
    let noise = excess(&[entry([0, 0], 0.5), entry([0, 1], 0.5)], &[vec![2.0]]);
    assert_eq!(share_of(&normal, &noise), 1.0);
    assert_eq!(
        less(normal, &noise),
        Matrix::from_row_slice(2, 2, &[3.0, 0.0, 0.0, 1.0])
    );
}
