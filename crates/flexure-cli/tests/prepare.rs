//! `flexure prepare`: what each option does to the numbers, to the last digit where it can, and what is refused.

mod common;

use common::Folder;
use flexure_io::{RecordFile, read_record, write_record};

/// A file of text with this header and a line for each sample.
fn log(folder: &Folder, name: &str, header: &str, samples: usize, line: impl Fn(f64) -> String) {
    let lines: Vec<String> = (0..samples).map(|i| line(i as f64)).collect();
    folder.write(name, format!("{header}\n{}\n", lines.join("\n")));
}

fn read(folder: &Folder, name: &str) -> RecordFile {
    read_record(folder.path(name)).unwrap()
}

fn column(folder: &Folder, name: &str, column: &str) -> Vec<f64> {
    read(folder, name).column(column).unwrap().to_vec()
}

/// No good sample becomes a missing one by overflow.
#[test]
fn values_that_would_overflow_are_refused() {
    let folder = Folder::new();
    let row = |k: u32| format!("{},{:e},{}\n", 0.01 * f64::from(k), 1e307 * f64::from(k).sin(), k % 5);
    folder.write("huge.csv", format!("t,u,q\n{}", (0..400).map(row).collect::<String>()));
    for step in ["--low-pass 3", "--remove-mean all", "--resample 0.007", "--detrend all"] {
        let outcome = folder.run(&format!("prepare huge.csv -o p.csv {step}"));
        assert_eq!(outcome.code, Some(1), "{step}: {outcome:?}");
        assert!(
            outcome.stderr.contains("the values of column 'u' reach"),
            "{step}: {outcome:?}"
        );
    }
    folder.write("short.csv", "t,u\n0,1\n1e-300,2\n2e-300,1\n3e-300,2\n");
    let outcome = folder.run("prepare short.csv -o p.csv --detrend all");
    assert!(
        outcome.code == Some(1) && outcome.stderr.contains("choose a unit"),
        "{outcome:?}"
    );
}

#[test]
fn a_record_without_a_step_is_the_record() {
    let folder = Folder::new();
    folder.known("r.csv", 50, 1);
    assert_eq!(folder.done("prepare r.csv -o out.csv"), "wrote out.csv (50 samples)\n");
    assert_eq!(read(&folder, "out.csv").record, read(&folder, "r.csv").record);
}

#[test]
fn time_and_units_are_kept_in_the_header() {
    let folder = Folder::new();
    log(&folder, "r.csv", "Time [ms],q [deg],u (V)", 4, |i| {
        format!("{},{},{i}", 10.0 * i, 90.0 * i)
    });
    let text = folder.done("prepare r.csv --convert q=rad -o out.csv");
    assert_eq!(text, "'q' is converted from deg to rad\nwrote out.csv (4 samples)\n");
    let written = folder.read("out.csv");
    assert!(
        written.starts_with("\"t [s]\",\"q [rad]\",\"u [V]\"\n0.0,0.0,0.0\n0.01,1.5707963267948966,1.0\n"),
        "{written}"
    );
    // The units survive in both formats.
    folder.done("prepare out.csv -o again.parquet");
    for name in ["out.csv", "again.parquet"] {
        let file = read(&folder, name);
        assert_eq!(file.record.names(), ["t", "q", "u"], "{name}");
        assert_eq!(
            file.units,
            [Some("s"), Some("rad"), Some("V")].map(|unit| unit.map(str::to_owned)),
            "{name}"
        );
        assert_eq!(file.sample_time("t").unwrap(), 0.01, "{name}");
    }
}

#[test]
fn cuts() {
    let folder = Folder::new();
    log(&folder, "r.csv", "t,u", 100, |i| format!("{},{i}", i / 10.0));
    let text = folder.done("prepare r.csv --cut 2:4.5 -o out.csv");
    assert!(
        text.starts_with("26 of 100 samples are kept, from 2 s to 4.5 s\n"),
        "{text}"
    );
    let kept: Vec<f64> = (20..=45).map(f64::from).collect();
    assert_eq!(column(&folder, "out.csv", "u"), kept);
    assert_eq!(column(&folder, "out.csv", "t")[0], 2.0);
    folder.done("prepare r.csv --cut-samples 20:46 -o out.csv");
    assert_eq!(column(&folder, "out.csv", "u"), kept);
    folder.done("prepare r.csv --cut 9.5: -o out.csv");
    assert_eq!(column(&folder, "out.csv", "u").len(), 5);
    folder.done("prepare r.csv --cut :0.3 -o out.csv");
    assert_eq!(column(&folder, "out.csv", "u"), [0.0, 1.0, 2.0, 3.0]);
    folder.failed(
        "prepare r.csv --cut 20:30 -o new.csv",
        "r.csv: nothing is left after the cut; the record goes from 0 s to 9.9 s",
    );
    folder.known("untimed.csv", 10, 1);
    folder.failed(
        "prepare untimed.csv --cut 1:2 -o new.csv",
        "untimed.csv: --cut needs the sample time, and there is no time column; name it by --time, or give --sample-time",
    );
}

/// An outlier is made missing, and the gap is filled with what was there before.
#[test]
fn outliers_are_marked_and_filled() {
    let folder = Folder::new();
    let truth = |i: f64| (0.1 * i).sin();
    log(&folder, "r.csv", "t,u,y", 200, |i| {
        let y = if i == 70.0 || i == 71.0 { 50.0 } else { truth(i) };
        format!("{},{},{y}", 0.01 * i, (0.3 * i).cos())
    });
    let text = folder.done("prepare r.csv --outliers all -o out.csv");
    assert_eq!(
        text,
        "'u' has no outliers\n\
         2 of 200 samples of 'y' are outliers (more than 5 robust deviations from 14 neighbours), at 0.7 s, 0.71 s; they are missing now\n\
         wrote out.csv (200 samples)\n\
         2 samples are missing, written as NaN; --fill N interpolates gaps of at most N\n"
    );
    let y = column(&folder, "out.csv", "y");
    let missing: Vec<usize> = (0..200).filter(|&i| y[i].is_nan()).collect();
    assert_eq!(missing, [70, 71]);
    assert_eq!(column(&folder, "out.csv", "u"), column(&folder, "r.csv", "u"));

    let text = folder.done("prepare r.csv --outliers y --fill 2 -o out.csv");
    assert!(
        text.contains("2 samples of 'y' are interpolated, in gaps of at most 2\nwrote"),
        "{text}"
    );
    let y = column(&folder, "out.csv", "y");
    for (i, y) in y.iter().enumerate() {
        assert!((y - truth(i as f64)).abs() < 1e-4, "{i}: {y}");
    }
    // A gap that is longer stays.
    let text = folder.done("prepare r.csv --outliers y --fill 1 -o out.csv");
    assert!(
        text.contains("2 in longer gaps, or at the ends, stay missing"),
        "{text}"
    );
}

/// Instants that jitter by up to 0.4 steps, with a pause of 20 samples, become a uniform record with a gap.
#[test]
fn jittered_instants_become_uniform() {
    let folder = Folder::new();
    let truth = |t: f64| (6.0 * t).sin();
    let instant = |i: f64| 0.01 * (i + 0.4 * (i * i).sin()) + if i >= 300.0 { 0.2 } else { 0.0 };
    log(&folder, "r.csv", "time,y", 600, |i| {
        format!("{},{}", instant(i), truth(instant(i)))
    });
    let outcome = folder.run("prepare r.csv --low-pass 20 -o new.csv");
    assert_eq!(outcome.code, Some(1));
    let message = "error: r.csv: the sample times are not uniform: the step to sample 2 is 0.0036";
    assert!(outcome.stderr.starts_with(message), "{}", outcome.stderr);
    let text = folder.done("prepare r.csv --resample 0.01 -o out.csv");
    assert!(text.contains("are now 619 every 0.01 s;"), "{text}");
    let [t, y] = ["t", "y"].map(|name| column(&folder, "out.csv", name));
    assert_eq!(&t[..4], [0.0, 0.01, 0.02, 0.03]);
    let mut missing = 0;
    for (t, y) in t.iter().zip(&y) {
        match y.is_nan() {
            true => missing += 1,
            false => assert!((y - truth(*t)).abs() < 1e-5, "{t}: {y}"),
        }
    }
    assert!((19..=22).contains(&missing), "{missing}");
    assert!(
        text.contains(&format!("{missing} samples of 'y' are missing, in gaps")),
        "{text}"
    );
}

/// Every second sample of a signal whose fast part would show as a slow one.
#[test]
fn a_longer_step_has_no_aliases() {
    let folder = Folder::new();
    let slow = |t: f64| (2.0 * t).sin();
    log(&folder, "r.csv", "t,u,y", 2000, |i| {
        let t = i / 100.0;
        // 45 Hz is 5 Hz where every second sample is taken.
        let alias = (std::f64::consts::TAU * 45.0 * t).sin();
        format!("{t},{},{}", (t / 0.5).floor(), slow(t) + alias)
    });
    let text = folder.done("prepare r.csv --resample 0.02 --hold u -o out.csv");
    let done = "2,000 samples, about 0.01 s apart, are now 1,000 every 0.02 s; what is faster than 20 Hz is taken out first; 'u' keeps its value between samples\nwrote out.csv (1,000 samples)\n";
    assert!(text.starts_with(done), "{text}");
    let [t, u, y] = ["t", "u", "y"].map(|name| column(&folder, "out.csv", name));
    for i in 50..950 {
        assert!((y[i] - slow(t[i])).abs() < 2e-3, "{}: {}", t[i], y[i]);
        assert_eq!(u[i], (t[i] / 0.5).floor(), "{}", t[i]);
    }
}

#[test]
fn filters_means_and_trends() {
    let folder = Folder::new();
    log(&folder, "r.csv", "u,y", 1000, |i| {
        let (slow, fast) = ((0.02 * i).sin(), (2.5 * i).sin());
        format!("{},{}", slow + fast, 3.0 + 0.01 * i + slow)
    });
    folder.failed(
        "prepare r.csv --low-pass 5 -o new.csv",
        "r.csv: --low-pass needs the sample time, and there is no time column; name it by --time, or give --sample-time",
    );
    folder.failed(
        "prepare r.csv --sample-time 0.01 --low-pass 50 -o new.csv",
        "r.csv: the cutoff frequency of the low-pass is 50, but must be positive and below half the sampling rate, 1/(2 x sample time)",
    );
    let text = folder.done("prepare r.csv --sample-time 0.01 --low-pass 5 -o out.csv");
    assert!(
        text.starts_with("'u' and 'y' went through a low-pass of 5 Hz (Butterworth of order 4, forward and backward, so without delay)\n"),
        "{text}"
    );
    let u = column(&folder, "out.csv", "u");
    for i in 100..900 {
        assert!((u[i] - (0.02 * i as f64).sin()).abs() < 1e-3, "{i}");
    }
    let text = folder.done("prepare r.csv --remove-mean y -o out.csv");
    assert!(text.starts_with("the mean of 'y', "), "{text}");
    let y = column(&folder, "out.csv", "y");
    assert!(y.iter().sum::<f64>().abs() < 1e-9);
    let text = folder.done("prepare r.csv --detrend y -o out.csv");
    assert!(text.contains("the straight line through 'y', "), "{text}");
    let y = column(&folder, "out.csv", "y");
    let slope: f64 = y.iter().enumerate().map(|(i, y)| (i as f64 - 499.5) * y).sum();
    assert!(slope.abs() < 1e-6, "{slope}");
    assert_eq!(column(&folder, "out.csv", "u"), column(&folder, "r.csv", "u"));
}

#[test]
fn files_are_merged_at_their_instants() {
    let folder = Folder::new();
    log(&folder, "motor.csv", "t,u,x", 100, |i| format!("{},{i},1", i / 100.0));
    log(&folder, "link.csv", "t,q,x", 100, |i| format!("{},{},2", i / 100.0, -i));
    log(&folder, "slow.csv", "time_ms,w", 30, |i| {
        format!("{},{}", 200.0 + 20.0 * i, 0.2 + 0.02 * i)
    });
    let text = folder.done("prepare motor.csv link.csv -o out.csv");
    assert_eq!(
        text,
        "'x' of link.csv is called 'link.x', as another file has a column of this name\n\
         the columns are side by side, 2 of motor.csv, 2 of link.csv, which have the same instants: 100 samples\n\
         wrote out.csv (100 samples)\n"
    );
    let file = read(&folder, "out.csv");
    assert_eq!(file.record.names(), ["t", "u", "x", "q", "link.x"]);
    assert_eq!(file.column("q").unwrap()[7], -7.0);

    // A slow file that covers a part: the motor's instants from 0.2 s to 0.78 s.
    let text = folder.done("prepare motor.csv slow.csv -o out.csv");
    assert!(
        text.contains("slow.csv: 30 samples, about 0.02 s apart, are now 59 every 0.01 s"),
        "{text}"
    );
    let [t, u, w] = ["t", "u", "w"].map(|name| column(&folder, "out.csv", name));
    assert_eq!((t[0], t[58], t.len()), (0.2, 0.78, 59));
    for i in 0..59 {
        assert!(
            (u[i] - 100.0 * t[i]).abs() < 1e-9 && (w[i] - t[i]).abs() < 1e-9,
            "{}: {} {}",
            t[i],
            u[i],
            w[i]
        );
    }

    log(&folder, "late.csv", "t,z", 10, |i| format!("{},{i}", 50.0 + i));
    folder.failed(
        "prepare motor.csv late.csv -o new.csv",
        "the files have no time in common: motor.csv goes from 0 s to 0.99 s, late.csv goes from 50 s to 59 s",
    );
    folder.known("untimed.csv", 100, 1);
    folder.failed(
        "prepare motor.csv untimed.csv -o new.csv",
        "untimed.csv has no time column, and another file has; name its column, or merge files without",
    );
}

/// Time stamps have a clock of their own: the files are aligned by it, not by their first samples.
#[test]
fn files_with_time_stamps_share_their_clock() {
    let folder = Folder::new();
    let stamped = |name: &str, first: usize, column: &str| {
        let lines = (first..first + 10).map(|s| format!("2024-05-01 10:00:{s:02},{s}"));
        let lines: Vec<String> = lines.collect();
        folder.write(name, format!("time,{column}\n{}\n", lines.join("\n")));
    };
    stamped("a.csv", 10, "u");
    stamped("b.csv", 13, "y");
    assert_eq!(folder.run("prepare a.csv b.csv -o out.csv").code, Some(0));
    let [t, u, y] = ["t", "u", "y"].map(|name| column(&folder, "out.csv", name));
    assert_eq!(t, [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    assert_eq!(u, [13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0]);
    assert_eq!(u, y);
    log(&folder, "c.csv", "t,z", 10, |i| format!("{i},{i}"));
    let outcome = folder.run("prepare a.csv c.csv -o new.csv");
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome.stderr.ends_with(
            "error: a.csv and c.csv have no common clock: the time of one is a time stamp, that of the other a number\n"
        ),
        "{}",
        outcome.stderr
    );
}

#[test]
fn a_given_sample_time_replaces_stamps_that_jitter() {
    let folder = Folder::new();
    log(&folder, "r.csv", "t,y", 10, |i| {
        format!("{},{i}", i * 0.01 + 0.004 * (i * i).sin())
    });
    let text = folder.done("prepare r.csv --sample-time 0.01 -o out.csv");
    assert_eq!(
        text,
        "the samples of r.csv count as 0.01 s apart; column 't' is left out\nwrote out.csv (10 samples)\n"
    );
    assert_eq!(read(&folder, "out.csv").sample_time("t").unwrap(), 0.01);
}

#[test]
fn kept_columns_and_json() {
    let folder = Folder::new();
    log(&folder, "r.csv", "t,u,v,y [deg]", 20, |i| {
        format!("{},{i},1,{i}", i / 100.0)
    });
    let value = folder.json("prepare r.csv --keep u,y --convert y=rad --remove-mean u -o out.csv");
    assert_eq!(value["files"], serde_json::json!(["r.csv"]));
    assert_eq!(value["out"], "out.csv");
    assert_eq!((&value["samples"], &value["sample_time"]), (&20.into(), &0.01.into()));
    assert_eq!(
        value["columns"],
        serde_json::json!([{"name": "u", "unit": null, "missing": 0}, {"name": "y", "unit": "rad", "missing": 0}])
    );
    let steps: Vec<&str> = value["steps"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["step"].as_str().unwrap())
        .collect();
    assert_eq!(steps, ["keep", "convert", "mean"]);
    assert_eq!(read(&folder, "out.csv").record.names(), ["t", "u", "y"]);
}

#[test]
fn what_is_refused_says_what_to_do() {
    let folder = Folder::new();
    let record = folder.known("r.csv", 30, 1);
    folder.failed(
        "prepare r.csv --keep u,z -o new.csv",
        "r.csv: no column 'z'; the columns are: u, y, y0",
    );
    folder.failed(
        "prepare r.csv --keep u --detrend y -o new.csv",
        "r.csv: column 'y' is not among those to keep; add it, or leave out what is to be done to it",
    );
    folder.failed(
        "prepare r.csv --convert u=rad -o new.csv",
        "r.csv: the record does not say the unit of column 'u'; give both: u=UNIT:rad",
    );
    folder.failed(
        "prepare r.csv --convert u=deg:m -o new.csv",
        "r.csv: column 'u': deg cannot be converted to m; it can be converted to: rad, mrad, arcmin, arcsec, rev",
    );
    let unknown = folder.run("prepare r.csv --convert u=furlong:m -o new.csv").stderr;
    assert!(
        unknown.starts_with("error: r.csv: column 'u': the unit furlong is not known; the units are: rad, "),
        "{unknown}"
    );
    folder.failed(
        "prepare r.csv --sample-time 0.01 --resample 1e-9 -o new.csv",
        "r.csv: the new sample time is 0.000000001, but must be long enough for at most 100 million samples",
    );
    folder.misused(
        "prepare r.csv -o r.csv",
        "r.csv is read and would be overwritten; give the output another name",
    );
    for (options, message) in [
        (
            "--cut 5",
            "'5' for '--cut <A:B>': expected A:B with two instants in s, A before B",
        ),
        (
            "--cut 5:4",
            "'5:4' for '--cut <A:B>': expected A:B with two instants in s, A before B",
        ),
        (
            "--cut-samples 4:4",
            "'4:4' for '--cut-samples <A:B>': expected A:B with two whole numbers from 0",
        ),
        (
            "--convert q",
            "'q' for '--convert <COLUMN=UNIT>': expected COLUMN=UNIT or COLUMN=UNIT:UNIT",
        ),
        ("--resample 0", "'0' for '--resample <DT>': expected a positive number"),
    ] {
        let outcome = folder.run(&format!("prepare r.csv {options} -o new.csv"));
        assert_eq!(outcome.code, Some(2), "{options}");
        assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
    }
    let back: flexure::Record = {
        let (names, samples): (Vec<_>, Vec<_>) = record.columns().map(|(n, s)| (n.to_owned(), s.to_vec())).unzip();
        let t: Vec<f64> = (0..30).map(|i: i32| f64::from((i - 20).abs())).collect();
        flexure::Record::new(std::iter::once(("t".to_owned(), t)).chain(names.into_iter().zip(samples))).unwrap()
    };
    write_record(folder.path("back.csv"), &back).unwrap();
    let outcome = folder.run("prepare back.csv --resample 0.5 -o new.csv");
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("back.csv: "), "{}", outcome.stderr);
}

/// The command that is printed last can be typed: the record is looked at before it is written.
#[test]
fn what_to_type_next_is_said() {
    let folder = Folder::new();
    let (mut seed, mut y, mut rows) = (1_u64, 0.0, String::from("t,valve,level\n"));
    for i in 0..600 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let u = (seed >> 40) as f64 / (1 << 24) as f64;
        let level = if i == 300 { String::new() } else { format!("{y}") };
        rows.push_str(&format!("{},{u},{level}\n", i as f64 * 0.01));
        y = 0.6 * y + u;
    }
    folder.write("log.csv", rows);
    let text = folder.done("prepare log.csv --fill 1 -o out.csv");
    let next = text.trim_end().rsplit_once("next: flexure ").map(|(_, next)| next);
    let next = next.unwrap_or_else(|| panic!("{text}"));
    assert!(
        next.starts_with("identify out.csv --input valve --output level"),
        "{next}"
    );
    folder.done(next);
    // With the model in the folder, another log validates it; its own log does not.
    let again = folder.done("prepare log.csv --fill 1 -o again.csv");
    assert!(!again.contains("validate"), "{again}");
    let later = folder.done("prepare log.csv --fill 1 --cut-samples 100: -o later.csv");
    let next = "validate model.json later.csv --report validated.html";
    let said = format!("next: flexure {next}\nor, for a model of its own: flexure identify later.csv ");
    assert!(later.contains(&said), "{later}");
    folder.done(next);
    // A log with the name of its own may be the same.
    std::fs::copy(folder.path("log.csv"), folder.path("out.csv")).unwrap();
    let own = folder.done("prepare out.csv --cut-samples 100: -o other.csv");
    assert!(!own.contains("validate"), "{own}");
}
