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
    /// Make outliers of these columns missing samples: A,B,... or all. An outlier is far away from its neighbours.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS")]
    outliers: Option<String>,
    /// How far an outlier is away from the median of its neighbours, in robust standard deviations.
    #[arg(long, help_heading = STEPS, value_name = "DEVIATIONS", default_value_t = Outliers::default().threshold, requires = "outliers", value_parser = arguments::positive)]
    threshold: f64,
    /// How many samples on either side are a sample's neighbours.
    #[arg(long, help_heading = STEPS, value_name = "N", default_value_t = Outliers::default().neighbours, requires = "outliers", value_parser = arguments::count_from_one)]
    neighbours: usize,
    /// Bring the record to a uniform sample time of DT s, also from instants that jitter. A longer sample time comes with a filter against aliases.
    #[arg(long, help_heading = STEPS, value_name = "DT", value_parser = arguments::positive)]
    pub resample: Option<f64>,
    /// These columns hold their value between samples, as commands do: A,B,... The others are taken as smooth.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS", value_delimiter = ',')]
    hold: Vec<String>,
    /// Interpolate gaps of at most N missing samples; by default 3 where something is resampled, else none.
    /// The output of a block model is never filled: its missing samples do not count. A joint's columns are all filled.
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
