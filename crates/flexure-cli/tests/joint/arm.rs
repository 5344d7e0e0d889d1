//! The two-link arm as a whole: from its log to an arm file, and the signals that excite it.

use super::common::{Folder, numbers};
use super::value;

/// The space arm under a multisine, or under the torques of a record, with noise of this scale.
fn space_arm(duration: f64, excitation: &str, noise: f64) -> String {
    let link = "[[arm.link]]\nmass = 1.5075\nlength = 4.5\ncom = 2.25\ninertia = 2.544\n";
    let joint = "[[arm.joint]]\nmotor_inertia = 1.0\ncubic = 500.0\nlinear = 500.0\nwindup = 10.0\nwindup_sharpness = 3000.0\n\
                 friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]\n";
    format!(
        "[arm]\nmodel = \"nonlinear\"\n{link}{link}{joint}{joint}[run]\nduration = {duration}\nsample_time = 0.002\n[excitation]\n\
         {excitation}\n[noise]\nstd = {{ tau1 = {}, tau2 = {}, q1 = {n}, q2 = {n}, qm1 = {n}, qm2 = {n} }}\n",
        0.4 * noise,
        0.2 * noise,
        n = 1e-5 * noise
    )
}

fn multisine(seed: u64) -> String {
    format!("kind = \"multisine\"\nseed = {seed}\namplitude = [40.0, 20.0]\nf_min = 0.05\nf_max = 3.0")
}

const COLUMNS: &str = "--motor qm1,qm2 --link q1,q2 --torque tau1,tau2";

fn column(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = flexure_io::read_record(folder.path(file)).unwrap();
    file.finite(name).unwrap().to_vec()
}

#[test]
fn the_identified_two_link_arm_moves_as_the_true_one() {
    let folder = Folder::new();
    folder.write("truth.toml", space_arm(40.0, &multisine(1), 1.0));
    folder.done("simulate truth.toml -o log.csv");
    let found = folder.json(&format!(
        "joint log.csv {COLUMNS} --arm arm.toml --friction f.csv --stiffness k.csv --report arm.html"
    ));
    assert_eq!(found["joint"], "two_link_arm");
    // The reason why parameters are not identifiable stands once a form; forms that were not kept are folded away.
    let page = folder.read("arm.html");
    assert!(page.matches("only the curve is determined").count() <= 2);
    assert!(page.contains("<summary>Forms of each curve in turn ("));
    // m (lc^2 + l^2 + lc^2) + 2 I, m lc^2 + I and m l lc.
    for (name, truth) in [("shoulder", 50.879), ("elbow", 10.1757), ("coupling", 15.2634)] {
        for found in [&found[name], &found["model"][name]] {
            let value = found["value"].as_f64().unwrap();
            assert!((value - truth).abs() < 0.01 * truth, "{name}: {value}");
        }
    }
    for joint in found["joints"].as_array().unwrap() {
        let inertia = joint["motor_inertia"]["value"].as_f64().unwrap();
        assert!((inertia - 1.0).abs() < 0.01, "{inertia}");
        let ksw = value(&joint["model"]["stiffness"], "ksw");
        assert!((ksw - 10.0).abs() < 1.0, "{ksw}");
        let secant = &joint["secant_stiffness"];
        let (d, k) = (numbers(&secant["x"]), numbers(&secant["y"]));
        let at = |low: f64| d.iter().position(|d| *d > low).unwrap();
        assert!(k[at(0.004)] < k[at(0.03)] - 5.0, "no dip at zero");
    }
    for file in ["f-1.csv", "f-2.csv"] {
        assert!(
            folder
                .read(file)
                .starts_with(r#""velocity [rad/s]","torque [N m]","lower"#),
            "{file}"
        );
    }
    for file in ["k-1.csv", "k-2.csv"] {
        assert!(
            folder
                .read(file)
                .starts_with(r#""deflection [rad]","torque [N m]","lower"#),
            "{file}"
        );
    }
    let page = folder.read("arm.html");
    assert!(page.contains("A two-link arm") && page.contains("Elastic torque, joint 2"));

    // Other multisines: the true arm, and the identified one under the same torques.
    folder.write("fresh.toml", space_arm(40.0, &multisine(7), 0.0));
    folder.done("simulate fresh.toml -o fresh.csv");
    let arm = folder.read("arm.toml");
    assert!(arm.contains("file = \"log.csv\""), "{arm}");
    folder.write("again.toml", arm.replace("log.csv", "fresh.csv"));
    folder.done("simulate again.toml -o again.csv");
    for name in ["dq1", "dq2"] {
        let (true_one, again) = (column(&folder, "fresh.csv", name), column(&folder, "again.csv", name));
        let mean = true_one.iter().sum::<f64>() / true_one.len() as f64;
        let both = true_one.iter().zip(&again);
        let (off, size) = both.fold((0.0, 0.0), |(o, s), (a, b)| {
            (o + (a - b).powi(2), s + (a - mean).powi(2))
        });
        let fit = 100.0 * (1.0 - (off / size).sqrt());
        println!("{name}: fit on a fresh excitation {fit:.2} %");
        assert!(fit > 98.0, "{name}: {fit}");
    }
    // With the true lengths and centres of mass come the true masses.
    folder.done(&format!(
        "joint log.csv {COLUMNS} --arm full.toml --template truth.toml"
    ));
    let masses: Vec<f64> = folder
        .read("full.toml")
        .lines()
        .filter_map(|line| line.strip_prefix("mass = ")?.parse().ok())
        .collect();
    assert_eq!(masses.len(), 2);
    assert!(masses.iter().all(|m| (m - 1.5075).abs() < 0.015), "{masses:?}");

    // What was identified compensates the friction and the springs that a data sheet does not have.
    let compensated = tip_error(&folder, "arm = \"arm.toml\"");
    let uncompensated = tip_error(
        &folder,
        "arm = \"truth.toml\"\nfriction = false\ncubic = false\nwindup = false",
    );
    assert!(compensated < 0.05 * uncompensated, "{compensated} {uncompensated}");
}

/// The largest error of the tip, m, of the true arm under a controller that knows this model.
fn tip_error(folder: &Folder, model: &str) -> f64 {
    let motion = "kind = \"moves\"\npostures = [[0.0, 0.5], [1.0, 1.5], [0.2, 1.0]]\nduration = 4.0\n";
    let controller = "kind = \"pd-feedforward\"\nkp = 1000.0\nkd = 50.0\n";
    folder.write(
        "control.toml",
        format!(
            "[plant]\narm = \"truth.toml\"\n[model]\n{model}\n[trajectory]\n{motion}[loop]\nsample_time = 0.01\n\
             [[controller]]\n{controller}"
        ),
    );
    let found = folder.json("control control.toml");
    found["results"][0]["tip_error_max_m"].as_f64().unwrap()
}

#[test]
fn an_arm_needs_two_columns_of_each_kind() {
    let folder = Folder::new();
    folder.write("truth.toml", space_arm(2.0, &multisine(1), 1.0));
    folder.done("simulate truth.toml -o log.csv");
    let outcome = folder.run("joint log.csv --motor qm1,qm2 --link q1 --torque tau1,tau2");
    assert_eq!(outcome.code, Some(2), "{outcome:?}");
    assert!(
        outcome
            .stderr
            .contains("--link q1: a two-link arm needs two columns of each kind, as in --motor qm1,qm2"),
        "{outcome:?}"
    );
}

#[test]
fn excitations_keep_within_their_limits_and_say_what_they_show() {
    let folder = Folder::new();
    let excite = "excite --preset space-arm --max-torque 40,20 --sample-time 0.002 --duration 30";
    let found = folder.json(&format!("{excite} --max-velocity 0.6,1.2 -o torques.csv"));
    let crest = numbers(&found["crest_factor"]);
    assert!(crest.iter().all(|c| *c < 1.8), "{crest:?}");
    let can = found["can"].to_string();
    assert!(can.contains("joint 1: ksw "), "{found}");
    let cannot = found["cannot"].to_string();
    assert!(cannot.contains("masses, lengths and centres of mass"), "{cannot}");
    // The arm itself keeps within the limits, and comes near one of them.
    folder.write(
        "played.toml",
        space_arm(30.0, "kind = \"record\"\nfile = \"torques.csv\"", 0.0),
    );
    folder.done("simulate played.toml -o played.csv");
    let mut nearest = 0.0_f64;
    for (name, limit) in [("tau1", 40.0), ("tau2", 20.0), ("dq1", 0.6), ("dq2", 1.2)] {
        let largest = column(&folder, "played.csv", name)
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(largest <= limit * (1.0 + 1e-6), "{name} reaches {largest}");
        nearest = nearest.max(largest / limit);
    }
    assert!(nearest > 0.9, "{nearest}");

    // Links that move each other: both signals shrink.
    for kind in ["multisine", "multilevel"] {
        let found = folder.json(&format!(
            "excite --preset space-arm --max-torque 40,20 --max-velocity 1 --kind {kind} --sample-time 0.005 --duration 20 -o slow.csv"
        ));
        assert!(numbers(&found["largest_velocity"]).iter().all(|v| *v <= 1.0), "{found}");
    }

    // References for servos: the angles' own limit too.
    let found = folder.json(&format!(
        "{excite} --reference --f-max 0.5 --max-position 0.3 --kind chirp -o reference.csv"
    ));
    assert!(folder.read("reference.csv").starts_with("t,r1,r2"));
    assert!(numbers(&found["largest_position"]).iter().all(|q| *q <= 0.3), "{found}");
    assert!(
        numbers(&found["largest_torque"])
            .iter()
            .zip([40.0, 20.0])
            .all(|(t, limit)| *t <= limit)
    );
    assert_eq!(found["gains"].as_array().unwrap().len(), 2);

    // Too little torque for the friction: that is said.
    let said = folder.done("excite --preset space-arm --max-torque 0.5 --sample-time 0.002 --duration 30 -o weak.csv");
    assert!(
        said.contains("It cannot tell:") && said.contains("move faster"),
        "{said}"
    );

    let outcome = folder.run("excite --preset space-arm --max-torque -3 -o x.csv");
    assert!(
        outcome.code == Some(2) && outcome.stderr.contains("invalid value '-3' for '--max-torque"),
        "{outcome:?}"
    );
    let outcome = folder.run("excite --preset space-arm --max-torque 1,2,3 -o x.csv");
    assert_eq!(outcome.code, Some(2));
    assert!(
        outcome
            .stderr
            .contains("--max-torque: one number, or one for each of the two joints"),
        "{outcome:?}"
    );
}

#[test]
fn the_three_views_of_a_joint() {
    let folder = Folder::new();
    let found = folder.json("demo --joint-views --out views");
    let number = |view: &str, key: &str| found[view][key].as_f64().unwrap();
    assert!(number("stiffness", "error") < 0.05, "{found}");
    assert!(number("stiffness", "covered") > 0.9, "{found}");
    // From both angles the curve is found too, at any position of the joint.
    let both = &found["stiffness"]["both_angles"];
    for key in ["error", "change"] {
        assert!(both[key].as_f64().unwrap() < 0.02, "{key}: {both}");
    }
    let bandwidths = numbers(&both["bandwidths"]);
    assert!(bandwidths[0] > 5.0 * bandwidths[1], "{both}");
    assert!(number("deflection", "error") < 0.05, "{found}");
    // exp(-0.5 4 / 10.1757)
    let (pole, truth) = (number("deflection", "pole"), number("deflection", "true_pole"));
    assert!(
        (truth - 0.821_553).abs() < 1e-4 && (pole - truth).abs() < 0.01 * truth,
        "{found}"
    );
    assert!(number("torque", "error") < 0.05, "{found}");
    assert_eq!(found["torque"]["holds"], false, "friction is feedback");
    for name in ["1-stiffness", "2-deflection-to-velocity", "3-torque-to-velocity"] {
        assert!(folder.read(&format!("views/{name}.html")).starts_with("<!"), "{name}");
        assert!(folder.read(&format!("views/{name}.csv")).starts_with("t,"), "{name}");
    }
}
