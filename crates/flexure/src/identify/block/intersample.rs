//! The intermediate signal between the samples, and how the back uses it.

use super::limits::INTERPOLATION_REACH;
use std::f64::consts::PI;

use super::candidate::Candidate;
use super::signals::{Signals, convolved, delayed};
use super::system::{Between, System};
use crate::linear::least_squares::least_squares;

/// The first branch with a second instant half-way between the samples.
///
/// The front's numerator for that instant fits the interpolated intermediate signal best. The back's numerators for both instants fit the
/// output best.
///
/// `None` if the record is too short to interpolate, or if the least squares have no solution.
pub(super) fn with_instant_between(system: &System, data: &Signals) -> Option<Candidate> {
    let s = system.branches.first()?;
    let n = data.y.len().checked_sub(INTERPOLATION_REACH)?;
    if n <= data.from {
        return None;
    }
    let all_pole = s.front.all_pole(&s.delayed(&data.u));
    let target = half_a_sample_later(&convolved(&s.front.b, &all_pole));
    // An instant half a sample later needs one more coefficient.
    let columns: Vec<Vec<f64>> = (0..s.front.b.len().max(s.front.order() + 1))
        .map(|i| delayed(&all_pole[..n], i, 1.0))
        .collect();
    let front = least_squares(&target[..n], &columns, data.from)?.coefficients;
    let mut columns = Vec::new();
    let lengths = [s.back.b.len(), s.back.b.len().max(s.back.order() + 1)];
    for (b, length) in [&s.front.b, &front].into_iter().zip(lengths) {
        let w = convolved(b, &all_pole);
        let z: Vec<f64> = w.iter().map(|w| s.spline.value(*w)).collect();
        let back = s.back.all_pole(&z);
        columns.extend((0..length).map(|i| delayed(&back, i, 1.0)));
    }
    let without_offset: Vec<f64> = data.y.iter().map(|y| y - s.offset).collect();
    let mut numerator = least_squares(&without_offset, &columns, data.from)?.coefficients;
    let back = numerator.split_off(lengths[0]);
    let mut next = system.clone();
    next.branches[0].back.b = numerator;
    next.branches[0].between = Some(Between { front, back });
    let candidate = Candidate::new(next, data);
    candidate.squares.is_finite().then_some(candidate)
}

/// A signal half a sample later, by the Hann-windowed cardinal series; zero beyond its ends.
fn half_a_sample_later(signal: &[f64]) -> Vec<f64> {
    let tap = |k: usize| {
        let distance = k as f64 - INTERPOLATION_REACH as f64 + 0.5;
        let window = (0.5 * PI * distance / INTERPOLATION_REACH as f64).cos().powi(2);
        window * (PI * distance).sin() / (PI * distance)
    };
    let taps: Vec<f64> = (0..2 * INTERPOLATION_REACH).map(tap).collect();
    let near = |t: usize| (t + 1).saturating_sub(INTERPOLATION_REACH)..(t + 1 + INTERPOLATION_REACH).min(signal.len());
    let late = |t: usize| near(t).map(|i| taps[i + INTERPOLATION_REACH - 1 - t] * signal[i]).sum();
    (0..signal.len()).map(late).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_signal_is_interpolated() {
        let wave = |t: f64| (0.9 * t + 0.3).sin() + 0.5 * (1.9 * t).cos();
        let signal: Vec<f64> = (0..300).map(|t| wave(f64::from(t))).collect();
        let late = half_a_sample_later(&signal);
        for t in INTERPOLATION_REACH..300 - INTERPOLATION_REACH {
            let want = wave(t as f64 + 0.5);
            assert!((late[t] - want).abs() < 1e-4, "{t}: {} {want}", late[t]);
        }
        // At the ends, the series leaves out missing samples.
        let tap = |distance: f64| {
            let window = (0.5 * PI * distance / INTERPOLATION_REACH as f64).cos().powi(2);
            window * (PI * distance).sin() / (PI * distance)
        };
        for t in [0_usize, 5, 31, 32, 63, 64, 299] {
            let near = |i: &usize| (*i as f64 - t as f64 - 0.5).abs() < INTERPOLATION_REACH as f64;
            let want: f64 = (0..300)
                .filter(near)
                .map(|i| tap(i as f64 - t as f64 - 0.5) * signal[i])
                .sum();
            assert!((late[t] - want).abs() < 1e-12, "{t}: {} {want}", late[t]);
        }
        assert_eq!(half_a_sample_later(&[1.0, 2.0]).len(), 2);
    }
}
