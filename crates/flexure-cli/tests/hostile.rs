//! Inputs that are made to do harm: what they cost is bounded, and what they say does not reach the terminal.

mod common;

use common::Folder;

/// A folder with a record of a joint whose motor and link are given as text, sample by sample.
fn joint(motor: impl Fn(f64) -> f64, link: impl Fn(f64) -> f64) -> Folder {
    let folder = Folder::new();
    let mut text = "t,qm,q,tau\n".to_owned();
    for k in 0..2000 {
        let t = 0.01 * f64::from(k);
        let tau = 3.0 * (1.3 * t).sin() + 2.0 * (4.1 * t).cos() + (0.37 * t).sin();
        text += &format!("{t:.2},{:?},{:?},{tau:?}\n", motor(t), link(t));
    }
    folder.write("log.csv", text);
    folder
}

fn motion(t: f64) -> f64 {
    (0.7 * t).sin() + 0.3 * (2.9 * t).sin() + 0.1 * (6.1 * t).cos()
}

#[test]
fn a_joint_without_a_deflection() {
    let equal = joint(motion, motion);
    equal.refused(
        "joint log.csv --motor qm --link q --torque tau",
        1,
        "log.csv: columns 'qm' and 'q' are equal: there is no deflection to see; use --position q for a rigid axis",
    );
    equal.refused(
        "joint log.csv --motor q --link q --torque tau",
        2,
        "--motor and --link are both 'q': there is no deflection to see; use --position q for a rigid axis\n\nFor more information, \
         try '--help'.",
    );
    equal.refused(
        "joint log.csv --position tau --torque tau",
        2,
        "column 'tau' is named twice; name every column once\n\nFor more information, try '--help'.",
    );
    equal.misused(
        "joint log.csv --position q --torque tau --reference q --kp 1 --kv 1",
        "column 'q' is named twice; name every column once",
    );
    // Nearly equal, by encoders of few steps.
    let coarse = |q: f64| (q * 50.0).round() / 50.0;
    for folder in [
        joint(|t| coarse(motion(t)), |t| coarse(motion(t) + 1e-4 * t.sin())),
        joint(motion, |t| motion(t) + if t == 3.0 { 1e-12 } else { 0.0 }),
        joint(motion, |t| motion(t) + 1e-3),
    ] {
        let outcome = folder.run("joint log.csv --motor qm --link q --torque tau");
        assert!(matches!(outcome.code, Some(0 | 1)), "{outcome:?}");
    }
}

/// No option's number makes a command take memory or time without an end.
#[test]
fn numbers_of_options_have_an_end() {
    let folder = Folder::new();
    folder.known("r.csv", 300, 1);
    for arguments in [
        "study rates --lengths 1000000000000,2000000000000",
        "study rates --lengths 20,10",
        "study rates --lengths 100",
        "study rates --lengths 50,100 --parts refined --runs 20",
        "study rates --runs 99999999999",
        "study rates --runs 1",
        "regress r.csv --x u --y y --grid 99999999999",
        "regress r.csv --x u,y --y y0 --grid 100000",
        "regress r.csv --x u --y y --block 99999999999999",
        "excite --preset space-arm --max-torque 10 --duration 1e12 -o e.csv",
        "excite --preset space-arm --max-torque 10 --duration 0.01 -o e.csv",
        "excite --preset space-arm --max-torque 1e-300 --duration 5 -o e.csv",
        "excite --preset none --max-torque 1 -o e.csv",
        "prepare r.csv --low-pass 10 --order 1000000000 -o e.csv",
        "prepare r.csv --fill 99999999999999 -o e.csv",
        "identify r.csv --period 99999999999999",
        "identify r.csv --memory 0",
        "identify r.csv --memory much",
        "validate m.json r.csv --skip 99999999999999999999",
    ] {
        let outcome = folder.run(arguments);
        assert_eq!(outcome.code, Some(2), "{arguments}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "{arguments}");
    }
    assert_eq!(folder.content().len(), 1);
}

/// One huge sample is named, and not its neighbours, which are small only in comparison with it.
#[test]
fn an_outlier_is_named() {
    let folder = Folder::new();
    let mut text = "t,u,y\n".to_owned();
    for k in 0..400 {
        let u = if k == 50 { 2.1e91 } else { (f64::from(k) * 0.7).sin() };
        text += &format!(
            "{:.2},{u:e},{:.4}\n",
            0.01 * f64::from(k),
            (f64::from(k) * 0.7 - 0.3).sin()
        );
    }
    folder.write("r.csv", text);
    folder.refused(
        "identify r.csv --input u --output y",
        1,
        "r.csv, line 52: column 'u' is 2.1e91 at sample 50, so large that all others are constant in comparison; remove or repair that sample",
    );
}

#[test]
fn a_record_larger_than_the_limit_is_refused_until_the_limit_is_raised() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 1);
    folder.refused(
        "look r.csv --memory 10KiB",
        1,
        "r.csv: the table takes more memory than the limit of 10 KiB; --memory SIZE (such as 8GiB) allows more",
    );
    assert_eq!(folder.run("look r.csv --memory 10MiB").code, Some(0));
}

/// What is computed has room in the memory, or is refused before it is begun. Here the process has a limit of its own.
#[cfg(target_os = "linux")]
#[test]
fn records_that_are_computed_have_room() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 1);
    folder.done("simulate --preset space-arm --write-arm a.toml");
    let long = folder.read("a.toml").replace("duration = 10.0", "duration = 900000.0");
    folder.write("a.toml", long);
    folder.done("control --preset rest-to-rest --write-scenario s.toml --dry-run");
    let scenario = folder.read("s.toml");
    let sample_time = scenario.lines().find(|line| line.starts_with("sample_time")).unwrap();
    let short = scenario.replace(sample_time, "sample_time = 2.5e-6");
    folder.write("s.toml", short);
    let before = folder.content();
    for arguments in [
        "simulate a.toml -o out.csv",
        "simulate --preset seven-joint-arm --duration 900000 --sample-time 0.01 -o out.csv",
        "excite --preset space-arm --max-torque 10 --duration 90000 -o out.csv",
        "prepare r.csv --sample-time 0.01 --resample 3e-7 -o out.csv",
        "control s.toml -o out.csv",
    ] {
        let outcome = folder.run_under("ulimit -v 4000000", arguments);
        assert_eq!(outcome.code, Some(1), "{arguments}: {outcome:?}");
        assert!(
            outcome.stderr.contains("half of the free memory"),
            "{arguments}: {outcome:?}"
        );
    }
    assert_eq!(folder.content(), before);
}

#[cfg(unix)]
#[test]
fn a_device_without_an_end_is_no_arm_and_no_model() {
    let folder = Folder::new();
    folder.known("r.csv", 300, 1);
    for (arguments, limit) in [
        ("simulate /dev/zero -o s.csv", "16 MiB"),
        ("validate /dev/zero r.csv", "256 MiB"),
    ] {
        let message = format!("/dev/zero: the file takes more memory than the limit of {limit}; is it the right file?");
        folder.refused(arguments, 1, &message);
    }
}

/// Names and texts of a file are shown, but are no commands to a terminal.
#[test]
fn control_characters_do_not_reach_the_terminal() {
    let folder = Folder::new();
    let evil = "\u{1b}]0;owned\u{7}\u{1b}[2Ju\u{9b}31m\u{202e}\u{200b}\u{2028}";
    let mut text = format!("t,{evil},y\n");
    for k in 0..200 {
        text += &format!("{:.2},{},{}\n", 0.01 * f64::from(k), (f64::from(k) * 0.7).sin(), k % 17);
    }
    folder.write("evil.csv", text);
    folder.write("bad.csv", format!("u,y\n1,2\n3,{evil}\n"));
    folder.write("model.json", format!("{{\"format\": \"{}\"}}", "\\u001b[2J"));
    for arguments in [
        "look evil.csv",
        "look evil.csv --json",
        "regress evil.csv --x z --y y",
        "identify evil.csv --input z --output y",
        "identify bad.csv --input u --output y",
        "validate model.json evil.csv",
    ] {
        let outcome = folder.run(arguments);
        let printed = outcome.stdout + &outcome.stderr;
        let command = printed
            .chars()
            .find(|c| c.is_control() && *c != '\n' || ['\u{202e}', '\u{200b}', '\u{2028}'].contains(c));
        assert_eq!(command, None, "{arguments}: {printed:?}");
        assert!(!printed.is_empty());
    }
    // A line break in the name of a file begins no line.
    folder.write("a\nwrote b.csv", "u,y\n1,2\n");
    for command in ["look", "identify --input u --output y"] {
        let outcome = common::outcome(folder.command(command).arg("a\nwrote b.csv"));
        let printed = outcome.stdout + &outcome.stderr;
        assert!(printed.contains(r"a\u000awrote b.csv"), "{command}: {printed}");
        assert!(
            !printed.lines().any(|line| line.starts_with("wrote b")),
            "{command}: {printed}"
        );
    }
}

/// Messages about a file can be read, no matter what the file contains.
#[test]
fn messages_are_short() {
    let folder = Folder::new();
    let long = "x".repeat(200_000);
    let many = (0..20_000).map(|i| format!("c{i}")).collect::<Vec<_>>().join(",");
    folder.write("long.csv", format!("{long},y\n1,2\n"));
    folder.write("many.csv", format!("{many}\n"));
    folder.write("huge.csv", "t,u,y\n0,1e300,1\n1,1e300,2\n2,1e300,4\n3,1e300,3\n");
    folder.write("arm.toml", format!("{long} = 1\n"));
    folder.write("model.json", format!("{{\"format\": \"{long}\"}}"));
    for arguments in [
        "look long.csv --time z",
        "identify long.csv --input z --output y",
        "identify many.csv --input z --output y",
        "identify huge.csv --input u --output y",
        "regress huge.csv --x u --y y",
        "regress long.csv --x z --y y",
        "simulate arm.toml -o s.csv",
        "validate model.json long.csv",
    ] {
        let outcome = folder.run(arguments);
        assert_eq!(outcome.code, Some(1), "{arguments}: {outcome:?}");
        assert!(
            outcome.stderr.len() < 5000,
            "{arguments}: {} bytes",
            outcome.stderr.len()
        );
        assert!(
            !outcome.stderr.contains(&"0".repeat(30)),
            "{arguments}: {}",
            outcome.stderr
        );
    }
}

/// Numbers of options are shown with all their digits, however small or large they are.
#[test]
fn numbers_of_options_are_shown_short() {
    let folder = Folder::new();
    let rows: String = (0..300)
        .map(|k| format!("{:.2},{},{}\n", 0.01 * f64::from(k), k % 7, (k * k) % 11))
        .collect();
    folder.write("r.csv", format!("t,u,y\n{rows}"));
    for arguments in [
        "identify r.csv --input u --output y --sample-time 1e-300",
        "prepare r.csv --sample-time 0.01 --resample 1e300 -o out.csv",
        "prepare r.csv --sample-time 0.01 --cut 1e300:1e301 -o out.csv",
        "prepare r.csv --sample-time 0.01 --low-pass 1e-300 -o out.csv",
        "joint r.csv --position u --torque y --sample-time 1e-300",
    ] {
        let outcome = folder.run(arguments);
        let said = outcome.stderr + &outcome.stdout;
        assert!(!said.contains(&"0".repeat(30)), "{arguments}: {said}");
    }
}

/// What is known before anything is read or computed is wrong usage.
#[test]
fn names_of_files_to_write_are_checked_first() {
    let folder = Folder::new();
    folder.known("r.csv", 300, 1);
    folder.done("simulate --preset space-arm --write-arm a.toml");
    for (arguments, said) in [
        ("simulate a.toml -o out.txt", "out.txt"),
        ("prepare r.csv -o out.doc", "out.doc"),
        ("identify r.csv --input u --output y -o -", "'-' names no file to write"),
    ] {
        let outcome = folder.run(arguments);
        assert_eq!(outcome.code, Some(2), "{arguments}: {outcome:?}");
        assert!(outcome.stderr.contains(said), "{arguments}: {outcome:?}");
    }
}

/// An arm whose simulation fails takes no other file's place.
#[test]
fn an_arm_that_cannot_be_simulated_is_not_written() {
    let folder = Folder::new();
    folder.done("simulate --preset space-arm --write-arm a.toml");
    let arm = folder.read("a.toml");
    let (head, _) = arm.split_once("[excitation]").unwrap();
    folder.write("torques.csv", "tau1,tau2\n".to_owned() + &"1e12,0\n".repeat(1001));
    folder.write(
        "a.toml",
        format!("{head}[excitation]\nkind = \"record\"\nfile = \"torques.csv\"\n"),
    );
    folder.write("kept.toml", "old");
    let outcome = folder.run("simulate a.toml -o out.csv --write-arm kept.toml");
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert_eq!(folder.read("kept.toml"), "old");
}

/// A file beyond the system's limit is an error like that of a full disk.
#[cfg(unix)]
#[test]
fn a_limit_of_file_sizes_is_a_failed_write() {
    let folder = Folder::new();
    folder.known("r.csv", 5000, 1);
    folder.write("out.csv", "old");
    let before = folder.content();
    let outcome = folder.run_under("ulimit -f 16", "prepare r.csv -o out.csv");
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains("out.csv"), "{outcome:?}");
    assert_eq!(folder.content(), before);
}

/// A folder that takes no file is named before anything is computed. Whoever may do everything may write there too.
#[cfg(unix)]
#[test]
fn a_folder_that_takes_no_file_is_named_first() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = Folder::new();
    folder.known("r.csv", 300, 1);
    let closed = folder.path("closed");
    std::fs::create_dir(&closed).unwrap();
    std::fs::set_permissions(&closed, std::fs::Permissions::from_mode(0o555)).unwrap();
    if std::fs::write(closed.join("probe"), "").is_ok() {
        println!("skipped: this user may write to every folder");
        return;
    }
    // The record's columns are not looked at before.
    let outcome = folder.run("identify r.csv --input none --output y -o closed/m.json");
    assert!(outcome.stderr.contains("closed/m.json"), "{outcome:?}");
}

/// An arm file from somebody else can read only the files in its folder, and reveals nothing about others.
#[test]
fn an_arm_file_names_records_beside_it() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("arms")).unwrap();
    folder.write("secret.csv", "tau1,tau2\n0,hunter2\n");
    let text = folder.done("simulate --preset space-arm --write-arm arms/a.toml");
    assert!(text.contains("wrote"));
    let arm = folder.read("arms/a.toml");
    let (head, _) = arm.split_once("[excitation]").unwrap();
    let head = head.replace("duration = 10.0", "duration = 0.1");
    let named = |name: &str| {
        folder.write(
            "arms/a.toml",
            format!("{head}[excitation]\nkind = \"record\"\nfile = \"{name}\"\n"),
        )
    };
    #[cfg(unix)]
    std::os::unix::fs::symlink("../secret.csv", folder.path("arms/link.csv")).unwrap();
    let absolute = folder.path("secret.csv").display().to_string();
    for name in [
        "../secret.csv",
        "x/../../secret.csv",
        "link.csv",
        &absolute,
        "/dev/zero",
    ] {
        named(name);
        let outcome = folder.run("simulate arms/a.toml -o s.csv");
        assert_eq!(outcome.code, Some(1), "{name}: {outcome:?}");
        assert!(outcome.stderr.contains("--allow-paths"), "{name}: {outcome:?}");
        let allowed = folder.run("simulate arms/a.toml -o s.csv --allow-paths");
        assert_eq!(allowed.code, Some(1), "{name}: {allowed:?}");
        for outcome in [outcome, allowed] {
            assert!(
                !outcome.stderr.contains("hunter2") && !outcome.stderr.contains("tau1"),
                "{outcome:?}"
            );
        }
    }
    // So does a scenario of its arm.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.csv", folder.path("arms/plant.toml")).unwrap();
        folder.done("control --preset rest-to-rest --write-scenario arms/s.toml --dry-run");
        let scenario = folder.read("arms/s.toml");
        let line = scenario.lines().find(|line| line.starts_with("arm =")).unwrap();
        folder.write("arms/s.toml", scenario.replace(line, "arm = \"plant.toml\""));
        let outcome = folder.run("control arms/s.toml --dry-run");
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(
            outcome.stderr.contains("in the scenario's folder or below") && !outcome.stderr.contains("hunter2"),
            "{outcome:?}"
        );
    }
    // Beside it, it is a record like any other.
    folder.write("arms/good.csv", "tau1,tau2\n".to_owned() + &"1,0\n".repeat(200));
    named("good.csv");
    folder.done("simulate arms/a.toml -o s.csv");
}

/// What is wrong is said in the words of whoever wrote the file, or gave the option.
#[test]
fn what_is_wrong_is_named_as_the_user_knows_it() {
    let folder = Folder::new();
    folder.done("simulate --preset space-arm --write-arm a.toml");
    let arm = folder.read("a.toml");
    folder.write("a.toml", arm.replace("[0.5, 150.0, 50.0, 2.0, 100.0, 0.5]", "[0.5]"));
    let outcome = folder.run("simulate a.toml -o s.csv");
    assert!(
        outcome
            .stderr
            .contains("there must be 6 numbers in this list, but it has 1"),
        "{outcome:?}"
    );
    // Nothing but one level of x is left where the weight is positive.
    let rows: String = (0..60)
        .map(|k| format!("{},{},{}\n", k % 3, k % 7, u8::from(k % 3 == 1)))
        .collect();
    folder.write("w.csv", format!("speed,torque,w\n{rows}"));
    for estimator in ["spline", "kernel", "polynomial"] {
        let outcome = folder.run(&format!(
            "regress w.csv --x speed --y torque --weights w --estimator {estimator}"
        ));
        assert!(!outcome.stderr.contains("'x'"), "{outcome:?}");
    }
    for (arguments, said) in [
        ("study rates --lengths 20,10", "10 follows 20"),
        ("study rates --lengths 100", "at least two numbers of samples"),
    ] {
        let outcome = folder.run(arguments);
        assert_eq!(outcome.code, Some(2), "{outcome:?}");
        assert!(outcome.stderr.contains(said), "{outcome:?}");
    }
}
