//! What is warned of, and what is not.

use super::common::Folder;
use super::{normal, rng};
use flexure::Record;
use flexure_io::write_record;
use rand::RngExt;
use serde_json::Value;

/// A folder with the record of these columns.
fn written(x: Vec<f64>, y: Vec<f64>) -> Folder {
    let folder = Folder::new();
    let record = Record::new([("x", x), ("y", y)]).unwrap();
    write_record(folder.path("r.csv"), &record).unwrap();
    folder
}

/// The record's object, and its warnings in one.
fn regressed(x: Vec<f64>, y: Vec<f64>, options: &str) -> (Value, String) {
    let folder = written(x, y);
    let object = folder.json(&format!("{} {options}", super::REGRESS));
    let warnings = object["warnings"].to_string();
    (object, warnings)
}

fn uniform(samples: usize) -> Vec<f64> {
    let mut rng = rng();
    (0..samples).map(|_| rng.random_range(-2.0..2.0)).collect()
}

fn step(x: &[f64]) -> Vec<f64> {
    let mut rng = rng();
    x.iter().map(|x| x.signum() + 0.1 * normal(&mut rng)).collect()
}

/// A jump along a trend asks for a narrow window, which is no dependence; noise that depends on itself is.
#[test]
fn a_jump_along_a_trend_is_no_dependence() {
    let ramp: Vec<f64> = (0..3000).map(|i| f64::from(i) / 750.0 - 2.0 + 1e-4).collect();
    let (object, warnings) = regressed(ramp.clone(), step(&ramp), "");
    assert_eq!(object["local_bandwidths"]["jumps"].as_array().unwrap().len(), 1);
    assert!(!warnings.contains("correlated"), "{warnings}");
    let (mut rng, mut state) = (rng(), 0.0);
    let wander: Vec<f64> = ramp
        .iter()
        .map(|x| {
            state = 0.8 * state + 0.1 * normal(&mut rng);
            x.sin() + state
        })
        .collect();
    assert!(regressed(ramp.clone(), wander.clone(), "").1.contains("correlated"));
    let robust = "--select block --band-method robust";
    let (_, warnings) = regressed(ramp.clone(), wander.clone(), robust);
    assert!(warnings.contains("the band is one for independent rows"), "{warnings}");
    let (_, warnings) = regressed(ramp, wander, "--select block");
    assert!(!warnings.contains("correlated"), "{warnings}");
}

/// Where jumps make one bandwidth narrow its band is not the estimate's.
#[test]
fn a_band_beside_jumps_is_said_to_say_little() {
    let x = uniform(3000);
    let y = step(&x);
    let message = "says little of the estimate shown";
    assert!(regressed(x.clone(), y.clone(), "").1.contains(message));
    assert!(!regressed(x, y, "--band-method none").1.contains(message));
}

/// With many columns, refits take long.
#[test]
fn in_many_columns_a_band_is_made_only_when_asked_for() {
    let folder = Folder::new();
    let columns = ["a", "b", "c", "d", "y"].map(|name| (name.to_owned(), step(&uniform(60))));
    write_record(folder.path("r.csv"), &Record::new(columns).unwrap()).unwrap();
    let object = folder.json("regress r.csv --x a,b,c,d --y y --estimator kernel --bandwidth 1 --grid 2");
    assert!(object["band"].is_null() && object["warnings"].to_string().contains("no band was made"));
    let object = folder
        .json("regress r.csv --x a,b,c,d --y y --estimator kernel --bandwidth 1 --grid 2 --band-method bootstrap");
    assert!(object["band"].is_object());
}

/// Where one bandwidth is at the edge of those tried, but another estimate is shown, that is said.
#[test]
fn an_edge_is_said_of_the_line_it_is_of() {
    // Each row is predicted best from only its copy.
    let twice = |v: Vec<f64>| [v.clone(), v].concat();
    let x = uniform(400);
    let mut rng = rng();
    let y = x.iter().map(|x| (2.0 * x).sin() + 0.1 * normal(&mut rng)).collect();
    let (object, warnings) = regressed(twice(x), twice(y), "");
    assert!(object["local_bandwidths"].is_object(), "{warnings}");
    assert_eq!(object["scores"]["at_edge"], true);
    assert!(
        warnings.contains("the line with one bandwidth, whose band is shown, is"),
        "{warnings}"
    );
}

#[test]
fn copies_of_rows_are_reported_but_rounded_values_are_none() {
    let x = uniform(400);
    let y = step(&x);
    let twice = |v: &[f64]| [v, v].concat();
    let (_, warnings) = regressed(twice(&x), twice(&y), "");
    assert!(
        warnings.contains("about 50 % of the rows are copies of others"),
        "{warnings}"
    );
    let rounded = |v: &[f64]| v.iter().map(|v| (v * 8.0).round() / 8.0).collect::<Vec<f64>>();
    for (x, y) in [(x.clone(), y.clone()), (rounded(&x), rounded(&y))] {
        let (_, warnings) = regressed(x, y, "");
        assert!(!warnings.contains("copies"), "{warnings}");
    }
}

#[test]
fn a_band_that_says_nothing_is_reported() {
    let x = uniform(25);
    let y = step(&x);
    let (_, warnings) = regressed(x.clone(), y.clone(), "--bandwidth 0.2");
    assert!(warnings.contains("wider than all values of 'y' together"), "{warnings}");
    let (_, warnings) = regressed(x, y, "--bandwidth 2");
    assert!(!warnings.contains("wider than"), "{warnings}");
}

/// Jumps far from zero are told to digits that place them.
#[test]
fn jumps_far_from_zero_keep_their_place() {
    let x = uniform(3000);
    let (y, far) = (step(&x), x.iter().map(|x| x + 1e6).collect());
    let folder = written(far, y);
    let text = folder.said(super::REGRESS);
    let place = text
        .split("jumps at ")
        .nth(1)
        .and_then(|rest| rest.split_whitespace().next());
    let place: f64 = place.unwrap_or_default().parse().unwrap_or(f64::NAN);
    assert!((place - 1e6).abs() < 0.02, "{text}");
    assert!(text.contains("by Lepski's rule"), "{text}");
}

/// Local bandwidths that were asked for and are not used are not passed over in silence.
#[test]
fn that_one_bandwidth_serves_is_said() {
    let x = uniform(500);
    let mut rng = rng();
    let y = x.iter().map(|x| x.sin() + 0.1 * normal(&mut rng)).collect();
    let folder = written(x, y);
    let asked = format!("{} --estimator local-bandwidth --report r.html", super::REGRESS);
    let message = "ot used: they do not predict clearly better than one";
    assert!(folder.said(&asked).contains(message));
    assert!(
        std::fs::read_to_string(folder.path("r.html"))
            .unwrap()
            .contains(message)
    );
    let object = folder.json(&asked);
    assert_eq!(
        (&object["estimator"], &object["estimator_asked"]),
        (&"local-linear".into(), &"local-bandwidth".into())
    );
    let one = format!("{} --estimator local-linear", super::REGRESS);
    assert!(!folder.done(&one).contains("local bandwidths"));
}
