//! An identification as the page that shows it: what the pages of all structures share.

pub mod cascade;
mod choices;
pub mod hammerstein;
pub mod joint_inputs;
pub mod nonlinear_ends;
pub mod parallel;
pub mod references;
pub mod several_inputs;

use anyhow::Result;
use flexure::Record;
use flexure::identify::Warning;
use flexure::linear::TransferFunction;
use flexure_io::RecordFile;
use flexure_report::data::{
    Approximation, ArmMotion, Axis, Choice, Fact, LinearPart, Nonlinearity, Page, Prediction, Residuals, Signal, Table,
    Test, TitledCurve, TitledSurface, Verdict,
};

use crate::systems::outcome::{self, SETTLED, Signals};
use crate::text::number;

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
    /// What periods of the record say without any model.
    pub approximation: Option<Approximation>,
}

/// The true nonlinearity, and what it is.
pub struct Truth {
    /// phi.
    pub phi: Box<dyn Fn(f64) -> f64>,
    /// What it is, and how it was laid onto the estimate.
    pub label: String,
}

/// What a page shows of an identification besides its blocks.
struct Judged<'a> {
    signals: Signals<'a>,
    /// What was identified from so many samples, in a sentence without its end.
    model: String,
    fitted: usize,
    predicted: &'a [f64],
    verdict: &'a flexure::identify::Verdict,
    warnings: &'a [Warning],
}

/// What is each structure's own.
#[derive(Default)]
struct Parts {
    facts: Vec<Fact>,
    nonlinearity: Nonlinearity,
    surface: Option<TitledSurface>,
    curves: Vec<TitledCurve>,
    linear: Vec<LinearPart>,
    choices: Vec<Choice>,
    candidates: Vec<Table>,
}

/// Puts the page together; the truth among the decorations is the parts' business.
fn assembled(file: &RecordFile, judged: &Judged, parts: Parts, decoration: Decoration) -> Result<Page> {
    let Judged {
        signals,
        fitted,
        predicted,
        verdict,
        ..
    } = *judged;
    let record = &file.record;
    // The output may have samples that are missing.
    let y = record.column(signals.output)?;
    let name = file
        .path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let signal = |column: &str, values: &[f64]| Signal {
        name: column.to_owned(),
        unit: unit_of(column).to_owned(),
        values: values.to_vec(),
    };
    let Parts {
        facts,
        nonlinearity,
        surface,
        curves,
        linear,
        choices,
        candidates,
    } = parts;
    let inputs = signals.inputs();
    let mut shown = Vec::new();
    for input in &inputs {
        shown.push(signal(input, record.finite(input)?));
    }
    shown.push(signal(signals.output, y));
    Ok(Page {
        title: decoration
            .title
            .unwrap_or_else(|| format!("From {} to {}", inputs.join(", "), signals.output)),
        subtitle: format!(
            "{} identified from {fitted} samples of {name}; judged on the {} that follow.",
            judged.model,
            y.len() - fitted
        ),
        verdict: Verdict {
            headline: verdict.headline().to_owned(),
            holds: verdict.holds(),
            words: [verdict.words()]
                .into_iter()
                .chain(decoration.remark)
                .collect::<Vec<_>>()
                .join(" "),
        },
        facts,
        record: shown,
        fresh_from: fitted,
        nonlinearity,
        surface,
        curves,
        approximation: decoration.approximation,
        linear,
        prediction: Prediction {
            y_label: labelled(signals.output),
            time: time_axis(signals.sample_time, fitted),
            measured: y[fitted..].to_vec(),
            predicted: predicted[fitted..].to_vec(),
            fit_percent: verdict.measures.fit_percent,
            rms: verdict.measures.rms,
        },
        residuals: residuals(verdict),
        choices,
        candidates,
        warnings: judged.warnings.iter().map(ToString::to_string).collect(),
        arm: decoration.arm,
        time: time_axis(signals.sample_time, 0),
        command: decoration.command,
    })
}

/// Something that was chosen, without a curve.
fn choice(name: &str, value: String, why: &str) -> Choice {
    Choice {
        name: name.to_owned(),
        value,
        why: why.to_owned(),
        curve: None,
    }
}

fn fact(name: &str, value: String, note: &str) -> Fact {
    Fact {
        name: name.to_owned(),
        value,
        note: note.to_owned(),
    }
}

/// How near the prediction is.
fn fit_facts(verdict: &flexure::identify::Verdict, output: &str) -> [Fact; 2] {
    let unit = match unit_of(output) {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    [
        fact(
            "Fit on fresh data",
            format!("{:.1} %", verdict.measures.fit_percent),
            "100 (1 - |y - ŷ| / |y - mean y|) of the free-run simulation",
        ),
        fact(
            "RMS error",
            format!("{}{unit}", number(verdict.measures.rms)),
            "root mean square of measured less simulated output",
        ),
    ]
}

/// How many samples there are, and what they were used for; `left_out` is said of the last ones.
fn samples_fact(all: usize, fitted: usize, left_out: &str) -> Fact {
    fact(
        "Samples",
        all.to_string(),
        &format!("{fitted} for the fit, {} kept for the verdict{left_out}", all - fitted),
    )
}

/// How many kinks nonlinearities have, where any has one.
fn kinks_fact(kinks: &[usize]) -> Option<Fact> {
    let each: Vec<String> = kinks.iter().map(usize::to_string).collect();
    let why = "where the nonlinearities' slopes jump, beside the pieces";
    kinks
        .iter()
        .any(|k| *k > 0)
        .then(|| fact("Kinks", each.join(" + "), why))
}

/// A delay for reading.
fn samples(delay: usize) -> String {
    match delay {
        1 => "1 sample".to_owned(),
        delay => format!("{delay} samples"),
    }
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

/// A linear part; the impulse response has at least `shown` values, or as many as it needs to settle.
fn linear_part(title: &str, system: &TransferFunction, shown: Option<usize>, sample_time: Option<f64>) -> LinearPart {
    let (highest, frequency_unit) = match sample_time {
        Some(step) => (0.5 / step, "Hz"),
        None => (0.5, "cycles/sample"),
    };
    let shown = shown.unwrap_or_else(|| system.settling(SETTLED).min(LONGEST_IMPULSE));
    let mut part = LinearPart {
        title: title.to_owned(),
        words: String::new(),
        b: system.b().to_vec(),
        a: system.a().to_vec(),
        impulse: system.impulse_response(shown.max(SHORTEST_IMPULSE)),
        impulse_estimate: Vec::new(),
        impulse_limit: 0.0,
        frequency: Vec::new(),
        frequency_unit: frequency_unit.to_owned(),
        magnitude_db: Vec::new(),
        phase_deg: Vec::new(),
        poles: outcome::parts(system.poles()),
        zeros: outcome::parts(system.zeros()),
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

fn residuals(verdict: &flexure::identify::Verdict) -> Residuals {
    let tests = verdict.residuals.as_ref();
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
