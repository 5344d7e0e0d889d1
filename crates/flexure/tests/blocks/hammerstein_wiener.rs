use flexure::error::{DataError, Stopped};
use std::ops::ControlFlow;

use flexure::Error;
use flexure::identify::{HAMMERSTEIN_WIENER, Identification, Options, Request};
use flexure::nonlinearity::Curve;
use flexure::record::Record;

use crate::common::{Known, dead_zone, fit, identity, noisy, saturation, spread, uniform};

const DEAD_ZONE_AND_SATURATION: Known = Known {
    f: dead_zone,
    b: &[0.0, 0.3, 0.1],
    a: &[1.0, -1.1, 0.5],
    g: saturation,
};

fn identify(record: &Record) -> Identification {
    HAMMERSTEIN_WIENER.identify(record, &["u"], "y").unwrap()
}

/// The fit to the noiseless output under another input.
fn truth_fit(known: &Known, result: &Identification) -> f64 {
    let u = uniform(4000, 77);
    fit(&known.run(&u), &result.model.simulate(&u))
}

/// The largest distance of a curve from its least-squares line over these points, relative to the line's rise.
fn bend(curve: &Curve, low: f64, high: f64) -> f64 {
    let x: Vec<f64> = (0..=100).map(|i| low + (high - low) * f64::from(i) / 100.0).collect();
    let y: Vec<f64> = x.iter().map(|x| curve.value(*x)).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let slope = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
        / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
    let off = x.iter().zip(&y).map(|(x, y)| (y - my - slope * (x - mx)).abs());
    off.fold(0.0, f64::max) / (slope * (high - low)).abs()
}

/// The range that the middle 98 % of a signal take.
fn middle(mut signal: Vec<f64>) -> (f64, f64) {
    signal.sort_unstable_by(f64::total_cmp);
    let at = |q: f64| signal[(q * (signal.len() - 1) as f64) as usize];
    (at(0.01), at(0.99))
}

#[test]
fn a_dead_zone_before_and_a_saturation_behind_come_back() {
    let known = DEAD_ZONE_AND_SATURATION;
    let result = identify(&known.record(12_000, 1, 0.01));
    let reached = truth_fit(&known, &result);
    println!("{reached} {:?}", result.tried.last());
    assert!(reached >= 99.0, "{reached}");
    assert_eq!(
        (result.order, result.delay),
        (2, 1),
        "{:?}",
        result.linear("linear").unwrap()
    );
    for (got, want) in result.linear("linear").unwrap().a().iter().zip(known.a) {
        assert!((got - want).abs() < 0.02, "{:?}", result.linear("linear").unwrap());
    }
    // The conventions: unit static gain, and a least-squares line through f that is the identity.
    assert!((result.linear("linear").unwrap().static_gain() - 1.0).abs() < 1e-9);
    let (n, u) = (result.fitted as f64, uniform(12_000, 1));
    let u = &u[..result.fitted];
    let v: Vec<f64> = u
        .iter()
        .map(|u| result.curve("nonlinearity").unwrap().value(*u))
        .collect();
    let (mu, mv) = (u.iter().sum::<f64>() / n, v.iter().sum::<f64>() / n);
    let slope = u.iter().zip(&v).map(|(u, v)| (u - mu) * (v - mv)).sum::<f64>() / (n * spread(u).powi(2));
    assert!(
        (slope - 1.0).abs() < 1e-3 && (mu - mv).abs() < 1e-3,
        "{slope} {mu} {mv}"
    );
}

#[test]
fn smooth_nonlinearities_a_resonance_and_a_delay_come_back() {
    let known = Known {
        f: |u| u + 0.3 * u * u - 0.1 * u.powi(3),
        b: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.08],
        a: &[1.0, -1.6, 0.8],
        g: |x| (0.8 * x).tanh() + 0.2 * x,
    };
    let result = identify(&known.record(10_000, 2, 0.01));
    let reached = truth_fit(&known, &result);
    println!("{reached} {:?}", result.tried.last());
    assert!(reached >= 99.0, "{reached}");
    assert_eq!(
        (result.order, result.delay),
        (2, 5),
        "{:?}",
        result.linear("linear").unwrap()
    );
    assert!(result.verdict.holds(), "{}", result.verdict.text());
}

#[test]
fn a_hammerstein_system_has_a_nearly_straight_output_nonlinearity() {
    let known = Known {
        g: identity,
        ..DEAD_ZONE_AND_SATURATION
    };
    let record = known.record(10_000, 3, 0.01);
    let result = identify(&record);
    let v: Vec<f64> = record
        .column("u")
        .unwrap()
        .iter()
        .map(|u| result.curve("nonlinearity").unwrap().value(*u))
        .collect();
    let (low, high) = middle(result.linear("linear").unwrap().simulate_from_mean(&v));
    let bend = bend(result.curve("output_nonlinearity").unwrap(), low, high);
    println!("{bend} {}", truth_fit(&known, &result));
    assert!(bend < 0.01, "{bend}");
    assert!(truth_fit(&known, &result) > 99.0);
}

#[test]
fn a_wiener_system_has_a_nearly_straight_input_nonlinearity() {
    let known = Known {
        f: identity,
        ..DEAD_ZONE_AND_SATURATION
    };
    let result = identify(&known.record(10_000, 4, 0.01));
    let bend = bend(result.curve("nonlinearity").unwrap(), -1.9, 1.9);
    println!("{bend} {}", truth_fit(&known, &result));
    assert!(bend < 0.01, "{bend}");
    assert!(truth_fit(&known, &result) > 99.0);
}

#[test]
fn units_do_not_matter_and_threads_neither() {
    let record = DEAD_ZONE_AND_SATURATION.record(3000, 5, 0.02);
    let result = identify(&record);
    let mapped = |name: &str, gain: f64, level: f64| -> Vec<f64> {
        record.column(name).unwrap().iter().map(|v| gain * v + level).collect()
    };
    let other = Record::new([("u", mapped("u", 1e-3, 5.0)), ("y", mapped("y", -2e4, 1e5))]).unwrap();
    let other = identify(&other);
    assert_eq!(result.order, other.order);
    let scale = spread(&result.predicted);
    for (a, b) in result.predicted.iter().zip(&other.predicted).skip(100) {
        assert!((a - (b - 1e5) / -2e4).abs() < 1e-3 * scale, "{a} {b}");
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| identify(&record)), result);
}

#[test]
fn odd_records_give_a_finite_stable_model_or_an_error() {
    let n = 300;
    let wave: Vec<f64> = (0..n).map(|i| (0.1 * i as f64).sin()).collect();
    let binary: Vec<f64> = uniform(n, 1).iter().map(|u| u.signum()).collect();
    let noise = uniform(n, 2);
    let one = |i: usize| {
        (0..n)
            .map(|k| f64::from(u8::from(k == i || k == n - 10)))
            .collect::<Vec<f64>>()
    };
    let even: Vec<f64> = noise.iter().map(|u| u * u).collect();
    let integrated: Vec<f64> = noise
        .iter()
        .scan(0.0, |s, u| {
            *s += u;
            Some(*s)
        })
        .collect();
    let huge: Vec<f64> = noise.iter().map(|u| 1e120 * u).collect();
    let cases = [
        (binary.clone(), noisy(binary.clone(), 0.1, 1)),
        (noise.clone(), uniform(n, 9)),
        (noise.clone(), even),
        (noise.clone(), integrated),
        (wave.clone(), wave.iter().map(|w| w.powi(3)).collect()),
        (wave, noise.clone()),
        (one(20), one(25)),
        (noise.clone(), binary),
        (
            noise.clone(),
            noise.iter().map(|u| f64::from(u8::from(*u > 1.9))).collect(),
        ),
        (huge.clone(), noise.iter().map(|u| 1e-120 * u).collect()),
        (noise.clone(), huge),
    ];
    for (i, (u, y)) in cases.into_iter().enumerate() {
        let record = Record::new([("u", u.clone()), ("y", y)]).unwrap();
        match HAMMERSTEIN_WIENER.identify(&record, &["u"], "y") {
            Ok(result) => {
                assert!(result.linear("linear").unwrap().is_stable(), "{i}");
                assert!(result.predicted.iter().all(|v| v.is_finite()), "{i}");
                assert!(result.model.simulate(&u).iter().all(|v| v.is_finite()), "{i}");
            }
            Err(error) => println!("{i}: {error}"),
        }
    }
}

#[test]
fn what_cannot_be_identified_is_refused_with_a_message() {
    let record = DEAD_ZONE_AND_SATURATION.record(250, 6, 0.01);
    let error = HAMMERSTEIN_WIENER.identify(&record, &["u"], "y").unwrap_err();
    assert_eq!(
        error.to_string(),
        "a Hammerstein-Wiener fit (besides the fresh part) needs at least 200 samples, but there are 187"
    );
    let error = HAMMERSTEIN_WIENER.identify(&record, &["u"], "z").unwrap_err();
    assert!(matches!(error, Error::Data(DataError::MissingColumn { .. })), "{error}");
    let error = HAMMERSTEIN_WIENER
        .identify_with(
            &Request::new(&[&record], &["u"], "y", Options::with_fresh_share(0.99)),
            &mut |_| ControlFlow::Continue(()),
        )
        .unwrap_err();
    assert!(error.to_string().contains("the fresh share is 0.99"), "{error}");
    let flat = Record::new([("u", vec![1.0; 400]), ("y", uniform(400, 1))]).unwrap();
    let error = HAMMERSTEIN_WIENER.identify(&flat, &["u"], "y").unwrap_err();
    assert!(matches!(error, Error::Data(DataError::Constant { .. })), "{error}");
}

#[test]
fn it_stops_when_asked() {
    let record = DEAD_ZONE_AND_SATURATION.record(400, 7, 0.01);
    let error = HAMMERSTEIN_WIENER
        .identify_with(&Request::new(&[&record], &["u"], "y", Options::default()), &mut |_| {
            ControlFlow::Break(())
        })
        .unwrap_err();
    assert!(matches!(error, Error::Stopped(Stopped::Identifying { .. })), "{error}");
}
