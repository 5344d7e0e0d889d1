//! `flexure identify --structure`: other cascades than Hammerstein models.

mod common;

use std::f64::consts::TAU;

use common::{Folder, filter, interpolate, numbers};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::{Curve, Outside};
use flexure::{Block, Record};
use flexure_io::{read_record, write_record};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

const IDENTIFY: &str = "identify r.csv --input u --output y --structure wiener-hammerstein";

/// Two poles, an asymmetric limiter, one pole; both linear parts of unit static gain.
fn wiener_hammerstein() -> Block {
    let linear = |b: &[f64], a: &[f64]| Block::Linear(TransferFunction::new(b.to_vec(), a.to_vec()).unwrap());
    let limiter = Curve::new(vec![-0.6, 0.8], vec![-0.6, 0.8], Outside::Nearest).unwrap();
    Block::Series(vec![
        linear(&[0.3, 0.1], &[1.0, -1.1, 0.5]),
        Block::Static(limiter),
        linear(&[0.0, 0.5], &[1.0, -0.5]),
    ])
}

/// A record of the Wiener-Hammerstein system under a Gaussian input, with white noise of a hundredth of the output's size.
fn write(folder: &Folder, name: &str, samples: usize, seed: u64) -> Record {
    write_of(&wiener_hammerstein(), folder, name, samples, seed)
}

/// The same of any system with an output of about that size.
fn write_of(system: &Block, folder: &Folder, name: &str, samples: usize, seed: u64) -> Record {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut normal = |n: usize| -> Vec<f64> { (0..n).map(|_| StandardNormal.sample(&mut rng)).collect() };
    let u = normal(samples);
    let noise = normal(samples);
    let y = system.simulate(&u);
    let y = y.iter().zip(noise).map(|(y, e)| y + 0.005 * e).collect();
    let record = Record::new([("u", u), ("y", y)]).unwrap();
    write_record(folder.path(name), &record).unwrap();
    record
}

fn near(found: &[f64], truth: &[f64], tolerance: f64) -> bool {
    found.len() == truth.len() && found.iter().zip(truth).all(|(f, t)| (f - t).abs() < tolerance)
}

#[test]
fn a_wiener_hammerstein_system_comes_back_and_predicts() {
    let folder = Folder::new();
    write(&folder, "r.csv", 5000, 1);
    let found = folder.json(&format!("{IDENTIFY} -o model.json --report page.html"));
    assert_eq!(found["structure"], "wiener-hammerstein");
    assert_eq!(found["method"], "prediction-error");
    assert!(found["fit_percent"].as_f64().unwrap() > 97.0, "{}", found["verdict"]);
    assert_eq!(found["holds"], true, "{}", found["verdict"]);
    assert_eq!(
        (&found["samples_fitted"], &found["samples_fresh"]),
        (&3750.into(), &1250.into())
    );
    // Blocks that each have unit static gain.
    let (front, back) = (&found["front"], &found["back"]);
    assert_eq!([&front["order"], &back["order"], &found["order"]], [2, 1, 3]);
    assert!(near(&numbers(&front["a"]), &[1.0, -1.1, 0.5], 0.02), "{front}");
    assert!(near(&numbers(&back["a"]), &[1.0, -0.5], 0.02), "{back}");
    for block in [front, back] {
        assert!((block["static_gain"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(
            block["poles"].as_array().unwrap().len() as u64,
            block["order"].as_u64().unwrap()
        );
        for pole in block["poles"].as_array().unwrap() {
            let [re, im] = [0, 1].map(|k| pole[k].as_f64().unwrap());
            assert!(re.hypot(im) < 1.0);
        }
    }
    let (x, y) = (
        numbers(&found["nonlinearity"]["x"]),
        numbers(&found["nonlinearity"]["y"]),
    );
    for at in [-1.0, -0.4, 0.0, 0.5, 1.2] {
        let value = interpolate(&x, &y, at);
        assert!((value - f64::clamp(at, -0.6, 0.8)).abs() < 0.03, "{at}: {value}");
    }
    assert!(found["tried"].as_array().unwrap().len() > 10);
    assert!(!found["approximations"].as_array().unwrap().is_empty());
    check_model(&folder);
    check_prediction(&folder);
    check_page(&folder.read("page.html"));
}

/// The model's file: three blocks in series.
fn check_model(folder: &Folder) {
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!(model["structure"], "wiener-hammerstein");
    let blocks = model["block"]["series"].as_array().unwrap();
    let kinds: Vec<&String> = blocks.iter().flat_map(|b| b.as_object().unwrap().keys()).collect();
    assert_eq!(kinds, ["linear", "static", "linear"]);
    let stored = model["identification"].as_object().unwrap();
    let labels = model["paths"][0]["blocks"].as_array().unwrap();
    let roles: Vec<&Value> = labels.iter().map(|label| &label["role"]).collect();
    assert_eq!(roles, ["front", "nonlinearity", "back"]);
    assert!(labels[1]["breakpoints"].is_array() && stored.contains_key("tried"));
    for twice in ["front", "back", "nonlinearity", "structure"] {
        assert!(!stored.contains_key(twice), "{twice}");
    }
}

/// `predict` and `validate` against filtering, interpolation and filtering.
fn check_prediction(folder: &Folder) {
    let fresh = write(folder, "fresh.csv", 800, 2);
    let printed = folder.done("predict model.json fresh.csv --initial-state steady -o predicted.csv");
    assert!(
        !printed.contains("warning") || printed.contains("samples behind the first linear part lie outside"),
        "{printed}"
    );
    let predicted = read_record(folder.path("predicted.csv")).unwrap();
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    let blocks = &model["block"]["series"];
    let from = |block: &Value, signal: &[f64], level: f64| {
        let [b, a] = ["b", "a"].map(|name| numbers(&block["linear"][name]));
        filter(&b, &a, signal, level)
    };
    let through = |block: &Value, signal: &[f64]| from(block, signal, signal[0]);
    let u = fresh.column("u").unwrap();
    let w = through(&blocks[0], u);
    let (x, f) = (numbers(&blocks[1]["static"]["x"]), numbers(&blocks[1]["static"]["y"]));
    // Those outside are counted from the steady state of the mean input.
    let counted = from(&blocks[0], u, u.iter().sum::<f64>() / u.len() as f64);
    let outside = counted.iter().filter(|w| **w < x[0] || **w > x[x.len() - 1]).count();
    let z: Vec<f64> = w.iter().map(|w| straight(&x, &f, *w)).collect();
    let y = through(&blocks[2], &z);
    for (sample, (got, want)) in predicted.record.column("predicted").unwrap().iter().zip(&y).enumerate() {
        assert!(
            (got - want).abs() < 1e-9 * want.abs().max(1.0),
            "{sample}: {got} {want}"
        );
    }
    let object = folder.json("predict model.json fresh.csv --initial-state steady -o predicted.csv");
    assert_eq!(object["samples_outside_range"], outside);
    let judged = folder.json("validate model.json fresh.csv --input u --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 97.0, "{judged}");
}

/// Interpolation, straight on beyond the ends.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let last = x.len() - 2;
    let i = x.partition_point(|x| *x <= at).saturating_sub(1).min(last);
    y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i])
}

fn check_page(page: &str) {
    for expected in [
        "A Wiener-Hammerstein model (linear dynamics, a static nonlinearity, linear dynamics)",
        "Block diagram: u, then Front linear part (order 2, delay ",
        "), then Nonlinearity, then Back linear part (order ",
        "Front linear part",
        "Back linear part",
        "Order 2, delay ",
        "Structures that were tried",
        "chosen-row",
        "intermediate signal, behind the front linear part",
        "cubic spline of ",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
}

#[test]
fn the_text_has_both_linear_parts() {
    let folder = Folder::new();
    write(&folder, "r.csv", 2000, 3);
    let printed = folder.said(IDENTIFY);
    for line in [
        "Wiener-Hammerstein model from 'u' to 'y': fit ",
        ", method prediction-error RMS error ",
        " front linear part order ",
        " nonlinearity cubic spline of ",
        " back linear part order ",
        " cycles/sample with damping 0.",
        " zeros ",
        " poles time constant ",
        " structures tried ",
    ] {
        assert!(printed.contains(line), "{line}: {printed}");
    }
}

#[test]
fn options_of_hammerstein_models_are_refused() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    for option in [
        "--method refined",
        "--method plain",
        "--order 2",
        "--delay 0",
        "--unit static-gain",
        "--known 0=0 1=1",
        "--form friction",
        "--kernel uniform",
        "--lag 0",
    ] {
        let name = option.split(' ').next().unwrap();
        let more = match name {
            "--form" => ". Other structures draw their curves on the page, without a form",
            _ => "",
        };
        for structure in ["auto", "linear", "wiener", "wiener-hammerstein"] {
            folder.misused(
                &format!("identify r.csv --input u --output y --structure {structure} -o new.json {option}"),
                &format!(
                    "{name} is an option of --structure hammerstein, not of --structure {structure}; leave it out, or choose \
                     --structure hammerstein{more}"
                ),
            );
        }
    }
    // What is automatic anyway may be said.
    let message =
        "r.csv: a Wiener-Hammerstein fit (besides the fresh part) needs at least 200 samples, but there are 150";
    folder.known("r.csv", 200, 1);
    folder.failed(&format!("{IDENTIFY} --order auto --delay auto -o new.json"), message);
    for (structure, what) in [("auto", "a comparison of structures"), ("wiener", "a Wiener fit")] {
        folder.failed(
            &format!("identify r.csv --input u --output y --structure {structure} -o new.json"),
            &format!("r.csv: {what} (besides the fresh part) needs at least 200 samples, but there are 150"),
        );
    }
    folder.known("r.csv", 70, 1);
    folder.failed(
        "identify r.csv --input u --output y --structure linear -o new.json",
        "r.csv: a linear fit (besides the fresh part) needs at least 60 samples, but there are 52",
    );
}

#[test]
fn records_that_cannot_be_used_are_refused() {
    let folder = Folder::new();
    let rows: String = (0..600)
        .map(|k| format!("{},{}\n", k % 7, if k == 11 { "nan" } else { "1.5" }))
        .collect();
    folder.write("r.csv", format!("u,y\n{rows}"));
    for structure in ["wiener-hammerstein", "hammerstein-wiener", "narx", "volterra"] {
        folder.failed(
            &format!("identify r.csv --input u --output y --structure {structure} -o new.json"),
            "r.csv, line 13: column 'y' is NaN or missing at sample 11; remove or repair that sample, or say --missing: samples without an output then do not count",
        );
    }
    folder.write("r.csv", format!("u,y\n{}", rows.replace("nan", "1.5")));
    let outcome = folder.run(&format!("{IDENTIFY} -o new.json"));
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("column 'y' is constant"), "{outcome:?}");
    assert!(!folder.path("new.json").exists());
}

/// Nine resonances have more poles than a Hammerstein model.
#[test]
fn without_a_structure_linear_dynamics_may_take_the_place_of_a_hammerstein_model() {
    let folder = Folder::new();
    let mode = |frequency: f64| {
        let turn = TAU * frequency;
        let radius = (-0.01 * turn).exp();
        let a = vec![1.0, -2.0 * radius * turn.cos(), radius * radius];
        Block::Linear(TransferFunction::new(vec![0.0, 0.1], a).unwrap())
    };
    let modes = Block::Parallel(
        [0.03, 0.07, 0.11, 0.16, 0.21, 0.26, 0.32, 0.38, 0.44]
            .map(mode)
            .to_vec(),
    );
    write_of(&modes, &folder, "r.csv", 3000, 1);
    // A comparison of more structures takes too long for the long record.
    write_of(&modes, &folder, "long.csv", 67_000, 1);
    for (record, others) in [
        ("r.csv", "Not fitted, as a simpler structure holds: Wiener, "),
        ("long.csv", "Only these two structures were compared: "),
    ] {
        let found = folder.json(&format!("identify {record} --input u --output y -o model.json"));
        assert_eq!((&found["structure"], &found["holds"]), (&json!("linear"), &json!(true)));
        let comparison = &found["comparison"];
        let compared: Vec<_> = (comparison["candidates"].as_array().unwrap().iter())
            .map(|c| &c["structure"])
            .collect();
        assert_eq!(compared, ["linear", "hammerstein"]);
        let mut reasons = comparison["reasons"].as_array().unwrap().iter();
        assert!(reasons.any(|r| r.as_str().unwrap().starts_with(others)), "{comparison}");
    }
    folder.done("validate model.json r.csv");
    // What is asked for is done.
    let found = folder.json("identify r.csv --input u --output y --structure hammerstein");
    assert_eq!(
        (&found["structure"], &found["holds"]),
        (&json!("hammerstein"), &json!(false))
    );
    // A Hammerstein system is one.
    folder.known("h.csv", 3000, 1);
    let found = folder.json("identify h.csv --input u --output y");
    assert_eq!(found["structure"], "hammerstein");
    assert!(found["comparison"].is_null());
}

/// The limiter acts in the fresh part only. No structure could know of it, so that their comparison would say nothing.
#[test]
fn a_fresh_part_beyond_the_fitted_range_decides_between_no_structures() {
    let folder = Folder::new();
    let record = write(&folder, "r.csv", 4000, 5);
    let shrunk = |(k, u): (usize, &f64)| if k < 3000 { 0.2 * u } else { *u };
    let u: Vec<f64> = record.column("u").unwrap().iter().enumerate().map(shrunk).collect();
    let Block::Series(blocks) = wiener_hammerstein() else {
        unreachable!()
    };
    let y = Block::Series(blocks[1..].to_vec()).simulate(&u);
    write_record(folder.path("r.csv"), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
    let found = folder.json("identify r.csv --input u --output y");
    assert_eq!(
        (&found["structure"], &found["holds"]),
        (&json!("hammerstein"), &json!(false))
    );
    assert!(found["comparison"].is_null(), "{}", found["comparison"]);
    assert!(
        found["warnings"].to_string().contains("lies outside the range"),
        "{}",
        found["warnings"]
    );
}

/// A record that is too short for a comparison keeps its Hammerstein model.
#[test]
fn a_short_record_needs_no_comparison() {
    let folder = Folder::new();
    write(&folder, "r.csv", 180, 3);
    let found = folder.json("identify r.csv --input u --output y");
    assert_eq!(
        (&found["structure"], &found["holds"]),
        (&json!("hammerstein"), &json!(false))
    );
}
