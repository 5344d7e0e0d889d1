//! An identified system as text for a terminal.

use flexure::identify::result::{BlockKind, LinearBlock, NamedBlock, Path, Place};
use flexure::linear::Complex;
use flexure::nonlinearity::Surface;
use flexure::text::{capitalised, number};

use super::comparison;
use super::periods::Periodic;
use super::task::Identified;

impl Identified {
    /// The text that `flexure identify` prints.
    pub fn summary(&self) -> String {
        let result = &self.result;
        let mut lines = Vec::new();
        let inputs: Vec<String> = result.inputs.iter().map(|i| format!("'{i}'")).collect();
        let columns = format!("from {} to '{}'", inputs.join(", "), result.output);
        if let Some(comparison) = &result.comparison {
            lines.extend(comparison::lines(comparison, &columns));
        }
        lines.push(format!(
            "{} model {columns}, method {}",
            capitalised(result.structure.title),
            result.method
        ));
        lines.push(format!("  {}", result.description));
        let measures = &result.verdict.measures;
        lines.push(format!(
            "  fit on fresh data   {:.2} %  (RMS error {}, {} samples)",
            measures.fit_percent,
            number(measures.rms),
            measures.samples
        ));
        for (i, path) in result.paths.iter().enumerate() {
            if result.is_sum {
                lines.push(format!("  {}", result.path_title(i)));
            }
            lines.extend(path.blocks.iter().flat_map(|block| block_lines(block, path)));
        }
        if result.output_offset != 0.0 {
            lines.push(line("output offset", &number(result.output_offset)));
        }
        if !result.tried.is_empty() {
            lines.push(line("structures tried", &result.tried.len().to_string()));
        }
        for shown in result.details.iter().filter_map(|d| d.shown.as_ref()) {
            match shown.place {
                Place::Choice => {}
                Place::Fact => lines.push(line(&uncapitalised(&shown.title), &shown.text)),
                Place::ChoiceAndText => {
                    lines.push(line(&uncapitalised(&shown.title), &shown.text));
                    lines.push(format!("    {}", shown.note));
                }
            }
        }
        lines.push(format!("  {}", result.verdict.text()));
        lines.extend(result.warnings.iter().map(|w| format!("  warning: {w}")));
        lines.extend(self.periodic.iter().flat_map(Periodic::lines));
        lines.join("\n")
    }
}

/// A name and a value.
fn line(name: &str, value: &str) -> String {
    format!("  {name:<19} {value}")
}

fn uncapitalised(title: &str) -> String {
    let mut letters = title.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

fn block_lines(block: &NamedBlock, path: &Path) -> Vec<String> {
    let title = uncapitalised(block.title);
    match &block.kind {
        BlockKind::Static(own) => vec![line(&title, &own.description)],
        BlockKind::Linear(own) => linear_lines(&title, own),
        BlockKind::Surface(surface) => surface_lines(&title, surface, &path.inputs),
        // Their details say what there is to say.
        BlockKind::Narx(_) | BlockKind::Volterra(_) => Vec::new(),
    }
}

/// Order, delay and static gain.
pub fn linear_text(block: &LinearBlock) -> String {
    let gain = number(block.system.static_gain());
    format!("order {}, delay {}, static gain {gain}", block.order(), block.delay())
}

/// The longest delay whose zeros are printed among the coefficients of the numerator.
const MOST_LEADING_ZEROS: usize = 3;

/// A linear part with its coefficients, poles and zeros.
fn linear_lines(title: &str, block: &LinearBlock) -> Vec<String> {
    let (system, errors) = (&block.system, block.errors.as_ref());
    vec![
        line(title, &linear_text(block)),
        format!("    b = {}", numerator(block)),
        format!("    a = {}", coefficients(system.a(), errors.map(|e| &*e.a))),
        format!("    poles {}", roots(system.poles())),
        format!("    zeros {}", roots(system.zeros())),
    ]
}

fn surface_lines(title: &str, surface: &Surface, inputs: &[String]) -> Vec<String> {
    let pieces: Vec<String> = surface.axes().iter().map(|a| a.pieces.to_string()).collect();
    let text = format!("cubic spline surface of {} pieces", pieces.join(" by "));
    let axes = inputs.iter().zip(surface.axes());
    let each = axes.map(|(name, axis)| format!("    '{name}' on [{}, {}]", number(axis.low), number(axis.high)));
    std::iter::once(line(title, &text)).chain(each).collect()
}

/// The numerator's coefficients; a long delay is said instead of listed as zeros.
fn numerator(block: &LinearBlock) -> String {
    let b = block.system.b();
    // A numerator of nothing but zeros keeps one.
    let delay = block.delay().min(b.len() - 1);
    let skipped = if delay > MOST_LEADING_ZEROS { delay } else { 0 };
    let errors = block.errors.as_ref().and_then(|e| e.b.get(skipped..));
    let list = coefficients(&b[skipped..], errors);
    match skipped {
        0 => list,
        _ => format!("{list}, delay {skipped} samples"),
    }
}

/// Coefficients in brackets, each with its standard error where there is one.
fn coefficients(c: &[f64], errors: Option<&[f64]>) -> String {
    let list = c.iter().enumerate().map(|(i, &v)| {
        let error = errors.and_then(|e| e.get(i).copied());
        match error.filter(|e| *e > 0.0 && e.is_finite()) {
            Some(error) => format!("{} ± {}", number(v), number(error)),
            None => number(v),
        }
    });
    format!("[{}]", list.collect::<Vec<_>>().join(", "))
}

/// Roots for reading, a conjugate pair once.
fn roots(list: Option<Vec<Complex<f64>>>) -> String {
    let Some(list) = list else {
        return "not found".to_owned();
    };
    let each = list.iter().filter(|z| z.im >= 0.0).map(|z| match z.im {
        im if im > 0.0 => format!("{} ± {}i", number(z.re), number(im)),
        _ => number(z.re),
    });
    let each: Vec<String> = each.collect();
    match each.is_empty() {
        true => "none".to_owned(),
        false => each.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexure::identify::result::CoefficientErrors;
    use flexure::linear::TransferFunction;

    #[test]
    fn a_long_delay_is_said_not_listed() {
        let text = |delay: usize| {
            let b = [vec![0.0; delay], vec![0.5, 0.25]].concat();
            let errors = Some(CoefficientErrors {
                b: [vec![0.0; delay], vec![0.0, 0.1]].concat(),
                a: vec![0.0],
            });
            let system = TransferFunction::new(b, vec![1.0]).unwrap();
            numerator(&LinearBlock {
                system,
                errors,
                impulse: None,
            })
        };
        assert_eq!(text(0), "[0.5000, 0.2500 ± 0.1000]");
        assert_eq!(text(2), "[0, 0, 0.5000, 0.2500 ± 0.1000]");
        assert_eq!(text(305), "[0.5000, 0.2500 ± 0.1000], delay 305 samples");
        let zero = LinearBlock {
            system: TransferFunction::new(vec![0.0; 9], vec![1.0]).unwrap(),
            errors: None,
            impulse: None,
        };
        assert_eq!(numerator(&zero), "[0], delay 8 samples");
    }

    #[test]
    fn roots_of_a_pair_stand_once() {
        let z = |re, im| Complex::new(re, im);
        assert_eq!(roots(None), "not found");
        assert_eq!(roots(Some(Vec::new())), "none");
        let list = vec![z(0.5, 0.25), z(0.5, -0.25), z(-2.0, 0.0)];
        assert_eq!(roots(Some(list)), "0.5000 ± 0.2500i, -2.000");
    }
}
