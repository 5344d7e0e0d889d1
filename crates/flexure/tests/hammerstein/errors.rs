//! What cannot be identified is refused, in words that say what to do.

use flexure::identify::{Calibration, RegressionLag};

use super::*;

fn good(n: usize) -> Record {
    hammerstein(|u| u + u * u, &filter(&[1.0], &[1.0, -0.5]), n, 0.1, 1)
}

fn message(method: PlainHammerstein, record: &Record) -> String {
    method.identify(record, "u", "y").unwrap_err().to_string()
}

fn with_column(name: &str, change: impl Fn(&mut Vec<f64>)) -> Record {
    let record = good(400);
    Record::new(record.columns().map(|(n, v)| {
        let mut v = v.to_vec();
        if n == name {
            change(&mut v);
        }
        (n, v)
    }))
    .unwrap()
}

#[test]
fn data() {
    let plain = PlainHammerstein::default();
    assert_eq!(
        plain.identify(&good(400), "torque", "y").unwrap_err().to_string(),
        "no column 'torque'; the columns are: u, y"
    );
    for (record, expected) in [
        (
            with_column("u", |u| u[17] = f64::NAN),
            "column 'u' is NaN at sample 17; remove or repair that sample",
        ),
        (
            with_column("y", |y| y[399] = f64::NEG_INFINITY),
            "column 'y' is -inf at sample 399; remove or repair that sample",
        ),
        (
            with_column("u", |u| u.fill(3.5)),
            "column 'u' is constant (3.5); nothing can be identified from it",
        ),
        (
            with_column("y", |y| y.fill(-1.0)),
            "column 'y' is constant (-1); nothing can be identified from it",
        ),
        (
            // Rounding of a large offset is not a signal.
            with_column("y", |y| y.iter_mut().for_each(|y| *y = 1e9 + 1e-7 * *y)),
            "column 'y' is constant (1000000000",
        ),
        (
            with_column("y", |y| y[300..].fill(2.0)),
            "column 'y' is constant (2) at samples 300 to 399, which are kept for the verdict; cut them off, change the fresh share, or leave the column out if it is one of several inputs",
        ),
        (
            with_column("u", |u| u[..300].fill(2.0)),
            "column 'u' is constant (2) at samples 0 to 299, which are used for the fit; cut them off, change the fresh share, or leave the column out if it is one of several inputs",
        ),
        (
            good(132),
            "a Hammerstein fit (besides the fresh part) needs at least 100 samples, but there are 99",
        ),
        (
            Record::new([("u", vec![]), ("y", vec![])]).unwrap(),
            "a Hammerstein fit (besides the fresh part) needs at least 100 samples, but there are 0",
        ),
    ] {
        let message = message(plain, &record);
        assert!(message.starts_with(expected), "{message}");
    }
    assert!(plain.identify(&good(134), "u", "y").is_ok());
}

#[test]
fn parameters() {
    let plain = PlainHammerstein::default();
    let quarter = "but must be below a quarter of the number of samples that are fitted";
    let two_points = |x, phi| PlainHammerstein {
        calibration: Calibration::TwoPoints { x, phi },
        ..plain
    };
    for (method, expected) in [
        (
            PlainHammerstein {
                fresh_share: 0.0,
                ..plain
            },
            "the fresh share is 0, but must be between 0.05 and 0.9".to_owned(),
        ),
        (
            PlainHammerstein {
                fresh_share: f64::NAN,
                ..plain
            },
            "the fresh share is NaN, but must be between 0.05 and 0.9".to_owned(),
        ),
        (
            PlainHammerstein {
                order: Some(51),
                ..plain
            },
            "the order is 51, but must be at most 50".to_owned(),
        ),
        (
            PlainHammerstein {
                delay: Some(75),
                ..plain
            },
            format!("the delay is 75, {quarter}"),
        ),
        (
            PlainHammerstein {
                regression_lag: RegressionLag::At(usize::MAX),
                ..plain
            },
            format!("the regression lag is 1.8446744073709552e19, {quarter}"),
        ),
        (
            PlainHammerstein {
                parameter: Some(0.0),
                ..plain
            },
            "the bandwidth is 0, but must be positive and finite".to_owned(),
        ),
        (
            PlainHammerstein {
                parameter: Some(f64::NAN),
                ..plain
            },
            "the bandwidth is NaN, but must be positive and finite".to_owned(),
        ),
        (
            PlainHammerstein {
                order: Some(50),
                ..plain
            },
            "the impulse response can be estimated at 61 lags from the delay of 0 on, but the given order needs 101; \
             give a lower order or a longer record"
                .to_owned(),
        ),
        (
            two_points([1.0, 1.0], [0.0, 1.0]),
            "x2 of the calibration is 1, but must be finite and different from the first point's".to_owned(),
        ),
        (
            two_points([0.0, 1.0], [0.0, f64::INFINITY]),
            "phi(x2) of the calibration is inf, but must be finite and different from the first point's".to_owned(),
        ),
        (
            two_points([0.0, 50.0], [0.0, 1.0]),
            "x2 of the calibration is 50, but must be a point with data within a bandwidth".to_owned(),
        ),
    ] {
        assert_eq!(message(method, &good(400)), expected);
    }
}

#[test]
fn the_limits_themselves_are_valid() {
    for method in [
        PlainHammerstein {
            fresh_share: 0.05,
            ..Default::default()
        },
        PlainHammerstein {
            delay: Some(74),
            ..Default::default()
        },
        PlainHammerstein {
            regression_lag: RegressionLag::At(74),
            ..Default::default()
        },
        PlainHammerstein {
            order: Some(0),
            ..Default::default()
        },
    ] {
        method.identify(&good(400), "u", "y").unwrap();
    }
}

#[test]
fn units_whose_squares_overflow_are_refused() {
    for scale in [1e200, 1e-200] {
        let u: Vec<f64> = uniform(1, 1000, 1.0).iter().map(|u| scale * u).collect();
        let largest = u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let error = PlainHammerstein::default().identify(&record(u, uniform(2, 1000, 1.0)), "u", "y");
        assert_eq!(
            error.unwrap_err().to_string(),
            format!(
                "the values of column 'u' reach {largest:e} in size; choose a unit in which that is between 1e-100 and 1e100"
            )
        );
    }
}
