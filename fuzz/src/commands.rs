//! Inputs for runs of the program: columns, arguments and files.

use rand::RngExt;
use rand_pcg::Pcg64;

/// Columns: a name, and the sample k of n.
pub type Column = (&'static str, fn(f64, &mut Pcg64) -> f64);

pub const COLUMNS: [Column; 14] = [
    ("zero", |_, _| 0.0),
    ("constant", |_, _| 3.25),
    ("white", |_, r| r.random_range(-1.0..1.0)),
    ("sine", |k, _| (0.1 * k).sin()),
    ("ramp", |k, _| k),
    ("huge", |k, r| 1e300 * (0.3 * k).sin() * r.random_range(0.5..1.0)),
    ("tiny", |k, r| 1e-300 * (0.3 * k).sin() * r.random_range(0.5..1.0)),
    ("denormal", |k, _| 5e-324 * (k % 7.0)),
    (
        "outlier",
        |k, r| if k == 50.0 { 2.1e91 } else { r.random_range(-1.0..1.0) },
    ),
    ("levels", |k, _| ((0.2 * k).sin() * 2.0).round()),
    ("offset", |k, r| 1e15 + (0.1 * k).sin() + r.random_range(-0.1..0.1)),
    ("missing", |k, r| {
        if k % 40.0 == 7.0 {
            f64::NAN
        } else {
            r.random_range(-1.0..1.0)
        }
    }),
    ("pulse", |k, _| f64::from(k == 30.0)),
    ("late", |k, r| if k < 150.0 { 0.0 } else { r.random_range(-1.0..1.0) }),
];

/// Commands on a record `r.csv` with three of these columns, a, b and c.
pub const COMMANDS: [&str; 16] = [
    "look r.csv --json",
    "identify r.csv --input a --output b -o model.json --json",
    "identify r.csv --input a --output b --structure linear -o model.json --json",
    "identify r.csv --input a --output b --method plain -o model.json --json",
    "identify r.csv --input a --output b --structure static -o model.json --json",
    "identify r.csv --input a --output b --structure narx -o model.json --json",
    "identify r.csv --input a,c --output b --structure joint-inputs -o model.json --json",
    "regress r.csv --x a --y b --json",
    "regress r.csv --x a --y b --estimator spline --json",
    "regress r.csv --x a,c --y b --estimator neighbours --band-method none --json",
    "joint r.csv --position a --torque b --json",
    "joint r.csv --motor a --link c --torque b --arm arm.toml --json",
    "joint r.csv --motor a --link b --torque c --json",
    "prepare r.csv --outliers all --resample 0.02 --fill 10 -o model.csv --json",
    "identify r.csv --input a --output b --structure feedback --order 1 -o model.json --json",
    "fleet r.csv --by a --input b --output c --structure linear -o results --json",
];

/// Arguments that are changed.
pub const ARGUMENTS: [&str; 22] = [
    "look r.csv --separator comma --skip-lines 0 --memory 1GiB",
    "regress r.csv --x a --y b --grid 50 --estimator kernel --bandwidth 0.3 --band 0.9 --seed 3",
    "identify r.csv --input a --output b --order 2 --delay 1 --fresh 0.3 --structure linear",
    "prepare r.csv --cut 0.1:1.5 --resample 0.02 --low-pass 5 --order 2 -o out.csv",
    "study rates --lengths 50,100 --runs 20 --seed 1",
    "simulate --preset motor-log --write-arm arm.toml",
    "excite --preset space-arm --max-torque 10,5 --duration 0.5 --levels 5 --kind multilevel --hold 0.1 -o e.csv",
    "joint r.csv --position a --torque b --gear-ratio 2 --sample-time 0.01 --torque-constant 1 --band 0.9",
    "simulate robot.urdf --duration 0.1 --sample-time 0.01 --start elbow=0.5 --free-base --no-gravity -o out.csv --json",
    "simulate chain.toml --duration 0.05 --sample-time 0.01 --start shoulder=-1,elbow=0.1 -o out.csv",
    "export model.json --to c --name motor -o out.c --json",
    "export model.json --to fmu --fmi 3 -o out.fmu",
    "fleet fleet --by plant --input u0 --output y --structure linear --fresh 0.3 --table csv -o fresh --json",
    "fleet s.csv --by k --position u0 --torque y --band 0.9 --gear-ratio 2 -o fresh",
    "predict good.json s.csv --horizon 5 --initial-state steady -o out.csv",
    "validate good.json s.csv --skip 5 --input u0 --output y --json",
    "compare good.json good.json s.csv --skip 3",
    "report good.json s.csv -o out.html",
    "man look",
    "control short.toml --seeds 2 --of lqg -o out.csv --report out.html --json",
    "control --preset rest-to-rest --write-scenario out.toml --dry-run --json",
    "joint s.csv --motor u0 --link u1 --torque y --motor-friction out.csv --arm out.toml --json",
];

/// Commands, each with its file that is changed or gets the content of another. Their outputs are named `out`, or are in the folder
/// `fresh`.
pub const ON_FILES: [(&str, &str); 38] = [
    ("s.csv", "look s.csv --json"),
    (
        "s.csv",
        "prepare s.csv --outliers u0 --resample 0.02 --fill 3 -o out.csv --json",
    ),
    ("s.csv", "prepare s.csv r.csv -o out.parquet"),
    (
        "s.csv",
        "identify s.csv --input u0 --output y --structure linear -o out.json --json",
    ),
    (
        "s.csv",
        "identify s.csv --input u0 --output y --structure static -o out.json --report out.html",
    ),
    (
        "s.csv",
        "regress s.csv --x u0 --y y --grid 10 --band-method none -o out.csv",
    ),
    (
        "s.csv",
        "joint s.csv --position u0 --torque y --friction out.csv --json",
    ),
    ("s.csv", "validate good.json s.csv --json"),
    (
        "s.csv",
        "fleet s.csv --by k --input u0 --output y --structure linear -o fresh --json",
    ),
    ("s.csv", "export s.csv --to c -o out.c"),
    ("s.parquet", "look s.parquet --json"),
    ("s.parquet", "predict good.json s.parquet -o out.csv"),
    ("model.json", "validate model.json s.csv --json"),
    ("model.json", "predict model.json s.csv -o out.csv --json"),
    ("model.json", "predict model.json s.csv --horizon 3 -o out.csv"),
    ("model.json", "compare model.json good.json s.csv --json"),
    ("model.json", "report model.json s.csv -o out.html"),
    ("model.json", "export model.json --to c -o out.c --json"),
    ("model.json", "export model.json --to fmu -o out.fmu"),
    ("model.json", "export model.json --to onnx -o out.onnx"),
    ("model.json", "export model.json --to python -o out.py"),
    ("model.json", "export model.json --to matlab -o out.m"),
    ("curve.csv", "export curve.csv --to python -o out.py"),
    ("arm.toml", "simulate arm.toml -o out.csv --json"),
    ("arm.toml", "simulate arm.toml --write-arm out.toml"),
    (
        "arm.toml",
        "excite arm.toml --max-torque 1 --duration 0.5 --sample-time 0.01 -o out.csv",
    ),
    (
        "chain.toml",
        "simulate chain.toml --duration 0.05 --sample-time 0.01 -o out.csv --json",
    ),
    (
        "robot.urdf",
        "simulate robot.urdf --duration 0.05 --sample-time 0.01 -o out.csv --json",
    ),
    (
        "robot.urdf",
        "simulate robot.urdf --free-base --duration 0.05 --sample-time 0.01 -o out.csv",
    ),
    (
        "torques.csv",
        "simulate robot.urdf --torques torques.csv --duration 0.05 --sample-time 0.01 -o out.csv",
    ),
    (
        "fleet/a.csv",
        "fleet fleet --by plant --input u0 --output y --structure linear -o fresh --table csv --json",
    ),
    (
        "results/rows/a.json",
        "fleet fleet --by plant --input u0 --output y --structure linear -o results --json",
    ),
    ("short.toml", "control short.toml -o out.csv --json"),
    ("short.toml", "control short.toml --seeds 2 --report out.html --json"),
    (
        "short.toml",
        "control short.toml --dry-run --write-scenario out.toml --json",
    ),
    ("servo.toml", "control servo.toml -o out.parquet --json"),
    ("plant.toml", "control servo.toml -o out.csv --json"),
    (
        "results/fleet.json",
        "fleet fleet --by plant --input u0 --output y --structure linear -o results",
    ),
];

/// What the commands may write.
pub const OUTPUTS: [&str; 11] = [
    "out.csv",
    "out.parquet",
    "out.json",
    "out.html",
    "out.c",
    "out.h",
    "out.fmu",
    "out.onnx",
    "out.py",
    "out.m",
    "out.toml",
];

/// Scenarios: one of an arm file with every estimator, one of presets with every other key.
pub const SCENARIOS: [(&str, &str); 2] = [
    ("servo.toml", include_str!("servo.toml")),
    ("short.toml", include_str!("short.toml")),
];
