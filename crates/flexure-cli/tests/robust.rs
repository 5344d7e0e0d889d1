//! `--robust`: outliers are named, and left out where that is asked for.

mod common;

use common::{Folder, numbers};

/// Seven samples of y far away, of the record of 2000 samples that most tests use.
const AT: [usize; 7] = [100, 333, 600, 601, 950, 1200, 1490];

fn spoiled(folder: &Folder) {
    let record = common::known(2000, 3);
    let mut y = record.column("y").unwrap().to_vec();
    for (k, at) in AT.iter().enumerate() {
        y[*at] += if k % 2 == 0 { 60.0 } else { -40.0 };
    }
    let rows = record.column("u").unwrap().iter().zip(&y);
    let rows: String = rows.map(|(u, y)| format!("{u},{y}\n")).collect();
    folder.write("spoiled.csv", format!("u,y\n{rows}"));
}

#[test]
fn an_identification_names_outliers_and_robust_leaves_them_out() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 3);
    spoiled(&folder);
    let fit = |object: &serde_json::Value| object["fit_percent"].as_f64().unwrap();
    let clean = folder.json("identify r.csv --input u --output y");
    assert!(clean.get("outliers").is_none());
    let plain = folder.json("identify spoiled.csv --input u --output y");
    assert_eq!(numbers(&plain["outliers"]), AT.map(|at| at as f64));
    assert!(
        plain["warnings"].to_string().contains("7 outliers"),
        "{}",
        plain["warnings"]
    );
    let robust = folder.json("identify spoiled.csv --input u --output y --robust");
    assert_eq!(numbers(&robust["outliers"]), AT.map(|at| at as f64));
    assert!(fit(&robust) > fit(&clean) - 0.5, "{} {}", fit(&robust), fit(&clean));
    assert!(fit(&plain) < fit(&clean) - 5.0, "{} {}", fit(&plain), fit(&clean));
}

/// Outliers that carry most of the squared error hide all else from the tests: no model holds by them.
#[test]
fn a_verdict_is_not_hidden_by_outliers() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 3);
    spoiled(&folder);
    folder.done("identify r.csv --input u --output y -o clean.json");
    folder.done("identify spoiled.csv --input u --output y --robust -o robust.json");
    let clean = folder.json("validate clean.json r.csv");
    assert_eq!(numbers(&clean["outliers"]), [0.0; 0]);
    // A single one of 2000, as a sensor that fails once writes it.
    let text = folder.read("r.csv");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let fields: Vec<&str> = lines[778].split(',').collect();
    lines[778] = format!("{},9999,{}", fields[0], fields[2]);
    folder.write("failed.csv", lines.join("\n"));
    let said = folder.said("validate clean.json failed.csv --report hidden.html");
    assert!(
        said.contains("hidden by outliers") && !said.contains("holds on"),
        "{said}"
    );
    assert!(
        said.contains("Whether it holds is not known: 1 sample far from all others carries"),
        "{said}"
    );
    assert!(said.contains("sample 777 (line 779)"), "{said}");
    assert!(
        folder
            .read("hidden.html")
            .contains("Outliers hide whether the model holds")
    );
    let object = folder.json("validate clean.json failed.csv");
    assert_eq!(object["holds"].as_bool(), Some(false));
    // Left out, they are as if they had not been; a model that was identified so is judged so.
    for (command, noted) in [
        ("validate clean.json failed.csv --robust --json", false),
        ("validate robust.json failed.csv --json", true),
    ] {
        let outcome = folder.run(command);
        assert_eq!(
            outcome.stderr.contains("with the options of the model's log: --robust"),
            noted,
            "{outcome:?}"
        );
        let object: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert_eq!(numbers(&object["outliers"]), [777.0], "{command}");
        assert_eq!(object["holds"].as_bool(), Some(true), "{command}: {object}");
    }
    let robust = folder.json("validate clean.json failed.csv --robust");
    let distance = robust["fit_percent"].as_f64().unwrap() - clean["fit_percent"].as_f64().unwrap();
    assert!(distance.abs() < 0.1, "{distance}");
}

#[test]
fn a_regression_names_outliers_and_robust_leaves_them_out() {
    const FAR: [usize; 3] = [60, 200, 317];
    let folder = Folder::new();
    let value = |i: usize| {
        let x = i as f64 / 400.0;
        let noise = (43_758.5 * (12.9898 * i as f64).sin()).rem_euclid(1.0) - 0.5;
        let far = if FAR.contains(&i) { 25.0 } else { 0.0 };
        (x, (4.0 * x).sin() + 0.2 * noise + far)
    };
    let rows: String = (0..400).map(value).map(|(x, y)| format!("{x},{y}\n")).collect();
    folder.write("r.csv", format!("x,y\n{rows}"));
    let error = |object: &serde_json::Value| -> f64 {
        let (x, y) = (
            numbers(&object["curve"]["x"][0]["values"]),
            numbers(&object["curve"]["y"]),
        );
        let squares = x.iter().zip(&y).map(|(x, y)| ((4.0 * x).sin() - y).powi(2));
        (squares.sum::<f64>() / x.len() as f64).sqrt()
    };
    let plain = folder.json("regress r.csv --x x --y y");
    let robust = folder.json("regress r.csv --x x --y y --robust");
    assert_eq!(
        (
            plain["outliers_left_out"].as_bool(),
            robust["outliers_left_out"].as_bool()
        ),
        (Some(false), Some(true))
    );
    assert_eq!(numbers(&robust["outliers"]), FAR.map(|row| row as f64));
    assert!(
        error(&robust) < 0.03 && error(&plain) > 0.1,
        "{} {}",
        error(&robust),
        error(&plain)
    );
}
