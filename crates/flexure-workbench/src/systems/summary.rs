//! An identified system as text: the result first, then its meaning, then the blocks.

use flexure::identify::result::{
    BlockKind, CoefficientErrors, FeedbackBlock, LinearBlock, LoopPart, NamedBlock, Path, Place, StaticBlock,
};
use flexure::identify::{Verdict, Warning};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::Surface;
use flexure::text::{capitalised, decimal, fit, joined, number, uncapitalised, with_error};

use super::comparison;
use super::poles::{NONE, poles_text, roots_text};
use super::task::Identified;
use crate::lines::{Lines, Tone, unbroken};

impl Identified {
    /// The text that `flexure identify` prints.
    pub fn summary(&self) -> Lines {
        let result = &self.result;
        let mut lines = Lines::new();
        let inputs: Vec<String> = result.inputs.iter().map(|i| format!("'{i}'")).collect();
        let columns = format!("from {} to '{}'", inputs.join(", "), result.output);
        if let Some(comparison) = &result.comparison {
            comparison::write(comparison, &columns, &mut lines);
        }
        let verdict = &result.verdict;
        lines.headline(
            tone(verdict),
            format!(
                "{} model {columns}: fit {} on fresh data, {}",
                capitalised(result.structure.title),
                fit(verdict.measures.fit_percent, 2),
                verdict.in_short()
            ),
        );
        // A fundamental warning says why the model cannot hold.
        let (above, below): (Vec<_>, Vec<_>) = (result.warnings.iter()).partition(|w| is_fundamental(w));
        above.into_iter().for_each(|warning| lines.warning(warning));
        lines.sentence(verdict.text());
        lines.item("structure", format!("{}, method {}", result.description, result.method));
        lines.item(
            "RMS error",
            format!(
                "{} over {} fresh samples",
                with_unit(number(verdict.measures.rms), self.labels.unit(&result.output)),
                verdict.measures.samples
            ),
        );
        if let Some(fitted) = self.in_parts {
            lines.item("samples", fitted.text());
        }
        for (i, path) in result.paths.iter().enumerate() {
            if result.is_sum {
                lines.sentence(capitalised(&result.path_title(i)));
            }
            for block in &path.blocks {
                self.write_block(block, path, &mut lines);
            }
        }
        if result.output_offset != 0.0 {
            lines.item("output offset", number(result.output_offset));
        }
        if !result.tried.is_empty() {
            lines.item("structures tried", result.tried.len().to_string());
        }
        for shown in result.details.iter().filter_map(|d| d.shown.as_ref()) {
            let title = uncapitalised(&shown.title);
            let text = match shown.place {
                Place::Choice | Place::PageFact => continue,
                Place::Fact => shown.text.clone(),
                Place::ChoiceAndText => format!("{}; {}", shown.text, shown.note),
            };
            lines.item(&title, self.in_unit(text));
        }
        if let Some(periodic) = &self.periodic {
            periodic.write(&mut lines);
        }
        below.into_iter().for_each(|warning| lines.warning(warning));
        lines
    }

    /// A text with the output's unit, if that is known, in place of the words for it.
    pub(super) fn in_unit(&self, text: String) -> String {
        match self.labels.unit(&self.result.output) {
            "" => text,
            unit => text.replace("in the output's unit", unit),
        }
    }

    fn write_linear(&self, title: &str, own: &LinearBlock, lines: &mut Lines) {
        lines.item(title, linear_text(own, self.sample_time));
        lines.deeper(|lines| {
            let listed = coefficients(own);
            let errors = if listed.contains('±') {
                "; ± one standard error"
            } else {
                ""
            };
            lines.item("coefficients", listed + errors);
            let poles = poles_text(own, self.sample_time);
            for (name, text) in [("poles", poles), ("zeros", roots_text(own.system.zeros()))] {
                if text != NONE {
                    lines.item(name, text);
                }
            }
        });
    }

    /// A loop: what it does as a whole, then its linear part, whose ways have one denominator.
    fn write_loop(&self, title: &str, own: &FeedbackBlock, lines: &mut Lines) {
        lines.item(title, &*own.nonlinearity.description);
        for part in own.whole() {
            let dynamics = linear_text(&part.block, self.sample_time);
            lines.item(&uncapitalised(part.title), format!("{dynamics} ({})", part.meaning));
            lines.deeper(|lines| lines.item("poles", poles_text(&part.block, self.sample_time)));
        }
        let parts = own.linear_parts();
        let Some(first) = parts.first() else { return };
        let system = &first.block.system;
        lines.item(
            "linear part alone",
            format!(
                "order {}; the nonlinearity feeds back around it, so it may be unstable or integrate",
                first.block.order()
            ),
        );
        lines.deeper(|lines| {
            let poles = poles_text(&first.block, self.sample_time);
            if poles != NONE {
                lines.item("poles", poles);
            }
            lines.item("denominator", listed('a', system.a(), None, 1));
            for (i, part) in parts.iter().enumerate() {
                let numerator = match parts[..i].iter().find(|p| p.block.system == part.block.system) {
                    Some(same) => format!("the same as {}", way(same)),
                    None => listed('b', part.block.system.b(), None, 0),
                };
                lines.item(&way(part), format!("{numerator} ({})", part.meaning));
            }
        });
    }

    /// The outputs at the kinks of the last nonlinearity, such as the limits of a sensor; empty without kinks.
    fn output_at_kinks(&self, block: &StaticBlock) -> String {
        let unit = self.labels.unit(&self.result.output);
        let offset = self.result.output_offset;
        let kinks = block.clear_kinks();
        let values: Vec<String> = kinks.iter().map(|at| number(block.curve.value(*at) + offset)).collect();
        match values.is_empty() {
            true => String::new(),
            false => format!("; the output at the kinks is {}", with_unit(joined(&values), unit)),
        }
    }

    fn write_block(&self, block: &NamedBlock, path: &Path, lines: &mut Lines) {
        let title = uncapitalised(&block.title);
        match &block.kind {
            BlockKind::Static(own) => {
                let is_first = path.blocks.first().is_some_and(|first| std::ptr::eq(first, block));
                let unit = (is_first && path.inputs.len() == 1).then(|| self.labels.unit(&path.inputs[0]));
                let unit = unit.filter(|unit| !unit.is_empty());
                let unit = unit.map_or(String::new(), |unit| format!("; input in {unit}"));
                let is_last = path.blocks.last().is_some_and(|last| std::ptr::eq(last, block));
                let there = if is_last && !is_first {
                    self.output_at_kinks(own)
                } else {
                    String::new()
                };
                lines.item(&title, format!("{}{there}{unit}", own.description));
            }
            BlockKind::Feedback(own) => self.write_loop(&title, own, lines),
            BlockKind::Linear(own) => self.write_linear(&title, own, lines),
            BlockKind::Surface(surface) => write_surface(&title, surface, &path.inputs, lines),
            // The details already describe these blocks.
            BlockKind::Narx(_) | BlockKind::Volterra(_) => {}
        }
    }
}

/// Whether a warning says why no block model can hold; it stands before all others.
pub fn is_fundamental(warning: &Warning) -> bool {
    matches!(warning, Warning::IntegratedOutput { .. })
}

/// The colour of a verdict.
pub fn tone(verdict: &Verdict) -> Tone {
    match (verdict.holds(), verdict.measures.fit_percent > 0.0) {
        (true, _) => Tone::Good,
        (false, true) => Tone::Caution,
        (false, false) => Tone::Bad,
    }
}

/// A way through the linear part of a loop: "input to output".
pub fn way(part: &LoopPart) -> String {
    part.title.trim_start_matches("Linear part, ").to_owned()
}

/// A denominator that is smaller than this at zero frequency, relative to its coefficients, has a pole at 1.
const ROUNDING: f64 = 1e-9;

/// A number with its unit, where that is known.
pub fn with_unit(number: String, unit: &str) -> String {
    match unit {
        "" => number,
        unit => format!("{number} {unit}"),
    }
}

/// Order, delay and static gain.
pub fn linear_text(block: &LinearBlock, sample_time: Option<f64>) -> String {
    let a = block.system.a();
    let size: f64 = a.iter().map(|a| a.abs()).sum();
    let gain = match a.iter().sum::<f64>().abs() > ROUNDING * size {
        true => format!("static gain {}", number(block.system.static_gain())),
        false => "no static gain, as it integrates".to_owned(),
    };
    let in_seconds = sample_time.map_or(String::new(), |step| {
        let seconds = |samples: usize| decimal(samples as f64 * step);
        match block.delay() {
            0 => String::new(),
            1 => format!(" ({} s)", seconds(1)),
            // A response that begins slowly is seen late, and a held input is seen a step late.
            delay => format!(" (dead time at most {} s)", seconds(delay)),
        }
    });
    format!("order {}, delay {}{in_seconds}, {gain}", block.order(), block.delay())
}

/// The coefficients that are not zero, each with its standard error where there is one: `b_k` weights the input of k samples ago,
/// `-a_k` the output.
fn coefficients(block: &LinearBlock) -> String {
    let system = &block.system;
    let (errors, remark) = match &block.errors {
        Some(errors) if !determined(system, errors) => (
            None,
            "; the data determine the response, not each coefficient (a pole and a zero may cancel)",
        ),
        Some(errors) => (Some(errors), ""),
        None => (None, "; standard errors are not estimated here"),
    };
    let b = listed('b', system.b(), errors.map(|e| &*e.b), 0);
    // The first one is 1.
    let a = listed('a', system.a(), errors.map(|e| &*e.a), 1);
    match (b.is_empty(), a.is_empty()) {
        (true, true) => "all zero".to_owned(),
        (false, false) => format!("{b}, {a}{remark}"),
        _ => format!("{b}{a}{remark}"),
    }
}

/// The coefficients of this name that are not zero, from the one of the index `from` on.
fn listed(name: char, values: &[f64], errors: Option<&[f64]>, from: usize) -> String {
    let each = values.iter().enumerate().skip(from).filter(|(_, c)| **c != 0.0);
    let each = each.map(|(k, c)| {
        let error = errors.and_then(|e| e.get(k).copied()).unwrap_or(0.0);
        unbroken(&format!("{name}{k} = {}", with_error(*c, error)))
    });
    each.collect::<Vec<String>>().join(", ")
}

/// Whether no coefficient has a standard error above the largest one. Else errors of what follows from the coefficients mean nothing either.
pub fn determined(system: &TransferFunction, errors: &CoefficientErrors) -> bool {
    let largest = |v: &[f64]| v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    largest(&errors.b) <= largest(system.b()) && largest(&errors.a) <= largest(system.a())
}

fn write_surface(title: &str, surface: &Surface, inputs: &[String], lines: &mut Lines) {
    let pieces: Vec<String> = surface.axes().iter().map(|a| a.pieces.to_string()).collect();
    let axes = inputs.iter().zip(surface.axes());
    let each = axes.map(|(name, axis)| format!("'{name}' on [{}, {}]", number(axis.low), number(axis.high)));
    let each: Vec<String> = each.collect();
    lines.item(
        title,
        format!(
            "cubic spline surface of {} pieces, {}",
            pieces.join(" by "),
            each.join(", ")
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_of_zero_are_left_out() {
        let text = |b: Vec<f64>, a: Vec<f64>, errors| {
            let block = LinearBlock {
                system: TransferFunction::new(b, a).unwrap(),
                errors,
                impulse: None,
            };
            coefficients(&block).replace('\u{a0}', " ")
        };
        let b = [vec![0.0; 305], vec![0.5, 0.25]].concat();
        let errors = Some(CoefficientErrors {
            b: [vec![0.0; 306], vec![0.012]].concat(),
            a: vec![0.0, 0.0003],
            covariance: Vec::new(),
        });
        assert_eq!(
            text(b, vec![1.0, -0.9], errors),
            "b305 = 0.5000, b306 = 0.250 ± 0.012, a1 = -0.90000 ± 0.00030"
        );
        assert_eq!(text(vec![0.0; 9], vec![1.0], None), "all zero");
    }

    /// The standard errors of a cancelling pole and zero are useless to a reader.
    #[test]
    fn coefficients_that_the_data_do_not_determine_say_so() {
        let text = |error: f64| {
            let errors = CoefficientErrors {
                b: vec![0.0, 0.01, 0.02],
                a: vec![0.0, error, 0.1],
                covariance: Vec::new(),
            };
            let block = LinearBlock {
                system: TransferFunction::new(vec![0.0, 0.5, 0.1], vec![1.0, -1.3, 0.4]).unwrap(),
                errors: Some(errors),
                impulse: None,
            };
            coefficients(&block).replace('\u{a0}', " ")
        };
        assert!(
            text(1.2).contains("a1 = -1.3 ± 1.2") && !text(1.2).contains("determine"),
            "{}",
            text(1.2)
        );
        assert!(
            text(1771.0)
                .starts_with("b1 = 0.5000, b2 = 0.1000, a1 = -1.300, a2 = 0.4000; the data determine the response")
        );
    }
}
