//! Physical forms of the nonlinearity: the right one is fitted, wrong ones are refuted.

use flexure::identify::result::{Value, Values};
use flexure::identify::{PhysicalForm, RefinedHammerstein};

use super::refined::named;
use super::*;

#[test]
fn forms_are_fitted_and_wrong_ones_are_refuted() {
    let linear = filter(&[0.0, 1.0, 0.5], &[1.0, -0.5]);
    // The static gain is 3.
    let forms = [
        PhysicalForm::DeadZone,
        PhysicalForm::Saturation,
        PhysicalForm::LimitedDeadZone,
        PhysicalForm::Quantizer,
        PhysicalForm::Polynomial(3),
        PhysicalForm::Friction,
        PhysicalForm::Stiffness,
    ];
    type Case = (fn(f64) -> f64, PhysicalForm, &'static [f64]);
    let cases: [Case; 7] = [
        (
            |x| (x - 0.7).max(0.0) + (x + 0.5).min(0.0),
            PhysicalForm::DeadZone,
            &[-0.5, 0.7, 3.0, 0.0],
        ),
        (
            |x| 2.0 * x.clamp(-0.8, 1.1),
            PhysicalForm::Saturation,
            &[-0.8, 1.1, 6.0, 0.0],
        ),
        (
            |x| {
                let held = x.clamp(-1.5, 1.3);
                (held - 0.5).max(0.0) + (held + 0.4).min(0.0)
            },
            PhysicalForm::LimitedDeadZone,
            &[-1.5, -0.4, 0.5, 1.3, 3.0, 0.0],
        ),
        (|x| (x / 0.4).round(), PhysicalForm::Quantizer, &[0.4, 3.0, 0.0]),
        (
            |x| x - 0.5 * x * x * x + 1.0,
            PhysicalForm::Polynomial(3),
            &[3.0, 0.0, -1.5, 3.0],
        ),
        (
            |x| 0.5 * ((15.0 * x).tanh() - (5.0 * x).tanh()) + 0.8 * (10.0 * x).tanh() + 0.3 * x,
            PhysicalForm::Friction,
            &[],
        ),
        (
            |x| x * x * x + x - 0.9 * x * (-20.0 * x * x).exp(),
            PhysicalForm::Stiffness,
            &[20.0, 3.0, 3.0, 2.7, 0.0],
        ),
    ];
    for (phi, form, truth) in cases {
        let record = hammerstein(phi, &linear, 20_000, 0.1, 11);
        for candidate in forms {
            let fit = fitted_form(&record, candidate);
            // A joint's stiffness contains the odd cubic, a dead zone with limits one without, and a saturation.
            let nested = match form {
                PhysicalForm::Polynomial(3) => candidate == PhysicalForm::Stiffness,
                PhysicalForm::DeadZone | PhysicalForm::Saturation => candidate == PhysicalForm::LimitedDeadZone,
                _ => false,
            };
            let nested = nested || candidate == form;
            assert_eq!(
                fit.get("holds"),
                Some(&Value::Flag(nested)),
                "{form:?} as {candidate:?}: {fit:?}"
            );
            if candidate != form {
                continue;
            }
            let parameters = fit.get("parameters").unwrap().list().iter().map(named);
            for (p, want) in parameters.clone().zip(truth) {
                // A quantizer's step has no standard error.
                let error = p.get("error").and_then(Value::number).unwrap_or(0.0);
                let tolerance = 4.5 * error + 0.02 * want.abs() + 0.01;
                assert!((p.number("value") - want).abs() < tolerance, "{form:?} {p:?} {want}");
            }
            let parameters: Vec<f64> = parameters.map(|p| p.number("value")).collect();
            for x in [-1.5, -0.31, 0.05, 0.9, 1.7] {
                let value = form.value(&parameters, x);
                assert!((value - 3.0 * phi(x)).abs() < 0.1, "{form:?} {x}: {value}");
            }
        }
    }
    let method = RefinedHammerstein {
        form: Some(PhysicalForm::Polynomial(16)),
        ..Default::default()
    };
    let record = hammerstein(f64::tanh, &linear, 2000, 0.1, 11);
    let error = method.identify(&record, "u", "y").unwrap_err();
    assert!(error.to_string().contains("the degree is 16, but must be at most 15"));
}

fn fitted_form(record: &Record, form: PhysicalForm) -> Values {
    let method = RefinedHammerstein {
        form: Some(form),
        ..Default::default()
    };
    let result = method.identify(record, "u", "y").unwrap();
    named(result.detail("form").unwrap()).clone()
}
