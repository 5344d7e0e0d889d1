//! The text of the page, as its template reads it.

use serde::Serialize;

use crate::data::{
    ArmMotion, Choice, Fact, LinearPart, Page, Residuals, ScoreCurve, Table, Test, TestOutcome, Verdict,
};
use crate::diagram::{DiagramText, diagram};
use crate::limits;
use crate::payload::Payload;

/// A sum smaller than this share of its terms is a rounding error.
const ROUNDING: f64 = 1e-9;

/// What the template shows as text, and which parts exist at all.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    verdict: &'a Verdict,
    facts: &'a [Fact],
    diagram: Option<DiagramText>,
    warnings: &'a [String],
    tests: Vec<TestRow<'a>>,
    choices: Vec<ChoiceText<'a>>,
    nonlinearity: Option<NonlinearityText<'a>>,
    surface: Option<SurfaceText<'a>>,
    curves: Vec<&'a str>,
    approximation: Option<ApproximationText<'a>>,
    linear: Vec<LinearText<'a>>,
    candidates: Vec<&'a Table>,
    prediction: Option<PredictionText<'a>>,
    residuals: ResidualText,
    record: Option<RecordText>,
    arm: Option<ArmText>,
    command: Option<&'a str>,
    python: Option<&'a str>,
    version: &'static str,
}

#[derive(Serialize)]
struct TestRow<'a> {
    name: &'a str,
    statistic: String,
    limit: String,
    p_value: String,
    outcome: TestOutcome,
    text: &'a str,
}

#[derive(Serialize)]
pub(crate) struct ChoiceText<'a> {
    /// Its index among all choices, used in the name of its plot.
    index: usize,
    name: &'a str,
    value: &'a str,
    why: &'a str,
    curve: bool,
}

#[derive(Serialize)]
struct NonlinearityText<'a> {
    points: bool,
    band: Option<&'a str>,
    density: bool,
    truth: Option<&'a str>,
}

#[derive(Serialize)]
struct SurfaceText<'a> {
    title: &'a str,
    text: &'a str,
}

#[derive(Serialize)]
struct ApproximationText<'a> {
    text: &'a str,
    levels: bool,
}

#[derive(Serialize)]
struct LinearText<'a> {
    title: &'a str,
    text: &'a str,
    /// Its index among all linear parts, used in the names of its plots.
    index: usize,
    any: bool,
    impulse: bool,
    estimate: bool,
    limits: bool,
    bode: bool,
    roots: bool,
    /// Whether bands and regions of confidence are drawn.
    confidence: bool,
    /// The static gain, where it is finite.
    gain: Option<String>,
    equation: Option<[String; 2]>,
}

#[derive(Serialize)]
struct PredictionText<'a> {
    fit: String,
    rms: String,
    unit: Option<&'a str>,
    samples: String,
    bucket: usize,
}

#[derive(Serialize)]
struct ResidualText {
    any: bool,
    auto: bool,
    cross: bool,
}

#[derive(Serialize)]
struct RecordText {
    samples: String,
    signals: usize,
    fresh: Option<String>,
    bucket: usize,
}

#[derive(Serialize)]
pub(crate) struct ArmText {
    caption: String,
    motors: bool,
    torques: bool,
    cut: bool,
    samples: String,
}

/// The page's text; `payload` says which plots there will be.
pub(crate) fn text<'a>(page: &'a Page, payload: &Payload<'_>) -> Text<'a> {
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        verdict: &page.verdict,
        facts: &page.facts,
        diagram: page.diagram.as_ref().map(diagram),
        warnings: &page.warnings,
        tests: page.residuals.tests.iter().map(row).collect(),
        choices: choices(&page.choices, &payload.scores),
        nonlinearity: payload
            .nonlinearity
            .as_ref()
            .map(|plot| nonlinearity(page, plot.points)),
        surface: payload
            .surface
            .as_ref()
            .zip(page.surface.as_ref())
            .map(|(_, s)| SurfaceText {
                title: &s.title,
                text: &s.text,
            }),
        curves: page.curves.iter().map(|c| c.title.as_str()).collect(),
        approximation: payload
            .approximation
            .as_ref()
            .zip(page.approximation.as_ref())
            .map(|(_, a)| ApproximationText {
                text: &a.text,
                levels: !(a.total_db.is_empty() && a.noise_db.is_empty()),
            }),
        linear: (page.linear.iter().enumerate().map(linear))
            .filter(|part| part.any)
            .collect(),
        candidates: (page.candidates.iter())
            .filter(|table| !table.rows.is_empty())
            .collect(),
        prediction: payload.prediction.as_ref().map(|plot| PredictionText {
            fit: number(page.prediction.fit_percent, 4),
            rms: number(page.prediction.rms, 4),
            unit: unit(&page.prediction.y_label),
            samples: page
                .prediction
                .measured
                .iter()
                .filter(|y| y.is_finite())
                .count()
                .to_string(),
            bucket: plot.time.bucket,
        }),
        residuals: residuals(&page.residuals),
        record: payload.record.as_ref().map(|plot| record(page, plot.time.bucket)),
        arm: payload
            .arm
            .as_ref()
            .zip(page.arm.as_ref())
            .map(|(_, motion)| arm(motion)),
        command: page.command.as_deref(),
        python: page.python.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}

fn residuals(residuals: &Residuals) -> ResidualText {
    let (auto, cross) = (
        residuals.autocorrelation.len() > 1,
        !residuals.cross_correlation.is_empty(),
    );
    ResidualText {
        any: auto || cross || !residuals.tests.is_empty(),
        auto,
        cross,
    }
}

fn record(page: &Page, bucket: usize) -> RecordText {
    let samples = page.record[0].values.len();
    RecordText {
        samples: samples.to_string(),
        signals: page.record.len(),
        fresh: (page.fresh_from > 0 && page.fresh_from < samples).then(|| page.fresh_from.to_string()),
        bucket,
    }
}

/// The text about a motion.
pub(crate) fn arm(arm: &ArmMotion) -> ArmText {
    ArmText {
        caption: arm.caption.clone(),
        motors: arm.qm.iter().any(|q| !q.is_empty()),
        torques: arm.tau.iter().any(|t| !t.is_empty()),
        cut: arm.q[0].len() > limits::ARM_SAMPLES,
        samples: arm.q[0].len().to_string(),
    }
}

fn row(test: &Test) -> TestRow<'_> {
    TestRow {
        name: &test.name,
        statistic: number(test.statistic, 4),
        limit: number(test.limit, 4),
        p_value: p_value(test.p_value),
        outcome: test.outcome,
        text: &test.text,
    }
}

/// What was chosen, and which choices have a curve among `scores`.
pub(crate) fn choices<'a>(choices: &'a [Choice], scores: &[Option<ScoreCurve>]) -> Vec<ChoiceText<'a>> {
    let chosen = |(index, (choice, score)): (usize, (&'a Choice, &Option<ScoreCurve>))| ChoiceText {
        index,
        name: &choice.name,
        value: &choice.value,
        why: &choice.why,
        curve: score.is_some(),
    };
    choices.iter().zip(scores).enumerate().map(chosen).collect()
}

fn nonlinearity(page: &Page, points: bool) -> NonlinearityText<'_> {
    let n = &page.nonlinearity;
    NonlinearityText {
        points,
        band: (!n.lower.is_empty()).then_some(n.band_label.as_str()),
        density: !points && !n.density.is_empty(),
        truth: (!n.truth.is_empty()).then_some(n.truth_label.as_str()),
    }
}

fn linear((index, l): (usize, &LinearPart)) -> LinearText<'_> {
    let (impulse, bode) = (
        l.impulse.len() + l.impulse_estimate.len() > 0,
        l.frequency.iter().any(|&f| f > 0.0),
    );
    let roots = l.poles.len() + l.zeros.len() > 0;
    let equation = (!l.b.is_empty() && !l.a.is_empty()).then(|| [polynomial(&l.b), polynomial(&l.a)]);
    LinearText {
        title: &l.title,
        text: &l.text,
        index,
        any: impulse || bode || roots || equation.is_some(),
        impulse,
        estimate: !l.impulse_estimate.is_empty(),
        limits: !l.impulse_estimate.is_empty() && l.impulse_limit > 0.0,
        bode,
        roots,
        confidence: !l.magnitude_error.is_empty(),
        gain: static_gain(l),
        equation,
    }
}

/// The static gain of a transfer function; `None` if an integrator makes it infinite.
fn static_gain(l: &LinearPart) -> Option<String> {
    let (sum, size) = (l.a.iter().sum::<f64>(), l.a.iter().map(|a| a.abs()).sum::<f64>());
    let is_finite = sum.abs() > ROUNDING * size;
    (is_finite && !l.b.is_empty()).then(|| number(l.b.iter().sum::<f64>() / sum, 4))
}

/// The unit in parentheses at the end of an axis's label.
fn unit(label: &str) -> Option<&str> {
    name_and_unit(label).1
}

/// An axis's label without the unit in parentheses at its end, and the unit.
pub(crate) fn name_and_unit(label: &str) -> (&str, Option<&str>) {
    match label.strip_suffix(')').and_then(|label| label.rsplit_once(" (")) {
        Some((name, unit)) if !unit.is_empty() => (name, Some(unit)),
        _ => (label, None),
    }
}

/// `c0 + c1 z^-1 + ...` with typographic signs and exponents, without the terms that are 0.
fn polynomial(c: &[f64]) -> String {
    let mut text = String::new();
    for (k, &v) in c.iter().enumerate().filter(|(_, v)| **v != 0.0) {
        let size = number(v.abs(), 5);
        match (text.is_empty(), v < 0.0) {
            (true, true) => text.push('−'),
            (true, false) => {}
            (false, true) => text.push_str(" − "),
            (false, false) => text.push_str(" + "),
        }
        text.push_str(&size);
        if k > 0 {
            text.push_str("\u{202f}z⁻");
            text.extend(k.to_string().chars().map(superscript));
        }
    }
    if text.is_empty() { "0".into() } else { text }
}

fn superscript(digit: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digit.to_digit(10).map_or(digit, |d| DIGITS[d as usize])
}

/// A number for reading, with a typographic minus; a dash if it is not finite.
pub(crate) fn number(v: f64, digits: usize) -> String {
    if !v.is_finite() {
        return "–".into();
    }
    let rounded: f64 = format!("{v:.*e}", digits.saturating_sub(1)).parse().unwrap_or(v);
    let size = rounded.abs();
    let text = if size == 0.0 || (1e-3..1e6).contains(&size) {
        rounded.to_string()
    } else {
        let scientific = format!("{rounded:e}");
        let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
        let exponent: String = exponent
            .chars()
            .map(|c| if c == '-' { '⁻' } else { superscript(c) })
            .collect();
        format!("{mantissa}·10{exponent}")
    };
    text.replace('-', "−")
}

/// A p-value for reading: two digits, and not below 1e-6, since no distribution is known so exactly.
fn p_value(p: f64) -> String {
    match p {
        p if !p.is_finite() => "–".into(),
        p if p < 1e-6 => "< 10⁻⁶".into(),
        p if p < 1e-3 => number(p, 1),
        p => number(p, 2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(0.0, 4), "0");
        assert_eq!(number(97.345_6, 4), "97.35");
        assert_eq!(number(-0.25, 4), "−0.25");
        assert_eq!(number(1.23456e-7, 4), "1.235·10⁻⁷");
        assert_eq!(number(-2e12, 4), "−2·10¹²");
        assert_eq!(number(999_999.9, 4), "1·10⁶");
        assert_eq!(number(f64::NAN, 4), "–");
        assert_eq!(number(f64::NEG_INFINITY, 4), "–");
    }

    #[test]
    fn units_stand_in_parentheses_at_the_end() {
        assert_eq!(unit("elbow rate (rad/s)"), Some("rad/s"));
        assert_eq!(unit("q (left) (rad)"), Some("rad"));
        for label in ["y", "y ()", "f(x)", "(m) y"] {
            assert_eq!(unit(label), None, "{label}");
        }
    }

    #[test]
    fn p_values_do_not_pretend() {
        assert_eq!(p_value(0.0), "< 10⁻⁶");
        assert_eq!(p_value(0.000_034), "3·10⁻⁵");
        assert_eq!(p_value(0.123_4), "0.12");
        assert_eq!(p_value(f64::NAN), "–");
    }

    #[test]
    fn polynomials_carry_signs_and_exponents() {
        assert_eq!(polynomial(&[1.0, -1.5, 0.25]), "1 − 1.5\u{202f}z⁻¹ + 0.25\u{202f}z⁻²");
        assert_eq!(polynomial(&[-2.0]), "−2");
        assert_eq!(polynomial(&[0.0, 0.0, -3.0]), "−3\u{202f}z⁻²");
        assert_eq!(polynomial(&[0.0]), "0");
        assert!(polynomial(&[1.0; 13]).ends_with("z⁻¹²"));
    }
}
