//! `flexure export`: files that other programs run.

mod common;

use std::fmt::Write as _;
use std::process::Command;

use common::Folder;
use flexure_io::read_model;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::json;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.known("r.csv", 1200, 1);
    folder.known("fresh.csv", 300, 2);
    folder.done("identify r.csv --input u --output y -o model.json");
    folder
}

/// Runs code by Python in the folder; skips where there is none.
fn python(folder: &Folder, code: &str) {
    let done = Command::new("python3")
        .args(["-c", code])
        .current_dir(folder.path("."))
        .output();
    match done {
        Ok(done) => assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr)),
        Err(_) => eprintln!("skipped: there is no python3"),
    }
}

#[test]
fn an_exported_model_predicts_what_predict_does() {
    let folder = folder();
    folder.done("predict model.json fresh.csv --initial-state steady -o p.csv");
    let text = folder.done("export model.json --to python -o plant.py");
    assert_eq!(text.trim(), "wrote plant.py");
    let code = "
import csv
from plant import plant
read = lambda name, column: [float(row[column]) for row in csv.DictReader(open(name))]
found, predicted = plant().simulate(read('fresh.csv', 'u')), read('p.csv', 'predicted')
assert len(found) == 300 and max(abs(f - p) for f, p in zip(found, predicted)) < 1e-12
";
    python(&folder, code);
}

#[test]
fn a_model_that_integrates_is_kept_and_exported() {
    let folder = Folder::new();
    for (integrators, named) in [
        (1, "an integrator, time constant"),
        (2, "an integrator, an integrator, time constant"),
    ] {
        let mut random = Pcg64::seed_from_u64(4);
        let (mut lag, mut sums) = (0.0, [0.0; 2]);
        let mut rows = "t,u,y\n".to_owned();
        for k in 0..2000 {
            let (u, noise) = (random.random_range(-1.0..1.0), random.random_range(-1e-3..1e-3));
            let y: f64 = sums[integrators - 1] + noise;
            writeln!(rows, "{},{u},{y}", 0.01 * f64::from(k)).unwrap();
            lag = 0.8 * lag + 0.2 * u;
            sums = [sums[0] + lag, sums[1] + sums[0] + lag];
        }
        folder.write("r.csv", rows);
        let text =
            folder.said("identify r.csv --input u --output y --structure linear -o model.json --report page.html");
        assert!(text.contains(named) && !text.contains("unstable"), "{text}");
        let page = folder.read("page.html");
        assert!(page.contains("no static gain, as it integrates"));
        assert_eq!(page.matches("[1.0,0.0]").count(), integrators);
        let read = read_model(folder.path("model.json")).unwrap();
        assert!(read.order > integrators);
        let text = folder.said("validate model.json r.csv");
        assert!(text.contains("holds"), "{text}");
        folder.done("predict model.json r.csv --initial-state steady -o p.csv");
        folder.done("export model.json --to python -o plant.py");
        let stated = "integrates: it has no steady state, and starts at rest.";
        assert!(folder.read("plant.py").contains(stated));
        let code = "
import csv
from plant import plant
rows = list(csv.DictReader(open('p.csv')))
inputs = [float(row['u']) for row in csv.DictReader(open('r.csv'))]
predicted = [float(row['predicted']) for row in rows]
assert len(rows) == 2000 and plant().simulate(inputs) == predicted
";
        python(&folder, code);
    }
}

#[test]
fn the_files_are_named() {
    let folder = folder();
    let text = folder.done("export model.json --to c --name plant_2 -o plant.c");
    assert_eq!(text.trim(), "wrote plant.c\nwrote plant.h");
    assert!(folder.read("plant.c").contains("#include \"plant.h\""));
    assert!(
        folder
            .read("plant.h")
            .contains("double plant_2_step(plant_2_state *state, double u);")
    );
    let object = folder.json("export model.json --to fmu --fmi 3 -o plant.fmu");
    assert_eq!(object, json!({ "out": ["plant.fmu"] }));
    folder.done("export model.json --to onnx --name net -o .");
    assert!(folder.path("net.onnx").exists());
}

#[test]
fn a_curve_of_a_table_is_held_beyond_its_rows() {
    let folder = Folder::new();
    folder.write(
        "friction.csv",
        "velocity,torque,lower,upper\n-1,-2,-3,-1\n0,0.5,0,1\n2,1.5,1,2\n",
    );
    folder.done("export friction.csv --to python -o friction.py");
    assert!(folder.read("friction.py").contains("# Output: torque."));
    let code = "from friction import friction; assert friction().simulate([-9, -0.5, 1, 9]) == [-2, -0.75, 1, 1.5]";
    python(&folder, code);
    folder.write("falls.csv", "velocity,torque\n0,1\n-1,2\n");
    let outcome = folder.run("export falls.csv --to c -o a.c");
    assert!(
        outcome.code == Some(1) && outcome.stderr.contains("must increase"),
        "{outcome:?}"
    );
}

#[test]
fn a_regression_on_two_columns_is_a_surface() {
    let folder = Folder::new();
    let noise = |k: u32, by: f64| (f64::from(k) * by).fract();
    let row = |k: u32| {
        let (a, b) = (4.0 * noise(k, 0.618_034) - 2.0, 3.0 * noise(k, 0.754_878));
        format!("{a},{b},{}\n", (1.5 * a).sin() + 0.3 * a * b)
    };
    folder.write(
        "r.csv",
        &("a,b,z\n".to_owned() + &(0..900).map(row).collect::<String>()),
    );
    folder.write(
        "at.csv",
        &("a,b,z\n".to_owned() + &(900..1000).map(row).collect::<String>()),
    );
    let regress = "regress r.csv --x a,b --y z --band-method none --bandwidth 0.5,0.5";
    folder.done(&format!("{regress} -o surface.csv"));
    folder.done(&format!("{regress} --outside nearest --at at.csv -o found.csv"));
    folder.done(&format!("{regress} --outside nearest --at surface.csv -o grid.csv"));
    folder.done("export surface.csv --to python -o surface.py");
    let text = folder.read("surface.py");
    for said in [
        "Input 0: a.",
        "Input 1: b.",
        "Output: y.",
        "a surface of cubic splines over",
    ] {
        assert!(text.contains(said), "{said}");
    }
    let code = "
import csv
from surface import surface
def apart(name):
    rows = [[float(row[c]) for c in 'aby'] for row in csv.DictReader(open(name))]
    size = max(abs(y) for _, _, y in rows)
    return max(abs(surface().step([a, b]) - y) for a, b, y in rows) / size
assert apart('grid.csv') < 1e-12, apart('grid.csv')
assert apart('found.csv') < 2e-3, apart('found.csv')
print(apart('found.csv'))
";
    python(&folder, code);
}

#[test]
fn what_is_no_grid_is_no_surface() {
    let folder = Folder::new();
    let grid = |x: fn(u32) -> f64| {
        let rows = (0..25).map(|k| format!("{},{},{k},,\n", x(k / 5), k % 5));
        "a,b,y,lower,upper\n".to_owned() + &rows.collect::<String>()
    };
    let even = grid(f64::from);
    let lines: Vec<&str> = even.lines().collect();
    for (text, message) in [
        (
            grid(|k| f64::from(k * k)),
            "a grid of four evenly spaced values or more of 'a'",
        ),
        (
            grid(|k| f64::from(k % 2)),
            "a grid of four evenly spaced values or more of 'a'",
        ),
        (lines[..24].join("\n"), "every point of its grid, each once"),
        (
            even.replace("3,3,18,", "3,3,,"),
            "a surface needs a value at every point of its grid",
        ),
        (
            even.replace("lower", "below"),
            "a surface has its columns of x, then y, lower and upper",
        ),
    ] {
        folder.write("s.csv", &text);
        let outcome = folder.run("export s.csv --to c -o s.c");
        assert!(
            outcome.code == Some(1) && outcome.stderr.contains(message),
            "{message}: {outcome:?}"
        );
    }
    // The rows may have any order.
    folder.write("s.csv", [&lines[..1], &lines[13..], &lines[1..13]].concat().join("\n"));
    folder.done("export s.csv --to c -o s.c");
}

#[test]
fn wrong_usage_is_refused_and_writes_nothing() {
    let folder = folder();
    for (arguments, message) in [
        ("export model.json --to c --fmi 2 -o a.c", "--fmi is for --to fmu"),
        (
            "export model.json --to python --compile -o a.py",
            "--compile is for --to fmu",
        ),
        ("export model.json --to c -o a.txt", "must end in .c"),
        (
            "export model.json --to c --name 2x -o a.c",
            "it must begin with a letter",
        ),
        ("export nowhere.json --to c -o a.c", "nowhere.json"),
    ] {
        let outcome = folder.run(arguments);
        assert!(
            outcome.code != Some(0) && outcome.stderr.contains(message),
            "{arguments}: {outcome:?}"
        );
        assert!(!folder.path("a.c").exists() && !folder.path("a.py").exists());
    }
}

#[test]
fn an_arm_goes_to_c_and_fmu_and_to_nothing_else() {
    let folder = Folder::new();
    folder.done("simulate --preset motor-log --write-arm arm.toml");
    folder.done("export arm.toml --to c -o arm.c");
    assert!(
        folder
            .read("arm.h")
            .contains("void arm_step(arm_state *state, const double *tau, double *y);")
    );
    folder.done("export arm.toml --to fmu --fmi 3 -o arm.fmu");
    let message = "an arm file goes to c and fmu alone\n\nFor more information, try '--help'.";
    folder.refused("export arm.toml --to onnx -o arm.onnx", 2, message);
}
