//! Changing units and offsets does what the mathematics says, and the number of threads does nothing.

use flexure::identify::Warning;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

use super::*;

/// The record with u -> c u + d and y -> e y + f.
fn changed(source: &Record, [c, d]: [f64; 2], [e, f]: [f64; 2]) -> Record {
    let map = |name: &str, a: f64, b: f64| source.column(name).unwrap().iter().map(|v| a * v + b).collect();
    record(map("u", c, d), map("y", e, f))
}

fn source() -> Record {
    let [linear, _] = known_linear_parts();
    KnownHammerstein::usual(KnownNonlinearity::SoftWindup, linear).simulate(3000, 12)
}

/// Everything that an identification says, against that of the changed record.
fn compare(one: &Identification, other: &Identification, [c, d]: [f64; 2], [e, f]: [f64; 2]) {
    // A mirrored input is tabulated at other quantiles.
    let tolerance = if c < 0.0 { 1e-4 } else { 1e-5 };
    let close = |a: f64, b: f64, scale: f64, what: &str| {
        assert!(
            (a - b).abs() <= tolerance * scale.abs(),
            "{what}: {a} {b} at u {c} {d} y {e} {f}"
        );
    };
    assert_eq!(
        (one.delay, lag_of_regression(one)),
        (other.delay, lag_of_regression(other))
    );
    assert_eq!(one.order, other.order);
    assert_eq!(one.detail("correlated_with"), other.detail("correlated_with"));
    close(
        number(one, "value") * c.abs(),
        number(other, "value"),
        number(other, "value"),
        "bandwidth",
    );
    // Unit static gain: the linear part has no unit.
    assert_close(linear_part(one).a(), linear_part(other).a(), 1e-5, "a");
    assert_close(linear_part(one).b(), linear_part(other).b(), 1e-5, "b");
    for x in [-1.9, -1.0, -0.1, 0.0, 0.2, 1.4] {
        close(
            e * curve(one).value(x) + f,
            curve(other).value(c * x + d),
            10.0 * e,
            "nonlinearity",
        );
    }
    for (a, b) in one.predicted.iter().zip(&other.predicted) {
        close(e * a + f, *b, 10.0 * e, "predicted");
    }
    let (a, b) = (&one.verdict, &other.verdict);
    close(a.measures.fit_percent, b.measures.fit_percent, 100.0, "fit");
    close(a.measures.rms * e.abs(), b.measures.rms, b.measures.rms, "rms");
    assert_eq!(a.holds(), b.holds());
    let names = |r: &Identification| {
        r.warnings
            .iter()
            .map(std::mem::discriminant)
            .collect::<Vec<std::mem::Discriminant<Warning>>>()
    };
    assert_eq!(names(one), names(other));
}

#[test]
fn units_and_offsets() {
    let source = source();
    let one = identify(&source);
    for exponent in [-9, -6, -3, 0, 3, 6, 9] {
        for sign in [1.0, -1.0] {
            let c = sign * 10.0_f64.powi(exponent);
            // The offset is a few of the signal's own spreads.
            for d in [0.0, 3.0 * c, -20.0 * c] {
                for (u, y) in [
                    ([c, d], [1.0, 0.0]),
                    ([1.0, 0.0], [c, d]),
                    ([c, d], [-1.0 / c, 5.0 / c]),
                ] {
                    compare(&one, &identify(&changed(&source, u, y)), u, y);
                }
            }
        }
    }
}

#[test]
fn powers_of_two_change_no_digit() {
    let source = source();
    let one = identify(&source);
    for k in [-30, 30] {
        let c = 2.0_f64.powi(k);
        let other = identify(&changed(&source, [c, 0.0], [c, 0.0]));
        assert_eq!(linear_part(&one), linear_part(&other));
        assert_eq!(number(&one, "value") * c, number(&other, "value"));
        let scaled: Vec<f64> = one.predicted.iter().map(|v| c * v).collect();
        assert_eq!(scaled, other.predicted);
        assert_eq!(one.verdict.measures.fit_percent, other.verdict.measures.fit_percent);
    }
}

#[test]
fn a_large_offset_costs_no_accuracy() {
    let source = source();
    let one = identify(&source);
    let (u, y) = ([1.0, 1e5], [1.0, -1e6]);
    compare(&one, &identify(&changed(&source, u, y)), u, y);
}

#[test]
fn a_later_start_moves_the_delay() {
    // The output shifted by five samples: the same identification with five more samples of delay.
    let linear = filter(&[1.0, 0.5], &[1.0, -0.6]);
    let source = hammerstein(|u| u * u * u, &linear, 4000, 0.1, 3);
    let (u, y) = (source.column("u").unwrap(), source.column("y").unwrap());
    let (one, other) = (
        identify(&record(u[5..].to_vec(), y[5..].to_vec())),
        identify(&record(u[5..].to_vec(), y[..3995].to_vec())),
    );
    assert_eq!((one.delay, other.delay), (0, 5));
    assert_close(linear_part(&one).b(), &linear_part(&other).b()[5..], 0.03, "b");
    assert_close(linear_part(&one).a(), linear_part(&other).a(), 0.03, "a");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let source = source();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| identify(&source))
    };
    assert_eq!(with(1), with(2));
}
