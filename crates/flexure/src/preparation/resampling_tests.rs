//! Resampling against known truth and plain definitions.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::{Between, Grid, LowPass, Resampling, fill, nominal_step};

fn grid(start: f64, step: f64, samples: usize) -> Grid {
    Grid { start, step, samples }
}

/// Instants of a step of 0.01 that jitter by up to `share` of it to either side.
fn jittered(n: usize, share: f64) -> Vec<f64> {
    let late = |i: usize| share * (0.7 * (i * i) as f64).sin();
    (0..n).map(|i| 0.01 * (i as f64 + late(i))).collect()
}

/// The error falls with the fourth power of the step.
#[test]
fn the_error_of_a_smooth_signal_is_of_fourth_order() {
    let error = |n: usize| {
        let t: Vec<f64> = jittered(n, 0.4).iter().map(|t| t * 100.0 / n as f64).collect();
        let x: Vec<f64> = t.iter().map(|t| (TAU * t).sin()).collect();
        let grid = Grid::over([0.1, 0.9], 1.0 / n as f64).unwrap();
        let got = Resampling::default().resample(&t, &x, &grid).unwrap();
        let errors = grid.instants().zip(got).map(|(t, x)| (x - (TAU * t).sin()).abs());
        errors.fold(0.0_f64, f64::max)
    };
    let [coarse, fine] = [error(40), error(160)];
    assert!(coarse < 1e-3 && coarse / fine > 100.0, "{coarse} {fine}"); // 4^4 = 256
}

#[test]
fn the_samples_own_instants_change_nothing() {
    let own = grid(3.0, 0.01, 500);
    let t: Vec<f64> = own.instants().collect();
    let x: Vec<f64> = t.iter().map(|t| (50.0 * t * t).sin()).collect();
    for between in [Between::Smooth, Between::Held] {
        let resampling = Resampling {
            between,
            longest_gap: 3,
        };
        let got = resampling.resample(&t, &x, &own).unwrap();
        assert_eq!(got, x, "{between:?}");
    }
}

/// A sine is gone where it would show as another one, and is there where it would not.
#[test]
fn aliases_are_taken_out() {
    let t: Vec<f64> = (0..4000).map(|i| f64::from(i) / 100.0).collect();
    let left = |frequency: f64| {
        let x: Vec<f64> = t.iter().map(|t| (TAU * frequency * t).sin()).collect();
        let got = Resampling::default().resample(&t, &x, &grid(0.0, 0.05, 800)).unwrap();
        let middle = &got[100..700];
        (middle.iter().map(|x| x * x).sum::<f64>() * 2.0 / middle.len() as f64).sqrt()
    };
    // Half of the new rate is 10 Hz, the cutoff 8 Hz: the gain is 1/(1 + (f/8)^16), nearly, as the frequencies are low.
    for (frequency, gain) in [(1.0, 1.0), (5.0, 0.9995), (12.0, 0.0015), (30.0, 0.0)] {
        let left = left(frequency);
        assert!((left - gain).abs() < 1e-3, "{frequency} Hz: {left}");
    }
}

#[test]
fn gaps_are_bridged_up_to_a_length() {
    let mut t: Vec<f64> = (0..100).map(f64::from).collect();
    t.drain(40..43);
    t.drain(60..64); // 63 to 66
    let x: Vec<f64> = t.iter().map(|t| 0.01 * t * t).collect();
    let bridged = |longest_gap: usize| {
        let resampling = Resampling {
            between: Between::Smooth,
            longest_gap,
        };
        let got = resampling.resample(&t, &x, &grid(0.0, 1.0, 100)).unwrap();
        for (i, x) in got.iter().enumerate() {
            assert!(x.is_nan() || (x - 0.01 * (i * i) as f64).abs() < 1e-9, "{i}: {x}");
        }
        (0..100).filter(|&i| got[i].is_nan()).collect::<Vec<_>>()
    };
    assert_eq!(bridged(4), [0_usize; 0]);
    assert_eq!(bridged(3), [63, 64, 65, 66]);
    assert_eq!(bridged(2), [40, 41, 42, 63, 64, 65, 66]);
}

#[test]
fn missing_samples_are_filled_up_to_a_length() {
    let truth: Vec<f64> = (0..50).map(|i| (0.1 * f64::from(i)).sin()).collect();
    let mut x = truth.clone();
    for i in [0, 1, 10, 20, 21, 30, 31, 32, 33, 49] {
        x[i] = f64::NAN;
    }
    x[10] = f64::INFINITY;
    let filled = fill(&x, 3);
    for i in 0..50 {
        match i {
            0 | 1 | 30..=33 | 49 => assert!(filled[i].is_nan(), "{i}"),
            // (5/384) (3 * 0.1)^4 at most.
            10 | 20 | 21 => assert!((filled[i] - truth[i]).abs() < 1.1e-4, "{i}: {}", filled[i]),
            _ => assert_eq!(filled[i], truth[i], "{i}"),
        }
    }
    assert!(fill(&[f64::NAN; 3], 3).iter().all(|x| x.is_nan()));
    assert_eq!(fill(&[], 3), [0.0; 0]);
}

/// The mean of a held signal over each new step, by adding up tiny pieces.
#[test]
fn held_signals_have_their_means() {
    let t = jittered(200, 0.4);
    let x: Vec<f64> = (0..200).map(|i| f64::from((37 * i) % 11)).collect();
    let held = |at: f64| x[t.partition_point(|&t| t <= at).max(1) - 1];
    for step in [0.003, 0.01, 0.025] {
        let grid = Grid::over([t[0], 1.9], step).unwrap();
        let resampling = Resampling {
            between: Between::Held,
            longest_gap: 3,
        };
        let got = resampling.resample(&t, &x, &grid).unwrap();
        for (from, got) in grid.instants().zip(got) {
            let pieces = 2000;
            let sum: f64 = (0..pieces)
                .map(|i| held(from + step * (f64::from(i) + 0.5) / f64::from(pieces)))
                .sum();
            let mean = sum / f64::from(pieces);
            assert!(
                (got - mean).abs() < 11.0 * 2.0 / f64::from(pieces),
                "{from}: {got} {mean}"
            );
        }
    }
}

#[test]
fn held_signals_end_at_gaps() {
    let resampling = Resampling {
        between: Between::Held,
        longest_gap: 1,
    };
    let got = resampling
        .resample(
            &[0.0, 1.0, 2.0, 7.0, 8.0],
            &[5.0, 6.0, 7.0, 8.0, 9.0],
            &grid(0.0, 1.0, 10),
        )
        .unwrap();
    let missing: Vec<usize> = (0..10).filter(|&i| got[i].is_nan()).collect();
    assert_eq!(missing, [3, 4, 5, 6, 9]);
    assert_eq!([got[0], got[2], got[7], got[8]], [5.0, 7.0, 8.0, 9.0]);
}

#[test]
fn samples_at_one_instant_are_averaged() {
    let t = [0.0, 1.0, 1.0, 2.0, 3.0, 4.0];
    let got = Resampling::default()
        .resample(&t, &[0.0, 2.0, 4.0, 6.0, 9.0, 12.0], &grid(0.0, 1.0, 5))
        .unwrap();
    assert_eq!(got, [0.0, 3.0, 6.0, 9.0, 12.0]);
}

#[test]
fn the_usual_step_knows_gaps_from_steps() {
    assert_eq!(nominal_step(&jittered(2001, 0.4)).unwrap(), 0.01);
    let mut t: Vec<f64> = (0..300).map(|i| 0.2 + 0.01 * f64::from(i)).collect();
    t.drain(100..200);
    assert_eq!(nominal_step(&t).unwrap(), 0.01);
    t[50] = t[49]; // a stamp that was written twice
    assert!((nominal_step(&t).unwrap() - 0.01).abs() < 2e-4);
}

#[test]
fn instants_that_cannot_be() {
    let message = |t: &[f64]| nominal_step(t).unwrap_err().to_string();
    assert!(
        message(&[0.0, 1.0, 0.5]).contains("sample 2"),
        "{}",
        message(&[0.0, 1.0, 0.5])
    );
    assert!(message(&[0.0, f64::NAN]).contains("sample 1"));
    for t in [&[][..], &[1.0], &[1.0, 1.0]] {
        assert!(nominal_step(t).is_err(), "{t:?}");
    }
    let grid = grid(0.0, 1.0, 3);
    assert!(Resampling::default().resample(&[0.0, 1.0], &[1.0], &grid).is_err());
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-12] {
        assert!(Grid::over([0.0, 1.0], step).is_err(), "{step}");
    }
}

#[test]
fn instants_of_a_grid_are_short_decimals() {
    for (start, step) in [(0.0, 0.001), (0.2, 0.01), (0.0, 0.02), (5.0, 0.1), (-0.4, 0.1)] {
        let grid = grid(start, step, 5000);
        for t in grid.instants() {
            assert!(t.to_string().len() <= 7, "{start} {step}: {t}");
        }
    }
    assert_eq!(Grid::over([0.0, 0.3], 0.1).unwrap().samples, 4);
    assert_eq!(Grid::over([0.0, 0.299], 0.1).unwrap().samples, 3);
    // For any other step the instants are right up to rounding.
    let third = grid(1.0, 1.0 / 3.0, 10);
    assert!((third.instant(9) - 4.0).abs() < 1e-14);
    assert!((grid(0.0, 2.5, 5).instant(4) - 10.0).abs() < 1e-14);
}

/// A filtered signal is delayed by nothing, and a missing sample is as good as not there.
#[test]
fn a_low_pass_shifts_nothing() {
    let y: Vec<f64> = (0..2000).map(|i| (TAU * 0.5 * 0.01 * f64::from(i)).sin()).collect();
    let filter = LowPass { cutoff: 10.0, order: 4 };
    let whole = filter.filter(&y, 0.01).unwrap();
    for i in 100..1900 {
        assert!((whole[i] - y[i]).abs() < 1e-9, "{i}");
    }
    let mut holes = y.clone();
    [300, 301, 700].into_iter().for_each(|i| holes[i] = f64::NAN);
    holes[1000..1100].fill(f64::NAN);
    let filtered = filter.filter(&holes, 0.01).unwrap();
    for i in 0..2000 {
        match holes[i].is_nan() {
            true => assert!(filtered[i].is_nan(), "{i}"),
            false => assert!((filtered[i] - y[i]).abs() < 1e-3, "{i}: {}", filtered[i] - y[i]),
        }
    }
    let bad = [(0.0, 4), (50.0, 4), (f64::NAN, 4), (5.0, 3), (5.0, 0), (5.0, 22)];
    for (cutoff, order) in bad {
        assert!(LowPass { cutoff, order }.filter(&y, 0.01).is_err(), "{cutoff} {order}");
    }
    assert!(filter.filter(&y, 0.0).is_err());
    assert_eq!(filter.filter(&[3.0], 0.01).unwrap(), [3.0]);
}

proptest! {
    /// The direction of time does not matter, and neither do the scale and the offset of the signal.
    #[test]
    fn a_low_pass_is_linear_and_symmetric(x in prop::collection::vec(-1.0..1.0_f64, 2..80), scale in -5.0..5.0_f64) {
        let filter = |x: &[f64]| LowPass { cutoff: 7.0, order: 6 }.filter(x, 0.02).unwrap();
        let plain = filter(&x);
        let scaled = filter(&x.iter().map(|x| scale * x + 3.0).collect::<Vec<_>>());
        for (scaled, plain) in scaled.iter().zip(&plain) {
            prop_assert!((scaled - (scale * plain + 3.0)).abs() < 1e-9);
        }
    }
}

/// A clock that jitters by 2 % of its step and lost three samples: the others keep their values, and nothing leaves their range.
#[test]
fn samples_near_the_new_instants_keep_their_values() {
    let kept: Vec<usize> = (0..200).filter(|i| !(90..93).contains(i)).collect();
    let t: Vec<f64> = kept
        .iter()
        .map(|i| 0.25 * (*i as f64 + 0.02 * (7.0 * *i as f64).sin()))
        .collect();
    // A command that jumps, which a spline through the instants as they are would overshoot.
    let x: Vec<f64> = kept.iter().map(|i| if i / 10 % 2 == 0 { 0.0 } else { 1.0 }).collect();
    let grid = grid(0.0, 0.25, 200);
    let smooth = Resampling::default().resample(&t, &x, &grid).unwrap();
    for (i, x) in kept.iter().zip(&x) {
        assert!((smooth[*i] - x).abs() < 1e-14, "{i}: {} {x}", smooth[*i]);
    }
    assert!(smooth[90..93].iter().all(|x| x.is_finite()));
    // With a jitter of 15 % the instants count: the values change.
    let t: Vec<f64> = kept
        .iter()
        .map(|i| 0.25 * (*i as f64 + 0.15 * (7.0 * *i as f64).sin()))
        .collect();
    let smooth = Resampling::default().resample(&t, &x, &grid).unwrap();
    assert!(kept.iter().zip(&x).any(|(i, x)| (smooth[*i] - x).abs() > 0.01));
}
