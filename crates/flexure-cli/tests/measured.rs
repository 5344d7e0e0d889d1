//! Measured benchmark records, where they are at hand: does Flexure say how far a Hammerstein model holds?
//!
//! They are looked for in `$FLEXURE_DATA`, otherwise in `../shared/data` next to the repository.

mod common;

use std::path::PathBuf;

use common::Folder;
use serde_json::Value;

const METHODS: [&str; 2] = ["refined", "plain"];

fn measured(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let path = std::env::var_os("FLEXURE_DATA")
        .map_or_else(beside, PathBuf::from)
        .join(name);
    if !path.is_file() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Identifies by a method, prints the figures, and checks that the report renders.
fn identify(name: &str, columns: [&str; 2], method: &str) -> Option<Value> {
    let path = measured(name)?;
    let folder = Folder::new();
    std::fs::copy(path, folder.path(name)).unwrap();
    let [input, output] = columns;
    let outcome = folder.run(&format!(
        "identify {name} --input {input} --output {output} --method {method} -o model.json --report report.html --json"
    ));
    // A record without a header is read with a note.
    let notes = outcome.stderr.lines().all(|line| line.starts_with("note: "));
    assert!(outcome.code == Some(0) && notes, "{name}: {outcome:?}");
    let found: Value = serde_json::from_str(&outcome.stdout).unwrap();
    println!(
        "{name}, {method}: fit {:.2} %, order {}, delay {}\n  {}",
        found["fit_percent"].as_f64().unwrap(),
        found["order"],
        found["delay"],
        found["verdict"].as_str().unwrap()
    );
    for warning in found["warnings"].as_array().unwrap() {
        println!("  warning: {}", warning.as_str().unwrap());
    }
    let page = folder.read("report.html");
    assert!(page.starts_with("<!") && page.trim_end().ends_with("</html>"), "{name}");
    Some(found)
}

/// Published linear models of the dryer (an electrically heated duct) leave about a tenth of the output's spread, and its input has
/// two levels, so that a Hammerstein model cannot be told from a linear one: that must be said.
#[test]
fn the_dryer() {
    for method in METHODS {
        let Some(found) = identify("daisy-dryer.dat", ["c0", "c1"], method) else {
            return;
        };
        assert!(found["fit_percent"].as_f64().unwrap() > 85.0, "{found}");
        assert_eq!(found["delay"], 3);
        assert!(
            found["warnings"].to_string().contains("only 2 levels"),
            "{}",
            found["warnings"]
        );
    }
}

/// A flexible arm rings for longer than this short record resolves: the model must not be said to hold.
#[test]
fn the_robot_arm() {
    if let Some(found) = identify("daisy-robot-arm.dat", ["c0", "c1"], "plain") {
        assert_eq!(found["holds"], false);
        let verdict = found["verdict"].as_str().unwrap();
        assert!(verdict.contains("does not hold: "), "{verdict}");
        assert!(
            found["warnings"].to_string().contains("has not settled"),
            "{}",
            found["warnings"]
        );
    }
}

/// A Wiener-Hammerstein circuit: a Hammerstein model comes nearer than the best linear one (43.4 mV), and is refuted.
#[test]
fn the_wiener_hammerstein_circuit() {
    let columns = match measured("wiener-hammerstein-2009-estimation.csv") {
        None => return,
        Some(path) => flexure_io::read_record(path).unwrap().record.names().to_vec(),
    };
    for method in METHODS {
        let Some(found) = identify(
            "wiener-hammerstein-2009-estimation.csv",
            [&columns[0], &columns[1]],
            method,
        ) else {
            return;
        };
        assert!(found["rms"].as_f64().unwrap() < 0.0434, "{}", found["rms"]);
        assert_eq!(found["holds"], false);
        let tests = found["residual_tests"].as_array().unwrap();
        let verdict = found["verdict"].as_str().unwrap();
        let mut failed = tests.iter().filter(|t| t["refutes"] == true && t["passed"] == false);
        assert!(
            failed.any(|t| verdict.contains(t["name"].as_str().unwrap())),
            "{verdict}"
        );
    }
}

/// The structure that the circuit has. Published on its test part, with 100,000 samples for the fit: 43.4 mV linear, 0.28 mV the best
/// block-structured model.
#[test]
fn the_circuit_in_its_own_structure() {
    let Some(path) = measured("wiener-hammerstein-2009-estimation.csv") else {
        return;
    };
    let folder = Folder::new();
    // The first samples are enough.
    let text = std::fs::read_to_string(path).unwrap();
    folder.write("r.csv", text.lines().take(16_001).collect::<Vec<_>>().join("\n"));
    let found =
        folder.json("identify r.csv --input u --output y --structure wiener-hammerstein -o m.json --report r.html");
    let error = found["rms"].as_f64().unwrap();
    println!("{:.4} mV, {} poles", 1e3 * error, found["order"]);
    assert!(error < 0.26e-3, "{error}");
    assert_eq!(
        (&found["front"]["order"], &found["back"]["order"]),
        (&3.into(), &3.into())
    );
    let again = folder.json("validate m.json r.csv --input u --output y --skip 12000");
    let difference = again["rms"].as_f64().unwrap() / error - 1.0;
    assert!(difference.abs() < 1e-6, "{difference}");
}
