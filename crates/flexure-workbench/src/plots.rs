//! Parts that the pages share: places along an axis, phases, curves with bands.

use flexure::bands::Band;
use flexure_io::RecordFile;
use flexure_report::data::{Axis, Nonlinearity};

/// A clock that begins later than this, in s, counts from a date: a plot's labels would be long and useless.
const LATEST_START: f64 = 86_400.0;

/// The instants of a record's samples from the one of index `first` on, as the record's own clock has them; their indices where there is no
/// sample time.
pub fn time_axis(file: &RecordFile, sample_time: Option<f64>, first: usize) -> Axis {
    let mut axis = Axis::of_samples(sample_time, first);
    if let (Some(_), Ok(Some((name, unit)))) = (sample_time, file.instants(None, &[]))
        && let Some(start) = file.record.column(name).ok().and_then(|instants| instants.first())
        && (start * unit).abs() < LATEST_START
    {
        axis.start += start * unit;
    }
    axis
}

/// The least and the greatest value; without values, infinities in the wrong order.
pub fn extent(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    (values.into_iter()).fold(none, |[low, high], v| [low.min(v), high.max(v)])
}

/// `places` evenly spaced places; the last one is exactly `high`.
pub fn evenly([low, high]: [f64; 2], places: usize) -> Vec<f64> {
    let last = places - 1;
    let place = |i: usize| match i == last {
        true => high,
        false => low + (high - low) * i as f64 / last as f64,
    };
    (0..places).map(place).collect()
}

/// The value in the middle; of an even number of values, the upper one.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Phases in degrees without jumps by whole turns.
pub fn unwrapped(phases: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut unwrapped: Vec<f64> = Vec::new();
    let mut turns = 0.0;
    for phase in phases {
        if let Some(last) = unwrapped.last() {
            turns = ((last - phase) / 360.0_f64).round();
        }
        unwrapped.push(phase + 360.0 * turns);
    }
    unwrapped
}

/// A curve of one variable with its band.
pub fn banded(band: &Band, [x_label, y_label]: [&str; 2], band_label: String) -> Nonlinearity {
    Nonlinearity {
        x_label: x_label.to_owned(),
        y_label: y_label.to_owned(),
        x: band.x[0].clone(),
        y: band.estimate.clone(),
        lower: band.lower.clone(),
        upper: band.upper.clone(),
        band_label,
        ..Nonlinearity::default()
    }
}
