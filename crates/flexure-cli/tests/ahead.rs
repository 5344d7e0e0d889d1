//! `predict --horizon`, and the initial state of `predict` and `validate`.

mod common;

use common::{Folder, numbers};
use flexure::Record;
use flexure::linear::TransferFunction;
use flexure_io::write_record;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

const PREDICT: &str = "predict model.json fresh.csv -o p.csv";
const STEADY: &str = "predict model.json fresh.csv -o p.csv --initial-state steady";

/// A limiter and a slowly ringing linear part, with output noise of its own colour.
fn record(samples: usize, seed: u64) -> Record {
    let mut rng = Pcg64::seed_from_u64(seed);
    let u: Vec<f64> = (0..samples).map(|_| rng.random_range(-2.0..2.0)).collect();
    let e: Vec<f64> = (0..samples).map(|_| rng.random_range(-0.1..0.1)).collect();
    let run =
        |b: &[f64], a: &[f64], signal: &[f64]| TransferFunction::new(b.to_vec(), a.to_vec()).unwrap().simulate(signal);
    let limited: Vec<f64> = u.iter().map(|u| u.clamp(-1.0, 0.6)).collect();
    let y = run(&[0.2, 0.1], &[1.0, -1.75, 0.85], &limited);
    let noise = run(&[1.0], &[1.0, -0.9], &e);
    let y = y.iter().zip(noise).map(|(y, v)| y + v).collect();
    Record::new([("u", u), ("y", y)]).unwrap()
}

/// A folder with a model, and a record that is the end of a longer one.
fn folder(fresh: usize, method: &str) -> Folder {
    let folder = Folder::new();
    write_record(folder.path("r.csv"), &record(4000, 1)).unwrap();
    folder.done(&format!(
        "identify r.csv --input u --output y -o model.json --method {method}"
    ));
    let long = record(500 + fresh, 2);
    let end = |name: &str| long.column(name).unwrap()[500..].to_vec();
    let fresh = Record::new([("u", end("u")), ("y", end("y"))]).unwrap();
    write_record(folder.path("fresh.csv"), &fresh).unwrap();
    folder
}

#[test]
fn the_noise_model_looks_ahead() {
    let folder = folder(300, "refined");
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    let r = numbers(&model["noise_model"]);
    assert!(r.len() > 1 && r[0] == 1.0, "{r:?}");
    folder.done(STEADY);
    let free = folder.column("p.csv", "predicted");
    let measured = folder.column("fresh.csv", "y");
    let v: Vec<f64> = measured.iter().zip(&free).map(|(y, s)| y - s).collect();
    let mut fits = Vec::new();
    for horizon in [1, 3, 20, 1000] {
        let options = format!("{STEADY} --horizon {horizon}");
        let found = folder.json(&options);
        assert_eq!(
            (&found["horizon"], &found["noise_model_used"]),
            (&horizon.into(), &true.into())
        );
        fits.push(found["fit_percent"].as_f64().unwrap());
        // The autoregression run on from what was known, one step after the other.
        for (t, got) in folder.column("p.csv", "predicted").iter().enumerate() {
            let mut known = v[..(t + 1).saturating_sub(horizon)].to_vec();
            let past = known.len();
            while past > 0 && known.len() <= t {
                let next = -known.iter().rev().zip(&r[1..]).map(|(v, r)| v * r).sum::<f64>();
                known.push(next);
            }
            let want = free[t] + if past > 0 { known[t] } else { 0.0 };
            assert!((got - want).abs() < 1e-9, "{horizon} {t}: {got} {want}");
        }
        let message = folder.done(&options);
        assert!(message.contains(&format!("\npredicted {horizon} sample")), "{message}");
        assert!(
            message.contains(" ahead, by the noise model, an autoregression of order "),
            "{message}"
        );
    }
    let run = folder.json(STEADY)["fit_percent"].as_f64().unwrap();
    assert!((fits[3] - run).abs() < 1e-9);
    // From a state that fits, what is near is predicted better.
    let fit = |options: &str| {
        folder.json(&format!("{PREDICT}{options}"))["fit_percent"]
            .as_f64()
            .unwrap()
    };
    let [near, further, run] = [" --horizon 1", " --horizon 3", ""].map(fit);
    println!("1 ahead {near}, 3 ahead {further}, free run {run}");
    assert!(near > further && further > run);
}

#[test]
fn without_a_noise_model_the_prediction_is_the_free_run_and_that_is_said() {
    let folder = folder(300, "plain");
    folder.done(STEADY);
    let free = folder.read("p.csv");
    let options = format!("{STEADY} --horizon 2");
    let message = folder.done(&options);
    assert!(
        message.contains("the model says nothing of its noise, so a 2-sample prediction equals the free run\n"),
        "{message}"
    );
    assert_eq!(folder.read("p.csv"), free);
    assert_eq!(folder.json(&options)["noise_model_used"], false);
}

#[test]
fn the_initial_state_of_a_short_record_is_estimated() {
    let folder = folder(60, "refined");
    let validate = "validate model.json fresh.csv --input u --output y";
    let fit = |options: &str| folder.json(&format!("{validate} {options}"));
    let (default, steady) = (fit("--skip 0"), fit("--skip 0 --initial-state steady"));
    assert_eq!(
        (&default["initial_state"], &steady["initial_state"]),
        (&"estimate".into(), &"steady".into())
    );
    assert!(default["initial_state_samples"].as_u64().unwrap() <= 60);
    assert_eq!(steady["initial_state_samples"], Value::Null);
    let percent = |object: &Value| object["fit_percent"].as_f64().unwrap();
    println!("estimated {}, steady {}", percent(&default), percent(&steady));
    assert!(percent(&default) > percent(&steady) + 5.0);
    // Where the start is skipped, it does not matter.
    assert_eq!(fit("--skip 40 --initial-state estimate")["initial_state"], "estimate");
    let message = folder.said(&format!("{validate} --skip 0"));
    assert!(
        message.contains(" free run from the state estimated from the first "),
        "{message}"
    );

    // The same in predict.
    folder.done(STEADY);
    let without = folder.column("p.csv", "predicted");
    let found = folder.json(PREDICT);
    assert_eq!(found["initial_state"], "estimate");
    assert!((percent(&found) - percent(&default)).abs() < 1e-9);
    assert_ne!(folder.column("p.csv", "predicted"), without);
    let message = folder.done(STEADY);
    assert!(
        message.contains("\nfree run from the steady state that belongs to the first input\nfit "),
        "{message}"
    );
    assert_eq!(folder.column("p.csv", "predicted"), without);
}

#[test]
fn outputs_that_are_missing_do_not_count() {
    let folder = folder(300, "refined");
    folder.done(STEADY);
    let predicted = folder.column("p.csv", "predicted");
    let (u, mut y) = (folder.column("fresh.csv", "u"), folder.column("fresh.csv", "y"));
    y.iter_mut().step_by(7).for_each(|y| *y = f64::NAN);
    let rows: String = u.iter().zip(&y).map(|(u, y)| format!("{u},{y}\n")).collect();
    folder.write("gaps.csv", format!("u,y\n{rows}"));
    folder.failed(
        "validate model.json gaps.csv --input u --output y",
        "gaps.csv, line 2: column 'y' is NaN or missing at sample 0; remove or repair that sample, or say --missing: samples without an output then do not count",
    );
    let validate = "validate model.json gaps.csv --input u --output y --missing --skip 20 --initial-state steady";
    let found = folder.json(validate);
    let errors = || (20..y.len()).filter(|&i| !y[i].is_nan()).map(|i| y[i] - predicted[i]);
    let rms = (errors().map(|e| e * e).sum::<f64>() / errors().count() as f64).sqrt();
    assert_eq!(found["samples"].as_u64(), Some(errors().count() as u64));
    assert!(
        (found["rms"].as_f64().unwrap() - rms).abs() < 1e-12 * (1.0 + rms),
        "{rms}"
    );
    folder.done("report model.json gaps.csv --input u --output y --missing -o page.html");
    assert!(folder.read("page.html").contains("Measured against predicted"));
}

/// The state at the start, and the fit, are computed from the outputs that are there.
#[test]
fn a_prediction_starts_from_the_outputs_that_are_there() {
    let folder = folder(300, "refined");
    folder.done(&format!("{PREDICT} --output y"));
    let complete = folder.column("p.csv", "predicted");
    let (u, mut y) = (folder.column("fresh.csv", "u"), folder.column("fresh.csv", "y"));
    y.iter_mut().step_by(7).for_each(|y| *y = f64::NAN);
    let rows: String = u.iter().zip(&y).map(|(u, y)| format!("{u},{y}\n")).collect();
    folder.write("fresh.csv", format!("u,y\n{rows}"));
    for options in ["", " --output y", " --initial-state estimate"] {
        let outcome = folder.run(&format!("{PREDICT}{options} --json"));
        assert_eq!(
            outcome.stderr.lines().last(),
            Some(
                "note: 43 of 300 samples of 'y' are missing or not finite; the fit and the state at the start are computed from the others"
            ),
            "{outcome:?}"
        );
        let found: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert_eq!(found["initial_state"], "estimate");
        let predicted = folder.column("p.csv", "predicted");
        let first = found["initial_state_samples"].as_u64().unwrap() as usize;
        let errors = || {
            (first..y.len())
                .filter(|&i| !y[i].is_nan())
                .map(|i| y[i] - predicted[i])
        };
        let rms = (errors().map(|e| e * e).sum::<f64>() / errors().count() as f64).sqrt();
        assert!((found["rms"].as_f64().unwrap() / rms - 1.0).abs() < 1e-9, "{found}");
        let off = predicted.iter().zip(&complete).map(|(p, c)| (p - c).abs());
        assert!(off.fold(0.0, f64::max) < 2.0 * rms, "{options}");
    }
    // A prediction some samples ahead needs them all, and no output leaves the start steady.
    assert_eq!(folder.run(&format!("{PREDICT} --output y --horizon 1")).code, Some(1));
    folder.write(
        "fresh.csv",
        format!("u,y\n{}", u.iter().map(|u| format!("{u},nan\n")).collect::<String>()),
    );
    let outcome = folder.run(&format!("{PREDICT} --json"));
    assert!(outcome.stdout.contains("\"initial_state\":\"steady\""), "{outcome:?}");
}

#[test]
fn what_cannot_be_done_is_refused() {
    let folder = folder(60, "refined");
    folder.misused(
        &format!("{PREDICT} --output u"),
        "--input and --output are both 'u'; name two different columns",
    );
    folder.misused(
        &format!("{PREDICT} --output y --horizon 0"),
        "invalid value '0' for '--horizon <K>': expected a whole number from 1",
    );
    folder.write("fresh.csv", "u,y\n1,2\n");
    let outcome = folder.run(&format!("{PREDICT} --initial-state estimate"));
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome
            .stderr
            .starts_with("error: fresh.csv: the estimation of an initial state needs at least "),
        "{outcome:?}"
    );
    // Unless it was asked for.
    assert_eq!(folder.json(&format!("{PREDICT} --output y"))["initial_state"], "steady");
}
