//! Numbers that every command prints and writes, on seeded records: a change of structure leaves them as they are.
//!
//! A change that improves accuracy renews them, with the figure that justifies it: `FLEXURE_SNAPSHOTS=write cargo test -p
//! flexure-cli --test snapshots`. `FLEXURE_SNAPSHOTS=exact` compares every digit.

#[path = "../common/mod.rs"]
mod common;
mod digest;
mod records;

use common::Folder;
use serde_json::Map;

/// Runs `command` for its text, its files and its JSON, and compares all of them.
fn check(name: &str, record: fn(&Folder), command: &str, files: &[&str]) {
    let folder = Folder::new();
    record(&folder);
    let mut now = Map::new();
    let said = folder.run(command);
    assert_eq!(said.code, Some(0), "{command}: {said:?}");
    now.insert("text".to_owned(), digest::text(&said.stdout));
    for file in files {
        let content = folder.read(file);
        let numbers = match file.rsplit_once('.') {
            Some((_, "html")) => digest::page(&content),
            Some((_, "csv")) => digest::csv(&content),
            Some((_, "json")) => digest::digest(&serde_json::from_str(&content).unwrap()),
            _ => digest::text(&content),
        };
        now.insert((*file).to_owned(), numbers);
    }
    let object = folder.run(&format!("{command} --json"));
    now.insert(
        "json".to_owned(),
        digest::digest(&serde_json::from_str(&object.stdout).unwrap()),
    );
    digest::compare(name, &now);
}

/// Identifies from r.csv, then predicts and validates on the same record.
fn identify(name: &str, record: fn(&Folder), options: &str) {
    check(
        name,
        record,
        &format!("identify r.csv {options} -o model.json --report page.html"),
        &["model.json", "page.html"],
    );
}

const PAIR: &str = "--input u --output y";

macro_rules! identifications {
    ($($name:ident: $record:ident, $options:expr;)*) => {$(
        #[test]
        fn $name() {
            identify(stringify!($name), records::$record, &format!("{PAIR} {}", $options));
        }
    )*};
}

identifications! {
    linear: linear_record, "--structure linear";
    hammerstein_refined: hammerstein, "";
    hammerstein_given: hammerstein, "--order 2 --delay 0 --unit first-coefficient --form dead-zone";
    hammerstein_known_points: hammerstein, "--known 1=0.5 -1=-0.5 --fresh 0.4";
    hammerstein_missing: missing, "--missing --start spline";
    hammerstein_plain: hammerstein, "--method plain";
    hammerstein_plain_knn: hammerstein, "--nonlinearity knn --lag delay";
    hammerstein_plain_colour: wiener, "--method plain --kernel gaussian --ignore-colour";
    hammerstein_periodic: periodic, "--period 200";
    wiener: wiener, "--structure wiener";
    wiener_hammerstein: wiener_hammerstein, "--structure wiener-hammerstein";
    hammerstein_wiener: hammerstein_wiener, "--structure hammerstein-wiener";
    feedback: feedback, "--structure feedback";
    parallel: parallel, "--structure parallel";
    parallel_of_two: parallel, "--structure parallel --branches 2";
    static_nonlinearity: hammerstein, "--structure static";
    narx: wiener, "--structure narx";
    volterra: parallel, "--structure volterra";
    auto_linear: linear_record, "--structure auto";
    auto_hammerstein: hammerstein, "--structure auto";
    auto_wiener: wiener, "--structure auto";
}

#[test]
fn multiple_inputs() {
    identify(
        "multiple_inputs",
        records::two_inputs,
        "--input p,q --output y --structure multiple-inputs",
    );
}

#[test]
fn joint_inputs() {
    identify(
        "joint_inputs",
        records::two_inputs,
        "--input p,q --output z --structure joint-inputs",
    );
}

#[test]
fn experiments() {
    let command = format!("identify r.csv s.csv {PAIR} -o model.json --report page.html");
    check(
        "experiments",
        records::hammerstein,
        &command,
        &["model.json", "page.html"],
    );
}

/// Writes a record, its model and nothing else.
fn modelled(folder: &Folder) {
    records::wiener_hammerstein(folder);
    folder.done(&format!("identify r.csv {PAIR} --structure linear -o model.json"));
}

#[test]
fn predict() {
    let command = "predict model.json r.csv --input u --output y --horizon 3 -o predicted.csv";
    check("predict", modelled, command, &["predicted.csv"]);
}

#[test]
fn validate() {
    check("validate", modelled, &format!("validate model.json r.csv {PAIR}"), &[]);
}

#[test]
fn joint_rigid() {
    let command = "joint log.csv --position q1 --torque tau1 --friction f.csv --arm found.toml --report page.html";
    check(
        "joint_rigid",
        records::shoulder,
        command,
        &["f.csv", "found.toml", "page.html"],
    );
}

#[test]
fn joint_flexible() {
    let command = "joint log.csv --motor qm1 --link q1 --torque tau1 --friction f.csv --stiffness k.csv --arm found.toml \
                   --report page.html";
    check(
        "joint_flexible",
        records::shoulder,
        command,
        &["f.csv", "k.csv", "found.toml", "page.html"],
    );
}

#[test]
fn joint_two_link() {
    let command = "joint log.csv --motor qm1,qm2 --link q1,q2 --torque tau1,tau2 --friction f.csv --stiffness k.csv --arm found.toml \
                   --report page.html";
    let files = ["f-1.csv", "f-2.csv", "k-1.csv", "k-2.csv", "found.toml", "page.html"];
    check("joint_two_link", records::arm, command, &files);
}

#[test]
fn excite() {
    let command =
        "excite --preset space-arm --max-torque 40,20 --max-velocity 2 --duration 10 --sample-time 0.002 -o e.csv";
    check("excite", |_| (), command, &["e.csv"]);
}

#[test]
fn simulate() {
    check(
        "simulate",
        records::arm,
        "simulate arm.toml -o again.csv",
        &["again.csv"],
    );
}

#[test]
fn study() {
    let command = "study rates --lengths 300,600 --runs 20 --report page.html";
    check("study", |_| (), command, &["page.html"]);
}

macro_rules! regressions {
    ($($name:ident: $options:expr;)*) => {$(
        #[test]
        fn $name() {
            let command = format!("regress r.csv --y y {} -o curve.csv --report page.html", $options);
            check(stringify!($name), records::points, &command, &["curve.csv", "page.html"]);
        }
    )*};
}

regressions! {
    regress_default: "--x x";
    regress_kernel: "--x x --estimator kernel --kernel biweight --select gcv";
    regress_local_linear: "--x x --estimator local-linear --select plugin --band 0.9";
    regress_block: "--x x --estimator local-linear --select block-bootstrap --band-method block";
    regress_weights: "--x x --weights w --estimator kernel --band-method none";
    regress_knn: "--x x --estimator knn";
    regress_spline: "--x x --estimator spline";
    regress_haar: "--x x --estimator haar";
    regress_network: "--x x --estimator network";
    regress_recursive: "--x x --estimator recursive";
    regress_surface: "--x x,z --band-method none";
    regress_surface_kernel: "--x x,z --estimator kernel --select gcv --band-method none";
}
