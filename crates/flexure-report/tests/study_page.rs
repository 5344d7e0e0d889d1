//! The page of a convergence study: safe, and honest about gaps.

mod common;

use common::{data, page_text};
use flexure_report::data::{RateLine, RatePlot, RateRow, StudyPage, StudySection, Verdict};
use flexure_report::render_study;

fn line(name: &str, error: [f64; 3]) -> RateLine {
    RateLine {
        name: name.into(),
        error: error.to_vec(),
    }
}

fn page() -> StudyPage {
    let section = |short: &str, plots: usize| StudySection {
        heading: format!("Part {short}"),
        short: short.into(),
        lead: "What was measured.".into(),
        plots: (0..plots)
            .map(|k| RatePlot {
                title: format!("{short} plot {k}"),
                y_label: "error".into(),
                n: vec![100.0, 1000.0, 10_000.0],
                lines: vec![line("measured", [0.1 + k as f64, f64::NAN, 0.0])],
                guides: vec![line("theory", [0.1, 0.05, 0.025])],
            })
            .collect(),
        rows: vec![RateRow {
            name: "a setting".into(),
            slope: "-0.33".into(),
            interval: "-0.4 to -0.3".into(),
            theory: "at most -0.5".into(),
            agrees: false,
            errors: "0.1 to 0.01".into(),
        }],
    };
    StudyPage {
        title: "Rates".into(),
        subtitle: "Measured.".into(),
        verdict: Verdict {
            headline: "Differs".into(),
            holds: false,
            text: "One differs.".into(),
            details: Vec::new(),
        },
        facts: Vec::new(),
        warnings: Vec::new(),
        sections: vec![section("A", 2), section("B", 1)],
        command: None,
    }
}

#[test]
fn plots_are_numbered_through_the_sections() {
    let html = render_study(&page()).unwrap();
    let plots = data(&html)["plots"].as_array().unwrap().len();
    assert_eq!(plots, 3);
    for k in 0..plots {
        assert_eq!(html.matches(&format!("id=\"plot-rate-{k}\"")).count(), 1, "{k}");
    }
    let shown = page_text(&html);
    let place = |text: &str| shown.find(text).unwrap_or_else(|| panic!("{text}"));
    assert!(place("A plot 1") < place("Part B") && place("Part B") < place("B plot 0"));
    assert!(shown.contains("at most -0.5") && shown.contains("differs"));
}

#[test]
fn what_has_no_logarithm_is_a_gap() {
    let html = render_study(&page()).unwrap();
    assert_eq!(
        data(&html)["plots"][0]["lines"][0]["error"],
        serde_json::json!([0.1, null, null])
    );
}

#[test]
fn contradictions_are_named() {
    let message = |change: fn(&mut RatePlot)| {
        let mut page = page();
        change(&mut page.sections[1].plots[0]);
        render_study(&page).unwrap_err().to_string()
    };
    for (got, expected) in [
        (message(|p| p.n[1] = 100.0), "sections[1].plots[0].n[1] = 100"),
        (
            message(|p| p.n[0] = 0.0),
            "sections[1].plots[0].n[0] = 0 has no logarithm",
        ),
        (
            message(|p| p.guides[0].error.truncate(1)),
            "sections[1].plots[0].line 1 has 1 values where 3",
        ),
    ] {
        assert!(got.starts_with(expected), "{got}");
    }
}

#[test]
fn no_text_can_become_a_tag() {
    let clean = render_study(&page()).unwrap();
    let evil = "</script><img src=x><!--";
    let mut page = page();
    let StudySection {
        heading,
        short,
        lead,
        plots,
        rows,
    } = &mut page.sections[0];
    let RatePlot {
        title, y_label, lines, ..
    } = &mut plots[0];
    let RateRow { name, slope, .. } = &mut rows[0];
    for text in [heading, short, lead, title, y_label, &mut lines[0].name, name, slope] {
        *text = evil.to_owned();
    }
    let html = render_study(&page).unwrap();
    for tag in ["<script", "</script", "<img", "<!--"] {
        assert_eq!(
            html.matches(tag).count(),
            clean.matches(tag).count(),
            "{tag} was smuggled in"
        );
    }
}
