//! `flexure control`: presets, figures, records, pages, and scenarios that are refused.

mod common;
#[path = "control/refused.rs"]
mod refused;

use common::Folder;

/// A scenario that runs in a moment.
const SHORT: &str = r#"[plant]
arm = "space-arm"
[trajectory]
kind = "moves"
postures = [[0.0, 0.6], [0.3, 1.0]]
duration = 2.0
hold = 1.0
[loop]
sample_time = 0.01
encoder_noise = 1e-4
[[controller]]
kind = "pd-feedforward"
kp = [400.0, 300.0]
kd = [30.0, 20.0]
[[controller]]
kind = "inverse-dynamics"
"#;

#[test]
fn a_controller_has_an_object_with_its_figures() {
    let folder = Folder::new();
    folder.write("s.toml", SHORT);
    let object = folder.json("control s.toml --seeds 3 -o run.csv --of pd-feedforward --report page.html");
    let results = object["results"].as_array().unwrap();
    assert_eq!(results.len(), 2);
    for (row, name) in results.iter().zip(["pd-feedforward", "inverse-dynamics"]) {
        assert_eq!(row["controller"], name);
        assert_eq!(row["seeds"], 3);
        for key in [
            "tip_error_max_m",
            "tip_error_rms_m",
            "residual_vibration_percent",
            "torque_peak_nm",
        ] {
            assert!(row[key].as_f64().unwrap() > 0.0, "{row}");
            assert!(
                row["worst"][key].as_f64().unwrap() >= row[key].as_f64().unwrap(),
                "{row}"
            );
        }
    }
    assert_eq!(folder.column("run.csv", "tau1").len(), 301);
    assert!(folder.read("page.html").contains("Controllers in one table"));
    // The same seeds give the same figures.
    assert_eq!(folder.json("control s.toml --seeds 3"), object);
    let said = folder.said("control s.toml");
    assert!(said.starts_with("Smallest maximum error of the tip: "), "{said}");
}

/// What a loop recorded can be looked at and identified from as any other record.
#[test]
fn the_record_of_a_run_is_one_to_identify_from() {
    let folder = Folder::new();
    folder.write("s.toml", SHORT);
    folder.done("control s.toml -o run.csv");
    let object = folder.json("identify run.csv --input tau2 --output qm2 --structure linear");
    assert!(object["fit_percent"].is_number(), "{object}");
}

#[test]
fn presets_are_files_that_read_back() {
    let folder = Folder::new();
    for name in [
        "square",
        "rest-to-rest",
        "unknown-stiffness",
        "noisy-encoders",
        "flexible-link",
    ] {
        folder.done(&format!(
            "control --preset {name} --write-scenario {name}.toml --dry-run"
        ));
        let said = folder.said(&format!("control {name}.toml --dry-run"));
        assert_eq!(said.trim(), format!("{name}.toml: no errors found"));
    }
    // Shapers, each against the same servo without one: the robust one leaves a twentieth of the vibration 20 % off its frequencies.
    let object = folder.json("control rest-to-rest.toml");
    let left = |i: usize| object["results"][i]["residual_of_unshaped_percent"].as_f64();
    assert_eq!(left(0), None);
    assert!(
        left(4) < Some(5.0) && left(3) < left(2) && left(2) < left(1),
        "{object}"
    );
}

/// A file that `flexure joint` or a user wrote goes straight into the controllers.
#[test]
fn a_model_may_be_an_arm_file_of_its_own() {
    let folder = Folder::new();
    folder.done("simulate --preset space-arm --write-arm known.toml");
    folder.write(
        "own.toml",
        SHORT.replace("[trajectory]", "[model]\narm = \"known.toml\"\n[trajectory]"),
    );
    folder.write("s.toml", SHORT);
    assert_eq!(folder.json("control own.toml"), folder.json("control s.toml"));
}

/// A flexible link in the loop of the arms: the adaptive law learns the payload that it was not told of.
#[test]
fn a_flexible_link_has_a_row_a_controller_too() {
    let folder = Folder::new();
    let object = folder.json("control --preset flexible-link -o run.csv --report page.html --write-scenario link.toml");
    let error = |i: usize| object["results"][i]["tip_error_rms_m"].as_f64().unwrap();
    assert_eq!(object["results"][2]["controller"], "model-reference differences");
    assert!(error(2) < 0.5 * error(1) && error(1) < error(0), "{object}");
    // The record's hub and tip differ where the link bends.
    let (hub, tip) = (
        folder.column("run.csv", "true_qm1"),
        folder.column("run.csv", "true_q1"),
    );
    let bent = hub
        .iter()
        .zip(&tip)
        .map(|(hub, tip)| (hub - tip).abs())
        .fold(0.0, f64::max);
    assert!((1e-4..0.1).contains(&bent), "{bent}");
    let page = folder.read("page.html");
    for part in [
        "Control of the flexible link",
        "of the motor",
        "0.5 m",
        "\"name\":\"torque\"",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("torque 2"));

    let text = folder.read("link.toml");
    for (old, new, message) in [
        (
            "length = 4.5 ",
            "",
            "s.toml, line 3: plant.link.length: missing; give it in m",
        ),
        (
            "hub = 1.0 ",
            "hub = 0.0 ",
            "s.toml, line 7: plant.link.hub: hub is 0, but must be positive and finite",
        ),
        (
            "payload = 0.0",
            "payload = -1.0",
            "s.toml, line 12: model.link.payload: payload is -1, but must be not negative and finite",
        ),
        (
            "[plant.link] ",
            "[plant]\narm = \"space-arm\"\n[plant.link] ",
            "s.toml, line 4: plant.arm: is only for arms; leave it out for a flexible link",
        ),
        (
            "kind = \"commands\" ",
            "kind = \"moves\" ",
            "s.toml, line 16: trajectory.angles: the kind \"moves\" has no such key; leave it out",
        ),
        (
            "frequency = 0.8 ",
            "frequency = -0.8 ",
            "s.toml, line 18: trajectory.frequency: frequency is -0.8, but must be positive and finite (in rad/s)",
        ),
        (
            "kind = \"pd\" ",
            "kind = \"lqg\" ",
            "s.toml, line 28: controller[1].kind: \"lqg\" does not control flexible links; \"pd\" and \"model-reference\" do",
        ),
        (
            "estimator = \"differences\" ",
            "estimator = \"ekf\" ",
            "s.toml, line 29: controller[1].estimator: the filters have the model of an arm; a flexible link has \"exact\", \
             \"differences\" and \"motor-differences\"",
        ),
        (
            "kp = 120.0 ",
            "kp = \"high\" ",
            "s.toml, line 30: expected a number, or a list of two",
        ),
    ] {
        assert!(text.contains(old), "{old}");
        folder.write("s.toml", text.replacen(old, new, 1));
        folder.refused("control s.toml", 1, message);
    }
}

/// Values that a scenario cannot have: messages are short, and no entry of the file is ignored.
#[test]
fn wrong_usage_is_said() {
    let folder = Folder::new();
    folder.write("s.toml", SHORT);
    folder.misused(
        "control --preset circle",
        "invalid value 'circle' for '--preset <NAME>': no preset 'circle'; the presets are: square, rest-to-rest, unknown-stiffness, noisy-encoders, \
         flexible-link",
    );
    folder.misused(
        "control s.toml --seeds 0",
        "invalid value '0' for '--seeds <N>': expected a whole number from 1 to 100000",
    );
    folder.misused(
        "control s.toml -o r.csv --of lqg",
        "--of lqg: the scenario's controllers are: pd-feedforward, inverse-dynamics",
    );
}

/// An arm that turns ever faster would take ever more steps.
#[test]
fn a_loop_that_runs_away_ends() {
    let folder = Folder::new();
    let loops = [
        ("encoder_noise = 1e-4", "torque_noise = 1e12"),
        ("encoder_noise = 1e-4", "initial_velocity = 1e9"),
        ("kp = [400.0, 300.0]", "kp = [1e9, 1e9]"),
    ];
    for (part, changed) in loops {
        folder.write("s.toml", SHORT.replace(part, changed));
        let object = folder.json("control s.toml --seeds 2");
        let row = &object["results"][0];
        let failure = row["failure"].as_str().unwrap_or_default();
        assert_eq!(row["seeds"], 0, "{changed}: {row}");
        assert!(
            failure.contains("a joint moves faster than 100000 rad/s"),
            "{changed}: {row}"
        );
    }
}
