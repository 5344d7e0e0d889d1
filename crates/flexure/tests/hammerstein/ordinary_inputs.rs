//! The refined identification under inputs that are coloured or held, as logs have them: how near the free run comes to the noise.

use super::refined::{breakpoints, refined};
use super::*;

const SAMPLES: usize = 2000;

fn dead_zone(u: f64) -> f64 {
    u.signum() * (u.abs() - 1.2).max(0.0)
}

/// A signal that has each of these values for some samples; the counts are drawn from `counts`.
fn held(values: &[f64], counts: std::ops::Range<usize>, seed: u64) -> Vec<f64> {
    let draws = uniform(seed, values.len(), 1.0);
    let count = |draw: &f64| counts.start + ((0.5 * draw + 0.5) * counts.len() as f64) as usize;
    let parts = values.iter().zip(&draws);
    let all = parts.flat_map(|(value, draw)| std::iter::repeat_n(*value, count(draw)));
    all.take(SAMPLES).collect()
}

/// A Hammerstein system's record, and the deviation of its noise on the fresh quarter. `noise` is of unit deviation, `share` of the output's.
fn system(
    u: Vec<f64>,
    phi: impl Fn(f64) -> f64,
    linear: &TransferFunction,
    noise: &[f64],
    share: f64,
) -> (Record, f64) {
    let clean = linear.simulate(&u.iter().map(|u| phi(*u)).collect::<Vec<_>>());
    let mean = clean.iter().sum::<f64>() / clean.len() as f64;
    let spread = (clean.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / clean.len() as f64).sqrt();
    let y: Vec<f64> = clean.iter().zip(noise).map(|(y, e)| y + share * spread * e).collect();
    let fresh = &noise[3 * y.len() / 4..];
    let square = fresh.iter().map(|e| e * e).sum::<f64>() / fresh.len() as f64;
    (record(u, y), share * spread * square.sqrt())
}

fn coloured_noise(seed: u64) -> Vec<f64> {
    filter(&[(1.0_f64 - 0.81).sqrt()], &[1.0, -0.9]).simulate(&normal(seed, SAMPLES, 1.0))
}

/// An autoregression, as a loop or a filter before the drive makes it, and a resonance: the noise of the memory-removed output is correlated
/// over dozens of samples, and in it one kink of two was missed.
#[test]
fn a_coloured_input_shows_both_kinks() {
    let resonance = filter(&[0.0, 0.025, 0.025], &[1.0, -1.88, 0.93]);
    for seed in 1..6 {
        let u = filter(&[(1.0_f64 - 0.9025).sqrt()], &[1.0, -0.95]).simulate(&normal(seed, 1000, 2.0));
        let (record, noise) = system(u, dead_zone, &resonance, &normal(seed + 100, 1000, 1.0), 0.03);
        let result = refined(&record);
        let found = breakpoints(&result);
        let near = |at: f64| found.iter().any(|b| (b.at - at).abs() < 0.1);
        assert!(near(-1.2) && near(1.2), "{seed}: {found:?}");
        let rms = result.verdict.measures.rms;
        assert!(rms < 1.3 * noise, "{seed}: {rms} {noise}");
    }
}

/// Two poles under a command that is held for 20 samples: the response rises slowly, and its first samples are too small to be seen in the
/// estimated impulse response.
#[test]
fn a_response_that_rises_slowly_is_no_delay() {
    let poles = filter(&[0.0, 0.0061, 0.0056], &[1.0, -1.7542, 0.7659]);
    for seed in 1..6 {
        let levels: Vec<f64> = uniform(seed, 110, 5.5).iter().map(|u| u.round()).collect();
        let u = held(&levels, 20..21, 1);
        let (record, noise) = system(u, |u| u.max(0.0), &poles, &normal(seed + 100, SAMPLES, 1.0), 0.01);
        let result = refined(&record);
        assert!(
            result.delay <= 2 && result.order == 2,
            "{seed}: {} {}",
            result.delay,
            result.order
        );
        let rms = result.verdict.measures.rms;
        assert!(rms < 1.15 * noise, "{seed}: {rms} {noise}");
    }
}

/// A dead zone under a command that is held for 5 to 80 samples. What a wrong curve leaves under it looks like coloured noise. Whitened, a curve of
/// one jump seemed to be as good as the dead zone.
#[test]
fn a_wrong_curve_is_not_taken_for_coloured_noise() {
    let lag = filter(&[0.0, 0.0329], &[1.0, -0.9671]);
    let mut ratios: Vec<f64> = (1..8)
        .map(|seed| {
            let u = held(&uniform(seed, 300, 5.0), 5..80, seed + 50);
            let (record, noise) = system(u, dead_zone, &lag, &coloured_noise(seed + 100), 0.01);
            refined(&record).verdict.measures.rms / noise
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[3] < 1.5 && ratios[6] < 6.0, "{ratios:?}");
}
