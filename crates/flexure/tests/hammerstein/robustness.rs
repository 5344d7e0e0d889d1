//! No record that passes the input checks makes the identification panic, or return what cannot be used.

use flexure::identify::{Calibration, HAMMERSTEIN, HammersteinMethod, PhysicalForm, RefinedHammerstein, RegressionLag};
use proptest::prelude::*;

use super::refined::{breakpoints, named, noise};
use super::*;

#[derive(Debug, Clone)]
pub struct Case {
    pub seed: u64,
    pub n: usize,
    system: usize,
    input: usize,
    scales: (f64, f64),
    offsets: (f64, f64),
    noise: f64,
    pub method: PlainHammerstein,
}

pub fn case(samples: std::ops::Range<usize>) -> impl Strategy<Value = Case> {
    let signals = (any::<u64>(), samples, 0..7usize, 0..5usize, 0.0..3.0f64);
    let units = ((-9.0..9.0f64, -9.0..9.0f64), (-50.0..50.0f64, -50.0..50.0f64));
    let method = (
        0..3usize,
        0..3usize,
        prop::option::of(0..6usize),
        prop::option::of(0..10usize),
        0.05..0.9f64,
    );
    (signals, units, method).prop_map(
        |((seed, n, system, input, noise), (e, offsets), (lag, fix, order, delay, share))| {
            let scales = (10.0_f64.powf(e.0), 10.0_f64.powf(e.1));
            Case {
                seed,
                n,
                system,
                input,
                scales,
                offsets,
                noise,
                method: PlainHammerstein {
                    regression_lag: [RegressionLag::Strongest, RegressionLag::Delay, RegressionLag::At(7)][lag],
                    calibration: [
                        Calibration::UnitStaticGain,
                        Calibration::UnitFirstCoefficient,
                        Calibration::TwoPoints {
                            x: [scales.0 * offsets.0, scales.0 * (offsets.0 + 0.5)],
                            phi: [0.0, 1.0],
                        },
                    ][fix],
                    order,
                    delay,
                    fresh_share: share,
                    ..Default::default()
                },
            }
        },
    )
}

pub fn simulate(case: &Case) -> Record {
    let Case { seed, n, .. } = *case;
    let white = uniform(seed, n, 2.0);
    let u: Vec<f64> = match case.input {
        0 => white,
        1 => white.iter().map(|u| u.signum()).collect(),
        2 => filter(&[1.0], &[1.0, -0.95]).simulate(&white),
        // Tails of Cauchy's kind.
        3 => white.iter().map(|u| (0.78 * u).tan()).collect(),
        _ => (0..n).map(|i| (0.07 * i as f64).sin()).collect(),
    };
    let cube = |u: &f64| u + 0.5 * u.powi(3);
    let y: Vec<f64> = match case.system {
        0 => filter(&[1.0, 0.4, 0.1], &[1.0, -1.2, 0.52]).simulate(&u.iter().map(cube).collect::<Vec<_>>()),
        1 => filter(&[0.05, 0.08], &[1.0, -1.97, 0.99]).simulate(&u.iter().map(|u| u * u).collect::<Vec<_>>()),
        2 => filter(&[1.0, -1.0], &[1.0]).simulate(&u),
        // An integrator: no stationary output.
        3 => filter(&[1.0], &[1.0, -1.0]).simulate(&u),
        4 => filter(&[0.3], &[1.0, -0.7])
            .simulate(&u)
            .iter()
            .map(|x| x.abs())
            .collect(),
        // One impulse.
        5 => (0..n).map(|i| f64::from(i == n / 3)).collect(),
        _ => vec![0.0; n],
    };
    let e = normal(seed ^ 1, n, case.noise);
    let map = |v: &[f64], scale: f64, offset: f64| v.iter().map(|v| scale * (v + offset)).collect();
    let noisy: Vec<f64> = y.iter().zip(e).map(|(y, e)| y + e).collect();
    record(
        map(&u, case.scales.0, case.offsets.0),
        map(&noisy, case.scales.1, case.offsets.1),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 250, ..ProptestConfig::default() })]
    #[test]
    fn identification_returns_a_stable_finite_model_or_says_why_not(case in case(100..3000)) {
        let record = simulate(&case);
        let result = match case.method.identify(&record, "u", "y") {
            Ok(result) => result,
            Err(error) => {
                prop_assert!(error.to_string().len() > 20);
                return Ok(());
            }
        };
        prop_assert!(linear_part(&result).is_stable(), "{:?}", linear_part(&result));
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        prop_assert!(finite(linear_part(&result).b()) && finite(linear_part(&result).a()));
        prop_assert!(finite(curve(&result).y()) && finite(&static_block(&result).band) && result.output_offset.is_finite());
        prop_assert!(finite(&result.predicted) && result.predicted.len() == case.n);
        prop_assert!(finite(&impulse(&result).values) && impulse(&result).limit.is_finite());
        prop_assert!(finite(&numbers(&result, "hankel_singular_values")));
        prop_assert!(number(&result, "value") > 0.0 && number(&result, "value").is_finite());
        prop_assert!(result.verdict.measures.fit_percent.is_finite());
        prop_assert!(result.verdict.text().starts_with("On fresh data") || result.verdict.text().starts_with("The model"));
        prop_assert!(result.warnings.iter().all(|w| !w.to_string().contains("NaN")));
    }

    #[test]
    fn refinement_returns_a_stable_finite_model_or_says_why_not(case in case(100..3000)) {
        let record = simulate(&case);
        let method = RefinedHammerstein {
            calibration: case.method.calibration,
            order: case.method.order,
            delay: case.method.delay,
            fresh_share: case.method.fresh_share,
            ..Default::default()
        };
        let result = match method.identify(&record, "u", "y") {
            Ok(result) => result,
            Err(error) => {
                prop_assert!(error.to_string().len() > 20);
                return Ok(());
            }
        };
        prop_assert!(linear_part(&result).is_stable(), "{:?}", linear_part(&result));
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        prop_assert!(finite(linear_part(&result).b()) && finite(linear_part(&result).a()));
        prop_assert!(errors(&result).is_none_or(|e| finite(&e.b) && finite(&e.a)));
        prop_assert!(finite(curve(&result).y()) && finite(&static_block(&result).band) && result.output_offset.is_finite());
        prop_assert!(static_block(&result).band.len() == curve(&result).y().len());
        prop_assert!(finite(&result.predicted) && result.predicted.len() == case.n);
        prop_assert!(result.noise_model.as_deref().is_none_or(finite) && noise(&result).is_finite());
        prop_assert!(breakpoints(&result).windows(2).all(|w| w[0].at <= w[1].at));
        prop_assert!(result.verdict.measures.fit_percent.is_finite());
        prop_assert!(result.warnings.iter().all(|w| !w.to_string().contains("NaN")));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]
    #[test]
    fn holes_and_several_experiments_do_no_harm(case in case(100..3000), cuts in 1..5usize, holes in 0.0..0.9f64) {
        let whole = simulate(&case);
        let draws = uniform(case.seed ^ 7, case.n, 1.0);
        let y = whole.column("y").unwrap();
        let y = y.iter().zip(draws).map(|(y, d)| if d.abs() < holes { f64::NAN } else { *y }).collect();
        let whole = record(whole.column("u").unwrap().to_vec(), y);
        let forms = [PhysicalForm::DeadZone, PhysicalForm::Saturation, PhysicalForm::Quantizer, PhysicalForm::Polynomial(5), PhysicalForm::Friction];
        let parts: Vec<Record> = (0..cuts).map(|k| whole.slice(k * case.n / cuts..(k + 1) * case.n / cuts)).collect();
        let method = RefinedHammerstein {
            calibration: case.method.calibration,
            form: forms.get(case.seed as usize % (forms.len() + 1)).copied(),
            fresh_share: case.method.fresh_share,
            ..Default::default()
        };
        let options = Options { missing: true, ..Options::with_method(HammersteinMethod::Refined(method)) };
        let records = parts.iter().collect::<Vec<_>>();
        let request = Request::new(&records, &["u"], "y", options);
        match HAMMERSTEIN.identify_with(&request, &mut |_| ControlFlow::Continue(())) {
            Ok(result) => {
                prop_assert!(linear_part(&result).is_stable(), "{:?}", linear_part(&result));
                let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
                prop_assert!(finite(curve(&result).y()) && finite(&static_block(&result).band) && finite(&result.predicted));
                if let Some(Value::Named(fit)) = result.detail("form") {
                    let mut parameters = fit.get("parameters").unwrap().list().iter().map(named);
                    prop_assert!(parameters.all(|p| p.number("value").is_finite()), "{fit:?}");
                    prop_assert!(fit.number("statistic") >= 0.0 && (0.0..=1.0).contains(&fit.number("p_value")), "{fit:?}");
                }
            }
            Err(error) => prop_assert!(error.to_string().len() > 20),
        }
    }
}
