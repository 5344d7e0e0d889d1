//! `flexure control`: presets, figures, records, pages, and scenarios that are refused.

mod common;

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
    assert!(said.starts_with("Smallest error of the tip: "), "{said}");
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
        assert_eq!(said.trim(), format!("{name}.toml: nothing wrong"));
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

#[test]
fn twenty_bad_scenarios_are_refused_with_their_line() {
    let folder = Folder::new();
    let gains = "kp = [400.0, 300.0]";
    for (old, new, message) in [
        ("[loop]", "[loop", "s.toml, line 8: "),
        ("duration = 2.0", "durations = 2.0", "line 6: unknown field `durations`"),
        ("sample_time = 0.01\n", "", "line 8: missing field `sample_time`"),
        (
            "space-arm",
            "space",
            "line 2: plant.arm: 'space' is neither a preset (space-arm, ",
        ),
        (
            "space-arm",
            "../a.toml",
            "line 2: plant.arm: '../a.toml' is neither a preset",
        ),
        ("space-arm", "none.toml", "line 2: plant.arm: cannot read none.toml"),
        (
            "\"space-arm\"",
            "\"space-arm\"\nstiffness = -1.0",
            "line 3: plant.stiffness: -1, but must be a factor from 0.001 to 1000",
        ),
        ("\"moves\"", "\"circle\"", "line 4: unknown variant `circle`"),
        (
            "\"moves\"",
            "\"square\"",
            "line 5: trajectory.postures: the kind \"square\" has no such key; leave it out",
        ),
        (
            "postures = [[0.0, 0.6], [0.3, 1.0]]\n",
            "",
            "trajectory.postures: missing; two or more pairs of link angles, in rad",
        ),
        (
            "[0.3, 1.0]",
            "[nan, 1.0]",
            "line 3: trajectory: an angle of the postures is NaN, but must be finite (in rad)",
        ),
        (
            "duration = 2.0",
            "duration = -2.0",
            "line 6: trajectory.duration: duration is -2, but must be positive and finite (in s)",
        ),
        (
            "hold = 1.0",
            "hold = -1.0",
            "line 7: trajectory.hold: -1, but must be from 0 to 1000000 s",
        ),
        (
            "sample_time = 0.01",
            "sample_time = 0.0",
            "line 9: loop.sample_time: sample_time is 0, but must be positive",
        ),
        (
            "sample_time = 0.01",
            "sample_time = 0.01\ndelay = 101",
            "line 10: loop.delay: delay is 101, but must be at most 100",
        ),
        (
            "encoder_noise = 1e-4",
            "encoder_noise = -1.0",
            "line 10: loop.encoder_noise: encoder_noise is -1",
        ),
        (
            "encoder_noise = 1e-4",
            "torque_limit = 0.0",
            "line 10: loop.torque_limit: torque_limit is 0, but must be positive",
        ),
        (
            "encoder_noise = 1e-4",
            "seeds = 0",
            "line 10: loop.seeds: 0, but must be from 1 to 100000",
        ),
        (
            gains,
            "",
            "controller[1].kp: missing; a servo needs it for both joints, in N m/rad",
        ),
        (
            gains,
            "kp = [400.0, -1.0]",
            "line 13: controller[1].kp: [400, -1], but must be not negative",
        ),
        (
            gains,
            "kp = [400.0]",
            "line 13: there must be 2 numbers in this list, but it has 1",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"magic\"",
            "line 16: unknown variant `magic`",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nrate = 2.0",
            "line 17: controller[2].rate: the kind \"lqg\" has no such key",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nshaper = \"zv\"",
            "line 17: controller[2].shaper: shapers are for servos",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nshaper = \"zw\"",
            "line 17: no shaper 'zw'; the shapers are: zv, zvd, ei, two-hump-ei",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\ncut_off = 1.0",
            "controller[2].cut_off: the estimator \"exact\" has no such key",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nestimator = \"ekf\"\ntorque_noise = 0.0",
            "line 18: controller[2].torque_noise: 0, but must be positive and finite (in N m)",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nadaptation = false",
            "line 17: controller[2].adaptation: the kind \"lqg\" has no such key; leave it out",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"model-reference\"",
            "controller[2].kind: \"model-reference\" does not control two-link arms; all kinds but \"model-reference\" do",
        ),
        (
            "arm = \"space-arm\"",
            "",
            "line 1: plant.arm: missing; name an arm, or describe a flexible link under [plant.link]",
        ),
        (
            "[trajectory]",
            "[model.link]\npayload = 0.0\n[trajectory]",
            "line 3: model.link: the plant is an arm; its model is one, too",
        ),
        (
            "kind = \"moves\"\npostures = [[0.0, 0.6], [0.3, 1.0]]",
            "kind = \"commands\"\nangles = [0.3]",
            "line 4: trajectory.kind: \"commands\" is for a flexible link; an arm has \"square\", \"path\" or \"moves\"",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"lqg\"\nname = \"pd-feedforward\"",
            "controller[2].name: 'pd-feedforward' is the name of another controller",
        ),
    ] {
        assert!(SHORT.contains(old), "{old}");
        folder.write("s.toml", SHORT.replacen(old, new, 1));
        let outcome = folder.run("control s.toml");
        assert_eq!(outcome.code, Some(1), "{new}: {outcome:?}");
        assert!(outcome.stderr.contains(message), "{new}: {}", outcome.stderr);
        assert_eq!(outcome.stdout, "");
    }
    // None at all, and a square that no arm of 9 m reaches.
    folder.write("s.toml", SHORT.split("[[controller]]").next().unwrap());
    assert!(
        folder
            .run("control s.toml")
            .stderr
            .contains("give at least one [[controller]]")
    );
    let square = "kind = \"square\"\nside = 13.0\nblend = 0.1\nduration = 60.0";
    folder.write(
        "s.toml",
        SHORT.replace(
            "kind = \"moves\"\npostures = [[0.0, 0.6], [0.3, 1.0]]\nduration = 2.0",
            square,
        ),
    );
    assert!(
        folder
            .run("control s.toml")
            .stderr
            .contains("the distance of point 1 from the shoulder is")
    );
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
    assert!(folder.read("page.html").contains("Control of the flexible link"));

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
            "s.toml, line 4: plant.arm: is of arms; leave it out beside a flexible link",
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

/// Values beside what a scenario can have: messages are short, and nothing is left unread.
#[test]
fn sizes_and_lengths_of_a_scenario_have_an_end() {
    let folder = Folder::new();
    for (old, new, message) in [
        (
            "kp = [400.0, 300.0]",
            "kp = [400.0, 300.0, 200.0]",
            "s.toml, line 13: there must be 2 numbers in this list, but it has 3",
        ),
        (
            "[0.3, 1.0]",
            "[0.3, 1.0, 0.0]",
            "s.toml, line 5: there must be 2 numbers in this list, but it has 3",
        ),
        (
            "[[0.0, 0.6], [0.3, 1.0]]",
            "[]",
            "s.toml, line 5: trajectory.postures: there are 0, but must be from 2 to 10000",
        ),
        (
            "hold = 1.0",
            "hold = 1e300",
            "s.toml, line 7: trajectory.hold: 1e300, but must be from 0 to 1000000 s",
        ),
        (
            "hold = 1.0",
            "hold = 99998.0",
            "s.toml, line 9: loop.sample_time: 0.01, which makes 20000002 samples of all controllers together, \
             but they can be at most 10000000",
        ),
        (
            "duration = 2.0",
            "duration = 5e-324",
            "s.toml, line 6: trajectory.duration: 5e-324, but must be at least one sample time (in s)",
        ),
        (
            "sample_time = 0.01",
            "sample_time = 1e-9",
            "s.toml, line 9: loop.sample_time: the motion with its rest takes 3 s, but it must take less than 100 million sample times (in s)",
        ),
        (
            "encoder_noise = 1e-4",
            "seed = 1e300",
            "s.toml, line 10: invalid type: floating point `1e300`, expected a whole number that is not negative",
        ),
    ] {
        folder.write("s.toml", SHORT.replacen(old, new, 1));
        folder.refused("control s.toml", 1, message);
    }
    folder.write("s.toml", SHORT);
    let checked = folder.json("control s.toml --dry-run");
    assert_eq!(checked["controllers"][1], "inverse-dynamics");
}

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
            failure.contains("a joint turns faster than 100000 rad/s"),
            "{changed}: {row}"
        );
    }
}
