//! Steps that `flexure identify` does to an untidy log, and that the model keeps for later logs.

mod common;

use common::Folder;

/// Rows of a known record at instants that jitter by a third of a step, without the rows `lost`, and without the outputs `missing`.
fn untidy(folder: &Folder, name: &str, header: &str, seed: u64, [lost, missing]: [&[usize]; 2]) {
    let record = folder.known("known.csv", 800, seed);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let row = |k: usize| {
        let late = if k % 5 == 2 { 3.0 } else { 0.0 };
        let output = if missing.contains(&k) {
            String::new()
        } else {
            y[k].to_string()
        };
        format!("{},{},{output}\n", 10.0 * k as f64 + late, u[k])
    };
    let rows = (0..800).filter(|k| !lost.contains(k)).map(row);
    folder.write(name, format!("{header}\n{}", rows.collect::<String>()));
}

/// The later log has other names. The model's steps prepare it as `flexure prepare` does.
#[test]
fn a_model_prepares_later_logs_as_its_own() {
    let folder = Folder::new();
    untidy(&folder, "first.csv", "t_ms,u,y", 3, [&[], &[]]);
    untidy(&folder, "later.csv", "t_ms,command,speed", 4, [&[], &[]]);
    let steps = "--resample 0.01 --hold u --fill 2";
    folder.run(&format!(
        "identify first.csv --input u --output y {steps} -o model.json"
    ));
    let renamed = "--input command --output speed";
    let raw = folder.run(&format!("validate model.json later.csv {renamed}"));
    assert_eq!(raw.code, Some(0), "{raw:?}");
    let said = "later.csv is read with the options of the model's log: --fill 2 --hold u --resample 0.01";
    assert!(raw.stderr.contains(said), "{raw:?}");
    assert!(
        raw.stderr.contains("'command' keeps its value between samples"),
        "{raw:?}"
    );

    // What is to be typed next names the columns of this log.
    let again = "identify later.csv --input command --output speed --fill 2 --hold command --resample 0.01";
    let found = |printed: &str| printed.split("\nnext: flexure ").map(str::to_owned).collect::<Vec<_>>();
    assert!(found(&raw.stdout)[1].starts_with(again), "{raw:?}");
    folder.done("prepare later.csv --resample 0.01 --hold command --fill 2 -o prepared.csv");
    // A log that is ready stays as it is.
    let tidy = folder.run(&format!("validate model.json prepared.csv {renamed}"));
    assert_eq!(found(&tidy.stdout)[0], found(&raw.stdout)[0]);
    // The model of a log that was prepared before is the same.
    folder.done("prepare first.csv --resample 0.01 --hold u --fill 2 -o clean.csv");
    folder.run("identify clean.csv --input u --output y -o by-hand.json");
    let by_hand = folder.run(&format!("validate by-hand.json prepared.csv {renamed}"));
    assert_eq!(found(&by_hand.stdout)[0], found(&raw.stdout)[0]);

    for command in [
        "predict model.json later.csv --input command -o out.csv",
        &format!("report model.json later.csv {renamed} -o out.html"),
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, Some(0), "{run:?}");
    }
    let predicted = flexure_io::read_record(folder.path("out.csv")).unwrap();
    assert_eq!(predicted.sample_time("t").unwrap(), 0.01);
    let compared = folder.run(&format!("compare model.json by-hand.json later.csv {renamed}"));
    assert_eq!(compared.code, Some(0), "{compared:?}");
}

/// Lost rows and missing outputs do not count; the input is interpolated there.
#[test]
fn outputs_are_not_made_up() {
    let folder = Folder::new();
    let lost: [&[usize]; 2] = [&[200, 300, 301], &[700, 799]];
    untidy(&folder, "first.csv", "t_ms,u,y", 3, lost);
    untidy(&folder, "later.csv", "t_ms,u,y", 4, lost);
    let found = folder.run("identify first.csv --input u --output y --resample 0.01 --hold u -o model.json");
    assert_eq!(found.code, Some(0), "{found:?}");
    assert!(found.stderr.contains("2 gaps in time are interpolated"), "{found:?}");
    let missing = |text: &str| -> usize {
        let (before, _) = text.split_once(" of 800 outputs are missing").expect(text);
        before.rsplit(' ').next().unwrap().parse().unwrap()
    };
    // At instants that jitter, a lost sample leaves none on its two sides either.
    assert!((5..=15).contains(&missing(&found.stdout)), "{found:?}");
    let judged = folder.run("validate model.json later.csv");
    assert_eq!(judged.code, Some(0), "{judged:?}");
    assert!(
        judged.stderr.contains("samples of 'y' are missing, in gaps"),
        "{judged:?}"
    );
    // Without gaps, the option has nothing to say.
    untidy(&folder, "whole.csv", "t_ms,u,y", 5, [&[], &[]]);
    let whole = folder.run("identify whole.csv --input u --output y --resample 0.01 --hold u");
    assert!(!whole.stdout.contains("missing"), "{whole:?}");
}

/// A record that has no instants is taken at the model's sample time, as without steps.
#[test]
fn a_later_log_without_instants_is_not_resampled() {
    let folder = Folder::new();
    untidy(&folder, "first.csv", "t_ms,u,y", 3, [&[], &[]]);
    folder.run("identify first.csv --input u --output y --resample 0.01 --hold u -o model.json");
    folder.known("later.csv", 800, 5);
    let validated = folder.run("validate model.json later.csv");
    assert_eq!(validated.code, Some(0), "{validated:?}");
    for said in [
        "later.csv has no instants, so it is not resampled",
        "the sample time is taken as the model's, 0.01 s",
    ] {
        assert!(validated.stderr.contains(said), "{validated:?}");
    }
}

#[test]
fn steps_that_cannot_be_done() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 600, 3);
    assert!(record.column("y0").is_ok());
    let identify = "identify r.csv --input u --output y -o new.json";
    folder.misused(
        &format!("{identify} --outliers y0"),
        "r.csv: a step names the column 'y0', but the columns in use are u, y",
    );
    folder.failed(
        &format!("{identify} --resample 0.01"),
        "r.csv: a new sample time needs the sample time, and there is no time column",
    );
    let in_vain = "--hold says what a column does between its samples where it is resampled; give --resample too";
    folder.misused(&format!("{identify} --hold u"), in_vain);
    for (options, said) in [
        ("--sample-time 0.1 --resample 0.1", "cannot be used with"),
        ("--hold u,u", "--hold names 'u' twice"),
        ("--threshold 4", "--outliers <COLUMNS>"),
    ] {
        let refused = folder.run(&format!("{identify} {options}"));
        assert!(refused.code == Some(2) && refused.stderr.contains(said), "{refused:?}");
    }
}

/// A logger that was off for a while, and a sensor that failed for single samples: the identification uses the longest part, and so do later ones.
#[test]
fn a_gap_too_long_to_fill_is_cut_off() {
    let folder = Folder::new();
    let log = |name: &str, seed: u64, off: std::ops::Range<usize>| {
        let record = folder.known("known.csv", 1500, seed);
        let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
        let value = |k: usize| if k % 197 == 5 { 1e5 + y[k] } else { y[k] };
        let rows = (0..1500).filter(|k| !off.contains(k));
        let rows = rows.map(|k| format!("{:.2},{},{}\n", 0.01 * k as f64, u[k], value(k)));
        folder.write(name, format!("t,u,y\n{}", rows.collect::<String>()));
    };
    log("first.csv", 3, 600..640);
    log("later.csv", 4, 1000..1100);
    let looked = folder.run("look first.csv").stdout;
    let line = common::next(&looked);
    assert!(
        line.contains("identify first.csv --input u --output y --structure auto --outliers y --resample 0.01 -o"),
        "{line}"
    );
    let found = common::typed(&folder, line);
    assert!(
        found
            .stderr
            .contains("the longest part without a gap is used, 860 of 1,500 samples, from 6.4 s to 14.99 s"),
        "{found:?}"
    );
    let judged = folder.run("validate model.json later.csv");
    assert_eq!(judged.code, Some(0), "{judged:?}");
    assert!(
        judged.stderr.contains("1,000 of 1,500 samples, from 0 s to 9.99 s"),
        "{judged:?}"
    );
    // Where gaps are the rule, no part stands for the record.
    let rows = (0..1500)
        .filter(|k| k % 100 >= 12)
        .map(|k| format!("{:.2},{},{}\n", 0.01 * f64::from(k), k % 7, k % 5));
    folder.write("gaps.csv", format!("t,u,y\n{}", rows.collect::<String>()));
    let refused = folder.run("identify gaps.csv --input u --output y --resample 0.01");
    assert!(
        refused.code == Some(1) && refused.stderr.contains("say --fill N"),
        "{refused:?}"
    );
}

/// A prediction needs no output: neither one that ends early, nor a column of it without numbers.
#[test]
fn a_prediction_goes_on_where_the_output_ends() {
    let folder = Folder::new();
    untidy(&folder, "first.csv", "t_ms,u,y", 3, [&[], &[]]);
    folder.run("identify first.csv --input u --output y --resample 0.01 --hold u -o model.json");
    let late: Vec<usize> = (300..800).collect();
    untidy(&folder, "half.csv", "t_ms,u,y", 4, [&[], &late]);
    let all: Vec<usize> = (0..800).collect();
    untidy(&folder, "none.csv", "t_ms,u,y", 4, [&[], &all]);
    for name in ["half", "none"] {
        let run = folder.run(&format!("predict model.json {name}.csv -o {name}-out.csv"));
        assert_eq!(run.code, Some(0), "{run:?}");
        let predicted = flexure_io::read_record(folder.path(&format!("{name}-out.csv"))).unwrap();
        assert_eq!(predicted.record.len(), 800, "{run:?}");
    }
}
