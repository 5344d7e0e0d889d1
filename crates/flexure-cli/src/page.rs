//! An identification as the page that shows it.

use flexure::Record;
use flexure_io::RecordFile;
use flexure_report::data::{
    ArmMotion, Axis, Fact, LinearPart, Nonlinearity, Page, Prediction, Residuals, Signal, Test, Verdict,
};

use anyhow::Result;

use crate::choices::{choices, given_or};
use crate::estimate::{Estimate, Own};
use crate::outcome::{Context, SETTLED, number};
use crate::tuning;

/// Frequencies of the Bode plot.
const FREQUENCIES: usize = 400;
/// Decades below the highest frequency that the Bode plot covers.
const DECADES: f64 = 3.0;
/// At least so many values of the impulse response are shown.
const SHORTEST_IMPULSE: usize = 20;
/// At most so many are shown of one that is not settled before, where none was estimated.
const LONGEST_IMPULSE: usize = 300;

/// What the caller knows beyond the record and the result.
#[derive(Default)]
pub struct Decoration {
    /// The heading.
    pub title: Option<String>,
    /// The command line that makes the page again.
    pub command: Option<String>,
    /// The true nonlinearity of simulated data.
    pub truth: Option<Truth>,
    /// A sentence that follows the verdict.
    pub remark: Option<String>,
    /// The moving arm.
    pub arm: Option<ArmMotion>,
}

/// The true nonlinearity, and what it is.
pub struct Truth {
    /// phi.
    pub phi: Box<dyn Fn(f64) -> f64>,
    /// What it is, and how it was laid onto the estimate.
    pub label: String,
}

/// Fills in the page.
pub fn page(file: &RecordFile, context: &Context, result: &Estimate, decoration: Decoration) -> Result<Page> {
    let record = &file.record;
    // The output may have samples that are missing.
    let (u, y) = (record.finite(context.input)?, record.column(context.output)?);
    let name = file
        .path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let time = time_axis(context.sample_time, 0);
    let signal = |column: &str, values: &[f64]| Signal {
        name: column.to_owned(),
        unit: unit_of(column).to_owned(),
        values: values.to_vec(),
    };
    Ok(Page {
        title: decoration
            .title
            .unwrap_or_else(|| format!("From {} to {}", context.input, context.output)),
        subtitle: format!(
            "A Hammerstein model (a static nonlinearity, then linear dynamics) identified from {} samples of {name}; judged on the {} that follow.",
            result.fitted,
            u.len() - result.fitted
        ),
        verdict: Verdict {
            headline: result.verdict.headline().to_owned(),
            holds: result.verdict.holds(),
            words: [result.verdict.words()]
                .into_iter()
                .chain(decoration.remark)
                .collect::<Vec<_>>()
                .join(" "),
        },
        facts: facts(context, result),
        record: vec![signal(context.input, u), signal(context.output, y)],
        fresh_from: result.fitted,
        nonlinearity: nonlinearity(u, context, result, decoration.truth),
        linear: linear(context, result),
        prediction: Prediction {
            y_label: labelled(context.output),
            time: time_axis(context.sample_time, result.fitted),
            measured: y[result.fitted..].to_vec(),
            predicted: result.predicted[result.fitted..].to_vec(),
            fit_percent: result.verdict.measures.fit_percent,
            rms: result.verdict.measures.rms,
        },
        residuals: residuals(result),
        choices: choices(context, result),
        warnings: result.warnings.iter().map(ToString::to_string).collect(),
        arm: decoration.arm,
        time,
        command: decoration.command,
    })
}

/// The unit of the columns that Flexure's simulation writes; empty for any other.
fn unit_of(column: &str) -> &'static str {
    match column {
        "tau1" | "tau2" => "N m",
        "q1" | "q2" | "qm1" | "qm2" | "d1" | "d2" => "rad",
        "dq1" | "dq2" | "dqm1" | "dqm2" => "rad/s",
        _ => "",
    }
}

/// A column's name with its unit, where that is known.
pub fn labelled(column: &str) -> String {
    match unit_of(column) {
        "" => column.to_owned(),
        unit => format!("{column} ({unit})"),
    }
}

fn time_axis(sample_time: Option<f64>, first: usize) -> Axis {
    let (name, unit, step) = match sample_time {
        Some(step) => ("time", "s", step),
        None => ("sample", "", 1.0),
    };
    Axis {
        name: name.to_owned(),
        unit: unit.to_owned(),
        start: first as f64 * step,
        step,
    }
}

fn facts(context: &Context, result: &Estimate) -> Vec<Fact> {
    let fact = |name: &str, value: String, note: &str| Fact {
        name: name.to_owned(),
        value,
        note: note.to_owned(),
    };
    let measures = &result.verdict.measures;
    let unit = match unit_of(context.output) {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let samples = match result.delay {
        1 => "1 sample".to_owned(),
        delay => format!("{delay} samples"),
    };
    let mut facts = vec![
        fact(
            "Fit on fresh data",
            format!("{:.1} %", measures.fit_percent),
            "100 (1 - |y - ŷ| / |y - mean y|) of the free-run simulation",
        ),
        fact(
            "RMS error",
            format!("{}{unit}", number(measures.rms)),
            "root mean square of measured less simulated output",
        ),
        fact(
            "Order",
            result.order.order.to_string(),
            given_or(
                context.method.order().is_some(),
                "order of the linear part, by Schwarz's criterion",
            ),
        ),
        fact(
            "Delay",
            samples,
            given_or(
                context.method.delay().is_some(),
                "the first lag at which the output depends on the input",
            ),
        ),
    ];
    match &result.own {
        Own::Plain(own) => facts.push(fact(
            &tuning::capitalised(own.estimator.parameter()),
            tuning::list(&[own.parameter]),
            &match own.estimator.has_bandwidth() {
                true => "half width of the kernel's window, in the input's unit".to_owned(),
                false => format!("of the {} that estimates the nonlinearity", own.estimator.title()),
            },
        )),
        Own::Refined(own) if own.refined => facts.push(fact(
            "Breakpoints",
            own.breakpoints.len().to_string(),
            &format!("of the nonlinearity: {}", own.breakpoint_words()),
        )),
        Own::Refined(_) => {}
    }
    let left_out = match result.missing_fresh() {
        0 => String::new(),
        n => format!(" ({n} of those missing)"),
    };
    let all = result.predicted.len();
    facts.push(fact(
        "Samples",
        all.to_string(),
        &format!(
            "{} for the fit, {} kept for the verdict{left_out}",
            result.fitted,
            all - result.fitted
        ),
    ));
    facts
}

fn nonlinearity(u: &[f64], context: &Context, result: &Estimate, truth: Option<Truth>) -> Nonlinearity {
    let curve = &result.nonlinearity;
    let x = curve.x().to_vec();
    let (truth, truth_label) = match truth {
        Some(truth) => (x.iter().map(|&x| (truth.phi)(x)).collect(), truth.label),
        None => (Vec::new(), String::new()),
    };
    Nonlinearity {
        x_label: labelled(context.input),
        y_label: "nonlinearity's output".to_owned(),
        y: curve.y().to_vec(),
        lower: result.band_edge(-1.0),
        upper: result.band_edge(1.0),
        band_label: match &result.own {
            Own::Refined(own) if own.refined => "95 % pointwise, for these breakpoints",
            _ => "95 % pointwise, variance only",
        }
        .to_owned(),
        density: density(&u[..result.fitted], &x),
        truth,
        truth_label,
        x,
    }
}

/// Histogram density of `u` in bins as wide as a fiftieth of the range, at the points `x`.
fn density(u: &[f64], x: &[f64]) -> Vec<f64> {
    const BINS: usize = 50;
    let (low, high) = (x[0], x[x.len() - 1]);
    let width = (high - low) / BINS as f64;
    if !(width > 0.0) {
        return Vec::new();
    }
    let bin = |v: f64| (((v - low) / width).max(0.0) as usize).min(BINS - 1);
    let mut counts = [0.0; BINS];
    u.iter().for_each(|&v| counts[bin(v)] += 1.0);
    x.iter().map(|&v| counts[bin(v)] / (u.len() as f64 * width)).collect()
}

fn linear(context: &Context, result: &Estimate) -> LinearPart {
    let system = &result.linear;
    let points = |list: Option<Vec<flexure::linear::Complex<f64>>>| -> Vec<[f64; 2]> {
        list.unwrap_or_default().iter().map(|z| [z.re, z.im]).collect()
    };
    let (highest, frequency_unit) = match context.sample_time {
        Some(step) => (0.5 / step, "Hz"),
        None => (0.5, "cycles/sample"),
    };
    let (impulse_estimate, impulse_limit) = match &result.own {
        Own::Plain(own) => (own.impulse_estimate.clone(), own.impulse_limit),
        Own::Refined(_) => (Vec::new(), 0.0),
    };
    let shown = match &result.own {
        Own::Plain(_) => impulse_estimate.len(),
        Own::Refined(_) => system.settling(SETTLED).min(LONGEST_IMPULSE),
    };
    let mut part = LinearPart {
        b: system.b().to_vec(),
        a: system.a().to_vec(),
        impulse: system.impulse_response(shown.max(SHORTEST_IMPULSE)),
        impulse_estimate,
        impulse_limit,
        frequency: Vec::new(),
        frequency_unit: frequency_unit.to_owned(),
        magnitude_db: Vec::new(),
        phase_deg: Vec::new(),
        poles: points(system.poles()),
        zeros: points(system.zeros()),
    };
    let mut turns = 0.0;
    for i in 0..FREQUENCIES {
        let share = 10.0_f64.powf(DECADES * (i as f64 / (FREQUENCIES - 1) as f64 - 1.0));
        let response = system.frequency_response(std::f64::consts::PI * share);
        let phase = response.arg().to_degrees();
        if let Some(&last) = part.phase_deg.last() {
            turns = ((last - phase) / 360.0_f64).round();
        }
        part.frequency.push(highest * share);
        part.magnitude_db.push(20.0 * response.norm().log10());
        part.phase_deg.push(phase + 360.0 * turns);
    }
    part
}

fn residuals(result: &Estimate) -> Residuals {
    let tests = result.verdict.residuals.as_ref();
    let with_input = tests.map(|t| t.correlations.with_input.clone()).unwrap_or_default();
    let middle = (with_input.len() / 2) as f64;
    Residuals {
        autocorrelation: tests.map(|t| t.correlations.residual.clone()).unwrap_or_default(),
        cross_lags: (0..with_input.len()).map(|i| i as f64 - middle).collect(),
        cross_correlation: with_input,
        limit: tests.map_or(0.0, |t| t.correlations.limit),
        level: "99 %".to_owned(),
        tests: tests.iter().flat_map(|t| &t.tests).map(test).collect(),
    }
}

fn test(t: &flexure::validation::ResidualTest) -> Test {
    let words = match (t.passed(), t.kind.refutes()) {
        (true, _) => "nothing found",
        (false, true) => "the model leaves something that the input explains",
        (false, false) => "the noise is coloured, which alone does not refute the model",
    };
    let name = t.kind.name();
    Test {
        name: name[..1].to_uppercase() + &name[1..],
        statistic: t.statistic,
        limit: t.limit,
        p_value: t.p_value,
        passed: t.passed(),
        words: words.to_owned(),
    }
}

/// The arm's motion, if the record has its angles `q1` and `q2`.
pub fn arm_motion(record: &Record, lengths: [f64; 2], sample_time: Option<f64>, caption: String) -> Option<ArmMotion> {
    let pair = |a: &str, b: &str| -> Option<[Vec<f64>; 2]> {
        Some([record.finite(a).ok()?.to_vec(), record.finite(b).ok()?.to_vec()])
    };
    let empty = || [Vec::new(), Vec::new()];
    Some(ArmMotion {
        caption,
        lengths,
        time: time_axis(sample_time, 0),
        q: pair("q1", "q2")?,
        qm: pair("qm1", "qm2").unwrap_or_else(empty),
        tau: pair("tau1", "tau2").unwrap_or_else(empty),
    })
}
