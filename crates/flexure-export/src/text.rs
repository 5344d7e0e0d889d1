//! The formats that are text: C, Python and MATLAB, each from its template.

use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, Value, context};

use crate::error::Result;
use crate::program::Program;
use crate::{Described, view};

/// The templates by their names.
const TEMPLATES: [(&str, &str); 12] = [
    ("c", include_str!("templates/model.c")),
    ("arm.c", include_str!("templates/arm.c")),
    ("arm.h", include_str!("templates/arm.h")),
    ("h", include_str!("templates/model.h")),
    ("py", include_str!("templates/model.py")),
    ("m", include_str!("templates/model.m")),
    ("fmi2.xml", include_str!("templates/fmi2.xml")),
    ("fmi3.xml", include_str!("templates/fmi3.xml")),
    ("build.xml", include_str!("templates/build.xml")),
    ("fmi_body.c", include_str!("templates/fmi_body.c")),
    ("fmi2.c", include_str!("templates/fmi2.c")),
    ("fmi3.c", include_str!("templates/fmi3.c")),
];

/// The text that a template makes of a model.
pub fn text(template: &str, program: &Program<'_>, described: &Described<'_>, more: Value) -> Result<String> {
    let own = context! {
        name => described.name,
        about => &described.about,
        sample_time => described.model.sample_time.map(|h| format!("{h:?}")),
        inputs => program.inputs,
        output => program.output,
        steps => view::steps(program),
    };
    rendered(template, context! { ..more, ..own })
}

/// The text that a template makes of these values.
pub fn rendered(template: &str, values: Value) -> Result<String> {
    let mut environment = Environment::new();
    let syntax = SyntaxConfig::builder()
        .trim_blocks(true)
        .lstrip_blocks(true)
        .keep_trailing_newline(true)
        .build()?;
    environment.set_syntax(syntax);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    Ok(environment.get_template(template)?.render(values)?)
}
