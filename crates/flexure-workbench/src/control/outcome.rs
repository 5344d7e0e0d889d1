//! The results of a scenario, as text and JSON.

use flexure::control::estimation::Consistency;
use flexure::control::{Figures, Run};
use flexure::manipulator::Link;
use serde_json::{Value, json};

use super::Judged;
use crate::lines::{Lines, Tone};

/// A figure over seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        let n = values.len();
        let middle = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
        Spread {
            median: match n % 2 {
                1 => middle(n / 2),
                _ => 0.5 * (middle(n.wrapping_sub(1) / 2) + middle(n / 2)),
            },
            worst: values.last().copied().unwrap_or(f64::NAN),
        }
    }
}

/// A controller's result.
pub struct Row {
    /// Its name.
    pub controller: String,
    /// The largest distance of the tip from its reference, m.
    pub tip_error_max: Spread,
    /// The root mean square of that distance, m.
    pub tip_error_rms: Spread,
    /// The tip's vibration after the motion, in percent of the diagonal of the box around its reference.
    pub residual_vibration: Spread,
    /// The same, in percent of the vibration that the same controller leaves without its shaper.
    pub residual_of_unshaped: Option<Spread>,
    /// The largest torque, N m.
    pub torque_peak: Spread,
    /// The root mean square of the error of the links' velocities that the controller was given, rad/s.
    pub velocity_error: Spread,
    /// The consistency of its filter.
    pub consistency: Option<Consistency>,
    /// The number of completed runs.
    pub seeds: usize,
    /// What went wrong in the others.
    pub failure: Option<String>,
    /// The first completed run.
    pub run: Option<Run>,
}

impl Row {
    pub(super) fn new(
        controller: String,
        results: Vec<flexure::Result<Judged>>,
        run: Option<Run>,
        extent: f64,
    ) -> Self {
        let failure = results.iter().find_map(|r| r.as_ref().err().map(ToString::to_string));
        let judged: Vec<Judged> = results.into_iter().flatten().collect();
        let spread = |of: &dyn Fn(&Figures) -> f64| Spread::new(judged.iter().map(|j| of(&j.figures)));
        let consistency: Vec<Consistency> = judged.iter().filter_map(|j| j.consistency).collect();
        let shaped = judged.iter().any(|j| j.unshaped.is_some());
        Row {
            controller,
            tip_error_max: spread(&|f| f.tip_error_max),
            tip_error_rms: spread(&|f| f.tip_error_rms),
            residual_vibration: spread(&|f| 100.0 * f.residual_vibration / extent),
            residual_of_unshaped: shaped
                .then(|| Spread::new(judged.iter().filter_map(|j| j.unshaped.map(|u| 100.0 * u)))),
            torque_peak: spread(&|f| f.torque_peak),
            velocity_error: spread(&|f| f.velocity_error_rms),
            consistency: Consistency::over(&consistency),
            seeds: judged.len(),
            failure,
            run,
        }
    }

    fn json(&self) -> Value {
        let number = |v: f64| json!(v.is_finite().then_some(v));
        json!({
            "controller": self.controller,
            "tip_error_max_m": number(self.tip_error_max.median),
            "tip_error_rms_m": number(self.tip_error_rms.median),
            "residual_vibration_percent": number(self.residual_vibration.median),
            "torque_peak_nm": number(self.torque_peak.median),
            "seeds": self.seeds,
            "residual_of_unshaped_percent": self.residual_of_unshaped.map(|s| number(s.median)),
            "velocity_error_rms": number(self.velocity_error.median),
            "nees_within": self.consistency.map(|c| number(c.nees.within)),
            "nis_within": self.consistency.map(|c| number(c.nis.within)),
            "worst": {
                "tip_error_max_m": number(self.tip_error_max.worst),
                "tip_error_rms_m": number(self.tip_error_rms.worst),
                "residual_vibration_percent": number(self.residual_vibration.worst),
                "torque_peak_nm": number(self.torque_peak.worst),
                "velocity_error_rms": number(self.velocity_error.worst),
            },
            "failure": self.failure,
        })
    }
}

/// The results.
pub struct Outcome {
    /// A row per controller.
    pub rows: Vec<Row>,
    /// The runs of each.
    pub seeds: usize,
    /// What moves.
    pub(super) body: &'static str,
    /// Its links.
    pub(super) links: [Link; 2],
    /// The motion's end, s.
    pub(super) end: f64,
    /// s.
    pub(super) sample_time: f64,
}

/// Three significant digits.
pub(super) fn short(value: f64) -> String {
    match value.is_finite() {
        true if value == 0.0 => "0".to_owned(),
        true if !(1e-3..1e6).contains(&value.abs()) => format!("{value:.1e}"),
        true => {
            let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
            format!("{value:.digits$}")
        }
        false => "-".to_owned(),
    }
}

impl Outcome {
    /// The controller whose largest error of the tip is smallest.
    pub fn best(&self) -> Option<&Row> {
        let finite = self.rows.iter().filter(|row| row.tip_error_max.median.is_finite());
        finite.min_by(|a, b| a.tip_error_max.median.total_cmp(&b.tip_error_max.median))
    }

    /// The columns' names, and each row's cells.
    pub(super) fn cells(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let seen = |any: &dyn Fn(&Row) -> bool| self.rows.iter().any(any);
        let many = self.seeds > 1;
        let shaped = seen(&|r| r.residual_of_unshaped.is_some());
        let estimated = seen(&|r| r.velocity_error.worst > 0.0);
        let filtered = seen(&|r| r.consistency.is_some());
        let mut names = vec!["controller", "max (mm)", "RMS (mm)"];
        if many {
            names.push("worst (mm)");
        }
        names.extend(["residual (%)", "peak torque (N m)"]);
        if shaped {
            names.push("of unshaped (%)");
        }
        if estimated {
            names.push("velocity error (mrad/s)");
        }
        if filtered {
            names.extend(["NEES (%)", "NIS (%)"]);
        }
        let row = |r: &Row| {
            let mut cells = vec![r.controller.clone()];
            cells.extend([1e3 * r.tip_error_max.median, 1e3 * r.tip_error_rms.median].map(short));
            if many {
                cells.push(short(1e3 * r.tip_error_max.worst));
            }
            cells.extend([r.residual_vibration.median, r.torque_peak.median].map(short));
            if shaped {
                cells.push(r.residual_of_unshaped.map_or("-".to_owned(), |s| short(s.median)));
            }
            if estimated {
                cells.push(short(1e3 * r.velocity_error.median));
            }
            if filtered {
                let share = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.1}", 100.0 * v));
                cells.push(share(r.consistency.map(|c| c.nees.within)));
                cells.push(share(r.consistency.map(|c| c.nis.within)));
            }
            cells
        };
        (
            names.iter().map(|n| (*n).to_owned()).collect(),
            self.rows.iter().map(row).collect(),
        )
    }

    /// What the columns mean.
    pub(super) fn legend(&self) -> String {
        let mut text = "max and RMS: distance of the tip from its reference".to_owned();
        if self.seeds > 1 {
            text.push_str(&format!(", medians and the worst of {} runs", self.seeds));
        }
        text.push_str(
            "; residual: vibration of the tip after the end of the motion, in percent of the diagonal of the box around its path",
        );
        if self.rows.iter().any(|r| r.residual_of_unshaped.is_some()) {
            text.push_str(" and, in the column 'of unshaped', in percent of the vibration without the shaper");
        }
        if self.rows.iter().any(|r| r.velocity_error.worst > 0.0) {
            text.push_str("; velocity error: RMS error of the links' velocities that the controller was given");
        }
        if self.rows.iter().any(|r| r.consistency.is_some()) {
            text.push_str("; NEES (NIS): share of instants at which the filter's normalised error (innovation) is within its 95 % band");
        }
        text.push('.');
        text
    }

    /// For reading.
    pub fn lines(&self) -> Lines {
        let mut lines = Lines::new();
        match self.best() {
            Some(best) => {
                let error = short(1e3 * best.tip_error_max.median);
                lines.headline(
                    Tone::Plain,
                    format!("Smallest maximum error of the tip: {error} mm, by {}", best.controller),
                );
            }
            None => lines.headline(Tone::Bad, "No controller carried its run through"),
        }
        let (names, rows) = self.cells();
        let table: Vec<Vec<String>> = [names].into_iter().chain(rows).collect();
        lines.table(&table, &[0]);
        lines.sentence(self.legend());
        for row in &self.rows {
            if let Some(failure) = &row.failure {
                lines.warning(format!(
                    "{}: {} of {} runs were not carried through: {failure}",
                    row.controller,
                    self.seeds - row.seeds,
                    self.seeds
                ));
            }
        }
        lines
    }

    /// One object a controller.
    pub fn json(&self) -> Value {
        json!({ "results": self.rows.iter().map(Row::json).collect::<Vec<_>>() })
    }
}
