//! `flexure look` on logs of joints: by names, by units, and by what a position does under a torque.

mod common;

use common::{Folder, next};
use flexure::Record;
use flexure_io::write_record;
use serde_json::Value;

/// An arm whose shoulder moves.
fn shoulder() -> String {
    let link = "[[arm.link]]\nmass = 1.5075\nlength = 4.5\ncom = 2.25\ninertia = 2.544\n";
    let joint = "[[arm.joint]]\nmotor_inertia = 1.0\ncubic = 500.0\nlinear = 500.0\nwindup = 10.0\nwindup_sharpness = 3000.0\n\
                 friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]\n";
    format!(
        "[arm]\nmodel = \"nonlinear\"\n{link}{link}{joint}{joint}locked = true\n[run]\nduration = 40.0\nsample_time = 0.002\n\
         [excitation]\nkind = \"multisine\"\nseed = 1\namplitude = 8.0\nf_min = 0.05\nf_max = 5.0\n\
         [noise]\nstd = {{ tau1 = 0.1, q1 = 1e-5, qm1 = 1e-5 }}\n"
    )
}

#[test]
fn two_encoders_and_two_joints() {
    let folder = Folder::new();
    folder.write("shoulder.toml", shoulder());
    folder.done("simulate shoulder.toml -o one.csv");
    assert_eq!(
        next(&folder.done("look one.csv")),
        "flexure joint one.csv --motor qm1 --link q1 --torque tau1 --report report.html"
    );
    // The same log by words and units; and one column chosen by the user.
    let file = flexure_io::read_record(folder.path("one.csv")).unwrap();
    let names = [
        ("t", "t"),
        ("motor_rad", "qm1"),
        ("load_rad", "q1"),
        ("torque_Nm", "tau1"),
    ];
    let columns = names.map(|(name, column)| (name, file.column(column).unwrap().to_vec()));
    write_record(folder.path("units.csv"), &Record::new(columns).unwrap()).unwrap();
    let expected = "flexure joint units.csv --motor motor_rad --link load_rad --torque torque_Nm --report report.html";
    for command in ["look units.csv", "look units.csv --input torque_Nm --output load_rad"] {
        assert_eq!(next(&folder.done(command)), expected, "{command}");
    }
    // Single lost samples are interpolated, and the joint stays a flexible one.
    let mut rows: Vec<String> = folder.read("units.csv").lines().take(8000).map(str::to_owned).collect();
    for row in rows.iter_mut().skip(17).step_by(3000) {
        let mut fields: Vec<&str> = row.split(',').collect();
        fields[2] = "";
        *row = fields.join(",");
    }
    folder.write("gaps.csv", rows.join("\n"));
    let looked = folder.done("look gaps.csv");
    assert_eq!(
        next(&looked),
        "flexure joint gaps.csv --motor motor_rad --link load_rad --torque torque_Nm --fill 1 --report report.html",
        "{looked}"
    );
    let columns = "--motor motor_rad --link load_rad --torque torque_Nm";
    let refused = folder.run(&format!("joint gaps.csv {columns}")).stderr;
    assert!(
        refused.contains("or say --fill N: gaps of at most N samples are then interpolated"),
        "{refused}"
    );
    let noted = folder
        .run(&format!("joint gaps.csv {columns} --convert load_rad=rad:rad"))
        .stderr;
    assert!(
        noted.contains("(--fill 1 interpolates the gaps, of at most 1 sample, and uses all)"),
        "{noted}"
    );
    folder.done("simulate --preset motor-log -o two.csv");
    assert_eq!(
        next(&folder.done("look two.csv")),
        "flexure joint two.csv --motor qm1,qm2 --link q1,q2 --torque tau1,tau2 --report report.html"
    );
}

#[test]
fn an_axis_is_known_by_names_that_end_in_units() {
    let folder = Folder::new();
    let [t, torque, q] = common::axis(12_000);
    let degrees: Vec<f64> = q.iter().map(|q| q.to_degrees()).collect();
    let late: Vec<f64> = (0..degrees.len())
        .map(|i| degrees[(i + 8).min(degrees.len() - 1)])
        .collect();
    let plain = [("t", t.clone()), ("c1", torque.clone()), ("c2", q)];
    let named = [("t", t), ("ref_deg", late), ("q_deg", degrees), ("tau_Nm", torque)];
    write_record(folder.path("plain.csv"), &Record::new(plain).unwrap()).unwrap();
    write_record(folder.path("named.csv"), &Record::new(named).unwrap()).unwrap();
    // A current drives a torque.
    let file = flexure_io::read_record(folder.path("plain.csv")).unwrap();
    let column = |name: &str| file.column(name).unwrap().to_vec();
    for torque in ["i_q/A", "I_q"] {
        let current = [("t", column("t")), (torque, column("c1")), ("pos_act", column("c2"))];
        write_record(folder.path("current.csv"), &Record::new(current).unwrap()).unwrap();
        let looked = folder.said("look current.csv");
        let command = format!("flexure joint current.csv --position pos_act --torque {torque} ");
        assert!(looked.contains(&command), "{looked}");
        let note = format!("'{torque}' is a current: add --torque-constant KT, in N m for each A");
        assert!(looked.contains(&note), "{looked}");
    }
    let noted = folder.run("joint current.csv --position pos_act --torque I_q").stderr;
    assert!(
        noted.contains("'I_q' is a current by its name, and 1 A is taken as 1 N m: --torque-constant gives"),
        "{noted}"
    );
    // Words that say nothing, beside units that do; the setpoint is no input.
    let log = "t;Sollwert;Istwert;Antrieb\n[s];[deg];[deg];[A]\n".to_owned();
    let rows = (0..12_000).map(|k| {
        let [t, u, q] = ["t", "c1", "c2"].map(|name| file.column(name).unwrap()[k]);
        format!("{t};{};{};{u}\n", q.to_degrees(), q.to_degrees())
    });
    folder.write("units.csv", log + &rows.collect::<String>());
    let looked = folder.run("look units.csv").stdout;
    assert_eq!(
        next(&looked),
        "flexure joint units.csv --position Istwert --torque Antrieb --report report.html",
        "{looked}"
    );
    let noted = folder.run("joint units.csv --position Istwert --torque Antrieb").stderr;
    assert!(
        noted.contains("'Antrieb' is in A, and 1 A is taken as 1 N m"),
        "{noted}"
    );
    let known = folder
        .run("joint units.csv --position Istwert --torque Antrieb --torque-constant 0.5")
        .stderr;
    assert!(!known.contains("is taken as"), "{known}");
    let line = next(&folder.done("look named.csv")).to_owned();
    assert_eq!(
        line,
        "flexure joint named.csv --position q_deg --torque tau_Nm --report report.html"
    );
    let inertia = |command: &str| {
        let joint: Value = serde_json::from_str(&folder.run(command).stdout).unwrap();
        joint["inertia"]["value"].as_f64().unwrap()
    };
    let [in_degrees, in_radians] = [
        inertia("joint named.csv --position q_deg --torque tau_Nm --json"),
        inertia("joint plain.csv --position c2 --torque c1 --json"),
    ];
    assert!(
        (in_degrees / in_radians - 1.0).abs() < 1e-9,
        "{in_degrees} {in_radians}"
    );
    // Without a structure, linear dynamics are fitted, which have a place for an integrator.
    let noted = folder.run("identify plain.csv --input c1 --output c2");
    let note = "note: 'c2' integrates 'c1', so that the structure linear is taken; if they are a position and a torque or force: \
                flexure joint plain.csv --position c2 --torque c1";
    assert!(noted.stderr.contains(note), "{}", noted.stderr);
    assert!(
        noted.stdout.starts_with("Linear model from 'c1' to 'c2'"),
        "{}",
        noted.stdout
    );
}
