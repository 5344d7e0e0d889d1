//! Whether a model holds on a record that was not used for its fit.

use anyhow::{Result, bail};
use flexure::error::DataError;
use flexure::identify::Verdict;
use flexure_io::{ModelFile, RecordFile};
use serde_json::{Value, json};

use crate::lines::{Lines, Tone};
use crate::named::Named;
use crate::plots::extent;
use crate::systems::SETTLED;
use crate::systems::columns::SystemColumns;
use crate::systems::json::tests;
use crate::systems::prediction::{self, FreeRun, Outside, Start};
use crate::systems::summary;
use crate::text::number;
use flexure::text::p_value;

/// What a model says about a record that was not used for its fit.
pub struct Judged {
    /// The verdict on the samples after those that are skipped.
    pub verdict: Verdict,
    /// The samples at the start that do not count.
    pub skip: usize,
    /// The model's run.
    pub free: FreeRun,
    outside: Outside,
}

impl Judged {
    /// Compares the model's free run under the columns `inputs` with the column `output`. `skip` samples at the start do not
    /// count, by default those that the model takes to settle, at most a tenth.
    ///
    /// # Errors
    /// Names what is wrong with the columns, or that `skip` leaves nothing.
    pub fn new(
        model: &ModelFile,
        file: &RecordFile,
        SystemColumns { inputs, output }: SystemColumns,
        skip: Option<usize>,
        initial_state: Option<Start>,
    ) -> Result<Self> {
        let (u, y) = (prediction::columns(file, inputs)?, file.finite(output)?);
        let settling = settling(model);
        let skip = skip.unwrap_or_else(|| usual_skip(model, y.len()));
        if skip >= y.len() {
            bail!(
                "{}: leaving out the first {skip} of {} samples leaves nothing to compare",
                file.path.display(),
                y.len()
            );
        }
        // Behind the settling time the state at the start no longer counts.
        let start = initial_state.or((skip >= settling).then_some(Start::Steady));
        let free = FreeRun::new(&model.block, file, inputs, Some(y), start)?;
        let fresh: Vec<&[f64]> = u.iter().map(|u| &u[skip..]).collect();
        let verdicts = Verdict::of_inputs(&fresh, &y[skip..], &free.output[skip..], model.estimated)
            .map_err(|error| file.locate(named(error, output)))?;
        if let Some((name, u)) = inputs.iter().zip(&fresh).find(|(_, u)| is_constant(u)) {
            let (column, value) = ((*name).to_owned(), u[0]);
            return Err(file.locate(flexure::Error::constant(column, value)).into());
        }
        let Some(verdict) = Verdict::worst(&verdicts) else {
            bail!("the model has no input");
        };
        Ok(Judged {
            verdict: verdict.clone(),
            skip,
            outside: Outside::new(&model.block, &u),
            free,
        })
    }

    /// The object that `validate --json` prints.
    pub fn json(&self) -> Value {
        let (verdict, measures) = (&self.verdict, &self.verdict.measures);
        json!({
            "fit_percent": measures.fit_percent,
            "rms": measures.rms,
            "r_squared": measures.r_squared,
            "samples": measures.samples,
            "skipped": self.skip,
            "initial_state": self.free.start().name(),
            "initial_state_samples": self.free.estimated_from,
            "holds": verdict.holds(),
            "misfit": verdict.misfit(),
            "verdict": verdict.text(),
            "residual_tests": tests(verdict),
            "samples_outside_range": self.outside.samples,
        })
    }

    /// The text that `validate` prints.
    pub fn summary(&self) -> Lines {
        let (verdict, measures) = (&self.verdict, &self.verdict.measures);
        let mut lines = Lines::new();
        lines.headline(
            summary::tone(verdict),
            format!(
                "Fit {:.2} % on this record, {}",
                measures.fit_percent,
                verdict.in_short()
            ),
        );
        lines.sentence(verdict.text());
        lines.item(
            "RMS error",
            format!(
                "{} over {} samples, the first {} skipped",
                number(measures.rms),
                measures.samples,
                self.skip
            ),
        );
        lines.item("free run", self.free.description());
        for test in verdict.residuals.iter().flat_map(|r| &r.tests) {
            let p = p_value(test.p_value);
            match (test.passed(), test.kind.refutes()) {
                (true, _) => lines.marked(Tone::Good, "passed", format!("{} ({p})", test.kind.name())),
                (false, true) => lines.marked(
                    Tone::Bad,
                    "FAILED",
                    format!("{} ({p}): {}", test.kind.name(), test.finding()),
                ),
                (false, false) => lines.marked(
                    Tone::Caution,
                    "not white",
                    format!(
                        "{} ({p}): {}, which does not refute the model",
                        test.kind.name(),
                        test.finding()
                    ),
                ),
            }
        }
        if let Some(warning) = self.outside.remark() {
            lines.warning(warning);
        }
        lines
    }
}

/// The samples that a model takes to settle.
fn settling(model: &ModelFile) -> usize {
    model.settling.unwrap_or_else(|| model.block.settling(SETTLED))
}

/// The samples at the start of a record of so many that do not count unless the user says otherwise: those that the model takes to
/// settle, at most a tenth.
pub(super) fn usual_skip(model: &ModelFile, samples: usize) -> usize {
    settling(model).min(samples / 10)
}

/// Whether samples vary by no more than rounding: then no test can find anything in them.
fn is_constant(samples: &[f64]) -> bool {
    let [low, high] = extent(samples.iter().copied());
    !(high - low > 1e-12 * low.abs().max(high.abs()))
}

/// The same error with the output's column in place of "the measurement".
fn named(error: flexure::Error, output: &str) -> flexure::Error {
    match error {
        flexure::Error::Data(DataError::Constant { value, .. }) => flexure::Error::constant(output, value),
        other => other,
    }
}
