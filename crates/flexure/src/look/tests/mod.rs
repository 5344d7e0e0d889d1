//! A look at signals whose truth is known.

mod columns;
mod dependences;
mod integrations;

use super::{Look, look};
use crate::record::Record;
use crate::signal::gaussian;

/// y_n = a y_(n-1) + x_n.
fn lag(a: f64, x: &[f64]) -> Vec<f64> {
    let mut y = 0.0;
    let step = |x: &f64| {
        y = a * y + x;
        y
    };
    x.iter().map(step).collect()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn times(factor: f64, x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| factor * x).collect()
}

/// The signal, later by this number of samples, with zeros before it.
fn later(samples: usize, x: &[f64]) -> Vec<f64> {
    std::iter::repeat_n(0.0, samples)
        .chain(x.iter().copied())
        .take(x.len())
        .collect()
}

fn look_at(columns: &[(&str, &[f64])]) -> Look {
    let record = Record::new(columns.iter().map(|(name, x)| (*name, x.to_vec()))).unwrap();
    look(&record, None, None).unwrap()
}

/// The findings about two columns do not depend on their units, except for values with a unit.
#[test]
fn units_and_offsets_change_nothing() {
    let u = gaussian(3000, 1);
    let y = sum(&lag(0.7, &later(2, &u)), &times(0.5, &gaussian(3000, 2)));
    let [plain, scaled] = [(1.0, 0.0), (-2.5e4, 7e5)].map(|(factor, offset)| {
        let moved: Vec<f64> = y.iter().map(|y| factor * y + offset).collect();
        look_at(&[("u", &u), ("y", &moved)])
    });
    let (one, other) = (&plain.dependences[0], &scaled.dependences[0]);
    assert_eq!((one.cause, one.effect, one.delay), (0, 1, 2));
    assert_eq!((other.cause, other.effect, other.delay), (0, 1, 2));
    assert!((one.coherent - other.coherent).abs() < 1e-6);
    assert!((one.correlation + other.correlation).abs() < 1e-6);
    let [a, b] = [&plain, &scaled].map(|l| l.columns[1].spectrum.as_ref().unwrap().below(0.9));
    assert_eq!(a, b);
    assert_eq!(plain.columns[1].outliers, scaled.columns[1].outliers);
}
