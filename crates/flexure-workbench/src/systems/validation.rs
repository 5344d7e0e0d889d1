//! Whether a model holds on a record that was not used for its fit.

use std::collections::HashSet;

use anyhow::{Result, bail};
use flexure::error::DataError;
use flexure::identify::{RunsAway, Verdict, Warning};
use flexure::validation::{FitMeasures, ResidualTest};
use flexure_io::{ModelFile, RecordFile, RecordMark};
use serde_json::{Value, json};

use crate::labels::Labels;
use crate::lines::{Lines, Tone};
use crate::named::Named;
use crate::plots::{extent, time_axis};
use crate::systems::SETTLED;
use crate::systems::columns::SystemColumns;
use crate::systems::json::tests;
use crate::systems::prediction::{self, FreeRun, Outside, Start};
use crate::systems::summary::{self, with_unit};
use crate::text::number;
use flexure::outliers::standing_alone;
use flexure::text::{counted, decimal, fit, p_value, percent, shown_path};

/// The samples on which a model is judged, and the place where its run starts.
#[derive(Debug, Clone, Copy, Default)]
pub struct Judging {
    /// The samples at the start that do not count; by default those that the model takes to settle, at most a tenth.
    pub skip: Option<usize>,
    /// The state in which the record begins.
    pub initial_state: Option<Start>,
    /// Whether outputs that are NaN are missing samples, which do not count. Without it they are refused.
    pub missing: bool,
    /// Whether outliers of the output do not count.
    pub robust: bool,
}

/// What a model says about a record that was not used for its fit.
pub struct Judged {
    /// The verdict on the samples after those that are skipped.
    pub verdict: Verdict,
    /// The samples at the start that do not count.
    pub skip: usize,
    /// The model's run.
    pub free: FreeRun,
    outside: Outside,
    /// Where the record's units are not the model's.
    units: Vec<String>,
    /// The verdict on the samples that no excursion of the input affects; `None` without excursions.
    within: Option<Verdict>,
    /// Whether the model was identified from this very record.
    pub seen: bool,
    /// Whether the model has a loop that may run away, and explains nothing.
    may_have_run_away: bool,
    /// Outliers of the error.
    outliers: Outliers,
    /// The output's unit; empty where it is not known.
    unit: String,
}

/// Samples of the output far from the model and from the neighbouring samples.
struct Outliers {
    samples: Vec<usize>,
    /// The lines of the first ones in the file, where it has lines.
    lines: Vec<Option<u64>>,
    left_out: bool,
}

impl Outliers {
    /// The most outliers that are named.
    const NAMED: usize = 5;

    fn sentence(&self) -> Option<String> {
        let count = self.samples.len();
        let named = self.samples.iter().zip(&self.lines).take(Self::NAMED);
        let named = named.map(|(sample, line)| match line {
            Some(line) => format!("sample {sample} (line {line})"),
            None => format!("sample {sample}"),
        });
        let mut named: Vec<String> = named.collect();
        if count > named.len() {
            named.push(format!("{} more", count - named.len()));
        }
        let (outliers, named) = (counted(count, "outlier"), named.join(", "));
        match (count, self.left_out) {
            (0, _) => None,
            (_, true) => Some(format!("{outliers} of the output left out: {named}")),
            (_, false) => Some(format!(
                "{outliers} of the output, far from the model and from the neighbouring samples: {named}; --robust leaves them out of the verdict"
            )),
        }
    }
}

impl Judged {
    /// Compares the model's free run under the columns `inputs` with the column `output`.
    ///
    /// # Errors
    /// Names what is wrong with the columns, or that `skip` leaves nothing.
    pub fn new(
        model: &ModelFile,
        file: &RecordFile,
        SystemColumns { inputs, output }: SystemColumns,
        judging: Judging,
    ) -> Result<Self> {
        let u = prediction::columns(file, inputs)?;
        let y = match judging.missing {
            true => file.column(output)?,
            false => file.finite(output)?,
        };
        let settling = settling(model);
        let skip = judging.skip.unwrap_or_else(|| usual_skip(model, y.len()));
        if skip >= y.len() {
            bail!(
                "{}: leaving out the first {skip} of {} samples leaves nothing to compare",
                shown_path(&file.path),
                y.len()
            );
        }
        // Even after the settling time, an unknown initial state may leave more than the noise.
        let mut free = FreeRun::that_may_run_away(&model.block, file, inputs, Some(y), judging.initial_state)?;
        let end = free.output.iter().position(|v| !v.is_finite()).unwrap_or(y.len());
        let left = (end < y.len()).then(|| leaves(y, &free.output[..end]));
        if let Some(left) = left {
            // The samples from there on count as just out of reach, so that the measures stay finite.
            let [_, farthest] = reach(y);
            free.output[left..].fill(farthest);
        }
        let error = |i: usize| if i < skip { f64::NAN } else { y[i] - free.output[i] };
        let outliers = match left {
            None => standing_alone(&(0..y.len()).map(error).collect::<Vec<f64>>()),
            Some(_) => Vec::new(),
        };
        let left_out: HashSet<usize> = outliers.iter().copied().filter(|_| judging.robust).collect();
        let present: Vec<usize> = (skip..y.len())
            .filter(|i| !y[*i].is_nan() && !left_out.contains(i))
            .collect();
        let verdicts = |at: &[usize]| {
            let of = |v: &[f64]| at.iter().map(|&i| v[i]).collect::<Vec<f64>>();
            let columns: Vec<Vec<f64>> = u.iter().map(|u| of(u)).collect();
            let inputs: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            Verdict::of_inputs(&inputs, &of(y), &of(&free.output), model.estimated)
        };
        let judged = verdicts(&present).map_err(|error| file.locate(named(error, output)))?;
        let constant = |u: &&[f64]| is_constant(&present.iter().map(|&i| u[i]).collect::<Vec<f64>>());
        if let Some((name, u)) = inputs.iter().zip(&u).find(|(_, u)| constant(u)) {
            let (column, value) = ((*name).to_owned(), u[present[0]]);
            return Err(file.locate(flexure::Error::constant(column, value)).into());
        }
        let Some(verdict) = Verdict::worst(&judged).cloned() else {
            bail!("the model has no input");
        };
        let verdict = match left {
            Some(sample) => verdict.running_away(RunsAway {
                sample,
                time: model
                    .sample_time
                    .map(|_| time_axis(file, model.sample_time, sample).start),
            }),
            None => verdict,
        };
        let mark = RecordMark::new(&file.name(), &file.record, &[inputs, &[output]].concat())?;
        let outside = Outside::new(&model.block, &u);
        let affected = outside.affected(y.len(), settling);
        let within: Vec<usize> = present.iter().copied().filter(|&i| !affected[i]).collect();
        let within = match within.len() < present.len() && left.is_none() {
            true => verdicts(&within).ok().and_then(|all| Verdict::worst(&all).cloned()),
            false => None,
        };
        // What comes after would hide the rest of a plot.
        free.output[left.unwrap_or(y.len())..].fill(f64::NAN);
        let labels = Labels::new(file);
        Ok(Judged {
            may_have_run_away: left.is_none()
                && !(verdict.measures.fit_percent > 0.0)
                && model.block.has_unstable_loop(),
            verdict,
            within: within.filter(|within| within.residuals.is_some()),
            seen: model.was_identified_from(&mark),
            outliers: Outliers {
                lines: outliers.iter().take(Outliers::NAMED).map(|i| file.line(*i)).collect(),
                samples: outliers,
                left_out: judging.robust,
            },
            skip,
            outside,
            free,
            units: other_units(model, &labels, inputs, output),
            unit: labels.unit(output).to_owned(),
        })
    }

    /// The verdict in sentences; on the record that the model was identified from, the word "fresh" is not used.
    pub fn text(&self) -> String {
        let text = self.verdict.text();
        match self.seen {
            true => text
                .replace("On fresh data", "On this record")
                .replace("on fresh data", "on this record"),
            false => text,
        }
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
            "runs_away_from": verdict.runs_away.map(|runs_away| runs_away.sample),
            "misfit": verdict.runs_away.is_none().then(|| verdict.misfit()),
            "verdict": self.text(),
            "identified_from_this_record": self.seen,
            "residual_tests": tests(verdict),
            "outliers": self.outliers.samples,
            "samples_outside_range": self.outside.samples,
            "within_range": self.within.as_ref().map(|within| json!({
                "samples": within.measures.samples,
                "fit_percent": within.measures.fit_percent,
                "rms": within.measures.rms,
                "holds": within.holds(),
            })),
        })
    }

    /// The warning about the outliers of the output, as an identification has it.
    pub fn outlier_warning(&self) -> Option<Warning> {
        let Outliers { samples, left_out, .. } = &self.outliers;
        (!samples.is_empty()).then(|| Warning::Outliers {
            samples: samples.clone(),
            left_out: *left_out,
        })
    }

    /// The text that `validate` prints.
    pub fn summary(&self) -> Lines {
        let (verdict, measures) = (&self.verdict, &self.verdict.measures);
        let mut lines = Lines::new();
        let answer = verdict.in_short();
        lines.headline(
            summary::tone(verdict),
            match verdict.runs_away {
                Some(runs_away) => format!(
                    "On this record, the model {answer}: its simulated output {}",
                    runs_away.text()
                ),
                None => format!("Fit {} on this record, {answer}", fit(measures.fit_percent, 2)),
            },
        );
        if self.seen {
            lines.warning(
                "this is the record that the model was identified from: the figures say little about fresh data"
                    .to_owned(),
            );
        }
        for warning in &self.units {
            lines.warning(warning.clone());
        }
        match verdict.runs_away {
            Some(_) => lines.sentence(RunsAway::ADVICE.to_owned()),
            None => {
                lines.sentence(self.text());
                self.write_run(&mut lines);
            }
        }
        if self.may_have_run_away {
            lines.warning(
                "the linear part of the model's loop is unstable by itself: from a wrong initial state, the free run may move away from the data and \
                 not come back. \
                 Cut off the start of the record (flexure prepare --cut) and validate again; if the fit stays as low, identify another structure"
                    .to_owned(),
            );
        }
        self.write_tests(&mut lines);
        if let Some(warning) = self.outliers.sentence() {
            lines.warning(warning);
        }
        if let Some(warning) = self.outside.remark() {
            lines.warning(warning);
        }
        let within = self.within.as_ref().filter(|within| within.holds() && !verdict.holds());
        if let Some(FitMeasures {
            samples, fit_percent, ..
        }) = within.map(|within| &within.measures)
        {
            lines.warning(format!(
                "on the {samples} samples on which no such excursion acts, the fit is {fit_percent:.2} % and the model holds: identify it \
                 from data that reach as far as these"
            ));
        }
        lines
    }

    /// The error of the run, and where it starts.
    fn write_run(&self, lines: &mut Lines) {
        let measures = &self.verdict.measures;
        lines.item(
            "RMS error",
            format!(
                "{} over {} samples, the first {} skipped",
                with_unit(number(measures.rms), &self.unit),
                measures.samples,
                self.skip
            ),
        );
        lines.item("free run", self.free.description());
        if self.free.took_most() {
            lines.warning(
                "the model is so slow that the state at the start depends on most of this record, and was estimated from it: judge the model on a \
                 longer record, or from the steady state (--initial-state steady)"
                    .to_owned(),
            );
        }
    }

    /// The residual tests, one a line.
    fn write_tests(&self, lines: &mut Lines) {
        let verdict = &self.verdict;
        if let Some(residuals) = &verdict.residuals {
            let refuting = residuals.tests.iter().find(|test| test.kind.refutes());
            let each = refuting.map_or(String::new(), |test| {
                let level = decimal((test.level * 1e4).round() / 1e4);
                format!("; the model fails such a test if its p-value is below {level}")
            });
            lines.item(
                "residual tests",
                format!("those that can refute the model have a joint level of 1 %{each}"),
            );
        }
        for test in verdict.residuals.iter().flat_map(|r| &r.tests) {
            let found = finding(verdict, test);
            let text = |found: String| format!("{} ({}){found}", test.kind.name(), p_value(test.p_value));
            match (test.passed(), test.kind.refutes()) {
                (true, _) => lines.marked(Tone::Good, "passed", text(String::new())),
                (false, true) if verdict.holds() => {
                    lines.marked(Tone::Caution, "negligible", text(format!(": {found}")))
                }
                (false, true) => lines.marked(Tone::Bad, "FAILED", text(format!(": {found}"))),
                (false, false) => lines.marked(Tone::Caution, "not white", text(format!(": {found}"))),
            }
        }
    }
}

/// The first sample from which a run that grows without bound stays out of reach of the measured output: farther from its range than this is
/// wide.
fn leaves(y: &[f64], run: &[f64]) -> usize {
    let [lowest, highest] = reach(y);
    let is_near = |v: &f64| (lowest..=highest).contains(v);
    run.iter().rposition(is_near).map_or(0, |last| last + 1)
}

/// The measured range and as much again on either side.
fn reach(y: &[f64]) -> [f64; 2] {
    let [low, high] = extent(y.iter().copied().filter(|y| y.is_finite()));
    [2.0 * low - high, 2.0 * high - low]
}

/// What a test that fails finds, and how much: a misfit as in the verdict's text.
pub(super) fn finding(verdict: &Verdict, test: &ResidualTest) -> String {
    match test.kind.refutes() {
        true => format!(
            "a misfit of {} of the output's standard deviation",
            percent(verdict.misfit_seen_by(test))
        ),
        false => "the error is correlated in time, which alone does not refute the model".to_owned(),
    }
}

/// Columns whose units are not those of the model, where both are known.
fn other_units(model: &ModelFile, labels: &Labels, inputs: &[&str], output: &str) -> Vec<String> {
    let own = model.inputs.iter().chain([&model.output]);
    let columns = inputs.iter().chain([&output]);
    let differs = |(own, column): (&String, &&str)| {
        let (unit, here) = (model.units.get(own)?, labels.unit(column));
        (!here.is_empty() && here != unit).then(|| {
            format!(
                "'{own}' of the model is in {unit}, but '{column}' of this record is in {here}: is it the right column?"
            )
        })
    };
    own.zip(columns).filter_map(differs).collect()
}

/// The samples that a model takes to settle.
fn settling(model: &ModelFile) -> usize {
    model.settling.unwrap_or_else(|| model.block.settling(SETTLED))
}

/// The number of first samples that do not count by default: those that the model takes to settle, at most a tenth of `samples`.
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
