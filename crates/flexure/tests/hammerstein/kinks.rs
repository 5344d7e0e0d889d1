//! Where the refined identification finds kinks and jumps, and how certain it says that it is.

use flexure::identify::result::Value;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

use super::refined::{breakpoints, refined};
use super::*;

#[test]
fn kinks_and_jumps_are_found_where_they_are() {
    let [linear, _] = known_linear_parts();
    let found = |phi| {
        let result = refined(&KnownHammerstein::usual(phi, linear.clone()).simulate(20_000, 2));
        breakpoints(&result)
    };
    let zone = found(KnownNonlinearity::DeadZone);
    assert_eq!(zone.len(), 2);
    assert!(
        (zone[0].at + 0.5).abs() < 0.03 && (zone[1].at - 0.7).abs() < 0.03,
        "{zone:?}"
    );
    assert!(zone.iter().all(|b| b.kind == "kink".into() && b.error.is_some()));
    let limiter = found(KnownNonlinearity::HardLimiter);
    assert!(limiter.len() == 1 && limiter[0].at.abs() < 2e-3 && limiter[0].kind == "jump".into());
    // The place of a jump is found at another rate, and has no standard error.
    assert!(limiter[0].error.is_none());
    let steps = found(KnownNonlinearity::Quantizer);
    assert_eq!(steps.len(), 8);
    for (step, want) in steps.iter().zip([-1.75, -1.25, -0.75, -0.25, 0.25, 0.75, 1.25, 1.75]) {
        assert!((step.at - want).abs() < 5e-3 && step.kind == "jump".into(), "{steps:?}");
    }
    assert!(found(KnownNonlinearity::Cubic).is_empty());
}

/// The errors of the places of a dead zone's kinks, divided by their standard errors, follow the normal distribution: under a white input,
/// and under one that is held for 7 samples. The kinks lie between its values and not at one of them. The bounds are three deviations of a
/// share of 90.
#[test]
fn kinks_are_as_near_as_their_standard_errors_say() {
    let [damped, _] = known_linear_parts();
    let slow = filter(&[0.28], &[1.0, -1.73, 0.7441]);
    for (hold, linear) in [(1, damped), (7, slow)] {
        let mut scores = Vec::new();
        for seed in 0..50 {
            let levels = normal(500 + seed, 3000 / hold + 1, 1.5);
            let u: Vec<f64> = (0..3000).map(|k| levels[k / hold]).collect();
            let w: Vec<f64> = u.iter().map(|u| KnownNonlinearity::DeadZone.value(*u)).collect();
            let y = linear.simulate(&w);
            let noise = normal(600 + seed, 3000, 0.05 * verdict::spread(&y));
            let found = breakpoints(&refined(&record(u, y.iter().zip(noise).map(|(y, e)| y + e).collect())));
            // A few records are taken for smooth curves, or for curves with a jump.
            if found.len() == 2 {
                let pairs = found.iter().zip([-0.5, 0.7]);
                scores.extend(pairs.map(|(kink, truth)| (kink.at - truth) / kink.error.unwrap()));
            }
        }
        assert!(scores.len() >= 86, "{hold}: {}", scores.len());
        let share = |limit: f64| scores.iter().filter(|z| z.abs() < limit).count() as f64 / scores.len() as f64;
        let (one, two) = (share(1.0), share(1.96));
        assert!((0.53..0.83).contains(&one) && two >= 0.88, "{hold}: {one} {two}");
    }
}

/// Motors are often driven by a command that is held for several samples. Neighbours then have one value of the nonlinearity, and
/// the slow linear part spreads what a wrong one does over all of them.
#[test]
fn a_held_input_shows_the_kinks_and_no_jumps() {
    let dead_zone = |u: f64| u.signum() * (u.abs() - 0.8).max(0.0);
    for (hold, seed) in [(3, 21), (7, 22), (7, 23), (20, 24)] {
        let levels = normal(seed, 3000 / hold + 1, 2.4);
        let u: Vec<f64> = (0..3000).map(|k| levels[k / hold]).collect();
        let w: Vec<f64> = u.iter().map(|u| 20.0 * dead_zone(*u)).collect();
        let noise = normal(seed + 100, 3000, 0.3);
        let y = filter(&[0.014], &[1.0, -1.73, 0.7441]).simulate(&w);
        let y = y.iter().zip(noise).map(|(y, e)| y + e).collect();
        let result = refined(&record(u, y));
        let found = breakpoints(&result);
        let near = |at: f64| found.iter().any(|b| (b.at - at).abs() < 0.08);
        assert!(near(-0.8) && near(0.8), "{hold} {seed}: {found:?}");
        // With 150 levels the dead zone may be drawn with smooth pieces.
        let most = if hold == 20 { 10 } else { 4 };
        assert!(found.len() <= most, "{hold} {seed}: {found:?}");
        assert!(found.iter().all(|b| b.kind != Value::Text("jump".into())), "{found:?}");
    }
}

/// A dead zone under 150 values that are held. If no sample lies between one of its kinks and a second kink next to it, neither place is
/// determined, and one of the two is superfluous.
#[test]
fn kinks_that_no_sample_separates_are_one() {
    let linear = filter(&[0.0, 0.5, 0.2], &[1.0, -0.9, 0.3]);
    let dead_zone = |u: f64| u - u.clamp(-0.5, 0.8);
    for seed in 0..12 {
        let levels = uniform(700 + seed, 150, 2.0);
        let u: Vec<f64> = (0..3000).map(|k| levels[k / 20]).collect();
        let y = linear.simulate(&u.iter().map(|u| dead_zone(*u)).collect::<Vec<_>>());
        let noise = normal(800 + seed, 3000, 0.02 * verdict::spread(&y));
        let result = refined(&record(u, y.iter().zip(noise).map(|(y, e)| y + e).collect()));
        let found = breakpoints(&result);
        assert_eq!(found.len(), 2, "{seed}: {found:?}");
        for (kink, truth) in found.iter().zip([-0.5, 0.8]) {
            assert!((kink.at - truth).abs() < 4.0 * kink.error.unwrap(), "{seed}: {found:?}");
        }
        let band = &static_block(&result).band;
        assert!(band.iter().all(|half| *half < 0.1), "{seed}: {band:?}");
    }
}
