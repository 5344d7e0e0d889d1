//! `flexure identify --structure`: two nonlinearities, and the references without blocks.

mod common;

use common::{Folder, interpolate, numbers};
use flexure::Record;
use flexure::linear::TransferFunction;
use flexure_io::{read_record, write_record};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

const IDENTIFY: &str = "identify r.csv --input u --output y --structure";

/// A parabola, one pole after a delay of 2, a saturation.
fn write(folder: &Folder, name: &str, samples: usize, seed: u64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let u: Vec<f64> = (0..samples).map(|_| rng.random_range(-1.0..1.0)).collect();
    let v: Vec<f64> = u.iter().map(|u| u + 0.5 * u * u).collect();
    let linear = TransferFunction::new(vec![0.0, 0.0, 0.4], vec![1.0, -0.6]).unwrap();
    let mut noise = || 0.003 * rng.random_range(-1.0..1.0);
    let y = linear
        .simulate_from_mean(&v)
        .iter()
        .map(|x| x.tanh() + noise())
        .collect();
    let record = Record::new([("u", u), ("y", y)]).unwrap();
    write_record(folder.path(name), &record).unwrap();
}

#[test]
fn a_hammerstein_wiener_model_comes_back_and_predicts() {
    let folder = Folder::new();
    write(&folder, "r.csv", 3000, 1);
    let found = folder.json(&format!(
        "{IDENTIFY} hammerstein-wiener -o model.json --report page.html"
    ));
    assert_eq!(found["structure"], "hammerstein-wiener");
    assert!(found["fit_percent"].as_f64().unwrap() > 98.0, "{}", found["verdict"]);
    assert_eq!((&found["order"], &found["delay"]), (&1.into(), &2.into()));
    let a = numbers(&found["linear"]["a"]);
    assert!((a[1] + 0.6).abs() < 0.01, "{a:?}");
    // The scale is a convention: the composition with the static gain is not.
    let curve = |name: &str, at: f64| interpolate(&numbers(&found[name]["x"]), &numbers(&found[name]["y"]), at);
    for u in [-0.8, -0.3, 0.2, 0.7] {
        let steady = curve("output_nonlinearity", curve("nonlinearity", u));
        let want = f64::tanh(u + 0.5 * u * u);
        assert!((steady - want).abs() < 0.05, "{u}: {steady} {want}");
    }
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    let blocks = model["block"]["series"].as_array().unwrap();
    let kinds: Vec<&String> = blocks.iter().flat_map(|b| b.as_object().unwrap().keys()).collect();
    assert_eq!(kinds, ["static", "linear", "static"]);
    let stored = model["identification"].as_object().unwrap();
    let label = &model["paths"][0]["blocks"][2];
    assert_eq!(label["role"], "output_nonlinearity");
    assert!(label["breakpoints"].is_array() && stored.contains_key("tried"));
    for twice in ["linear", "nonlinearity", "output_nonlinearity"] {
        assert!(!stored.contains_key(twice), "{twice}");
    }
    write(&folder, "fresh.csv", 900, 2);
    folder.done("predict model.json fresh.csv --input u -o predicted.csv");
    assert_eq!(read_record(folder.path("predicted.csv")).unwrap().record.len(), 900);
    let judged = folder.json("validate model.json fresh.csv --input u --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 98.0, "{judged}");
    let page = folder.read("page.html");
    for expected in [
        "A Hammerstein-Wiener model (a static nonlinearity, linear dynamics, a static nonlinearity)",
        "Nonlinearity at the output",
        "Order 1, delay 2",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    let message = folder.said(&format!("{IDENTIFY} hammerstein-wiener"));
    for line in [
        "Hammerstein-Wiener model from 'u' to 'y': fit ",
        " nonlinearity at the input: cubic spline of ",
        " linear part order 1, delay 2",
        " nonlinearity at the output: cubic spline of ",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
}

#[test]
fn references_show_how_far_one_gets() {
    let folder = Folder::new();
    write(&folder, "r.csv", 2000, 3);
    for (name, title) in [("narx", "Polynomial NARX"), ("volterra", "Second-order Volterra")] {
        let found = folder.json(&format!("{IDENTIFY} {name}"));
        assert_eq!(found["structure"], name);
        assert!(
            found["fit_percent"].as_f64().unwrap() > 75.0,
            "{name} {}",
            found["fit_percent"]
        );
        let message = folder.said(&format!("{IDENTIFY} {name}"));
        assert!(
            message.starts_with(&format!("{title} model from 'u' to 'y': fit ")),
            "{message}"
        );
        assert!(message.contains("a reference without blocks"), "{message}");
        let message = folder.done(&format!("{IDENTIFY} {name} -o {name}.json --report {name}.html"));
        assert!(message.contains(&format!("wrote {name}.json")), "{message}");
        let model: Value = serde_json::from_str(&folder.read(&format!("{name}.json"))).unwrap();
        assert!(model["block"][name].is_object(), "{model}");
        write(&folder, "fresh.csv", 700, 4);
        folder.done(&format!("predict {name}.json fresh.csv --input u -o predicted.csv"));
        assert_eq!(read_record(folder.path("predicted.csv")).unwrap().record.len(), 700);
        let judged = folder.json(&format!("validate {name}.json fresh.csv --input u --output y"));
        assert!(judged["fit_percent"].as_f64().unwrap() > 75.0, "{judged}");
        let page = folder.read(&format!("{name}.html"));
        let section = if name == "narx" { "Terms" } else { "Second-order kernel" };
        assert!(
            page.contains(section) && page.contains("a reference without blocks"),
            "{name}"
        );
        folder.misused(
            &format!("{IDENTIFY} {name} --order 2"),
            &format!(
                "--order is an option of --structure hammerstein, not of --structure {name}; leave it out, or choose --structure \
                 hammerstein"
            ),
        );
    }
    let volterra = folder.json(&format!("{IDENTIFY} volterra"));
    let rows = volterra["second"].as_array().unwrap();
    assert_eq!(rows.len(), rows[0].as_array().unwrap().len());
    let narx = folder.json(&format!("{IDENTIFY} narx"));
    assert_eq!(narx["bounded"], true);
    assert!(!narx["terms"].as_array().unwrap().is_empty());
}

/// A square through a slow pole and a saturation through a fast one.
fn write_sum(folder: &Folder, name: &str, samples: usize, seed: u64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let u: Vec<f64> = (0..samples).map(|_| rng.random_range(-1.0..1.0)).collect();
    let branch = |f: fn(f64) -> f64, pole: f64| {
        let v: Vec<f64> = u.iter().map(|u| f(*u)).collect();
        let linear = TransferFunction::new(vec![1.0 - pole], vec![1.0, -pole]).unwrap();
        linear.simulate_from_mean(&v)
    };
    let (p, q) = (branch(|u| u * u, 0.8), branch(|u| (2.0 * u).tanh(), -0.4));
    let y = p
        .iter()
        .zip(&q)
        .map(|(p, q)| p + q + 0.002 * rng.random_range(-1.0..1.0))
        .collect();
    write_record(folder.path(name), &Record::new([("u", u.clone()), ("y", y)]).unwrap()).unwrap();
}

#[test]
fn a_sum_of_branches_comes_back_and_predicts() {
    let folder = Folder::new();
    write_sum(&folder, "r.csv", 2500, 1);
    let found = folder.json(&format!(
        "{IDENTIFY} parallel --branches 2 -o model.json --report page.html"
    ));
    assert_eq!(found["structure"], "parallel");
    assert!(found["fit_percent"].as_f64().unwrap() > 98.0, "{}", found["verdict"]);
    let branches = found["branches"].as_array().unwrap();
    assert_eq!(branches.len(), 2);
    let steady = |at: f64| -> f64 {
        let of = |b: &Value| {
            let curve = &b["nonlinearity"];
            let last = if b["linear"].is_null() {
                &b["back"]
            } else {
                &b["linear"]
            };
            let gain = last["static_gain"].as_f64().unwrap();
            gain * interpolate(&numbers(&curve["x"]), &numbers(&curve["y"]), at)
        };
        branches.iter().map(of).sum::<f64>() + found["output_offset"].as_f64().unwrap()
    };
    for u in [-0.8, -0.3, 0.2, 0.7] {
        assert!(
            (steady(u) - u * u - f64::tanh(2.0 * u)).abs() < 0.03,
            "{u}: {}",
            steady(u)
        );
    }
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!(model["block"]["parallel"].as_array().unwrap().len(), 2);
    let stored = model["identification"].as_object().unwrap();
    assert_eq!(model["paths"].as_array().unwrap().len(), 2);
    assert!(!stored.contains_key("branches"), "{stored:?}");
    write_sum(&folder, "fresh.csv", 900, 2);
    folder.done("predict model.json fresh.csv --input u -o predicted.csv");
    assert_eq!(read_record(folder.path("predicted.csv")).unwrap().record.len(), 900);
    let judged = folder.json("validate model.json fresh.csv --input u --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 98.0, "{judged}");
    let page = folder.read("page.html");
    for expected in ["(a sum of 2 branches: ", "Nonlinearity, branch 2", "Branch 2: "] {
        assert!(page.contains(expected), "{expected}");
    }
    let message = folder.said(&format!("{IDENTIFY} parallel --branches 1"));
    for line in [
        "Parallel model from 'u' to 'y': fit ",
        " structure a sum of 1 branch: ",
        " Branch 1 nonlinearity ",
        " nonlinearity cubic spline of ",
        " structures tried ",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
    folder.misused(
        &format!("{IDENTIFY} wiener --branches 2"),
        "--branches is an option of --structure parallel, not of --structure wiener; leave it out, or choose --structure parallel",
    );
    folder.misused(
        &format!("{IDENTIFY} parallel --branches 6"),
        "invalid value '6' for '--branches <auto|N>': expected 'auto' or a whole number from 1 to 5",
    );
}

#[test]
fn several_inputs_come_back() {
    let folder = Folder::new();
    let mut rng = Pcg64::seed_from_u64(5);
    let mut input = || -> Vec<f64> { (0..3000).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let (p, q, e) = (input(), input(), input());
    let mut y = vec![0.0; 3000];
    for n in 1..3000 {
        y[n] = 0.6 * y[n - 1] + p[n].powi(2) + q[n - 1].tanh();
    }
    let y: Vec<f64> = y.iter().zip(&e).map(|(y, e)| y + 1.0 + 0.01 * e).collect();
    let record = Record::new([("p", p), ("q", q), ("y", y)]).unwrap();
    write_record(folder.path("r.csv"), &record).unwrap();
    let identify = "identify r.csv --input p,q --output y --structure multiple-inputs";
    let found = folder.json(identify);
    assert!(found["fit_percent"].as_f64().unwrap() > 98.0, "{}", found["verdict"]);
    assert_eq!(found["inputs"], serde_json::json!(["p", "q"]));
    let branches = found["branches"].as_array().unwrap();
    assert_eq!((branches.len(), &branches[1]["delay"]), (2, &1.into()));
    let message = folder.said(identify);
    assert!(
        message.starts_with("Multiple-input Hammerstein model from 'p', 'q' to 'y': fit ")
            && message.contains(" From 'q' nonlinearity "),
        "{message}"
    );
    write_record(folder.path("fresh.csv"), &record).unwrap();
    folder.done(&format!("{identify} -o model.json --report page.html"));
    folder.done("predict model.json fresh.csv --input p,q -o predicted.csv");
    let judged = folder.json("validate model.json fresh.csv --input p,q --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 98.0, "{judged}");
    let page = folder.read("page.html");
    for expected in [
        "From p, q to y",
        "From &#x27;q&#x27;",
        "From &#x27;q&#x27;: linear part",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    folder.misused(
        "predict model.json fresh.csv --input p -o new.csv",
        "--input names 1 of the model's 2 inputs; give them all, separated by commas, in the model's order: p,q",
    );
    folder.misused(
        &format!("{identify} --period 100"),
        "--period is for a single input; leave it out, or name one column by --input",
    );
    folder.misused(
        "identify r.csv --input p,p --output y --structure multiple-inputs",
        "--input names 'p' twice; name each once",
    );
    folder.misused(
        "identify r.csv --input p,y --output y --structure multiple-inputs",
        "--input and --output are both 'y'; name two different columns",
    );
}

#[test]
fn inputs_that_act_jointly_come_back_and_predict() {
    let folder = Folder::new();
    let write = |name: &str, samples: usize, seed: u64| {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut input = || -> Vec<f64> { (0..samples).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (p, q, e) = (input(), input(), input());
        let v: Vec<f64> = p
            .iter()
            .zip(&q)
            .map(|(p, q)| (3.0 * p).tanh() * (1.0 + q * q))
            .collect();
        let linear = TransferFunction::new(vec![0.0, 0.4], vec![1.0, -0.6]).unwrap();
        let y = linear
            .simulate_from_mean(&v)
            .iter()
            .zip(&e)
            .map(|(y, e)| y + 0.01 * e)
            .collect();
        write_record(folder.path(name), &Record::new([("p", p), ("q", q), ("y", y)]).unwrap()).unwrap();
    };
    write("r.csv", 2500, 1);
    write("fresh.csv", 800, 2);
    let identify = "identify r.csv --input p,q --output y --structure joint-inputs";
    let found = folder.json(&format!("{identify} -o model.json --report page.html"));
    assert_eq!(found["structure"], "joint-inputs");
    assert!(found["fit_percent"].as_f64().unwrap() > 96.0, "{}", found["verdict"]);
    assert_eq!((&found["order"], &found["delay"]), (&1.into(), &1.into()));
    let judged = folder.json("validate model.json fresh.csv --input p,q --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 96.0, "{judged}");
    folder.done("predict model.json fresh.csv --input p,q -o predicted.csv");
    let page = folder.read("page.html");
    for expected in ["Joint nonlinearity", "plot-surface", "Along q at p = "] {
        assert!(page.contains(expected), "{expected}");
    }
    let additive = folder.json("identify r.csv --input p,q --output y --structure multiple-inputs");
    assert!(
        additive["verdict"].as_str().unwrap().contains("It does not hold: "),
        "{}",
        additive["verdict"]
    );
    folder.misused(
        "identify r.csv --input p --output y --structure joint-inputs",
        "--structure joint-inputs needs 2 to 4 inputs; name them by --input A,B, or choose another structure",
    );
}

#[test]
fn periods_distinguish_noise_from_distortion() {
    let folder = Folder::new();
    let mut rng = Pcg64::seed_from_u64(3);
    let (mut u, mut y) = (Vec::new(), Vec::new());
    for _ in 0..4 {
        let period: Vec<f64> = (0..128).map(|_| rng.random_range(-1.0..1.0)).collect();
        let part: Vec<f64> = period.iter().cycle().take(5 * 128).copied().collect();
        let v: Vec<f64> = part.iter().map(|u| u + 0.5 * u * u * u).collect();
        let linear = TransferFunction::new(vec![0.4], vec![1.0, -0.6]).unwrap();
        let clean = linear.simulate(&v);
        y.extend(clean.iter().map(|y| y + 0.001 * rng.random_range(-1.0..1.0)));
        u.extend(part);
    }
    write_record(folder.path("r.csv"), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
    let found = folder.json(&format!("{IDENTIFY} linear --realisations 4 --report page.html"));
    let best = &found["best_linear_approximation"];
    assert_eq!((&best["period"], &best["periods"]), (&128.into(), &4.into()), "{best}");
    let power = |name: &str| numbers(&best[name]).iter().map(|v| v * v).sum::<f64>();
    assert!(power("distortion") > 100.0 * power("noise"), "{}", best["text"]);
    assert!(folder.read("page.html").contains("Best linear approximation"));
    let message = folder.said(&format!("{IDENTIFY} linear --realisations 4"));
    assert!(
        message.contains(" best linear approximation: 64 lines from "),
        "{message}"
    );
    assert!(message.contains("nonlinear distortion -"), "{message}");
    folder.failed(
        &format!("{IDENTIFY} linear --realisations 4 --period 700"),
        "r.csv: --period 700 must be at least 2 and fit into the 640 samples of a realisation",
    );
}

/// The structure of CONTRIBUTING.md's recipe, which its row in the registry makes known: to the options and their help, the text, the
/// JSON, the page and the model file.
#[test]
fn a_row_in_the_registry_is_enough() {
    let folder = Folder::new();
    let write = |name: &str, seed: u64| {
        let mut rng = Pcg64::seed_from_u64(seed);
        let u: Vec<f64> = (0..800).map(|_| rng.random_range(-1.0..1.0)).collect();
        let y = (0..800_usize)
            .map(|n| n.checked_sub(3).map_or(0.0, |i| (2.0 * u[i]).tanh()) + 0.01 * rng.random_range(-1.0..1.0))
            .collect();
        write_record(folder.path(name), &Record::new([("u", u.clone()), ("y", y)]).unwrap()).unwrap();
    };
    write("r.csv", 1);
    write("fresh.csv", 2);
    assert!(
        folder.done("identify --help").contains("static:"),
        "the help lists the structure"
    );
    let message = folder.said(&format!("{IDENTIFY} static -o model.json --report page.html"));
    for line in [
        "Static model from 'u' to 'y': fit ",
        " structure a static nonlinearity of the delayed input",
        ", method smoothing-spline ",
        " delay order 0, delay 3, static gain 1.000",
        " nonlinearity smoothing spline on [",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
    let found = folder.json(&format!("{IDENTIFY} static"));
    assert_eq!((&found["structure"], &found["delay"]), (&"static".into(), &3.into()));
    assert_eq!(found["delay_scores"].as_array().unwrap().len(), 21);
    assert_eq!(found["linear"]["b"], serde_json::json!([0.0, 0.0, 0.0, 1.0]));
    assert!(found["fit_percent"].as_f64().unwrap() > 98.0, "{}", found["verdict"]);
    let page = folder.read("page.html");
    for expected in [
        "A static model (a static nonlinearity of the delayed input",
        "behind the delay",
        "delay, samples",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!(model["paths"][0]["blocks"][1]["role"], "nonlinearity");
    let judged = folder.json("validate model.json fresh.csv --input u --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 98.0, "{judged}");
    folder.misused(
        &format!("{IDENTIFY} static --order 2"),
        "--order is an option of --structure hammerstein, not of --structure static; leave it out, or choose --structure hammerstein",
    );
}
