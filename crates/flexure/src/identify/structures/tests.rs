//! What all structures of one input have in common.

use std::ops::ControlFlow;

use super::super::block::Stage;
use super::{HAMMERSTEIN_WIENER, LINEAR, PARALLEL, WIENER, WIENER_HAMMERSTEIN};
use crate::Error;
use crate::error::{DataError, Result};
use crate::identify::request::{Options, Request, Structure};
use crate::identify::result::{Identification, Value};
use crate::identify::warning::Warning;
use crate::linear::TransferFunction;
use crate::record::Record;
use crate::signal::gaussian;

fn identify(structure: &Structure, u: &[f64], y: &[f64]) -> Result<Identification> {
    structure.identify(&Record::new([("u", u.to_vec()), ("y", y.to_vec())])?, &["u"], "y")
}

#[test]
fn hopeless_records_give_stable_models_and_a_verdict() {
    let n = 400;
    let noise = gaussian(n, 7);
    let levels: Vec<f64> = gaussian(n, 6).iter().map(|v| f64::from(u8::from(*v > 0.0))).collect();
    let square: Vec<f64> = noise.iter().map(|v| v * v).collect();
    let ramp: Vec<f64> = (0..n).map(|i| i as f64).collect();
    let growing: Vec<f64> = ramp.iter().map(|i| (0.05 * i).exp()).collect();
    let sine: Vec<f64> = ramp.iter().map(|i| (0.1 * i).sin()).collect();
    let mut spike = vec![0.0; n];
    (spike[50], spike[350]) = (1.0, 1.0);
    let cases = [
        (&levels, &noise),
        (&noise, &levels),
        (&noise, &gaussian(n, 8)),
        (&noise, &square),
        (&spike, &noise),
        (&spike, &spike),
        (&ramp, &noise),
        (&ramp, &growing),
        (&sine, &sine),
        (&noise, &ramp),
        (&growing, &noise),
    ];
    for structure in [WIENER, WIENER_HAMMERSTEIN] {
        for (i, (u, y)) in cases.into_iter().enumerate() {
            let result = identify(&structure, u, y).unwrap();
            let mut linear = result.blocks().filter_map(|b| b.linear());
            assert!(linear.all(|g| g.system.is_stable()), "{} {i}", structure.name);
            assert!(result.predicted.iter().all(|v| v.is_finite()), "{} {i}", structure.name);
        }
    }
    let even = identify(&WIENER_HAMMERSTEIN, &noise, &square).unwrap();
    let weak = |w: &Warning| matches!(w, Warning::WeakLinearApproximation { .. });
    assert!(even.warnings.iter().any(weak), "{:?}", even.warnings);
}

#[test]
fn it_can_be_stopped_at_every_stage() {
    let front = TransferFunction::new(vec![0.3, 0.1], vec![1.0, -1.1, 0.5]).unwrap();
    let back = TransferFunction::new(vec![0.5], vec![1.0, -0.5]).unwrap();
    let u = gaussian(600, 8);
    let z: Vec<f64> = front.simulate(&u).iter().map(|w| w.clamp(-0.6, 0.8)).collect();
    let y: Vec<f64> = (back.simulate(&z).iter().zip(gaussian(600, 99)))
        .map(|(y, e)| y + 0.005 * e)
        .collect();
    let record = Record::new([("u", u), ("y", y)]).unwrap();
    let others = [
        (Stage::Approximation, "approximating"),
        (Stage::Screening, "screening"),
        (Stage::Structure, "choosing"),
        (Stage::Refinement, "refining"),
    ];
    for (structure, own) in [
        (WIENER, (Stage::Correlation, "correlating")),
        (WIENER_HAMMERSTEIN, (Stage::Split, "splitting")),
    ] {
        for (stage, text) in others.into_iter().chain([own]) {
            let stop = &mut |now: &str| match now == stage.name() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            };
            let records = [&record];
            let request = Request::new(&records, &["u"], "y", Options::default());
            let error = structure.identify_with(&request, stop).unwrap_err();
            assert!(error.to_string().contains(text), "{}: {error}", structure.name);
        }
    }
}

#[test]
fn what_cannot_be_identified_is_refused() {
    let of = |n: usize| Record::new([("u", gaussian(n, 9)), ("y", gaussian(n, 10))]).unwrap();
    let flat = Record::new([("u", gaussian(400, 9)), ("y", vec![1.0; 400])]).unwrap();
    let cascades = [WIENER, WIENER_HAMMERSTEIN, HAMMERSTEIN_WIENER, PARALLEL].map(|structure| (structure, 250, 200));
    for (structure, samples, fewest) in [(LINEAR, 70, 60)].into_iter().chain(cascades) {
        let record = of(1000);
        for share in [0.01, 1.0] {
            let records = [&record];
            let request = Request::new(&records, &["u"], "y", Options::with_fresh_share(share));
            let go = &mut |_: &str| ControlFlow::Continue(());
            let error = structure.identify_with(&request, go).unwrap_err().to_string();
            assert!(error.contains("fresh share"), "{error}");
        }
        let error = structure.identify(&of(samples), &["u"], "y").unwrap_err();
        let Error::Data(DataError::TooShort { what, need, got }) = &error else {
            panic!("{error}");
        };
        assert_eq!((*need, *got), (fewest, samples * 3 / 4));
        assert!(error.to_string().contains(what), "{error}");
        let error = structure.identify(&flat, &["u"], "y").unwrap_err();
        assert!(matches!(error, Error::Data(DataError::Constant { .. })), "{error}");
        let error = structure.identify(&of(400), &["u"], "z").unwrap_err();
        assert!(matches!(error, Error::Data(DataError::MissingColumn { .. })), "{error}");
    }
}

#[test]
fn a_linear_output_that_integrates_goes_on_through_fresh_samples() {
    let u: Vec<f64> = gaussian(1200, 5).iter().map(|e| 3.0 + e).collect();
    // At an input of 2.9 it stands still.
    let force: Vec<f64> = u.iter().map(|u| u - 2.9).collect();
    let system = TransferFunction::new(vec![0.0, 0.2], vec![1.0, -1.5, 0.5]).unwrap();
    let clean = system.simulate(&force);
    let y: Vec<f64> = clean
        .iter()
        .zip(gaussian(1200, 6))
        .map(|(y, e)| 7.0 + y + 0.05 * e)
        .collect();
    let found = identify(&LINEAR, &u, &y).unwrap();
    assert_eq!(found.detail("integrators"), Some(&Value::Count(1)));
    assert!(found.fit_percent() > 95.0 && found.holds(), "{}", found.fit_percent());
    let block = found.linear("linear").unwrap();
    assert!(block.static_gain().is_infinite());
    let levels = found.detail("input_levels").unwrap().list();
    let level = levels[0].number().unwrap();
    assert!((level - 2.9).abs() < 0.02, "{level}");
}
