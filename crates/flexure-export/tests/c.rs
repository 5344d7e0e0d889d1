//! C, compiled and run, against the model's own free run.

mod common;

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use common::{FORMS, difference, file, inputs, models, predicted};
use flexure::Block;
use flexure::nonlinearity::{Curve, Outside};
use flexure_export::{Fmi, Format, Options, export};
use flexure_io::ModelFile;

const FLAGS: [&str; 8] = [
    "-std=c99",
    "-O1",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Werror",
    "-fsanitize=undefined,address",
    "-fno-sanitize-recover=all",
];
/// Reads samples as `f64` from its input and writes the outputs; a sample whose first input is 1e300 resets.
const MAIN: &str = r#"
#include <stdio.h>
#include "model.h"
int main(void) {
    static model_state state;
    double u[INPUTS], y;
    model_init(&state);
    while (fread(u, sizeof u, 1, stdin) == 1) {
        if (u[0] == 1e300) { model_reset(&state); continue; }
        y = model_step(&state, ARGUMENT);
        fwrite(&y, sizeof y, 1, stdout);
    }
    return 0;
}
"#;

/// The compilers of this machine; says so where there is none.
fn compilers() -> Vec<&'static str> {
    let works = |name: &&str| {
        Command::new(name)
            .arg("--version")
            .output()
            .is_ok_and(|o| o.status.success())
    };
    let found: Vec<_> = ["gcc", "clang"].into_iter().filter(works).collect();
    if found.is_empty() {
        eprintln!("skipped: there is no C compiler");
    }
    found
}

fn written(model: &ModelFile, folder: &Path) {
    let options = Options {
        format: Format::C,
        name: None,
        fmi: Fmi::default(),
        compile: false,
    };
    for artefact in export(model, &folder.join("model.c"), options).unwrap() {
        std::fs::write(artefact.path, artefact.bytes).unwrap();
    }
}

fn compiled(compiler: &str, model: &ModelFile, folder: &Path) {
    let n = model.block.inputs();
    let argument = if n == 1 { "u[0]" } else { "u" };
    let main = MAIN.replace("INPUTS", &n.to_string()).replace("ARGUMENT", argument);
    std::fs::write(folder.join("main.c"), main).unwrap();
    let done = Command::new(compiler)
        .args(FLAGS)
        .args(["model.c", "main.c", "-o", "program"])
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{compiler}: {text}");
}

fn run(folder: &Path, inputs: &[Vec<f64>]) -> Vec<f64> {
    let samples = (0..inputs[0].len()).flat_map(|n| inputs.iter().flat_map(move |u| u[n].to_ne_bytes()));
    let bytes: Vec<u8> = samples.collect();
    let mut child = Command::new(folder.join("program"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(&bytes).unwrap());
    let done = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    done.stdout
        .chunks_exact(8)
        .map(|b| f64::from_ne_bytes(b.try_into().unwrap()))
        .collect()
}

#[test]
fn c_computes_what_the_model_does() {
    let folder = tempfile::tempdir().unwrap();
    for compiler in compilers() {
        for (k, (structure, model)) in models().iter().enumerate() {
            let u = inputs(model, 10_000, 100 + k as u64);
            written(model, folder.path());
            compiled(compiler, model, folder.path());
            let apart = difference(&run(folder.path(), &u), &predicted(model, &u));
            println!("{compiler} {structure}: {apart:.1e}");
            assert!(apart <= 1e-12, "{compiler} {structure}: {apart}");
        }
    }
}

#[test]
fn numbers_that_are_not_finite_give_what_the_model_gives() {
    let folder = tempfile::tempdir().unwrap();
    for compiler in compilers() {
        for (k, (structure, model)) in models().iter().enumerate().take(FORMS) {
            written(model, folder.path());
            compiled(compiler, model, folder.path());
            for (at, value) in [(0, f64::NAN), (7, f64::NAN), (7, f64::INFINITY), (3, -1e308)] {
                let mut u = inputs(model, 40, 7 + k as u64);
                u[0][at] = value;
                let apart = difference(&run(folder.path(), &u), &predicted(model, &u));
                assert!(apart <= 1e-12, "{compiler} {structure} {value} at {at}: {apart}");
            }
        }
    }
}

#[test]
fn reset_starts_again() {
    let folder = tempfile::tempdir().unwrap();
    for compiler in compilers() {
        for (structure, model) in models().iter().take(FORMS) {
            written(model, folder.path());
            compiled(compiler, model, folder.path());
            let u = inputs(model, 50, 3);
            let twice: Vec<Vec<f64>> = u
                .iter()
                .map(|u| [u.as_slice(), &[1e300], u.as_slice()].concat())
                .collect();
            let found = run(folder.path(), &twice);
            let once = predicted(model, &u);
            assert!(
                difference(&found, &[once.clone(), once].concat()) <= 1e-12,
                "{structure}"
            );
        }
    }
}

#[test]
fn names_of_a_hostile_model_do_no_harm() {
    let curve = Curve::new(vec![-1.0, 1.0], vec![0.0, 2.0], Outside::Nan).unwrap();
    let mut model = file("x */ #error structure\n#error line /* ??/", Block::Static(curve));
    model.inputs = vec!["*/ int main(void) { return 1; } /* \\\n\"".to_owned()];
    model.output = "'''\n\"\"\"; import os %}{{ 7*7 }} */".to_owned();
    let folder = tempfile::tempdir().unwrap();
    for compiler in compilers() {
        written(&model, folder.path());
        compiled(compiler, &model, folder.path());
        let u = vec![vec![0.0, 1.0, -1.0, 1.5, f64::NAN]];
        let found = run(folder.path(), &u);
        assert_eq!(found[..3], [1.0, 2.0, 0.0]);
        assert!(found[3].is_nan() && found[4].is_nan());
    }
}

#[test]
fn the_header_is_cpp() {
    let works = |name: &&str| {
        Command::new(name)
            .arg("--version")
            .output()
            .is_ok_and(|o| o.status.success())
    };
    let Some(compiler) = ["g++", "clang++"].into_iter().find(works) else {
        eprintln!("skipped: there is no C++ compiler");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for (structure, model) in models().iter().take(FORMS) {
        written(model, folder.path());
        std::fs::write(folder.path().join("main.cpp"), "#include \"model.h\"\nmodel_state s;\n").unwrap();
        let flags = [
            "-fsyntax-only",
            "-std=c++11",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "main.cpp",
        ];
        let done = Command::new(compiler)
            .args(flags)
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(
            done.status.success(),
            "{structure}: {}",
            String::from_utf8_lossy(&done.stderr)
        );
    }
}
