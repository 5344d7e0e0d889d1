//! `flexure look` on untidy logs: the command that it suggests mends them, and runs as printed. `flexure prepare` says what it changes.

mod common;

use common::{Folder, next, typed};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

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
    assert!(next(&looked).contains(" --resample 0.01 "), "{looked}");
    let outcome = typed(&folder, next(&looked));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    folder.done("prepare twice.csv --resample 0.01 -o prepared.csv");
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
        looked.contains("flexure prepare FILE --sample-time 0.01 -o jitter-prepared.csv gives them even stamps"),
        "{looked}"
    );
    folder.done("prepare jitter.csv --sample-time 0.01 -o even.csv");
    let even = flexure_io::read_record(folder.path("even.csv")).unwrap();
    assert_eq!(even.column("y").unwrap(), y);
}

/// Stamps of whole seconds, taken early or late, repeat and skip. With as many rows as the duration needs, no row is lost or there twice.
#[test]
fn stamps_of_whole_seconds_are_not_lost_rows() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 600, 6);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    // Every 2 s; a late stamp equals the next one, and an early one the one before.
    let stamp = |k: usize| 2 * k + 2 * usize::from(k % 90 == 40) - 2 * usize::from(k % 90 == 70);
    let log = |rows: &[usize]| -> String {
        let row = |&k: &usize| format!("{},{},{}\n", stamp(k), u[k], y[k]);
        format!("t,u,y\n{}", rows.iter().map(row).collect::<String>())
    };
    let all: Vec<usize> = (0..600).collect();
    folder.write("coarse.csv", log(&all));
    let looked = folder.done("look coarse.csv").replace("\n                      ", " ");
    assert!(
        looked.contains("the number of rows fits one row every 2.000 s"),
        "{looked}"
    );
    assert_eq!(
        next(&looked),
        "flexure prepare coarse.csv --sample-time 2 -o coarse-prepared.csv"
    );
    let outcome = typed(&folder, next(&looked));
    assert!(
        outcome
            .stdout
            .contains("next: flexure identify coarse-prepared.csv --input u --output y"),
        "{outcome:?}"
    );
    let prepared = flexure_io::read_record(folder.path("coarse-prepared.csv")).unwrap();
    assert_eq!(prepared.column("y").unwrap(), y);
    assert_eq!(prepared.sample_time("t").unwrap(), 2.0);
    // Of few rows nothing can be said.
    folder.write("few.csv", "t,u,y\n0,1,2\n0,2,3\n1,3,5\n3,4,4\n");
    folder.done("look few.csv");
    // With a lost row, or one that is there twice, there are not as many rows as the duration needs.
    let lost: Vec<usize> = all.iter().copied().filter(|k| *k != 300).collect();
    let twice: Vec<usize> = all.iter().flat_map(|k| vec![*k; 1 + usize::from(*k == 300)]).collect();
    for (name, rows) in [("lost.csv", lost), ("twice.csv", twice)] {
        folder.write(name, log(&rows));
        let looked = folder.done(&format!("look {name}"));
        assert!(!next(&looked).contains("--sample-time"), "{name}: {looked}");
    }
}

/// A text among the numbers of one column is one for missing samples, whatever the other columns hold.
#[test]
fn a_text_beside_units_leads_to_a_second_look() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 400, 7);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let level = |k: usize| {
        if k == 77 {
            "Err".to_owned()
        } else {
            format!("{} mm", y[k])
        }
    };
    let rows: String = (0..400)
        .map(|k| format!("{},{} %,{}\n", 0.01 * k as f64, u[k], level(k)))
        .collect();
    folder.write("err.csv", format!("t,u,y\n{rows}"));
    assert_eq!(
        next(&folder.done("look err.csv")),
        "flexure look err.csv --missing-text Err"
    );
}

/// What resampling makes up is said: missing samples, lost rows, rows at one instant.
#[test]
fn resampling_says_what_it_interpolates() {
    let folder = Folder::new();
    let rows = (0..200)
        .filter(|i| *i != 50)
        .flat_map(|i| vec![i; 1 + usize::from(i == 120)]);
    let row = |i: usize| {
        let y = if [80, 81, 150].contains(&i) {
            String::new()
        } else {
            (0.1 * i as f64).sin().to_string()
        };
        format!("{},{},{y}\n", 0.01 * i as f64, i % 7)
    };
    folder.write("r.csv", format!("t,u,q_deg\n{}", rows.map(row).collect::<String>()));
    let text = folder.done("prepare r.csv --resample 0.01 --convert q_deg=rad -o out.csv");
    for said in [
        "'q_deg' is converted from deg to rad\n",
        "are now 200 every 0.01 s; 1 row has the same instant as the row before, and is averaged with it; 1 gap in time is interpolated; \
         3 samples missing of 'q_deg' are interpolated\n",
    ] {
        assert!(text.contains(said), "{text}");
    }
}

/// Names with their units at the end, beside the reference of a position controller, are those of a joint.
/// Where the stamps are not read, the look goes no further: lost rows would be hidden.
#[test]
fn stamps_that_are_not_read_stop_the_look() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 400, 8);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let log = |stamp: &dyn Fn(usize) -> String| -> String {
        let row = |k: usize| format!("{},{},{}\n", stamp(k), u[k], y[k]);
        format!("Timestamp,u,y\n{}", (0..400).map(row).collect::<String>())
    };
    folder.write(
        "unread.csv",
        log(&|k| format!("2026w14 d{} {}h{}", 1 + k / 1440, k / 60 % 24, k % 60)),
    );
    let looked = folder.run("look unread.csv").stdout;
    assert_eq!(
        next(&looked),
        "the same with --time-format FORMAT, as the stamps are written"
    );
    assert!(
        looked.contains("Column 'Timestamp' should have the instants"),
        "{looked}"
    );
    let timed = folder.run("look unread.csv --sample-time 60").stdout;
    assert!(
        next(&timed).starts_with("flexure identify unread.csv --input u --output y"),
        "{timed}"
    );
    // Months in words are read; the duration is that of the instants, also where rows are lost.
    let lost = |k: usize| k + usize::from(k > 300) * 20;
    folder.write(
        "words.csv",
        log(&|k| format!("30-May-26 {:02}:{:02}:00", lost(k) / 60, lost(k) % 60)),
    );
    let looked = folder.run("look words.csv").stdout;
    assert!(looked.contains("every 60 s, 25200 s in all"), "{looked}");
}

/// A clock that starts again makes two records of a log: sorting would mix them. Rows out of order are to be sorted.
#[test]
fn a_log_that_starts_again_has_parts() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 700, 9);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let rows = |range: std::ops::Range<usize>, start: usize| -> String {
        let row = |k: usize| format!("{:.2},{},{}\n", 0.01 * (k - start) as f64, u[k], y[k]);
        range.map(row).collect()
    };
    let names = "t,u,y\n";
    folder.write(
        "again.csv",
        format!("{names}{}\n{names}{}", rows(0..300, 0), rows(300..700, 300)),
    );
    let looked = folder
        .run("look again.csv")
        .stdout
        .replace("\n                      ", " ");
    let said = "'t' starts again at sample 300 (line 304): the log has 2 parts, which sorting by time would mix. flexure prepare FILE \
                --cut-samples A:B -o part.csv takes one of them: 0:300 or 300:700.";
    assert!(looked.contains(said) && !looked.contains("sort the record"), "{looked}");
    assert!(looked.contains("The clock starts again within the log"), "{looked}");
    assert_eq!(
        next(&looked),
        "flexure prepare again.csv --cut-samples 300:700 -o again-prepared.csv"
    );
    let outcome = typed(&folder, next(&looked));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let part = flexure_io::read_record(folder.path("again-prepared.csv")).unwrap();
    assert_eq!(part.column("y").unwrap(), &y[300..]);
    let refused = folder.run("prepare again.csv --low-pass 5 -o out.csv").stderr;
    assert!(refused.contains("--cut-samples :300 or 300: -o part.csv"), "{refused}");
    // Rows out of order, and parts that were joined in the wrong order.
    let swapped = [rows(0..300, 0), rows(310..320, 0), rows(300..310, 0), rows(320..700, 0)].concat();
    for (name, rows) in [
        ("swapped.csv", swapped),
        ("joined.csv", rows(300..700, 0) + &rows(0..300, 0)),
    ] {
        folder.write(name, format!("{names}{rows}"));
        let looked = folder.done(&format!("look {name}"));
        assert!(
            looked.contains("sort the record by") && !looked.contains("parts"),
            "{looked}"
        );
    }
}

/// A cut counts on the record's own clock. One that cuts nothing off is refused, with the instants that it may mean.
#[test]
fn a_cut_on_a_clock_from_1970() {
    let folder = Folder::new();
    let row = |k: usize| format!("{},{},{}\n", 1_764_400_000_000_000_000 + 2_000_000 * k, k % 7, k % 5);
    folder.write(
        "epoch.csv",
        format!("stamp,u,y\n{}", (0..2000).map(row).collect::<String>()),
    );
    let range = "the record goes from 1764400000 s to 1764400003.998 s";
    for (cut, said) in [
        (
            "0.6:",
            "error: epoch.csv: the cut keeps all of the record, which goes from 1764400000 s to 1764400003.998 s; 0.6 s after its start is \
             1764400000.6 s",
        ),
        (":2e9", "which goes from 1764400000 s to 1764400003.998 s"),
        ("0:2e9", "which goes from 1764400000 s to 1764400003.998 s"),
        (
            "0.5:1.5",
            "0.5 s after its start is 1764400000.5 s, 1.5 s after its start is 1764400001.5 s",
        ),
        ("0.5:1.5", range),
        ("50:60", range),
    ] {
        let refused = folder.run(&format!("prepare epoch.csv --cut {cut} -o out.csv"));
        assert!(
            refused.code == Some(1) && refused.stderr.contains(said),
            "{cut}: {refused:?}"
        );
        assert!(!folder.path("out.csv").exists());
    }
    let kept = folder
        .run("prepare epoch.csv --cut 1764400000.6:1764400001.002 -o out.csv")
        .stdout;
    assert!(
        kept.starts_with("202 of 2,000 samples are kept, from 1764400000.6 s to 1764400001.002 s\n"),
        "{kept}"
    );
    // An end at the record's own end is within it. Of several files, each may be shorter than the cut.
    folder.write("a.csv", "t,u\n0,1\n1,2\n2,4\n3,1\n");
    folder.write("b.csv", "t,v\n1,1\n2,2\n");
    folder.done("prepare a.csv --cut 0: -o out.csv");
    folder.done("prepare a.csv b.csv --cut 0.5:2.5 -o out.csv");
    let refused = folder.run("prepare a.csv b.csv --cut :9 -o out.csv").stderr;
    assert!(
        refused.contains("the cut keeps all of the record, which goes from 0 s to 3 s\n"),
        "{refused}"
    );
}

/// A single number is no column of instants, but may be the sample time: messages that ask for it say so.
#[test]
fn a_constant_may_be_the_sample_time() {
    let folder = Folder::new();
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../flexure-io/tests/data/untimed.mat");
    std::fs::copy(fixture, folder.path("log.mat")).unwrap();
    let looked = folder
        .run("look log.mat")
        .stdout
        .replace("\n                      ", " ");
    let said = "between two samples; by the constant 'fs' it is 0.125 s: --sample-time 0.125.";
    assert!(looked.contains(said) && !looked.contains("--time-format"), "{looked}");
    assert!(
        next(&looked).starts_with("flexure identify log.mat --input u --output y"),
        "{looked}"
    );
    let refused = folder.run("prepare log.mat --low-pass 1 -o out.csv").stderr;
    assert!(
        refused.contains("by the constant 'fs' it is 0.125 s: --sample-time 0.125"),
        "{refused}"
    );
    let timed = folder.run("prepare log.mat --low-pass 1 --sample-time 0.125 -o out.csv");
    assert_eq!(timed.code, Some(0), "{timed:?}");
}

/// A logger that ran before its machine: rows of zeros, then a joint under gravity, whose look needs gravity too.
#[test]
fn rows_before_the_machine_ran_are_cut_off_and_gravity_is_tried() {
    let folder = Folder::new();
    let mut text = "t,state,q,tau\n".to_owned();
    let step = 0.002;
    for i in 0..300 {
        text += &format!("{},0,0,0\n", step * f64::from(i));
    }
    let mut rng = Pcg64::seed_from_u64(3);
    let (mut q, mut v) = (0.4_f64, 0.0_f64);
    for i in 300..15_000 {
        let t = step * f64::from(i);
        let wanted = 0.4 + 0.8 * (1.3 * t).sin() + 0.3 * (4.1 * t).sin() + 0.1 * (11.0 * t).cos();
        let tau = 60.0 * (wanted - q) - 8.0 * v + 6.0 * q.sin();
        let noise = 1e-4 * (rng.random_range(-1.0..1.0_f64) + rng.random_range(-1.0..1.0));
        text += &format!("{t},4,{},{tau}\n", q + noise);
        for _ in 0..20 {
            let force = tau - 6.0 * q.sin() - 0.8 * v - 0.6 * (200.0 * v).tanh();
            v += 1e-4 * force / 0.35;
            q += 1e-4 * v;
        }
    }
    folder.write("log.csv", text);
    let look = folder.done("look log.csv");
    assert_eq!(
        next(&look),
        "flexure prepare log.csv --cut-samples 300: -o log-prepared.csv"
    );
    typed(&folder, next(&look));
    let look = folder.done("look log-prepared.csv");
    let command = next(&look).to_owned();
    assert!(
        command.contains("--position q --torque tau") && command.contains("--gravity"),
        "{look}"
    );
    let found = folder.json("joint log-prepared.csv --position q --torque tau --gravity");
    let inertia = found["inertia"]["value"].as_f64().unwrap();
    assert!((inertia - 0.35).abs() < 0.01, "{inertia}");
}

/// Rows of 100 Hz with stamps in whole seconds: the instants at which the seconds change tell the step. Where they do not, the command to type
/// leaves it open, and says what the rows fit.
#[test]
fn stamps_of_whole_seconds_tell_a_fast_sample_time() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 1600, 8);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let log = |rows: usize, second: &dyn Fn(usize) -> usize| -> String {
        let row = |k: usize| format!("2026-03-01 08:00:{:02},{},{}\n", second(k), u[k], y[k]);
        format!("Time,u,y\n{}", (0..rows).map(row).collect::<String>())
    };
    for seconds in [12, 14, 16] {
        folder.write("whole.csv", log(100 * seconds, &|k| k / 100));
        let looked = folder.run("look whole.csv").stdout;
        let headline = format!("every 0.01 s, {seconds} s in all");
        assert!(looked.contains(&headline), "{looked}");
        assert!(
            next(&looked).starts_with("flexure identify whole.csv --input u --output y"),
            "{looked}"
        );
    }
    // A second with half as many rows, and one with half as many more: the clock was late.
    folder.write(
        "late.csv",
        log(1200, &|k| if (500..550).contains(&k) { 4 } else { k / 100 }),
    );
    let looked = folder
        .run("look late.csv")
        .stdout
        .replace("\n                      ", " ");
    assert!(looked.contains("one row every 0.009200 s, within 9.1 %"), "{looked}");
    assert!(
        looked.contains("in place of SECONDS: the rows fit about 0.0092 s."),
        "{looked}"
    );
    assert_eq!(
        next(&looked),
        "flexure prepare late.csv --sample-time SECONDS -o late-prepared.csv"
    );
}
