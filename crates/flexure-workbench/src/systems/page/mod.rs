//! An identification as the page that shows it.

mod blocks;
mod choices;
mod closed_loop;
mod diagram;
mod terms;

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::identify::Warning;
use flexure::text::capitalised;
use flexure_io::RecordFile;
use flexure_report::data::{ArmMotion, Axis, Page, Prediction, Residuals, Signal, Test, TestOutcome, Verdict};

use super::comparison;
use super::periods::Periodic;
use super::summary::is_fundamental;
use super::task::Identified;
use super::validation::finding;
use crate::labels::Labels;
use crate::plots::time_axis;
pub use choices::score_curve;

/// Content for the page from the caller, in addition to the record and the result.
#[derive(Default)]
pub struct Decoration {
    /// The heading.
    pub title: Option<String>,
    /// The command line that makes the page again.
    pub command: Option<String>,
    /// The same in Python.
    pub python: Option<String>,
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
    pub phi: Box<dyn Fn(f64) -> f64 + Send>,
    /// What it is, and how it was aligned with the estimate.
    pub label: String,
}

impl Identified {
    /// The page that `flexure identify --report` writes.
    ///
    /// # Errors
    /// For columns that the record lacks, and for numbers that cannot be drawn.
    pub fn html(&self, file: &RecordFile, decoration: Decoration) -> Result<String> {
        flexure_report::render(&self.page(file, decoration)?).context("the report")
    }

    fn page(&self, file: &RecordFile, mut decoration: Decoration) -> Result<Page> {
        let result = &self.result;
        let record = &file.record;
        // The output may have samples that are missing.
        let y = without_outliers(record.column(&result.output)?, &result.warnings);
        let mut drawn = blocks::drawn(record, self)?;
        if let Some(truth) = decoration.truth.take() {
            let curve = &mut drawn.nonlinearity;
            curve.truth = curve.x.iter().map(|&x| (truth.phi)(x)).collect();
            curve.truth_label = truth.label;
        }
        let inputs = result
            .inputs
            .iter()
            .map(|input| Ok(signal(&self.labels, input, record.finite(input)?)));
        let mut signals = inputs.collect::<Result<Vec<Signal>>>()?;
        signals.push(signal(&self.labels, &result.output, &y));
        let sentences = [result.verdict.text()].into_iter().chain(decoration.remark);
        let title = || format!("From {} to {}", result.inputs.join(", "), result.output);
        let (above, below): (Vec<_>, Vec<_>) = (result.warnings.iter()).partition(|w| is_fundamental(w));
        let fitted = result.fitted;
        let mut page = Page {
            title: decoration.title.unwrap_or_else(title),
            subtitle: self.subtitle(&file.name(), y.len() - fitted),
            verdict: Verdict {
                headline: result.verdict.headline().to_owned(),
                holds: result.verdict.holds(),
                text: sentences.collect::<Vec<_>>().join(" "),
                details: Vec::new(),
            },
            facts: choices::facts(self),
            diagram: Some(diagram::diagram(result, &self.labels)),
            record: signals,
            fresh_from: if self.is_other_record { 0 } else { fitted },
            nonlinearity: drawn.nonlinearity,
            surface: drawn.surface,
            curves: drawn.curves,
            approximation: self.periodic.as_ref().map(Periodic::section),
            linear: drawn.linear,
            prediction: prediction(self, file, &y),
            residuals: residuals(&result.verdict),
            choices: choices::choices(result),
            candidates: drawn.tables.into_iter().chain(choices::tried(result)).collect(),
            warnings: below.into_iter().map(ToString::to_string).collect(),
            arm: decoration.arm,
            time: time_axis(file, self.sample_time, 0),
            command: decoration.command,
            python: decoration.python,
        };
        if let Some(comparison) = &result.comparison {
            comparison::show_on(comparison, &mut page);
        }
        for warning in above {
            let verdict = &mut page.verdict;
            if !verdict.holds {
                verdict.headline = "The output integrates the input: no block model explains it".to_owned();
            }
            verdict.text = format!("{}. {}", capitalised(&warning.to_string()), verdict.text);
        }
        Ok(page)
    }
}

impl Identified {
    /// The subtitle: the model's structure, and which samples of this file fitted and judged it.
    fn subtitle(&self, file: &str, fresh: usize) -> String {
        let result = &self.result;
        let model = format!("A {} model ({})", result.structure, result.description);
        match self.is_other_record {
            true => format!(
                "{model}, judged on {} samples of {file}.",
                result.verdict.measures.samples
            ),
            false => {
                let fitted = self.in_parts.map_or(result.fitted, |fitted| fitted.samples);
                format!("{model} identified from {fitted} samples of {file}; judged on the {fresh} that follow.")
            }
        }
    }
}

fn signal(labels: &Labels, column: &str, values: &[f64]) -> Signal {
    Signal {
        name: column.to_owned(),
        unit: labels.unit(column).to_owned(),
        values: values.to_vec(),
    }
}

/// The output without the outliers that were left out: they are no errors of the model, and would hide everything else.
fn without_outliers(y: &[f64], warnings: &[Warning]) -> Vec<f64> {
    let mut y = y.to_vec();
    for warning in warnings {
        if let Warning::Outliers {
            samples,
            left_out: true,
        } = warning
        {
            samples.iter().for_each(|&t| y[t] = f64::NAN);
        }
    }
    y
}

/// Measured against predicted on the fresh part.
fn prediction(identified: &Identified, file: &RecordFile, y: &[f64]) -> Prediction {
    let result = &identified.result;
    Prediction {
        y_label: identified.labels.of(&result.output),
        time: time_axis(file, identified.sample_time, result.fitted),
        measured: y[result.fitted..].to_vec(),
        predicted: result.predicted[result.fitted..].to_vec(),
        fit_percent: result.verdict.measures.fit_percent,
        rms: result.verdict.measures.rms,
    }
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
        cross_limit: tests.map_or(0.0, |t| t.correlations.input_limit),
        level: "99 %".to_owned(),
        tests: tests.iter().flat_map(|t| &t.tests).map(|t| test(t, verdict)).collect(),
    }
}

/// A test of a model that holds may detect a negligible misfit.
fn test(t: &flexure::validation::ResidualTest, verdict: &flexure::identify::Verdict) -> Test {
    let outcome = match (t.passed(), t.kind.refutes()) {
        (true, _) => TestOutcome::Passed,
        (false, true) if verdict.holds() => TestOutcome::Negligible,
        (false, true) => TestOutcome::Failed,
        (false, false) => TestOutcome::Coloured,
    };
    let text = match outcome {
        TestOutcome::Passed => "nothing found".to_owned(),
        TestOutcome::Negligible | TestOutcome::Failed | TestOutcome::Coloured => finding(verdict, t),
    };
    let name = t.kind.name();
    Test {
        name: capitalised(name),
        statistic: t.statistic,
        limit: t.limit,
        p_value: t.p_value,
        outcome,
        text,
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
        time: Axis::of_samples(sample_time, 0),
        q: pair("q1", "q2")?,
        qm: pair("qm1", "qm2").unwrap_or_else(empty),
        tau: pair("tau1", "tau2").unwrap_or_else(empty),
    })
}
