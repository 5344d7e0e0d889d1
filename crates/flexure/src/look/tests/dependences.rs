//! Which column follows which.

use super::{lag, later, look_at, sum, times};
use crate::look::{Dependence, Direction, Kind, Relation, beside};
use crate::signal::gaussian;

const SAMPLES: usize = 4000;

/// The dependences of two columns. The first is column 0.
fn between(a: &[f64], b: &[f64]) -> Vec<Dependence> {
    look_at(&[("a", a), ("b", b)]).dependences
}

fn only(a: &[f64], b: &[f64]) -> Dependence {
    let mut found = between(a, b);
    assert_eq!(found.len(), 1, "{found:?}");
    found.remove(0)
}

#[test]
fn delays_are_found_to_the_sample() {
    for (delay, seed) in [(0, 1), (1, 2), (3, 3), (17, 4), (29, 5)] {
        let u = gaussian(SAMPLES, seed);
        let y = sum(&lag(0.8, &later(delay, &u)), &gaussian(SAMPLES, seed + 100));
        let found = only(&u, &y);
        assert_eq!((found.cause, found.effect, found.delay, found.block), (0, 1, delay, 1));
        assert_eq!(
            (found.kind, found.direction),
            (Kind::Linear, Direction::Forward),
            "delay {delay}"
        );
        // The order of the columns does not matter.
        let turned = only(&y, &u);
        assert_eq!((turned.cause, turned.effect, turned.delay), (1, 0, delay));
    }
}

/// A coloured input does not blur the delay, as it is whitened.
#[test]
fn delays_under_a_coloured_input() {
    let u = lag(0.95, &gaussian(SAMPLES, 11));
    let y = sum(&lag(0.8, &later(4, &u)), &gaussian(SAMPLES, 12));
    let found = only(&u, &y);
    assert_eq!((found.cause, found.delay, found.direction), (0, 4, Direction::Forward));
}

/// Outliers whiten badly: without them the effect does not seem to lead its cause.
#[test]
fn outliers_do_not_turn_a_dependence_round() {
    for seed in 31..36 {
        let values = gaussian(SAMPLES, seed);
        let u: Vec<f64> = (0..SAMPLES).map(|t| values[t / 7]).collect();
        let clean = sum(&lag(0.95, &later(3, &u)), &times(0.05, &gaussian(SAMPLES, seed + 100)));
        let mut y = clean.clone();
        for at in [411, 1333, 1334, 2600, 3777] {
            y[at] += 30.0;
        }
        let found = only(&u, &y);
        assert_eq!(
            (found.cause, found.delay, found.direction),
            (0, 3, Direction::Forward),
            "seed {seed}"
        );
        assert!((found.coherent - only(&u, &clean).coherent).abs() < 1e-3, "seed {seed}");
    }
}

#[test]
fn a_long_delay_is_found_to_a_block() {
    let u = lag(0.9, &gaussian(20_000, 21));
    let y = sum(&later(150, &u), &gaussian(20_000, 22));
    let found = only(&u, &y);
    assert!(
        found.block > 1 && found.delay.abs_diff(150) <= found.block,
        "{} of {}",
        found.delay,
        found.block
    );
    assert_eq!((found.cause, found.direction), (0, Direction::Forward));
}

/// A slow system under much noise changes too little from sample to sample; means show it.
#[test]
fn a_slow_system_under_noise() {
    let u = lag(0.99, &gaussian(40_000, 31));
    let y = lag(0.998, &u);
    let spread = y.iter().map(|v| v * v).sum::<f64>().sqrt() / 200.0;
    let measured = sum(&y, &times(spread, &gaussian(40_000, 32)));
    let found = only(&u, &measured);
    assert_eq!((found.cause, found.direction), (0, Direction::Forward));
    assert!(found.block > 1);
}

#[test]
fn the_coherent_share_is_that_of_the_signal() {
    let u = gaussian(20_000, 41);
    let response = lag(0.6, &u);
    // Powers of 1 / (1 - 0.36) and of 1.
    let found = only(&u, &sum(&response, &gaussian(20_000, 42)));
    let expected = 1.5625 / 2.5625;
    assert!((found.coherent - expected).abs() < 0.03, "{}", found.coherent);
    // Where there is nothing, the chance coherence of few segments is taken off.
    let share = |a: &[f64], b: &[f64]| super::super::coherence::coherent_share(a, b);
    let chance: f64 = (0..20)
        .map(|s| share(&gaussian(2000, 50 + s), &gaussian(2000, 80 + s)))
        .sum::<f64>()
        / 20.0;
    assert!(chance < 0.06, "{chance}");
}

#[test]
fn feedback_is_seen_both_ways() {
    let (v, w) = (gaussian(SAMPLES, 51), gaussian(SAMPLES, 52));
    let (mut u, mut y) = (vec![0.0; SAMPLES], vec![0.0; SAMPLES]);
    for n in 2..SAMPLES {
        y[n] = 0.5 * y[n - 1] + u[n - 1] + w[n];
        u[n] = -0.5 * y[n - 1] + v[n];
    }
    // The lags do not tell an order, so that of the columns is kept.
    for found in [only(&u, &y), only(&y, &u)] {
        assert_eq!((found.direction, found.cause, found.effect), (Direction::Both, 0, 1));
    }
}

#[test]
fn columns_that_change_together_have_no_direction() {
    let common = gaussian(SAMPLES, 61);
    let found = only(
        &sum(&common, &gaussian(SAMPLES, 62)),
        &sum(&common, &gaussian(SAMPLES, 63)),
    );
    assert_eq!((found.cause, found.effect, found.direction), (0, 1, Direction::AtOnce));
}

/// An even nonlinearity is not correlated with its input.
#[test]
fn an_even_nonlinearity_shows_in_the_square() {
    let u = gaussian(SAMPLES, 71);
    let squares: Vec<f64> = u.iter().map(|u| u * u).collect();
    let y = sum(&lag(0.5, &later(3, &squares)), &gaussian(SAMPLES, 72));
    let found = only(&u, &y);
    assert_eq!((found.kind, found.cause, found.delay), (Kind::Square, 0, 3));
    assert_eq!(found.coherent, 0.0);
}

/// All tests together are wrong in at most 1 % of the records, for any kind of columns. More than eight of 300 records have a probability
/// of 0.4 %.
#[test]
fn independent_columns_are_seldom_said_to_depend() {
    type Make = fn(u64) -> Vec<f64>;
    let kinds: [(&str, Make); 6] = [
        ("white", |seed| gaussian(1000, seed)),
        ("slow", |seed| lag(0.97, &gaussian(1000, seed))),
        ("random walk", |seed| lag(1.0, &gaussian(1000, seed))),
        ("oscillating", |seed| {
            let e = gaussian(1000, seed);
            let mut y = vec![0.0; e.len()];
            for n in 2..e.len() {
                y[n] = 1.8 * y[n - 1] - 0.95 * y[n - 2] + e[n];
            }
            y
        }),
        ("two levels", |seed| {
            gaussian(1000, seed).iter().map(|v| v.signum()).collect()
        }),
        ("bursts", |seed| {
            let bursts = |(n, v): (usize, &f64)| if n / 100 % 2 == 0 { 10.0 * v } else { 0.01 * v };
            gaussian(1000, seed).iter().enumerate().map(bursts).collect()
        }),
    ];
    let mut found = Vec::new();
    for (i, (one, a)) in kinds.iter().enumerate() {
        for (other, b) in &kinds[i..] {
            let false_alarms: usize = (0..300)
                .filter(|seed| !between(&a(2 * seed + 1), &b(2 * seed + 2)).is_empty())
                .count();
            found.push((*one, *other, false_alarms));
        }
    }
    println!("{found:?}");
    let most = found.iter().map(|f| f.2).max().unwrap();
    assert!(most <= 8, "{found:?}");
    let all: usize = found.iter().map(|f| f.2).sum();
    assert!(all <= 3 * found.len(), "{found:?}");
}

#[test]
fn derivatives_and_multiples() {
    let dt = 0.01;
    let acceleration = lag(0.9, &gaussian(3000, 81));
    let velocity = times(dt, &lag(1.0, &acceleration));
    let position = times(dt, &lag(1.0, &velocity));
    let noisy = sum(&position, &times(1e-6, &gaussian(3000, 82)));
    let copy: Vec<f64> = velocity.iter().map(|v| 57.3 * v + 1.0).collect();
    let other = gaussian(3000, 83);
    let columns = [("q", noisy), ("dq", velocity), ("deg", copy), ("w", other)];
    let record = crate::Record::new(columns.map(|(name, x)| (name, x))).unwrap();
    let found = crate::look::look(&record, None, Some(dt)).unwrap().relations;
    assert_eq!(found.len(), 2, "{found:?}");
    let derivative = found.iter().find(|k| (k.column, k.of) == (1, 0)).unwrap();
    assert!(matches!(derivative.relation, Relation::Derivative { factor } if (factor - 1.0).abs() < 0.01));
    let multiple = found.iter().find(|k| (k.column, k.of) == (2, 1)).unwrap();
    assert!(matches!(multiple.relation, Relation::Multiple { factor, .. } if (factor - 57.3).abs() < 1e-6));
}

/// An output of a strong input through a root, and a weak one: both held, each with a delay of its own.
fn fan_and_heater(seed: u64) -> [Vec<f64>; 3] {
    let held = |seed: u64, every: usize| -> Vec<f64> {
        let levels = gaussian(SAMPLES, seed);
        (0..SAMPLES).map(|k| levels[k / every].clamp(-2.0, 2.0)).collect()
    };
    let (fan, heater) = (held(seed, 7), held(seed + 1000, 22));
    let root: Vec<f64> = fan.iter().map(|u| 40.0 * (0.5 + u / 4.0).max(0.03).sqrt()).collect();
    let strong = times(0.2, &lag(0.8, &later(1, &root)));
    let weak = times(0.06, &lag(0.94, &later(3, &heater)));
    let y = sum(&sum(&strong, &weak), &times(0.2, &gaussian(SAMPLES, seed + 2000)));
    [fan, heater, y]
}

/// No pair of columns shows the weak input; what the strong one leaves does. Unrelated columns are seldom taken for inputs.
#[test]
fn a_weak_input_is_seen_beside_a_strong_one() {
    let mut wrong = 0;
    for seed in 0..40 {
        let [fan, heater, y] = fan_and_heater(seed);
        let slow = lag(0.99, &gaussian(SAMPLES, seed + 3000));
        let white = gaussian(SAMPLES, seed + 4000);
        let found = beside(&y, &[(&fan, 1)], &[&slow, &heater, &white]);
        assert!(
            found.iter().any(|b| b.column == 1 && b.coherent > 0.05),
            "{seed}: {found:?}"
        );
        wrong += found.iter().filter(|b| b.column != 1).count();
    }
    // Of 40 records at a level of 1 %; three or more have a probability of 0.8 %.
    assert!(wrong < 3, "{wrong}");
    let [fan, _, y] = fan_and_heater(1);
    assert!(beside(&y[..5], &[(&fan[..5], 1)], &[&fan[..5]]).is_empty());
    assert!(beside(&y, &[(&fan, 1)], &[]).is_empty());
}
