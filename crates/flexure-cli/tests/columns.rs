//! The columns that a system connects: named, those of the model, or the only two that there are.

mod common;

use common::{Folder, known};
use serde_json::Value;

/// A record of a known system as text, with these names.
fn text(header: &str, columns: &[&str], samples: usize) -> String {
    let record = known(samples, 1);
    let row = |k: usize| {
        let field = |name: &&str| match *name {
            "t" => format!("{}", k as f64 * 0.25),
            "k" => format!("{k}"),
            name => record.column(name).unwrap()[k].to_string(),
        };
        columns.iter().map(field).collect::<Vec<_>>().join(",") + "\n"
    };
    format!("{header}\n{}", (0..samples).map(row).collect::<String>())
}

/// Identifies, and returns the input, the output and the note on the error stream.
fn identified(folder: &Folder, arguments: &str) -> (Value, Value, String) {
    let outcome = folder.run(&format!("identify {arguments} --json"));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let object: Value = serde_json::from_str(&outcome.stdout).unwrap();
    (object["input"].clone(), object["output"].clone(), outcome.stderr)
}

#[test]
fn a_record_with_two_signals_needs_no_names() {
    let folder = Folder::new();
    folder.write("two.csv", text("volts,speed", &["u", "y"], 600));
    let note = "note: two.csv: the input is 'volts', the output 'speed'; the file has no other signals (--input and --output swap them)\n";
    assert_eq!(
        identified(&folder, "two.csv"),
        ("volts".into(), "speed".into(), note.to_owned())
    );
    // One that is named leaves the other.
    let (input, output, _) = identified(&folder, "two.csv --input speed");
    assert_eq!((input, output), ("speed".into(), "volts".into()));
    let (input, output, _) = identified(&folder, "two.csv --output volts");
    assert_eq!((input, output), ("speed".into(), "volts".into()));
    // Neither instants nor a count of the rows is a signal; y is the output in any column.
    folder.write("pandas.csv", text(",time [s],y,u", &["k", "t", "y", "u"], 600));
    let (input, output, notes) = identified(&folder, "pandas.csv");
    assert_eq!((input, output), ("u".into(), "y".into()));
    assert!(notes.starts_with("note: pandas.csv: column 1 has no name; it is called index\nnote: pandas.csv: the input is 'u', the output 'y'"), "{notes}");
}

#[test]
fn more_signals_are_listed() {
    let folder = Folder::new();
    folder.write("three.csv", text("t,u [V],y [rad/s],y0", &["t", "u", "y", "y0"], 600));
    let list = "three.csv: the signals are u [V], y [rad/s], y0; ";
    folder.misused(
        "identify three.csv",
        &format!("{list}name the input by --input and the output by --output"),
    );
    folder.misused(
        "identify three.csv --input u",
        &format!("{list}name the output by --output"),
    );
    folder.misused(
        "identify three.csv --output y",
        &format!("{list}name the input by --input"),
    );
    folder.write("one.csv", text("t,u", &["t", "u"], 600));
    folder.failed(
        "identify one.csv",
        "one.csv: the only signal is u, but a system has an input and an output; if a column of instants or counts is one of them, name both by --input and --output",
    );
    // A name may have the unit behind it that the header has.
    let (input, output, note) = identified(&folder, "three.csv --input u --output y");
    assert_eq!((input, output, &*note), ("u".into(), "y".into(), ""));
    let mut command = folder.command("identify three.csv --json");
    let with_units = common::outcome(command.args(["--input", "u [V]", "--output", "y [rad/s]"]));
    let object: Value = serde_json::from_str(&with_units.stdout).unwrap();
    assert_eq!((&object["input"], &object["output"]), (&"u".into(), &"y".into()));
}

#[test]
fn a_model_knows_its_columns() {
    let folder = Folder::new();
    folder.write("r.csv", text("volts,speed", &["u", "y"], 600));
    folder.done("identify r.csv --input volts --output speed -o model.json");
    let named = folder.json("validate model.json r.csv --input volts --output speed");
    assert_eq!(folder.json("validate model.json r.csv"), named);
    let predicted = folder.json("predict model.json r.csv -o p.csv");
    assert_eq!(predicted["initial_state"], "estimate");
    assert!(predicted["fit_percent"].as_f64().unwrap() > 60.0);
    // Only the input: no fit, and nothing measured.
    folder.write("input.csv", text("volts", &["u"], 600));
    let alone = folder.json("predict model.json input.csv -o p.csv");
    assert_eq!(
        (&alone["fit_percent"], &alone["initial_state"]),
        (&Value::Null, &"steady".into())
    );
    assert!(folder.read("p.csv").starts_with("predicted\n"));
    folder.misused(
        "predict model.json input.csv --horizon 2 -o new.csv",
        "--horizon needs the measured output, and input.csv has no column 'speed', as the model calls it; name it by --output",
    );
    folder.misused(
        "predict model.json input.csv --initial-state estimate -o new.csv",
        "--initial-state estimate needs the measured output, and input.csv has no column 'speed', as the model calls it; name it by --output",
    );
    folder.failed(
        "validate model.json input.csv",
        "input.csv: no column 'speed'; the columns are: volts",
    );
}

/// A record with two lines before the table, semicolons, decimal commas and outputs that are missing.
fn as_logged(samples: usize, seed: u64) -> String {
    let record = known(samples, seed);
    let row = |k: usize| {
        let field = |name: &str| record.column(name).unwrap()[k].to_string().replace('.', ",");
        let y = if k % 50 == 7 { String::new() } else { field("y") };
        format!("{};{y}\n", field("u"))
    };
    format!(
        "logger 7\nstarted at noon\nu;y\n{}",
        (0..samples).map(row).collect::<String>()
    )
}

#[test]
fn a_model_says_how_records_like_its_own_are_read() {
    let folder = Folder::new();
    folder.write("log.csv", as_logged(900, 1));
    folder.write("later.csv", as_logged(400, 2));
    let options = "--decimal comma --skip-lines 2 --missing";
    folder.done(&format!(
        "identify log.csv --input u --output y {options} -o model.json"
    ));
    let note = format!("note: later.csv is read with the options of the model's log: {options}\n");
    for command in ["validate model.json later.csv", "compare model.json later.csv"] {
        let as_kept = folder.run(command);
        assert_eq!((as_kept.code, &as_kept.stderr), (Some(0), &note), "{command}");
        assert_eq!(as_kept.stdout, folder.done(&format!("{command} {options}")));
    }
    let page = folder.run("report model.json later.csv -o page.html");
    assert_eq!((page.code, page.stderr), (Some(0), note));
    // What is given counts: the header is not on the first line.
    let other = folder.run("validate model.json later.csv --skip-lines 1");
    assert_eq!(other.code, Some(1));
    assert!(other.stderr.contains("--decimal comma --missing\n"), "{other:?}");
    // Nothing is kept of a record that needed nothing, and a topic is none of a text file.
    let plain = folder
        .read("model.json")
        .replace("\"skip-lines\"", "\"topic\"")
        .replace("\"2\"", "\"/x\"");
    folder.write("topic.json", plain);
    folder.write("plain.csv", text("u,y", &["u", "y"], 300));
    let outcome = folder.run("validate topic.json plain.csv --decimal point");
    assert_eq!(
        outcome.stderr,
        "note: plain.csv is read with the options of the model's log: --missing\n"
    );
    folder.known("r.csv", 900, 1);
    folder.done("identify r.csv --input u --output y -o tidy.json");
    assert!(!folder.read("tidy.json").contains("\"reading\"") && !folder.read("tidy.json").contains("\"missing\""));
    folder.done("validate tidy.json r.csv");
}

/// A later log may have no lines before its table.
#[test]
fn lines_before_the_table_are_skipped_only_where_there_are_any() {
    let folder = Folder::new();
    let table = |seed: u64| {
        let record = known(600, seed);
        let field = |name: &str, k: usize| record.column(name).unwrap()[k];
        let rows = (0..600).map(|k| format!("{};{}\n", field("u", k), field("y", k)));
        format!("\"u [V]\";y\n{}", rows.collect::<String>())
    };
    folder.write("log.csv", format!("logger 7\nstarted at noon\n{}", table(1)));
    folder.write("tidy.csv", table(2));
    folder.done("identify log.csv --input u --output y --skip-lines 2 -o model.json");
    let tidy = folder.json("validate model.json tidy.csv");
    assert_eq!(tidy["holds"], true);
    assert_eq!(folder.json("validate model.json tidy.csv --skip-lines 0"), tidy);
    // Another log that does not read in that way lacks the model's columns in the first place.
    let rows = text("drive,stage", &["u", "y"], 300).replace('\n', ",open\n");
    folder.write("other.csv", rows);
    for command in ["validate model.json other.csv", "compare model.json other.csv"] {
        let refused = folder.run(command).stderr;
        assert!(
            refused.ends_with("error: other.csv: no column 'u'; the columns are: drive, stage\n"),
            "{refused}"
        );
    }
}
