//! `--json`: one object on one line, with what scripts rely on.

mod common;

use common::{Folder, numbers};
use serde_json::Value;

fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("{key}: {}", object[key]))
}

fn count(object: &Value, key: &str) -> u64 {
    object[key].as_u64().unwrap_or_else(|| panic!("{key}: {}", object[key]))
}

/// The residual tests. At least one of them can refute the model.
fn check_tests(object: &Value) {
    let tests = object["residual_tests"].as_array().unwrap();
    assert!(!tests.is_empty());
    for test in tests {
        assert!(test["name"].is_string() && test["refutes"].is_boolean(), "{test}");
        let passed = number(test, "statistic") <= number(test, "limit");
        assert_eq!(test["passed"], passed, "{test}");
        assert!((0.0..=1.0).contains(&number(test, "p_value")), "{test}");
    }
    assert!(tests.iter().any(|t| t["refutes"] == true));
    let refuted = tests.iter().any(|t| t["refutes"] == true && t["passed"] == false);
    let misfit = number(object, "misfit");
    assert_eq!(refuted, misfit > 0.0);
    if object["holds"] == true {
        assert!(misfit < 0.01 && number(object, "r_squared") >= 0.1);
    } else {
        assert!(refuted || number(object, "r_squared") < 0.9);
    }
    assert!(tests.iter().all(|t| (0.0..=1.0).contains(&number(t, "effect"))));
    // Seven tests share the level, and one input has all of it. The test of missed dynamics, which is made if none of them refutes, has as much as each.
    let levels: Vec<f64> = tests
        .iter()
        .filter(|t| t["refutes"] == true)
        .map(|t| number(t, "level"))
        .collect();
    assert!([7, 8].contains(&levels.len()), "{levels:?}");
    assert!(
        levels.iter().all(|level| (level - 0.01 / 7.0).abs() < 1e-12),
        "{levels:?}"
    );
}

fn check_identification(object: &Value) {
    assert_eq!(object["structure"], "hammerstein");
    let (order, delay) = (count(object, "order") as usize, count(object, "delay") as usize);
    assert!(number(object, "fit_percent") <= 100.0);
    assert!(number(object, "rms") > 0.0);
    let (x, y) = (
        numbers(&object["nonlinearity"]["x"]),
        numbers(&object["nonlinearity"]["y"]),
    );
    assert_eq!(x.len(), y.len());
    assert!(x.len() > 10 && x.windows(2).all(|w| w[0] < w[1]));
    let (b, a) = (numbers(&object["linear"]["b"]), numbers(&object["linear"]["a"]));
    assert_eq!(a[0], 1.0);
    assert!(a.len() <= order + 1 && b.len() <= order + delay + 1, "{b:?} {a:?}");
    assert!(b[..delay].iter().all(|v| *v == 0.0));
    assert!(object["warnings"].as_array().unwrap().iter().all(Value::is_string));
    check_tests(object);
}

/// What only the refined method has.
fn check_refined(object: &Value) {
    assert_eq!(
        (&object["method"], &object["refined"]),
        (&"refined".into(), &true.into())
    );
    assert_eq!(object["bandwidth"], Value::Null);
    let band = |edge: &str| numbers(&object["nonlinearity"][edge]);
    let (lower, y, upper) = (band("lower"), band("y"), band("upper"));
    assert_eq!((lower.len(), upper.len()), (y.len(), y.len()));
    assert!((0..y.len()).all(|i| lower[i] < y[i] && y[i] < upper[i]));
    for c in ["b", "a"] {
        let (values, errors) = (
            numbers(&object["linear"][c]),
            numbers(&object["linear"][&format!("{c}_errors")]),
        );
        assert_eq!(values.len(), errors.len());
        assert!(
            errors.iter().all(|e| *e >= 0.0) && errors.iter().any(|e| *e > 0.0),
            "{errors:?}"
        );
    }
    assert_eq!(object["linear"]["a_errors"][0], 0.0);
    for breakpoint in object["breakpoints"].as_array().unwrap() {
        assert!(breakpoint["at"].is_f64(), "{breakpoint}");
        assert!(["jump", "kink", "knot"].contains(&breakpoint["kind"].as_str().unwrap()));
    }
    assert_eq!(numbers(&object["noise"]["model"])[0], 1.0);
    assert!(number(&object["noise"], "deviation") > 0.0);
    let points = ["x", "value", "samples"].map(|key| numbers(&object["memory_removed"][key]));
    assert!(points.iter().all(|p| p.len() == points[0].len()));
    assert_eq!(points[2].iter().sum::<f64>(), number(object, "samples_fitted"));
}

/// What only the plain method has.
fn check_plain(object: &Value) {
    assert_eq!(object["method"], "plain");
    assert!(number(object, "bandwidth") > 0.0);
    for absent in ["refined", "breakpoints", "noise", "memory_removed", "form"] {
        assert_eq!(object[absent], Value::Null, "{absent}");
    }
    assert_eq!(object["linear"]["b_errors"], Value::Null);
}

#[test]
fn identify_predict_and_validate() {
    let folder = Folder::new();
    folder.known("record.csv", 1200, 1);
    folder.known("fresh.csv", 500, 2);
    let object = folder.json("identify record.csv --input u --output y -o model.json --report report.html");
    check_identification(&object);
    check_refined(&object);
    assert!(number(&object, "fit_percent") > 60.0, "{}", object["verdict"]);
    let plain = folder.json("identify record.csv --input u --output y --method plain");
    check_identification(&plain);
    check_plain(&plain);
    assert_eq!(count(&object, "samples_fitted") + count(&object, "samples_fresh"), 1200);
    assert!(folder.read("report.html").starts_with("<!"));

    let object = folder.json("predict model.json fresh.csv --input u -o predicted.csv");
    assert_eq!(count(&object, "samples"), 500);
    assert_eq!(object["out"], "predicted.csv");
    assert!(count(&object, "samples_outside_range") < 10);

    let object = folder.json("validate model.json fresh.csv --input u --output y --skip 50");
    assert_eq!((count(&object, "samples"), count(&object, "skipped")), (450, 50));
    assert!(number(&object, "fit_percent") > 60.0);
    assert!(number(&object, "rms") > 0.0);
    check_tests(&object);
}

#[test]
fn simulate_says_what_it_wrote() {
    let folder = Folder::new();
    let object = folder.json("simulate --preset space-arm -o record.csv --write-arm arm.toml");
    let columns = [
        "t", "tau1", "tau2", "q1", "q2", "qm1", "qm2", "dq1", "dq2", "dqm1", "dqm2",
    ];
    assert_eq!(object["columns"], serde_json::json!(columns));
    assert_eq!(object["record"], "record.csv");
    assert_eq!(object["arm"], "arm.toml");
    let text = folder.read("record.csv");
    assert_eq!(text.lines().next(), Some(&*columns.join(",")));
    assert_eq!(text.lines().count() as u64, 1 + count(&object, "samples"));
    // The arm file that was written is the preset.
    folder.done("simulate arm.toml -o again.csv");
    assert!(text == folder.read("again.csv"));
    let object = folder.json("simulate arm.toml --write-arm copy.toml");
    assert_eq!(object["samples"], Value::Null);
    assert_eq!(object["record"], Value::Null);
}

#[test]
fn the_demo_finds_both_joints_and_gives_the_same_files_each_time() {
    const FILES: [&str; 7] = [
        "arm.toml",
        "log.csv",
        "identified.toml",
        "report.html",
        "elbow.csv",
        "elbow.json",
        "elbow.html",
    ];
    let folder = Folder::new();
    let object = folder.json("demo --out one");
    let files = FILES.map(|name| format!("one/{name}"));
    assert_eq!(object["files"], serde_json::json!(files));
    assert!(files.iter().all(|file| folder.path(file).is_file()));
    let joints = &object["joints"];
    for (name, truth) in joints["truth"]["links"].as_object().unwrap() {
        let (found, truth) = (joints[name]["value"].as_f64().unwrap(), truth.as_f64().unwrap());
        assert!((found / truth - 1.0).abs() < 0.01, "{name}: {found} {truth}");
    }
    for curves in joints["truth"]["curves"].as_array().unwrap() {
        for curve in ["elastic_torque", "friction_curve"] {
            assert!(curves[curve]["distance"].as_f64().unwrap() < 0.02, "{curve}: {curves}");
        }
    }
    for fit in joints["fresh"]["fit_percent"].as_array().unwrap() {
        assert!(fit.as_f64().unwrap() > 98.0, "{fit}");
    }
    assert_eq!(object["elbow"]["holds"], false, "friction is feedback");

    let message = folder.done("demo --out two");
    assert!(message.contains("wrote two/report.html"), "{message}");
    assert!(message.ends_with("now your file: flexure look FILE\n"), "{message}");
    for name in FILES.iter().filter(|name| !name.ends_with(".html")) {
        let [one, two] = ["one", "two"].map(|run| folder.read(&format!("{run}/{name}")));
        assert!(one == two, "{name}");
    }
    let left: Vec<String> = folder.content().into_keys().filter(|n| n.contains(".tmp")).collect();
    assert!(left.is_empty(), "{left:?}");
}
