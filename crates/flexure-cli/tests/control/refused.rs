//! Scenarios that are refused, with the line and what to do.

use crate::SHORT;
use crate::common::Folder;

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
            "s.toml, line 9: loop.sample_time: the motion with its rest takes 3 s, but it must take less than 100 million sample times (in s); shorten it, or lengthen the sample time",
        ),
        (
            "encoder_noise = 1e-4",
            "seed = 1e300",
            "s.toml, line 10: invalid type: floating point `1e300`, expected a whole number that is not negative",
        ),
        (
            "hold = 1.0",
            "pause = -1.0",
            "s.toml, line 7: trajectory.pause: pause is -1, but must be not negative and finite (in s)",
        ),
        (
            "kind = \"inverse-dynamics\"",
            &format!("kind = \"inverse-dynamics\"\nname = \"{}\"", "x".repeat(100_000)),
            "s.toml, line 17: controller[2].name: a name has at most 60 characters, all in one line",
        ),
        (
            "kind = \"inverse-dynamics\"",
            "kind = \"inverse-dynamics\"\nname = \"two\\nlines\"",
            "s.toml, line 17: controller[2].name: a name has at most 60 characters, all in one line",
        ),
    ] {
        folder.write("s.toml", SHORT.replacen(old, new, 1));
        folder.refused("control s.toml", 1, message);
    }
    folder.write("s.toml", SHORT);
    let checked = folder.json("control s.toml --dry-run");
    assert_eq!(checked["controllers"][1], "inverse-dynamics");
}
