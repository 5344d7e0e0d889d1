//! `flexure fleet`: many machines of one data set.

mod common;

use std::fs;

use common::{Folder, known};
use flexure_io::read_record;

/// Six plants in one file. The fifth has a missing sample.
fn file_of_six(folder: &Folder) {
    let mut text = "plant,u,y\n".to_owned();
    for plant in 0..6 {
        let record = known(700, plant + 1);
        let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
        for (i, (u, y)) in u.iter().zip(y).enumerate() {
            match (plant, i) {
                (4, 300) => text.push_str(&format!("{plant},{u},\n")),
                _ => text.push_str(&format!("{plant},{u},{y}\n")),
            }
        }
    }
    folder.write("all.csv", text);
}

const FLEET: &str = "fleet all.csv --by plant --input u --output y";

#[test]
fn every_machine_gets_what_identify_gives_and_a_broken_one_its_error() {
    let folder = Folder::new();
    file_of_six(&folder);
    let said = folder.done(&format!("{FLEET} -o results --table csv"));
    assert_eq!(
        said.trim(),
        "wrote results/table.csv (6 machines, 1 failed: see the column error)"
    );
    let table = folder.read("results/table.csv");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 7);
    assert!(lines[0].starts_with("plant,status,error,") && lines[0].ends_with(",model"));
    assert!(lines[5].starts_with("4,failed,") && lines[5].contains("column 'y' is NaN or missing at sample 300"));

    folder.known("own.csv", 700, 3);
    let object = folder.json("identify own.csv --input u --output y -o own.json");
    let column = lines[0].split(',').position(|name| name == "fit_percent").unwrap();
    let fit: f64 = lines[3].split(',').nth(column).unwrap().parse().unwrap();
    assert_eq!(Some(fit), object["fit_percent"].as_f64());
    // A machine's model is a model as any other.
    folder.done("predict results/models/2.json own.csv --initial-state steady -o fleet.csv");
    folder.done("predict own.json own.csv --initial-state steady -o alone.csv");
    let predicted = |file: &str| {
        read_record(folder.path(file))
            .unwrap()
            .record
            .column("predicted")
            .unwrap()
            .to_vec()
    };
    assert_eq!(predicted("fleet.csv"), predicted("alone.csv"));
}

/// Results within the data set are no machines.
#[test]
fn results_are_no_machines() {
    let folder = Folder::new();
    fs::create_dir(folder.path("logs")).unwrap();
    for (seed, name) in ["a", "b"].iter().enumerate() {
        folder.known(&format!("logs/{name}.csv"), 600, seed as u64);
    }
    for _ in 0..2 {
        let said = folder.done("fleet logs --by plant --input u --output y -o logs/results --table csv");
        assert!(said.contains("(2 machines"), "{said}");
    }
}

#[test]
fn a_stopped_run_goes_on_and_threads_change_nothing() {
    let folder = Folder::new();
    file_of_six(&folder);
    folder.done(&format!("{FLEET} -o results"));
    let whole = fs::read(folder.path("results/table.parquet")).unwrap();
    // The state after a stop: two rows and the table are missing. A third row has another number, which must stay.
    for gone in ["rows/1.json", "rows/3.json", "table.parquet"] {
        fs::remove_file(folder.path("results").join(gone)).unwrap();
    }
    let said = folder.done(&format!("{FLEET} -o results"));
    assert!(said.contains("(6 machines, 3 from an earlier run, 1 failed"), "{said}");
    assert_eq!(fs::read(folder.path("results/table.parquet")).unwrap(), whole);
    for threads in ["1", "3"] {
        let results = format!("threads{threads}");
        let command = format!("{FLEET} -o {results}");
        let done = folder
            .command(&command)
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .unwrap();
        assert!(done.status.success(), "{done:?}");
        assert_eq!(
            fs::read(folder.path(&format!("{results}/table.parquet"))).unwrap(),
            whole
        );
    }
    let other = folder.run(&format!("{FLEET} --structure linear -o results"));
    assert!(
        other.code == Some(1) && other.stderr.contains("begun with other choices"),
        "{other:?}"
    );
}

#[test]
fn folders_and_joints() {
    let folder = Folder::new();
    let log = |inertia: f64| {
        let mut text = "t,q,tau\n".to_owned();
        for i in 0..3000 {
            let t = f64::from(i) * 0.002;
            let terms = [(0.8, 0.9, 0.2), (0.3, 2.3, 1.0), (0.1, 5.1, 2.0)];
            let of = |f: &dyn Fn(f64, f64, f64) -> f64| terms.iter().map(|&(a, w, p)| f(a, w * 3.0, p)).sum::<f64>();
            let q = of(&|a, w, p| a * (w * t + p).sin());
            let (v, a) = (
                of(&|a, w, p| a * w * (w * t + p).cos()),
                of(&|a, w, p| -a * w * w * (w * t + p).sin()),
            );
            text.push_str(&format!(
                "{t},{q},{}\n",
                inertia * a + 2.0 * (50.0 * v).tanh() + 0.7 * v
            ));
        }
        text
    };
    for (name, inertia) in [("left", 1.5), ("right", 2.5)] {
        fs::create_dir_all(folder.path(&format!("logs/joint={name}"))).unwrap();
        folder.write(&format!("logs/joint={name}/log.csv"), log(inertia));
    }
    folder.done("fleet logs --by joint --position q --torque tau -o found --table csv");
    let table = folder.read("found/table.csv");
    let column = table
        .lines()
        .next()
        .unwrap()
        .split(',')
        .position(|name| name == "inertia.value")
        .unwrap();
    for (line, (name, inertia)) in table.lines().skip(1).zip([("left", 1.5), ("right", 2.5)]) {
        let found: f64 = line.split(',').nth(column).unwrap().parse().unwrap();
        assert!(
            line.starts_with(name) && (found - inertia).abs() < 0.02 * inertia,
            "{line}"
        );
    }
}

#[test]
fn wrong_usage_is_refused() {
    let folder = Folder::new();
    file_of_six(&folder);
    fs::create_dir_all(folder.path("empty")).unwrap();
    fs::create_dir_all(folder.path("used")).unwrap();
    folder.write("used/notes.txt", "mine");
    for (command, message) in [
        (
            "fleet all.csv --by machine --input u --output y -o r",
            "no column 'machine'",
        ),
        (
            "fleet empty --by plant --input u --output y -o r",
            "no record is in this folder",
        ),
        (
            "fleet all.csv --by plant --structure round -o r",
            "invalid value 'round'",
        ),
        ("fleet all.csv --by plant --torque y -o r", "--position <COLUMN>"),
        (
            "fleet all.csv --by plant --input u --output y -o used",
            "this folder has other files",
        ),
        (
            "fleet all.csv --by plant --input u --output z -o r",
            "none of 6 machines could be identified; the first: ",
        ),
    ] {
        let outcome = folder.run(command);
        assert!(
            outcome.code != Some(0) && outcome.stderr.contains(message),
            "{command}: {outcome:?}"
        );
    }
    assert_eq!(folder.read("used/notes.txt"), "mine");
}

/// What is reached by several ways is one machine's, and only regular files are read.
#[cfg(unix)]
#[test]
fn a_folder_with_links_in_circles_and_pipes() {
    let folder = Folder::new();
    fs::create_dir_all(folder.path("data/sub")).unwrap();
    folder.known("data/a.csv", 700, 1);
    folder.known("data/sub/b.csv", 700, 2);
    for name in ["up", "again", "self"] {
        let target = if name == "self" { "." } else { ".." };
        std::os::unix::fs::symlink(target, folder.path("data/sub").join(name)).unwrap();
    }
    std::os::unix::fs::symlink("nowhere.csv", folder.path("data/c.csv")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path("data/pipe.csv"))
        .status();
    assert!(made.unwrap().success());
    let object = folder.json("fleet data --by plant --input u --output y --structure static -o results");
    assert_eq!((&object["machines"], &object["failed"]), (&2.into(), &0.into()));
}
