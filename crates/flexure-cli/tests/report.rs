//! `flexure report`: the page of a model on a record.

mod common;

use common::{Folder, filter, known};
use flexure::Record;
use flexure_io::write_record;
use serde_json::Value;

/// What a page plots.
fn payload(folder: &Folder, page: &str) -> Value {
    let html = folder.read(page);
    let (_, data) = html
        .split_once(r#"<script type="application/json" id="page-data">"#)
        .unwrap();
    serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn on_its_own_record_it_is_the_page_of_the_identification() {
    for structure in ["hammerstein", "wiener-hammerstein", "parallel"] {
        let folder = Folder::new();
        folder.known("r.csv", 1200, 1);
        folder.done(&format!(
            "identify r.csv --input u --output y --structure {structure} -o model.json --report first.html"
        ));
        folder.done("report model.json r.csv -o again.html");
        let (first, again) = (payload(&folder, "first.html"), payload(&folder, "again.html"));
        for part in ["prediction", "residuals", "record"] {
            assert_eq!(first[part], again[part], "{structure} {part}");
        }
        for key in ["x", "y", "density", "x_label", "y_label"] {
            assert_eq!(
                first["nonlinearity"][key], again["nonlinearity"][key],
                "{structure} {key}"
            );
        }
        let linear = |page: &Value| -> Vec<[Value; 3]> {
            let parts = page["linear"].as_array().unwrap().iter();
            parts
                .map(|part| ["frequency", "magnitude", "poles"].map(|key| part[key].clone()))
                .collect()
        };
        assert_eq!(linear(&first), linear(&again), "{structure}");
    }
}

#[test]
fn on_another_record_all_samples_behind_the_settling_time_are_judged() {
    let folder = Folder::new();
    folder.known("r.csv", 1200, 1);
    folder.known("fresh.csv", 600, 2);
    folder.done("identify r.csv --input u --output y -o model.json");
    let judged = folder.json("validate model.json fresh.csv");
    let reported = folder.json("report model.json fresh.csv -o page.html");
    for key in ["fit_percent", "rms", "samples", "holds", "verdict"] {
        assert_eq!(judged[key], reported[key], "{key}");
    }
    let page = folder.read("page.html");
    let subtitle = format!("judged on {} samples of fresh.csv.", judged["samples"]);
    assert!(page.contains(&subtitle), "{subtitle}");
    assert!(page.contains("flexure report model.json fresh.csv -o page.html"));
}

/// The page of `validate` is that of `report`.
#[test]
fn validate_writes_the_same_page() {
    let folder = Folder::new();
    folder.known("log.csv", 1500, 1);
    folder.known("later.csv", 600, 2);
    folder.done("identify log.csv --input u --output y -o model.json");
    let text = folder.done("report model.json later.csv -o page.html");
    assert!(
        text.starts_with("Fit ") && text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    let text = folder.done("validate model.json later.csv --report same.html");
    assert!(text.ends_with("wrote same.html\n"), "{text}");
    assert_eq!(payload(&folder, "same.html"), payload(&folder, "page.html"));
}

/// The errors of a model where its input goes beyond the range of the fit are reported apart from those within.
#[test]
fn excursions_of_the_input_are_judged_apart() {
    let folder = Folder::new();
    // A limiter that acts beyond what the fit sees.
    let record = |samples: usize, seed: u64, reach: f64| {
        let u = known(samples, seed).column("u").unwrap().to_vec();
        let largest = u.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        let far = |k: usize| if k % 200 == 150 { reach } else { 1.0 };
        let u: Vec<f64> = u.iter().enumerate().map(|(k, u)| far(k) * u / largest).collect();
        let limited: Vec<f64> = u.iter().map(|u| u.clamp(-1.0, 1.0)).collect();
        let noise = known(samples, seed + 50).column("u").unwrap().to_vec();
        let y = filter(&[0.3], &[1.0, -0.7], &limited, 0.0);
        let y = y.iter().zip(noise).map(|(y, e)| y + 0.003 * e).collect();
        Record::new([("u", u), ("y", y)]).unwrap()
    };
    write_record(folder.path("log.csv"), &record(2000, 1, 1.0)).unwrap();
    write_record(folder.path("later.csv"), &record(2000, 2, 9.0)).unwrap();
    folder.done("identify log.csv --input u --output y -o model.json");
    let found = folder.json("validate model.json later.csv");
    assert_eq!(
        (&found["holds"], &found["within_range"]["holds"]),
        (&false.into(), &true.into())
    );
    let fit = |of: &Value| of["fit_percent"].as_f64().unwrap();
    assert!(fit(&found) < 90.0 && fit(&found["within_range"]) > 95.0, "{found}");
    let text = folder.done("validate model.json later.csv");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        text.contains("and the model holds: identify it from data that reach as far"),
        "{text}"
    );
    // Its own record is no fresh one.
    let own = folder.json("validate model.json log.csv");
    assert_eq!(own["identified_from_this_record"], true);
}
