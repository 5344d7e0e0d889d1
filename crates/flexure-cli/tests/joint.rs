//! `flexure joint`: from a log to curves, parameters and an arm that moves the same way.

#[path = "joint/axes.rs"]
mod axes;
#[path = "joint/cannot_tell.rs"]
mod cannot_tell;
#[path = "joint/chain.rs"]
mod chain;
mod common;
#[path = "joint/geared.rs"]
mod geared;
#[path = "joint/later.rs"]
mod later;
#[path = "joint/arm.rs"]
mod two_link;

use std::path::PathBuf;

use common::{Folder, numbers};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

/// The shoulder of the space arm with its elbow locked, excited by a multisine of this seed, with noise of this scale.
fn shoulder(seed: u64, noise: f64) -> String {
    let link = "[[arm.link]]\nmass = 1.5075\nlength = 4.5\ncom = 2.25\ninertia = 2.544\n";
    let joint = "[[arm.joint]]\nmotor_inertia = 1.0\ncubic = 500.0\nlinear = 500.0\nwindup = 10.0\nwindup_sharpness = 3000.0\n\
                 friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]\n";
    format!(
        "[arm]\nmodel = \"nonlinear\"\n{link}{link}{joint}{joint}locked = true\n[run]\nduration = 40.0\nsample_time = 0.001\n\
         [excitation]\nkind = \"multisine\"\nseed = {seed}\namplitude = 8.0\nf_min = 0.05\nf_max = 5.0\n\
         [noise]\nstd = {{ tau1 = {}, q1 = {}, qm1 = {} }}\n",
        0.1 * noise,
        1e-5 * noise,
        1e-5 * noise
    )
}

fn value(form: &Value, symbol: &str) -> f64 {
    form["parameters"][symbol]["value"].as_f64().unwrap()
}

#[test]
fn the_identified_arm_moves_as_the_true_one_under_a_fresh_torque() {
    let folder = Folder::new();
    folder.write("truth.toml", shoulder(1, 1.0));
    folder.done("simulate truth.toml -o log.csv");
    let found = folder.json(
        "joint log.csv --motor qm1 --link q1 --torque tau1 --arm arm.toml --stiffness stiffness.csv --friction friction.csv \
         --report report.html",
    );
    assert_eq!(found["joint"], "flexible");
    // 1.5075 (2.25^2 + 4.5^2 + 2.25^2 + 2 4.5 2.25) + 2 2.544
    let inertia = found["link_inertia"]["value"].as_f64().unwrap();
    assert!((inertia - 81.405).abs() < 0.4, "{inertia}");
    let motor = found["motor_inertia"]["value"].as_f64().unwrap();
    assert!((motor - 1.0).abs() < 0.005, "{motor}");
    let stiffness = &found["model"]["stiffness"];
    assert!((value(stiffness, "ksw") - 10.0).abs() < 1.0, "{stiffness}");
    assert!((value(stiffness, "a2") - 500.0).abs() < 1.0, "{stiffness}");
    let secant = &found["secant_stiffness"];
    let (d, k) = (numbers(&secant["x"]), numbers(&secant["y"]));
    let middle = d.iter().position(|d| *d == 0.0).unwrap();
    let beside = d.iter().position(|d| *d > 0.03).unwrap();
    assert!(k[middle] < k[beside] - 5.0, "no dip: {} {}", k[middle], k[beside]);
    for (file, header) in [
        (
            "stiffness.csv",
            r#""deflection [rad]","torque [N m]","lower [N m]","upper [N m]","stiffness [N m/rad]","stiffness_lower [N m/rad]","stiffness_upper [N m/rad]""#,
        ),
        (
            "friction.csv",
            r#""velocity [rad/s]","torque [N m]","lower [N m]","upper [N m]""#,
        ),
    ] {
        assert!(folder.read(file).starts_with(header), "{file}");
    }
    let page = folder.read("report.html");
    assert!(page.starts_with("<!") && page.contains("Elastic torque"));
    let verdict = page.split_once("id=\"verdict-heading\">").map(|(_, rest)| rest);
    assert!(
        verdict.is_some_and(|rest| rest.starts_with("Nothing refutes the form")),
        "{verdict:.200?}"
    );
    assert!(page.contains("The simulated motion fits by "));
    assert!(page.contains("joint = flexure.identify_joint("));

    // Another multisine: the true arm, and the identified one under the same torque.
    folder.write("fresh.toml", shoulder(7, 0.0));
    folder.done("simulate fresh.toml -o fresh.csv");
    let arm = folder.read("arm.toml");
    assert!(arm.contains("file = \"log.csv\""), "{arm}");
    assert!(
        arm.starts_with("# A joint's log tells the inertia about its axis"),
        "{arm}"
    );
    folder.write("again.toml", arm.replace("log.csv", "fresh.csv"));
    folder.done("simulate again.toml -o again.csv");
    let velocity = |name: &str| -> Vec<f64> {
        let file = flexure_io::read_record(folder.path(name)).unwrap();
        file.finite("dq1").unwrap().to_vec()
    };
    let (true_one, again) = (velocity("fresh.csv"), velocity("again.csv"));
    let (off, size) = true_one
        .iter()
        .zip(&again)
        .fold((0.0, 0.0), |(o, s), (a, b)| (o + (a - b).powi(2), s + a * a));
    let fit = 100.0 * (1.0 - (off / size).sqrt());
    println!("fit on a fresh excitation: {fit:.2} %");
    // The identified arm starts as the log did, with the encoders' noise, not at rest at zero.
    assert!(fit > 98.0, "{fit}");
}

#[test]
fn what_cannot_be_used_is_said() {
    let folder = Folder::new();
    folder.write("r.csv", "t,q,tau\n0,0,1\n0.1,0.1,2\n0.2,0.3,1\n");
    folder.failed(
        "joint r.csv --position q --torque tau",
        "r.csv: a joint's friction and inertia needs at least 200 samples, but there are 3",
    );
    folder.failed(
        "joint r.csv --position q --torque tau --torque-constant gtau",
        "r.csv: --torque-constant gtau is neither a number nor a constant of the record; the record has no constants",
    );
    let rows: String = (0..300)
        .map(|i| {
            let t = 0.01 * f64::from(i);
            format!("{t},{},{}\n", (3.0 + 2.0 * t) % (2.0 * std::f64::consts::PI), t.sin())
        })
        .collect();
    folder.write("w.csv", format!("t,q,tau\n{rows}"));
    let outcome = folder.run("joint w.csv --position q --torque tau");
    assert_eq!(outcome.code, Some(1));
    assert!(
        outcome.stderr.contains("column 'q' jumps by -6.2") && outcome.stderr.contains("unwrap the angle first"),
        "{outcome:?}"
    );
    folder.write("n.csv", "q,tau\n0,0\n1,1\n");
    folder.failed(
        "joint n.csv --position q --torque tau",
        "n.csv: no column of sample instants, such as 't', says the sample time; give it by --sample-time, or name the column by --time",
    );
}

/// A rigid axis as an arm file moves like its log, except for the constant torque. The message says that an arm file cannot hold it.
#[test]
fn a_rigid_axis_becomes_an_arm_file() {
    let folder = Folder::new();
    let truth = shoulder(3, 1.0).replace("\"nonlinear\"\n", "\"rigid\"\nfriction = true\n");
    folder.write("truth.toml", truth.replace(", qm1 = 0.00001", ""));
    folder.done("simulate truth.toml -o log.csv");
    let found = folder.json("joint log.csv --position q1 --torque tau1 --arm arm.toml");
    assert_eq!(found["joint"], "rigid");
    let arm = folder.read("arm.toml");
    assert!(
        arm.starts_with("# A rigid axis:")
            && arm.contains("a constant torque of")
            && arm.contains("file = \"log.csv\""),
        "{arm}"
    );
    folder.done("simulate arm.toml -o again.csv");
    // The same log in other units, which its header names.
    let rows: Vec<String> = (folder.read("log.csv").lines().skip(1))
        .map(|line| {
            let row: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            format!("{},{},{}\n", row[0], 1e3 * row[1], row[3].to_degrees())
        })
        .collect();
    folder.write("units.csv", format!("t,tau [mNm],q [deg]\n{}", rows.concat()));
    let outcome = folder.run("joint units.csv --position q --torque tau --json");
    let same: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let inertia = |of: &Value| of["inertia"]["value"].as_f64().unwrap();
    assert!((inertia(&same) / inertia(&found) - 1.0).abs() < 1e-6, "{same}");
    for said in ["'tau' is converted from mNm to Nm", "'q' is converted from deg to rad"] {
        assert!(outcome.stderr.contains(said), "{}", outcome.stderr);
    }
    let velocity = |name: &str| -> Vec<f64> {
        let file = flexure_io::read_record(folder.path(name)).unwrap();
        file.finite("dq1").unwrap().to_vec()
    };
    let (true_one, again) = (velocity("log.csv"), velocity("again.csv"));
    let both = true_one.iter().zip(&again);
    let (off, size) = both.fold((0.0, 0.0), |(o, s), (a, b)| (o + (a - b).powi(2), s + a * a));
    let fit = 100.0 * (1.0 - (off / size).sqrt());
    assert!(fit > 98.0, "{fit}");
    folder.misused(
        "joint log.csv --position q1 --torque tau1 --gravity --arm arm.toml",
        "--arm: an arm file has no gravity, and without it the arm would not move as the axis does; leave --arm out: the motion with \
         the gravity is simulated under the recorded torque, and --report shows it",
    );
}

/// What would not be used is not taken.
#[test]
fn options_of_another_kind_of_joint_are_refused() {
    let folder = Folder::new();
    folder.write("r.csv", "t,q,tau\n0,0,1\n0.1,0.1,2\n0.2,0.3,1\n");
    for option in ["--stiffness k.csv", "--motor-inertia 1"] {
        let outcome = folder.run(&format!("joint r.csv --position q --torque tau {option}"));
        assert_eq!(outcome.code, Some(2), "{option}");
        let name = option.split(' ').next().unwrap();
        assert!(
            outcome.stderr.contains(name) && outcome.stderr.contains("--position"),
            "{outcome:?}"
        );
    }
    folder.write("a.csv", "t,a,b,c,d,e,f\n0,0,1,2,3,4,5\n0.1,0,1,2,3,4,5\n");
    folder.misused(
        "joint a.csv --motor a,b --link c,d --torque e,f --motor-inertia 1",
        "--motor-inertia is of a single flexible joint; leave it out for a two-link arm, whose motors are identified",
    );
}

/// A torque of the wrong sign would give a negative inertia: that is said in its place.
#[test]
fn a_torque_of_the_wrong_sign_is_said() {
    let folder = Folder::new();
    let mut rng = Pcg64::seed_from_u64(8);
    // 2 q'' = tau - q', in steps of 1 ms, the torque held 50 ms.
    let (mut q, mut v, mut tau, mut text) = (0.0_f64, 0.0_f64, 0.0_f64, "t,q,tau\n".to_owned());
    for i in 0..6000 {
        if i % 50 == 0 {
            tau = rng.random_range(-5.0..5.0);
        }
        text += &format!("{},{q},{}\n", 0.001 * f64::from(i), -tau);
        v += 0.0005 * (tau - v);
        q += 0.001 * v;
    }
    folder.write("r.csv", text);
    let found = folder.json("joint r.csv --position q --torque tau --torque-constant -1");
    let inertia = found["inertia"]["value"].as_f64().unwrap();
    assert!((inertia - 2.0).abs() < 0.1, "{inertia}");
    let outcome = folder.run("joint r.csv --position q --torque tau");
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("inertia comes out negative") && outcome.stderr.contains("--torque-constant -1"));
}

/// A folder with a copy of a measured record, where it is at hand.
fn measured(name: &str, copy: &str) -> Option<Folder> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let path = std::env::var_os("FLEXURE_DATA").map_or_else(beside, PathBuf::from);
    let path = path.join(name);
    if !path.is_file() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    let folder = Folder::new();
    std::fs::copy(path, folder.path(copy)).unwrap();
    Some(folder)
}

/// An industrial robot (KUKA KR300): behind the gears of three axes a second encoder, whose samples are 2.8 to 2.9 ms late.
#[test]
fn the_industrial_robot() {
    let Some(folder) = measured("kr300-a.csv", "robot.csv") else {
        return;
    };
    for axis in 1..=3 {
        let found = folder.json(&format!(
            "joint robot.csv --motor qm{axis} --link q{axis} --torque tau{axis}"
        ));
        assert_eq!(found["joint"], "rigid");
        let number = |value: &Value| value.as_f64().unwrap();
        let [late, error] = ["value", "standard_error"].map(|key| number(&found["encoder_skew"][key]));
        let [gives, uncertain] = ["value", "standard_error"].map(|key| number(&found["compliance"][key]));
        println!(
            "axis {axis}: {late} +- {error} s, {gives} +- {uncertain} rad/(N m), inertia {}",
            found["inertia"]
        );
        assert!((2.65e-3..3.0e-3).contains(&late) && error < 1e-4, "{late} {error}");
        assert!(
            (1e-5..4e-5).contains(&gives) && gives > 3.0 * uncertain,
            "{gives} {uncertain}"
        );
        assert!(number(&found["inertia"]["value"]) > 0.0 && found["inertia"]["identifiable"] == true);
    }
}

/// The electro-mechanical positioning system (EMPS): published M 95.1 kg, Fv 203.5 N s/m, Fc 20.4 N, offset -3.2 N.
#[test]
fn the_positioning_system() {
    let Some(folder) = measured("emps-estimation.mat", "emps.mat") else {
        return;
    };
    let found = folder.json(
        "joint emps.mat --position qm --torque vir --torque-constant gtau --prismatic --reference qg --kp kp --kv kv --report page.html",
    );
    assert!(
        folder
            .read("page.html")
            .contains("<summary>Other forms that were tried (")
    );
    let said = folder.said("joint emps.mat --position qm --torque vir --torque-constant gtau --prismatic");
    assert!(
        said.contains("its best friction form differs from the measured curve by"),
        "{said}"
    );
    let form = &found["forms"][0];
    assert_eq!(form["form"], "coulomb_viscous");
    let inertia = form["inertia"]["value"].as_f64().unwrap();
    println!("M {inertia}, {}", form["parameters"]);
    assert!((inertia - 95.1).abs() < 0.01 * 95.1, "{inertia}");
    for (symbol, published, share) in [("Fv", 203.5, 0.02), ("Fc", 20.4, 0.03), ("F0", -3.2, 0.1)] {
        let got = value(form, symbol);
        assert!((got - published).abs() < share * published.abs(), "{symbol} = {got}");
    }
    // Values from SciPy by the textbook method (scripts/reference/joint.py), within three of its standard errors.
    for (symbol, scipy, error) in [
        ("Fv", 202.5636, 1.5725),
        ("Fc", 20.4935, 0.1391),
        ("F0", -3.1710, 0.0607),
    ] {
        let got = value(form, symbol);
        assert!((got - scipy).abs() < 3.0 * error, "{symbol} = {got}");
    }
    let closed = &found["replays"][1];
    assert_eq!(closed["drive"], "in the position loop");
    assert!(closed["rms"].as_f64().unwrap() < 2e-5, "{closed}");
    let open = &found["replays"][0];
    assert!(open["rms"].as_f64().unwrap() < 0.007, "{open}");
}
