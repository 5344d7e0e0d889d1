//! A joint's free curve with its band, and where the data hardly determine it.

use flexure::Record;
use flexure::bands::Band;
use flexure::text::joined;
use flexure_report::data::Nonlinearity;
use serde_json::{Value, json};

use crate::plots::median;
use crate::text::number;

/// A curve is not determined where its band is this many times as wide as usual,
const WIDER: f64 = 5.0;
/// and half as wide as this share of the curve's usual size.
const OF_THE_CURVE: f64 = 0.25;

/// Wide points with fewer than this many narrow ones between them are one range.
const NEAR: usize = 6;
/// Narrower ranges, as shares of the abscissas, are not reported: there a curve jumps, or next to it.
const SHARE: f64 = 0.02;

/// The ranges in which the data hardly determine the curve: its band is much wider there than elsewhere, and wide for the curve itself.
///
/// An axis that only passes through small velocities, or rests there, tells little of its friction at these. A band that is wide
/// everywhere has no such range.
pub fn undetermined(band: &Band) -> Vec<[f64; 2]> {
    let x = &band.x[0];
    let half: Vec<f64> = (0..x.len()).map(|i| 0.5 * (band.upper[i] - band.lower[i])).collect();
    let usual = median(half.iter().copied());
    let size = median(band.estimate.iter().map(|y| y.abs()));
    let limit = (WIDER * usual).max(OF_THE_CURVE * size);
    let mut ranges: Vec<[usize; 2]> = Vec::new();
    for i in (0..x.len()).filter(|&i| half[i] > limit) {
        match ranges.last_mut() {
            Some([_, last]) if i - *last <= NEAR => *last = i,
            _ => ranges.push([i, i]),
        }
    }
    let least = SHARE * (x[x.len() - 1] - x[0]);
    let ranges = ranges.into_iter().map(|range| range.map(|i| x[i]));
    ranges.filter(|[from, to]| to - from >= least).collect()
}

/// The range over which a curve was seen, and those within it that the data hardly determine.
pub fn range_text(band: &Band, unit: &str) -> String {
    let x = &band.x[0];
    let range = |[from, to]: [f64; 2]| format!("from {} to {}", number(from), number(to));
    let seen = range([x[0], x[x.len() - 1]]);
    let gaps: Vec<String> = undetermined(band).into_iter().map(range).collect();
    match gaps.is_empty() {
        true => format!("determined {seen} {unit}; outside this range the log gives no information"),
        false => format!(
            "determined {seen} {unit}; outside this range the log gives no information, and too little to draw the curve {} {unit}",
            joined(&gaps)
        ),
    }
}

/// A curve as it is drawn: with gaps where the data hardly determine it.
pub fn with_gaps(mut curve: Nonlinearity, band: &Band) -> Nonlinearity {
    for [from, to] in undetermined(band) {
        for i in 0..curve.x.len() {
            if (from..=to).contains(&curve.x[i]) {
                (curve.y[i], curve.lower[i], curve.upper[i]) = (f64::NAN, f64::NAN, f64::NAN);
            }
        }
    }
    curve
}

/// What a curve's caption says of the gaps.
pub fn gaps_caption(band: &Band) -> &'static str {
    match undetermined(band).is_empty() {
        true => "",
        false => " It has a gap where the data do not determine it.",
    }
}

/// A curve with its band as the columns of a file.
pub fn curve_record(band: &Band, [x, y]: [&str; 2]) -> flexure::Result<Record> {
    Record::new([
        (x, band.x[0].clone()),
        (y, band.estimate.clone()),
        ("lower", band.lower.clone()),
        ("upper", band.upper.clone()),
    ])
}

/// A curve with its band as JSON.
pub fn curve_json(band: &Band) -> Value {
    json!({
        "x": band.x[0],
        "y": band.estimate,
        "lower": band.lower,
        "upper": band.upper,
        "standard_error": band.standard_error,
        "level": band.level,
        "undetermined": undetermined(band),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexure::bands::BandKind;

    /// A curve sign(x) (1 + x^2) on [-1, 1] whose band has this half width.
    fn band(half: impl Fn(f64) -> f64) -> Band {
        let x: Vec<f64> = (-100..=100).map(|i| f64::from(i) / 100.0).collect();
        let estimate: Vec<f64> = x.iter().map(|x| x.signum() * (1.0 + x * x)).collect();
        let edge = |sign: f64| (0..x.len()).map(|i| estimate[i] + sign * half(x[i])).collect();
        Band {
            lower: edge(-1.0),
            upper: edge(1.0),
            centre: estimate.clone(),
            standard_error: x.iter().map(|x| half(*x) / 1.96).collect(),
            estimate,
            level: 0.95,
            kind: BandKind::Pointwise,
            method: String::new(),
            x: vec![x],
        }
    }

    #[test]
    fn ranges_with_a_band_much_wider_than_elsewhere_are_gaps() {
        let wide = band(|x| if x.abs() <= 0.05 && x.abs() >= 0.01 { 2.0 } else { 0.02 });
        assert_eq!(undetermined(&wide), [[-0.05, 0.05]]);
        assert_eq!(
            range_text(&wide, "rad/s"),
            "determined from -1.000 to 1.000 rad/s; outside this range the log gives no information, and too little to draw the \
             curve from -0.05000 to 0.05000 rad/s"
        );
        let two = band(|x| if (0.2..=0.3).contains(&x.abs()) { 2.0 } else { 0.02 });
        assert_eq!(undetermined(&two), [[-0.3, -0.2], [0.2, 0.3]]);
    }

    #[test]
    fn a_band_that_is_wide_everywhere_or_only_at_a_jump_or_narrow_for_the_curve_has_no_gaps() {
        assert!(undetermined(&band(|x| if x.abs() < 0.015 { 2.0 } else { 0.02 })).is_empty());
        assert!(undetermined(&band(|_| 3.0)).is_empty());
        assert!(undetermined(&band(|x| if x.abs() < 0.1 { 0.2 } else { 0.02 })).is_empty());
    }
}
