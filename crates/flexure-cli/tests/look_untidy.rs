//! `flexure look` on untidy logs: the command that it suggests mends them, and runs as printed.

mod common;

use common::{Folder, next, typed};

/// A number that stands for a missing sample hides all dependences: the second look takes it for one, and its command can be typed.
#[test]
fn a_number_for_missing_samples_is_seen() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 600, 3);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let row = |k: usize, code: &str| {
        let y = if k % 35 == 9 { code.to_owned() } else { y[k].to_string() };
        format!("{},{},{y}\n", 0.01 * k as f64, u[k])
    };
    for code in ["-7999", "-9999"] {
        let rows: String = (0..600).map(|k| row(k, code)).collect();
        folder.write("s.csv", format!("t,u,y\n{rows}"));
        let looked = folder.done("look s.csv");
        let next = format!("next: flexure look s.csv --missing-text {code}\n");
        assert!(looked.contains(&next), "{looked}");
    }
    let again = folder.done("look s.csv --missing-text -9999");
    let next = "identify s.csv --input u --output y --structure auto --missing --missing-text -9999 -o model.json --report report.html";
    assert!(
        again.contains("--missing") && again.contains("--missing-text -9999"),
        "{again}"
    );
    folder.done(next);
}

/// Rows that are there twice are resampled away; the longest part without them would be a third of the log.
#[test]
fn rows_that_are_there_twice_cost_no_others() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 600, 4);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let row = |k: usize| format!("{},{},{}\n", 0.01 * k as f64, u[k], y[k]);
    let rows = (0..600).map(|k| row(k).repeat(if k % 200 == 100 { 2 } else { 1 }));
    folder.write("twice.csv", format!("t,u,y\n{}", rows.collect::<String>()));
    let looked = folder.done("look twice.csv");
    assert!(looked.contains("Rows are there twice"), "{looked}");
    let outcome = typed(&folder, next(&looked));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let prepared = flexure_io::read_record(folder.path("prepared.csv")).unwrap();
    assert_eq!(prepared.record.len(), 600);
    let off = (0..600).map(|k| (prepared.column("y").unwrap()[k] - y[k]).abs());
    assert!(off.fold(0.0, f64::max) < 1e-9);
}

/// Stamps that jitter by half a step may be those of even samples: the look says what to type then.
#[test]
fn stamps_that_jitter_may_be_those_of_even_samples() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 600, 5);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let row = |k: usize| format!("{},{},{}\n", 10 * k + 4 * usize::from(k % 7 == 3), u[k], y[k]);
    folder.write(
        "jitter.csv",
        format!("t_ms,u,y\n{}", (0..600).map(row).collect::<String>()),
    );
    let looked = folder.done("look jitter.csv").replace("\n  ", " ");
    assert!(
        looked.contains("say --sample-time 0.01 in place of --resample 0.01"),
        "{looked}"
    );
    folder.done("prepare jitter.csv --sample-time 0.01 -o even.csv");
    let even = flexure_io::read_record(folder.path("even.csv")).unwrap();
    assert_eq!(even.column("y").unwrap(), y);
}
