//! The regression of a record that is read in parts: only sums are kept, no rows.

use anyhow::Result;
use flexure::Record;
use flexure::nonlinearity::{Degree, EstimatorName, Kernel, Regression, StreamedFit, StreamedRegression};
use flexure::simulation::batch;
use flexure::text::{counted, nearly_all};
use flexure_io::ParquetParts;
use serde_json::{Value, json};

use crate::lines::{Lines, Tone};
use crate::plots::evenly;
use crate::text::{capitalised, grouped, kernel_text, number, percent};

/// The memory of a part, bytes: sums in all bins, of 960 bytes each, a table of these, and some rows.
const OF_PART: u64 = 64 << 20;

/// The settings of the regression of one column on another, part by part.
pub struct Streamed {
    /// The column to regress on.
    pub x: String,
    /// The column to estimate.
    pub y: String,
    /// [`EstimatorName::Kernel`] or [`EstimatorName::LocalLinear`].
    pub estimator: EstimatorName,
    /// The kernel.
    pub kernel: Kernel,
    /// In the unit of x; `None` chooses it.
    pub bandwidth: Option<f64>,
    /// The level of the band.
    pub level: f64,
    /// Points of the curve.
    pub points: usize,
    /// The memory for sums and rows, bytes; at least [`LEAST_MEMORY`](Self::LEAST_MEMORY).
    pub memory: u64,
}

/// The regression, its curve and its band.
pub struct StreamedReport {
    asked: Streamed,
    fit: StreamedFit,
    x: Vec<f64>,
    y: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Streamed {
    /// The memory for the sums of the whole record and those of one part, bytes.
    pub const LEAST_MEMORY: u64 = 2 * OF_PART;

    /// Reads all parts, as many at a time as there are cores and memory for, and fits. `report` is called with the parts that are
    /// done and all of them.
    ///
    /// The result does not depend on the number of cores: every part has its own sums, which are added in the file's order.
    ///
    /// # Errors
    /// As [`ParquetParts::read`] and [`StreamedRegression::fit`], with the file's names of the columns.
    pub fn regress(self, parts: &ParquetParts, report: &dyn Fn(usize, usize)) -> Result<StreamedReport> {
        let located = |error: flexure::Error| {
            let name = |column: &str| match column {
                "x" => Some(self.x.clone()),
                "y" => Some(self.y.clone()),
                _ => None,
            };
            parts.locate(error.with_columns(name))
        };
        let sums_of = |part: usize, mut sums: StreamedRegression| -> flexure_io::Result<StreamedRegression> {
            parts.read(part, &mut |row, columns| {
                sums.push(row, &columns[0], &columns[1]).map_err(located)
            })?;
            Ok(sums)
        };
        let most = usize::try_from(self.memory / OF_PART)
            .unwrap_or(usize::MAX)
            .saturating_sub(1);
        let at_once = std::thread::available_parallelism().map_or(1, |cores| cores.get().min(most.max(1)));
        // The first part shows roughly how wide the bins will be.
        let mut sums = sums_of(0, StreamedRegression::default())?;
        let empty = sums.emptied();
        let others: Vec<usize> = (1..parts.count()).collect();
        for some in others.chunks(at_once) {
            for of_part in batch(some, |part| sums_of(*part, empty.clone())) {
                sums.merge(&of_part?).map_err(located)?;
            }
            report(some[some.len() - 1] + 1, parts.count());
        }
        let degree = match self.estimator {
            EstimatorName::Kernel => Degree::Constant,
            _ => Degree::Linear,
        };
        let fit = sums.fit(self.kernel, degree, self.bandwidth).map_err(located)?;
        let (low, high) = fit.range();
        let x = evenly([low, high], self.points);
        let y = fit.predict(&[&x]).map_err(located)?;
        let band = fit.band(&x, self.level).map_err(located)?;
        Ok(StreamedReport {
            asked: self,
            fit,
            x,
            y,
            lower: band.lower,
            upper: band.upper,
        })
    }
}

impl StreamedReport {
    /// How the bandwidth was chosen.
    fn why(&self) -> &'static str {
        match self.fit.search() {
            Some(_) => "smallest error of rows predicted from the other folds, blocks of 1000 rows",
            None => "as given",
        }
    }

    /// A short account, the result first.
    pub fn summary(&self) -> Lines {
        let Streamed {
            x,
            y,
            estimator,
            kernel,
            ..
        } = &self.asked;
        let r_squared = self.fit.r_squared();
        let explains = match r_squared {
            Some(share) if share > 0.0 => format!(", explains {} of its variance", nearly_all(share)),
            Some(_) => ", explains none of its variance".to_owned(),
            None => String::new(),
        };
        let tone = match r_squared {
            Some(share) if share <= 0.0 => Tone::Caution,
            _ => Tone::Good,
        };
        let mut lines = Lines::new();
        lines.headline(
            tone,
            format!("{} of '{y}' on '{x}'{explains}", capitalised(estimator.title())),
        );
        let shape = kernel_text(*estimator, *kernel, ", ", "");
        let bandwidth = number(self.fit.bandwidth());
        lines.item("bandwidth", format!("{bandwidth}{shape}  ({})", self.why()));
        if let (Some(share), Some(error)) = (r_squared, self.fit.prediction_error()) {
            let rms = number(error.sqrt());
            lines.item(
                "R squared",
                format!("{share:.4}  (rows predicted from the other folds; RMS error {rms})"),
            );
        }
        lines.item(
            "rows",
            format!(
                "{}, in bins {} wide",
                grouped(self.fit.count() as usize),
                number(self.fit.bin_width())
            ),
        );
        lines.item(
            "band",
            format!(
                "{} %, pointwise; from the scatter of the folds",
                percent(self.asked.level)
            ),
        );
        if self.fit.search().is_some_and(|search| search.at_edge) {
            lines.warning(
                "the error is smallest at the edge of the bandwidths tried: the regression is nearly straight or constant, or rougher than \
                 the data resolve",
            );
        }
        let bare = self.lower.iter().filter(|edge| edge.is_nan()).count();
        if bare > 0 {
            lines.warning(format!(
                "at {bare} of the {} of the curve too few rows are within reach for a band",
                counted(self.x.len(), "point")
            ));
        }
        lines
    }

    /// The object that `flexure regress --stream --json` prints.
    pub fn json(&self) -> Value {
        let asked = &self.asked;
        json!({
            "x": [asked.x],
            "y": asked.y,
            "samples": self.fit.count(),
            "estimator": asked.estimator.name(),
            "kernel": asked.kernel.name(),
            "parameter": "bandwidth",
            "value": [self.fit.bandwidth()],
            "chosen_by": self.fit.search().map(|_| "folds"),
            "bin_width": self.fit.bin_width(),
            "r_squared": self.fit.r_squared(),
            "prediction_rms": self.fit.prediction_error().map(f64::sqrt),
            "band": { "level": asked.level, "kind": "pointwise", "method": "folds" },
            "curve": { "x": [{ "name": asked.x, "values": self.x }], "y": self.y, "lower": self.lower, "upper": self.upper },
        })
    }

    /// The curve as a record.
    ///
    /// # Errors
    /// For columns of the same name.
    pub fn record(&self) -> flexure::Result<Record> {
        let columns = [
            (self.asked.x.as_str(), &self.x),
            ("y", &self.y),
            ("lower", &self.lower),
            ("upper", &self.upper),
        ];
        Record::new(columns.map(|(name, values)| (name, values.clone())))
    }
}
