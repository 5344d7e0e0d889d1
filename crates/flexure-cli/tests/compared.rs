//! `flexure identify --structure auto|linear|wiener`.

mod common;

use common::{Folder, numbers};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::{Curve, Outside};
use flexure::{Block, Record};
use flexure_io::write_record;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::Value;

const IDENTIFY: &str = "identify r.csv --input u --output y --structure";

/// Two poles of unit static gain.
fn linear() -> Block {
    Block::Linear(TransferFunction::new(vec![0.3, 0.1], vec![1.0, -1.1, 0.5]).unwrap())
}

/// The same, then a limiter.
fn wiener() -> Block {
    let limiter = Curve::new(vec![-0.6, 0.8], vec![-0.6, 0.8], Outside::Nearest).unwrap();
    Block::Series(vec![linear(), Block::Static(limiter)])
}

/// Writes a record of a system under a Gaussian input of mean 0.4, with white noise of about a hundredth of the output's size.
fn write(folder: &Folder, name: &str, system: &Block, samples: usize, seed: u64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let u: Vec<f64> = (0..samples).map(|_| 0.4 + normal()).collect();
    let y = system.simulate(&u).iter().map(|y| y + 0.005 * normal()).collect();
    write_record(folder.path(name), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
}

/// The kinds of blocks in series in a model's file.
fn kinds(model: &Value) -> Vec<&String> {
    let blocks = model["block"]["series"].as_array().unwrap();
    blocks.iter().flat_map(|b| b.as_object().unwrap().keys()).collect()
}

/// Predicts and judges a fresh record with the model; returns the words of the prediction.
fn used(folder: &Folder, system: &Block) -> String {
    write(folder, "fresh.csv", system, 800, 9);
    let judged = folder.json("validate model.json fresh.csv --input u --output y");
    assert!(judged["fit_percent"].as_f64().unwrap() > 97.0, "{judged}");
    folder.done("predict model.json fresh.csv --input u --output y --horizon 3 -o predicted.csv")
}

#[test]
fn a_wiener_model_comes_back_and_predicts() {
    let folder = Folder::new();
    write(&folder, "r.csv", &wiener(), 3000, 1);
    let found = folder.json(&format!("{IDENTIFY} wiener -o model.json --report page.html"));
    assert_eq!(found["structure"], "wiener");
    assert_eq!(found["method"], "prediction-error");
    assert_eq!(found["holds"], true, "{}", found["verdict"]);
    assert_eq!(found["start"], "the poles of the best linear model");
    let block = &found["linear"];
    for (got, want) in numbers(&block["a"]).iter().zip([1.0, -1.1, 0.5]) {
        assert!((got - want).abs() < 0.02, "{block}");
    }
    assert!((block["static_gain"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    assert!(found.get("comparison").is_none() && found.get("front").is_none());
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!((&model["structure"], kinds(&model).len()), (&"wiener".into(), 2));
    used(&folder, &wiener());
    let page = folder.read("page.html");
    for expected in [
        "A Wiener model (linear dynamics, then a static nonlinearity)",
        "intermediate signal, behind the linear part",
        "Structures that were tried",
        "front numerator</th>",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    assert!(!page.contains("back order") && !page.contains("Back linear part"));
    let message = folder.said(&format!("{IDENTIFY} wiener"));
    for line in [
        "Wiener model from 'u' to 'y': fit ",
        ", method prediction-error ",
        " linear part order 2, delay ",
        " nonlinearity cubic spline of ",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
}

#[test]
fn a_linear_model_comes_back_and_knows_no_range() {
    let folder = Folder::new();
    let system = Block::Series(vec![
        linear(),
        Block::Static(Curve::new(vec![0.0, 1.0], vec![5.0, 6.0], Outside::Linear).unwrap()),
    ]);
    write(&folder, "r.csv", &system, 2000, 2);
    let found = folder.json(&format!("{IDENTIFY} linear -o model.json --report page.html"));
    assert_eq!(found["structure"], "linear");
    assert_eq!((&found["order"], &found["nonlinearity"]), (&2.into(), &Value::Null));
    assert_eq!(found["holds"], true, "{}", found["verdict"]);
    assert!(
        (found["output_offset"].as_f64().unwrap() - 5.0).abs() < 0.01,
        "{}",
        found["output_offset"]
    );
    let message = used(&folder, &system);
    assert!(!message.contains("warning"), "{message}");
    let page = folder.read("page.html");
    assert!(
        page.contains("A linear model (linear dynamics alone) identified from"),
        "subtitle"
    );
    for absent in ["id=\"nonlinearity\"", "cubic spline of", "Structures that were tried"] {
        assert!(!page.contains(absent), "{absent}");
    }
    let message = folder.said(&format!("{IDENTIFY} linear"));
    assert!(
        message.starts_with("Linear model from 'u' to 'y': fit ") && message.contains(" output offset 5.0"),
        "{message}"
    );
    assert!(
        !message.contains("spline") && !message.contains("structures tried"),
        "{message}"
    );
}

#[test]
fn the_structure_is_named_and_the_others_are_refuted() {
    let folder = Folder::new();
    write(&folder, "r.csv", &wiener(), 2500, 3);
    let message = folder.said(&format!("{IDENTIFY} auto -o model.json --report page.html"));
    for line in [
        "Structure from 'u' to 'y': Wiener fit RMS error parameters",
        " The data support Wiener: ",
        " refuted by Wiener and ",
        " A structure is refuted by another one that predicts significantly better, or by a residual test. ",
        " Wiener model from 'u' to 'y': fit ",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
    let found = folder.json(&format!("{IDENTIFY} auto"));
    let comparison = &found["comparison"];
    assert_eq!(
        (&found["structure"], &comparison["supported"], &comparison["best"]),
        (&"wiener".into(), &true.into(), &"wiener".into())
    );
    let candidates = comparison["candidates"].as_array().unwrap();
    for c in candidates {
        let refuted = c["refuted_by"].as_array().unwrap();
        match c["structure"].as_str().unwrap() {
            "linear" | "hammerstein" => {
                assert_eq!(
                    (&refuted[0]["by"], &refuted[0]["better"]),
                    (&"comparison".into(), &"wiener".into())
                );
                assert!(refuted[0]["squared_error_ratio"].as_f64().unwrap() > 1.02);
                let tests = refuted.iter().filter(|r| r["by"] == "test").count();
                assert!(message.contains(&format!("refuted by Wiener and {tests} test")), "{c}");
            }
            _ => assert!(refuted.is_empty(), "{c}"),
        }
    }
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!(&model["identification"]["comparison"], comparison);
    used(&folder, &wiener());
    let page = folder.read("page.html");
    for expected in [
        "The data support Wiener",
        "Structures that were compared",
        "Structures that were tried",
        "Wiener, whose squared error is",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
}

#[test]
fn a_hammerstein_system_gets_the_refined_model() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 5);
    let found = folder.json(&format!("{IDENTIFY} auto -o model.json"));
    let comparison = &found["comparison"];
    assert_eq!(
        (&comparison["supported"], &comparison["best"]),
        (&true.into(), &"hammerstein".into()),
        "{}",
        comparison["reasons"]
    );
    let alone = folder.json(&format!("{IDENTIFY} hammerstein -o alone.json"));
    assert_eq!(
        (&found["method"], &found["linear"]),
        (&"refined".into(), &alone["linear"])
    );
    let block = |name: &str| -> Value { serde_json::from_str::<Value>(&folder.read(name)).unwrap()["block"].take() };
    assert_eq!(block("model.json"), block("alone.json"));
}

/// A system whose gain doubles over the record.
#[test]
fn none_of_these_is_a_verdict() {
    let folder = Folder::new();
    let mut rng = Pcg64::seed_from_u64(3);
    let u: Vec<f64> = (0..2000).map(|_| rng.random_range(-1.7..1.7)).collect();
    let mut x = 0.0;
    let y: Vec<f64> = u
        .iter()
        .enumerate()
        .map(|(k, u)| {
            x = 0.7 * x + u.clamp(-0.7, 1.0);
            (1.0 + k as f64 / 2000.0) * x + 0.02 * rng.random_range(-1.0..1.0)
        })
        .collect();
    write_record(folder.path("r.csv"), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
    let message = folder.said(&format!("{IDENTIFY} auto -o model.json --report page.html"));
    for line in [
        "Structure from 'u' to 'y': none of these; ",
        "none predicts significantly better than Hammerstein, fit ",
        " The data support none of these structures: ",
        "Its error looks like",
        "a drift in time (",
        " model is an approximation under inputs like this one",
    ] {
        assert!(message.contains(line), "{line}: {message}");
    }
    assert!(!message.contains("next:"), "{message}");
    let page = folder.read("page.html");
    assert!(page.contains("None of these structures holds; "));
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    let comparison = &model["identification"]["comparison"];
    assert_eq!(
        (&comparison["supported"], &comparison["best"]),
        (&false.into(), &model["structure"])
    );
    assert_eq!(comparison["looks_like"][0]["kind"], "drift", "{comparison}");
    folder.json("validate model.json r.csv --input u --output y");
}
