//! The page of a first look: safe, and honest about gaps.

mod common;

use common::{data, page_text};
use flexure_report::data::{Axis, LagPlot, LookPage, NextCommand, Signal, SpectrumPlot, Table};
use flexure_report::render_look;

fn table(cell: &str) -> Table {
    Table {
        title: "The columns".into(),
        text: "Their ranges.".into(),
        columns: vec!["column".into(), "least".into()],
        rows: vec![vec![cell.into(), "-1".into()]],
        chosen: None,
        ends_in_text: false,
    }
}

fn page() -> LookPage {
    LookPage {
        title: "log.csv".into(),
        subtitle: "A first look.".into(),
        next: Some(NextCommand {
            command: "flexure identify log.csv --input u --output y".into(),
            why: "y follows u.".into(),
            notes: vec!["Beware.".into()],
        }),
        facts: Vec::new(),
        warnings: vec!["y misses 3 samples".into()],
        notes: vec!["u has 2 levels".into()],
        columns: table("u"),
        record: vec![Signal {
            name: "u".into(),
            unit: "V".into(),
            values: vec![1.0, f64::NAN, 3.0],
        }],
        time: Axis::of_samples(Some(0.1), 0),
        dependences: table("y follows u"),
        correlations: vec![LagPlot {
            title: "y after u".into(),
            caption: "Whitened.".into(),
            lags: vec![-1.0, 0.0, 1.0],
            values: vec![0.0, 0.5, 0.1],
            limit: 0.1,
            level: "99 %".into(),
        }],
        spectra: vec![SpectrumPlot {
            title: "u".into(),
            y_label: "power density (V²/Hz)".into(),
            frequency: vec![1.0, 2.0, 3.0],
            density: vec![2.0, 0.0, 1.0],
        }],
        frequency_unit: "Hz".into(),
        command: None,
    }
}

#[test]
fn everything_is_on_the_page_and_a_power_of_zero_is_a_gap() {
    let html = render_look(&page()).unwrap();
    let shown = page_text(&html);
    let command = shown.replace("<span>", "").replace("</span>", "");
    assert!(
        command.contains("flexure identify log.csv --input u --output y</code>"),
        "{command}"
    );
    for text in [
        "y follows u.",
        "Beware.",
        "y misses 3 samples",
        "u has 2 levels",
        "Whitened.",
    ] {
        assert!(shown.contains(text), "{text}");
    }
    let data = data(&html);
    assert_eq!(data["spectra"][0]["density"], serde_json::json!([2.0, null, 1.0]));
    assert_eq!(data["spectra"][0]["x_label"], "frequency (Hz)");
    assert_eq!(
        data["record"]["signals"][0]["values"],
        serde_json::json!([1.0, null, 3.0])
    );
    assert_eq!(data["correlations"][0]["limit"], 0.1);
    for id in ["plot-record", "plot-correlation-0", "plot-spectrum-0"] {
        assert_eq!(html.matches(&format!("id=\"{id}\"")).count(), 1, "{id}");
    }
}

#[test]
fn what_is_not_there_has_no_place() {
    let bare = LookPage {
        next: None,
        warnings: Vec::new(),
        notes: Vec::new(),
        record: Vec::new(),
        correlations: Vec::new(),
        spectra: Vec::new(),
        dependences: Table {
            rows: Vec::new(),
            ..table("")
        },
        ..page()
    };
    let shown = page_text(&render_look(&bare).unwrap());
    for id in [
        "\"next",
        "id=\"record\"",
        "id=\"spectra\"",
        "id=\"dependences\"",
        "plot-",
    ] {
        assert!(!shown.contains(id), "{id}");
    }
}

#[test]
fn contradictions_are_named() {
    let message = |change: fn(&mut LookPage)| {
        let mut page = page();
        change(&mut page);
        render_look(&page).unwrap_err().to_string()
    };
    for (got, expected) in [
        (
            message(|p| p.spectra[0].frequency[0] = 0.0),
            "spectra[0].frequency[0] = 0 has no logarithm",
        ),
        (
            message(|p| p.spectra[0].density.truncate(1)),
            "spectra[0].density has 1 values where 3",
        ),
        (
            message(|p| p.correlations[0].lags[1] = -1.0),
            "correlations[0].lags[1] = -1",
        ),
        (
            message(|p| p.columns.rows[0].truncate(1)),
            "columns.rows[0] has 1 values where 2",
        ),
        (message(|p| p.time.step = 0.0), "time starts at 0 and steps by 0"),
    ] {
        assert!(got.starts_with(expected), "{got}");
    }
}

#[test]
fn no_text_can_become_a_tag() {
    let clean = render_look(&page()).unwrap();
    let evil = "</script><img src=x><!--";
    let mut page = page();
    page.columns = table(evil);
    let LookPage {
        title,
        warnings,
        notes,
        next,
        record,
        correlations,
        spectra,
        ..
    } = &mut page;
    let next = next.as_mut().unwrap();
    let (lags, spectrum) = (&mut correlations[0], &mut spectra[0]);
    let plots = [
        &mut lags.title,
        &mut lags.caption,
        &mut spectrum.title,
        &mut spectrum.y_label,
    ];
    let texts = [
        title,
        &mut warnings[0],
        &mut notes[0],
        &mut next.command,
        &mut next.why,
        &mut record[0].name,
    ];
    texts.into_iter().chain(plots).for_each(|text| *text = evil.to_owned());
    let html = render_look(&page).unwrap();
    for tag in ["<script", "</script", "<img", "<!--"] {
        assert_eq!(
            html.matches(tag).count(),
            clean.matches(tag).count(),
            "{tag} was smuggled in"
        );
    }
}
