//! A regression with its report, as text and JSON.

use std::ops::ControlFlow;

use flexure::identify::result::Values;
use flexure::nonlinearity::{LocalWindow, Side, Tuning};
use flexure::text::nearly_all;
use serde_json::{Value, json};

use super::text::{FELL_BACK, fell_back, judged, local_range, local_rule, places, why};
use super::warnings::Subject;
use super::{BandOptions, Diagnosis, Evaluation, Regression, RegressionData, Validation};
use crate::Spelling;
use crate::lines::{Lines, Tone};
use crate::text::{capitalised, kernel_text, list, number, percent};

/// A regression, and what a reader needs to judge it.
pub struct Report<'a> {
    /// The data.
    pub data: &'a RegressionData<'a>,
    /// The fit.
    pub regression: Regression,
    /// The options of the band.
    pub band: BandOptions,
    /// The residuals.
    pub diagnosis: Diagnosis,
    /// How well the fit predicts rows that it did not use.
    pub validation: Validation,
    /// The estimate and its band at the points that were asked for.
    pub evaluation: Evaluation,
    /// What to know before trusting it, one sentence each.
    pub warnings: Vec<String>,
}

impl<'a> Report<'a> {
    /// Judges a fit, and evaluates it at the points with the coordinates `at`, column by column; `go_on` as of [`Regression::evaluate`].
    pub fn new(
        regression: Regression,
        data: &'a RegressionData,
        band: BandOptions,
        at: Vec<Vec<f64>>,
        spelling: Spelling,
        go_on: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> flexure::Result<Self> {
        let diagnosis = Diagnosis::new(&regression, data)?;
        let validation = Validation::new(&regression, data, &diagnosis)?;
        let evaluation = regression.evaluate(data, &band, at, go_on)?;
        let subject = Subject {
            regression: &regression,
            data,
            diagnosis: &diagnosis,
            evaluation: Some((&evaluation, &band)),
            spelling,
        };
        let warnings = subject.warnings();
        Ok(Report {
            data,
            regression,
            band,
            diagnosis,
            validation,
            evaluation,
            warnings,
        })
    }

    /// The estimate at other points.
    pub(super) fn evaluate(&self, at: Vec<Vec<f64>>) -> flexure::Result<Evaluation> {
        self.regression
            .evaluate(self.data, &self.band, at, &mut |_, _| ControlFlow::Continue(()))
    }

    /// The object that `flexure regress --json` prints, without its files.
    pub fn json(&self) -> Value {
        let (data, Regression { estimator, fit }) = (self.data, &self.regression);
        let (diagnosis, validation, evaluation) = (&self.diagnosis, &self.validation, &self.evaluation);
        let columns: Vec<Value> = (data.names.x.iter().zip(&evaluation.x))
            .map(|(name, x)| json!({ "name": name, "values": x }))
            .collect();
        let mut object = json!({
            "x": data.names.x,
            "y": data.names.y,
            "weights": data.names.weights,
            "samples": diagnosis.rows.len(),
            "estimator": fit.name.name(),
            "estimator_asked": estimator.name.name(),
            "kernel": fit.name.has_bandwidth().then(|| estimator.kernel.name()),
            "parameter": fit.name.parameter(),
            "value": fit.parameter,
            "chosen_by": match estimator.tuning {
                Tuning::FromData(rule) => Some(rule.name()),
                Tuning::Fixed(_) => None,
            },
            "scores": fit.scores.as_ref().map(|s| json!(Values::from(s))),
            "band": evaluation.band.as_ref().map(|band| json!({ "level": band.level, "kind": band.kind, "method": band.method })),
            "local_bandwidths": self.local_bandwidths_json(),
            "residual_sd": validation.residual_sd,
            "r_squared": validation.r_squared,
            "prediction_rms": validation.rms,
            "validation": validation.by,
            "rows_alone": diagnosis.alone,
            "rows_not_predicted": validation.unpredicted,
            "dependent_rows": diagnosis.dependent,
            "curve": { "x": columns, "y": evaluation.y, "lower": evaluation.lower, "upper": evaluation.upper },
            "warnings": self.warnings,
        });
        if !data.left_out.is_empty() || !diagnosis.outliers.is_empty() {
            object["outliers_left_out"] = json!(!data.left_out.is_empty());
            object["outliers"] = json!(if data.left_out.is_empty() {
                &diagnosis.outliers
            } else {
                &data.left_out
            });
        }
        object
    }

    fn local_bandwidths_json(&self) -> Option<Value> {
        self.regression.fit.local.as_ref().map(|local| {
            let of = |value: fn(&LocalWindow) -> f64| local.windows.iter().map(value).collect::<Vec<_>>();
            let sides = local.windows.iter().map(|w| match w.side {
                Side::Left => "left",
                Side::Both => "both",
                Side::Right => "right",
            });
            json!({
                "rule": local_rule(local).name,
                "threshold": local.threshold,
                "prediction_rms": local.prediction_error.map(f64::sqrt),
                "prediction_rms_of_one_bandwidth": local.prediction_error_of_one.map(f64::sqrt),
                "x": of(|w| w.x),
                "bandwidth": of(|w| w.bandwidth),
                "side": sides.collect::<Vec<_>>(),
                "jumps": local.jumps,
            })
        })
    }

    /// A short account, the result first.
    pub fn summary(&self) -> Lines {
        let Regression { estimator, fit } = &self.regression;
        let names = &self.data.names;
        let r_squared = self.validation.r_squared;
        let explains = match r_squared.is_finite() {
            true if r_squared > 0.0 => format!(", explains {} of its variance", nearly_all(r_squared)),
            true => ", explains none of its variance".to_owned(),
            false => String::new(),
        };
        let tone = match r_squared > 0.0 {
            true => Tone::Good,
            false => Tone::Caution,
        };
        let mut lines = Lines::new();
        lines.headline(
            tone,
            format!(
                "{} of '{}' on '{}'{explains}",
                capitalised(fit.name.title()),
                names.y,
                names.x.join("', '")
            ),
        );
        let kernel = kernel_text(fit.name, estimator.kernel, ", ", "");
        lines.item(
            fit.name.parameter(),
            format!("{}{kernel}  ({})", list(&fit.parameter), why(&self.regression)),
        );
        if let Some(local) = &fit.local {
            let jumps = match local.jumps.as_slice() {
                [] => String::new(),
                _ => format!("; jumps at {}", places(local)),
            };
            let text = format!("{}{jumps}  ({})", local_range(local), local_rule(local).why);
            lines.item("local bandwidths", text);
        } else if fell_back(&self.regression) {
            lines.item("local bandwidths", FELL_BACK);
        }
        lines.item("R squared", judged(&self.validation, &self.diagnosis));
        lines.item(
            "residuals",
            format!(
                "standard deviation {}, {} rows",
                number(self.validation.residual_sd),
                self.diagnosis.rows.len()
            ),
        );
        if let Some(band) = &self.evaluation.band {
            lines.item("band", format!("{} %, {}{}", percent(band.level), band.kind, band.of));
        }
        for warning in &self.warnings {
            lines.warning(warning);
        }
        lines
    }
}
