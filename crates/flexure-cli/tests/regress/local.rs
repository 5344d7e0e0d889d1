//! Local bandwidths: asked for, and by default.

use flexure_io::read_record;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

use super::common::{Folder, numbers};
use super::{REGRESS, column, error, wave};

/// Local bandwidths by plug-in, in comparison with Lepski's.
#[test]
fn local_bandwidths_come_by_either_rule() {
    let folder = wave(1500);
    let found = |rule: &str| folder.json(&format!("{REGRESS} --estimator local-bandwidth --select {rule}"));
    let (lepski, plug_in) = (found("loo"), found("plugin"));
    assert_eq!(
        (lepski["chosen_by"].as_str(), plug_in["chosen_by"].as_str()),
        (Some("loo"), Some("plugin"))
    );
    assert!(lepski["curve"]["y"] != plug_in["curve"]["y"]);
    assert!(plug_in["scores"].is_null() && lepski["scores"].is_object());
    let r_squared = plug_in["r_squared"].as_f64().unwrap();
    assert!((0.88..0.95).contains(&r_squared), "{r_squared}");
}

/// Where kinks call for it, bandwidths are local without being asked for, and the band is that of one bandwidth; what
/// asks for one bandwidth gets it.
#[test]
fn kinks_get_local_bandwidths_by_default() {
    let folder = Folder::new();
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let mut text = "x,y\n".to_owned();
    let bent = |x: f64| (x - 0.7).max(0.0) + (x + 0.5).min(0.0);
    for _ in 0..20_000 {
        let (x, e): (f64, f64) = (rng.random_range(-2.0..2.0), StandardNormal.sample(&mut rng));
        text += &format!("{x},{}\n", bent(x) + 0.02 * e);
    }
    folder.write("bent.csv", text);
    let found = |options: &str| {
        let object = folder.json(&format!("regress bent.csv --x x --y y -o curve.csv {options}"));
        let curve = read_record(folder.path("curve.csv")).unwrap().record;
        (object, error(&curve, bent), curve)
    };
    let (local, local_error, curve) = found("");
    let (one, one_error, other) = found("--estimator local-linear");
    assert_eq!(local["estimator"], "local-bandwidth");
    assert!(local_error < 0.8 * one_error, "{local_error} {one_error}");
    assert_eq!(local["value"], one["value"]);
    let whose = |object: &Value| {
        object["band"]["method"]
            .as_str()
            .unwrap()
            .ends_with("of the local line with one bandwidth")
    };
    assert!(whose(&local) && !whose(&one));
    assert_eq!(column(&curve, "lower"), column(&other, "lower"));
    assert_eq!(column(&curve, "upper"), column(&other, "upper"));
    let outside = |y: &[f64], lower: &[f64], upper: &[f64]| {
        (0..y.len())
            .filter(|&i| !(lower[i] <= y[i] && y[i] <= upper[i]))
            .count()
    };
    let [y, lower, upper] = ["y", "lower", "upper"].map(|name| column(&curve, name));
    // Some hundredths of the range are in reach of the kinks, where one bandwidth is biased.
    let share = outside(&y, &lower, &upper) as f64 / y.len() as f64;
    assert!(share < 0.08, "{share}");
    let bandwidths = numbers(&local["local_bandwidths"]["bandwidth"]);
    let global = numbers(&local["value"])[0];
    assert!(bandwidths.iter().any(|h| *h < 0.7 * global) && bandwidths.iter().any(|h| *h > 2.0 * global));
    let rms = |object: &Value| object["prediction_rms"].as_f64().unwrap();
    assert!((rms(&local) - rms(&one)).abs() < 2e-4 && (rms(&local) - 0.02).abs() < 4e-4);
    assert!(one["local_bandwidths"].is_null());
    for options in ["--bandwidth 0.1", "--select loo", "--select gcv", "--select block"] {
        assert_eq!(found(options).0["estimator"], "local-linear", "{options}");
    }
}
