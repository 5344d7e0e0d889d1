//! The conventions for scale and offset.

use flexure::identify::{Calibration, Warning};
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

use super::*;

fn with(calibration: Calibration, record: &Record) -> Identification {
    PlainHammerstein {
        calibration,
        ..Default::default()
    }
    .identify(record, "u", "y")
    .unwrap()
}

const POINTS: Calibration = Calibration::TwoPoints {
    x: [-1.2, 1.5],
    phi: [-7.0, 11.0],
};

fn usual() -> Record {
    let [linear, _] = known_linear_parts();
    KnownHammerstein::usual(KnownNonlinearity::SoftWindup, linear).simulate(6000, 4)
}

#[test]
fn each_convention_holds_exactly() {
    let record = usual();
    let result = with(Calibration::UnitStaticGain, &record);
    assert!((linear_part(&result).static_gain() - 1.0).abs() < 1e-12);
    assert_eq!(result.output_offset, 0.0);
    let result = with(Calibration::UnitFirstCoefficient, &record);
    assert!((linear_part(&result).b()[result.delay] - 1.0).abs() < 1e-12);
    assert_eq!(result.output_offset, 0.0);
    let result = with(POINTS, &record);
    // The curve is a table of the estimate: between its points it is interpolated.
    assert!((curve(&result).value(-1.2) + 7.0).abs() < 1e-2);
    assert!((curve(&result).value(1.5) - 11.0).abs() < 1e-2);
}

#[test]
fn two_points_that_the_table_contains_are_met_to_rounding() {
    let linear = filter(&[1.0, 0.3], &[1.0, -0.6]);
    let levels = |u: f64| (4.0 * u).round() / 4.0;
    let source = hammerstein(|u| levels(u).powi(3), &linear, 4000, 0.1, 3);
    let u: Vec<f64> = source.column("u").unwrap().iter().map(|&u| levels(u)).collect();
    let record = record(u, source.column("y").unwrap().to_vec());
    let points = Calibration::TwoPoints {
        x: [0.5, -1.25],
        phi: [2.0, -3.0],
    };
    let result = with(points, &record);
    assert!((curve(&result).value(0.5) - 2.0).abs() < 1e-10);
    assert!((curve(&result).value(-1.25) + 3.0).abs() < 1e-10);
}

#[test]
fn the_free_run_does_not_depend_on_the_convention() {
    let record = usual();
    let reference = with(Calibration::UnitStaticGain, &record);
    for other in [Calibration::UnitFirstCoefficient, POINTS] {
        let result = with(other, &record);
        assert_close(&result.predicted, &reference.predicted, 1e-9, "predicted");
        assert_eq!(result.order, reference.order);
        assert_close(linear_part(&result).a(), linear_part(&reference).a(), 1e-12, "a");
    }
}

#[test]
fn two_known_points_of_the_truth_give_the_truth_s_scale() {
    let phi = KnownNonlinearity::Cubic;
    let [linear, _] = known_linear_parts();
    let record = KnownHammerstein::usual(phi, linear.clone()).simulate(40_000, 8);
    let points = Calibration::TwoPoints {
        x: [-1.8, 1.8],
        phi: [phi.value(-1.8), phi.value(1.8)],
    };
    let result = with(points, &record);
    assert!((linear_part(&result).static_gain() / linear.static_gain() - 1.0).abs() < 0.1);
    for x in [-1.6, -1.0, 0.0, 1.0, 1.6] {
        assert!((curve(&result).value(x) - phi.value(x)).abs() < 0.5, "{x}");
    }
    assert!(result.output_offset.abs() < 0.5);
}

#[test]
fn a_differentiator_has_no_static_gain_to_scale_by() {
    let linear = filter(&[1.0, -1.0], &[1.0]);
    let source = hammerstein(|u| u + 0.3 * u * u * u, &linear, 8000, 0.05, 6);
    let y = source.column("y").unwrap().iter().map(|y| y + 40.0).collect();
    let record = record(source.column("u").unwrap().to_vec(), y);
    let result = identify(&record);
    assert!(
        result.warnings.contains(&Warning::NoStaticGain),
        "{:?}",
        result.warnings
    );
    assert!((linear_part(&result).b()[0] - 1.0).abs() < 1e-12);
    assert!((result.output_offset - 40.0).abs() < 0.1);
    assert!(result.verdict.measures.fit_percent > 80.0, "{}", result.verdict.text());
    let points = with(POINTS, &record);
    assert!(!points.warnings.contains(&Warning::NoStaticGain));
    assert_close(&points.predicted, &result.predicted, 1e-6, "predicted");
}

#[test]
fn a_gain_within_its_error_of_zero_is_not_scaled_by() {
    let difference = TransferFunction::new(vec![1.0, -1.0], vec![1.0]).unwrap();
    for seed in 0..12 {
        let u = uniform(seed, 4000, 2.0);
        let e = normal(seed + 100, 4000, 0.01);
        let y = difference.simulate(&u).iter().zip(e).map(|(y, e)| y + e).collect();
        let result = identify(&record(u, y));
        assert!(
            result.warnings.contains(&Warning::NoStaticGain),
            "seed {seed}: {:?}",
            linear_part(&result)
        );
        let b = linear_part(&result).b();
        assert!(b[0] == 1.0 && (b[1] + 1.0).abs() < 0.1, "seed {seed}: {b:?}");
        assert!((curve(&result).value(1.5) - 1.5).abs() < 0.3, "seed {seed}");
    }
}
