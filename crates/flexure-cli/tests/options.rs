//! The options of `identify`: each one reaches the fit.

mod common;

use common::{Folder, numbers};
use serde_json::Value;

/// The plain method, which has the most options.
const IDENTIFY: &str = "identify record.csv --input u --output y --method plain";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.known("record.csv", 1200, 1);
    folder
}

fn with(folder: &Folder, options: &str) -> Value {
    folder.json(&format!("{IDENTIFY} {options}"))
}

/// The estimate at `at`, between two of its points.
fn estimate(found: &Value, at: f64) -> f64 {
    let (x, y) = (
        numbers(&found["nonlinearity"]["x"]),
        numbers(&found["nonlinearity"]["y"]),
    );
    let i = x.iter().rposition(|&x| x <= at).unwrap();
    y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i])
}

#[test]
fn what_is_chosen_from_data_can_be_given() {
    let folder = folder();
    let chosen = with(&folder, "");
    assert_eq!(
        with(
            &folder,
            "--order auto --delay auto --bandwidth auto --lag strongest --kernel epanechnikov --unit static-gain --fresh 0.25 --structure hammerstein"
        ),
        chosen
    );
    for order in [0, 1, 4] {
        let found = with(&folder, &format!("--order {order}"));
        assert_eq!(found["order"], order);
        assert_eq!(found["order_scores"]["order"], serde_json::json!([order]));
        assert!(numbers(&found["linear"]["a"]).len() <= order + 1);
    }
    let found = with(&folder, "--delay 2 --order 2");
    assert_eq!(found["delay"], 2);
    assert_eq!(numbers(&found["linear"]["b"])[..2], [0.0, 0.0]);
    let found = with(&folder, "--bandwidth 0.3");
    assert_eq!(found["bandwidth"], 0.3);
    assert_eq!(found["bandwidth_scores"], Value::Null);
    for (lag, expected) in [("0", 0), ("1", 1), ("delay", 0)] {
        let found = with(&folder, &format!("--lag {lag} --delay 0"));
        assert_eq!(found["regression_lag"], expected, "{lag}");
    }
}

/// What was given is not said to have been chosen from data.
#[test]
fn the_page_distinguishes_given_from_chosen() {
    let folder = folder();
    let page = |options: &str| {
        folder.done(&format!("{IDENTIFY} --report page.html {options}"));
        folder.read("page.html").replace("&#x27;", "'").to_lowercase()
    };
    let first = "first lag with a significant dependence";
    let strongest = "that of the strongest dependence";
    let chosen = page("");
    assert!(chosen.contains(first) && chosen.contains(strongest));
    assert!(!chosen.contains("as given"));
    assert!(
        chosen.contains("✓ passed</span> nothing found"),
        "a verdict is said once"
    );
    let delay = page("--delay 0");
    assert!(delay.contains("the delay is as given;"));
    assert!(!delay.contains(first) && delay.contains(strongest));
    let lag = page("--lag 0");
    assert!(lag.contains("the lag of the regression is as given,"));
    assert!(lag.contains(first) && !lag.contains(strongest));
    assert!(page("--lag delay").contains("the lag of the regression is the delay,"));
    let order = page("--order 2 --bandwidth 0.3");
    assert_eq!(order.matches("as given").count(), 2); // both choices
}

#[test]
fn every_kernel() {
    let folder = folder();
    let mut curves = Vec::new();
    for kernel in [
        "uniform",
        "triangular",
        "epanechnikov",
        "biweight",
        "triweight",
        "gaussian",
    ] {
        let found = with(&folder, &format!("--kernel {kernel}"));
        assert_eq!(found["kernel"], kernel);
        assert!(
            found["fit_percent"].as_f64().unwrap() > 60.0,
            "{kernel}: {}",
            found["fit_percent"]
        );
        curves.push(found["nonlinearity"]["y"].to_string());
    }
    curves.sort();
    curves.dedup();
    assert_eq!(curves.len(), 6);
}

#[test]
fn conventions_for_the_scale() {
    let folder = folder();
    let gain = with(&folder, "");
    assert!((gain["linear"]["static_gain"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    let first = with(&folder, "--unit first-coefficient");
    let b = numbers(&first["linear"]["b"]);
    assert_eq!(b[first["delay"].as_u64().unwrap() as usize], 1.0);
    // Two points, one of them negative; the dead zone's true values there.
    let known = with(&folder, "--known -1.5=-1 1.7=1");
    assert!(
        (estimate(&known, -1.5) + 1.0).abs() < 0.02,
        "{}",
        estimate(&known, -1.5)
    );
    assert!((estimate(&known, 1.7) - 1.0).abs() < 0.02, "{}", estimate(&known, 1.7));
    // The convention moves a factor between the blocks and does not change the prediction.
    for other in [&first, &known] {
        let difference = other["fit_percent"].as_f64().unwrap() - gain["fit_percent"].as_f64().unwrap();
        assert!(difference.abs() < 0.01, "{difference}");
    }
}

#[test]
fn the_fresh_share() {
    let folder = folder();
    for (share, fresh) in [(0.1, 120), (0.5, 600)] {
        let found = with(&folder, &format!("--fresh {share}"));
        assert_eq!(found["samples_fresh"], fresh);
        assert_eq!(found["samples_fitted"], 1200 - fresh);
    }
}

#[test]
fn the_sample_time() {
    let folder = folder();
    assert_eq!(with(&folder, "")["sample_time"], Value::Null);
    assert_eq!(with(&folder, "--sample-time 0.02")["sample_time"], 0.02);
}
