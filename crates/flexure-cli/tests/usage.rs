//! Help, and wrong usage: exit code 2, one message, nothing written.

mod common;

use common::Folder;

const COMMANDS: [&str; 15] = [
    "compare", "control", "export", "fleet", "demo", "simulate", "study", "identify", "joint", "look", "predict",
    "prepare", "regress", "report", "validate",
];

#[test]
fn every_command_has_help_with_an_example() {
    let folder = Folder::new();
    let all = folder.done("--help");
    for command in COMMANDS {
        assert!(all.contains(&format!("\n  {command} ")), "{all}");
        for flag in ["--help", "-h"] {
            let help = folder.done(&format!("{command} {flag}"));
            let example = help.split("Example").nth(1).unwrap_or_else(|| panic!("{help}"));
            assert!(example.contains(&format!("  flexure {command} ")), "{help}");
            assert!(help.contains("--json"), "{help}");
        }
    }
    assert_eq!(
        folder.done("--version"),
        format!("flexure {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn no_command_prints_the_help() {
    let folder = Folder::new();
    let outcome = folder.run("");
    assert_eq!(outcome.code, Some(2));
    assert_eq!(outcome.stdout, "");
    assert!(
        COMMANDS.iter().all(|c| outcome.stderr.contains(&format!("\n  {c} "))),
        "{outcome:?}"
    );
}

/// What the examples in the help say works.
#[test]
fn the_examples_work() {
    let folder = Folder::new();
    folder.known("record.csv", 600, 1);
    folder.known("fresh.csv", 300, 2);
    for command in ["identify", "predict", "prepare", "validate", "regress"] {
        let help = folder.done(&format!("{command} --help"));
        let (_, examples) = help.split_once("\nExample").unwrap_or_else(|| panic!("{help}"));
        for example in examples.split("\n  flexure ").skip(1) {
            folder.done(&example.split_whitespace().collect::<Vec<_>>().join(" "));
        }
    }
}

#[test]
fn values_out_of_range() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    let count = "expected 'auto' or a whole number from 0";
    for (options, message) in [
        (
            "--order x",
            "'x' for '--order <auto|N>': expected 'auto' or a whole number from 0 to 50",
        ),
        (
            "--order 51",
            "'51' for '--order <auto|N>': expected 'auto' or a whole number from 0 to 50",
        ),
        (
            "--order -1",
            "'-1' for '--order <auto|N>': expected 'auto' or a whole number from 0 to 50",
        ),
        ("--delay -1", &*format!("'-1' for '--delay <auto|N>': {count}")),
        ("--delay 1.5", &*format!("'1.5' for '--delay <auto|N>': {count}")),
        (
            "--bandwidth 0",
            "'0' for '--bandwidth <auto|H>': expected a positive number",
        ),
        (
            "--bandwidth -2",
            "'-2' for '--bandwidth <auto|H>': expected a positive number",
        ),
        (
            "--bandwidth inf",
            "'inf' for '--bandwidth <auto|H>': expected a positive number",
        ),
        (
            "--kernel cosine",
            "'cosine' for '--kernel <NAME>': expected one of uniform, triangular, epanechnikov, biweight, triweight, gaussian",
        ),
        (
            "--lag first",
            "'first' for '--lag <strongest|delay|N>': expected 'strongest', 'delay' or a whole number from 0",
        ),
        (
            "--form line",
            "'line' for '--form <FORM>': expected dead-zone, saturation, limited-dead-zone, quantizer, polynomial:N with N from 1 to 15, friction or stiffness",
        ),
        (
            "--form polynomial:16",
            "'polynomial:16' for '--form <FORM>': expected dead-zone, saturation, limited-dead-zone, quantizer, polynomial:N with N from 1 to 15, friction or stiffness",
        ),
        (
            "--fresh 1",
            "'1' for '--fresh <SHARE>': expected a number from 0.05 to 0.9",
        ),
        (
            "--fresh nan",
            "'nan' for '--fresh <SHARE>': expected a number from 0.05 to 0.9",
        ),
        (
            "--fresh half",
            "'half' for '--fresh <SHARE>': expected a number from 0.05 to 0.9",
        ),
        (
            "--fresh 25",
            "'25' for '--fresh <SHARE>': expected a number from 0.05 to 0.9; 25 % is 0.25",
        ),
        (
            "--sample-time 5ms",
            "'5ms' for '--sample-time <S>': expected a positive number in s or Hz, without the unit: 0.005",
        ),
        (
            "--sample-time 0",
            "'0' for '--sample-time <S>': expected a positive number",
        ),
        (
            "--known a 1=1",
            "'a' for '--known <X=PHI> <X=PHI>': expected X=PHI, two numbers of a usual size (from 1e-100 to 1e100, or 0), for example 0=0",
        ),
        (
            "--unit metre",
            "'metre' for '--unit <UNIT>'\n  [possible values: static-gain, first-coefficient]",
        ),
        (
            "--structure fuzzy",
            "'fuzzy' for '--structure <STRUCTURE>'\n  [possible values: auto, linear, hammerstein, wiener, wiener-hammerstein, \
             hammerstein-wiener, feedback, parallel, multiple-inputs, joint-inputs, static, narx, volterra]",
        ),
        (
            "--method magic",
            "'magic' for '--method <METHOD>'\n  [possible values: refined, plain]",
        ),
    ] {
        folder.misused(
            &format!("identify r.csv --input u --output y -o new.json {options}"),
            &format!("invalid value {message}"),
        );
    }
    folder.misused(
        "validate m.json r.csv --input u --output y --skip -3",
        "invalid value '-3' for '--skip <N>': expected a whole number from 0",
    );
    folder.misused(
        "simulate --preset moon -o new.csv",
        "invalid value 'moon' for '--preset <NAME>': no preset 'moon'; the presets are: space-arm, motor-log, elbow-test, short-stiff, frictionless; of chains: free-space-arm, space-manipulator, six-joint-arm, seven-joint-arm",
    );
}

#[test]
fn options_that_contradict_each_other_or_are_missing() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    let identify = "identify r.csv --input u --output y -o new.json";
    for (points, shown) in [("0=0 0=1", "0=0 0=1"), ("0=2 1=2.0", "0=2 1=2")] {
        folder.misused(
            &format!("{identify} --known {points}"),
            &format!("--known {shown}: the two points must differ in X and in PHI"),
        );
    }
    for command in ["identify r.csv", "validate m.json r.csv"] {
        folder.misused(
            &format!("{command} --input u --output u"),
            "--input and --output are both 'u'; name two different columns",
        );
    }
    let usage = |command: &str, start: &str| {
        let before = folder.content();
        let outcome = folder.run(command);
        assert_eq!(outcome.code, Some(2), "{command}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "{command}");
        assert!(
            outcome.stderr.starts_with(&format!("error: {start}")),
            "{command}: {}",
            outcome.stderr
        );
        assert!(folder.content() == before, "{command}");
    };
    usage(
        &format!("{identify} --known 0=0"),
        "2 values required for '--known <X=PHI> <X=PHI>' but 1 was provided\n",
    );
    usage(
        &format!("{identify} --known 0=0 1=1 --unit static-gain"),
        "the argument '--known <X=PHI> <X=PHI>' cannot be used with '--unit <UNIT>'\n",
    );
    usage(
        "identify r.csv --input u",
        "r.csv: the signals are u, y, y0; name the output by --output\n",
    );
    usage(
        "predict m.json r.csv --input u",
        "the following required arguments were not provided:\n  --out <OUT.csv>\n",
    );
    usage(
        "simulate -o new.csv",
        "the following required arguments were not provided:\n  <ARM.toml|ROBOT.urdf|--preset <NAME>>\n",
    );
    usage(
        "simulate arm.toml --preset space-arm -o new.csv",
        "the argument '[ARM.toml|ROBOT.urdf]' cannot be used with '--preset <NAME>'\n",
    );
    usage(
        "simulate arm.toml",
        "say where the record is to be written: -o arm.csv, or -o arm.parquet\n",
    );
    usage("identfy r.csv", "unrecognized subcommand 'identfy'\n");
    usage(
        &format!("{identify} --delays 3"),
        "unexpected argument '--delays' found\n",
    );
}

/// A list names every column or part once.
#[test]
fn lists_that_name_something_twice() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    for (command, option, name) in [
        ("prepare r.csv -o p.csv --keep u,y,u", "keep", "u"),
        ("prepare r.csv -o p.csv --outliers u,u", "outliers", "u"),
        ("prepare r.csv -o p.csv --remove-mean y,y", "remove-mean", "y"),
        ("prepare r.csv -o p.csv --detrend y,y", "detrend", "y"),
        ("prepare r.csv -o p.csv --hold u,u", "hold", "u"),
        ("identify r.csv --input u,u --output y", "input", "u"),
        ("regress r.csv --x u,u --y y", "x", "u"),
        ("study rates --parts plain,refined,plain", "parts", "plain"),
    ] {
        folder.misused(command, &format!("--{option} names '{name}' twice; name each once"));
    }
}

/// Numbers that would overflow, or that no data make valid, are wrong usage; what the data decide is not.
#[test]
fn numbers_that_no_data_make_right() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    let identify = "identify r.csv --input u --output y";
    for options in [
        "--known 0=0 1e-12=1e300",
        "--known 0=1e308 1=-1e308",
        "--method plain --lag 18446744073709551615",
        "--nonlinearity knn --parameter 0",
        "--nonlinearity knn --parameter 1e18",
        "--nonlinearity polynomial --parameter 1000",
        "--nonlinearity network --parameter 1e9",
        "--nonlinearity haar --parameter 60",
        "--sample-time 1e308",
        "--sample-time 5e-324",
    ] {
        let outcome = folder.run(&format!("{identify} {options}"));
        assert_eq!(outcome.code, Some(2), "{options}: {outcome:?}");
        assert!(outcome.stderr.len() < 400, "{options}: {outcome:?}");
    }
    for command in [
        "prepare r.csv -o p.csv --sample-time 0.1 --low-pass 2 --order 3",
        "prepare r.csv -o p.csv --sample-time 1e308",
        "joint r.csv --torque u --motor y --link y0 --torque-constant 1e308",
        "excite --preset space-arm --max-torque 10 --duration 5 --torque-noise 1e308 -o e.csv",
        "simulate --preset six-joint-arm --duration 1 --sample-time 0.1 --start joint1=1e308 -o s.csv",
        "simulate --preset six-joint-arm --duration 1 --sample-time 0.1 --start joint1=1,joint1=2 -o s.csv",
    ] {
        let outcome = folder.run(command);
        assert_eq!(outcome.code, Some(2), "{command}: {outcome:?}");
    }
    folder.write("one.csv", "t\n0\n1\n2\n");
    for command in [
        "identify r.csv --input u --output y --period 5000",
        "identify r.csv --input u --output y --realisations 50",
        "identify one.csv",
    ] {
        let outcome = folder.run(command);
        assert_eq!(outcome.code, Some(1), "{command}: {outcome:?}");
    }
}

/// What an option cannot have is wrong usage, and is said before anything is computed.
#[test]
fn values_that_no_run_can_have() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.done("identify r.csv --input u --output y --structure linear -o m.json");
    folder.misused(
        "study rates --lengths 100,200 --runs 20",
        "--lengths 100: the part 'refined' needs at least 134 samples; give larger numbers, or --parts without it",
    );
    folder.misused(
        "prepare r.csv -o -",
        "'-' names no file to write; give a name that ends in .csv or .parquet",
    );
    folder.misused(
        "identify r.csv --input u --output y -o -",
        "'-' names no file to write; give a name, such as /dev/stdout",
    );
    folder.refused(
        "export m.json --to c -o same.h",
        2,
        "same.h: the file's name must end in .c, or be that of a folder",
    );
    let outcome = folder.run("simulate --preset six-joint-arm --duration -1 --sample-time 0.1 -o o.csv");
    assert_eq!(outcome.code, Some(2));
    assert!(outcome.stderr.contains("expected a positive number"), "{outcome:?}");
    folder.failed(
        "look r.csv --skip-lines 99999999999",
        "r.csv has nothing after the 99999999999 lines that are skipped; skip fewer",
    );
}

/// Values that are valid for some records, but not for this one, are a matter of the data.
#[test]
fn values_that_this_record_does_not_allow() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    let identify = "identify r.csv --input u --output y -o new.json";
    for (options, message) in [
        (
            "--method plain --delay 112",
            "the delay is 112, but must be below a quarter of the number of samples that are fitted",
        ),
        (
            "--method plain --lag 500",
            "the regression lag is 500, but must be below a quarter of the number of samples that are fitted",
        ),
        (
            "--method plain --known 0=0 9=1",
            "x2 of the calibration is 9, but must be a point with data within a bandwidth",
        ),
    ] {
        folder.failed(&format!("{identify} {options}"), &format!("r.csv: {message}"));
    }
}
