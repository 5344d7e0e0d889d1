//! An arm in C, compared with the arm that Flexure simulates with its own integrator.

mod runtime;

use std::path::Path;
use std::process::Command;

use flexure::Record;
use flexure_export::{Fmi, Format, Options, export_arm, to_be_compared};
use flexure_io::arm::{ArmFile, PRESETS, preset, run};
use runtime::{MISSING, python, skipped};

const STATE: [&str; 8] = ["q1", "q2", "qm1", "qm2", "dq1", "dq2", "dqm1", "dqm2"];

const MAIN: &str = r#"
#include <stdio.h>
#include "model.h"
int main(void) {
    static model_state state;
    double tau[2], y[8];
    model_init(&state);
    while (fread(tau, sizeof tau, 1, stdin) == 1) {
        model_step(&state, tau, y);
        fwrite(y, sizeof y, 1, stdout);
    }
    return 0;
}
"#;

const LINK: &str = "[[arm.link]]\nmass = 1.5\nlength = 1.2\ncom = 0.6\ninertia = 0.3\n";

fn arm(model: &str, locked: [bool; 2], sample_time: f64, second: &str) -> ArmFile {
    let joint = "[[arm.joint]]\nmotor_inertia = 0.5\nstiffness = 300.0\ncubic = 400.0\nlinear = 300.0\nwindup = 10.0\nwindup_sharpness = 3000.0\n\
                 damping = 0.4\nfriction = [0.5, 15.0, 5.0, 1.0, 20.0, 0.5]\nmotor_friction = [0.0, 0.0, 0.0, 0.2, 20.0, 0.3]\n";
    let text = format!(
        "[arm]\nmodel = \"{model}\"\n{LINK}{second}{joint}locked = {}\n{joint}locked = {}\n[run]\nduration = 5.0\nsample_time = {sample_time}\nrtol = 1e-12\n[excitation]\n\
         kind = \"multisine\"\nseed = 3\namplitude = 4.0\nf_min = 0.2\nf_max = 3.0\n",
        locked[0], locked[1]
    );
    ArmFile::from_toml_str(&text, "arm").unwrap()
}

/// Compiles it with every warning an error and every check on, and drives it with the recorded torques.
fn moved(file: &ArmFile, folder: &Path, record: &Record) -> Option<Vec<f64>> {
    let options = Options {
        format: Format::C,
        name: None,
        fmi: Fmi::Two,
        compile: false,
    };
    for artefact in export_arm(file, record, &folder.join("model.c"), options).unwrap() {
        std::fs::write(artefact.path, artefact.bytes).unwrap();
    }
    std::fs::write(folder.join("main.c"), MAIN).unwrap();
    let compiler = ["gcc", "clang"]
        .into_iter()
        .find(|c| Command::new(c).arg("--version").output().is_ok())?;
    let flags =
        "-std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -fsanitize=undefined,address model.c main.c -lm -o program";
    let done = Command::new(compiler)
        .args(flags.split(' '))
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let rows = record
        .column("tau1")
        .unwrap()
        .iter()
        .zip(record.column("tau2").unwrap());
    let bytes: Vec<u8> = rows
        .flat_map(|(a, b)| [a.to_ne_bytes(), b.to_ne_bytes()].concat())
        .collect();
    std::fs::write(folder.join("tau.bin"), bytes).unwrap();
    let input = std::fs::File::open(folder.join("tau.bin")).unwrap();
    let done = Command::new(folder.join("program")).stdin(input).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let values = done.stdout.as_chunks::<8>().0.iter();
    Some(values.map(|bytes| f64::from_ne_bytes(*bytes)).collect())
}

/// The largest difference of a component of the state, of its largest value.
fn difference(found: &[f64], record: &Record) -> f64 {
    let mut largest: f64 = 0.0;
    for (i, name) in STATE.iter().enumerate() {
        let Ok(expected) = record.column(name) else { continue };
        let scale = expected.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        for (k, value) in expected.iter().enumerate() {
            largest = largest.max((found[8 * k + i] - value).abs() / scale);
        }
    }
    largest
}

/// The difference that the C source states.
fn stated(folder: &Path) -> f64 {
    let text = std::fs::read_to_string(folder.join("model.c")).unwrap();
    let (_, behind) = text.split_once("the state differs by ").unwrap();
    behind.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn presets_move_as_the_simulated_ones_and_as_closely_as_stated() {
    let folder = tempfile::tempdir().unwrap();
    for name in PRESETS.map(|(name, _)| name) {
        let mut file = to_be_compared(&preset(name).unwrap());
        file.run.duration = file.run.duration.min(200.0 * file.run.sample_time);
        let record = run(&file, |_| Err("no record is named")).unwrap();
        let Some(found) = moved(&file, folder.path(), &record) else {
            return skipped("there is no C compiler");
        };
        let (found, stated) = (difference(&found, &record), stated(folder.path()));
        println!("{name}: {found:.1e}, stated {stated:.1e}");
        assert!(stated < 1e-9, "{name}: {stated:e}");
        // The compiler may add up in another order than the comparison.
        assert!(found < 2.0 * stated + 1e-11, "{name}: {found:e}, stated {stated:e}");
    }
}

#[test]
fn the_exported_arm_moves_as_the_simulated_one() {
    let folder = tempfile::tempdir().unwrap();
    for model in ["nonlinear", "linear", "rigid"] {
        // What `flexure joint --arm` writes of a single joint has nothing behind the other one.
        let nothing = "[[arm.link]]\nmass = 1e-9\nlength = 1.0\ncom = 0.0\ninertia = 0.0\n";
        for (locked, sample_time, second) in [
            ([false, false], 0.005, LINK),
            ([false, true], 0.005, LINK),
            ([true, false], 0.005, LINK),
            ([false, false], 0.05, LINK),
            ([false, true], 0.05, nothing),
        ] {
            let file = arm(model, locked, sample_time, second);
            let record = run(&file, |_| Err("no record is named")).unwrap();
            let Some(found) = moved(&file, folder.path(), &record) else {
                return skipped("there is no C compiler");
            };
            let largest = difference(&found, &record);
            println!("{model}, locked {locked:?}, {sample_time} s: {largest:.1e}");
            assert!(largest < 1e-9, "{model} {locked:?} {sample_time}: {largest:e}");
        }
    }
}

#[test]
fn the_arm_as_an_fmu_moves_as_the_simulated_one() {
    let folder = tempfile::tempdir().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/agreement.py");
    let file = arm("nonlinear", [false, false], 0.005, LINK);
    let record = run(&file, |_| Err("no record is named")).unwrap();
    let rows = |names: &[&str]| -> Vec<u8> {
        let columns: Vec<&[f64]> = names.iter().map(|name| record.column(name).unwrap()).collect();
        let all = (0..record.len()).flat_map(|k| columns.iter().map(move |column| column[k]));
        all.flat_map(f64::to_le_bytes).collect()
    };
    std::fs::write(folder.path().join("u.bin"), rows(&["tau1", "tau2"])).unwrap();
    std::fs::write(folder.path().join("y.bin"), rows(&STATE)).unwrap();
    for (fmi, runtime, name) in [(Fmi::Two, "arm2", "model2.fmu"), (Fmi::Three, "arm3", "model3.fmu")] {
        let options = Options {
            format: Format::Fmu,
            name: None,
            fmi,
            compile: true,
        };
        let Ok(artefacts) = export_arm(&file, &record, &folder.path().join(name), options) else {
            return skipped("there is no C compiler");
        };
        std::fs::write(&artefacts[0].path, &artefacts[0].bytes).unwrap();
        let Ok(done) = Command::new(python())
            .arg(script)
            .arg(runtime)
            .arg(folder.path())
            .output()
        else {
            return skipped("there is no Python");
        };
        let said = String::from_utf8_lossy(&done.stdout);
        if done.status.code() == Some(MISSING) {
            return skipped(&said);
        }
        assert!(done.status.success(), "{said}{}", String::from_utf8_lossy(&done.stderr));
        let apart: f64 = said.lines().filter_map(|line| line.parse().ok()).next_back().unwrap();
        assert!(apart < 1e-9, "{runtime}: {apart:e}");
    }
}
