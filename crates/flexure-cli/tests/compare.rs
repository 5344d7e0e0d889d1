//! `flexure compare`: several models on one record.

mod common;

use common::Folder;
use serde_json::Value;

/// A record, a fresh one, and models of different structures from the first.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.known("r.csv", 1200, 1);
    folder.known("fresh.csv", 600, 2);
    folder.done("identify r.csv --input u --output y -o good.json");
    folder.done("identify r.csv --input u --output y --structure linear -o linear.json");
    folder
}

#[test]
fn every_row_is_what_validate_says_of_the_model() {
    let folder = folder();
    let compared = folder.json("compare linear.json good.json fresh.csv --skip 50");
    let models = compared["models"].as_array().unwrap();
    assert_eq!(models.len(), 2);
    for (row, name) in models.iter().zip(["good.json", "linear.json"]) {
        assert_eq!(row["model"], name);
        assert_eq!(row["identified_from_this_record"], false);
        let alone = folder.json(&format!("validate {name} fresh.csv --skip 50"));
        for key in ["fit_percent", "rms", "holds", "verdict", "samples", "skipped"] {
            assert_eq!(row[key], alone[key], "{name} {key}");
        }
    }
    let text = folder.done("compare linear.json good.json fresh.csv --skip 50");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "2 models on fresh.csv: 550 samples compared, the first 50 skipped"
    );
    assert!(lines[2].starts_with("  good.json    hammerstein"), "{text}");
    assert!(
        lines[2].ends_with("  holds") && lines[3].ends_with("  does not hold"),
        "{text}"
    );
    assert!(lines[3].starts_with("  linear.json  linear"), "{text}");
    assert!(!text.contains('*'), "{text}");
}

#[test]
fn a_record_may_call_its_columns_otherwise() {
    let folder = folder();
    let text = std::fs::read_to_string(folder.path("fresh.csv")).unwrap();
    let renamed: Vec<String> = text.lines().map(str::to_owned).collect();
    let header = renamed[0].replace('u', "force").replace('y', "speed");
    folder.write("other.csv", [&[header][..], &renamed[1..]].concat().join("\n"));
    let own = folder.json("compare linear.json good.json fresh.csv");
    let other = folder.json("compare linear.json good.json other.csv --input force --output speed");
    for row in 0..2 {
        assert_eq!(own["models"][row]["rms"], other["models"][row]["rms"]);
    }
}

#[test]
fn all_models_are_judged_on_the_same_samples() {
    let folder = folder();
    let compared = folder.json("compare good.json linear.json fresh.csv");
    let skips: Vec<&Value> = compared["models"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| &m["skipped"])
        .collect();
    assert_eq!(skips[0], skips[1]);
    let alone = ["good.json", "linear.json"].map(|name| {
        folder.json(&format!("validate {name} fresh.csv"))["skipped"]
            .as_u64()
            .unwrap()
    });
    assert_eq!(compared["skipped"], *alone.iter().max().unwrap());
}

#[test]
fn a_model_is_marked_on_its_own_record_under_any_name() {
    let folder = folder();
    std::fs::copy(folder.path("r.csv"), folder.path("renamed.csv")).unwrap();
    folder.done("identify fresh.csv --input u --output y --structure linear -o other.json");
    for record in ["r.csv", "renamed.csv"] {
        let compared = folder.json(&format!("compare good.json other.json {record}"));
        for row in compared["models"].as_array().unwrap() {
            assert_eq!(row["identified_from_this_record"], row["model"] == "good.json", "{row}");
        }
        let text = folder.done(&format!("compare good.json other.json {record}"));
        assert!(text.contains("\n  good.json *  hammerstein"), "{text}");
        assert!(
            text.ends_with("\n  * was identified from this very record, so its row says little about fresh data.\n"),
            "{text}"
        );
    }
    // An experiment of several counts as well.
    folder.done("identify r.csv fresh.csv --input u --output y -o both.json");
    for record in ["r.csv", "fresh.csv"] {
        let compared = folder.json(&format!("compare both.json {record}"));
        assert_eq!(compared["models"][0]["identified_from_this_record"], true);
    }
}

#[test]
fn the_page_has_every_models_run() {
    let folder = folder();
    let text = folder.done("compare good.json linear.json fresh.csv --report page.html");
    assert!(text.ends_with("\nwrote page.html\n"), "{text}");
    let page = folder.read("page.html");
    for part in [
        "plot-prediction-0",
        "plot-prediction-1",
        "<h3>good.json</h3>",
        "<h3>linear.json</h3>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.contains("flexure compare good.json linear.json fresh.csv --report page.html"));
    // The errors have one scale, and each model its verdict.
    assert!(page.contains(r#""same_scale":true"#));
    assert_eq!(page.matches("the model explains").count(), 2);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = folder();
    folder.write("other.csv", "a,b\n1,2\n2,3\n");
    folder.failed(
        "compare good.json linear.json other.csv",
        "good.json: other.csv: no column 'u'; the columns are: a, b",
    );
    folder.failed(
        "compare good.json fresh.csv fresh.csv",
        "fresh.csv: not a model file; a command takes the model first, then the record",
    );
    // The other way round.
    folder.failed(
        "validate fresh.csv good.json",
        "fresh.csv: not a model file; a command takes the model first, then the record",
    );
    folder.write("quoted.csv", "\"u\",\"y\"\n1,2\n");
    folder.failed(
        "validate quoted.csv good.json",
        "quoted.csv: not a model file; a command takes the model first, then the record",
    );
    folder.failed(
        "validate good.json linear.json",
        "linear.json, line 1: this is a model, not a record; a command takes models first, then the record",
    );
    let outcome = folder.run("compare fresh.csv");
    assert_eq!(outcome.code, Some(2));
}
