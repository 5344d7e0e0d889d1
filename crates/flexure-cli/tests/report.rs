//! `flexure report`: the page of a model on a record.

mod common;

use common::Folder;
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
