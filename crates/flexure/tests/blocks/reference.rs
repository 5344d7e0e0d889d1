use flexure::Block;
use flexure::identify::result::Value;
use flexure::identify::{NARX, VOLTERRA};
use flexure::record::Record;

use crate::common::{Known, fit, identity, noisy, saturation, spread, uniform};

#[test]
fn narx_comes_near_a_system_with_feedback() {
    // No chain of blocks.
    let run = |u: &[f64]| {
        let mut y = vec![0.0; u.len()];
        for n in 2..u.len() {
            y[n] =
                1.2 * y[n - 1] - 0.5 * y[n - 2] + 0.3 * u[n - 1] - 0.05 * y[n - 1].powi(3) + 0.1 * u[n - 1] * y[n - 2];
        }
        y
    };
    let u = uniform(6000, 1);
    let y = noisy(run(&u), 0.003, 1);
    let result = NARX
        .identify(&Record::new([("u", u), ("y", y)]).unwrap(), &["u"], "y")
        .unwrap();
    let fresh = uniform(3000, 2);
    let reached = fit(&run(&fresh), &result.model.simulate(&fresh));
    let degree = result.detail("degree").unwrap();
    println!("{reached} {:?} {degree:?}", result.tried.last());
    assert!(reached > 97.0, "{reached}");
    assert_eq!(
        (degree, result.detail("bounded")),
        (&Value::Count(3), Some(&Value::Flag(true)))
    );
    assert!(result.delay <= 1);
    assert!(result.verdict.measures.fit_percent > 97.0);
}

#[test]
fn a_free_run_of_narx_is_bounded_far_outside_the_data() {
    let known = Known {
        f: |u| u + 0.3 * u * u,
        b: &[0.3],
        a: &[1.0, -0.8],
        g: saturation,
    };
    let record = known.record(2000, 3, 0.05);
    let result = NARX.identify(&record, &["u"], "y").unwrap();
    let wild: Vec<f64> = uniform(2000, 4).iter().map(|u| 1e6 * u).collect();
    let limit = 10.0 * spread(record.column("y").unwrap());
    for y in result.model.simulate(&wild) {
        assert!(y.abs() < limit, "{y}");
    }
}

#[test]
fn volterra_kernels_of_a_wiener_square_come_back() {
    // y = w + w^2 / 2 with w = G u has h1 = g and h2 = g g' / 2.
    let known = Known {
        f: identity,
        b: &[0.0, 0.5, 0.2],
        a: &[1.0, -0.8],
        g: |w| w + 0.5 * w * w,
    };
    let record = known.record(8000, 5, 0.03);
    let result = VOLTERRA.identify(&record, &["u"], "y").unwrap();
    let fresh = uniform(3000, 6);
    let reached = fit(&known.run(&fresh), &result.model.simulate(&fresh));
    println!("{reached} {:?}", result.detail("priors"));
    assert!(reached > 96.0, "{reached}");
    let g = flexure::linear::TransferFunction::new(known.b.to_vec(), known.a.to_vec()).unwrap();
    let g = g.impulse_response(40);
    let Block::Volterra(model) = &result.model else {
        panic!("{:?} is no Volterra series", result.model);
    };
    let delay = result.delay;
    // About the input's mean m: h1 = g (1 + G(1) m).
    let slope = 1.0 + g.iter().sum::<f64>() * model.input_level;
    for (i, h) in model.first.iter().take(8).enumerate() {
        assert!((h - slope * g[i + delay]).abs() < 0.02, "{i}: {h}");
        for k in 0..8.min(model.second_memory) {
            let h2 = model.second[i * model.second_memory + k];
            assert!((h2 - 0.5 * g[i + delay] * g[k + delay]).abs() < 0.02, "{i} {k}: {h2}");
            assert_eq!(h2, model.second[k * model.second_memory + i]);
        }
    }
    let noise = result.detail("noise").and_then(Value::number).unwrap();
    assert!(
        (noise / (0.03 * spread(record.column("y").unwrap())) - 1.0).abs() < 0.2,
        "{noise}"
    );
}

#[test]
fn odd_records_give_finite_references_or_an_error() {
    let n = 270;
    let wave: Vec<f64> = (0..n).map(|i| (0.1 * i as f64).sin()).collect();
    let noise = uniform(n, 2);
    let binary: Vec<f64> = noise.iter().map(|u| u.signum()).collect();
    let one: Vec<f64> = (0..n).map(|k| f64::from(u8::from(k == 20 || k == n - 10))).collect();
    let cases = [
        (binary.clone(), noisy(binary, 0.1, 1)),
        (wave.clone(), wave.iter().map(|w| w.powi(3)).collect()),
        (wave, noise.clone()),
        (one.clone(), one),
        (noise.clone(), noise.iter().map(|u| 1e80 * u.exp()).collect()),
    ];
    for (u, y) in cases {
        let record = Record::new([("u", u), ("y", y)]).unwrap();
        if let Ok(result) = NARX.identify(&record, &["u"], "y") {
            assert!(result.predicted.iter().all(|v| v.is_finite()));
        }
        if let Ok(result) = VOLTERRA.identify(&record, &["u"], "y") {
            assert!(result.predicted.iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn threads_do_not_matter() {
    let known = Known {
        f: |u| u + 0.3 * u * u,
        b: &[0.3],
        a: &[1.0, -0.8],
        g: identity,
    };
    let record = known.record(900, 7, 0.05);
    let both = || {
        let narx = NARX.identify(&record, &["u"], "y").unwrap();
        (narx, VOLTERRA.identify(&record, &["u"], "y").unwrap())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(both), both());
}

#[test]
fn too_few_samples_are_refused_with_a_message() {
    let record = Record::new([("u", uniform(100, 1)), ("y", uniform(100, 2))]).unwrap();
    let error = NARX.identify(&record, &["u"], "y").unwrap_err();
    assert_eq!(
        error.to_string(),
        "a NARX fit (besides the fresh part) needs at least 200 samples, but there are 75"
    );
    let error = VOLTERRA.identify(&record, &["u"], "y").unwrap_err();
    assert!(error.to_string().starts_with("a Volterra fit"), "{error}");
}
