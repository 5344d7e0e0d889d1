//! The page of a regression: safe, self-contained, small, and without empty boxes.

mod common;

use common::{data, page_text};
use flexure_report::data::{
    Choice, Fact, Nonlinearity, RegressionPage, RegressionResiduals, Scatter, ScoreCurve, Slice, Surface,
};
use flexure_report::{limits, render_regression};
use serde_json::Value;

fn curve(points: usize) -> Nonlinearity {
    let x: Vec<f64> = (0..points).map(|i| i as f64 / 10.0).collect();
    let shifted = |by: f64| x.iter().map(|x| x.sin() + by).collect();
    Nonlinearity {
        x_label: "force (N)".into(),
        y_label: "speed (m/s)".into(),
        y: shifted(0.0),
        lower: shifted(-0.1),
        upper: shifted(0.1),
        band_label: "95 % pointwise".into(),
        density: Vec::new(),
        truth: Vec::new(),
        truth_label: String::new(),
        x,
    }
}

fn scatter(n: usize) -> Scatter {
    Scatter {
        x: (0..n).map(|i| (i * 617 % 1009) as f64 / 100.0).collect(),
        y: (0..n).map(|i| (i * 421 % 997) as f64 / 500.0 - 1.0).collect(),
    }
}

/// A page with every part.
fn full() -> RegressionPage {
    let grid: Vec<f64> = (0..12).map(f64::from).collect();
    RegressionPage {
        title: "speed against force".into(),
        subtitle: "The mean of speed at given force.".into(),
        facts: vec![Fact {
            name: "R squared".into(),
            value: "0.9".into(),
            note: "by leave-one-out".into(),
        }],
        warnings: vec!["the rows depend on each other".into()],
        curve: curve(50),
        points: scatter(300),
        surface: Some(Surface {
            x_label: "a".into(),
            y_label: "b".into(),
            z_label: "c".into(),
            x: grid.clone(),
            y: grid[..7].to_vec(),
            z: (0..84).map(f64::from).collect(),
            points: scatter(300),
        }),
        slices: vec![Slice {
            at: "b = 0.3".into(),
            curve: curve(20),
        }],
        residuals: RegressionResiduals {
            x_label: "force (N)".into(),
            y_label: "residual of speed".into(),
            points: scatter(300),
            running_x: vec![1.0, 2.0, 3.0],
            running_mean: vec![0.0, 0.1, 0.0],
            running_spread: vec![0.5, 0.6, 0.5],
        },
        choices: vec![Choice {
            name: "Bandwidth".into(),
            value: "0.3".into(),
            why: "smallest leave-one-out error".into(),
            curve: Some(ScoreCurve {
                x_label: "bandwidth".into(),
                y_label: "leave-one-out error".into(),
                log_x: true,
                x: vec![0.1, 0.3, 1.0],
                y: vec![2.0, 1.0, 3.0],
                chosen: 0.3,
            }),
        }],
        command: Some("flexure regress r.csv".into()),
    }
}

fn html(page: &RegressionPage) -> String {
    render_regression(page).expect("the page is made")
}

#[test]
fn text_cannot_become_markup_or_end_the_data() {
    let evil = r#"</script><script>alert(1)</script><img src=x onerror="alert(2)"><!-- <script> & ' "#;
    let clean = html(&full());
    let mut page = full();
    let surface = page.surface.as_mut().expect("a surface");
    let slice = &mut page.slices[0];
    for text in [
        &mut page.title,
        &mut page.subtitle,
        &mut page.facts[0].name,
        &mut page.warnings[0],
        &mut page.curve.x_label,
        &mut page.curve.band_label,
        &mut surface.x_label,
        &mut surface.z_label,
        &mut slice.at,
        &mut slice.curve.y_label,
        &mut page.residuals.x_label,
        &mut page.residuals.y_label,
        &mut page.choices[0].why,
    ] {
        *text = evil.to_owned();
    }
    page.command = Some(evil.to_owned());
    let html = html(&page);
    for tag in ["<script", "</script", "<img", "<!--"] {
        assert_eq!(
            html.matches(tag).count(),
            clean.matches(tag).count(),
            "{tag} was smuggled in"
        );
    }
    assert_eq!(data(&html)["surface"]["z_label"], evil, "the words arrive unharmed");
}

#[test]
fn nothing_is_referred_to_outside_the_page() {
    let html = html(&full());
    let rest = html.replace("/*! https://github.com/leeoniya/uPlot (v1.6.32) */", "");
    for reference in ["http://", "https://", "@import", "fetch(", "XMLHttpRequest", "import("] {
        assert!(!rest.contains(reference), "{reference} in the page");
    }
    assert!(!rest.replace("url(#", "").contains("url("), "url( in the page");
    assert!(rest.contains("default-src 'none'"), "the page forbids requests");
}

#[test]
fn values_that_are_not_finite_become_gaps() {
    let mut page = full();
    page.curve.y[3] = f64::NAN;
    page.curve.lower[4] = f64::INFINITY;
    page.surface.as_mut().expect("a surface").z[5] = f64::NAN;
    page.points.y[7] = f64::NAN;
    page.residuals.points.x[2] = f64::NAN;
    let html = html(&page);
    let data = data(&html);
    for pointer in ["/curve/y/3", "/curve/lower/4", "/surface/z/5"] {
        assert_eq!(data.pointer(pointer), Some(&Value::Null), "{pointer}");
    }
    let count = |pointer: &str| data.pointer(pointer).and_then(Value::as_array).expect("a list").len();
    assert_eq!((count("/points/x"), count("/points/y")), (299, 299));
    assert_eq!(count("/residuals/points/x"), 299);
    assert!(!page_text(&html).contains("NaN"));
}

#[test]
fn a_million_points_stay_small() {
    let mut page = full();
    page.points = scatter(1_000_000);
    page.residuals.points = scatter(1_000_000);
    page.surface.as_mut().expect("a surface").points = scatter(1_000_000);
    let html = html(&page);
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
    let counts = data(&html)["points"]["cells"]["count"]
        .as_array()
        .expect("counts")
        .clone();
    let total: u64 = counts.iter().filter_map(Value::as_u64).sum();
    assert_eq!(total, 1_000_000, "every point is counted");
    assert!(page_text(&html).contains("the number of points in each cell"));
    page.points = scatter(limits::SCATTER_POINTS);
    assert!(page_text(&self::html(&page)).contains("over the data"));
}

#[test]
fn parts_without_data_leave_no_empty_boxes() {
    let sections = ["estimate", "slices", "residuals", "choices"];
    let mut page = full();
    let everything = html(&page);
    for id in sections {
        assert!(
            everything.contains(&format!(r#"<section class="part" id="{id}""#)),
            "{id}"
        );
        assert!(everything.contains(&format!(r##"href="#{id}""##)), "{id}");
    }
    page.facts.clear();
    page.warnings.clear();
    page.curve = curve(0);
    page.points = Scatter::default();
    page.surface = None;
    page.slices.clear();
    page.residuals = RegressionResiduals::default();
    page.choices.clear();
    page.command = None;
    let empty = page_text(&html(&page));
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
        assert!(!empty.contains(class), "{class} without content");
    }
    // Residuals that do not vary have no distribution.
    let mut page = full();
    page.residuals.points.y.fill(0.0);
    let constant = page_text(&html(&page));
    assert!(constant.contains("plot-residuals") && !constant.contains("plot-distribution"));
}

#[test]
fn outliers_are_counted_in_the_text() {
    let mut page = full();
    page.points.y[0] = 1e6;
    assert!(page_text(&html(&page)).contains("1 point lies outside the picture"));
    page.points.y[1] = -1e6;
    assert!(page_text(&html(&page)).contains("2 points lie outside the picture"));
    assert!(!page_text(&html(&full())).contains("outside the picture"));
}

#[test]
fn contradictions_are_named() {
    let fault = |change: fn(&mut RegressionPage)| {
        let mut page = full();
        change(&mut page);
        render_regression(&page).expect_err("the page is refused").to_string()
    };
    for (error, message) in [
        (
            fault(|p| p.points.y.truncate(4)),
            "points.y has 4 values where 300 are needed: give one for each abscissa",
        ),
        (
            fault(|p| p.curve.upper.clear()),
            "curve.upper has 0 values where 50 are needed: give one for each value of the band's lower edge",
        ),
        (
            fault(|p| p.surface.as_mut().expect("a surface").z.truncate(83)),
            "surface.z has 83 values where 84 are needed: give one for each point of the grid",
        ),
        (
            fault(|p| p.slices[0].curve.x[3] = f64::NAN),
            "slices[0].curve.x[3] = NaN is not a finite value above the one before it: sort the abscissas",
        ),
        (
            fault(|p| p.residuals.running_mean.truncate(1)),
            "residuals.running_mean has 1 values where 3 are needed: give one for each value of running_x",
        ),
    ] {
        assert_eq!(error, message);
    }
}
