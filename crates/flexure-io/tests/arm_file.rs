//! Arm files: reading, writing back, every bad value's message, running.

use flexure::Record;
use flexure::manipulator::{JointKind, Parts, space_arm};
use flexure_io::RecordFile;
use flexure_io::arm::{ArmError, ArmFile, PRESETS, preset, preset_text, run};

fn no_record(name: &str) -> Result<RecordFile, String> {
    Err(format!("{name} is not to be loaded"))
}

/// The space arm's text with one piece replaced.
fn changed(from: &str, to: &str) -> String {
    let text = preset_text("space-arm").unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// The space arm with another table `[excitation]`.
fn excited(keys: &str) -> String {
    let (before, _) = preset_text("space-arm").unwrap().split_once("[excitation]").unwrap();
    format!("{before}[excitation]\n{keys}\n")
}

fn read(text: &str) -> ArmFile {
    ArmFile::from_toml_str(text, "arm.toml").unwrap()
}

#[test]
fn the_space_arm_is_the_librarys() {
    assert_eq!(preset("space-arm").unwrap().arm, space_arm(JointKind::Nonlinear));
    for name in ["rigid", "linear"] {
        let arm = read(&changed("\"nonlinear\"  ", &format!("\"{name}\"  "))).arm;
        assert_eq!(arm, space_arm(arm.model));
        assert_eq!(arm.parts, Parts::of(arm.model));
    }
}

#[test]
fn every_preset_reads_writes_and_runs() {
    for (name, _) in PRESETS {
        let mut file = preset(name).unwrap();
        assert_eq!(read(&file.to_toml().unwrap()), file);
        file.run.duration = 100.0 * file.run.sample_time;
        let record = run(&file, no_record).unwrap();
        assert_eq!(record.names().join(","), "t,tau1,tau2,q1,q2,qm1,qm2,dq1,dq2,dqm1,dqm2");
        assert_eq!(record, run(&file, no_record).unwrap());
    }
    let error = preset("moon-arm").unwrap_err().to_string();
    assert_eq!(
        error,
        "no preset 'moon-arm'; the presets are: space-arm, motor-log, elbow-test, short-stiff, frictionless"
    );
}

#[test]
fn everything_that_can_be_written_reads_back() {
    let switches = "coupling = false\nrotor_in_link_inertia = true\nfriction = false\n[[arm.link]]";
    let text = changed("[[arm.link]]", switches).replace("# locked = true ", "locked = true ")
        + "\n[noise]\nseed = 9\nstd = { q1 = 1e-4, dqm1 = 0.5 }\n[initial]\nq = [0.1, 2]\n";
    let file = read(&text);
    assert!(file.arm.joints[1].locked && !file.arm.parts.coupling && file.arm.parts.rotor_in_link_inertia);
    assert_eq!(file.initial.q, [0.1, 2.0]);
    assert_eq!(read(&file.to_toml().unwrap()), file);
}

#[test]
fn bad_files_say_file_line_key_unit_and_range() {
    let friction = "friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]";
    let amplitude = "amplitude = [40.0, 20.0]";
    let cases = [
        (
            "mass = 1.5075  ",
            "mass = -1.0  ",
            ": arm.link[1].mass: mass of link 1 is -1 kg, but must be positive",
        ),
        ("mass = 1.5075  ", "mass = \"heavy\" ", ": invalid type"),
        ("mass = 1.5075  ", "weight = 1.5  ", ": unknown field `weight`"),
        (
            "duration = 10.0",
            "duration = 0.0",
            "run.duration: duration is 0, but must be positive and finite (in s)",
        ),
        ("sample_time = 0.01", "sample_time = -1.0", "run.sample_time: "),
        ("rtol = 1e-9", "rtol = 2.0", "run.rtol: rtol is 2, but must be between"),
        ("kind = \"white\"", "kind = \"pink\"", "unknown variant `pink`"),
        (amplitude, "amplitude = -1", "excitation.amplitude: amplitude is -1"),
        (
            amplitude,
            "amplitude = [1, 2, 3]",
            ": invalid length 3, expected a number, or two numbers, one for each joint",
        ),
        (
            amplitude,
            "amplitude = [1]",
            ": invalid length 1, expected a number, or two numbers, one for each joint",
        ),
        (
            amplitude,
            "amplitude = \"loud\"",
            ": invalid type: string \"loud\", expected a number, or two numbers, one for each joint",
        ),
        (
            amplitude,
            "amplitude = [1, \"loud\"]",
            ": invalid type: string \"loud\", expected a number",
        ),
        (
            amplitude,
            "",
            "excitation.amplitude: missing; kind = \"white\" needs it",
        ),
        (
            amplitude,
            "amplitude = 1\nlevels = 3",
            "excitation.levels: does not belong to kind = \"white\"",
        ),
        (
            amplitude,
            "amplitude = 1\njoints = [3]",
            "excitation.joints: 3 is no joint",
        ),
        (
            "motor_inertia = 1.0",
            "motor_inertia = 0",
            "arm.joint[1].motor_inertia: ",
        ),
        (
            "linear = 500.0",
            "",
            "arm.joint[1].linear: missing; this model needs it, positive, in N m/rad",
        ),
        (
            "windup = 10.0",
            "windup = 500.0",
            "arm.joint[1].windup: windup of joint 1 is 500 N m/rad",
        ),
        (
            friction,
            "friction = [0.5, 150, 50, -2, 100, 0.5]",
            "arm.joint[1].friction: friction g4 of joint 1 is -2 N m",
        ),
        (
            "[run]",
            "[initial]\ndq = [inf, 0]\n[run]",
            "initial.dq: the initial dq1 is inf, but must be finite",
        ),
        (
            "[run]",
            "[noise]\nstd = { x = 1 }\n[run]",
            "noise.std.x: no noise on this column; the arm's columns are: tau1",
        ),
        (
            "[run]",
            "[noise]\nstd = { q1 = -1 }\n[run]",
            "noise.std.q1: -1, but a standard deviation",
        ),
        ("[run]", "[extra]\n[run]", "unknown field `extra`"),
        (
            "[run]",
            "[[arm.link]]\nmass=1\nlength=1\ncom=1\ninertia=1\n[run]",
            "arm.link: there are 3, but an arm has two",
        ),
        ("[run]", "[run", "arm.toml, line"),
    ];
    for (from, to, expected) in cases {
        let message = ArmFile::from_toml_str(&changed(from, to), "arm.toml")
            .unwrap_err()
            .to_string();
        assert!(message.contains(expected), "{expected}\n{message}");
        assert!(message.starts_with("arm.toml, line "), "{message}");
    }
    let text = changed("mass = 1.5075  ", "mass = -1.0  ");
    let line = 1 + text.lines().position(|l| l.contains("-1.0")).unwrap();
    let message = ArmFile::from_toml_str(&text, "arm.toml").unwrap_err().to_string();
    assert!(message.contains(&format!("line {line}:")), "{message}");
    let heavy = changed("motor_inertia = 1.0\n", "motor_inertia = 90.0\n");
    let message = ArmFile::from_toml_str(&heavy, "arm.toml").unwrap_err().to_string();
    assert!(
        message.contains("arm: the inertia matrix of the arm is not positive definite"),
        "{message}"
    );
}

#[test]
fn every_kind_of_excitation_drives_the_arm() {
    for keys in [
        "kind = \"white\"\namplitude = 5\ndistribution = \"gaussian\"",
        "kind = \"multisine\"\namplitude = 5\nf_min = 0.5\nf_max = 4\nphases = \"schroeder\"",
        "kind = \"chirp\"\namplitude = 5\nf_min = 0.1\nf_max = 4\nsweep = \"logarithmic\"",
        "kind = \"prbs\"\namplitude = 5\nhold = 5",
        "kind = \"multilevel\"\namplitude = 5\nlevels = 3",
        "kind = \"step\"\namplitude = 5\nstart = 0.5",
        "kind = \"white\"\namplitude = 0.05\ndrive = \"deflection\"\njoints = [2]",
    ] {
        let file = read(&excited(keys));
        assert_eq!(read(&file.to_toml().unwrap()), file);
        let record = run(&file, no_record).unwrap();
        assert!(record.column("q2").unwrap()[1000] != 0.0, "{keys}");
        if keys.contains("step") {
            let tau = record.column("tau1").unwrap();
            assert_eq!((tau[49], tau[50]), (0.0, 5.0));
        }
    }
}

#[test]
fn a_record_can_excite_the_arm() {
    let file = read(&excited("kind = \"record\"\nfile = \"past.csv\""));
    let past = run(&preset("space-arm").unwrap(), no_record).unwrap();
    assert_eq!(
        run(&file, |_| Ok::<_, String>(RecordFile::in_memory(
            past.clone(),
            "past.csv"
        )))
        .unwrap(),
        past
    );
    let reason = |record: Record| {
        run(&file, |_| Ok::<_, String>(RecordFile::in_memory(record, "past.csv")))
            .unwrap_err()
            .to_string()
    };
    assert!(reason(past.slice(0..9)).contains("'past.csv': it has 9 rows, but the run has 1001"));
    let untimed = Record::new([("tau1", vec![0.0; 1001])]).unwrap();
    assert!(reason(untimed).contains("no column 'tau2'"));
    let error = run(&file, no_record).unwrap_err();
    assert!(matches!(error, ArmError::Record { .. }));
    // Whoever has the arm file's text can say where it names the record.
    let text = excited("kind = \"record\"\nfile = \"past.csv\"");
    let line = 1 + text.lines().position(|l| l.starts_with("file = ")).unwrap();
    assert_eq!(
        error.located(&text, "arm.toml").to_string(),
        format!(
            "arm.toml, line {line}: excitation.file: the excitation record 'past.csv': past.csv is not to be loaded"
        )
    );
    let other = ArmError::from(flexure::Error::from(flexure::error::ArmError::RigidDeflection));
    assert_eq!(other.clone().located(&text, "arm.toml"), other);
}

#[test]
fn noise_changes_the_named_columns_alone() {
    let clean = run(&preset("space-arm").unwrap(), no_record).unwrap();
    let text = preset_text("space-arm").unwrap().to_owned() + "\n[noise]\nstd = { q1 = 1e-3 }\n";
    let noisy = run(&read(&text), no_record).unwrap();
    for (name, samples) in clean.columns() {
        assert_eq!(noisy.column(name).unwrap() == samples, name != "q1", "{name}");
    }
}
