//! `flexure regress`: the truth is found, and the results are what the help says.

mod common;
#[path = "regress/local.rs"]
mod local;
#[path = "regress/stream.rs"]
mod stream;
#[path = "regress/warnings.rs"]
mod warnings;

use common::{Folder, numbers};
use flexure::Record;
use flexure::nonlinearity::EstimatorName;
use flexure_io::{read_record, write_record};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

const REGRESS: &str = "regress r.csv --x x --y y";

fn rng() -> rand_pcg::Pcg64 {
    rand_pcg::Pcg64::seed_from_u64(11)
}

fn normal(rng: &mut rand_pcg::Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// y = sin(2 x) with noise of 0.2 on [-2, 2], and a column of weights that leaves out the rows with another law.
fn wave(samples: usize) -> Folder {
    let mut rng = rng();
    let x: Vec<f64> = (0..samples).map(|_| rng.random_range(-2.0..2.0)).collect();
    let bad = |i: usize| i.is_multiple_of(5);
    let clean: Vec<f64> = (0..samples)
        .map(|i| (2.0 * x[i]).sin() + 0.2 * normal(&mut rng))
        .collect();
    let mixed: Vec<f64> = (0..samples).map(|i| if bad(i) { 9.0 } else { clean[i] }).collect();
    let w: Vec<f64> = (0..samples).map(|i| if bad(i) { 0.0 } else { 2.0 }).collect();
    let folder = Folder::new();
    let record = Record::new([("x", x), ("y", clean), ("mixed", mixed), ("w", w)]).unwrap();
    write_record(folder.path("r.csv"), &record).unwrap();
    folder
}

/// z = a b, on a square, with little noise.
fn saddle(samples: usize) -> Folder {
    let mut rng = rng();
    let draw = |rng: &mut rand_pcg::Pcg64| -> Vec<f64> { (0..samples).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let (a, b) = (draw(&mut rng), draw(&mut rng));
    let z = a.iter().zip(&b).map(|(a, b)| a * b + 0.05 * normal(&mut rng)).collect();
    let folder = Folder::new();
    write_record(
        folder.path("s.csv"),
        &Record::new([("a", a), ("b", b), ("z", z)]).unwrap(),
    )
    .unwrap();
    folder
}

fn column(record: &Record, name: &str) -> Vec<f64> {
    record.column(name).unwrap().to_vec()
}

/// The root mean square of estimate minus truth over the inner part of the curve.
fn error(curve: &Record, truth: impl Fn(f64) -> f64) -> f64 {
    let (x, y) = (column(curve, "x"), column(curve, "y"));
    let inner: Vec<f64> = x
        .iter()
        .zip(&y)
        .filter(|(x, _)| x.abs() < 1.6)
        .map(|(x, y)| (y - truth(*x)).powi(2))
        .collect();
    (inner.iter().sum::<f64>() / inner.len() as f64).sqrt()
}

#[test]
fn every_estimator_finds_the_truth() {
    let folder = wave(1200);
    for name in EstimatorName::ALL {
        let object = folder.json(&format!("{REGRESS} --estimator {name} --band-method none -o curve.csv"));
        let curve = read_record(folder.path("curve.csv")).unwrap().record;
        assert_eq!(curve.names(), ["x", "y", "lower", "upper"], "{name}");
        let found = error(&curve, |x| (2.0 * x).sin());
        let rough = matches!(name, EstimatorName::Haar | EstimatorName::Recursive);
        assert!(found < if rough { 0.15 } else { 0.07 }, "{name}: {found}");
        // A sine does not need local bandwidths.
        let fitted = match name {
            EstimatorName::LocalBandwidth => EstimatorName::LocalLinear,
            name => name,
        };
        assert_eq!(object["estimator"], fitted.name());
        assert_eq!(object["parameter"], fitted.parameter());
        assert_eq!(numbers(&object["value"]).len(), 1);
        let r_squared = object["r_squared"].as_f64().unwrap();
        assert!((0.88..0.95).contains(&r_squared), "{name}: {r_squared}");
        let rms = object["prediction_rms"].as_f64().unwrap();
        assert!((0.18..0.25).contains(&rms), "{name}: {rms}");
    }
}

/// What scripts rely on.
#[test]
fn the_object_has_everything() {
    let folder = wave(600);
    let object = folder.json(&format!("{REGRESS} -o curve.csv --report page.html --grid 50"));
    assert_eq!(object["x"], serde_json::json!(["x"]));
    assert_eq!((object["y"].as_str(), &object["weights"]), (Some("y"), &Value::Null));
    assert_eq!(object["samples"], 600);
    assert_eq!(object["estimator"], "local-linear");
    assert_eq!(object["kernel"], "epanechnikov");
    assert_eq!(object["parameter"], "bandwidth");
    let value = numbers(&object["value"])[0];
    let (tried, scores) = (
        numbers(&object["scores"]["parameter"]),
        numbers(&object["scores"]["score"]),
    );
    let best = (0..scores.len())
        .min_by(|&i, &j| scores[i].total_cmp(&scores[j]))
        .unwrap();
    assert_eq!(tried[best], value, "the chosen value has the smallest score");
    assert_eq!(
        (object["chosen_by"].as_str(), object["scores"]["criterion"].as_str()),
        (Some("loo"), Some("leave-one-out error"))
    );
    assert_eq!(object["band"]["level"], 0.95);
    assert_eq!(object["band"]["kind"], "pointwise");
    let sd = object["residual_sd"].as_f64().unwrap();
    assert!((0.17..0.22).contains(&sd), "{sd}");
    assert_eq!(object["validation"], "leave-one-out");
    let mean_square = object["prediction_rms"].as_f64().unwrap().powi(2);
    assert!((mean_square / scores[best] - 1.0).abs() < 1e-12);
    let curve = &object["curve"];
    assert_eq!(curve["x"][0]["name"], "x");
    let (x, y) = (numbers(&curve["x"][0]["values"]), numbers(&curve["y"]));
    let (lower, upper) = (numbers(&curve["lower"]), numbers(&curve["upper"]));
    assert_eq!((x.len(), y.len(), lower.len(), upper.len()), (50, 50, 50, 50));
    assert!((0..50).all(|i| lower[i] < upper[i]));
    let covered = (0..50)
        .filter(|&i| lower[i] < (2.0 * x[i]).sin() && (2.0 * x[i]).sin() < upper[i])
        .count();
    assert!(covered >= 40, "{covered} of 50");
    assert_eq!(
        (object["out"].as_str(), object["report"].as_str()),
        (Some("curve.csv"), Some("page.html"))
    );
    assert!(
        object["warnings"].as_array().unwrap().is_empty(),
        "{}",
        object["warnings"]
    );
    // The file holds the same numbers to the last digit.
    let file = read_record(folder.path("curve.csv")).unwrap().record;
    assert_eq!(
        (column(&file, "x"), column(&file, "y"), column(&file, "upper")),
        (x, y, upper)
    );
    assert!(folder.read("page.html").starts_with("<!"));
}

#[test]
fn a_search_on_data_in_bins_says_how_far_it_is_off() {
    let folder = wave(25_000);
    let object = folder.json(&format!("{REGRESS} --kernel gaussian --band-method none"));
    let off = object["scores"]["binning_error"].as_f64().unwrap();
    assert!(off > 0.0 && off < 1e-3, "{off}");
    let message = folder.said(&format!("{REGRESS} --kernel gaussian --band-method none"));
    assert!(
        message.contains("on data in bins, which is off by at most"),
        "{message}"
    );
    let exact = folder.json(&format!("{REGRESS} --band-method none"));
    assert!(exact["scores"]["binning_error"].is_null());
}

#[test]
fn a_given_parameter_is_taken_and_a_narrower_band_is_narrower() {
    let folder = wave(600);
    let object = folder.json(&format!("{REGRESS} --bandwidth 0.3 --kernel gaussian"));
    assert_eq!(numbers(&object["value"]), [0.3]);
    assert_eq!(
        (&object["kernel"], &object["scores"]),
        (&Value::from("gaussian"), &Value::Null)
    );
    let width = |options: &str| -> f64 {
        let curve = &folder.json(&format!("{REGRESS} --bandwidth 0.3 {options}"))["curve"];
        let (lower, upper) = (numbers(&curve["lower"]), numbers(&curve["upper"]));
        upper.iter().zip(&lower).map(|(u, l)| u - l).sum()
    };
    let ordinary = width("");
    assert!(width("--band 0.8") < 0.8 * ordinary);
    assert!(width("--simultaneous") > 1.2 * ordinary);
    let object = folder.json(&format!(
        "{REGRESS} --estimator polynomial --parameter 5 --band-method none"
    ));
    assert_eq!(
        (numbers(&object["value"]), &object["parameter"]),
        (vec![5.0], &Value::from("degree"))
    );
    assert_eq!(object["validation"], "10-fold cross-validation");
    assert_eq!(object["band"], Value::Null);
    assert!(object["curve"]["lower"].as_array().unwrap().iter().all(Value::is_null));
}

#[test]
fn rows_of_weight_zero_are_not_there() {
    let folder = wave(1000);
    let with = folder.json("regress r.csv --x x --y mixed --weights w -o a.csv");
    assert_eq!(
        (with["samples"].as_u64(), with["weights"].as_str()),
        (Some(800), Some("w"))
    );
    let curve = read_record(folder.path("a.csv")).unwrap().record;
    let found = error(&curve, |x| (2.0 * x).sin());
    assert!(found < 0.07, "{found}");
    let without = folder.json("regress r.csv --x x --y mixed");
    let of = |object: &Value| object["residual_sd"].as_f64().unwrap();
    assert!(of(&without) > 10.0 * of(&with));
}

#[test]
fn two_columns_make_a_surface() {
    let folder = saddle(1500);
    let regress = "regress s.csv --x a,b --y z";
    for estimator in ["knn", "kernel", "local-linear"] {
        folder.done(&format!(
            "{regress} --estimator {estimator} --band-method none --grid 9 -o surface.csv"
        ));
        let surface = read_record(folder.path("surface.csv")).unwrap().record;
        assert_eq!(surface.names(), ["a", "b", "y", "lower", "upper"], "{estimator}");
        assert_eq!(surface.len(), 81);
        let (a, b, y) = (column(&surface, "a"), column(&surface, "b"), column(&surface, "y"));
        assert!(a[0] == a[8] && b[0] < b[8] && a[8] < a[9], "the last column is fastest");
        let worst = (0..81)
            .filter(|&i| a[i].abs() < 0.8 && b[i].abs() < 0.8)
            .map(|i| (y[i] - a[i] * b[i]).abs());
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 0.15, "{estimator}: {worst}");
    }
    folder.write("at.csv", "b,c,a\n0.5,9,0.5\n-0.5,9,0.25\n7,9,0\n");
    let object = folder.json(&format!("{regress} --at at.csv --band-method none"));
    let y: Vec<Option<f64>> = object["curve"]["y"]
        .as_array()
        .unwrap()
        .iter()
        .map(Value::as_f64)
        .collect();
    assert!(
        (y[0].unwrap() - 0.25).abs() < 0.1 && (y[1].unwrap() + 0.125).abs() < 0.1,
        "{y:?}"
    );
    assert_eq!(y[2], None, "outside the data");
    assert!(
        object["warnings"][0].as_str().unwrap().contains("--outside nearest"),
        "{object}"
    );
    let object = folder.json(&format!("{regress} --at at.csv --band-method none --outside nearest"));
    assert!(object["curve"]["y"][2].is_f64() && object["warnings"].as_array().unwrap().is_empty());
}

/// Rows in order of time whose noise is correlated: leave-one-out follows the noise.
#[test]
fn dependent_rows_are_warned_of_and_blocks_help() {
    let mut rng = rng();
    let n = 800;
    let x: Vec<f64> = (0..n).map(|i| f64::from(i) / f64::from(n)).collect();
    let mut noise = 0.0;
    let mut step = || {
        noise = 0.9 * noise + 0.1 * normal(&mut rng);
        noise
    };
    let y = x.iter().map(|x| (6.0 * x).sin() + step()).collect();
    let folder = Folder::new();
    write_record(folder.path("r.csv"), &Record::new([("x", x), ("y", y)]).unwrap()).unwrap();
    let found = |options: &str| folder.json(&format!("{REGRESS} {options}"));
    let (loo, block) = (found("--select loo"), found("--select block --band-method block"));
    let bandwidth = |object: &Value| numbers(&object["value"])[0];
    assert!(
        bandwidth(&block) > 2.0 * bandwidth(&loo),
        "{} {}",
        bandwidth(&block),
        bandwidth(&loo)
    );
    let resampled = found("--select block-bootstrap --block 40");
    assert!(
        bandwidth(&resampled) > 2.0 * bandwidth(&loo),
        "{}",
        bandwidth(&resampled)
    );
    assert_eq!(resampled["chosen_by"], "block-bootstrap");
    assert!(
        resampled["band"]["method"].as_str().unwrap().contains("blocks of 40"),
        "the band is by blocks of the same length: {}",
        resampled["band"]
    );
    let warned = |object: &Value| object["warnings"].to_string().contains("--select block");
    assert!(
        warned(&loo) && !warned(&block),
        "{} {}",
        loo["warnings"],
        block["warnings"]
    );
}

/// Blocks and block bands for the recursive estimate, which the order of the rows counts for.
#[test]
fn the_recursive_estimate_does_what_the_others_do() {
    let folder = wave(400);
    let recursive = format!("{REGRESS} --estimator recursive");
    for rule in ["loo", "gcv", "block", "bootstrap", "block-bootstrap"] {
        let object = folder.json(&format!("{recursive} --select {rule} --band-method none"));
        assert_eq!(object["chosen_by"], rule);
        assert!(
            numbers(&object["scores"]["score"]).len() > 10,
            "{rule}: {}",
            object["scores"]
        );
    }
    for method in ["bootstrap", "block"] {
        let object = folder.json(&format!("{recursive} --bandwidth 0.8 --band-method {method} --grid 21"));
        let (lower, upper) = (numbers(&object["curve"]["lower"]), numbers(&object["curve"]["upper"]));
        assert!(
            lower.iter().zip(&upper).all(|(l, u)| l < u),
            "{method}: {lower:?} {upper:?}"
        );
    }
    // A gap of no data is not bridged.
    let mut text = "x,y\n".to_owned();
    for i in 0..100 {
        let x = f64::from(i * 37 % 100) / 100.0 + if i % 2 == 0 { 0.0 } else { 9.0 };
        text += &format!("{x},{}\n", x * x);
    }
    folder.write("gap.csv", text);
    let gap = "regress gap.csv --x x --y y --estimator recursive --bandwidth 0.3 --band-method none --grid 21";
    let object = folder.json(gap);
    let unknown = object["curve"]["y"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|v| v.is_null())
        .count();
    assert!((14..=18).contains(&unknown), "{unknown}");
    let nearest = folder.json(&format!("{gap} --outside nearest"));
    assert!(nearest["curve"]["y"].as_array().unwrap().iter().all(Value::is_f64));
}

/// A score of rows that have no others in reach is not one of the curve.
#[test]
fn rows_alone_in_their_windows_are_reported() {
    let folder = wave(60);
    for estimator in ["kernel", "local-linear", "recursive"] {
        let options = format!("{REGRESS} --estimator {estimator} --band-method none");
        let object = folder.json(&format!("{options} --bandwidth 1e-9"));
        assert_eq!(object["rows_alone"], 60, "{estimator}");
        let warnings = object["warnings"].to_string();
        assert!(
            warnings.contains("no other row is within reach of 60 of the 60 rows"),
            "{warnings}"
        );
        let text = folder.said(&format!("{options} --bandwidth 1e-9"));
        assert!(
            text.contains("with 60 of 60 rows predicted by their nearest as none is within reach"),
            "{text}"
        );
        assert_eq!(folder.json(&options)["rows_alone"], 0, "{estimator}");
    }
    // The same with two columns.
    let mut text = "a,b,y\n".to_owned();
    for i in 0..100 {
        text += &format!("{},{},{}\n", i % 10, i / 10, i % 7);
    }
    folder.write("two.csv", text);
    let two = "regress two.csv --x a,b --y y --band-method none --estimator kernel";
    assert_eq!(folder.json(&format!("{two} --bandwidth 0.9"))["rows_alone"], 100);
    assert_eq!(folder.json(&format!("{two} --bandwidth 1.1,0.9"))["rows_alone"], 0);
}

/// Two rows allow no prediction of one from the other by a curve of two parameters.
#[test]
fn what_cannot_be_predicted_is_said() {
    let folder = Folder::new();
    folder.write("r.csv", "x,y\n0,1\n1,3\n");
    let options = "regress r.csv --x x --y y --estimator spline --band-method none";
    let text = folder.said(options);
    assert!(text.contains(" R squared not known (too few rows"), "{text}");
    assert!(folder.json(options)["r_squared"].is_null());
    folder.write("r.csv", "x,y\n0,1\n1,3\n2,2\n");
    let object = folder.json("regress r.csv --x x --y y");
    assert!(object["band"].is_null());
    assert_eq!(
        object["warnings"].to_string().matches("needs 5 rows or more").count(),
        1,
        "{object}"
    );
}

/// Beyond the data an estimate can be continued; its error is not known there.
#[test]
fn a_continued_estimate_has_no_band() {
    let folder = wave(400);
    folder.write("wide.csv", "x\n-9\n0\n9\n");
    let object = folder.json(&format!("{REGRESS} --at wide.csv --outside linear"));
    let warnings = object["warnings"].to_string();
    assert!(
        warnings.contains("at 2 of the 3 points of the result the band is NaN: the estimate is continued"),
        "{warnings}"
    );
}

/// The same command gives the same files, and random bands depend only on their seed.
#[test]
fn results_are_reproducible() {
    let folder = wave(300);
    let band = "--estimator spline --band-method bootstrap";
    let run = |options: &str, out: &str| {
        folder.done(&format!("{REGRESS} {band} {options} -o {out}"));
        folder.read(out)
    };
    let one = run("--seed 3", "one.csv");
    assert!(one == run("--seed 3", "two.csv"));
    assert!(one != run("--seed 4", "three.csv"));
    let with_page = run("--seed 3 --report page.html", "four.csv");
    assert!(one == with_page, "the page changes nothing");
}

/// Rows near in time are those near in x: that leaving them out widens the window tells nothing.
#[test]
fn independent_noise_along_a_trend_is_not_called_dependent() {
    for seed in 0..6 {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut text = "t,y\n".to_owned();
        for i in 0..2000 {
            let (t, e): (f64, f64) = (f64::from(i) / 2000.0, StandardNormal.sample(&mut rng));
            text += &format!("{t},{}\n", (20.0 * t).sin() + 0.1 * e);
        }
        let folder = Folder::new();
        folder.write("trend.csv", text);
        let object = folder.json("regress trend.csv --x t --y y --band-method none");
        assert_eq!(object["dependent_rows"], false, "{seed}");
    }
}
