//! `flexure identify --nonlinearity`: every estimator can be the nonlinearity of a Hammerstein model.

mod common;

use common::{Folder, numbers};
use flexure::nonlinearity::{Basis, EstimatorName};
use serde_json::Value;

const IDENTIFY: &str = "identify r.csv --input u --output y --method plain";

#[test]
fn every_estimator_identifies_the_system() {
    let folder = Folder::new();
    folder.known("r.csv", 2000, 3);
    let kernel = folder.json(IDENTIFY);
    for name in EstimatorName::ALL {
        let found = folder.json(&format!(
            "{IDENTIFY} --nonlinearity {name} -o m.json --report page.html"
        ));
        assert_eq!(found["estimator"], name.name());
        assert_eq!(found["parameter"], name.parameter());
        let fit = found["fit_percent"].as_f64().unwrap();
        // A dead zone is not periodic, as the Fourier series takes it to be.
        let loss = if name == EstimatorName::Series(Basis::Fourier) {
            20.0
        } else {
            8.0
        };
        assert!(fit > kernel["fit_percent"].as_f64().unwrap() - loss, "{name}: {fit}");
        let count = |key: &str| found["nonlinearity"][key].as_array().unwrap().len();
        let banded = found["nonlinearity"]["lower"].as_array().is_some_and(|l| !l.is_empty());
        // Local bandwidths do not predict better here, and the band is that of one bandwidth.
        let one = [
            EstimatorName::Kernel,
            EstimatorName::LocalLinear,
            EstimatorName::LocalBandwidth,
        ];
        assert_eq!(banded, one.contains(&name), "{name}");
        assert_eq!(count("x"), count("y"));
        assert_eq!(found["bandwidth"].is_null(), !name.has_bandwidth(), "{name}");
        assert_eq!(found["kernel"].is_null(), !name.has_bandwidth(), "{name}");
        if name == EstimatorName::Kernel {
            assert_eq!(found["bandwidth"], found["value"]);
            assert_eq!(found["bandwidth_scores"]["bandwidth"], found["scores"]["parameter"]);
            assert_eq!(found, kernel, "the kernel is the default");
        }
        // The model runs, and its page names the parameter and the score.
        folder.done("predict m.json r.csv --input u -o p.csv");
        let page = folder.read("page.html");
        let parameter = name.parameter();
        let label = parameter[..1].to_uppercase() + &parameter[1..];
        assert!(page.contains(&format!("<dt>{label}</dt>")), "{name}");
        assert!(
            page.contains("leave-one-out error") || found["scores"].is_null(),
            "{name}"
        );
    }
}

#[test]
fn a_given_parameter_is_taken() {
    let folder = Folder::new();
    folder.known("r.csv", 1200, 3);
    let found = folder.json(&format!("{IDENTIFY} --nonlinearity legendre --parameter 7"));
    assert_eq!((&found["value"], &found["scores"]), (&Value::from(7.0), &Value::Null));
    let found = folder.json(&format!(
        "{IDENTIFY} --nonlinearity local-linear --bandwidth 0.4 --kernel triweight"
    ));
    assert_eq!(
        (&found["value"], &found["kernel"]),
        (&Value::from(0.4), &Value::from("triweight"))
    );
    assert!(!numbers(&found["nonlinearity"]["lower"]).is_empty());
}

#[test]
fn options_of_another_estimator_are_refused() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    for (options, message) in [
        (
            "--nonlinearity spline --bandwidth 0.1",
            "--bandwidth: --nonlinearity spline has no bandwidth; its parameter is penalty, given by --parameter",
        ),
        (
            "--parameter 3",
            "--parameter: the parameter of --nonlinearity kernel is its bandwidth, given by --bandwidth",
        ),
        (
            "--nonlinearity knn --kernel uniform",
            "--kernel: --nonlinearity knn has no kernel; leave it out, or choose an estimator that has one",
        ),
    ] {
        folder.misused(&format!("{IDENTIFY} -o new.json {options}"), message);
    }
    folder.misused(
        &format!("{IDENTIFY} -o new.json --nonlinearity haar --parameter 21"),
        "--parameter: the number of levels is 21, but must be at most 20",
    );
}
