//! `flexure identify --method`: the refined method is the default. An option that only one method has chooses that method.

mod common;

use common::{Folder, numbers};
use flexure::identify::RefinedHammerstein;
use flexure::systems::KnownNonlinearity;
use serde_json::Value;

const IDENTIFY: &str = "identify r.csv --input u --output y";

/// The record that most of these tests use: a dead zone from -0.5 to 0.7.
fn folder(samples: usize) -> Folder {
    let folder = Folder::new();
    folder.known("r.csv", samples, 3);
    folder
}

/// The error of the estimated nonlinearity relative to the dead zone's spread, by trapezoids over the inputs from -1.9 to 1.9; scale
/// and offset, which the data cannot tell, are those of the best fit.
fn error(found: &Value) -> f64 {
    let (x, y) = (
        numbers(&found["nonlinearity"]["x"]),
        numbers(&found["nonlinearity"]["y"]),
    );
    let points: Vec<[f64; 3]> = (1..x.len() - 1)
        .filter(|&i| x[i].abs() < 1.9)
        .map(|i| {
            [
                0.5 * (x[i + 1] - x[i - 1]),
                KnownNonlinearity::DeadZone.value(x[i]),
                y[i],
            ]
        })
        .collect();
    let mean = |f: &dyn Fn(&[f64; 3]) -> f64| {
        let weight: f64 = points.iter().map(|p| p[0]).sum();
        points.iter().map(|p| p[0] * f(p)).sum::<f64>() / weight
    };
    let (truth, estimate) = (mean(&|p| p[1]), mean(&|p| p[2]));
    let joint = mean(&|p| (p[1] - truth) * (p[2] - estimate));
    let spreads = mean(&|p| (p[1] - truth).powi(2)) * mean(&|p| (p[2] - estimate).powi(2));
    (1.0 - joint * joint / spreads).max(0.0).sqrt()
}

#[test]
fn the_default_recovers_the_dead_zone_far_better_than_the_plain_method() {
    let folder = folder(10_000);
    let (default, plain) = (
        folder.json(IDENTIFY),
        folder.json(&format!("{IDENTIFY} --method plain")),
    );
    assert_eq!(
        (&default["method"], &plain["method"]),
        (&"refined".into(), &"plain".into())
    );
    assert_eq!(default, folder.json(&format!("{IDENTIFY} --method refined")));
    let errors = [error(&default), error(&plain)];
    println!(
        "errors {errors:?}, fits {} and {} %",
        default["fit_percent"], plain["fit_percent"]
    );
    assert!(errors[0] < 0.01 && errors[0] < errors[1] / 5.0, "{errors:?}");
    let kinks: Vec<f64> = (default["breakpoints"].as_array().unwrap().iter())
        .map(|b| {
            assert_eq!(b["kind"], "kink", "{b}");
            b["at"].as_f64().unwrap()
        })
        .collect();
    assert_eq!(kinks.len(), 2, "{kinks:?}");
    assert!(
        (kinks[0] + 0.5).abs() < 0.02 && (kinks[1] - 0.7).abs() < 0.02,
        "{kinks:?}"
    );
}

#[test]
fn options_of_the_plain_method_imply_it() {
    let folder = folder(1200);
    for option in [
        "--lag 1",
        "--nonlinearity spline",
        "--bandwidth 0.3",
        "--bandwidth auto",
        "--kernel uniform",
        "--ignore-colour",
    ] {
        let expected = folder.json(&format!("{IDENTIFY} --method plain {option}"));
        let outcome = folder.run(&format!("{IDENTIFY} --json {option}"));
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        let found: Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert_eq!(found, expected, "{option}");
        let name = option.split(' ').next().unwrap();
        assert_eq!(
            outcome.stderr,
            format!("note: {name} implies --method plain; the default is --method refined\n")
        );
    }
    let help = folder.done("identify --help");
    assert!(
        help.contains("Options of --method plain (each of these options selects it):"),
        "{help}"
    );
}

#[test]
fn options_of_another_method_are_refused() {
    let folder = folder(600);
    for (options, message) in [
        (
            "--method refined --kernel uniform",
            "--kernel is an option of --method plain, not of --method refined; leave it out, or choose --method plain",
        ),
        (
            "--method refined --parameter auto",
            "--parameter is an option of --method plain, not of --method refined; leave it out, or choose --method plain",
        ),
        (
            "--method refined --ignore-colour",
            "--ignore-colour is an option of --method plain, not of --method refined; leave it out, or choose --method plain",
        ),
        (
            "--form dead-zone --lag 0",
            "--form is an option of --method refined, --lag one of --method plain; leave one of them out",
        ),
    ] {
        folder.misused(&format!("{IDENTIFY} -o new.json {options}"), message);
    }
}

/// A parameter of the requested form: its value and its standard error.
fn parameter(found: &Value, name: &str) -> [f64; 2] {
    let all = found["form"]["parameters"].as_array().unwrap();
    let one = all
        .iter()
        .find(|p| p["name"] == name)
        .unwrap_or_else(|| panic!("{name}: {all:?}"));
    ["value", "error"].map(|key| one[key].as_f64().unwrap())
}

#[test]
fn the_true_form_is_accepted_with_its_parameters_and_a_wrong_one_refuted() {
    let folder = folder(10_000);
    let accepted = folder.json(&format!("{IDENTIFY} --form dead-zone --report page.html -o m.json"));
    assert_eq!(accepted["form"]["name"], "dead-zone");
    assert_eq!(accepted["form"]["holds"], true, "{}", accepted["form"]);
    for (name, truth) in [("low", -0.5), ("high", 0.7)] {
        let [value, error] = parameter(&accepted, name);
        assert!(
            error > 0.0 && error < 0.02 && (value - truth).abs() < 4.0 * error,
            "{name}: {value} ± {error}"
        );
    }
    let page = folder.read("page.html");
    assert!(page.contains("Form dead-zone") && page.contains("The data do not refute this form"));
    let printed = folder.said(&format!("{IDENTIFY} --form dead-zone"));
    assert!(printed.contains(" form dead-zone low = -0."), "{printed}");
    assert!(
        printed.contains("the data do not refute this form (lack of fit "),
        "{printed}"
    );

    let refuted = folder.json(&format!("{IDENTIFY} --form polynomial:2 --report page.html"));
    let form = &refuted["form"];
    assert_eq!((&form["name"], &form["holds"]), (&"polynomial:2".into(), &false.into()));
    assert!(
        form["statistic"].as_f64().unwrap() > form["limit"].as_f64().unwrap(),
        "{form}"
    );
    assert!(form["p_value"].as_f64().unwrap() < 1e-6, "{form}");
    assert!(folder.read("page.html").contains("The data refute this form at 1 %"));
    // A form is a remark on the estimate, and changes nothing of it.
    assert_eq!(refuted["nonlinearity"], accepted["nonlinearity"]);
}

/// A form needs more distinct inputs than it has parameters.
#[test]
fn a_form_that_the_record_cannot_decide_is_an_error_that_writes_nothing() {
    let folder = Folder::new();
    let record = common::known(600, 1);
    let columns = record.column("u").unwrap().iter().zip(record.column("y").unwrap());
    let rows: String = columns.map(|(u, y)| format!("{},{y}\n", u.signum())).collect();
    folder.write("r.csv", format!("u,y\n{rows}"));
    let outcome = folder.run(&format!("{IDENTIFY} --form friction -o new.json"));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(
        outcome.stderr.starts_with(
            "error: r.csv: a form of the nonlinearity with a test (distinct inputs of a refined estimate) needs"
        ),
        "{outcome:?}"
    );
    assert!(!folder.path("new.json").exists());
}

#[test]
fn missing_outputs_are_skipped_on_request() {
    let folder = Folder::new();
    let record = common::known(6000, 3);
    let columns = record.column("u").unwrap().iter().zip(record.column("y").unwrap());
    // Every 17th output is empty, every 34th of them nan; line 1 is the header.
    let row = |(k, (u, y)): (usize, (&f64, &f64))| match (k % 17, k % 34) {
        (3, 3) => format!("{u},\n"),
        (3, _) => format!("{u},nan\n"),
        _ => format!("{u},{y}\n"),
    };
    let rows: String = columns.enumerate().map(row).collect();
    folder.write("r.csv", format!("u,y\n{rows}"));
    folder.failed(
        &format!("{IDENTIFY} -o new.json"),
        "r.csv, line 5: column 'y' is NaN or missing at sample 3; remove or repair that sample, or say --missing: samples without an output then do not count",
    );
    let found = folder.json(&format!("{IDENTIFY} --missing --report page.html"));
    assert_eq!(found["samples_fitted"], 4500);
    let missing = (4500..6000).filter(|k| k % 17 == 3).count();
    assert_eq!(found["samples_fresh"], 1500 - missing);
    assert!(error(&found) < 0.02, "{}", error(&found));
    assert!(
        folder
            .read("page.html")
            .contains(&format!("1500 kept for the verdict ({missing} of those missing)"))
    );
    // No sample of the input may be missing.
    folder.write(
        "r.csv",
        format!("u,y\n{}", rows.replacen(rows.split(',').next().unwrap(), "", 1)),
    );
    folder.failed(
        &format!("{IDENTIFY} --missing -o new.json"),
        "r.csv, line 2: column 'u' is NaN or missing at sample 0; remove or repair that sample, or say --fill N: gaps of at most N samples are then interpolated",
    );
}

/// The page of the refined method shows all its results, and no card for results that it does not have.
#[test]
fn the_page_shows_what_the_method_has() {
    let folder = folder(6000);
    folder.done(&format!("{IDENTIFY} --report refined.html --order 2"));
    folder.done(&format!("{IDENTIFY} --report plain.html --method plain"));
    let (refined, plain) = (folder.read("refined.html"), folder.read("plain.html"));
    for (expected, by_refined, by_plain) in [
        ("<dt>Breakpoints</dt>", true, false),
        ("Breakpoints of the nonlinearity", true, false),
        ("kinks at ", true, false),
        ("has the smallest Schwarz criterion", true, false),
        ("<dt>Bandwidth</dt>", false, true),
        ("Delay and lag of the regression", false, true),
        ("leave-one-out", false, true),
        ("95 % pointwise, for this number of breakpoints", true, false),
        ("95 % pointwise, variance only", false, true),
        ("As given.", true, false),
    ] {
        assert_eq!(
            (refined.contains(expected), plain.contains(expected)),
            (by_refined, by_plain),
            "{expected}"
        );
    }
}

/// What both methods have reaches the refined one too.
#[test]
fn the_refined_method_takes_what_is_given() {
    let folder = folder(3000);
    let with = |options: &str| folder.json(&format!("{IDENTIFY} {options}"));
    let found = with("--order 3 --delay 0");
    assert_eq!((&found["order"], &found["delay"]), (&3.into(), &0.into()));
    assert_eq!(found["order_scores"]["order"], serde_json::json!([3]));
    assert_eq!(with("--fresh 0.5")["samples_fitted"], 1500);
    let gain = with("");
    assert!((gain["linear"]["static_gain"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    let first = with("--unit first-coefficient");
    let b = numbers(&first["linear"]["b"]);
    let delay = first["delay"].as_u64().unwrap() as usize;
    assert_eq!(b[delay], 1.0);
    // What the convention fixes has no error.
    assert_eq!(numbers(&first["linear"]["b_errors"])[delay], 0.0);
    // Two points at which the dead zone is known.
    let known = with("--known -1.5=-1 1.7=1");
    for (at, phi) in [(-1.5, -1.0), (1.7, 1.0), (0.1, 0.0)] {
        let (x, y) = (
            numbers(&known["nonlinearity"]["x"]),
            numbers(&known["nonlinearity"]["y"]),
        );
        let i = x.iter().rposition(|&x| x <= at).unwrap();
        let value = y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]);
        assert!((value - phi).abs() < 0.02, "{at}: {value}");
    }
    for other in [&first, &known] {
        let difference = other["fit_percent"].as_f64().unwrap() - gain["fit_percent"].as_f64().unwrap();
        assert!(difference.abs() < 0.01, "{difference}");
    }
    folder.failed(
        &format!("{IDENTIFY} -o new.json --delay 600"),
        "r.csv: the delay is 600, but must be below a quarter of the number of samples that are fitted",
    );
}

/// Several records are several experiments: better than one of them, as one long record, and what takes one is told.
#[test]
fn several_records_are_several_experiments() {
    let folder = Folder::new();
    let lengths = [1500, 2500, 2000];
    let parts: Vec<_> = (0..3)
        .map(|k| folder.known(&format!("{k}.csv"), lengths[k], 7 + k as u64))
        .collect();
    let three = "identify 0.csv 1.csv 2.csv --input u --output y";
    let found = folder.json(&format!("{three} -o model.json --report r.html"));
    assert_eq!(found["samples_fitted"], 4500);
    assert_eq!(found["samples_fresh"], 1500);
    let one = folder.json("identify 0.csv --input u --output y");
    assert!(error(&found) < 0.8 * error(&one), "{} {}", error(&found), error(&one));
    // The library on the same records.
    let records: Vec<_> = parts.iter().collect();
    let twin = RefinedHammerstein::default()
        .identify_experiments(&records, "u", "y")
        .unwrap();
    let y = numbers(&found["nonlinearity"]["y"]);
    assert_eq!(y, twin.curve("nonlinearity").unwrap().y());
    assert!(folder.read("r.html").contains("0.csv, 1.csv, 2.csv"));
    folder.done("validate model.json 2.csv --input u --output y");

    let several = "3 records are as many experiments of one system, which only --structure hammerstein by the refined method takes; name one \
                   record";
    folder.misused(&format!("{three} --structure wiener"), several);
    folder.misused(&format!("{three} --method plain"), several);
    folder.misused(
        &format!("{three} --period 100"),
        "--period is for one record, and 3 are named; name one, or leave the option out",
    );
    folder.write("slow.csv", "t,u,y\n0,1,2\n0.5,2,3\n1,3,4\n");
    folder.write("fast.csv", "t,u,y\n0,1,2\n0.1,2,3\n0.2,3,4\n");
    folder.failed(
        "identify slow.csv fast.csv --input u --output y",
        "fast.csv: the sample time is 0.1 s, but that of slow.csv is 0.5 s; experiments of one system need the same: resample one of them",
    );
    folder.write("gap.csv", "u,y\n1,2\n2,\n3,4\n");
    folder.failed(
        "identify 0.csv gap.csv --input u --output y",
        "gap.csv, line 3: column 'y' is NaN or missing at sample 1; remove or repair that sample",
    );
}
