//! Where a curve is flat: the limits of a saturation, a dead zone.

use crate::sort::median;
use crate::text::{joined, number};

/// A flat stretch keeps its values within this share of the curve's range. Convention.
const FLAT: f64 = 0.005;
/// A flat stretch is at least this share of the data's range wide: a cubic, which is flat at zero too, has 17 %. Convention.
const WIDE: f64 = 0.2;

/// A stretch of a curve over which it hardly changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FlatStretch {
    from: f64,
    to: f64,
    /// The median of its values.
    value: f64,
}

/// The wide flat stretches of a curve between two abscissas, as a continuation of its description; empty if there are none.
pub fn flats(x: &[f64], y: &[f64], [low, high]: [f64; 2]) -> String {
    // The ends of a model file may be in any order.
    let (start, end) = (x.partition_point(|v| *v < low), x.partition_point(|v| *v <= high));
    let (x, y) = (&x[start.min(end)..end], &y[start.min(end)..end]);
    let [least, most] = range(y);
    let mut found = Vec::new();
    if most <= least {
        return String::new();
    }
    widest(x, y, FLAT * (most - least), WIDE * (high - low), &mut found);
    let stretch = |flat: &FlatStretch| {
        let [value, from, to] = [flat.value, flat.from, flat.to].map(number);
        format!("at {value} from {from} to {to}")
    };
    match found.is_empty() {
        true => String::new(),
        false => format!(
            ", flat {} within {} % of the height of the curve",
            joined(&found.iter().map(stretch).collect::<Vec<_>>()),
            100.0 * FLAT
        ),
    }
}

/// Adds the widest stretch that varies by at most `most`, if it is at least this wide, and then those on either side of it, from left to
/// right.
fn widest(x: &[f64], y: &[f64], most: f64, wide: f64, found: &mut Vec<FlatStretch>) {
    let mut best = [0, 0];
    for first in 0..x.len() {
        let [mut low, mut high] = [y[first]; 2];
        let inside = y[first..].iter().take_while(|v| {
            (low, high) = (low.min(**v), high.max(**v));
            high - low <= most
        });
        let last = first + inside.count() - 1;
        if x[last] - x[first] > x[best[1]] - x[best[0]] {
            best = [first, last];
        }
    }
    let [first, last] = best;
    if last == first || x[last] - x[first] < wide {
        return;
    }
    widest(&x[..first], &y[..first], most, wide, found);
    found.push(FlatStretch {
        from: x[first],
        to: x[last],
        value: median(y[first..=last].to_vec()),
    });
    widest(&x[last + 1..], &y[last + 1..], most, wide, found);
}

fn range(y: &[f64]) -> [f64; 2] {
    y.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(*v), high.max(*v)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On [-2, 3], with points beyond.
    fn described(f: impl Fn(f64) -> f64) -> String {
        let x: Vec<f64> = (0..=700).map(|i| -3.0 + 0.01 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|x| f(*x)).collect();
        flats(&x, &y, [-2.0, 3.0])
    }

    #[test]
    fn limits_and_dead_zones_are_flat_and_polynomials_are_not() {
        for f in [|x: f64| x, |x: f64| x * x, |x: f64| x * x * x] {
            assert_eq!(described(f), "");
        }
        let limits = described(|x| x.clamp(-0.5, 1.0));
        assert_eq!(
            limits,
            ", flat at -0.5000 from -2.000 to -0.5000 and at 1.000 from 1.000 to 3.000 within 0.5 % of the height of the curve"
        );
    }

    #[test]
    fn a_curve_without_points_or_changes_has_no_stretch_to_look_for() {
        assert_eq!(flats(&[], &[], [0.0, 1.0]), "");
        assert_eq!(flats(&[5.0], &[1.0], [0.0, 1.0]), "");
        assert_eq!(flats(&[0.0, 1.0, 2.0], &[1.0, 1.0, 1.0], [2.0, 0.0]), "");
        assert_eq!(described(|_| 1.0), "");
    }
}
