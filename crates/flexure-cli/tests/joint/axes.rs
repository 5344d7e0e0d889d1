//! Several axes of one log, each identified alone.

use super::common::{Folder, axis};
use super::{measured, shoulder};

/// The shoulder of an arm as axis 1, and its locked elbow as axis 2.
fn arm() -> Folder {
    let folder = Folder::new();
    folder.write(
        "truth.toml",
        shoulder(1, 1.0).replace("duration = 40.0", "duration = 20.0"),
    );
    folder.done("simulate truth.toml -o log.csv");
    folder
}

#[test]
fn each_axis_is_identified_alone_and_one_that_cannot_be_keeps_its_row() {
    let folder = arm();
    let pattern = "--motor qm{} --link q{} --torque tau{}";
    let alone = folder.json("joint log.csv --motor qm1 --link q1 --torque tau1");
    let found = folder.json(&format!(
        "joint log.csv --axis 1..2 {pattern} --friction f.csv --report page.html"
    ));
    let [first, second] = found["axes"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    assert_eq!((&first["axis"], &second["axis"]), (&"1".into(), &"2".into()));
    for key in ["link_inertia", "motor_inertia", "friction", "findings", "replay"] {
        assert_eq!(first[key], alone[key], "{key}");
    }
    assert_eq!(first["row"]["inertia"]["value"], alone["link_inertia"]["value"]);
    assert!(
        first["row"]["stiffness"]["value"].as_f64().unwrap() > 400.0,
        "{}",
        first["row"]
    );
    assert!(second["error"].as_str().unwrap().contains("qm2"), "{second}");
    assert!(folder.path("f-1.csv").is_file() && !folder.path("f-2.csv").exists());
    assert_eq!(found["written"], serde_json::json!(["f-1.csv", "page.html"]));

    let said = folder.said(&format!("joint log.csv --axis 1,2 {pattern}"));
    assert!(said.starts_with("1 of 2 axes identified, each alone; "), "{said}");
    assert!(said.contains("axis inertia, kg m^2 viscous, N m s/rad"), "{said}");
    assert!(said.contains("2 - - - - - - not identified"), "{said}");
    assert!(
        said.contains("axis 2: log.csv: columns 'qm2' and 'q2' are equal"),
        "{said}"
    );

    // A section an axis, each plot with a place of its own.
    let page = folder.read("page.html");
    for part in ["Axis 1: a flexible joint", "Axis 2: not identified", "All axes"] {
        assert!(page.contains(part), "{part}");
    }
    let places: Vec<&str> = page
        .split("id=\"plot-")
        .skip(1)
        .filter_map(|p| p.split('"').next())
        .collect();
    let distinct: std::collections::HashSet<&&str> = places.iter().collect();
    assert!(places.len() > 5 && distinct.len() == places.len(), "{places:?}");
}

#[test]
fn an_axis_without_an_angle_of_its_link_is_rigid_at_its_motor() {
    let folder = Folder::new();
    let [t, force, position] = axis(6000);
    let log = |header: &str, ratio: f64| {
        let row = |i: usize| format!("{},{},{}\n", t[i], ratio * position[i], 35.0 * force[i] / ratio);
        format!("t,{header}\n{}", (0..t.len()).map(row).collect::<String>())
    };
    folder.write("motor.csv", log("qm_a,tau_a", 10.0));
    folder.write("link.csv", log("q,tau", 1.0));
    let found = folder.json("joint motor.csv --axis a --motor qm_{} --link q_{} --torque tau_{} --gear-ratio 10");
    let axis = &found["axes"][0];
    assert_eq!(axis["joint"], "rigid");
    let remark = axis["remark"].as_str().unwrap();
    assert!(remark.contains("rigid axis at its motor, column 'qm_a'"), "{remark}");
    let alone = folder.json("joint link.csv --position q --torque tau");
    let [of_axis, of_link] = [axis, &alone].map(|found| found["inertia"]["value"].as_f64().unwrap());
    assert!((of_link / 95.0 - 1.0).abs() < 0.05, "{of_link}");
    assert!((of_axis / of_link - 1.0).abs() < 1e-6, "{of_axis} {of_link}");
}

#[test]
fn axes_that_are_named_wrongly_are_refused() {
    let folder = Folder::new();
    folder.write("r.csv", "t,q1,tau1\n0,0,1\n0.1,0.1,2\n0.2,0.3,1\n");
    folder.misused(
        "joint r.csv --axis 1..2 --position q1 --torque tau{}",
        "--position q1: with --axis or --chain, write {} where the name has the axis, as in --position q1{}",
    );
    for (axes, why) in [
        ("3..1", "begins with its smaller number"),
        ("1..x", "no range of whole numbers"),
        ("1,1", "axis 1 is named twice"),
        ("1,", "an axis is a number"),
        ("a/b", "an axis is a number"),
    ] {
        let outcome = folder.run(&format!("joint r.csv --axis {axes} --position q{{}} --torque tau{{}}"));
        assert_eq!(outcome.code, Some(2), "{axes}");
        assert!(outcome.stderr.contains(why), "{outcome:?}");
    }
    // Where no axis can be identified, the command fails, with the reason of each.
    let outcome = folder.run("joint r.csv --axis 1..2 --position q{} --torque tau{}");
    assert_eq!(outcome.code, Some(1));
    for why in [
        "none of the axes",
        "axis 1: r.csv: a joint's friction",
        "axis 2: r.csv: no column",
    ] {
        assert!(outcome.stderr.contains(why), "{why}: {outcome:?}");
    }
}

/// All six axes of an industrial robot (KUKA KR300): what is printed as an inertia is positive.
#[test]
fn all_axes_of_the_industrial_robot() {
    let Some(folder) = measured("kr300-a.csv", "robot.csv") else {
        return;
    };
    let found = folder.json("joint robot.csv --axis 1..6 --motor qm{} --link q{} --torque tau{}");
    for (i, axis) in found["axes"].as_array().unwrap().iter().enumerate() {
        println!("axis {}: {}", axis["axis"], axis["row"]);
        let inertia = &axis["row"]["inertia"]["value"];
        assert!(inertia.is_null() || inertia.as_f64().unwrap() > 0.0, "{axis}");
        let skew = axis["row"]["encoder_skew"]["value"].as_f64();
        assert_eq!(skew.is_some(), i < 3);
        assert!(skew.is_none_or(|skew| (2.65e-3..3.0e-3).contains(&skew)), "{skew:?}");
    }
}
