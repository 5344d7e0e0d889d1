//! Models and arms that cannot be used, and outputs that cannot be written.

mod common;

use common::Folder;
use serde_json::Value;

#[test]
fn models_that_cannot_be_used() {
    let folder = Folder::new();
    folder.known("good.csv", 600, 1);
    folder.done("identify good.csv --input u --output y -o model.json");
    let text = folder.read("model.json");
    let changed = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut model: Value = serde_json::from_str(&text).unwrap();
        change(&mut model);
        folder.write(name, model.to_string());
    };
    changed("version.json", &|m| m["version"] = 3.into());
    changed("format.json", &|m| m["format"] = "other".into());
    changed("unstable.json", &|m| {
        m["block"]["series"][1]["linear"]["a"] = serde_json::json!([1.0, -2.0]);
    });
    changed("nothing.json", &|m| m["block"]["series"] = Value::Array(Vec::new()));
    changed("time.json", &|m| m["sample_time"] = (-1.0).into());
    changed("unnamed.json", &|m| m["inputs"] = serde_json::json!([""]));
    folder.write("cut.json", "{ \"format\": \"flexure-model\",\n  \"version\": ");
    folder.write("empty.json", "");
    folder.write("blockless.json", "{ \"format\": \"flexure-model\", \"version\": 1,\n  \"flexure\": \"0.1.0\", \"structure\": \"hammerstein\", \"method\": \"plain\", \"input\": \"u\", \"output\": \"y\", \"delay\": 0, \"order\": 1 }");
    let version = env!("CARGO_PKG_VERSION");
    for (name, message) in [
        (
            "version.json",
            &*format!(
                "version.json: the model's format version is 3, but Flexure {version} reads versions 1 to 2; identify the model again or update Flexure"
            ),
        ),
        (
            "format.json",
            "format.json: not a model file: its \"format\" is \"other\", not \"flexure-model\"; models are written by `flexure identify -o`",
        ),
        (
            "unstable.json",
            "unstable.json: its linear part with a = [1.0, -2.0] is unstable, so its output would grow without bound; identify the model again",
        ),
        (
            "nothing.json",
            "nothing.json: it contains no block; identify the model again",
        ),
        (
            "time.json",
            "time.json: sample_time is -1, but must be positive and finite, or null",
        ),
        (
            "unnamed.json",
            "unnamed.json: an input is empty, but must be a column's name",
        ),
        (
            "cut.json",
            "cut.json, line 2, column 13: the file is empty or was cut off; models are written by `flexure identify -o`",
        ),
        (
            "empty.json",
            "empty.json, line 1, column 0: the file is empty or was cut off; models are written by `flexure identify -o`",
        ),
        (
            "blockless.json",
            "blockless.json, line 2, column 122: missing field `block`; models are written by `flexure identify -o`",
        ),
        (
            "good.csv",
            "good.csv: not a model file; a command takes the model first, then the record",
        ),
        (
            "absent.json",
            "cannot read absent.json: there is no such file or directory",
        ),
    ] {
        folder.failed(&format!("predict {name} good.csv --input u -o new.csv"), message);
        folder.failed(&format!("validate {name} good.csv --input u --output y"), message);
    }
}

/// What a curve says of inputs beyond its ends decides: a value, a straight line, or that nothing is known.
#[test]
fn inputs_beyond_the_curve() {
    let folder = Folder::new();
    let model = |name: &str, outside: &str| {
        let text = format!(
            r#"{{"format": "flexure-model", "version": 1, "flexure": "0.1.0", "structure": "hammerstein", "method": "plain",
            "input": "u", "output": "y", "delay": 0, "order": 1, "block": {{"series": [
            {{"static": {{"x": [-1.0, 0.0, 2.0], "y": [-1.0, 0.0, 3.0], "outside": "{outside}"}}}},
            {{"linear": {{"b": [0.5], "a": [1.0, -0.5]}}}}]}}}}"#
        );
        folder.write(name, text);
    };
    for outside in ["nan", "nearest", "linear"] {
        model(&format!("{outside}.json"), outside);
    }
    let rows = |at: f64| -> String {
        let rows = (0..100).map(|k| {
            format!(
                "{},{}\n",
                if k == 40 { at } else { f64::from(k % 3) - 1.0 },
                (k * k) % 7
            )
        });
        format!("# measured\nu,y\n{}", rows.collect::<String>())
    };
    folder.write("within.csv", rows(2.0));
    folder.write("beyond.csv", rows(2.5));
    folder.write("huge.csv", rows(1.5e308));
    let predict = |model: &str, record: &str| format!("predict {model}.json {record}.csv --input u -o new.csv");
    let validate = |model: &str, record: &str| format!("validate {model}.json {record}.csv --input u --output y");
    for command in [predict("nan", "beyond"), validate("nan", "beyond")] {
        folder.failed(
            &command,
            "beyond.csv, line 43: column 'u' is 2.5 at sample 40, but the model's nonlinearity is known only from -1 to 2; \
             cut such samples off, or identify the model from a record with a wider range",
        );
    }
    for command in [predict("linear", "huge"), validate("linear", "huge")] {
        let outcome = folder.run(&command);
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(outcome.stderr.starts_with("error: huge.csv, line "), "{outcome:?}");
    }
    let warning = "warning: 1 input sample lies outside the range in which the nonlinearity was identified; there it";
    for command in [predict, validate] {
        for model in ["nan", "nearest", "linear"] {
            assert!(!folder.done(&command(model, "within")).contains("warning"), "{model}");
        }
        for (model, behaviour) in [
            ("nearest", "is held at its end value"),
            ("linear", "continues as a straight line"),
        ] {
            let printed = folder.said(&command(model, "beyond"));
            assert!(printed.contains(&format!("{warning} {behaviour}")), "{printed}");
        }
    }
}

const ARM: &str = r#"[arm]
model = "nonlinear"
[[arm.link]]
mass = 1.5
length = 4.5
com = 2.25
inertia = 2.5
[[arm.link]]
mass = 1.5
length = 4.5
com = 2.25
inertia = 2.5
[[arm.joint]]
motor_inertia = 1.0
linear = 500.0
[[arm.joint]]
motor_inertia = 1.0
linear = 500.0
[run]
duration = 1.0
sample_time = 0.01
[excitation]
kind = "zero"
"#;

#[test]
fn arms_that_cannot_be_simulated() {
    let folder = Folder::new();
    folder.write("arm.toml", ARM);
    folder.done("simulate arm.toml -o good.csv");
    for (old, new, message) in [
        (
            "mass = 1.5\n",
            "mass = -1.5\n",
            ", line 4: arm.link[1].mass: mass of link 1 is -1.5 kg, but must be positive and finite",
        ),
        (
            "mass = 1.5\n",
            "mass = nan\n",
            ", line 4: arm.link[1].mass: mass of link 1 is NaN kg, but must be positive and finite",
        ),
        (
            "motor_inertia = 1.0",
            "motor_inertia = 0.0",
            ", line 14: arm.joint[1].motor_inertia: motor_inertia of joint 1 is 0 kg m^2, but must be positive and finite",
        ),
        (
            "com = 2.25\ninertia = 2.5",
            "com = 0.0\ninertia = 0.0",
            ", line 1: arm: the inertia matrix of the arm is not positive definite at q2 = 0 rad (its determinant is 0); check the links' masses, lengths and inertias, and the motor inertia of joint 2, which the coupling S takes from M11",
        ),
        (
            "mass = 1.5\n",
            "mas = 1.5\n",
            ", line 4: unknown field `mas`, expected one of `mass`, `length`, `com`, `inertia`",
        ),
        ("mass = 1.5\n", "", ", line 3: missing field `mass`"),
        (
            "mass = 1.5\n",
            "mass = \"heavy\"\n",
            ", line 4: invalid type: string \"heavy\", expected a number",
        ),
        (
            "\"nonlinear\"",
            "\"stiff\"",
            ", line 2: unknown variant `stiff`, expected one of `rigid`, `linear`, `nonlinear`",
        ),
        (
            "duration = 1.0",
            "duration = -1.0",
            ", line 20: run.duration: duration is -1, but must be positive and finite (in s)",
        ),
        (
            "mass = 1.5\n",
            "mass = = 1.5\n",
            ", line 4: extra `=`, expected nothing",
        ),
        (ARM, "", ", line 1: missing field `arm`"),
    ] {
        assert!(ARM.contains(old));
        let all = old.starts_with("com");
        folder.write(
            "bad.toml",
            if all {
                ARM.replace(old, new)
            } else {
                ARM.replacen(old, new, 1)
            },
        );
        folder.failed("simulate bad.toml -o new.csv", &format!("bad.toml{message}"));
        folder.failed(
            "simulate bad.toml -o good.csv --write-arm new.toml",
            &format!("bad.toml{message}"),
        );
    }
    folder.failed(
        "simulate absent.toml -o new.csv",
        "cannot read absent.toml: there is no such file or directory",
    );
    // A text in a file makes no line of its own.
    folder.write("forged.toml", "[arm]\nmodel = \"x\\nwrote new.csv\"\n");
    folder.failed(
        "simulate forged.toml -o new.csv",
        "forged.toml, line 2: unknown variant `x; wrote new.csv`, expected one of `rigid`, `linear`, `nonlinear`",
    );
    folder.write("latin.toml", b"# \xe9\n");
    folder.failed(
        "simulate latin.toml -o new.csv",
        "cannot read latin.toml: it is not text in UTF-8",
    );
}

/// An excitation record is named by the arm file, so that is where to look.
#[test]
fn excitation_records_that_cannot_be_used() {
    let folder = Folder::new();
    folder.write(
        "arm.toml",
        ARM.replace("kind = \"zero\"", "kind = \"record\"\nfile = \"past.csv\""),
    );
    let line = 1 + folder
        .read("arm.toml")
        .lines()
        .position(|l| l.starts_with("file = "))
        .unwrap();
    let refused = |reason: &str| {
        folder.failed(
            "simulate arm.toml -o new.csv",
            &format!("arm.toml, line {line}: excitation.file: the excitation record 'past.csv': {reason}"),
        );
    };
    refused("cannot read past.csv: there is no such file or directory");
    folder.write("past.csv", "tau1,tau2\n1,2\n3,abc\n");
    refused(
        "past.csv, line 3: column 'tau2' holds 'abc' at sample 1, which is not a number (numbers look like -1.5e-3; --missing-text 'abc' takes it for a missing sample; --time-format is for time stamps)",
    );
    folder.write("past.csv", "tau1,tau2\n1,2\n3,4\n");
    refused("it has 2 rows, but the run has 101 instants; shorten the duration");
    folder.write("past.csv", format!("tau1,tau2\n{}", "1,2\n".repeat(101)));
    folder.done("simulate arm.toml -o new.csv");
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = Folder::new();
    folder.known("good.csv", 600, 1);
    folder.write("arm.toml", ARM);
    folder.done("identify good.csv --input u --output y -o model.json");
    std::fs::create_dir(folder.path("folder.csv")).unwrap();
    let commands = [
        "identify good.csv --input u --output y -o OUT",
        "identify good.csv --input u --output y --report OUT -o model.json",
        "predict model.json good.csv --input u -o OUT",
        "simulate arm.toml -o OUT",
        "simulate arm.toml -o good.csv --write-arm OUT",
    ];
    for command in commands {
        for (out, message) in [
            ("absent/new.csv", "there is no such file or directory"),
            ("folder.csv", "it is a directory, not a file"),
            ("arm.toml/new.csv", "a part of its path is not a directory"),
        ] {
            folder.failed(&command.replace("OUT", out), &format!("cannot write {out}: {message}"));
        }
    }
    for command in [
        "predict model.json good.csv --input u -o new.txt",
        "simulate arm.toml -o new.txt",
    ] {
        folder.refused(
            command,
            2,
            "cannot write new.txt: a record's file name must end in .csv or .parquet",
        );
    }
}
