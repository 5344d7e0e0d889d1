//! The page as a whole: safe, self-contained, small, and without empty boxes.

#[path = "../../examples/sample/arm.rs"]
mod arm;
#[path = "../../examples/sample/pages.rs"]
mod pages;
#[path = "../../examples/sample/system.rs"]
mod system;

#[path = "../common/mod.rs"]
mod common;
mod contradictions;
mod diagram;

use common::{data, page_text};
use flexure_report::data::{Approximation, Nonlinearity, Page, Scatter, Surface, Table, TitledCurve, TitledSurface};
use flexure_report::render;
use serde_json::Value;

fn html(page: &Page) -> String {
    render(page).expect("the page is made")
}

#[test]
fn text_cannot_become_markup_or_end_the_data() {
    let evil = r#"</script><script>alert(1)</script><img src=x onerror="alert(2)"><!-- <script> & ' "#;
    let clean = html(&pages::full());
    let mut page = pages::full();
    let (fact, signal) = (&mut page.facts[0], &mut page.record[0]);
    let part = &mut page.linear[0];
    let (test, choice) = (&mut page.residuals.tests[0], &mut page.choices[0]);
    for text in [
        &mut page.title,
        &mut page.subtitle,
        &mut page.verdict.text,
        &mut fact.name,
        &mut fact.value,
        &mut fact.note,
        &mut signal.name,
        &mut signal.unit,
        &mut page.time.name,
        &mut page.nonlinearity.x_label,
        &mut page.nonlinearity.band_label,
        &mut page.nonlinearity.truth_label,
        &mut part.title,
        &mut part.text,
        &mut page.prediction.y_label,
        &mut page.residuals.level,
        &mut test.name,
        &mut test.text,
        &mut choice.name,
        &mut choice.value,
        &mut choice.why,
        &mut page.warnings[0],
    ] {
        *text = evil.to_owned();
    }
    choice.curve.as_mut().expect("a curve").x_label = evil.to_owned();
    page.command = Some(evil.to_owned());
    let html = html(&page);
    for tag in ["<script", "</script", "<img", "<!--"] {
        assert_eq!(
            html.matches(tag).count(),
            clean.matches(tag).count(),
            "{tag} was smuggled in"
        );
    }
    assert_eq!(
        data(&html)["record"]["signals"][0]["name"],
        evil,
        "the words arrive unharmed"
    );
}

#[test]
fn nothing_is_referred_to_outside_the_page() {
    for page in [pages::full(), pages::bare()] {
        let html = html(&page);
        let licence = "/*! https://github.com/leeoniya/uPlot (v1.6.32) */";
        assert!(html.contains(licence), "the licence comment stays");
        let rest = html.replace(licence, "");
        for reference in ["http://", "https://", "@import", "fetch(", "XMLHttpRequest", "import("] {
            assert!(!rest.contains(reference), "{reference} in the page");
        }
        assert!(!rest.replace("url(#", "").contains("url("), "url( in the page");
        assert!(rest.contains("default-src 'none'"), "the page forbids requests");
        for attribute in ["src=", "href="] {
            for (at, _) in page_text(&rest).match_indices(attribute) {
                let value = &page_text(&rest)[at + attribute.len() + 1..][..6];
                assert!(
                    value.starts_with('#') || value.starts_with("data:,"),
                    "{attribute}{value}"
                );
            }
        }
    }
}

#[test]
fn assets_cannot_end_their_own_element() {
    let html = html(&pages::full());
    assert_eq!(html.matches("</script").count(), 2, "the data and the script");
    assert_eq!(html.matches("</style").count(), 1);
}

#[test]
fn values_that_are_not_finite_become_gaps() {
    let mut page = pages::full();
    page.record[0].values[3] = f64::NAN;
    page.nonlinearity.y[0] = f64::INFINITY;
    page.nonlinearity.lower[1] = f64::NEG_INFINITY;
    page.prediction.predicted[5] = f64::NAN;
    page.prediction.fit_percent = f64::NAN;
    page.residuals.limit = f64::NAN;
    page.residuals.tests[0].p_value = f64::NAN;
    page.linear[0].poles[0][1] = f64::NAN;
    page.arm.as_mut().expect("an arm").q[0][7] = f64::NAN;
    let html = html(&page);
    let data = data(&html);
    for (pointer, name) in [
        ("/record/signals/0/values/3", "signal"),
        ("/nonlinearity/y/0", "estimate"),
        ("/nonlinearity/lower/1", "band"),
        ("/prediction/predicted/5", "prediction"),
        ("/prediction/error/5", "error"),
        ("/residuals/limit", "limit"),
        ("/linear/0/poles/0/1", "pole"),
        ("/arm/q/0/7", "angle"),
    ] {
        assert_eq!(data.pointer(pointer), Some(&Value::Null), "{name}");
    }
    assert!(!page_text(&html).contains("NaN"), "a reader sees a dash");
}

#[test]
fn a_million_samples_stay_small_and_keep_their_spikes() {
    let n = 1_000_000;
    let mut page = pages::long(n);
    let mut torque = page.record[0].clone();
    torque.values[654_321] = 1234.5;
    torque.values[654_322] = -4321.5;
    page.record = (0..11).map(|_| torque.clone()).collect();
    page.prediction.measured[77_777] = 777.25;
    let html = html(&page);
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    let data = data(&html);
    let values = |pointer: &str| -> Vec<f64> {
        let list = data.pointer(pointer).and_then(Value::as_array).expect("a list");
        list.iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    for k in 0..11 {
        let kept = values(&format!("/record/signals/{k}/values"));
        assert_eq!(
            kept.len(),
            data["record"]["time"]["count"],
            "one point for each abscissa"
        );
        let at = kept.iter().position(|&v| v == 1234.5).expect("the spike up");
        assert_eq!(kept[at + 1], -4321.5, "the spike down follows");
        let step = data["record"]["time"]["step"].as_f64().expect("a step");
        let bucket = data["record"]["time"]["bucket"].as_f64().expect("a bucket") * page.time.step;
        assert!(
            (at as f64 * step - 654_321.0 * page.time.step).abs() <= bucket,
            "at its time"
        );
    }
    assert!(values("/prediction/measured").contains(&777.25));
    let error = values("/prediction/error").into_iter().fold(0.0, f64::max);
    assert!(error > 700.0, "the error is decimated from the full one: {error}");
    assert_eq!(values("/arm/q/0").len(), flexure_report::limits::ARM_SAMPLES);
}

#[test]
fn short_records_are_embedded_sample_by_sample() {
    let page = pages::full();
    let data = data(&html(&page));
    let count = data["record"]["time"]["count"].as_u64();
    assert_eq!(count, Some(page.record[0].values.len() as u64));
    assert_eq!(data["record"]["fresh_from"].as_f64(), Some(40.0));
    let kept = data["prediction"]["measured"].as_array().expect("a list");
    for (kept, &sample) in kept.iter().zip(&page.prediction.measured) {
        assert!((kept.as_f64().expect("a number") - sample).abs() <= 1e-6 * sample.abs());
    }
}

#[test]
fn parts_without_data_leave_no_empty_boxes() {
    let full = html(&pages::full());
    let sections = [
        "nonlinearity",
        "linear",
        "prediction",
        "residuals",
        "choices",
        "record",
        "arm",
    ];
    for id in sections {
        assert!(
            full.contains(&format!(r#"<section class="part" id="{id}""#)),
            "{id} is there"
        );
    }
    let mut page = pages::bare();
    let bare = page_text(&html(&page));
    assert!(!bare.contains("plot-cross") && !bare.contains("plot-score"));
    for list in [&mut page.nonlinearity.x, &mut page.nonlinearity.y] {
        list.clear();
    }
    let linear = &mut page.linear[0];
    for list in [&mut linear.b, &mut linear.a, &mut linear.impulse, &mut linear.frequency] {
        list.clear();
    }
    linear.magnitude_db.clear();
    linear.phase_deg.clear();
    linear.magnitude_error.clear();
    linear.phase_error.clear();
    linear.poles.clear();
    linear.pole_covariances.clear();
    linear.zeros.clear();
    page.prediction.measured.clear();
    page.prediction.predicted.clear();
    page.residuals.autocorrelation.clear();
    page.residuals.tests.clear();
    page.facts.clear();
    page.choices.clear();
    page.warnings.clear();
    page.record.clear();
    let empty = html(&page);
    for id in sections {
        assert!(!empty.contains(&format!(r#"id="{id}""#)), "{id} has nothing to show");
        assert!(!empty.contains(&format!(r##"href="#{id}""##)), "nothing leads to {id}");
    }
    for class in [
        r#"class="facts""#,
        r#"class="warnings""#,
        "<figure",
        "<figcaption",
        "<pre",
    ] {
        assert!(!page_text(&empty).contains(class), "{class} without content");
    }
    assert!(
        page_text(&empty).contains("does not hold"),
        "the verdict is always there"
    );
}

#[test]
fn a_nonlinearity_known_at_few_points_shows_them() {
    let text_of = |points: usize| {
        let mut page = pages::full();
        let n = &mut page.nonlinearity;
        for list in [
            &mut n.x,
            &mut n.y,
            &mut n.lower,
            &mut n.upper,
            &mut n.density,
            &mut n.truth,
        ] {
            list.truncate(points);
        }
        let html = html(&page);
        let plot = &data(&html)["nonlinearity"];
        let dense = !plot["density"].as_array().expect("a list").is_empty();
        assert_eq!(page_text(&html).contains("over the density"), dense);
        assert_eq!(plot["points"], !dense, "there are no data between few levels");
        (plot["points"].clone(), page_text(&html))
    };
    let said = "The estimate at the points where it is known";
    for few in [1, 2, 10] {
        let (points, shown) = text_of(few);
        assert!(points == true && shown.contains(said), "{few}");
    }
    let (points, shown) = text_of(11);
    assert!(points == false && shown.contains("The estimated curve") && !shown.contains(said));
}

#[test]
fn every_linear_part_has_a_section_and_plots_of_its_own() {
    let mut page = pages::full();
    let mut back = page.linear[0].clone();
    back.title = "Behind the nonlinearity".into();
    back.zeros.clear();
    back.poles.clear();
    back.pole_covariances.clear();
    page.linear.push(back);
    let html = html(&page);
    for (id, heading) in [("linear", "Linear part"), ("linear-1", "Behind the nonlinearity")] {
        assert!(html.contains(&format!(r#"<section class="part" id="{id}""#)), "{id}");
        assert!(html.contains(&format!(r##"href="#{id}">{heading}"##)), "{heading}");
    }
    let plots = |name: &str| [0, 1].map(|k| html.matches(&format!(r#"id="plot-{name}-{k}""#)).count());
    assert_eq!(["impulse", "magnitude", "phase"].map(plots), [[1, 1]; 3]);
    assert_eq!(plots("roots"), [1, 0], "the second has none");
    assert_eq!(data(&html)["linear"].as_array().expect("a list").len(), 2);
}

#[test]
fn candidates_stand_in_a_table_with_the_chosen_one_marked() {
    let table = Table {
        title: "Structures <tried>".into(),
        text: "By their error.".into(),
        columns: ["structure", "error"].map(String::from).to_vec(),
        rows: vec![vec!["linear".into(), "0.4".into()], vec!["Wiener".into(), "0.1".into()]],
        chosen: Some(1),
        ends_in_text: false,
    };
    let with = |table: Table| Page {
        candidates: vec![table],
        ..pages::full()
    };
    let text = page_text(&html(&with(table.clone())));
    assert!(text.contains("Structures &lt;tried&gt;</h2>") && text.contains(r#"data-name="error">0.4</td>"#));
    let (before, after) = text.split_once(r#"<tr class="chosen-row">"#).expect("a marked row");
    assert!(before.contains(">linear</th>") && after.contains(">Wiener</th>"));
    let empty = Table {
        rows: Vec::new(),
        ..table.clone()
    };
    assert!(!page_text(&html(&with(empty))).contains("candidates-heading"));
    let mut both = with(table.clone());
    both.candidates.push(Table {
        title: "Sizes".into(),
        ends_in_text: true,
        ..table.clone()
    });
    let text = page_text(&html(&both));
    assert!(text.contains(r#"id="candidates-heading-1""#) && text.contains(r#"id="candidates-heading-2">Sizes</h2>"#));
    assert!(text.contains(r#"<td class="text" data-name="error">0.4</td>"#));
    let mut ragged = with(table);
    ragged.candidates[0].rows[0].pop();
    assert_eq!(
        render(&ragged).expect_err("refused").to_string(),
        "candidates[0].rows[0] has 1 values where 2 are needed: give one for each column"
    );
}

#[test]
fn verdicts_are_sentences() {
    let holds = page_text(&html(&pages::full()));
    assert!(holds.contains("The model holds on fresh data") && holds.contains("✓ passed"));
    let fails = page_text(&html(&pages::bare()));
    assert!(fails.contains("The model does not hold on fresh data") && fails.contains("✗ failed"));
    assert!(fails.contains("&lt; 10⁻⁶"), "a p-value of 0 is not shown as such");
}

#[test]
fn a_surface_further_curves_and_an_approximation_have_their_places() {
    let mut page = pages::full();
    page.surface = Some(TitledSurface {
        title: "Joint nonlinearity".into(),
        text: "Of both <inputs>.".into(),
        surface: Surface {
            x_label: "a".into(),
            y_label: "b".into(),
            z_label: "phi".into(),
            x: vec![0.0, 1.0, 2.0],
            y: vec![0.0, 1.0],
            z: vec![0.0, 1.0, 2.0, 3.0, 4.0, f64::NAN],
            points: Scatter::default(),
        },
    });
    page.curves = vec![TitledCurve {
        title: "Along b".into(),
        curve: Nonlinearity {
            x: vec![0.0, 1.0],
            y: vec![1.0, 0.0],
            ..Nonlinearity::default()
        },
    }];
    page.approximation = Some(Approximation {
        text: "From 4 periods.".into(),
        frequency: vec![0.1, 0.2],
        frequency_unit: "Hz".into(),
        magnitude_db: vec![0.0, -3.0],
        phase_deg: vec![0.0, -90.0],
        total_db: Vec::new(),
        noise_db: vec![-40.0, -50.0],
        distortion_db: vec![f64::NEG_INFINITY, -30.0],
    });
    let html = html(&page);
    for expected in [
        "Joint nonlinearity",
        "Of both &lt;inputs&gt;.",
        "Along b",
        "From 4 periods.",
        "plot-approximation-phase",
    ] {
        assert!(html.contains(expected), "{expected}");
    }
    let plotted = data(&html);
    assert_eq!(plotted["surface"]["z"][5], Value::Null);
    assert_eq!(
        plotted["approximation"]["distortion_db"],
        serde_json::json!([null, -30.0])
    );
    let without = render(&pages::full()).expect("the page is made");
    assert!(!without.contains("id=\"plot-approximation\"") && !without.contains("id=\"plot-surface\""));
    let refused = |change: &dyn Fn(&mut Page)| {
        let mut wrong = page.clone();
        change(&mut wrong);
        render(&wrong).expect_err("refused").to_string()
    };
    let cut = refused(&|p| p.surface.as_mut().expect("a surface").surface.z.truncate(5));
    assert!(cut.contains("surface.surface.z"), "{cut}");
    let low = refused(&|p| p.approximation.as_mut().expect("an approximation").frequency[0] = 0.0);
    assert!(low.contains("approximation.frequency"), "{low}");
    let short = refused(&|p| p.approximation.as_mut().expect("an approximation").noise_db.truncate(1));
    assert!(short.contains("approximation.noise_db"), "{short}");
}
