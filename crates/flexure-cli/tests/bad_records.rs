//! Records that cannot be used: one clear line on the error stream, and no file written.

mod common;

use common::{Folder, known, mat};
use flexure_io::write_record;

/// The commands that read a record, with an output wherever they can write one.
const COMMANDS: [&str; 3] = [
    "identify RECORD --input u --output y -o new.json --report new.html",
    "predict model.json RECORD --input u -o new.csv",
    "validate model.json RECORD --input u --output y",
];

/// A folder with a good record and a model of it.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.known("good.csv", 600, 1);
    folder.done("identify good.csv --input u --output y -o model.json");
    folder
}

/// Every command that reads a record refuses this one with the same words.
fn all_refuse(folder: &Folder, record: &str, message: &str) {
    for command in COMMANDS {
        let command = command.replace("RECORD", record);
        // An identification also says what to type instead.
        let typed = match message.ends_with("to uniform steps") && command.starts_with("identify") {
            true => format!(
                ": flexure {command} --resample 1 --hold u (without --hold where the input changes smoothly between its samples)"
            ),
            false => String::new(),
        };
        folder.failed(&command, &format!("{message}{typed}"));
    }
}

#[test]
fn files_that_are_no_records() {
    let folder = folder();
    std::fs::create_dir(folder.path("folder.csv")).unwrap();
    for (name, content, message) in [
        (
            "text.csv",
            "u,y\n1,2\n3,abc\n",
            "text.csv, line 3: column 'y' holds 'abc' at sample 1, which is not a number (numbers look like -1.5e-3; --missing-text 'abc' takes it for a missing sample; --time-format is for time stamps)",
        ),
        (
            "ragged.csv",
            "u,y\n1,2\n3\n4,5\n",
            "ragged.csv, line 3: 1 field where there are 2 columns; every line must have one field a column: remove it if it is no sample (--skip-lines N leaves out N lines before the table, --separator says what separates the columns)",
        ),
        (
            "empty.csv",
            "",
            "empty.csv is empty; a record is a CSV file with a header, whitespace-separated columns, Parquet, MAT, HDF5 or a ROS 2 bag",
        ),
        ("header.csv", "u,y\n", "header.csv has the columns u, y but no samples"),
        (
            "text.parquet",
            "u,y\n1,2\n3,4\n5,6\n",
            "text.parquet cannot be read as Parquet: it does not begin with PAR1; give it the extension of its true format",
        ),
    ] {
        folder.write(name, content);
        if name != "text.csv" {
            all_refuse(&folder, name, message);
            continue;
        }
        // Predicting needs no output.
        folder.failed(&COMMANDS[0].replace("RECORD", name), message);
        folder.failed(&COMMANDS[2].replace("RECORD", name), message);
        let outcome = folder.run("predict model.json text.csv -o predicted.csv");
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        let note = format!(
            "note: {message}: no fit is computed, and the state at the start is not estimated from the output\n"
        );
        assert_eq!(outcome.stderr, note);
        assert!(folder.read("predicted.csv").starts_with("predicted\n"));
    }
    all_refuse(
        &folder,
        "absent.csv",
        "cannot read absent.csv: there is no such file or directory",
    );
    all_refuse(
        &folder,
        "folder.csv",
        "cannot read folder.csv: it is a directory, not a file",
    );
    all_refuse(
        &folder,
        "good.csv/record.csv",
        "cannot read good.csv/record.csv: a part of its path is not a directory",
    );
}

#[test]
fn missing_columns() {
    let folder = folder();
    folder.write("x.csv", "t,a,b\n0,1,2\n1,2,3\n");
    all_refuse(&folder, "x.csv", "x.csv: no column 'u'; the columns are: t, a, b");
    folder.failed(
        "identify good.csv --input u --output torque",
        "good.csv: no column 'torque'; the columns are: u, y, y0",
    );
    folder.failed(
        "validate model.json good.csv --input u --output torque",
        "good.csv: no column 'torque'; the columns are: u, y, y0",
    );
}

#[test]
fn samples_that_are_missing_or_not_finite() {
    let folder = folder();
    for (name, content, message) in [
        (
            "nan.csv",
            "u,y\n1,2\nnan,3\n4,5\n",
            "nan.csv, line 3: column 'u' is NaN or missing at sample 1; remove or repair that sample, or say --fill N: gaps of at most N samples are then interpolated",
        ),
        (
            "missing.csv",
            "# measured\nu,y\n1,2\n,3\n4,5\n",
            "missing.csv, line 4: column 'u' is NaN or missing at sample 1; remove or repair that sample, or say --fill N: gaps of at most N samples are then interpolated",
        ),
        (
            "infinite.csv",
            "u,y\n1,2\n2,3\n-inf,5\n",
            "infinite.csv, line 4: column 'u' is -inf at sample 2; remove or repair that sample",
        ),
    ] {
        folder.write(name, content);
        all_refuse(&folder, name, message);
    }
    // The bad value is in the output, which only some commands read. Predicting does not.
    folder.write("output.csv", "u,y\n1,2\n2,inf\n3,5\n");
    let message = "output.csv, line 3: column 'y' is inf at sample 1; remove or repair that sample";
    folder.failed(&COMMANDS[0].replace("RECORD", "output.csv"), message);
    folder.failed(&COMMANDS[2].replace("RECORD", "output.csv"), message);
    let outcome = folder.run("predict model.json output.csv -o predicted.csv");
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let note = "note: 1 of 3 samples of 'y' are missing or not finite; the fit and the state at the start are computed from the others\n";
    assert_eq!(outcome.stderr, note);
    assert!(
        folder
            .read("predicted.csv")
            .starts_with("measured,predicted,error\n2.0,")
    );
    // Missing outputs can be left out.
    folder.write("gap.csv", "u,y\n1,2\n2,nan\n3,5\n");
    let missing = "gap.csv, line 3: column 'y' is NaN or missing at sample 1; remove or repair that sample";
    for structure in ["hammerstein", "wiener"] {
        folder.failed(
            &format!("identify gap.csv --input u --output y --structure {structure}"),
            &format!("{missing}, or say --missing: samples without an output then do not count"),
        );
    }
    folder.failed("predict model.json output.csv --horizon 2 -o new.csv", message);
}

#[test]
fn sample_times_that_are_not_uniform() {
    let folder = folder();
    for (name, times, message) in [
        (
            "gap.csv",
            [0.0, 1.0, 3.0, 4.0, 5.0],
            "gap.csv, line 4: the sample times are not uniform: the step to sample 2 is 2 s, but the typical step is 1 s; --resample 1 brings the record to uniform steps",
        ),
        (
            "back.csv",
            [5.0, 4.0, 5.0, 6.0, 7.0],
            "back.csv, line 3: the sample times do not increase: the step to sample 1 is -1 s; if the clock starts again there, the samples before and after are two records: flexure prepare FILE --cut-samples :1 or 1: -o part.csv takes one of them; otherwise put the samples in order of time, one an instant",
        ),
        (
            "twice.csv",
            [0.0, 1.0, 1.0, 2.0, 3.0],
            "twice.csv, line 4: the sample times do not increase: the step to sample 2 is 0 s; flexure prepare FILE --resample S -o prepared.csv takes the mean of samples at one instant",
        ),
        (
            "unknown.csv",
            [0.0, 1.0, f64::NAN, 3.0, 4.0],
            "unknown.csv, line 4: column 't' is NaN or missing at sample 2; remove or repair that sample",
        ),
    ] {
        let rows: String = times.iter().map(|t| format!("{t},{},1\n", t * t)).collect();
        folder.write(name, format!("t,u,y\n{rows}"));
        all_refuse(&folder, name, message);
    }
}

#[test]
fn another_sample_time_than_the_models_or_the_options() {
    let folder = Folder::new();
    let rows = |step: f64| -> String {
        let record = known(600, 1);
        let columns = record.column("u").unwrap().iter().zip(record.column("y").unwrap());
        let rows = columns
            .enumerate()
            .map(|(k, (u, y))| format!("{:?},{u},{y}\n", k as f64 * step));
        format!("t,u,y\n{}", rows.collect::<String>())
    };
    folder.write("half.csv", rows(0.5));
    folder.write("slow.csv", rows(2.0));
    folder.done("identify half.csv --input u --output y -o model.json --sample-time 0.5");
    let message = "slow.csv: the sample time is 2 s, but the model was identified at 0.5 s; --resample 0.5 brings the record to that";
    folder.failed("predict model.json slow.csv --input u -o new.csv", message);
    folder.failed("validate model.json slow.csv --input u --output y", message);
    folder.failed(
        "identify slow.csv --input u --output y --sample-time 0.5 -o new.json",
        "slow.csv: column 't' has a sample time of 2 s, but --sample-time says 0.5 s; leave the option out or correct the column",
    );
}

#[test]
fn constant_signals_and_too_few_samples() {
    let folder = folder();
    let rows: String = (0..300).map(|k| format!("1.5,{}\n", (k * k) % 17)).collect();
    folder.write("still.csv", format!("u,y\n{rows}"));
    folder.failed(
        &COMMANDS[0].replace("RECORD", "still.csv"),
        "still.csv: column 'u' is constant (1.5); nothing can be identified from it",
    );
    let swapped = COMMANDS[0]
        .replace("RECORD", "still.csv")
        .replace("--input u --output y", "--input y --output u");
    folder.failed(
        &swapped,
        "still.csv: column 'u' is constant (1.5); nothing can be identified from it",
    );
    folder.write("short.csv", "u,y\n1,2\n2,3\n3,1\n4,7\n");
    folder.failed(
        &COMMANDS[0].replace("RECORD", "short.csv"),
        "short.csv: a Hammerstein fit (besides the fresh part and missing samples) needs at least 100 samples, but there are 3",
    );
    folder.failed(
        &COMMANDS[2].replace("RECORD", "still.csv"),
        "still.csv: column 'u' is constant (1.5); nothing can be identified from it",
    );
    // Constant over the samples that are compared.
    let rows: String = (0..300)
        .map(|k| format!("{},{}\n", if k < 100 { k } else { 7 }, (k * k) % 17))
        .collect();
    folder.write("stops.csv", format!("u,y\n{rows}"));
    folder.failed(
        "validate model.json stops.csv --input u --output y --skip 100",
        "stops.csv: column 'u' is constant (7); nothing can be identified from it",
    );
    folder.done("validate model.json stops.csv --input u --output y --skip 99");
    folder.write("one.csv", "t,u,y\n0,1,2\n");
    all_refuse(
        &folder,
        "one.csv",
        "one.csv: a sample time needs at least 2 samples, but there are 1",
    );
    folder.failed(
        "validate model.json short.csv --input u --output y --skip 4",
        "short.csv: --skip 4 leaves nothing of 4 samples to compare",
    );
    folder.failed(
        "validate model.json short.csv --input u --output y --skip 3",
        "short.csv: column 'y' is constant (7); nothing can be identified from it",
    );
}

#[test]
fn mat_vectors_of_unequal_lengths() {
    let folder = folder();
    folder.write("unequal.mat", mat(&[("u", &[1.0, 2.0, 3.0]), ("y", &[1.0, 2.0])]));
    all_refuse(
        &folder,
        "unequal.mat",
        "unequal.mat: 'y' has 2 samples where 3 were expected; all columns must have the same length",
    );
}

#[test]
fn truncated_and_damaged_binary_files() {
    let folder = folder();
    let record = known(40, 3);
    write_record(folder.path("whole.parquet"), &record).unwrap();
    let parquet = std::fs::read(folder.path("whole.parquet")).unwrap();
    folder.write("cut.parquet", &parquet[..parquet.len() / 2]);
    let length = parquet.len() / 2;
    all_refuse(
        &folder,
        "cut.parquet",
        &format!(
            "cut.parquet is truncated: it ends after {length} bytes without Parquet's footer; copy or save it again"
        ),
    );
    let whole = mat(&[("u", record.column("u").unwrap()), ("y", record.column("y").unwrap())]);
    folder.write("cut.mat", &whole[..300]);
    let outcome = folder.run("identify cut.mat --input u --output y");
    assert!(
        outcome
            .stderr
            .starts_with("error: cut.mat is truncated: it ends after 300 "),
        "{outcome:?}"
    );
    all_refuse(
        &folder,
        "cut.mat",
        outcome.stderr.trim_start_matches("error: ").trim_end(),
    );
}

/// The Parquet crate asserts some of what a damaged footer may violate: users see one line all the same.
#[test]
fn damaged_parquet_footers_give_one_clean_line() {
    let folder = folder();
    write_record(folder.path("whole.parquet"), &known(40, 3)).unwrap();
    let whole = std::fs::read(folder.path("whole.parquet")).unwrap();
    let mut refused = 0;
    // The footer: its length stands before the closing magic.
    let footer = u32::from_le_bytes(whole[whole.len() - 8..whole.len() - 4].try_into().unwrap()) as usize;
    for at in (whole.len() - 8 - footer..whole.len() - 8).step_by(5) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0xff;
        folder.write("damaged.parquet", &damaged);
        let outcome = folder.run("predict model.json damaged.parquet --input u -o new.csv");
        if outcome.code == Some(0) {
            std::fs::remove_file(folder.path("new.csv")).unwrap();
            continue;
        }
        assert_eq!(outcome.code, Some(1));
        assert_eq!(outcome.stderr.lines().count(), 1, "byte {at}: {}", outcome.stderr);
        assert!(
            outcome.stderr.starts_with("error: damaged.parquet"),
            "{}",
            outcome.stderr
        );
        assert!(!folder.path("new.csv").exists());
        refused += 1;
    }
    assert!(refused > 20, "{refused}");
}

/// A byte at which the Parquet crate panics: the message must be ours alone.
#[test]
fn a_panic_within_the_parquet_crate_stays_within() {
    let folder = folder();
    let fixture = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../flexure-io/tests/data/signals_none.parquet"
    );
    let mut content = std::fs::read(fixture).unwrap();
    let footer = u32::from_le_bytes(content[content.len() - 8..content.len() - 4].try_into().unwrap()) as usize;
    let at = content.len() - 8 - footer + 250;
    content[at] ^= 0xff;
    folder.write("damaged.parquet", content);
    all_refuse(
        &folder,
        "damaged.parquet",
        "damaged.parquet cannot be read as Parquet: its metadata contradict themselves; save it again",
    );
}
