//! The options for the steps that every record of a system needs in the same way.

use std::collections::BTreeMap;

use flexure::preparation::{LONGEST_GAP, Outliers};
use flexure_workbench::preparation::{Columns, Preparation};

use crate::arguments::{self, Usage};

/// The heading of the steps' options.
pub const STEPS: &str = "Preparing the record, in this order";

/// The steps.
#[derive(Clone, clap::Args)]
pub struct Steps {
    /// Treat the outliers in these columns as missing samples: A,B,... or all. An outlier is a sample that is far away
    /// from its neighbours.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS")]
    outliers: Option<String>,
    /// A sample is an outlier if it is farther than this from the median of its neighbours, in robust standard
    /// deviations.
    #[arg(long, help_heading = STEPS, value_name = "DEVIATIONS", default_value_t = Outliers::default().threshold, requires = "outliers", value_parser = arguments::positive)]
    threshold: f64,
    /// The number of neighbours on either side of a sample.
    #[arg(long, help_heading = STEPS, value_name = "N", default_value_t = Outliers::default().neighbours, requires = "outliers", value_parser = arguments::count_from_one)]
    neighbours: usize,
    /// Resample the record to a uniform sample time of DT, in s. The instants of the record may jitter. If DT is longer
    /// than the sample time of the record, a filter prevents aliases.
    #[arg(long, help_heading = STEPS, value_name = "DT", value_parser = arguments::positive)]
    pub resample: Option<f64>,
    /// Columns that hold their value between two samples, as commands do: A,B,... Between the samples of the other
    /// columns, a smooth curve is assumed. Give this option only if the record is resampled.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS", value_delimiter = ',')]
    hold: Vec<String>,
    /// Interpolate gaps of at most N missing samples. By default, N is 3 if the record is resampled, and 0 otherwise.
    /// The output of a block model is never filled: its missing samples do not count. For a joint, all columns are
    /// filled.
    #[arg(long, help_heading = STEPS, value_name = "N", value_parser = arguments::count)]
    pub fill: Option<usize>,
}

/// `all` or a list of columns.
pub fn columns(list: &str) -> Columns {
    match list {
        "all" => Columns::All,
        _ => Columns::Named(arguments::columns(list).into_iter().map(str::to_owned).collect()),
    }
}

impl Steps {
    /// The steps as a preparation without others.
    pub fn preparation(&self) -> Preparation {
        Preparation {
            outliers: self.outliers.as_deref().map(columns),
            rule: Outliers {
                neighbours: self.neighbours,
                threshold: self.threshold,
            },
            resample: self.resample,
            held: self.hold.iter().map(|name| name.trim().to_owned()).collect(),
            longest_gap: self.fill.unwrap_or(LONGEST_GAP),
            fill: self.fill,
            ..Preparation::default()
        }
    }

    /// The options that were given, by their names.
    pub fn kept(&self) -> BTreeMap<String, String> {
        let repeated = self.preparation().repeated().into_iter();
        repeated.map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// Whether columns are to hold their values, but nothing is resampled.
    pub fn holds_in_vain(&self) -> bool {
        !self.hold.is_empty() && self.resample.is_none()
    }

    /// Refuses a list that names a column twice.
    pub fn check(&self) -> Result<(), Usage> {
        let outliers = self.outliers.as_deref().map(arguments::columns);
        arguments::named_once("outliers", &outliers.unwrap_or_default())?;
        let held: Vec<&str> = self.hold.iter().map(|name| name.trim()).collect();
        arguments::named_once("hold", &held)
    }
}
