//! What the periods of a record show without a model: the best linear approximation, with the levels of noise and nonlinear distortion.

use anyhow::Result;
use flexure::linear::{BestLinearApproximation, PeriodicSignals, period_of};
use flexure::text::counted;
use flexure_io::RecordFile;
use flexure_report::data::Approximation;
use serde_json::{Value, json};

use crate::lines::Lines;
use crate::plots::unwrapped;
use crate::text::number;

/// With this many periods or more, the first one is left out: the transient decays in it.
const ENOUGH_PERIODS: usize = 3;

/// A best linear approximation of a record.
pub struct Periodic {
    best: BestLinearApproximation,
    /// Samples.
    period: usize,
    sample_time: Option<f64>,
    /// Whether every realisation's first period was left out.
    settled: bool,
}

/// The period, in samples, of an input within the first realisation, if it repeats itself there.
pub fn period(input: &[f64], realisations: usize) -> Option<usize> {
    period_of(&input[..input.len() / realisations])
}

/// The root mean square of levels over that of the response, dB.
fn relative(best: &BestLinearApproximation, levels: &[f64]) -> f64 {
    let power = |v: f64| v * v;
    let response: f64 = best.response.iter().map(|g| g.norm_sqr()).sum();
    10.0 * (levels.iter().copied().map(power).sum::<f64>() / response).log10()
}

impl Periodic {
    /// The approximation from the column `input` to the column `output`. The record has `realisations` of equal length. The input's
    /// `period`, in samples, is at least 2 and at most the length of a realisation.
    pub fn new(
        file: &RecordFile,
        input: &str,
        output: &str,
        sample_time: Option<f64>,
        period: usize,
        realisations: usize,
    ) -> Result<Self> {
        let (u, y) = (file.finite(input)?, file.finite(output)?);
        let part = u.len() / realisations;
        let settled = part / period >= ENOUGH_PERIODS;
        let first = if settled { period } else { 0 };
        let parts: Vec<PeriodicSignals> = (0..realisations)
            .map(|m| {
                let range = m * part + first..(m + 1) * part;
                PeriodicSignals {
                    u: &u[range.clone()],
                    y: &y[range],
                }
            })
            .collect();
        let best = BestLinearApproximation::new(&parts, period).map_err(|error| file.locate(error))?;
        Ok(Periodic {
            best,
            period,
            sample_time,
            settled,
        })
    }

    /// Levels of the estimate, which is the mean of all realisations, converted to those of a single realisation.
    fn single(&self, levels: &[f64]) -> Vec<f64> {
        let gain = (self.best.realisations as f64).sqrt();
        levels.iter().map(|s| gain * s).collect()
    }

    /// What was measured, for reading.
    fn measured(&self) -> String {
        let left_out = if self.settled { ", the first one left out" } else { "" };
        format!(
            "{} of {} samples in {}{left_out}",
            counted(self.best.periods, "period"),
            self.period,
            counted(self.best.realisations, "realisation")
        )
    }

    /// The levels relative to the response, for reading; if they are not known, what would show them.
    fn levels(&self) -> String {
        let best = &self.best;
        let decibels = |levels: &[f64]| format!("{:.1} dB", relative(best, levels));
        let noise = self.single(&best.noise);
        match (best.noise.is_empty(), best.distortion.is_empty()) {
            (false, false) if best.distortion.iter().all(|d| *d == 0.0) => {
                format!(
                    "noise {} of the response, nonlinear distortion below it",
                    decibels(&noise)
                )
            }
            (false, false) => format!(
                "noise {}, nonlinear distortion {} of the response",
                decibels(&noise),
                decibels(&best.distortion)
            ),
            (false, true) => format!(
                "noise {} of the response; nonlinear distortion shows between realisations only (--realisations)",
                decibels(&noise)
            ),
            (true, false) | (true, true) if !best.total.is_empty() => format!(
                "noise and nonlinear distortion together {} of the response; more periods would separate them",
                decibels(&self.single(&best.total))
            ),
            _ => "one period of one realisation shows no levels".to_owned(),
        }
    }

    /// For reading.
    pub fn write(&self, lines: &mut Lines) {
        let frequency = &self.best.frequency;
        let ends = [frequency.first(), frequency.last()].map(|f| number(self.frequency(f.copied().unwrap_or(0.0))));
        lines.item(
            "best linear approximation",
            format!(
                "{} lines from {} to {} {}, {}: {}",
                frequency.len(),
                ends[0],
                ends[1],
                self.unit(),
                self.measured(),
                self.levels()
            ),
        );
    }

    fn unit(&self) -> &'static str {
        match self.sample_time {
            Some(_) => "Hz",
            None => "cycles/sample",
        }
    }

    fn frequency(&self, cycles: f64) -> f64 {
        cycles / self.sample_time.unwrap_or(1.0)
    }

    /// For `identify --json` and model files.
    pub fn json(&self) -> Value {
        let best = &self.best;
        let or_null = |v: &[f64]| (!v.is_empty()).then(|| v.to_vec());
        json!({
            "period": self.period,
            "periods": best.periods,
            "realisations": best.realisations,
            "first_period_left_out": self.settled,
            "frequency": best.frequency.iter().map(|f| self.frequency(*f)).collect::<Vec<_>>(),
            "frequency_unit": self.unit(),
            "response": best.response.iter().map(|g| [g.re, g.im]).collect::<Vec<_>>(),
            "noise": or_null(&best.noise),
            "total": or_null(&best.total),
            "distortion": or_null(&best.distortion),
            "text": self.levels(),
        })
    }

    /// For the page.
    pub fn section(&self) -> Approximation {
        let best = &self.best;
        let decibels = |v: &[f64]| v.iter().map(|s| 20.0 * s.log10()).collect::<Vec<f64>>();
        Approximation {
            text: format!("From {}, without any model: {}.", self.measured(), self.levels()),
            frequency: best.frequency.iter().map(|f| self.frequency(*f)).collect(),
            frequency_unit: self.unit().to_owned(),
            magnitude_db: best.response.iter().map(|g| 20.0 * g.norm().log10()).collect(),
            phase_deg: unwrapped(best.response.iter().map(|g| g.arg().to_degrees())),
            total_db: decibels(&self.single(&best.total)),
            noise_db: decibels(&self.single(&best.noise)),
            distortion_db: decibels(&best.distortion),
        }
    }
}
