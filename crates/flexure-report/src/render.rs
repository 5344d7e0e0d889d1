//! Putting the page together.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, context};

use crate::data::Page;
use crate::payload::{Payload, payload};
use crate::text::text;
use crate::{Result, check};

const TEMPLATE: &str = include_str!("../assets/page.html");

const STYLES: [&str; 3] = [
    include_str!("../assets/vendor/uplot/uPlot.min.css"),
    include_str!("../assets/page.css"),
    include_str!("../assets/print.css"),
];

const UPLOT: &str = include_str!("../assets/vendor/uplot/uPlot.iife.min.js");

/// The page's scripts in the order in which they build on one another; they share one function scope.
const SCRIPTS: [&str; 10] = [
    include_str!("../assets/format.js"),
    include_str!("../assets/theme.js"),
    include_str!("../assets/chart.js"),
    include_str!("../assets/group.js"),
    include_str!("../assets/curves.js"),
    include_str!("../assets/linear.js"),
    include_str!("../assets/signals.js"),
    include_str!("../assets/arm-view.js"),
    include_str!("../assets/arm.js"),
    include_str!("../assets/main.js"),
];

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
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_template("page", TEMPLATE)?;
    let words = environment.get_template("page")?.render(context! {
        page => Value::from(Serde(text(page, &payload))),
        style => STYLES.concat(),
        script => format!("{UPLOT}\n(() => {{\n\"use strict\";\n{}}})();\n", SCRIPTS.concat()),
        data => embedded(&payload)?,
    })?;
    Ok(words)
}

/// JSON that can stand inside a `<script>` element: no `<` means no end tag and no comment can begin in it.
/// (`<` occurs in JSON only inside strings, where its escape means the same.) NaN and infinities become `null`.
fn embedded(payload: &Payload<'_>) -> Result<String> {
    Ok(serde_json::to_string(payload)?.replace('<', "\\u003c"))
}
