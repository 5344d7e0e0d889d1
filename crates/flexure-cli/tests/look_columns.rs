//! `flexure look` and `flexure identify` on columns that leave a choice: units in the cells, dates, no names, and columns that do not change.

mod common;

use common::{Folder, next, typed};

/// A log of a known system at 100 Hz: the fields of each row from its number and its samples.
fn log(folder: &Folder, name: &str, header: &str, row: impl Fn(usize, f64, f64) -> String) {
    let record = common::known(600, 3);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let rows: String = (0..600).map(|k| row(k, u[k], y[k]) + "\n").collect();
    folder.write(name, format!("{header}{rows}"));
}

#[test]
fn a_unit_with_another_prefix_is_converted() {
    let folder = Folder::new();
    let volts = |k: usize, u: f64| match k % 2 {
        0 => format!("{} mV", 1e3 * u),
        _ => format!("{u} V"),
    };
    log(&folder, "units.csv", "t,u,y\n", |k, u, y| {
        format!("{},{},{y}", 0.01 * k as f64, volts(k, u))
    });
    let looked = folder.run("look units.csv");
    assert!(
        looked
            .stderr
            .contains("column 'u' has numbers in mV and V; all are taken in mV"),
        "{looked:?}"
    );
    assert!(
        next(&looked.stdout).starts_with("flexure identify units.csv --input u --output y"),
        "{looked:?}"
    );
    // Another quantity is no text for missing samples.
    log(&folder, "other.csv", "t,u,y\n", |k, u, y| {
        format!("{},{u} {},{y}", 0.01 * k as f64, ["V", "psi"][k % 2])
    });
    let looked = folder.said("look other.csv");
    assert!(
        looked.contains("but the numbers above are in V: write all of them in one unit"),
        "{looked}"
    );
    assert!(!looked.contains("--missing-text"), "{looked}");
}

/// Dates that begin with the day or the month: an identification without the time would go on in samples.
#[test]
fn dates_that_are_read_in_two_ways_are_refused() {
    let folder = Folder::new();
    log(&folder, "dates.csv", "time,u,y\n", |k, u, y| {
        format!("03/04/2026 08:00:{:02}.{:02}0,{u},{y}", k / 100, k % 100)
    });
    let identify = "identify dates.csv --input u --output y --structure linear";
    let note = folder.run(identify).stderr;
    assert!(
        note.ends_with(
            "error: dates.csv: column 'time' has dates that may begin with the day or the month, such as '03/04/2026 08:00:00.000' on line 2: say \
             --time-format \"%d/%m/%Y %H:%M:%S%.f\" if it is the day, --time-format \"%m/%d/%Y %H:%M:%S%.f\" if it is the month; --sample-time S \
             takes the rows as evenly spaced\n"
        ),
        "{note}"
    );
    assert_eq!(folder.run(identify).code, Some(1));
    assert_eq!(folder.run(&format!("{identify} --fill 3")).code, Some(1));
    assert_eq!(folder.run(&format!("{identify} --sample-time 0.01")).code, Some(0));
    let looked = folder.run("look dates.csv").stdout;
    assert!(!looked.contains("No column has the sample instants"), "{looked}");
    for (when, format) in [("day", "%d/%m"), ("month", "%m/%d")] {
        let start = format!("next, if the {when} comes first: ");
        let line = looked
            .lines()
            .find_map(|line| line.strip_prefix(&start))
            .expect(&looked);
        assert_eq!(
            line,
            format!("flexure look dates.csv --time-format '{format}/%Y %H:%M:%S%.f'")
        );
        let outcome = typed(&folder, line);
        assert!(outcome.stdout.contains("every 0.01 s, 6 s in all"), "{outcome:?}");
    }
}

/// The median of steps that jitter is not their mean.
#[test]
fn the_look_and_the_refusal_suggest_the_same_step() {
    let folder = Folder::new();
    let late = |k: usize| if k % 5 == 2 { 0.0035 } else { 1e-4 * (k % 3) as f64 };
    log(&folder, "jitter.csv", "t,u,y\n", |k, u, y| {
        format!("{},{u},{y}", 0.01 * k as f64 + late(k))
    });
    let step = |text: &str| {
        text.split_once("--resample ")
            .expect(text)
            .1
            .split(' ')
            .next()
            .unwrap()
            .to_owned()
    };
    let looked = folder.done("look jitter.csv");
    let refused = folder.run("identify jitter.csv --input u --output y").stderr;
    assert_eq!(step(next(&looked)), "0.01", "{looked}");
    assert_eq!(step(&refused), "0.01", "{refused}");
}

#[test]
fn the_first_column_of_a_file_without_names_may_have_the_instants() {
    let folder = Folder::new();
    log(&folder, "bare.csv", "", |k, u, y| {
        format!("{},{u},{y}", 0.01 * k as f64)
    });
    let looked = folder.run("look bare.csv").stdout;
    assert!(looked.contains("every 0.01 s, 6 s in all"), "{looked}");
    assert!(
        looked.contains("'c0' has no name and rises evenly: it is taken as the sample instants"),
        "{looked}"
    );
    let line = next(&looked);
    assert!(
        line.starts_with("flexure identify bare.csv --input c1 --output c2") && line.ends_with(" --time c0"),
        "{line}"
    );
    assert_eq!(typed(&folder, line).code, Some(0));
    let refused = folder.run("identify bare.csv");
    assert_eq!(refused.code, Some(2));
    assert!(
        refused
            .stderr
            .contains("; 'c0' rises evenly: say --time c0 if it has the sample instants\n"),
        "{refused:?}"
    );
    assert_eq!(folder.run("identify bare.csv --time c0").code, Some(0));
    // A count of the rows has no instants.
    log(&folder, "counted.csv", "", |k, u, y| format!("{k},{u},{y}"));
    let looked = folder.run("look counted.csv").stdout;
    assert!(!looked.contains("--time c0"), "{looked}");
}

#[test]
fn a_clock_whose_numbers_do_not_show_it_is_named() {
    let folder = Folder::new();
    log(&folder, "stamps.csv", "timestamp_us,u,y\n", |k, u, y| {
        format!("{},{u},{y}", 1_760_000_000_000_000_u64 + 10_000 * k as u64)
    });
    let looked = folder.done("look stamps.csv");
    assert!(
        looked.contains("'timestamp_us' has the sample instants, in units of 1e-6 s."),
        "{looked}"
    );
    log(&folder, "plain.csv", "t,u,y\n", |k, u, y| {
        format!("{},{u},{y}", 0.01 * k as f64)
    });
    assert!(!folder.done("look plain.csv").contains("sample instants"));
}

#[test]
fn a_constant_column_is_no_signal() {
    let folder = Folder::new();
    log(&folder, "constant.csv", "t,enable,u,y\n", |k, u, y| {
        format!("{},1,{u},{y}", 0.01 * k as f64)
    });
    let outcome = folder.run("identify constant.csv");
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    assert!(
        outcome.stderr.contains(
            "note: constant.csv: the input is 'u', the output 'y'; 'enable' is constant, and the file has no other signals (--input and --output swap them)\n"
        ),
        "{outcome:?}"
    );
}
