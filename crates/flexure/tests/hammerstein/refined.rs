//! The refined identification is nearly as good as with a known linear part, and its standard errors are right.

use flexure::Error;
use flexure::error::DataError;
use flexure::identify::result::{Value, Values};
use flexure::identify::{Calibration, HAMMERSTEIN, RefinedHammerstein, Warning};
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts, relative_error_after_alignment};

use super::*;

pub fn refined(record: &Record) -> Identification {
    let result = RefinedHammerstein::default().identify(record, "u", "y").unwrap();
    assert!(is_refined(&result) && linear_part(&result).is_stable());
    result
}

pub fn is_refined(result: &Identification) -> bool {
    result.detail("refined") == Some(&Value::Flag(true))
}

/// A breakpoint of the nonlinearity.
#[derive(Debug)]
pub struct Breakpoint {
    pub at: f64,
    pub kind: Value,
    /// The standard error of its place.
    pub error: Option<f64>,
}

pub fn breakpoints(result: &Identification) -> Vec<Breakpoint> {
    let breakpoint = |v: &Value| Breakpoint {
        at: named(v).number("at"),
        kind: named(v).get("kind").unwrap().clone(),
        error: match named(v).get("error") {
            Some(Value::Number(error)) => Some(*error),
            _ => None,
        },
    };
    result
        .detail("breakpoints")
        .unwrap()
        .list()
        .iter()
        .map(breakpoint)
        .collect()
}

pub fn named(value: &Value) -> &Values {
    match value {
        Value::Named(values) => values,
        other => panic!("{other:?} has no names"),
    }
}

/// The deviation of the whitened error.
pub fn noise(result: &Identification) -> f64 {
    match result.detail("noise") {
        Some(Value::Named(noise)) => noise.number("deviation"),
        _ => result.verdict.measures.rms,
    }
}

pub fn error(phi: impl Fn(f64) -> f64, result: &Identification) -> f64 {
    // Without 0, where a limiter's value is a convention.
    let grid: Vec<f64> = (0..200).map(|i| -1.9 + 3.8 * (f64::from(i) + 0.5) / 200.0).collect();
    let truth: Vec<f64> = grid.iter().map(|x| phi(*x)).collect();
    let estimate: Vec<f64> = grid.iter().map(|x| curve(result).value(*x)).collect();
    relative_error_after_alignment(&truth, &estimate)
}

#[test]
fn every_nonlinearity_is_followed_through_a_damped_and_a_resonant_part() {
    for (which, linear) in known_linear_parts().into_iter().enumerate() {
        for phi in KnownNonlinearity::ALL {
            let record = KnownHammerstein::usual(phi, linear.clone()).simulate(8000, 3);
            let result = refined(&record);
            // The plain estimate's errors here are 0.05 to 0.4.
            let got = error(|x| phi.value(x), &result);
            assert!(got < 0.05, "{phi:?} {which}: {got}");
            assert_eq!((result.delay, result.order), (0, 2), "{phi:?} {which}");
            let tolerance = [0.03, 0.005][which];
            assert_close(linear_part(&result).a(), linear.a(), tolerance, "a");
            assert!((linear_part(&result).static_gain() - 1.0).abs() < 1e-9);
            assert!(result.verdict.holds(), "{phi:?} {which}: {}", result.verdict.text());
        }
    }
}

#[test]
fn the_common_job_is_done_as_well_as_a_prediction_error_fit_from_a_good_start() {
    let linear = filter(&[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7]);
    let mut system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
    system.process_noise = 0.0;
    let results: Vec<Identification> = (0..5).map(|s| refined(&system.simulate(10_000, s))).collect();
    for result in &results {
        // 20 and 40 knots from the true order reach 0.0071 in the mean.
        let got = error(|x| KnownNonlinearity::DeadZone.value(x), result);
        assert!(got < 0.0071, "{got} {:?}", breakpoints(result));
        assert_eq!((result.delay, result.order), (1, 2));
        assert!(result.verdict.measures.fit_percent > 89.0);
        assert_eq!(result.noise_model.as_deref(), Some(&[1.0][..]));
    }
}

#[test]
fn delay_and_order_are_found() {
    let late = filter(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.4, 0.1], &[1.0, -1.2, 0.52]);
    let fourth = filter(&[1.0, -0.6, 0.5, 0.2], &[1.0, -2.6, 3.05, -1.748, 0.442]);
    for (linear, want) in [(late, (5, 2)), (fourth, (0, 4)), (filter(&[0.7], &[1.0]), (0, 0))] {
        let result = refined(&KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear).simulate(20_000, 4));
        assert_eq!((result.delay, result.order), want);
        let got = error(|x| KnownNonlinearity::DeadZone.value(x), &result);
        assert!(got < 0.02, "{want:?} {got}");
    }
}

#[test]
fn a_coloured_input_does_no_harm() {
    let [linear, _] = known_linear_parts();
    let u = filter(&[0.6], &[1.0, -0.8]).simulate(&normal(3, 20_000, 1.0));
    let w: Vec<f64> = u.iter().map(|u| u.tanh()).collect();
    let y = linear
        .simulate(&w)
        .iter()
        .zip(normal(4, 20_000, 0.1))
        .map(|(y, e)| y + e)
        .collect();
    let result = refined(&record(u, y));
    assert_eq!(result.warnings, []);
    let got = error(f64::tanh, &result);
    assert!(got < 0.01, "{got}");
    assert_close(linear_part(&result).a(), linear.a(), 0.01, "a");
}

#[test]
fn standard_errors_and_band_hold_at_their_level() {
    let [linear, _] = known_linear_parts();
    let at = [-1.6, -1.1, -0.4, 0.1, 0.6, 1.2, 1.7];
    let (mut inside, mut all) = ([0, 0], [0, 0]);
    for seed in 0..60 {
        // Process noise, so that the output error is coloured.
        let result = refined(&KnownHammerstein::usual(KnownNonlinearity::Cubic, linear.clone()).simulate(4000, seed));
        for (i, truth) in linear.a().iter().enumerate().skip(1) {
            let z = (linear_part(&result).a()[i] - truth) / errors(&result).unwrap().a[i];
            inside[0] += usize::from(z.abs() < 1.96);
            all[0] += 1;
        }
        // phi with unit static gain, whose level is that of the true cubic.
        let gain = linear.static_gain();
        let curve = curve(&result);
        for x in at {
            let i = curve.x().partition_point(|v| *v < x);
            inside[1] += usize::from((curve.value(x) - gain * x.powi(3)).abs() < static_block(&result).band[i]);
            all[1] += 1;
        }
    }
    let share = |i: usize| inside[i] as f64 / all[i] as f64;
    assert!((0.88..=0.99).contains(&share(0)), "{}", share(0));
    assert!((0.86..=0.99).contains(&share(1)), "{}", share(1));
}

#[test]
fn whitening_the_error_pays_for_a_resonance() {
    let [_, resonance] = known_linear_parts();
    let plain = RefinedHammerstein {
        noise_model: false,
        ..Default::default()
    };
    let (mut without, mut with) = (0.0, 0.0);
    for seed in 0..5 {
        let record = KnownHammerstein::usual(KnownNonlinearity::Parabola, resonance.clone()).simulate(8000, seed);
        let phi = |x| KnownNonlinearity::Parabola.value(x);
        without += error(phi, &plain.identify(&record, "u", "y").unwrap());
        with += error(phi, &refined(&record));
    }
    assert!(with < 0.8 * without, "{with} {without}");
}

#[test]
fn missing_samples_are_skipped() {
    let [linear, _] = known_linear_parts();
    let complete = hammerstein(f64::tanh, &linear, 6000, 0.1, 5);
    let mut y = complete.column("y").unwrap().to_vec();
    for (i, draw) in uniform(6, 6000, 1.0).iter().enumerate() {
        if *draw > 0.6 {
            y[i] = f64::NAN;
        }
    }
    let holes = record(complete.column("u").unwrap().to_vec(), y);
    let refused = RefinedHammerstein::default().identify(&holes, "u", "y");
    assert!(matches!(refused, Err(Error::Data(DataError::NonFinite { .. }))));
    let result = identify_present(&HAMMERSTEIN, &holes);
    let (got, with_all) = (error(f64::tanh, &result), error(f64::tanh, &refined(&complete)));
    assert!(got < 2.0 * with_all + 0.005, "{got} {with_all}");
    assert_close(linear_part(&result).a(), linear.a(), 0.01, "a");
    assert!(result.predicted.iter().all(|p| p.is_finite()) && result.verdict.holds());
}

/// Coloured noise is whitened also where samples miss.
#[test]
fn missing_samples_cost_little_in_coloured_noise() {
    let [linear, _] = known_linear_parts();
    let phi = |u: f64| u.signum() * (u.abs() - 0.5).max(0.0);
    let colour = TransferFunction::new(vec![0.1], vec![1.0, -0.8]).unwrap();
    let (mut with_all, mut with_few) = (0.0, 0.0);
    for seed in 0..6 {
        let clean = hammerstein(phi, &linear, 4000, 0.0, 20 + seed);
        let noise = colour.simulate(&uniform(30 + seed, 4000, 1.0));
        let u = || clean.column("u").unwrap().to_vec();
        let y: Vec<f64> = clean
            .column("y")
            .unwrap()
            .iter()
            .zip(noise)
            .map(|(y, e)| y + e)
            .collect();
        let draws = uniform(40 + seed, 4000, 1.0);
        let holes = y
            .iter()
            .zip(draws)
            .map(|(y, draw)| if draw > 0.8 { f64::NAN } else { *y });
        with_few += error(phi, &identify_present(&HAMMERSTEIN, &record(u(), holes.collect()))) / 6.0;
        with_all += error(phi, &refined(&record(u(), y))) / 6.0;
    }
    assert!(with_few < 1.4 * with_all, "{with_few} {with_all}");
}

#[test]
fn experiments_have_initial_states_of_their_own() {
    let [linear, _] = known_linear_parts();
    let experiments: Vec<Record> = (0..4)
        .map(|k| {
            let whole = hammerstein(f64::tanh, &linear, 2000, 0.1, 10 + k);
            // A state far from rest: its decay is added.
            let kick = linear.impulse_response(2000);
            let y = whole
                .column("y")
                .unwrap()
                .iter()
                .zip(kick)
                .map(|(y, k)| y + 20.0 * k)
                .collect();
            record(whole.column("u").unwrap().to_vec(), y)
        })
        .collect();
    let all: Vec<&Record> = experiments.iter().collect();
    let result = RefinedHammerstein::default()
        .identify_experiments(&all, "u", "y")
        .unwrap();
    assert_eq!((result.fitted, result.predicted.len()), (6000, 8000));
    assert!(error(f64::tanh, &result) < 0.01, "{}", error(f64::tanh, &result));
    assert_close(linear_part(&result).a(), linear.a(), 0.01, "a");
}

#[test]
fn units_and_offsets_change_nothing_else() {
    let [linear, _] = known_linear_parts();
    let plain = hammerstein(|u| (u - 0.3).max(0.0), &linear, 4000, 0.1, 8);
    let (u, y) = (plain.column("u").unwrap(), plain.column("y").unwrap());
    let scaled = record(
        u.iter().map(|u| 1e6 * u - 3e6).collect(),
        y.iter().map(|y| 1e-7 * y + 2e-7).collect(),
    );
    let (a, b) = (refined(&plain), refined(&scaled));
    assert_close(linear_part(&a).a(), linear_part(&b).a(), 1e-5, "a");
    assert!((a.verdict.measures.fit_percent - b.verdict.measures.fit_percent).abs() < 1e-3);
    for x in [-1.5, 0.0, 0.9, 1.8] {
        let (p, q) = (curve(&a).value(x), 1e7 * (curve(&b).value(1e6 * x - 3e6) - 2e-7));
        assert!((p - q).abs() < 1e-3 * 2.0, "{x}: {p} {q}");
    }
}

#[test]
fn conventions_are_kept() {
    let linear = filter(&[0.0, 2.0, 1.0], &[1.0, -0.5]);
    let record = hammerstein(|u| u + 0.2 * u * u * u + 1.0, &linear, 4000, 0.05, 3);
    let of = |calibration| {
        let method = RefinedHammerstein {
            calibration,
            ..Default::default()
        };
        method.identify(&record, "u", "y").unwrap()
    };
    let first = of(Calibration::UnitFirstCoefficient);
    assert_eq!((linear_part(&first).b()[0], linear_part(&first).b()[1]), (0.0, 1.0));
    assert_eq!(errors(&first).unwrap().b[1], 0.0);
    let phi = |x: f64| x + 0.2 * x.powi(3) + 1.0;
    let points = of(Calibration::TwoPoints {
        x: [-1.0, 1.5],
        phi: [phi(-1.0), phi(1.5)],
    });
    for x in [-1.8, 0.0, 0.7, 1.9] {
        assert!((curve(&points).value(x) - phi(x)).abs() < 0.05, "{x}");
    }
    assert!((linear_part(&points).b()[1] - 2.0).abs() < 0.05);
}

#[test]
fn parameters_out_of_range_are_refused() {
    let record = hammerstein(f64::tanh, &filter(&[1.0], &[1.0, -0.5]), 400, 0.1, 1);
    let refuse = |method: RefinedHammerstein, message: &str| {
        let error = method.identify(&record, "u", "y").unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
    };
    let default = RefinedHammerstein::default();
    refuse(
        RefinedHammerstein {
            fresh_share: f64::NAN,
            ..default
        },
        "the fresh share",
    );
    refuse(
        RefinedHammerstein {
            order: Some(51),
            ..default
        },
        "the order",
    );
    refuse(
        RefinedHammerstein {
            delay: Some(200),
            ..default
        },
        "the delay",
    );
    let short = record.slice(0..120);
    let error = default.identify(&short, "u", "y").unwrap_err();
    assert!(error.to_string().contains("needs at least 100 samples"), "{error}");
    assert!(matches!(
        default.identify(&record, "u", "x"),
        Err(Error::Data(DataError::MissingColumn { .. }))
    ));
    assert!(matches!(
        default.identify_experiments(&[], "u", "y"),
        Err(Error::Data(DataError::TooShort { .. }))
    ));
}

#[test]
fn an_output_without_the_input_is_not_explained() {
    let record = record(uniform(1, 3000, 1.0), normal(2, 3000, 1.0));
    let result = RefinedHammerstein::default().identify(&record, "u", "y").unwrap();
    assert!(result.verdict.measures.fit_percent < 3.0);
    assert!(
        result
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::NoDependence { .. })),
        "{:?}",
        result.warnings
    );
    assert!(linear_part(&result).is_stable());
}

#[test]
fn an_input_of_few_levels_is_known_at_those() {
    let [linear, _] = known_linear_parts();
    let u: Vec<f64> = uniform(3, 6000, 2.49).iter().map(|u| u.round()).collect();
    let w: Vec<f64> = u.iter().map(|u| (2.0 * u).tanh() + 0.5).collect();
    let y = linear
        .simulate(&w)
        .iter()
        .zip(normal(4, 6000, 0.1))
        .map(|(y, e)| y + e)
        .collect();
    let result = refined(&record(u, y));
    assert_eq!(curve(&result).x(), [-2.0, -1.0, 0.0, 1.0, 2.0]);
    let gain = linear.static_gain();
    for (x, y) in curve(&result).x().iter().zip(curve(&result).y()) {
        assert!((y - gain * ((2.0 * x).tanh() + 0.5)).abs() < 0.05, "{x} {y}");
    }
    assert!(
        matches!(result.warnings[..], [Warning::FewLevels { levels: 5 }]),
        "{:?}",
        result.warnings
    );
}

#[test]
fn the_result_is_the_same_twice() {
    let [linear, _] = known_linear_parts();
    let record = KnownHammerstein::usual(KnownNonlinearity::Friction, linear).simulate(3000, 1);
    assert_eq!(refined(&record), refined(&record));
}
