//! Putting the page together.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, context};

use serde::Serialize;

use crate::data::{ComparisonPage, ControlPage, JointPage, LookPage, MotionPage, Page, RegressionPage, StudyPage};
use crate::payload::payload;
use crate::text::text;
use crate::typeset::typeset;
use crate::{Result, check, comparison, control, joint, look, motion, regression, study};

/// The templates by the names under which they include one another.
const TEMPLATES: [(&str, &str); 10] = [
    ("base.html", include_str!("../assets/base.html")),
    ("parts.html", include_str!("../assets/parts.html")),
    ("identification.html", include_str!("../assets/identification.html")),
    ("compare.html", include_str!("../assets/compare.html")),
    ("control.html", include_str!("../assets/control.html")),
    ("joint.html", include_str!("../assets/joint.html")),
    ("look.html", include_str!("../assets/look.html")),
    ("motion.html", include_str!("../assets/motion.html")),
    ("regression.html", include_str!("../assets/regression.html")),
    ("study.html", include_str!("../assets/study.html")),
];

const STYLES: [&str; 5] = [
    include_str!("../assets/vendor/uplot/uPlot.min.css"),
    include_str!("../assets/page.css"),
    include_str!("../assets/diagram.css"),
    include_str!("../assets/save.css"),
    include_str!("../assets/print.css"),
];

const UPLOT: &str = include_str!("../assets/vendor/uplot/uPlot.iife.min.js");

/// The scripts that all pages share, in the order in which they build on one another. The page's own scripts follow. All have one function
/// scope.
const SHARED: [&str; 10] = [
    include_str!("../assets/format.js"),
    include_str!("../assets/theme.js"),
    include_str!("../assets/chart.js"),
    include_str!("../assets/bands.js"),
    include_str!("../assets/group.js"),
    include_str!("../assets/scatter.js"),
    include_str!("../assets/curves.js"),
    include_str!("../assets/svg-context.js"),
    include_str!("../assets/image.js"),
    include_str!("../assets/save.js"),
];

const IDENTIFICATION: [&str; 7] = [
    include_str!("../assets/surface.js"),
    include_str!("../assets/linear.js"),
    include_str!("../assets/signals.js"),
    include_str!("../assets/arm-view.js"),
    include_str!("../assets/player.js"),
    include_str!("../assets/arm.js"),
    include_str!("../assets/main.js"),
];

const JOINT: [&str; 2] = [include_str!("../assets/signals.js"), include_str!("../assets/joint.js")];

const CONTROL: [&str; 5] = [
    include_str!("../assets/signals.js"),
    include_str!("../assets/arm-view.js"),
    include_str!("../assets/player.js"),
    include_str!("../assets/arm.js"),
    include_str!("../assets/control.js"),
];

const MOTION: [&str; 5] = [
    include_str!("../assets/signals.js"),
    include_str!("../assets/arm-view.js"),
    include_str!("../assets/chain-view.js"),
    include_str!("../assets/player.js"),
    include_str!("../assets/motion.js"),
];

const LOOK: [&str; 2] = [include_str!("../assets/signals.js"), include_str!("../assets/look.js")];

const REGRESSION: [&str; 3] = [
    include_str!("../assets/distribution.js"),
    include_str!("../assets/surface.js"),
    include_str!("../assets/regression.js"),
];

const STUDY: [&str; 1] = [include_str!("../assets/study.js")];

/// The page as one HTML document that needs nothing else.
///
/// Values that are not finite become gaps in the plots. Long signals are decimated as [`crate::limits`] describes.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::NotIncreasing`], [`crate::Error::NotPositive`], [`crate::Error::Axis`] and
/// [`crate::Error::LinkLength`] if the page's data contradict one another.
pub fn render(page: &Page) -> Result<String> {
    check::page(page)?;
    let payload = payload(page);
    document("identification.html", &IDENTIFICATION, text(page, &payload), &payload)
}

/// The page of a first look at a record as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::NotIncreasing`], [`crate::Error::NotPositive`] and [`crate::Error::Axis`] if the
/// page's data contradict one another.
pub fn render_look(page: &LookPage) -> Result<String> {
    look::check(page)?;
    let payload = look::payload(page);
    document("look.html", &LOOK, look::text(page, &payload), &payload)
}

/// The page of a regression as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::NotIncreasing`] and [`crate::Error::NotPositive`] if the page's data contradict
/// one another.
pub fn render_regression(page: &RegressionPage) -> Result<String> {
    regression::check(page)?;
    let payload = regression::payload(page);
    document(
        "regression.html",
        &REGRESSION,
        regression::text(page, &payload),
        &payload,
    )
}

/// The page of a convergence study as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::NotIncreasing`] and [`crate::Error::NotPositive`] if the page's data contradict
/// one another.
pub fn render_study(page: &StudyPage) -> Result<String> {
    study::check(page)?;
    document("study.html", &STUDY, study::text(page), &study::payload(page))
}

/// The page of several models on one record as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`] and [`crate::Error::Axis`] if the page's data contradict one another.
pub fn render_comparison(page: &ComparisonPage) -> Result<String> {
    comparison::check(page)?;
    let payload = comparison::payload(page);
    document("compare.html", &JOINT, comparison::text(page, &payload), &payload)
}

/// The page of a control scenario as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::Axis`] and [`crate::Error::LinkLength`] if the page's data contradict one another.
pub fn render_control(page: &ControlPage) -> Result<String> {
    control::check(page)?;
    let payload = control::payload(page);
    document("control.html", &CONTROL, control::text(page, &payload), &payload)
}

/// The page of a moving chain as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`] and [`crate::Error::Axis`] if the page's data contradict one another.
pub fn render_motion(page: &MotionPage) -> Result<String> {
    motion::check(page)?;
    let payload = motion::payload(page);
    document("motion.html", &MOTION, motion::text(page, &payload), &payload)
}

/// The page of a joint's friction and stiffness as one HTML document that needs nothing else.
///
/// # Errors
///
/// [`crate::Error::Length`], [`crate::Error::NotIncreasing`] and [`crate::Error::Axis`] if the page's data contradict one
/// another.
pub fn render_joint(page: &JointPage) -> Result<String> {
    joint::check(page)?;
    let payload = joint::payload(page);
    document("joint.html", &JOINT, joint::text(page, &payload), &payload)
}

/// Fills in a template with the page's text, and embeds its scripts and the data that they plot.
fn document(template: &str, scripts: &[&str], text: impl Serialize, payload: &impl Serialize) -> Result<String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_filter("typeset", |text: String| typeset(&text));
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    let html = environment.get_template(template)?.render(context! {
        page => Value::from(Serde(text)),
        style => STYLES.concat(),
        script => format!(
            "{UPLOT}\n(() => {{\n\"use strict\";\n{}{}}})();\n",
            SHARED.concat(),
            scripts.concat()
        ),
        data => embedded(payload)?,
    })?;
    Ok(html)
}

/// JSON that can stand inside a `<script>` element: no `<` means no end tag and no comment can begin in it.
/// (`<` occurs in JSON only inside strings, where its escape means the same.) NaN and infinities become `null`.
fn embedded(payload: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string(payload)?.replace('<', "\\u003c"))
}
