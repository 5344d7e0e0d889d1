//! Columns by themselves.

use super::super::clock::Clock;
use super::super::quantisation::Quantisation;
use super::super::spectrum::Spectrum;
use super::{lag, look_at};
use crate::look::Column;
use crate::signal::gaussian;
use crate::sort::sorted;

fn column(samples: &[f64]) -> Column {
    look_at(&[("x", samples)]).columns.remove(0)
}

fn rounded(x: &[f64], step: f64, offset: f64) -> Vec<f64> {
    x.iter().map(|x| offset + step * (x / step).round()).collect()
}

#[test]
fn what_is_missing_is_counted_and_left_out() {
    let mut x = gaussian(1000, 1);
    let clean = column(&x[10..]);
    x[..4].fill(f64::NAN);
    x[4..10].fill(f64::NEG_INFINITY);
    let c = column(&x);
    assert_eq!((c.samples, c.missing, c.infinite), (990, 4, 6));
    assert!((c.mean - clean.mean).abs() < 1e-12 && (c.deviation - clean.deviation).abs() < 1e-12);
    assert_eq!((c.least, c.greatest), (clean.least, clean.greatest));
    let empty = column(&[f64::NAN; 100]);
    assert!(empty.samples == 0 && empty.mean.is_nan() && !empty.is_signal());
}

#[test]
fn columns_that_are_no_signals() {
    let even: Vec<f64> = (0..500).map(|i| 3.0 + 0.1 * f64::from(i)).collect();
    assert!(column(&even).counts && !column(&even).is_signal());
    let constant = column(&[0.1 + 0.2; 300]);
    assert!(constant.constant && !constant.is_signal() && constant.spectrum.is_none());
    let ramp: Vec<f64> = (0..500).map(|i| f64::from(i % 100)).collect();
    assert!(!column(&ramp).counts);
}

#[test]
fn levels_are_listed_where_they_are_few() {
    let steps: Vec<f64> = gaussian(400, 2)
        .iter()
        .map(|v| if *v > 0.3 { 6.41 } else { 3.41 })
        .collect();
    let c = column(&steps);
    assert_eq!(c.levels.as_deref(), Some(&[3.41, 6.41][..]));
    assert!(c.lower_stop.is_none() && c.quantisation.is_none() && c.outliers.is_empty());
    assert_eq!(column(&gaussian(400, 2)).levels, None);
}

#[test]
fn the_step_of_rounding_is_found() {
    for (seed, step, offset) in [
        (1, 0.01, 0.0),
        (2, 0.037, 0.123),
        (3, 10.0 / 65536.0, -5.0),
        (4, 0.3, 1e3),
    ] {
        let q = column(&rounded(&gaussian(4000, seed), step, offset)).quantisation;
        let q = q.unwrap_or_else(|| panic!("no step of {step} was found"));
        assert!((q.step / step - 1.0).abs() < 1e-6, "{} for {step}", q.step);
        assert_eq!(q.share, 1.0);
    }
    // Single precision, as many loggers store it.
    let single: Vec<f64> = rounded(&gaussian(4000, 5), 0.001, 0.0)
        .iter()
        .map(|x| f64::from(*x as f32))
        .collect();
    let q = column(&single).quantisation.unwrap();
    assert!((q.step / 0.001 - 1.0).abs() < 1e-5, "{q:?}");
}

#[test]
fn samples_beside_the_grid_are_counted() {
    let mut x = rounded(&gaussian(5000, 6), 0.05, 0.0);
    for i in 0..50 {
        x[100 * i] += 0.02;
    }
    let q = column(&x).quantisation.unwrap();
    assert!((q.step - 0.05).abs() < 1e-6 && (q.share - 0.99).abs() < 1e-9, "{q:?}");
}

/// A grid is never seen where there is none: by chance a fifth of the samples lie near one.
#[test]
fn no_grid_where_there_is_none() {
    for seed in 0..200 {
        for n in [60, 1000] {
            assert_eq!(
                Quantisation::of_sorted(&sorted(&gaussian(n, seed))),
                None,
                "seed {seed}"
            );
        }
    }
}

#[test]
fn a_standstill_at_an_extreme_is_seen_on_its_side() {
    let smooth = lag(0.9, &gaussian(5000, 7));
    let clipped: Vec<f64> = smooth.iter().map(|v| v.min(3.0)).collect();
    let expected = smooth.iter().filter(|v| **v >= 3.0).count();
    let c = column(&clipped);
    let stop = c.upper_stop.unwrap();
    assert_eq!((stop.value, stop.samples), (3.0, expected));
    assert_eq!(c.lower_stop, None);
    assert_eq!(column(&smooth).upper_stop, None);
    // A sine is nearly at rest at its ends, but not at one value only. The steps of the converter do not change this.
    for steps in [100.0, 1000.0, 12345.0] {
        let sine: Vec<f64> = (0..5000)
            .map(|i| (steps * (f64::from(i) * 0.01).sin()).round())
            .collect();
        assert_eq!(column(&sine).upper_stop, None, "{steps} steps");
    }
    let saturated: Vec<f64> = (0..5000)
        .map(|i| (f64::from(i) * 0.01).sin().clamp(-0.9, 1.0))
        .collect();
    assert!(column(&saturated).lower_stop.is_some() && column(&saturated).upper_stop.is_none());
}

/// A fast signal leaves its extreme at once and returns. Values of a grid, of a few levels and of a repeated period return too, but not more
/// often than others do.
#[test]
fn a_fast_signal_that_is_clipped_is_seen() {
    let white = gaussian(3000, 23);
    let clipped: Vec<f64> = white.iter().map(|v| v.clamp(-2.0, 1.25)).collect();
    let (c, at) = (column(&clipped), |limit: f64| {
        clipped.iter().filter(|v| **v == limit).count()
    });
    assert_eq!(c.upper_stop.map(|s| s.samples), Some(at(1.25)));
    assert_eq!(c.lower_stop.map(|s| s.samples), Some(at(-2.0)));
    // The same by a converter, and where each value is held.
    let of_converter = column(&rounded(&clipped, 0.05, 0.0));
    assert!(of_converter.upper_stop.is_some() && of_converter.lower_stop.is_some());
    let held: Vec<f64> = clipped.iter().flat_map(|v| [*v; 3]).collect();
    assert!(column(&held).upper_stop.is_some() && column(&held).lower_stop.is_some());
    let none = |x: &[f64], what: &str| {
        let c = column(x);
        assert!(
            c.lower_stop.is_none() && c.upper_stop.is_none(),
            "{what}: {:?} {:?}",
            c.lower_stop,
            c.upper_stop
        );
    };
    none(&white, "white");
    for step in [0.05, 0.3, 0.7, 1.5] {
        none(&rounded(&white, step, 0.0), &format!("rounded to {step}"));
    }
    let uniform = |k: usize, levels: usize| ((k * 7919 + k * k * 31) % 10_007 % levels) as f64;
    for levels in [2, 3, 5, 12, 25, 100] {
        let x: Vec<f64> = (0..3000).map(|k| uniform(k, levels)).collect();
        none(&x, &format!("{levels} levels"));
    }
    // Mostly the outer two of four levels.
    let switched: Vec<f64> = (0..3000)
        .map(|k| [0.0, 3.0, 0.0, 3.0, 0.0, 3.0, 0.0, 3.0, 1.0, 2.0][k * 7 % 10])
        .collect();
    none(&switched, "switched");
    let periodic: Vec<f64> = (0..3000).map(|k| white[k % 150]).collect();
    none(&periodic, "periodic");
    for period in [37.0, 100.0, 613.7] {
        let sine: Vec<f64> = (0..3000)
            .map(|k| (std::f64::consts::TAU * f64::from(k) / period).sin())
            .collect();
        none(&sine, &format!("a sine of {period} samples"));
        none(
            &rounded(&sine, 0.02, 0.0),
            &format!("a rounded sine of {period} samples"),
        );
    }
}

#[test]
fn planted_outliers_are_found_and_no_others() {
    let smooth = lag(0.95, &gaussian(8000, 8));
    let spread = column(&smooth).deviation;
    let mut x = smooth.clone();
    let planted = [17, 900, 901, 4000, 7998];
    for &i in &planted {
        x[i] += 6.0 * spread;
    }
    assert_eq!(column(&x).outliers, planted);
    assert!(column(&smooth).outliers.is_empty());
}

/// What `OUTLIER` says: none in a million samples of normal white noise. And none where a signal jumps, bursts or rests.
#[test]
fn no_outliers_where_there_are_none() {
    assert!(column(&gaussian(1_000_000, 9)).outliers.is_empty());
    let quiet = gaussian(6000, 10);
    let steps: Vec<f64> = (0..6000)
        .map(|i| f64::from(i / 50 * 7919 % 13) + 0.01 * quiet[i as usize])
        .collect();
    assert!(column(&steps).outliers.is_empty());
    let bursts: Vec<f64> = (0..6000)
        .map(|i| if i / 500 % 2 == 0 { quiet[i] } else { 0.0 })
        .collect();
    assert!(column(&bursts).outliers.is_empty());
    let sine: Vec<f64> = (0..6000).map(|i| (f64::from(i) * 0.3).sin()).collect();
    assert!(column(&sine).outliers.is_empty());
}

/// A response to steps turns at each of them. Between the turns it follows its running median.
#[test]
fn turns_of_a_smooth_signal_are_no_outliers() {
    let (levels, noise) = (gaussian(500, 21), gaussian(4000, 22));
    let mut reached = 0.0;
    let response = (0..4000).map(|i| {
        reached += 0.1 * (levels[i / 8] - reached);
        reached + 1e-3 * noise[i]
    });
    let mut x: Vec<f64> = response.collect();
    assert!(column(&x).outliers.is_empty(), "{:?}", column(&x).outliers);
    x[1234] += 2.0;
    x[2345] -= 2.0;
    assert_eq!(column(&x).outliers, [1234, 2345]);
}

/// A command that is held for 1 to 40 samples: a value that is held for one sample is no outlier, one far beyond all others is.
#[test]
fn values_that_are_held_count_once() {
    let values = gaussian(600, 12);
    let held: Vec<f64> = (0..600).flat_map(|k| vec![values[k]; 1 + k * 31 % 40]).collect();
    assert!(column(&held).outliers.is_empty());
    let mut spoiled = held.clone();
    spoiled[5000] += 30.0 * column(&held).deviation;
    assert_eq!(column(&spoiled).outliers, [5000]);
}

#[test]
fn a_clock_with_jitter_gaps_and_steps_back() {
    let even: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
    let clock = Clock::new(&even).unwrap();
    assert!((clock.step - 0.01).abs() < 1e-12 && clock.jitter < 1e-9 && clock.gaps.is_empty());
    assert!(clock.is_uniform);
    // Instants that are late by a tenth of a step in turn: steps differ by a fifth, and an identification takes them.
    let late: Vec<f64> = even
        .iter()
        .enumerate()
        .map(|(i, t)| t + 0.00099 * (i % 2) as f64)
        .collect();
    let clock = Clock::new(&late).unwrap();
    assert!(clock.jitter > 0.09 && clock.is_uniform, "{clock:?}");
    // A clock that drifts has no jitter and is not even.
    let drifts: Vec<f64> = even.iter().map(|t| t + 0.01 * t * t).collect();
    let clock = Clock::new(&drifts).unwrap();
    assert!(clock.jitter < 0.02 && !clock.is_uniform, "{clock:?}");
    let mut t = even.clone();
    t[30] += 0.002;
    t[60..].iter_mut().for_each(|t| *t += 0.05);
    t[80] = t[79];
    let clock = Clock::new(&t).unwrap();
    assert!((clock.jitter - 0.2).abs() < 1e-9, "{}", clock.jitter);
    assert_eq!(clock.gaps.iter().map(|g| g.sample).collect::<Vec<_>>(), [60, 81]);
    assert!((clock.gaps[0].steps - 6.0).abs() < 1e-9 && clock.lost().round() == 6.0);
    assert_eq!(clock.backwards, [80]);
    assert!(!clock.is_uniform);
    assert_eq!(Clock::new(&[1.0]), None);
    assert_eq!(Clock::new(&[1.0, 1.0]), None);
}

#[test]
fn a_spectrum_has_the_power_where_it_is() {
    let n = 40_000;
    let white = gaussian(n, 11);
    let spectrum = Spectrum::new(&white).unwrap();
    let width = 1.0 / spectrum.segment as f64;
    let power: f64 = spectrum.density.iter().map(|d| d * width).sum();
    assert!((power - 1.0).abs() < 0.03, "{power}");
    // One-sided: twice the variance for each cycle a sample.
    assert!((spectrum.density[..500].iter().sum::<f64>() / 500.0 - 2.0).abs() < 0.1);
    assert!((spectrum.below(0.5) - 0.25).abs() < 0.01);
    let tone: Vec<f64> = (0..n)
        .map(|i| 3.0 * (std::f64::consts::TAU * 0.0625 * i as f64).sin() + 7.0)
        .collect();
    let spectrum = Spectrum::new(&tone).unwrap();
    let peak = (0..spectrum.density.len())
        .max_by(|&a, &b| spectrum.density[a].total_cmp(&spectrum.density[b]))
        .unwrap();
    assert_eq!(spectrum.frequency[peak], 0.0625);
    assert!((spectrum.density.iter().sum::<f64>() / spectrum.segment as f64 - 4.5).abs() < 0.01);
    assert!((spectrum.below(0.95) - 0.0625).abs() < 2.0 / spectrum.segment as f64);
    assert_eq!(Spectrum::new(&white[..15]), None);
}
