//! Delay, order, linear part and nonlinearity are found, and better from more samples.

use flexure::identify::RegressionLag;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts, relative_error_after_alignment};

use super::*;

fn grid() -> Vec<f64> {
    (0..=200).map(|i| -1.9 + 3.8 * i as f64 / 200.0).collect()
}

fn error(system: &KnownHammerstein, result: &Identification) -> f64 {
    system.nonlinearity_error(&grid(), |x| curve(result).value(x))
}

/// The relative L2 distance of the linear part's impulse response from the truth's, after the best gain: the
/// static gain of a resonance is small, and scaling by its estimate would hide the rest.
fn impulse_error(result: &Identification, truth: &TransferFunction) -> f64 {
    let (k, estimate) = (truth.impulse_response(400), linear_part(result).impulse_response(400));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let cosine = dot(&k, &estimate).powi(2) / (dot(&k, &k) * dot(&estimate, &estimate));
    (1.0 - cosine).max(0.0).sqrt()
}

fn mean_error(system: &KnownHammerstein, n: usize, seeds: u64) -> f64 {
    let total: f64 = (0..seeds)
        .map(|s| error(system, &identify(&system.simulate(n, s))))
        .sum();
    total / seeds as f64
}

#[test]
fn the_nonlinearity_s_error_falls_as_n_grows() {
    for (which, linear) in known_linear_parts().into_iter().enumerate() {
        for phi in KnownNonlinearity::ALL {
            let system = KnownHammerstein::usual(phi, linear.clone());
            let (few, many) = (mean_error(&system, 2000, 6), mean_error(&system, 20_000, 6));
            // n^(-2/5) is a factor 0.40, n^(-1/4) of jumps 0.56.
            let factor = if phi.is_continuous() { 0.55 } else { 0.75 };
            assert!(many < factor * few, "{phi:?} {which}: {few} {many}");
            // The size that direct experiments show: the resonance has the longer memory.
            assert!(many < [0.12, 0.20][which], "{phi:?} {which}: {many}");
        }
    }
}

#[test]
fn the_linear_part_is_recovered() {
    for phi in KnownNonlinearity::ALL {
        for (which, linear) in known_linear_parts().into_iter().enumerate() {
            let result = identify(&KnownHammerstein::usual(phi, linear.clone()).simulate(20_000, 3));
            assert_eq!(result.order, 2, "{phi:?} {which}");
            let singular = numbers(&result, "hankel_singular_values");
            assert!(singular[1] > 3.0 * singular[2], "{phi:?} {which}: {singular:?}");
            let tolerance = [0.08, 0.01][which];
            assert_close(linear_part(&result).a(), linear.a(), tolerance, "a");
            assert!(
                impulse_error(&result, &linear) < 0.06,
                "{phi:?} {which}: {}",
                impulse_error(&result, &linear)
            );
            assert!((linear_part(&result).static_gain() - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn every_delay_is_found() {
    for delay in [0, 3, 5] {
        for phi in [KnownNonlinearity::DeadZone, KnownNonlinearity::Parabola] {
            let mut b = vec![0.0; delay];
            b.extend([1.0, 0.4, 0.1]);
            let linear = filter(&b, &[1.0, -1.2, 0.52]);
            let result = identify(&KnownHammerstein::usual(phi, linear.clone()).simulate(8000, 5));
            assert_eq!(result.delay, delay, "{phi:?}");
            assert_eq!(lag_of_regression(&result), delay + 1, "{phi:?}");
            assert!(linear_part(&result).b()[..delay].iter().all(|&b| b == 0.0));
            assert!(impulse_error(&result, &linear) < 0.1, "{phi:?} {delay}");
        }
    }
}

#[test]
fn a_first_coefficient_below_the_noise_costs_a_sample_of_delay_and_no_more() {
    // k_0 is 0.05 of a response that swings up to 0.6: its share of the output's variance is lost among all
    // lags' chance, and the response that is found starts at k_1.
    let [_, resonance] = known_linear_parts();
    let result = identify(&KnownHammerstein::usual(KnownNonlinearity::Cubic, resonance.clone()).simulate(20_000, 1));
    assert_eq!(result.delay, 1);
    assert!(
        impulse_error(&result, &resonance) < 0.1,
        "{}",
        impulse_error(&result, &resonance)
    );
    let given = PlainHammerstein {
        delay: Some(0),
        ..Default::default()
    };
    let system = KnownHammerstein::usual(KnownNonlinearity::Cubic, resonance.clone());
    let result = given.identify(&system.simulate(20_000, 1), "u", "y").unwrap();
    assert_eq!(result.delay, 0);
    assert!(
        impulse_error(&result, &resonance) < 0.1,
        "{}",
        impulse_error(&result, &resonance)
    );
}

#[test]
fn the_paper_s_lag_works_and_the_strongest_is_better() {
    let [linear, _] = known_linear_parts();
    for phi in KnownNonlinearity::ALL {
        let system = KnownHammerstein::usual(phi, linear.clone());
        let mean = |regression_lag| {
            let method = PlainHammerstein {
                regression_lag,
                ..Default::default()
            };
            let total: f64 = (0..5)
                .map(|seed| {
                    let result = method.identify(&system.simulate(8000, seed), "u", "y").unwrap();
                    let expected = if regression_lag == RegressionLag::Strongest {
                        1
                    } else {
                        0
                    };
                    assert_eq!((result.delay, lag_of_regression(&result)), (0, expected));
                    error(&system, &result)
                })
                .sum();
            total / 5.0
        };
        // k_0 = 1, k_1 = 1.6.
        let (paper, strongest) = (mean(RegressionLag::Delay), mean(RegressionLag::Strongest));
        assert!(strongest < 0.95 * paper, "{phi:?}: {paper} {strongest}");
        assert!(paper < 0.25, "{phi:?}: {paper}");
    }
}

#[test]
fn an_even_nonlinearity_is_correlated_with_itself() {
    let linear = filter(&[0.0, 1.0, 0.5], &[1.0, -0.7]);
    let result = identify(&hammerstein(|u| u * u, &linear, 10_000, 0.05, 9));
    assert!(is_correlated_with(&result, "estimated nonlinearity"));
    assert_eq!((result.delay, result.order), (1, 1));
    assert!(
        impulse_error(&result, &linear) < 0.05,
        "{}",
        impulse_error(&result, &linear)
    );
    let truth: Vec<f64> = grid().iter().map(|x| x * x).collect();
    let estimate: Vec<f64> = grid().iter().map(|&x| curve(&result).value(x)).collect();
    assert!(relative_error_after_alignment(&truth, &estimate) < 0.06);
    // An odd one is correlated with the input.
    let odd = identify(&hammerstein(|u| u * u * u, &linear, 10_000, 0.05, 9));
    assert!(is_correlated_with(&odd, "input"));
}

#[test]
fn a_static_system_has_order_zero() {
    let result = identify(&hammerstein(|u| u.tanh(), &filter(&[1.0], &[1.0]), 4000, 0.05, 2));
    assert_eq!((result.order, result.delay, lag_of_regression(&result)), (0, 0, 0));
    assert_close(linear_part(&result).b(), &[1.0], 1e-12, "b");
    for x in [-1.5, -0.3, 0.0, 1.2] {
        assert!((curve(&result).value(x) - x.tanh()).abs() < 0.03);
    }
}

#[test]
fn the_band_covers_the_mean_estimate_at_its_level() {
    // The pointwise 95 % are for the variance only. So the truth here is the mean estimate over many records, which has the same bias.
    let linear = filter(&[1.0], &[1.0, -0.5]);
    let results: Vec<Identification> = (0..60)
        .map(|seed| {
            PlainHammerstein {
                parameter: Some(0.3),
                order: Some(1),
                delay: Some(0),
                regression_lag: RegressionLag::Delay,
                ..Default::default()
            }
            .identify(&hammerstein(|u| u.sin(), &linear, 3000, 0.2, seed), "u", "y")
            .unwrap()
        })
        .collect();
    let (mut inside, mut all) = (0, 0);
    for x in [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5] {
        // In the regression's own scale: the band does not include the scatter of the gain and the level.
        let own = |r: &Identification| {
            let gain = impulse(r).values[0];
            let i = curve(r).x().partition_point(|&v| v < x);
            (curve(r).value(x) * gain, static_block(r).band[i] * gain.abs())
        };
        let mean = results.iter().map(|r| own(r).0).sum::<f64>() / results.len() as f64;
        for r in &results {
            let (value, half) = own(r);
            all += 1;
            inside += usize::from((value - mean).abs() < half);
        }
    }
    let share = f64::from(inside as u32) / f64::from(all as u32);
    assert!((0.88..=0.99).contains(&share), "{share}");
}
