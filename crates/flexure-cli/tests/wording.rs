//! One output has one verdict and one share, and says what to do next.

mod common;

use common::Folder;
use flexure::Record;
use flexure_io::write_record;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A mass on a hardening spring under held random forces.
fn spring(samples: usize) -> Record {
    let mut random = Pcg64::seed_from_u64(1);
    let (mut force, mut y) = (vec![0.0; samples], vec![0.0_f64; samples]);
    for n in 2..samples {
        force[n] = random.random_range(-1.0..1.0);
        let spring = 0.3 * y[n - 1] + 0.2 * y[n - 1].powi(3);
        y[n] = 1.6 * y[n - 1] - 0.7 * y[n - 2] + 0.4 * (force[n - 1] - spring);
    }
    let noise = |y: &f64| y + 0.01 * random.random_range(-1.0..1.0);
    let y = y.iter().map(noise).collect();
    Record::new([("force", force), ("position", y)]).unwrap()
}

#[test]
fn a_loop_says_what_it_does_as_a_whole_before_its_parts() {
    let folder = Folder::new();
    write_record(folder.path("r.csv"), &spring(3000)).unwrap();
    let identify = "identify r.csv --input force --output position --structure feedback -o model.json --report page.html --sample-time 0.1";
    let said = folder.said(identify);
    let place = |text: &str| said.find(text).unwrap_or_else(|| panic!("{text}: {said}"));
    let order = [
        " nonlinearity in the loop: ",
        " whole loop at small amplitudes: ",
        " whole loop at large amplitudes: ",
        " linear part alone order ",
    ];
    assert!(order.map(place).is_sorted(), "{said}");
    // At rest, the difference equation is z^2 - 1.6 z + 0.7 + 0.4 0.3 z: 0.74 +- sqrt(0.7 - 0.74^2) i, every 0.1 s.
    let small = &said[place(order[1])..place(order[2])];
    assert!(small.contains(" Hz with damping 0.3"), "{small}");
    // Each of the four ways has a numerator, and all have the same denominator.
    assert_eq!(said.matches(" denominator a1 = ").count(), 1, "{said}");
    assert!(!said.contains("poles and a as above"), "{said}");
    let page = folder.read("page.html");
    for heading in [
        "Whole loop at small amplitudes",
        "Whole loop at large amplitudes",
        "Linear part without the nonlinearity",
    ] {
        assert!(page.contains(heading), "{heading}");
    }
    assert!(!page.contains("Linear part, nonlinearity back to itself"));
    // The axes of the curve have names.
    for label in [
        r#""x_label":"position""#,
        r#""y_label":"output of the nonlinearity, in the unit of force""#,
    ] {
        assert!(page.contains(label), "{label}");
    }
}

/// A model of another system than the record's.
#[test]
fn a_validation_that_fails_says_how_much_is_missed_and_what_to_type() {
    let folder = Folder::new();
    write_record(folder.path("r.csv"), &spring(3000)).unwrap();
    let linear = folder
        .done("identify r.csv --input force --output position --structure linear --sample-time 0.1 -o model.json");
    // Another structure in place of the one that does not hold.
    let other = "next: flexure identify r.csv --input force --output position --sample-time 0.1 -o model.json --structure auto\n";
    assert!(linear.ends_with(other), "{linear}");
    let later = common::known(3000, 3);
    let columns = ["u", "y"].map(|name| later.column(name).unwrap().to_vec());
    let [u, y] = columns;
    write_record(
        folder.path("later.csv"),
        &Record::new([("force", u), ("position", y)]).unwrap(),
    )
    .unwrap();
    let said = folder.run("validate model.json later.csv --missing").stdout;
    let command = "next: flexure identify later.csv --input force --output position --missing --structure auto";
    assert!(said.contains(command), "{said}");
    // What is typed is valid.
    folder.done("identify later.csv --input force --output position --missing --structure linear");
    let own = folder
        .run("validate model.json r.csv --skip 100")
        .stdout
        .replace(['\n'], " ");
    assert!(
        own.contains(" standard deviation") && !own.contains("of the error's variance"),
        "{own}"
    );
    assert!(own.contains("next: flexure identify r.csv "), "{own}");
}

#[test]
fn a_fit_below_zero_says_what_it_means() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 1);
    folder.done("identify r.csv --input u --output y -o good.json");
    let record = common::known(2000, 2);
    let [u, y] = ["u", "y"].map(|name| record.column(name).unwrap().to_vec());
    let turned = y.iter().map(|y| -3.0 * y).collect();
    write_record(
        folder.path("turned.csv"),
        &Record::new([("u", u), ("y", turned)]).unwrap(),
    )
    .unwrap();
    let meaning = "A fit below 0 % is worse than a constant";
    let said = folder.said("compare good.json turned.csv");
    assert!(said.contains(" below 0 % ") && said.contains(meaning), "{said}");
    let said = folder.said("validate good.json turned.csv");
    assert!(
        said.contains("Fit below 0 %") && said.contains("no better than a constant"),
        "{said}"
    );
    let said = folder.said("predict good.json turned.csv -o predicted.csv");
    assert!(said.contains("fit below 0 %") && said.contains(meaning), "{said}");
}

#[test]
fn a_page_of_a_saved_model_keeps_the_errors_of_the_poles() {
    let folder = Folder::new();
    folder.known("r.csv", 3000, 1);
    folder.done("identify r.csv --input u --output y --sample-time 0.1 -o model.json --report first.html");
    folder.run("report model.json r.csv -o again.html");
    let poles = |page: &str| {
        let page = folder.read(page);
        let end = page.find(" with damping ").unwrap();
        page[end.saturating_sub(40)..end + 40].to_owned()
    };
    assert!(poles("first.html").contains('±'), "{}", poles("first.html"));
    assert_eq!(poles("again.html"), poles("first.html"));
}

/// The state of a slow system at the start matters for the whole record.
#[test]
fn a_slow_model_says_what_share_of_the_record_its_start_took() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(4);
    let u: Vec<f64> = (0..3000).map(|_| random.random_range(-1.0..1.0)).collect();
    let y = common::filter(&[0.0, 1.0], &[1.0, -0.995], &u, 0.0);
    let noise = |y: &f64| y + 0.05 * random.random_range(-1.0..1.0);
    let y: Vec<f64> = y.iter().map(noise).collect();
    let part =
        |from: usize, to: usize| Record::new([("u", u[from..to].to_vec()), ("y", y[from..to].to_vec())]).unwrap();
    write_record(folder.path("r.csv"), &part(0, 2000)).unwrap();
    write_record(folder.path("later.csv"), &part(2000, 3000)).unwrap();
    folder.done("identify r.csv --input u --output y --structure linear -o model.json");
    let said = folder.said("validate model.json later.csv");
    assert!(
        said.contains(" of 1000 outputs (") && said.contains("the state at the start depends on most of this record"),
        "{said}"
    );
    let said = folder.said("validate model.json later.csv --initial-state steady");
    assert!(!said.contains("depends on most of this record"), "{said}");
}

#[test]
fn uneven_samples_name_the_command_that_can_be_pasted() {
    let folder = Folder::new();
    let known = common::known(2000, 1);
    let columns = ["u", "y"].map(|name| known.column(name).unwrap().to_vec());
    let t = (0..2000)
        .map(|i| 0.1 * (f64::from(i) + 0.3 * f64::from(i * i).sin()))
        .collect();
    let [u, y] = columns;
    write_record(
        folder.path("r.csv"),
        &Record::new([("t", t), ("u", u), ("y", y)]).unwrap(),
    )
    .unwrap();
    let outcome = folder.run("identify r.csv --input u --output y");
    let (_, command) = outcome.stderr.split_once("steps: flexure ").unwrap();
    let (command, _) = command.split_once(" (without --hold ").unwrap();
    assert!(
        command.starts_with("identify r.csv --input u --output y --resample 0."),
        "{command}"
    );
    assert!(command.ends_with(" --hold u"), "{command}");
    assert_eq!(folder.run(command).code, Some(0));
}

/// An encoder's counts beside a speed in rpm.
#[test]
fn counts_beside_a_speed_tell_the_counts_a_turn() {
    let folder = Folder::new();
    let [t, torque, q] = common::axis(3000);
    let step = t[1] - t[0];
    let counts: Vec<f64> = q.iter().map(|q| (q * 8192.0 / std::f64::consts::TAU).round()).collect();
    let speed =
        |i: usize| (q[(i + 1).min(2999)] - q[i.saturating_sub(1)]) / (2.0 * step) * 60.0 / std::f64::consts::TAU;
    let mut text = "t,torque,counts,speed_rpm\n".to_owned();
    for i in 1..2999 {
        text.push_str(&format!("{},{},{},{}\n", t[i], torque[i], counts[i], speed(i)));
    }
    folder.write("r.csv", text);
    let said = folder.run("joint r.csv --position counts --torque torque").stderr;
    assert!(
        said.contains("'counts' moves by 819") && said.contains(" a turn of 'speed_rpm'"),
        "{said}"
    );
    assert!(said.contains("divide it by 1304 for rad"), "{said}");
}
