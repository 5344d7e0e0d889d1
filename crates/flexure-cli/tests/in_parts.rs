//! `flexure identify --stream`: sums over the parts of a record in place of its samples.

mod common;

use common::{Folder, known};
use flexure::Record;
use flexure_io::{read_model, write_record};
use serde_json::Value;

/// Two runs of shards in two row groups, with a column of instants that is not the first.
const SAMPLES: usize = (1 << 20) + (1 << 18) + 777;
const STREAM: &str = "identify r.parquet --input u --output y --stream";
/// What is kept for the verdict of a record in parts: a quarter of its last million samples.
const KEPT: usize = 250_000;

/// A log with instants.
fn long(folder: &Folder) -> Record {
    let record = known(SAMPLES, 3);
    let mut columns: Vec<(String, Vec<f64>)> = record.columns().map(|(n, c)| (n.to_owned(), c.to_vec())).collect();
    columns.push(("t [s]".to_owned(), (0..SAMPLES).map(|i| i as f64 / 256.0).collect()));
    let record = Record::new(columns).unwrap();
    write_record(folder.path("r.parquet"), &record).unwrap();
    record
}

/// The coefficients of the linear part, with their standard errors.
fn coefficients(found: &Value) -> Vec<[f64; 2]> {
    let linear = &found["linear"];
    let numbers = |name: &str| common::numbers(&linear[name]);
    let pairs = |name: &str| {
        let errors = numbers(&format!("{name}_errors"));
        numbers(name)
            .into_iter()
            .zip(errors)
            .map(|(value, error)| [value, error])
            .collect::<Vec<_>>()
    };
    [pairs("b"), pairs("a")].concat()
}

#[test]
fn parts_have_the_result_of_the_record_in_memory() {
    let folder = Folder::new();
    long(&folder);
    let found = folder.json(&format!("{STREAM} -o parts.json --report page.html"));
    assert_eq!(found["samples_fitted"], SAMPLES - KEPT);
    assert_eq!(found["samples_fresh"], KEPT);
    assert_eq!(found["sample_time"], 1.0 / 256.0);
    assert_eq!(found["holds"], true, "{}", found["verdict"]);
    // The same samples fitted in memory.
    let fresh = KEPT as f64 / SAMPLES as f64;
    let whole = folder.json(&format!(
        "identify r.parquet --input u --output y --fresh {fresh} -o whole.json"
    ));
    assert_eq!(whole["samples_fitted"], SAMPLES - KEPT);
    for ([part, error], [whole, own]) in coefficients(&found).into_iter().zip(coefficients(&whole)) {
        assert!((part - whole).abs() <= 0.3 * own, "{part} {whole} {own}");
        assert!((error / own - 1.0).abs() < 0.05 || error == own, "{error} {own}");
    }
    // The model knows its record.
    let [parts, whole] =
        ["parts", "whole"].map(|name| read_model(folder.path(&format!("{name}.json"))).unwrap().records);
    assert_eq!(parts, whole);
    // One thread, and memory for one part at a time: the same bytes.
    let alone = folder.run_with(
        &format!("{STREAM} --memory 256MiB -o alone.json"),
        &[("RAYON_NUM_THREADS", "1")],
    );
    assert_eq!(alone.code, Some(0), "{alone:?}");
    assert!(
        alone
            .stdout
            .contains(" fitted, read in parts; order, delay and breakpoints from 1,"),
        "{alone:?}"
    );
    let bytes = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(bytes("parts.json") == bytes("alone.json"));
}

#[test]
fn flaws_are_named_with_their_place() {
    let folder = Folder::new();
    let record = known(150_000, 3);
    let [u, y] = ["u", "y"].map(|name| record.column(name).unwrap());
    let write = |change: &dyn Fn(&mut [Vec<f64>; 3])| {
        let t = (0..u.len()).map(|i| i as f64 / 256.0).collect();
        let mut columns = [u.to_vec(), y.to_vec(), t];
        change(&mut columns);
        let [u, y, t] = columns;
        write_record(
            folder.path("r.parquet"),
            &Record::new([("u", u), ("y", y), ("t", t)]).unwrap(),
        )
        .unwrap();
    };
    write(&|[_, y, _]| y[123_456] = f64::NAN);
    folder.failed(
        STREAM,
        "r.parquet: column 'y' is NaN or missing at sample 123456; remove or repair that sample",
    );
    write(&|[.., t]| t[100_000..].iter_mut().for_each(|t| *t += 0.1));
    let outcome = folder.run(STREAM);
    assert!(
        outcome.code == Some(1)
            && outcome
                .stderr
                .contains("not uniform: the step to sample 100000 is 0.1039"),
        "{outcome:?}"
    );
    // Between two batches of a part.
    write(&|[.., t]| t[1 << 16..].iter_mut().for_each(|t| *t -= 1.0));
    let outcome = folder.run(STREAM);
    assert!(
        outcome.code == Some(1)
            && outcome
                .stderr
                .contains("do not increase: the step to sample 65536 is -0.99609375 s"),
        "{outcome:?}"
    );
}

#[test]
fn what_parts_cannot_do_is_refused_in_words() {
    let folder = Folder::new();
    write_record(folder.path("r.parquet"), &known(3000, 3)).unwrap();
    write_record(folder.path("r.csv"), &known(3000, 3)).unwrap();
    for (arguments, message) in [
        ("r.parquet --stream r.csv", "--stream is for one record"),
        (
            "r.parquet --stream --structure wiener",
            "--stream is for --structure hammerstein",
        ),
        ("r.parquet --stream --form dead-zone", "--stream cannot fit a --form"),
        ("r.parquet --stream --method plain", "--stream is for --method refined"),
        ("r.parquet --stream --period 100", "--stream cannot look for periods"),
        (
            "r.parquet --stream --fill 3",
            "--stream cannot prepare the record; use flexure prepare before",
        ),
        (
            "r.parquet --stream --decimal point",
            "--stream reads Parquet files as they are; leave out --decimal",
        ),
        (
            "r.parquet --stream --memory 1MiB",
            "--memory: --stream takes 224MiB or more",
        ),
        (
            "r.csv --stream",
            "--stream reads Parquet files; flexure prepare RECORD -o RECORD.parquet makes one of what fits into memory",
        ),
    ] {
        folder.misused(&format!("identify {arguments} --input u --output y"), message);
    }
    folder.failed(
        "identify r.parquet --input u --output z --stream",
        "r.parquet: no column 'z'; the columns are: u, y, y0",
    );
    folder.failed(
        "identify r.parquet --input u --output y --memory 1KiB",
        "r.parquet: a column that is unpacked takes more memory than the limit of 1 KiB; --memory SIZE (such as 8GiB) allows more, and \
         --stream reads it in parts",
    );
    // A short record is one excerpt.
    let found = folder.json("identify r.parquet --input u --output y --stream");
    assert_eq!(
        (&found["samples_fitted"], &found["holds"]),
        (&2250.into(), &true.into())
    );
}
