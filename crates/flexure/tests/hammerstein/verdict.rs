//! The verdict is honest: it accepts what holds, refutes what does not, and says when there is nothing.

use flexure::identify::{Verdict, Warning};

use super::*;

#[test]
fn a_hammerstein_system_whose_noise_hides_the_estimate_s_error_is_accepted() {
    let linear = filter(&[1.0, 0.4], &[1.0, -0.6]);
    let accepted = (0..40)
        .filter(|&seed| {
            // The output's own standard deviation is about 2.5, the noise's 5.
            let result = identify(&hammerstein(|u| u.tanh() + 0.3 * u, &linear, 8000, 5.0, seed));
            if result.verdict.holds() {
                let message = result.verdict.text();
                assert!(
                    message.contains("The model holds: no residual test")
                        || message.contains("The error is correlated in time"),
                    "{message}"
                );
            }
            result.verdict.holds()
        })
        .count();
    // The tests at 1 % together, and what is left of the estimate's error.
    assert!(accepted >= 36, "{accepted} of 40");
}

/// y'' = -y' - y - 4 y^3 + u in steps of 0.1: a nonlinear spring in the loop.
fn duffing(n: usize, seed: u64) -> Record {
    let u = uniform(seed, n, 8.0);
    let (mut y, mut v, step) = (0.0_f64, 0.0_f64, 0.1);
    let output: Vec<f64> = u
        .iter()
        .map(|u| {
            v += step * (u - v - y - 4.0 * y.powi(3));
            y += step * v;
            y
        })
        .collect();
    let e = normal(seed + 1, n, 0.01);
    record(u, output.iter().zip(e).map(|(y, e)| y + e).collect())
}

/// Linear first, then a strong nonlinearity.
fn wiener(n: usize, seed: u64) -> Record {
    let u = uniform(seed, n, 2.0);
    let x = filter(&[0.5], &[1.0, -0.8]).simulate(&u);
    let e = normal(seed + 1, n, 0.01);
    record(u, x.iter().zip(e).map(|(x, e)| (2.0 * x).tanh() + x * x + e).collect())
}

#[test]
fn feedback_and_wiener_systems_are_refuted_by_a_named_test() {
    for seed in 0..5 {
        for (name, record) in [("duffing", duffing(10_000, seed)), ("wiener", wiener(10_000, seed))] {
            let result = identify(&record);
            assert!(!result.verdict.holds(), "{name}: {}", result.verdict.text());
            let message = result.verdict.text();
            let test = result.verdict.refutation().unwrap();
            assert!(message.contains(test.kind.name()), "{name}: {message}");
            assert!(message.contains("does not hold"), "{name}: {message}");
        }
    }
}

#[test]
fn unrelated_signals_are_called_that() {
    let alarms = (0..30)
        .filter(|&seed| {
            let result = identify(&record(uniform(seed, 3000, 1.0), normal(seed + 100, 3000, 2.0)));
            let fit = result.verdict.measures.fit_percent;
            assert!(fit < 5.0, "{fit}");
            assert!(!(result.verdict.holds() && fit > 2.0), "{}", result.verdict.text());
            result
                .warnings
                .iter()
                .any(|w| matches!(w, Warning::NoDependence { .. }))
        })
        .count();
    assert!(alarms >= 29, "{alarms} of 30");
    let warning = Warning::NoDependence { lags: 450 }.to_string();
    assert!(
        warning.contains("no significant dependence on the input at lags 0 to 450"),
        "{warning}"
    );
}

#[test]
fn a_coloured_input_is_named() {
    let linear = filter(&[1.0], &[1.0, -0.5]);
    let u = filter(&[1.0], &[1.0, -0.6]).simulate(&normal(4, 5000, 1.0));
    let y = linear.simulate(&u);
    let result = identify(&record(u, y));
    let Some(Warning::InputNotWhite { largest, lag }) = result
        .warnings
        .iter()
        .find(|w| matches!(w, Warning::InputNotWhite { .. }))
    else {
        panic!("{:?}", result.warnings);
    };
    assert_eq!(*lag, 1);
    assert!((largest - 0.6).abs() < 0.05);
}

#[test]
fn a_range_that_was_not_covered_is_named() {
    let mut u = uniform(3, 2000, 1.0);
    u[1500..].iter_mut().for_each(|u| *u *= 2.0);
    let y = u.iter().map(|u| u + u * u).collect();
    let result = identify(&record(u, y));
    let outside = result.warnings.iter().find_map(|w| match w {
        Warning::OutsideRange { percent, low, high, .. } => Some((*percent, *low, *high)),
        _ => None,
    });
    let (percent, low, high) = outside.unwrap();
    assert!(
        (percent - 50.0).abs() < 8.0 && low > -1.0 && high < 1.0,
        "{percent} {low} {high}"
    );
}

#[test]
fn a_short_record_of_a_quick_system_has_settled() {
    let quick = hammerstein(|u| u, &filter(&[1.0], &[1.0, -0.3]), 160, 0.05, 2);
    let slow = hammerstein(|u| u, &filter(&[1.0], &[1.0, -0.995]), 160, 0.0, 2);
    let unsettled = |r: &Record| {
        identify(r)
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::NotSettled { .. }))
    };
    assert!(!unsettled(&quick));
    assert!(unsettled(&slow));
}

#[test]
fn an_input_of_few_levels_is_named() {
    let linear = filter(&[1.0], &[1.0, -0.5]);
    let u: Vec<f64> = uniform(3, 3000, 1.0).iter().map(|u| u.signum()).collect();
    let y = linear.simulate(&u);
    let result = identify(&record(u, y));
    assert!(
        result.warnings.contains(&Warning::FewLevels { levels: 2 }),
        "{:?}",
        result.warnings
    );
    assert_eq!(curve(&result).x(), [-1.0, 1.0]);
}

/// The verdict on a prediction that misses a part of the output. `misfit` and `noise` are in standard deviations of the output; the noise
/// is white.
fn with_misfit(misfit: f64, noise: f64) -> Verdict {
    let (n, filter) = (20_000, filter(&[1.0, 0.4], &[1.0, -0.6]));
    let u = normal(1, n, 1.0);
    let predicted = filter.simulate(&u);
    let (y, e) = (spread(&predicted), normal(2, n, 1.0));
    // The standard deviation of u^2 is the root of two.
    let missed = |u: f64| misfit * y * (u * u - 1.0) / 2_f64.sqrt();
    let output: Vec<f64> = (0..n).map(|i| predicted[i] + missed(u[i]) + noise * y * e[i]).collect();
    Verdict::new(&u, &output, &predicted).unwrap()
}

pub fn spread(v: &[f64]) -> f64 {
    let centre = v.iter().sum::<f64>() / v.len() as f64;
    (v.iter().map(|v| (v - centre).powi(2)).sum::<f64>() / v.len() as f64).sqrt()
}

#[test]
fn the_misfit_is_that_of_the_system_and_decides_with_its_size() {
    let negligible = with_misfit(0.004, 0.02);
    assert!((negligible.misfit() - 0.004).abs() < 0.0004, "{}", negligible.misfit());
    assert!(negligible.refutation().is_some() && negligible.holds());
    assert!(negligible.headline().contains("negligible misfit"));
    assert!(
        negligible
            .text()
            .contains("The model holds, but for a negligible misfit of 0."),
        "{}",
        negligible.text()
    );

    let large = with_misfit(0.05, 0.02);
    assert!(
        (large.misfit() - 0.05).abs() < 0.003 && !large.holds(),
        "{}",
        large.misfit()
    );
    assert!(
        large.text().contains("depends on the squared input (test"),
        "{}",
        large.text()
    );
    assert_eq!(with_misfit(0.0, 0.02).misfit(), 0.0);
}

#[test]
fn headline_and_text_agree() {
    for misfit in [0.0, 0.002, 0.008, 0.012, 0.1, 1.0, 3.0] {
        for noise in [0.001, 0.03, 0.5, 2.0] {
            let verdict = with_misfit(misfit, noise);
            let (head, text) = (verdict.headline(), verdict.text());
            assert_eq!(verdict.holds(), text.contains("The model holds"), "{head}: {text}");
            assert_eq!(verdict.holds(), head.starts_with("The model holds"), "{head}: {text}");
            assert_eq!(verdict.holds(), verdict.in_short().starts_with("holds"), "{head}");
            let refuted = head.contains("does not hold");
            assert_eq!(refuted, verdict.in_short().contains("does not hold"), "{head}");
            assert_eq!(refuted, text.contains("does not hold"), "{head}: {text}");
            assert_eq!(
                head.contains("exactly"),
                text.contains("hold exactly"),
                "{head}: {text}"
            );
        }
    }
}
