//! From a record to a model to predictions, against twins written here.

mod common;

use common::{Folder, filter, interpolate, known, mat, numbers};
use flexure_io::{read_record, write_record};
use serde_json::Value;

#[test]
fn predict_is_interpolation_and_filtering_and_validate_agrees() {
    let folder = Folder::new();
    folder.known("record.csv", 1200, 1);
    let fresh = folder.known("fresh.csv", 400, 2);
    folder.done("identify record.csv --input u --output y --unit first-coefficient -o model.json");
    folder.done("predict model.json fresh.csv --initial-state steady -o predicted.csv");
    let predicted = read_record(folder.path("predicted.csv")).unwrap();
    assert_eq!(predicted.record.names(), ["measured", "predicted", "error"]);
    let y = predicted.record.column("predicted").unwrap();
    assert_eq!(predicted.record.column("measured").unwrap(), fresh.column("y").unwrap());
    for ((e, m), p) in predicted
        .record
        .column("error")
        .unwrap()
        .iter()
        .zip(fresh.column("y").unwrap())
        .zip(y)
    {
        assert_eq!(*e, m - p);
    }

    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    let blocks = &model["block"]["series"];
    assert_eq!(blocks.as_array().unwrap().len(), 2);
    let (x, phi) = (numbers(&blocks[0]["static"]["x"]), numbers(&blocks[0]["static"]["y"]));
    let (b, a) = (numbers(&blocks[1]["linear"]["b"]), numbers(&blocks[1]["linear"]["a"]));
    let w: Vec<f64> = fresh
        .column("u")
        .unwrap()
        .iter()
        .map(|&u| interpolate(&x, &phi, u))
        .collect();
    let twin = filter(&b, &a, &w, w[0]);
    assert_eq!(y.len(), twin.len());
    for (k, (y, twin)) in y.iter().zip(&twin).enumerate() {
        assert!((y - twin).abs() < 1e-12, "sample {k}: {y} {twin}");
    }

    for skip in [0, 37] {
        let object = folder.json(&format!(
            "validate model.json fresh.csv --skip {skip} --initial-state steady"
        ));
        let measured = &fresh.column("y").unwrap()[skip..];
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        let squares = |v: &mut dyn Iterator<Item = f64>| v.map(|e| e * e).sum::<f64>();
        let error = squares(&mut measured.iter().zip(&y[skip..]).map(|(m, p)| m - p));
        let spread = squares(&mut measured.iter().map(|m| m - mean));
        let fit = 100.0 * (1.0 - (error / spread).sqrt());
        let rms = (error / measured.len() as f64).sqrt();
        assert!(
            (object["fit_percent"].as_f64().unwrap() - fit).abs() < 1e-10,
            "{object}"
        );
        assert!((object["rms"].as_f64().unwrap() - rms).abs() < 1e-12, "{object}");
        assert_eq!(object["samples"], measured.len());
        assert!(fit > 60.0);
    }
}

/// The model's own fit is that of `validate` on the part that was kept fresh; of the other start rounding is left.
#[test]
fn the_fit_that_identify_reports_is_found_again() {
    let folder = Folder::new();
    folder.known("record.csv", 1200, 1);
    let found = folder.json("identify record.csv --input u --output y -o model.json");
    let fitted = found["samples_fitted"].as_u64().unwrap();
    let again = folder.json(&format!(
        "validate model.json record.csv --input u --output y --skip {fitted}"
    ));
    for key in ["fit_percent", "rms"] {
        let [own, other] = [&found, &again].map(|object| object[key].as_f64().unwrap());
        assert!((own - other).abs() < 1e-12 * own, "{key}: {own} {other}");
    }
    assert_eq!(found["holds"], again["holds"]);
    // The same sentences: but of samples before these the model was made.
    let verdict = |of: &Value| {
        of["verdict"]
            .as_str()
            .unwrap()
            .replace("On fresh data", "On this record")
    };
    assert_eq!(verdict(&found), verdict(&again));
}

#[test]
fn a_column_of_times_goes_along() {
    let folder = Folder::new();
    folder.write("record.csv", with_times(600));
    folder.done("identify record.csv --input u --output y -o model.json");
    folder.done("predict model.json record.csv -o predicted.parquet");
    let predicted = read_record(folder.path("predicted.parquet")).unwrap();
    assert_eq!(predicted.record.names(), ["t", "measured", "predicted", "error"]);
    assert_eq!(predicted.sample_time("t").unwrap(), 0.25);
    let model: Value = serde_json::from_str(&folder.read("model.json")).unwrap();
    assert_eq!(model["sample_time"], 0.25);
}

/// A column `t` that is the input or the output is no column of times.
#[test]
fn signals_may_be_named_t() {
    let folder = Folder::new();
    let record = known(600, 1);
    let named = |names: [&str; 2]| {
        let columns = names.into_iter().zip(["u", "y"]);
        flexure::Record::new(columns.map(|(name, column)| (name, record.column(column).unwrap().to_vec()))).unwrap()
    };
    write_record(folder.path("uy.csv"), &named(["u", "y"])).unwrap();
    let expected = folder.json("identify uy.csv --input u --output y -o uy.json");
    folder.done("predict uy.json uy.csv -o uy_predicted.csv");
    for [input, output] in [["t", "y"], ["u", "t"]] {
        write_record(folder.path("t.csv"), &named([input, output])).unwrap();
        let columns = format!("--input {input} --output {output}");
        let mut found = folder.json(&format!("identify t.csv {columns} -o model.json --report page.html"));
        assert_eq!(found["sample_time"], Value::Null);
        found["input"] = "u".into();
        found["inputs"] = serde_json::json!(["u"]);
        found["output"] = "y".into();
        assert_eq!(found, expected);
        assert!(!folder.read("page.html").contains("t (s)"));
        folder.done(&format!("predict model.json t.csv {columns} -o predicted.csv"));
        assert_eq!(folder.read("predicted.csv"), folder.read("uy_predicted.csv"));
        folder.done(&format!("validate model.json t.csv {columns}"));
        // Nor has it a sample time that could differ from the option's.
        folder.done(&format!("identify t.csv {columns} --sample-time 0.5"));
    }
}

fn with_times(samples: usize) -> String {
    let record = known(samples, 1);
    let columns = record.column("u").unwrap().iter().zip(record.column("y").unwrap());
    let rows = columns
        .enumerate()
        .map(|(k, (u, y))| format!("{:?},{u},{y}\n", k as f64 * 0.25));
    format!("t,u,y\n{}", rows.collect::<String>())
}

#[test]
fn every_format_gives_the_same_model() {
    let folder = Folder::new();
    let record = folder.known("record.csv", 600, 1);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    write_record(folder.path("record.parquet"), &record).unwrap();
    folder.write("record.mat", mat(&[("u", u), ("y", y)]));
    let rows: String = u.iter().zip(y).map(|(u, y)| format!("  {u:?}\t{y:?} \r\n")).collect();
    folder.write("record.dat", rows);
    let rows: String = u.iter().zip(y).map(|(u, y)| format!("{u:?};{y:?}\n")).collect();
    folder.write("record.txt", format!("# measured\n\"u\";\"y\"\n{rows}\n"));
    let expected = folder.json("identify record.csv --input u --output y");
    for name in ["record.parquet", "record.mat", "record.txt"] {
        assert_eq!(
            folder.json(&format!("identify {name} --input u --output y")),
            expected,
            "{name}"
        );
    }
    let outcome = folder.run("identify record.dat --input c0 --output c1 --json");
    assert_eq!(
        outcome.stderr,
        "note: record.dat: there is no header; the columns are called c0, c1\n"
    );
    let mut found: Value = serde_json::from_str(&outcome.stdout).unwrap();
    found["input"] = "u".into();
    found["inputs"] = serde_json::json!(["u"]);
    found["output"] = "y".into();
    assert_eq!(found, expected);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let folder = Folder::new();
    folder.known("record.csv", 600, 1);
    let run = |threads: &str| {
        folder.run_with(
            "identify record.csv --input u --output y --json",
            &[("RAYON_NUM_THREADS", threads)],
        )
    };
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one.code, Some(0));
    assert_eq!(one.stdout, two.stdout);
}

/// An existing output is replaced whole, and nothing else is left in the folder.
#[test]
fn outputs_are_replaced() {
    let folder = Folder::new();
    folder.known("record.csv", 600, 1);
    let command = "identify record.csv --input u --output y -o model.json --report report.html";
    folder.write("model.json", "old");
    folder.write("report.html", "old");
    let printed = folder.done(command);
    assert!(printed.contains("\nwrote model.json\nwrote report.html\n"), "{printed}");
    let first = folder.content();
    assert_eq!(
        first.keys().collect::<Vec<_>>(),
        ["model.json", "record.csv", "report.html"]
    );
    folder.done(command);
    assert!(folder.content() == first);
}
