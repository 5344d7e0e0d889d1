//! `flexure look`: what it says about records with a known truth. The command that it suggests runs as printed.

mod common;

use common::{Folder, mat, next, outcome, typed};
use flexure::Record;
use flexure::identify::Warning;
use flexure_io::write_record;
use serde_json::Value;

#[test]
fn a_system_is_identified_by_the_command_that_is_printed() {
    let folder = Folder::new();
    let record = common::known(3000, 1);
    let columns = ["u", "y"].map(|name| (name, record.column(name).unwrap().to_vec()));
    // A name that a shell would take apart.
    write_record(folder.path("my log's.csv"), &Record::new(columns).unwrap()).unwrap();
    let mut look = folder.command("look");
    let found = outcome(look.arg("my log's.csv"));
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""), "{found:?}");
    assert!(
        found.stdout.contains("'y' follows 'u' without delay"),
        "{}",
        found.stdout
    );
    let line = next(&found.stdout);
    assert!(
        line.starts_with(r"flexure identify 'my log'\''s.csv' --input u --output y"),
        "{line}"
    );
    let identified = typed(&folder, line);
    assert_eq!(identified.code, Some(0), "{identified:?}");
    assert!(folder.read("report.html").starts_with("<!"));
    assert!(folder.read("model.json").contains("\"output\""));
}

#[test]
fn how_the_record_was_read_is_part_of_the_command() {
    let folder = Folder::new();
    let record = common::known(600, 2);
    let rows = (0..600).map(|i| {
        let cell = |name: &str| format!("{:.6}", record.column(name).unwrap()[i]).replace('.', ",");
        format!("{};{};{:.3}\n", cell("u"), cell("y"), 0.01 * i as f64)
    });
    let text: String = rows.map(|row| row.replace('.', ",")).collect();
    folder.write("log.txt", format!("made by a logger\n{text}"));
    let printed = folder.run("look log.txt --skip-lines 1 --header no --separator semicolon --decimal comma --time c2");
    assert_eq!(printed.code, Some(0), "{printed:?}");
    let line = next(&printed.stdout);
    for option in [
        "--skip-lines 1",
        "--header no",
        "--separator semicolon",
        "--decimal comma",
        "--time c2",
    ] {
        assert!(line.contains(option), "{line}");
    }
    assert!(line.contains("--input c0 --output c1"), "{line}");
    assert_eq!(typed(&folder, line).code, Some(0));
    assert!(
        printed.stdout.contains("every 0.01 s, 6 s in all"),
        "{}",
        printed.stdout
    );
}

#[test]
fn an_axis_is_a_joint_and_identify_says_so() {
    let folder = Folder::new();
    let [t, vir, qm] = common::axis(12_000);
    let columns: [(&str, &[f64]); 4] = [("t", &t), ("vir", &vir), ("qm", &qm), ("gtau", &[35.0])];
    folder.write("axis.mat", mat(&columns));
    let text = folder.done("look axis.mat");
    let line = next(&text);
    assert_eq!(
        line,
        "flexure joint axis.mat --position qm --torque vir --torque-constant gtau --prismatic --report report.html"
    );
    assert!(
        text.contains("'qm' integrates 'vir', as a position integrates a force"),
        "{text}"
    );
    let found = typed(&folder, &format!("{line} --json"));
    let joint: Value = serde_json::from_str(&found.stdout).unwrap();
    let inertia = joint["inertia"]["value"].as_f64().unwrap_or_else(|| panic!("{joint}"));
    assert!((inertia / 95.0 - 1.0).abs() < 0.05, "{inertia}");
    // The same for names that say nothing: only the data decide.
    write_record(
        folder.path("plain.csv"),
        &Record::new([("t", t), ("c1", vir), ("c2", qm)]).unwrap(),
    )
    .unwrap();
    let line = next(&folder.done("look plain.csv")).to_owned();
    assert_eq!(
        line,
        "flexure joint plain.csv --position c2 --torque c1 --report report.html"
    );
    let warned = folder.json("identify plain.csv --input c1 --output c2 --structure hammerstein");
    let expected = Warning::IntegratedOutput {
        input: "c1".to_owned(),
        output: "c2".to_owned(),
    };
    assert_eq!(warned["warnings"][0], expected.to_string());
}

/// What `flexure joint` would refuse, or find an inertia in that cannot be, is not suggested.
#[test]
fn no_joint_is_suggested_that_cannot_be_identified() {
    let folder = Folder::new();
    // A link whose motor is no motor of it: its angle is that of the link and some of the torque.
    let [t, tau, q] = common::axis(4000);
    let motor: Vec<f64> = q.iter().zip(&tau).map(|(q, tau)| q + 1e-4 * tau).collect();
    let columns = [("t", &t), ("q", &q), ("qm", &motor), ("tau", &tau)].map(|(name, column)| (name, column.clone()));
    write_record(folder.path("one.csv"), &Record::new(columns).unwrap()).unwrap();
    let text = folder.done("look one.csv");
    assert_eq!(
        next(&text),
        "flexure joint one.csv --position qm --torque tau --report report.html",
        "{text}"
    );
    assert!(text.contains("A flexible joint was tried, too: "), "{text}");
    // A torque of the wrong sign.
    let turned: Vec<f64> = tau.iter().map(|tau| -tau).collect();
    let columns = [("t", t), ("q", q), ("tau", turned)];
    write_record(folder.path("turned.csv"), &Record::new(columns).unwrap()).unwrap();
    let text = folder.done("look turned.csv");
    assert!(next(&text).starts_with("the same with --input A --output Y"), "{text}");
    assert!(
        text.contains("No joint can be identified from the motion under 'tau'"),
        "{text}"
    );
}

/// A controller's setpoint leads the output, but acts through the controller's output.
#[test]
fn a_setpoint_is_no_input_beside_what_its_controller_does() {
    let folder = Folder::new();
    let known = common::known(4000, 5);
    let [op, pv] = ["u", "y"].map(|name| known.column(name).unwrap().to_vec());
    let sp: Vec<f64> = op
        .iter()
        .enumerate()
        .map(|(i, u)| u + 0.3 * (0.01 * i as f64).sin())
        .collect();
    let columns = [("LIC_SP", sp), ("LIC_OP", op), ("LIC_PV", pv)];
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let said = folder.said("look r.csv");
    assert!(
        said.contains("Left out: 'LIC_SP'.")
            && said.contains(
                "'LIC_SP' is by its name a setpoint, so a controller may make 'LIC_OP' from 'LIC_PV' (closed loop)"
            ),
        "{said}"
    );
    assert!(
        said.contains("next: flexure identify r.csv --input LIC_OP --output LIC_PV "),
        "{said}"
    );
}

/// A force and a position may be of a mass on a spring, which is no axis.
#[test]
fn a_mass_on_a_spring_is_no_axis() {
    let folder = Folder::new();
    let force = common::known(4000, 9).column("u").unwrap().to_vec();
    let position = common::filter(&[0.0, 0.01], &[1.0, -1.8, 0.85], &force, 0.0);
    let columns = [("force", force), ("position", position)];
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let line = next(&folder.done("look r.csv")).to_owned();
    assert!(
        line.starts_with("flexure identify r.csv --input force --output position"),
        "{line}"
    );
}

#[test]
fn missing_outputs_several_inputs_and_two_levels() {
    let folder = Folder::new();
    let record = common::known(2000, 3);
    let (u, mut y) = (
        record.column("u").unwrap().to_vec(),
        record.column("y").unwrap().to_vec(),
    );
    let other = common::known(2000, 4);
    let (p, added) = (other.column("u").unwrap().to_vec(), other.column("y").unwrap().to_vec());
    let both: Vec<f64> = y.iter().zip(&added).map(|(a, b)| a + b).collect();
    let three = [("speed", u.clone()), ("valve", p), ("level", both)];
    write_record(folder.path("three.csv"), &Record::new(three).unwrap()).unwrap();
    let line = next(&folder.done("look three.csv")).to_owned();
    assert!(line.contains("--input speed,valve --output level"), "{line}");

    y[100] = f64::NAN;
    write_record(
        folder.path("missing.csv"),
        &Record::new([("u", u.clone()), ("y", y)]).unwrap(),
    )
    .unwrap();
    let text = folder.done("look missing.csv");
    assert!(
        next(&text).contains("--input u --output y --structure auto --missing"),
        "{text}"
    );
    assert!(text.contains("'y' misses 1 sample (0.050 %)"), "{text}");
    assert_eq!(typed(&folder, next(&text)).code, Some(0));

    let levels: Vec<f64> = u.iter().map(|u| u.signum()).collect();
    let response: Vec<f64> = levels.windows(2).map(|w| w[0] + 0.3 * w[1]).collect();
    let two = [("u", levels[1..].to_vec()), ("y", response)];
    write_record(folder.path("two.csv"), &Record::new(two).unwrap()).unwrap();
    let line = next(&folder.done("look two.csv")).to_owned();
    assert_eq!(
        line,
        "flexure identify two.csv --input u --output y --structure linear -o model.json --report report.html"
    );
}

#[test]
fn a_column_with_one_text_among_its_numbers_is_a_warning() {
    let folder = Folder::new();
    let record = common::known(300, 4);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let rows = u.iter().zip(y).enumerate().map(|(i, (u, y))| match i {
        9 => format!("{u},OVER\n"),
        _ => format!("{u},{y}\n"),
    });
    folder.write("over.csv", format!("u,y\n{}", rows.collect::<String>()));
    let text = folder.done("look over.csv");
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        flat.contains("warning: Line 11: column 'y' holds 'OVER' at sample 9, which is not a number"),
        "{text}"
    );
}

#[test]
fn what_is_named_decides() {
    let folder = Folder::new();
    folder.known("r.csv", 1000, 5);
    let line = next(&folder.done("look r.csv --input y --output u")).to_owned();
    assert!(line.contains("--input y --output u"), "{line}");
    folder.failed(
        "look r.csv --input volts",
        "r.csv: no column 'volts'; the columns are: u, y, y0",
    );
    folder.misused(
        "look r.csv --input u --output u",
        "--input and --output are both 'u'; name two different columns",
    );
}

#[test]
fn json_and_gaps_in_time() {
    let folder = Folder::new();
    let record = common::known(1000, 6);
    let mut t: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
    t[500..].iter_mut().for_each(|t| *t += 0.2);
    let column = |name: &str| record.column(name).unwrap().to_vec();
    let columns = [
        ("t", t),
        ("u", column("u")),
        ("y", column("y")),
        ("mode", vec![3.0; 1000]),
    ];
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let found = folder.json("look r.csv");
    assert_eq!(found["clock"]["gaps"][0]["sample"], 500);
    assert!((found["sample_time"].as_f64().unwrap() - 0.01).abs() < 1e-9);
    assert_eq!(found["columns"][3]["constant"], true);
    let first = &found["dependences"][0];
    assert_eq!(
        (&first["cause"], &first["effect"], &first["delay"]),
        (&"u".into(), &"y".into(), &0.into())
    );
    let line = found["next"]["command"].as_str().unwrap();
    assert!(
        line.starts_with("flexure identify r.csv --input u --output y --structure auto "),
        "{line}"
    );
    assert!(line.contains(" --resample 0.01 -o "), "{line}");
    let identified = typed(&folder, line);
    let used = "the longest part without a gap is used, 500 of 1,020 samples, from 0 s to 4.99 s";
    assert!(identified.stderr.contains(used), "{identified:?}");
    let findings = found["findings"].to_string();
    assert!(
        findings.contains("'t' has 1 gap, before sample 500 (line 502): about 20 samples lost"),
        "{findings}"
    );
}

#[test]
fn a_clock_that_jitters_too_much_is_resampled() {
    let folder = Folder::new();
    let record = common::known(1000, 6);
    let late = |i: u32| if i % 7 == 3 { 0.003 } else { 0.0 };
    let t: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i) + late(i)).collect();
    let column = |name: &str| record.column(name).unwrap().to_vec();
    let levels: Vec<f64> = column("u").iter().map(|u| u.signum()).collect();
    let response = common::filter(&[0.0, 0.5], &[1.0, -0.5], &levels, 0.0);
    let columns = [("t", t), ("u", levels), ("y", response)];
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let text = folder.done("look r.csv");
    let line = next(&text);
    let command = "flexure identify r.csv --input u --output y --structure linear --resample 0.01 --hold u -o";
    assert!(line.starts_with(command), "{line}");
    assert!(text.contains("differ from the median step by up to 30 %"), "{text}");
    let outcome = typed(&folder, line);
    assert!(outcome.stderr.contains("are now 1,000 every 0.01 s"), "{outcome:?}");
    // The model keeps the steps.
    let validated = folder.run("validate model.json r.csv");
    assert!(
        validated
            .stderr
            .contains("is read with the options of the model's log: --hold u --resample 0.01"),
        "{validated:?}"
    );
}

#[test]
fn a_terminal_is_not_flooded_with_columns() {
    let folder = Folder::new();
    let names: Vec<String> = (0..103).map(|k| format!("c{k}")).collect();
    let rows = (0..9).map(|row| {
        (0..103)
            .map(|k| ((k % 5 + 1) * row % 7).to_string())
            .collect::<Vec<_>>()
            .join(",")
    });
    let text: Vec<String> = std::iter::once(names.join(",")).chain(rows).collect();
    folder.write("r.csv", text.join("\n"));
    let found = outcome(folder.command("look").arg("r.csv"));
    assert!(
        found.stdout.contains("\n  c99 ") && !found.stdout.contains("\n  c100 "),
        "{}",
        found.stdout
    );
    assert!(
        found.stdout.contains("and 3 more columns: see --report or --json"),
        "{}",
        found.stdout
    );
    // Each column has few levels, which is noted of some.
    assert!(
        found.stdout.contains(" more notes: see --report or --json"),
        "{}",
        found.stdout
    );
    assert!(found.stdout.lines().count() < 200, "{}", found.stdout);
    let found = outcome(folder.command("look").args(["r.csv", "--json"]));
    let json: Value = serde_json::from_str(&found.stdout).unwrap();
    assert_eq!(json["columns"].as_array().unwrap().len(), 103);
    // The page draws a hundred of them, and a name may be longer than any width.
    folder.done("look r.csv --report page.html");
    assert!(
        folder
            .read("page.html")
            .contains("The first 100 of 103 signals are drawn.")
    );
    let rows = "1,2\n2,1\n3,5\n4,4\n".repeat(20);
    folder.write("long.csv", format!("u,{}\n{rows}", "x".repeat(70_000)));
    let found = outcome(folder.command("look").arg("long.csv"));
    assert!(found.code == Some(0) && found.stdout.len() < 10_000, "{found:?}");
}

#[test]
fn nothing_to_identify() {
    let folder = Folder::new();
    let [a, b] = [7, 8].map(|seed| common::known(1000, seed).column("u").unwrap().to_vec());
    write_record(folder.path("r.csv"), &Record::new([("left", a), ("right", b)]).unwrap()).unwrap();
    let text = folder.done("look r.csv --report look.html");
    assert!(text.contains("No column was seen to depend on another"), "{text}");
    assert!(next(&text).starts_with("the same with --input A --output Y"), "{text}");
    assert!(folder.read("look.html").contains("left"));
}

/// A log as a logger in Germany writes it: a lost sample, two codes for "no value", a command that is held for seven samples.
#[test]
fn an_untidy_log_leads_to_a_model_by_the_commands_that_are_printed() {
    let folder = Folder::new();
    let levels = common::known(300, 9).column("u").unwrap().to_vec();
    let u: Vec<f64> = (0..2100).map(|k| levels[k / 7]).collect();
    let force: Vec<f64> = u.iter().map(|u| u.signum() * (u.abs() - 0.4).max(0.0)).collect();
    let noise = common::known(2100, 10).column("u").unwrap().to_vec();
    let y = common::filter(&[0.014], &[1.0, -1.73, 0.744], &force, 0.0);
    let value = |k: usize| match [400, 1700].contains(&k) {
        true => -9999.0,
        false => y[k] + 0.003 * noise[k],
    };
    let rows = (0..2100).filter(|k| *k != 1000);
    let rows = rows.map(|k| format!("{:.3};{:.4};{:.5}\n", 0.005 * k as f64, u[k], value(k)).replace('.', ","));
    let table: String = rows.collect();
    folder.write("log.csv", format!("Zeit [s];Strom [A];Drehzahl\n{table}"));
    let outcome = folder.run("look log.csv");
    let line = next(&outcome.stdout);
    let command = "flexure identify log.csv --input Strom --output Drehzahl --structure auto --outliers Drehzahl --resample 0.005 --hold Strom -o";
    assert!(line.starts_with(command), "{line}");
    let found = typed(&folder, line);
    assert!(
        found
            .stdout
            .contains("Structure from 'Strom' to 'Drehzahl': Hammerstein\n"),
        "{found:?}"
    );
}

#[test]
fn outliers_that_hide_the_dependence_are_taken_out_first() {
    let folder = Folder::new();
    let record = common::known(600, 3);
    let mut y = record.column("y").unwrap().to_vec();
    (y[100], y[101], y[400]) = (-9e9, -9e9, -9e9);
    let columns = [("a", record.column("u").unwrap().to_vec()), ("b", y)];
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let text = folder.done("look r.csv");
    let line = next(&text);
    let command = "flexure identify r.csv --input a --output b --structure auto --outliers b --fill 2 -o model.json";
    assert!(line.starts_with(command), "{line}");
    assert!(text.contains("3 outliers hide what depends on what"), "{text}");
    let outcome = typed(&folder, line);
    assert!(
        outcome.stderr.contains("3 of 600 samples of 'b' are outliers"),
        "{outcome:?}"
    );
}
