//! A motor whose encoder and torque are before its gear.

use super::cannot_tell::{PLAIN, as_it_is, multisine};
use super::common::Folder;
use super::shoulder;

/// The names of the columns are those that drives give. The joint twists, so that the ratio of the motions is not quite that of the gear.
#[test]
fn a_motor_before_its_gear_is_seen_from_the_link() {
    const RATIO: f64 = 50.0;
    let folder = Folder::new();
    folder.write(
        "shoulder.toml",
        shoulder(1, 1.0).replace("linear = 500.0", "linear = 5000.0"),
    );
    folder.done("simulate shoulder.toml -o one.csv");
    let text = folder.read("one.csv");
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let [time, motor, link, torque] = ["t", "qm1", "q1", "tau1"].map(column);
    let mut geared = "t,MotorPos,SetPos,LinkPos,ActTorque\n".to_owned();
    for line in text.lines().skip(1) {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let (at_motor, torque) = (RATIO * values[motor], values[torque] / RATIO);
        let (time, link) = (values[time], values[link]);
        geared += &format!("{time},{at_motor},{},{link},{torque}\n", link + 1e-3);
    }
    folder.write("geared.csv", geared);
    let said = folder.done("look geared.csv");
    let next = "next: flexure joint geared.csv --motor MotorPos --link LinkPos --torque ActTorque --gear-ratio 50 --report report.html\n";
    assert!(said.ends_with(next), "{said}");
    let columns = "--motor MotorPos --link LinkPos --torque ActTorque";
    folder.refused(
        &format!("joint geared.csv {columns}"),
        1,
        "geared.csv: 'MotorPos' goes 50.09 times as far as 'LinkPos', as an angle before the gear does: --gear-ratio 50 divides it by the gear \
         ratio and multiplies the torque by it; take the ratio of the gear's data sheet",
    );
    let commands = [
        &format!("joint geared.csv {columns} --gear-ratio 50"),
        "joint one.csv --motor qm1 --link q1 --torque tau1",
    ];
    let [geared, plain] = commands.map(|command| folder.json(command)["link_inertia"]["value"].as_f64().unwrap());
    assert!((geared / plain - 1.0).abs() < 1e-3, "{geared} {plain}");
}

/// The log of a rigid axis, with the motor's angle in counts of an encoder of 10,000 a turn and the motor's torque, before a gear of 40.
fn at_motor(folder: &Folder, name: &str, start: f64) {
    const GEAR: f64 = 40.0;
    let counts = |q: f64| (GEAR * q * 10_000.0 / std::f64::consts::TAU).round();
    let log = PLAIN.log(|t, _| multisine(t + start), |[q, tau]| [counts(q), tau / GEAR]);
    folder.write(name, log.replacen("q", "enc_counts", 1));
}

#[test]
fn a_rigid_axis_at_its_motor_is_seen_from_the_link() {
    let folder = Folder::new();
    folder.write("plain.csv", PLAIN.log(|t, _| multisine(t), as_it_is));
    at_motor(&folder, "counts.csv", 0.0);
    let looked = folder.done("look counts.csv");
    let next = "next: flexure joint counts.csv --position enc_counts --torque tau --convert enc_counts=rev/N:rad --report report.html\n";
    assert!(looked.ends_with(next), "{looked}");
    let untold = folder.done("joint counts.csv --motor enc_counts --torque tau --gear-ratio 40");
    assert!(
        untold.starts_with("Rigid axis, not reliable because an angle may be in counts of an encoder"),
        "{untold}"
    );
    folder.done("prepare counts.csv --convert enc_counts=rev/10000:rad -o geared.csv");
    let inertia = |command: &str| folder.json(command)["inertia"]["value"].as_f64().unwrap();
    let plain = inertia("joint plain.csv --position q --torque tau");
    let geared = inertia("joint geared.csv --motor enc_counts --torque tau --gear-ratio 40");
    assert!((geared / plain - 1.0).abs() < 2e-3, "{geared} {plain}");
    let command =
        "joint counts.csv --motor enc_counts --torque tau --gear-ratio 40 --convert enc_counts=rev/10000:rad --json";
    let at_once: serde_json::Value = serde_json::from_str(&folder.run(command).stdout).unwrap();
    assert_eq!(at_once["inertia"]["value"], geared);
    // As a position, it is taken as it is, and that is said.
    let noted = folder.run("joint geared.csv --position enc_counts --torque tau --gear-ratio 40");
    let note = "'enc_counts' is taken as the angle behind the gear and is not divided by 40; if it is the motor's, write --motor in place of --position";
    assert!(noted.stderr.contains(note), "{}", noted.stderr);
    let alone = folder.run("joint geared.csv --torque tau --link enc_counts");
    assert!(
        alone.code == Some(2) && alone.stderr.contains("--motor <COLUMN>"),
        "{}",
        alone.stderr
    );
}

#[test]
fn logs_with_lost_rows_are_prepared_alike() {
    let folder = Folder::new();
    let without_rows = |text: String| -> String {
        let rows = text.lines().enumerate();
        let kept = rows
            .filter(|(i, _)| *i < 2 || i % 700 != 0)
            .map(|(_, line)| format!("{line}\n"));
        kept.collect()
    };
    let log = |start: f64| PLAIN.log(move |t, _| multisine(t + start), as_it_is);
    folder.write("plain.csv", log(0.0));
    folder.write("log.csv", without_rows(log(0.0)));
    folder.write("later.csv", without_rows(log(33.0)));
    let said = folder.done("look log.csv");
    let next = "next: flexure joint log.csv --position q --torque tau --resample 0.002 --report report.html\n";
    assert!(said.ends_with(next), "{said}");
    let columns = "--position q --torque tau";
    let uneven = folder.run(&format!("joint log.csv {columns}")).stderr;
    let remedy = format!("flexure joint log.csv {columns} --resample 0.002");
    assert!(uneven.contains(&remedy), "{uneven}");
    let found = folder.run(&format!(
        "joint log.csv {columns} --resample 0.002 --validate later.csv --json"
    ));
    let found: serde_json::Value = serde_json::from_str(&found.stdout).unwrap();
    assert_eq!(found["later"]["holds"], true);
    let plain = folder.json(&format!("joint plain.csv {columns}"));
    let [of_rest, of_all] = [&found, &plain].map(|found| found["inertia"]["value"].as_f64().unwrap());
    assert!((of_rest / of_all - 1.0).abs() < 2e-3, "{of_rest} {of_all}");
}
