//! Several models on one record, side by side.

use anyhow::{Context as _, Result};
use flexure::text::{BELOW_ZERO, counted, fit, number};
use flexure_io::{ModelFile, RecordFile};
use flexure_report::data::{Comparison, ComparisonPage, Prediction, Table};
use serde_json::{Value, json};

use super::columns::SystemColumns;
use super::validation::{Judged, Judging, usual_skip};
use crate::labels::Labels;
use crate::lines::{Lines, Tone};
use crate::plots::time_axis;

/// The mark after a model that has seen the record.
const SEEN: &str = " *";

/// A model that takes part, and the columns that it connects.
pub struct ComparedModel {
    /// The model file's name.
    pub name: String,
    /// The model.
    pub model: ModelFile,
    /// The columns that enter the model.
    pub inputs: Vec<String>,
    /// The column that it should predict.
    pub output: String,
}

/// A model's result on the record.
struct Outcome {
    compared: ComparedModel,
    judged: Judged,
}

/// Models on one record, the best fit first.
pub struct Compared {
    record: String,
    samples: usize,
    skip: usize,
    outcomes: Vec<Outcome>,
}

impl Compared {
    /// Runs every model under the record's inputs. The first samples do not count for any model: as many as `judging` skips; by default as
    /// many as the slowest model takes to settle, at most a tenth of the record.
    ///
    /// # Errors
    /// As [`Judged::new`].
    pub fn new(models: Vec<ComparedModel>, file: &RecordFile, judging: Judging) -> Result<Self> {
        let samples = file.record.len();
        let usual = models.iter().map(|c| usual_skip(&c.model, samples)).max();
        let skip = judging.skip.or(usual).unwrap_or(0);
        let judge = |compared: ComparedModel| -> Result<Outcome> {
            let inputs: Vec<&str> = compared.inputs.iter().map(String::as_str).collect();
            let output = compared.output.as_str();
            let columns = SystemColumns {
                inputs: &inputs,
                output,
            };
            let judging = Judging {
                skip: Some(skip),
                ..judging
            };
            let judged = Judged::new(&compared.model, file, columns, judging).with_context(|| compared.name.clone())?;
            Ok(Outcome { compared, judged })
        };
        let mut outcomes = models.into_iter().map(judge).collect::<Result<Vec<_>>>()?;
        outcomes.sort_by(|a, b| b.fit().total_cmp(&a.fit()));
        Ok(Compared {
            record: file.name(),
            samples,
            skip,
            outcomes,
        })
    }

    /// The heading: what is compared, and on how many samples.
    fn heading(&self) -> String {
        // Samples without an output do not count.
        let samples = self.outcomes.iter().map(|o| o.judged.verdict.measures.samples);
        let most = samples.max().unwrap_or(self.samples - self.skip);
        format!(
            "{} on {}: {most} samples compared, the first {} skipped",
            counted(self.outcomes.len(), "model"),
            self.record,
            self.skip
        )
    }

    /// What a reader of the table should know.
    fn remarks(&self) -> Vec<String> {
        let below = self.outcomes.iter().any(|o| o.fit() < 0.0);
        let below = below.then(|| BELOW_ZERO.to_owned());
        self.mark().into_iter().chain(below).collect()
    }

    /// What the mark means, if a model has it.
    fn mark(&self) -> Option<String> {
        let seen = self.outcomes.iter().filter(|o| o.judged.seen).count();
        (seen > 0).then(|| {
            let which = match seen {
                1 => "was identified from this very record, so its row says",
                _ => "were identified from this very record, so their rows say",
            };
            format!("* {which} little about fresh data.")
        })
    }

    fn columns() -> [&'static str; 6] {
        ["model", "structure", "order", "fit", "RMS error", "verdict"]
    }

    /// What `flexure compare` prints.
    pub fn summary(&self) -> Lines {
        let mut lines = Lines::new();
        lines.headline(Tone::Plain, self.heading());
        let mut rows = vec![Self::columns().map(str::to_owned)];
        rows.extend(self.outcomes.iter().map(Outcome::row));
        lines.table(&rows, &[0, 1, 5]);
        self.remarks().into_iter().for_each(|remark| lines.sentence(remark));
        lines
    }

    /// The object that `flexure compare --json` prints.
    pub fn json(&self) -> Value {
        json!({
            "record": self.record,
            "samples": self.samples - self.skip,
            "skipped": self.skip,
            "models": self.outcomes.iter().map(Outcome::json).collect::<Vec<_>>(),
        })
    }

    /// The page that `flexure compare --report` writes.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, file: &RecordFile, command: Option<String>) -> Result<String> {
        let page = ComparisonPage {
            title: format!("Models on {}", self.record),
            subtitle: format!("{}.", self.heading()),
            table: Table {
                title: "Fits, the best first".to_owned(),
                text: self.remarks().join(" "),
                columns: Self::columns().map(str::to_owned).to_vec(),
                rows: self.outcomes.iter().map(|o| o.row().to_vec()).collect(),
                chosen: None,
                ends_in_text: true,
            },
            runs: self
                .outcomes
                .iter()
                .map(|outcome| outcome.run(file, self.skip))
                .collect::<Result<_>>()?,
            command,
        };
        flexure_report::render_comparison(&page).context("the report")
    }
}

impl Outcome {
    fn fit(&self) -> f64 {
        self.judged.verdict.measures.fit_percent
    }

    /// The cells of the model's row.
    fn row(&self) -> [String; 6] {
        let ComparedModel { name, model, .. } = &self.compared;
        let mark = if self.judged.seen { SEEN } else { "" };
        [
            format!("{name}{mark}"),
            model.structure.clone(),
            model.order.to_string(),
            fit(self.fit(), 2),
            number(self.judged.verdict.measures.rms),
            self.judged.verdict.in_short().to_owned(),
        ]
    }

    fn json(&self) -> Value {
        let ComparedModel { name, model, .. } = &self.compared;
        let mut object = self.judged.json();
        object["model"] = json!(name);
        object["structure"] = json!(model.structure);
        object["order"] = json!(model.order);
        object
    }

    /// The output against the model's run.
    fn run(&self, file: &RecordFile, skip: usize) -> Result<Comparison> {
        let ComparedModel {
            name, model, output, ..
        } = &self.compared;
        let measures = &self.judged.verdict.measures;
        Ok(Comparison {
            names: ["measured", "predicted"],
            heading: name.clone(),
            prediction: Prediction {
                y_label: Labels::new(file).of(output),
                time: time_axis(file, model.sample_time, skip),
                measured: file.column(output)?[skip..].to_vec(),
                predicted: self.judged.free.output[skip..].to_vec(),
                fit_percent: measures.fit_percent,
                rms: measures.rms,
            },
            remark: self.judged.text(),
        })
    }
}
